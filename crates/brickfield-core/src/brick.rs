//! Bricks by name, and cuts through their octree.

use std::collections::HashSet;
use std::fmt;

use glam::UVec3;

use crate::BrickLayout;

/// A resolution level: 0 is the finest, each level up halves the resolution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Level(pub u8);

impl Level {
    /// Distance between this level's samples in voxels of level 0: 2^level.
    pub const fn stride(self) -> u32 {
        1 << self.0
    }

    /// Samples of this level that stand for `dims` of level 0 along x, y, z: ceil(dims / 2^level). A zero dimension counts as one.
    #[inline]
    pub fn dims_of(self, dims: UVec3) -> UVec3 {
        ((dims.max(UVec3::ONE) - 1) >> u32::from(self.0)) + 1
    }
}

/// One brick of an octree: its level and its place among the bricks of that level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub struct BrickId {
    pub level: Level,
    pub coords: UVec3,
}

impl BrickId {
    /// The brick one level coarser that contains this one.
    pub fn parent(self) -> BrickId {
        BrickId { level: Level(self.level.0 + 1), coords: self.coords / 2 }
    }

    /// The brick of level `level` (this one's or coarser) that contains this one.
    pub fn ancestor(self, level: Level) -> BrickId {
        let up = level.0.saturating_sub(self.level.0);
        BrickId { level: Level(self.level.0 + up), coords: self.coords >> u32::from(up) }
    }
}

impl fmt::Display for BrickId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "brick ({}, {}, {}) of level {}", self.coords.x, self.coords.y, self.coords.z, self.level.0)
    }
}

/// A set of bricks, of one or several levels, that tiles the volume exactly once.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    layout: BrickLayout,
    bricks: Vec<BrickId>,
}

/// Why bricks do not make a cut.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum CutError {
    #[error("{id} does not exist: the octree has {n_levels} levels")]
    NoSuchBrick { id: BrickId, n_levels: u8 },
    #[error("{id} is covered twice")]
    Overlap { id: BrickId },
    #[error("{id} is not covered")]
    Gap { id: BrickId },
}

impl Cut {
    /// A cut from its bricks, in any order.
    ///
    /// # Errors
    /// A brick that does not exist, is covered twice (also by an ancestor), or a part that is not covered.
    pub fn new(layout: BrickLayout, bricks: Vec<BrickId>) -> Result<Cut, CutError> {
        if let Some(&id) = bricks.iter().find(|id| !layout.contains(**id)) {
            return Err(CutError::NoSuchBrick { id, n_levels: layout.n_levels() });
        }
        let mut leaves = HashSet::with_capacity(bricks.len());
        if let Some(&id) = bricks.iter().find(|id| !leaves.insert(**id)) {
            return Err(CutError::Overlap { id });
        }
        let inner: HashSet<BrickId> = bricks.iter().flat_map(|id| ancestors(&layout, *id)).collect();
        if let Some(&id) = bricks.iter().find(|id| inner.contains(id)) {
            return Err(CutError::Overlap { id });
        }
        let covered = |id: &BrickId| leaves.contains(id) || inner.contains(id);
        if let Some(id) = inner.iter().flat_map(|id| layout.children(*id)).find(|id| !covered(id)) {
            return Err(CutError::Gap { id });
        }
        if !covered(&layout.root()) {
            return Err(CutError::Gap { id: layout.root() });
        }
        Ok(Cut { layout, bricks })
    }

    /// The cut through all bricks of one level.
    ///
    /// # Panics
    /// If the layout has no such level.
    pub fn uniform(layout: BrickLayout, level: Level) -> Cut {
        assert!(level.0 < layout.n_levels(), "level {} of an octree of {} levels", level.0, layout.n_levels());
        Cut { layout, bricks: layout.bricks(level).collect() }
    }

    /// The cut that a depth-first descent from the root makes: a cut by construction, so nothing is left to check.
    ///
    /// `visit` sees a brick and the state that its parent handed down; it returns the state for the children, or `None` to
    /// take the brick itself. A brick of level 0 is taken whatever `visit` returns. The cut holds the bricks in the
    /// order in which they are taken.
    pub fn descend<S: Copy>(layout: BrickLayout, state: S, mut visit: impl FnMut(BrickId, S) -> Option<S>) -> Cut {
        let mut bricks = Vec::new();
        // The root is treated as the only child of a parent that does not exist.
        take_children(&layout, layout.root().parent(), state, &mut visit, &mut bricks);
        Cut { layout, bricks }
    }

    /// The octree's geometry.
    pub fn layout(&self) -> &BrickLayout {
        &self.layout
    }

    /// The bricks, each exactly once, in no particular order.
    pub fn bricks(&self) -> &[BrickId] {
        &self.bricks
    }

    /// Number of bricks per level, finest first.
    pub fn n_bricks_per_level(&self) -> Vec<usize> {
        let mut n = vec![0; usize::from(self.layout.n_levels())];
        for id in &self.bricks {
            n[usize::from(id.level.0)] += 1;
        }
        n
    }
}

/// Takes the children of a brick, or theirs.
fn take_children<S: Copy>(
    layout: &BrickLayout,
    parent: BrickId,
    state: S,
    visit: &mut impl FnMut(BrickId, S) -> Option<S>,
    bricks: &mut Vec<BrickId>,
) {
    for id in layout.children(parent) {
        match visit(id, state) {
            Some(state) if id.level.0 > 0 => take_children(layout, id, state, visit, bricks),
            _ => bricks.push(id),
        }
    }
}

fn ancestors(layout: &BrickLayout, id: BrickId) -> impl Iterator<Item = BrickId> + use<> {
    let top = layout.n_levels();
    std::iter::successors(Some(id), |id| Some(id.parent())).skip(1).take_while(move |id| id.level.0 < top)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BrickSide;

    fn layout() -> BrickLayout {
        BrickLayout::new(UVec3::new(46, 31, 16), BrickSide::S16)
    }

    #[test]
    fn uniform_cuts_are_cuts() {
        for level in (0..layout().n_levels()).map(Level) {
            let cut = Cut::uniform(layout(), level);
            assert!(Cut::new(layout(), cut.bricks().to_vec()).is_ok());
        }
    }

    #[test]
    fn a_descent_makes_a_cut_and_hands_state_down() {
        let cut = Cut::descend(layout(), 0, |id, depth| {
            assert_eq!(depth + id.level.0, layout().root().level.0);
            (id.coords.x > 0 || id.level == layout().root().level).then_some(depth + 1)
        });
        assert!(Cut::new(layout(), cut.bricks().to_vec()).is_ok());
        assert!(cut.n_bricks_per_level().iter().filter(|n| **n > 0).count() > 1);
    }

    #[test]
    fn gaps_overlaps_and_strangers_are_named() {
        let fine = Cut::uniform(layout(), Level(0)).bricks().to_vec();
        let error = |bricks: Vec<BrickId>| Cut::new(layout(), bricks).unwrap_err();
        assert!(matches!(error(fine[1..].to_vec()), CutError::Gap { .. }));
        assert!(matches!(error([&fine[..], &fine[..1]].concat()), CutError::Overlap { .. }));
        assert!(matches!(error([&fine[..], &[layout().root()]].concat()), CutError::Overlap { .. }));
        assert!(matches!(error(vec![layout().root().parent()]), CutError::NoSuchBrick { .. }));
        assert!(matches!(error(vec![]), CutError::Gap { .. }));
    }
}
