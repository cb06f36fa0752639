//! Which zones are drawn.

mod budget;
mod size;

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

pub use budget::BudgetSelector;
pub use size::{GranularityError, SizeSelector};

use crate::{QuadLayout, QuadTree, Zone};

/// What a selection says of a zone (Wynn et al. 1999, section 2.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Label {
    /// It is drawn, as one quadrilateral.
    Leaf,
    /// Zones below it are looked at.
    Branch,
    /// It is outside of the view or has nothing to draw, and so has everything below it.
    Out,
}

/// Labels of zones: of the root, and of all children of branches.
#[derive(Clone, Debug)]
pub struct Selection {
    layout: QuadLayout,
    entries: ZoneMap<Zone, Entry>,
    n_leaves: usize,
}

/// How much work an update of a selection was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[allow(missing_docs)]
pub struct SelectionWork {
    /// Zones whose box was held against the view.
    pub n_visited: usize,
    /// Zones that were divided.
    pub n_split: usize,
    /// Zones whose children were taken back.
    pub n_merged: usize,
}

/// Why leaves are no selection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum SelectionError {
    #[error("{zone} is not in a grid of {n_rows} x {n_columns} zones")]
    Outside { zone: Zone, n_rows: u32, n_columns: u32 },
    #[error("{zone} is a leaf, and so is {other}, which overlaps it")]
    Overlap { zone: Zone, other: Zone },
    #[error("{zone} must not be drawn as one quadrilateral: it is not nice, or it has holes")]
    NotNice { zone: Zone },
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    label: Label,
    /// The odometer reading of the selector up to which nothing changes, here and below.
    expiry: f64,
}

impl Selection {
    /// A selection of zones that were chosen by other means; everything else is out.
    ///
    /// # Errors
    /// A zone that is not in the layout, overlaps another one, or must not be drawn coarse.
    pub fn of_leaves(tree: &QuadTree, leaves: impl IntoIterator<Item = Zone>) -> Result<Selection, SelectionError> {
        let layout = *tree.layout();
        let mut selection = Selection::empty(layout);
        for zone in leaves {
            if !layout.contains(zone) {
                let (n_rows, n_columns) = (layout.rows().n_final(), layout.columns().n_final());
                return Err(SelectionError::Outside { zone, n_rows, n_columns });
            }
            if !tree.summary(zone).is_nice() {
                return Err(SelectionError::NotNice { zone });
            }
            selection.add_leaf(zone)?;
        }
        selection.fill();
        Ok(selection)
    }

    /// The label of a zone; `None` below leaves and zones that are out.
    pub fn label(&self, zone: Zone) -> Option<Label> {
        self.entries.get(&zone).map(|entry| entry.label)
    }

    /// How many zones are drawn.
    pub fn n_leaves(&self) -> usize {
        self.n_leaves
    }

    /// The zones that are drawn, level by level from the finest, row by row.
    pub fn leaves(&self) -> Vec<Zone> {
        let is_leaf = |(zone, entry): (&Zone, &Entry)| (entry.label == Label::Leaf).then_some(*zone);
        let mut leaves: Vec<Zone> = self.entries.iter().filter_map(is_leaf).collect();
        leaves.sort_unstable();
        leaves
    }

    /// The zone that draws a final zone; `None` if it is out, or not in the grid.
    pub fn leaf_over(&self, row: u32, column: u32) -> Option<Zone> {
        if row >= self.layout.rows().n_final() || column >= self.layout.columns().n_final() {
            return None;
        }
        // Of all zones over a final zone, the finest one with a label is no branch.
        for level in self.layout.levels() {
            let zone = self.layout.ancestor(level, row, column);
            match self.label(zone) {
                Some(Label::Leaf) => return Some(zone),
                Some(Label::Branch | Label::Out) => return None,
                None => {}
            }
        }
        None
    }

    /// The greatest error of the zones that are drawn, in units of the values.
    pub fn greatest_error(&self, tree: &QuadTree) -> f32 {
        self.leaves().into_iter().map(|zone| tree.summary(zone).error).fold(0.0, f32::max)
    }

    /// The addresses of zones.
    pub fn layout(&self) -> &QuadLayout {
        &self.layout
    }

    fn empty(layout: QuadLayout) -> Selection {
        Selection { layout, entries: ZoneMap::default(), n_leaves: 0 }
    }

    fn set(&mut self, zone: Zone, label: Label, expiry: f64) {
        let before = self.entries.insert(zone, Entry { label, expiry });
        self.count(before.map(|entry| entry.label), Some(label));
    }

    fn remove(&mut self, zone: Zone) -> Option<Entry> {
        let removed = self.entries.remove(&zone);
        self.count(removed.map(|entry| entry.label), None);
        removed
    }

    fn count(&mut self, before: Option<Label>, after: Option<Label>) {
        self.n_leaves -= usize::from(before == Some(Label::Leaf));
        self.n_leaves += usize::from(after == Some(Label::Leaf));
    }

    fn add_leaf(&mut self, zone: Zone) -> Result<(), SelectionError> {
        if self.label(zone) == Some(Label::Branch) {
            let other = self.leaf_below(zone).unwrap_or(zone);
            return Err(SelectionError::Overlap { zone, other });
        }
        let mut above = self.layout.parent(zone);
        while let Some(ancestor) = above {
            if self.label(ancestor) == Some(Label::Leaf) {
                return Err(SelectionError::Overlap { zone, other: ancestor });
            }
            self.set(ancestor, Label::Branch, 0.0);
            above = self.layout.parent(ancestor);
        }
        self.set(zone, Label::Leaf, 0.0);
        Ok(())
    }

    fn leaf_below(&self, zone: Zone) -> Option<Zone> {
        match self.label(zone)? {
            Label::Leaf => Some(zone),
            Label::Out => None,
            Label::Branch => self.layout.children(zone).find_map(|child| self.leaf_below(child)),
        }
    }

    /// Labels the root and the children of branches that have no label yet.
    fn fill(&mut self) {
        let branches: Vec<Zone> =
            self.entries.iter().filter(|(_, e)| e.label == Label::Branch).map(|(zone, _)| *zone).collect();
        let children = branches.into_iter().flat_map(|zone| self.layout.children(zone));
        let unlabelled: Vec<Zone> =
            children.chain([self.layout.root()]).filter(|zone| self.label(*zone).is_none()).collect();
        unlabelled.into_iter().for_each(|zone| self.set(zone, Label::Out, 0.0));
    }
}

/// Equal if they label the same zones alike.
impl PartialEq for Selection {
    fn eq(&self, other: &Selection) -> bool {
        self.layout == other.layout
            && self.entries.len() == other.entries.len()
            && self.entries.iter().all(|(zone, entry)| other.label(*zone) == Some(entry.label))
    }
}

/// A map from zones or nodes, with a short hash that is the same in every run.
pub(crate) type ZoneMap<K, V> = HashMap<K, V, BuildHasherDefault<ZoneHasher>>;

/// The hash of a [`ZoneMap`].
#[derive(Default)]
pub(crate) struct ZoneHasher(u64);

impl Hasher for ZoneHasher {
    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 32
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.write_u32(u32::from(*byte)));
    }

    fn write_u8(&mut self, i: u8) {
        self.write_u32(u32::from(i));
    }

    fn write_usize(&mut self, i: usize) {
        self.write_u32(i as u32);
    }

    fn write_u32(&mut self, i: u32) {
        self.0 = (self.0.rotate_left(29) ^ u64::from(i)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
}
