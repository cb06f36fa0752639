//! The least error under a polygon budget (Wynn et al. 1999, section 2.4).

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::{Label, Selection, SelectionWork, ZoneMap};
use crate::{QuadTree, View, Zone, ZoneSummary};
use brickfield_core::Level;

/// Divides the zone with the greatest error again and again, until the next division would exceed a number of zones.
///
/// The order of divisions is fixed for a tree. A zone cannot be divided before the zones above it, so its *rank* is the least error on
/// the way to it from the root; the greatest rank comes first, then the coarsest zone, then the first row and column. The selection is the
/// longest beginning of that order, left to visible zones, that fits the budget. So it does not depend on the views and budgets before,
/// and an update has to divide and to merge only where two such beginnings differ.
///
/// Zones that are not nice are divided together with the zone above them, whatever the budget. So a selection may exceed the budget, but
/// only if it divides nothing else.
#[derive(Clone, Debug)]
pub struct BudgetSelector {
    tree: Arc<QuadTree>,
    view: Option<View>,
    odometer: f64,
    selection: Selection,
    ranks: ZoneMap<Zone, Rank>,
    /// Leaves that may be divided.
    candidates: BTreeSet<Turn>,
    /// Zones that are divided for their error, with the number of zones that they add.
    divided: BTreeMap<Turn, u64>,
    /// An upper bound of the zones that are drawn: those below the root, and those that divisions add.
    n_zones: u64,
    work: SelectionWork,
}

/// What is known of a zone with a label.
#[derive(Clone, Copy, Debug)]
struct Rank {
    /// The least error of the zone and the zones above it.
    error: f32,
    /// Whether it may be drawn coarse; if not, it is a branch, or out.
    is_nice: bool,
    /// Of a branch: how many zones stand below it if all nice ones are leaves.
    n_below: u64,
}

/// When a zone is divided: the least turn comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Turn {
    /// Falls with the rank's error, which is not negative, so that its bits are ordered as it is.
    error_bits: std::cmp::Reverse<u32>,
    level: std::cmp::Reverse<Level>,
    row: u32,
    column: u32,
}

impl Turn {
    fn new(zone: Zone, error: f32) -> Turn {
        let Zone { level, row, column } = zone;
        Turn { error_bits: std::cmp::Reverse(error.to_bits()), level: std::cmp::Reverse(level), row, column }
    }

    fn zone(&self) -> Zone {
        Zone { level: self.level.0, row: self.row, column: self.column }
    }
}

impl BudgetSelector {
    /// A selector that has selected nothing yet.
    pub fn new(tree: Arc<QuadTree>) -> BudgetSelector {
        let selection = Selection::empty(*tree.layout());
        BudgetSelector {
            tree,
            view: None,
            odometer: 0.0,
            selection,
            ranks: ZoneMap::default(),
            candidates: BTreeSet::new(),
            divided: BTreeMap::new(),
            n_zones: 0,
            work: SelectionWork::default(),
        }
    }

    /// Selects for a view at most `budget` zones. The result is the same whatever views and budgets came before.
    pub fn update(&mut self, view: &View, budget: usize) -> SelectionWork {
        self.work = SelectionWork::default();
        self.look(view);
        self.divide(view, budget as u64);
        self.work
    }

    /// The last selection; empty before the first view.
    pub fn selection(&self) -> &Selection {
        &self.selection
    }

    /// Brings the labels up to date with what the view sees, without divisions for errors.
    fn look(&mut self, view: &View) {
        let root = self.tree.layout().root();
        let extent = self.tree.extent(root);
        self.odometer += self.view.map_or(f64::INFINITY, |last| view.motion_from(&last, &extent));
        self.view = Some(*view);
        if self.odometer.is_infinite() {
            *self = BudgetSelector { view: self.view, work: self.work, ..BudgetSelector::new(self.tree.clone()) };
            self.place(root, f32::INFINITY, view);
        } else {
            self.n_zones -= self.n_below_root();
            self.refresh(root, f32::INFINITY, view);
        }
        self.n_zones += self.n_below_root();
    }

    /// Divides and merges until the divided zones are the longest beginning of the order that fits.
    fn divide(&mut self, view: &View, budget: u64) {
        loop {
            let last = self.divided.last_key_value().map(|(turn, _)| *turn);
            if let Some(last) = last.filter(|_| self.n_zones > budget) {
                self.merge(last.zone(), view);
                continue;
            }
            let Some(next) = self.candidates.first().copied() else { return };
            self.split(next.zone(), view);
            let is_among_divided = last.is_some_and(|last| next < last);
            if !is_among_divided && self.n_zones > budget {
                self.merge(next.zone(), view);
                return;
            }
        }
    }

    fn n_below_root(&self) -> u64 {
        self.counted(self.tree.layout().root()).max(1)
    }

    /// How many zones a zone stands for where all nice ones are leaves.
    fn counted(&self, zone: Zone) -> u64 {
        match (self.selection.label(zone), self.ranks.get(&zone)) {
            (Some(Label::Branch), Some(rank)) if !rank.is_nice => rank.n_below,
            (Some(Label::Leaf | Label::Branch), _) => 1,
            _ => 0,
        }
    }

    /// Labels a zone that has no label.
    fn place(&mut self, zone: Zone, error_above: f32, view: &View) {
        let summary = self.tree.summary(zone);
        let (is_visible, slack) = self.visibility(zone, &summary, view);
        let expiry = self.odometer + slack;
        if !is_visible {
            self.selection.set(zone, Label::Out, expiry);
            return;
        }
        let rank = Rank { error: error_above.min(summary.error), is_nice: summary.is_nice(), n_below: 0 };
        self.ranks.insert(zone, rank);
        if rank.is_nice {
            self.selection.set(zone, Label::Leaf, expiry);
            self.propose(zone, rank.error);
        } else {
            self.branch(zone, rank, expiry, view);
        }
    }

    /// A leaf without error is never divided.
    fn propose(&mut self, zone: Zone, error: f32) {
        if zone.level > Level(0) && error > 0.0 {
            self.candidates.insert(Turn::new(zone, error));
        }
    }

    /// Makes a branch of a zone and places its children.
    fn branch(&mut self, zone: Zone, rank: Rank, expiry: f64, view: &View) {
        for child in self.tree.layout().children(zone) {
            self.place(child, rank.error, view);
        }
        self.close(zone, rank, expiry);
    }

    /// Labels a branch after its children, and returns how many zones stand below it.
    fn close(&mut self, zone: Zone, rank: Rank, expiry: f64) -> u64 {
        let (mut n_below, mut least) = (0, expiry);
        for child in self.tree.layout().children(zone) {
            n_below += self.counted(child);
            least = least.min(self.selection.entries[&child].expiry);
        }
        self.selection.set(zone, Label::Branch, least);
        self.ranks.insert(zone, Rank { n_below, ..rank });
        n_below
    }

    fn split(&mut self, zone: Zone, view: &View) {
        self.work.n_split += 1;
        let (rank, expiry) = (self.ranks[&zone], self.selection.entries[&zone].expiry);
        let turn = Turn::new(zone, rank.error);
        self.candidates.remove(&turn);
        self.branch(zone, rank, expiry, view);
        let added = self.ranks[&zone].n_below.max(1) - 1;
        self.divided.insert(turn, added);
        self.n_zones += added;
        self.limit_above(zone);
    }

    fn merge(&mut self, zone: Zone, view: &View) {
        self.work.n_merged += 1;
        self.remove_below(zone);
        self.forget_division(zone);
        let (_, slack) = self.visibility(zone, &self.tree.summary(zone), view);
        self.selection.set(zone, Label::Leaf, self.odometer + slack);
        self.propose(zone, self.ranks[&zone].error);
    }

    /// No zone outlasts those below it.
    fn limit_above(&mut self, zone: Zone) {
        let expiry = self.selection.entries[&zone].expiry;
        let mut above = self.tree.layout().parent(zone);
        while let Some(ancestor) = above {
            match self.selection.entries.get_mut(&ancestor) {
                Some(entry) if entry.expiry > expiry => entry.expiry = expiry,
                _ => return,
            }
            above = self.tree.layout().parent(ancestor);
        }
    }

    /// Looks again at the zones whose visibility may have changed.
    fn refresh(&mut self, zone: Zone, error_above: f32, view: &View) {
        let entry = self.selection.entries[&zone];
        if entry.expiry > self.odometer {
            return;
        }
        if entry.label == Label::Out {
            self.selection.remove(zone);
            return self.place(zone, error_above, view);
        }
        let (is_visible, slack) = self.visibility(zone, &self.tree.summary(zone), view);
        let expiry = self.odometer + slack;
        if !is_visible {
            self.remove_below(zone);
            self.forget(zone);
            self.selection.set(zone, Label::Out, expiry);
        } else if entry.label == Label::Leaf {
            self.selection.set(zone, Label::Leaf, expiry);
        } else {
            let rank = self.ranks[&zone];
            for child in self.tree.layout().children(zone) {
                self.refresh(child, rank.error, view);
            }
            let n_below = self.close(zone, rank, expiry);
            if let Some(added) = self.divided.get_mut(&Turn::new(zone, rank.error)).filter(|_| rank.is_nice) {
                self.n_zones -= *added;
                *added = n_below.max(1) - 1;
                self.n_zones += *added;
            }
        }
    }

    fn remove_below(&mut self, zone: Zone) {
        for child in self.tree.layout().children(zone) {
            let Some(entry) = self.selection.remove(child) else { continue };
            if entry.label == Label::Branch {
                self.remove_below(child);
            }
            self.forget(child);
        }
    }

    fn forget(&mut self, zone: Zone) {
        if let Some(rank) = self.ranks.get(&zone).copied() {
            self.candidates.remove(&Turn::new(zone, rank.error));
            self.forget_division(zone);
            self.ranks.remove(&zone);
        }
    }

    fn forget_division(&mut self, zone: Zone) {
        let turn = Turn::new(zone, self.ranks[&zone].error);
        self.n_zones -= self.divided.remove(&turn).unwrap_or(0);
    }

    fn visibility(&mut self, zone: Zone, summary: &ZoneSummary, view: &View) -> (bool, f64) {
        self.work.n_visited += 1;
        if summary.is_void() {
            return (false, f64::INFINITY);
        }
        let seen = view.seen(&self.tree.extent_by(zone, summary));
        (seen.is_visible, seen.slack)
    }
}
