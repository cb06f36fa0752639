//! Which bricks contribute where a segment may end in a brick beside them.

use brickfield_core::glam::UVec3;
use brickfield_core::{BrickId, BrickLayout, Level};

/// Which bricks of a cut contribute, on the grid of level-0 bricks.
pub(crate) struct Visibility {
    layout: BrickLayout,
    cells: Vec<bool>,
}

impl Visibility {
    /// The visible bricks of a cut (all others are transparent), and their neighbours within `reach` bricks of level 0 (rules whose
    /// segments span two nodes need the data at both).
    pub(crate) fn around(layout: BrickLayout, visible: impl Iterator<Item = BrickId>, reach: u32) -> Visibility {
        let mut visibility = Visibility { layout, cells: vec![false; layout.n_bricks_total(Level(0))] };
        for id in visible {
            let (low, high) = visibility.block(id);
            visibility.mark(low.saturating_sub(UVec3::splat(reach)), high.saturating_add(UVec3::splat(reach)));
        }
        visibility
    }

    /// Whether any part of the brick contributes.
    pub(crate) fn needs(&self, id: BrickId) -> bool {
        let (low, high) = self.block(id);
        (low.z..high.z).any(|z| (low.y..high.y).any(|y| self.cells[self.row(low.x, high.x, y, z)].contains(&true)))
    }

    fn mark(&mut self, low: UVec3, high: UVec3) {
        let high = high.min(self.layout.n_bricks(Level(0)));
        for z in low.z..high.z {
            for y in low.y..high.y {
                let row = self.row(low.x, high.x, y, z);
                self.cells[row].fill(true);
            }
        }
    }

    /// The level-0 cells that a brick covers.
    fn block(&self, id: BrickId) -> (UVec3, UVec3) {
        let low = id.coords << u32::from(id.level.0);
        (low, (low + id.level.stride()).min(self.layout.n_bricks(Level(0))))
    }

    fn row(&self, x0: u32, x1: u32, y: u32, z: u32) -> std::ops::Range<usize> {
        let at = |x| self.layout.ordinal(BrickId { level: Level(0), coords: UVec3::new(x, y, z) });
        let start = at(x0);
        start..start + (x1 - x0) as usize
    }
}
