//! The hierarchy of a volume: its cells, values, and a summary of every coarser zone.

use brickfield_core::glam::UVec3;
use brickfield_core::{Aabb, Level};
use rayon::prelude::*;

use crate::{ByteAccount, CurvilinearVolume, OctLayout, OctSummary, OctZone, examine_cells};

/// A curvilinear volume with values at its nodes, and all levels above it: the octree that Wynn et al. 1999 leave to future work.
///
/// Each level from 1 on is one array of summaries, as in [`QuadTree`](crate::QuadTree). Zones of level 0 are the cells; their summaries are made
/// when they are asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct OctTree {
    volume: CurvilinearVolume,
    values: Vec<f32>,
    /// Level 1 first.
    levels: Vec<Vec<OctSummary>>,
}

/// Why there is no octree.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum OctTreeError {
    #[error("{n_values} values for {n_nodes} nodes")]
    Count { n_values: usize, n_nodes: usize },
    #[error("node ({}, {}, {}) has the value {value}; it must be finite, or NaN for a hole", node.x, node.y, node.z)]
    Value { node: UVec3, value: f32 },
}

impl OctTree {
    /// The hierarchy over a volume, of one value for each node; NaN is a hole. Every node is looked at once for every level, by rayon's current
    /// thread pool.
    ///
    /// # Errors
    /// Not one value for each node; an infinite value.
    pub fn build(volume: CurvilinearVolume, values: Vec<f32>) -> Result<OctTree, OctTreeError> {
        let (n_values, n_nodes) = (values.len(), volume.positions().len());
        if n_values != n_nodes {
            return Err(OctTreeError::Count { n_values, n_nodes });
        }
        if let Some(i) = values.iter().position(|value| value.is_infinite()) {
            return Err(OctTreeError::Value { node: volume.node(i), value: values[i] });
        }
        let above = volume.layout().levels().skip(1);
        let levels = above.map(|level| build_level(&volume, &values, level)).collect();
        Ok(OctTree { volume, values, levels })
    }

    /// The cells below.
    pub fn volume(&self) -> &CurvilinearVolume {
        &self.volume
    }

    /// The value of each node, x varying fastest; NaN for a hole.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The addresses of zones.
    pub fn layout(&self) -> &OctLayout {
        self.volume.layout()
    }

    /// The array of a level, in the order of [`OctLayout::address`]; empty for level 0.
    pub fn summaries(&self, level: Level) -> &[OctSummary] {
        level.0.checked_sub(1).map_or(&[], |i| &self.levels[usize::from(i)])
    }

    /// The summary of a zone.
    ///
    /// # Panics
    /// If the layout does not contain the zone, as [`extent`](Self::extent) does.
    pub fn summary(&self, zone: OctZone) -> OctSummary {
        match zone.level {
            Level(0) => examine_cells(&self.volume, &self.values, &self.layout().descendants(zone)),
            level => self.summaries(level)[self.layout().address(zone)],
        }
    }

    /// A closed box around all nodes of a zone that are no holes.
    pub fn extent(&self, zone: OctZone) -> Aabb {
        let cells = self.layout().descendants(zone);
        let corner = |i: u32| cells.first + cells.n * UVec3::new(i & 1, i >> 1 & 1, i >> 2);
        let around = Aabb::of_points((0..8).map(|i| self.volume.positions()[self.volume.number(corner(i))]));
        let extension = self.summary(zone).extension.as_dvec3();
        Aabb { min: around.min - extension, max: around.max + extension }
    }

    /// How much memory the hierarchy takes.
    pub fn byte_account(&self) -> ByteAccount {
        let n_stored_zones = self.levels.iter().map(Vec::len).sum();
        let bytes_per_zone = size_of::<OctSummary>();
        ByteAccount {
            n_stored_zones,
            bytes_per_zone,
            hierarchy_bytes: n_stored_zones * bytes_per_zone,
            data_bytes: size_of_val(self.volume.positions()) + size_of_val(self.values.as_slice()),
        }
    }
}

fn build_level(volume: &CurvilinearVolume, values: &[f32], level: Level) -> Vec<OctSummary> {
    let layout = volume.layout();
    let summary = |address| examine_cells(volume, values, &layout.descendants(layout.zone_at(level, address)));
    (0..layout.n_zones(level)).into_par_iter().map(summary).collect()
}
