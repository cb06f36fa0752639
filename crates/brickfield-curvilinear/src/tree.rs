//! The hierarchy: a grid, and a summary of every coarse zone over it.

use brickfield_core::{Aabb, Level};
use rayon::prelude::*;

use crate::chart::Quad;
use crate::{CurvilinearGrid, QuadLayout, Zone, ZoneSummary, examine};

/// A curvilinear grid with all its levels (Wynn et al. 1999, sections 2 and 2.1).
///
/// Each level from [`FIRST_STORED`](Self::FIRST_STORED) on is one array of summaries. Three quarters of all coarse zones are of level 1 and have
/// nine nodes: their summaries are made when they are asked for, as those of final zones.
#[derive(Clone, Debug, PartialEq)]
pub struct QuadTree {
    grid: CurvilinearGrid,
    /// The first stored level first.
    levels: Vec<Vec<ZoneSummary>>,
}

/// Bytes of a hierarchy beside those of its data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct ByteAccount {
    /// Zones from [`QuadTree::FIRST_STORED`] on.
    pub n_stored_zones: usize,
    pub bytes_per_zone: usize,
    pub hierarchy_bytes: usize,
    /// Positions and values of the grid.
    pub data_bytes: usize,
}

impl QuadTree {
    /// The finest level with stored summaries.
    pub const FIRST_STORED: Level = Level(2);

    /// The hierarchy over a grid. Every node is looked at once for every stored level, by rayon's current thread pool.
    pub fn build(grid: CurvilinearGrid) -> QuadTree {
        let stored = grid.layout().levels().skip(QuadTree::FIRST_STORED.0.into());
        let levels = stored.map(|level| build_level(&grid, level)).collect();
        QuadTree { grid, levels }
    }

    /// The grid below.
    pub fn grid(&self) -> &CurvilinearGrid {
        &self.grid
    }

    /// The addresses of zones.
    pub fn layout(&self) -> &QuadLayout {
        self.grid.layout()
    }

    /// The array of a stored level, in the order of [`QuadLayout::address`]; empty for the levels below.
    pub fn summaries(&self, level: Level) -> &[ZoneSummary] {
        level.0.checked_sub(QuadTree::FIRST_STORED.0).map_or(&[], |i| &self.levels[usize::from(i)])
    }

    /// The summary of a zone.
    ///
    /// # Panics
    /// If the layout does not contain the zone, as [`extent`](Self::extent) does.
    #[inline]
    pub fn summary(&self, zone: Zone) -> ZoneSummary {
        if zone.level >= QuadTree::FIRST_STORED {
            return self.summaries(zone.level)[self.layout().address(zone)];
        }
        let range = self.layout().descendants(zone);
        if zone.level == Level(0) { ZoneSummary::of_final(&self.grid, &range) } else { examine(&self.grid, &range).0 }
    }

    /// A closed box around all nodes of a zone that are no holes.
    pub fn extent(&self, zone: Zone) -> Aabb {
        self.extent_by(zone, &self.summary(zone))
    }

    /// The same, of a zone whose summary is known.
    pub(crate) fn extent_by(&self, zone: Zone, summary: &ZoneSummary) -> Aabb {
        let around = Aabb::of_points(Quad::of(&self.grid, &self.layout().descendants(zone)).positions);
        let extension = summary.extension.as_dvec3();
        Aabb { min: around.min - extension, max: around.max + extension }
    }

    /// How much memory the hierarchy takes.
    pub fn byte_account(&self) -> ByteAccount {
        let n_stored_zones = self.levels.iter().map(Vec::len).sum();
        let bytes_per_zone = size_of::<ZoneSummary>();
        ByteAccount {
            n_stored_zones,
            bytes_per_zone,
            hierarchy_bytes: n_stored_zones * bytes_per_zone,
            data_bytes: self.grid.n_bytes(),
        }
    }
}

impl ByteAccount {
    /// Bytes of the hierarchy for each byte of the data.
    pub fn ratio(&self) -> f64 {
        self.hierarchy_bytes as f64 / self.data_bytes as f64
    }
}

fn build_level(grid: &CurvilinearGrid, level: Level) -> Vec<ZoneSummary> {
    let layout = grid.layout();
    let summary = |address: usize| examine(grid, &layout.descendants(layout.zone_at(level, address))).0;
    (0..layout.n_zones(level)).into_par_iter().map(summary).collect()
}
