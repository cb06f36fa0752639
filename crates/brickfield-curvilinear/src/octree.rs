//! The addresses of zones of 3-D curvilinear grids: an octree without pointers, as the quadtree of [`QuadLayout`](crate::QuadLayout).

use std::fmt;

use brickfield_core::Level;
use brickfield_core::glam::UVec3;

use crate::SplitAxis;

/// A zone of an octree: the part of the grid in one cell of a level. Level 0 has the cells of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub struct OctZone {
    pub level: Level,
    pub coords: UVec3,
}

/// Cells of the grid: `n` along each axis, from the cell `first`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub struct CellBox {
    pub first: UVec3,
    pub n: UVec3,
}

/// The levels of an octree over any number of cells along x, y and z, without pointers: the extension of Wynn et al. 1999 to three
/// dimensions, which the paper leaves to future work.
///
/// From the root down, longer axes are split first and shorter ones as late as possible. A zone has two to 27 children.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OctLayout {
    axes: [SplitAxis; 3],
}

/// Why there is no layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum OctLayoutError {
    #[error("a grid of {} x {} x {} cells; each axis needs at least 1", n.x, n.y, n.z)]
    Empty { n: UVec3 },
    #[error("a grid of {} x {} x {} cells; at most {} are possible", n.x, n.y, n.z, OctLayout::MAX_CELLS)]
    Large { n: UVec3 },
}

impl OctLayout {
    /// The most cells of a grid.
    pub const MAX_CELLS: u64 = 1 << 62;

    /// The layout of a grid of so many cells.
    ///
    /// # Errors
    /// An axis without cells, or more than [`MAX_CELLS`](Self::MAX_CELLS) in all.
    pub fn new(n: UVec3) -> Result<OctLayout, OctLayoutError> {
        if n.min_element() == 0 {
            return Err(OctLayoutError::Empty { n });
        }
        let n_cells = n.to_array().iter().map(|n| u128::from(*n)).product::<u128>();
        if n_cells > u128::from(OctLayout::MAX_CELLS) || n.max_element() == u32::MAX {
            return Err(OctLayoutError::Large { n });
        }
        Ok(OctLayout { axes: n.to_array().map(SplitAxis::new) })
    }

    /// How x, y and z are split.
    pub fn axes(&self) -> &[SplitAxis; 3] {
        &self.axes
    }

    /// The level of the root, which is one zone.
    pub fn top(&self) -> Level {
        Level(self.axes.iter().map(SplitAxis::n_splits).max().unwrap_or(0))
    }

    /// The zone that holds the whole grid.
    pub fn root(&self) -> OctZone {
        OctZone { level: self.top(), coords: UVec3::ZERO }
    }

    /// All levels from the finest to the root.
    pub fn levels(&self) -> impl DoubleEndedIterator<Item = Level> + use<> {
        (0..=self.top().0).map(Level)
    }

    /// Zones along x, y and z at a level.
    #[inline]
    pub fn n(&self, level: Level) -> UVec3 {
        UVec3::from(self.axes.map(|axis| axis.n(level)))
    }

    /// How many zones a level has.
    pub fn n_zones(&self, level: Level) -> usize {
        self.n(level).to_array().iter().map(|n| *n as usize).product()
    }

    /// Whether this is a zone of the grid.
    pub fn contains(&self, zone: OctZone) -> bool {
        zone.level <= self.top() && zone.coords.cmplt(self.n(zone.level)).all()
    }

    /// A zone's place in the array of its level; x varies fastest.
    #[inline]
    pub fn address(&self, zone: OctZone) -> usize {
        let (n, c) = (self.n(zone.level), zone.coords);
        c.x as usize + n.x as usize * (c.y as usize + n.y as usize * c.z as usize)
    }

    /// The zone at a place in the array of a level; the inverse of [`address`](Self::address).
    pub fn zone_at(&self, level: Level, address: usize) -> OctZone {
        let [nx, ny, _] = self.n(level).to_array().map(|n| n as usize);
        let coords = UVec3::new((address % nx) as u32, (address / nx % ny) as u32, (address / nx / ny) as u32);
        OctZone { level, coords }
    }

    /// The zone of the next coarser level in which a zone lies; `None` for the root.
    pub fn parent(&self, zone: OctZone) -> Option<OctZone> {
        let along = |axis: usize| self.axes[axis].parent(zone.level, zone.coords[axis]);
        (zone.level < self.top())
            .then(|| OctZone { level: Level(zone.level.0 + 1), coords: UVec3::from([0, 1, 2].map(along)) })
    }

    /// The zones of the next finer level that lie in a zone, x varying fastest; none of a cell.
    pub fn children(&self, zone: OctZone) -> impl Iterator<Item = OctZone> + use<> {
        let [x, y, z] = [0, 1, 2].map(|axis| self.axes[axis].children(zone.level, zone.coords[axis]));
        let level = Level(zone.level.0.wrapping_sub(1));
        z.flat_map(move |z| {
            let x = x.clone();
            y.clone().flat_map(move |y| x.clone().map(move |x| OctZone { level, coords: UVec3::new(x, y, z) }))
        })
    }

    /// The cells that lie in a zone, in constant time.
    #[inline]
    pub fn descendants(&self, zone: OctZone) -> CellBox {
        let ranges = [0, 1, 2].map(|axis| self.axes[axis].descendants(zone.level, zone.coords[axis]));
        let first = UVec3::from(ranges.clone().map(|range| range.start));
        CellBox { first, n: UVec3::from(ranges.map(|range| range.end)) - first }
    }

    /// The zone of `level` in which a cell lies, in constant time.
    #[inline]
    pub fn ancestor(&self, level: Level, cell: UVec3) -> OctZone {
        let along = |axis: usize| self.axes[axis].ancestor(level, cell[axis]);
        OctZone { level, coords: UVec3::from([0, 1, 2].map(along)) }
    }
}

impl fmt::Display for OctZone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let c = self.coords;
        write!(f, "zone ({}, {}, {}) of level {}", c.x, c.y, c.z, self.level.0)
    }
}
