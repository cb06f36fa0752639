//! Curvilinear volumes: hexahedral cells between nodes with positions.

use brickfield_core::glam::{DMat3, DVec3, UVec3};

use crate::{OctLayout, OctLayoutError};

/// A structured grid of hexahedral cells: one node more than cells along each axis, x varying fastest.
///
/// Inside a cell, local coordinates from 0 to 1 along each axis map to positions by trilinear interpolation of the eight corners.
#[derive(Clone, Debug, PartialEq)]
pub struct CurvilinearVolume {
    layout: OctLayout,
    positions: Vec<DVec3>,
}

/// Why there is no volume.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum CurvilinearVolumeError {
    #[error(transparent)]
    Layout(#[from] OctLayoutError),
    #[error("{n_positions} positions; {} x {} x {} cells have {n_nodes} nodes", n.x, n.y, n.z)]
    Count { n_positions: usize, n: UVec3, n_nodes: u64 },
    #[error("node ({}, {}, {}) lies at {position}; it must be finite", node.x, node.y, node.z)]
    Position { node: UVec3, position: DVec3 },
}

/// A cell's map from local coordinates to positions, as a polynomial.
pub(crate) struct CellMap {
    /// Of 1, x, y, z, xy, xz, yz, xyz.
    terms: [DVec3; 8],
}

impl CurvilinearVolume {
    /// A volume of `n` cells along x, y and z.
    ///
    /// # Errors
    /// No cells; not one position for each node; a position that is not finite.
    pub fn new(n: UVec3, positions: Vec<DVec3>) -> Result<CurvilinearVolume, CurvilinearVolumeError> {
        let layout = OctLayout::new(n)?;
        let n_nodes = n.to_array().iter().map(|n| u64::from(*n) + 1).product();
        if positions.len() as u64 != n_nodes {
            return Err(CurvilinearVolumeError::Count { n_positions: positions.len(), n, n_nodes });
        }
        let volume = CurvilinearVolume { layout, positions };
        match volume.positions.iter().position(|p| !p.is_finite()) {
            Some(i) => Err(CurvilinearVolumeError::Position { node: volume.node(i), position: volume.positions[i] }),
            None => Ok(volume),
        }
    }

    /// The levels of zones over the cells.
    pub fn layout(&self) -> &OctLayout {
        &self.layout
    }

    /// Cells along x, y and z.
    pub fn n_cells(&self) -> UVec3 {
        UVec3::from(self.layout.axes().map(|axis| axis.n_final()))
    }

    /// The positions of all nodes, x varying fastest.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// The eight corners of a cell, x varying fastest.
    pub fn corners(&self, cell: UVec3) -> [DVec3; 8] {
        let [nx, ny, _] = self.n_cells().to_array().map(|n| n as usize + 1);
        let first = cell.x as usize + nx * (cell.y as usize + ny * cell.z as usize);
        std::array::from_fn(|i| self.positions[first + (i & 1) + nx * ((i >> 1 & 1) + ny * (i >> 2))])
    }

    /// The position of local coordinates in a cell.
    pub fn position(&self, cell: UVec3, local: DVec3) -> DVec3 {
        CellMap::new(&self.corners(cell)).position(local)
    }

    /// The local coordinates of a position in a cell, by Newton's method: `None` if it does not find them within 2^-36 of the
    /// cell's size. They may lie outside of 0 to 1.
    pub fn local(&self, cell: UVec3, position: DVec3) -> Option<DVec3> {
        let corners = self.corners(cell);
        let size = corners.iter().fold(0.0f64, |size, corner| size.max(corner.distance(corners[0])));
        let map = CellMap::new(&corners);
        let local = map.local(position, DVec3::splat(0.5));
        (map.position(local).distance(position) <= size * 2f64.powi(-36)).then_some(local)
    }

    /// The local coordinates of a position in a cell, limited to 0 to 1: [`CellSegment`](crate::CellSegment) has them at its ends.
    ///
    /// Of a position beside the cell, or where the map is singular, they are near ones.
    pub fn local_inside(&self, cell: UVec3, position: DVec3) -> DVec3 {
        CellMap::new(&self.corners(cell)).local_inside(position, DVec3::splat(0.5))
    }

    /// The number of a node.
    pub(crate) fn number(&self, node: UVec3) -> usize {
        let [nx, ny, _] = self.n_cells().to_array().map(|n| n as usize + 1);
        node.x as usize + nx * (node.y as usize + ny * node.z as usize)
    }

    pub(crate) fn node(&self, i: usize) -> UVec3 {
        let [nx, ny, _] = self.n_cells().to_array().map(|n| n as usize + 1);
        UVec3::new((i % nx) as u32, (i / nx % ny) as u32, (i / nx / ny) as u32)
    }
}

impl CellMap {
    pub(crate) fn new(p: &[DVec3; 8]) -> CellMap {
        let (x, y, z) = (p[1] - p[0], p[2] - p[0], p[4] - p[0]);
        let (xy, xz, yz) = (p[3] - p[1] - y, p[5] - p[1] - z, p[6] - p[2] - z);
        let xyz = p[7] - p[0] - x - y - z - xy - xz - yz;
        CellMap { terms: [p[0], x, y, z, xy, xz, yz, xyz] }
    }

    pub(crate) fn position(&self, local: DVec3) -> DVec3 {
        let [one, x, y, z, xy, xz, yz, xyz] = self.terms;
        let DVec3 { x: u, y: v, z: w } = local;
        one + (x + (xy + xyz * w) * v + xz * w) * u + (y + yz * w) * v + z * w
    }

    fn slopes(&self, local: DVec3) -> DMat3 {
        let [_, x, y, z, xy, xz, yz, xyz] = self.terms;
        let DVec3 { x: u, y: v, z: w } = local;
        DMat3::from_cols(
            x + xy * v + xz * w + xyz * (v * w),
            y + xy * u + yz * w + xyz * (u * w),
            z + xz * u + yz * v + xyz * (u * v),
        )
    }

    /// Newton's method, limited to the cell.
    pub(crate) fn local_inside(&self, position: DVec3, guess: DVec3) -> DVec3 {
        self.local(position, guess).clamp(DVec3::ZERO, DVec3::ONE)
    }

    /// Newton's method from a guess. Steps are halved until they come nearer; where the map is singular it ends at the nearest point that
    /// it found.
    pub(crate) fn local(&self, position: DVec3, guess: DVec3) -> DVec3 {
        let miss = |local: DVec3| position - self.position(local);
        let mut local = guess;
        let mut distance = miss(local).length_squared();
        for _ in 0..40 {
            let step = self.slopes(local).inverse() * miss(local);
            let halved = (0..6).map(|i| local + step * 0.5f64.powi(i));
            let Some((next, next_distance)) =
                halved.map(|next| (next, miss(next).length_squared())).find(|(_, d)| *d < distance)
            else {
                break;
            };
            (local, distance) = (next, next_distance);
            // The next step would be about the square of this one.
            if step.length_squared() < 1e-17 {
                break;
            }
        }
        local
    }
}
