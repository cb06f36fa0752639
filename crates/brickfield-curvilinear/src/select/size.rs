//! Zones of a minimal size in the picture (Wynn et al. 1999, section 2.3).

use std::sync::Arc;

use super::{Label, Selection, SelectionWork};
use crate::{QuadTree, View, Zone};
use brickfield_core::Level;

/// Selects the coarsest zones that are smaller than a number of pixels.
///
/// The size of a zone is its shorter diagonal, seen face on at the nearest depth of its box: never less than in the picture.
/// Zones that are not nice are divided whatever their size.
///
/// An update looks only at zones where the camera's motion may have changed something. Each zone keeps how far all points may move
/// relative to the camera before its label may change; the selector sums up the motions.
#[derive(Clone, Debug)]
pub struct SizeSelector {
    tree: Arc<QuadTree>,
    granularity: f64,
    view: Option<View>,
    odometer: f64,
    selection: Selection,
    work: SelectionWork,
}

/// Why there is no selector.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("a granularity of {granularity} pixels; it must be finite and above 0")]
#[allow(missing_docs)]
pub struct GranularityError {
    pub granularity: f64,
}

impl SizeSelector {
    /// `granularity` is the size in pixels of the smallest zone that is divided.
    ///
    /// # Errors
    /// A granularity that is not finite, or not above 0.
    pub fn new(tree: Arc<QuadTree>, granularity: f64) -> Result<SizeSelector, GranularityError> {
        if !(granularity.is_finite() && granularity > 0.0) {
            return Err(GranularityError { granularity });
        }
        let selection = Selection::empty(*tree.layout());
        Ok(SizeSelector { tree, granularity, view: None, odometer: 0.0, selection, work: SelectionWork::default() })
    }

    /// Selects for a view. The result is the same whatever views came before.
    pub fn update(&mut self, view: &View) -> SelectionWork {
        let root = self.tree.layout().root();
        let extent = self.tree.extent(root);
        self.odometer += self.view.map_or(f64::INFINITY, |last| view.motion_from(&last, &extent));
        if self.odometer.is_infinite() {
            self.odometer = 0.0;
            self.selection = Selection::empty(*self.tree.layout());
        }
        self.view = Some(*view);
        self.work = SelectionWork::default();
        self.visit(root, view);
        self.work
    }

    /// The last selection; empty before the first view.
    pub fn selection(&self) -> &Selection {
        &self.selection
    }

    /// Labels a zone and all below it, and returns the odometer reading up to which that holds.
    fn visit(&mut self, zone: Zone, view: &View) -> f64 {
        let before = self.selection.entries.get(&zone).copied();
        if let Some(entry) = before.filter(|entry| entry.expiry > self.odometer) {
            return entry.expiry;
        }
        self.work.n_visited += 1;
        let (label, slack) = decide(&self.tree, view, self.granularity, zone);
        let was_branch = before.is_some_and(|entry| entry.label == Label::Branch);
        if was_branch && label != Label::Branch {
            self.work.n_merged += 1;
            self.remove_below(zone);
        }
        let mut expiry = self.odometer + slack;
        if label == Label::Branch {
            self.work.n_split += usize::from(!was_branch);
            for child in self.tree.layout().children(zone) {
                expiry = expiry.min(self.visit(child, view));
            }
        }
        self.selection.set(zone, label, expiry);
        expiry
    }

    fn remove_below(&mut self, zone: Zone) {
        for child in self.tree.layout().children(zone) {
            if self.selection.remove(child).is_some_and(|entry| entry.label == Label::Branch) {
                self.remove_below(child);
            }
        }
    }
}

/// The label of a zone that is looked at, and the motion up to which it stays.
fn decide(tree: &QuadTree, view: &View, granularity: f64, zone: Zone) -> (Label, f64) {
    let summary = tree.summary(zone);
    if summary.is_void() {
        return (Label::Out, f64::INFINITY);
    }
    let extent = tree.extent_by(zone, &summary);
    let seen = view.seen(&extent);
    if !seen.is_visible {
        return (Label::Out, seen.slack);
    }
    if zone.level == Level(0) {
        return (Label::Leaf, seen.slack);
    }
    if !summary.is_nice() {
        return (Label::Branch, seen.slack);
    }
    let (size, nearest) = (f64::from(summary.size), view.nearest(&extent));
    let is_small = view.pixels(size, nearest) < granularity;
    let slack = view.depth_of(size, granularity).map_or(f64::INFINITY, |depth| (nearest - depth).abs());
    (if is_small { Label::Leaf } else { Label::Branch }, seen.slack.min(slack))
}
