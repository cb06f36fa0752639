//! The addresses of zones: parents, children, siblings and final descendants by arithmetic.

use std::fmt;
use std::ops::Range;

use brickfield_core::Level;

use crate::SplitAxis;

/// A zone of the hierarchy: the part of the grid in one cell of a level.
///
/// Level 0 has the final zones, the cells of the grid. (In Wynn et al. 1999 level 0 is the root.)
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)]
pub struct Zone {
    pub level: Level,
    pub row: u32,
    pub column: u32,
}

/// Final zones, or the nodes at their corners: rows and columns from a first one to before an end.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct ZoneRange {
    pub rows: Range<u32>,
    pub columns: Range<u32>,
}

/// The levels of a quadtree over m x n final zones, any m and n: an array of arrays without pointers (Wynn et al. 1999, sections 2.1
/// and 2.2).
///
/// From the root down, the axis with more splits is split first, and the other one as late as possible: coarse levels are then
/// small. The paper says so of rows; here the rule holds for columns, too, where they are the shorter axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QuadLayout {
    rows: SplitAxis,
    columns: SplitAxis,
}

/// Why there is no layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum LayoutError {
    #[error("{what} of 0 zones; each axis needs at least 1")]
    Empty { what: &'static str },
    #[error("{what} of {n} zones; at most {} are possible", QuadLayout::MAX_ZONES)]
    Long { what: &'static str, n: u32 },
}

impl QuadLayout {
    /// The most final zones along an axis: nodes are counted in 32 bits, too.
    pub const MAX_ZONES: u32 = u32::MAX - 1;

    /// The layout of a grid of so many final zones.
    ///
    /// # Errors
    /// An axis without zones, or with more than [`MAX_ZONES`](Self::MAX_ZONES).
    pub fn new(n_rows: u32, n_columns: u32) -> Result<QuadLayout, LayoutError> {
        for (what, n) in [("a grid's rows", n_rows), ("a grid's columns", n_columns)] {
            if n == 0 {
                return Err(LayoutError::Empty { what });
            }
            if n > QuadLayout::MAX_ZONES {
                return Err(LayoutError::Long { what, n });
            }
        }
        Ok(QuadLayout { rows: SplitAxis::new(n_rows), columns: SplitAxis::new(n_columns) })
    }

    /// How rows are split.
    pub fn rows(&self) -> &SplitAxis {
        &self.rows
    }

    /// How columns are split.
    pub fn columns(&self) -> &SplitAxis {
        &self.columns
    }

    /// The level of the root, which is one zone.
    pub fn top(&self) -> Level {
        Level(self.rows.n_splits().max(self.columns.n_splits()))
    }

    /// The zone that holds the whole grid.
    pub fn root(&self) -> Zone {
        Zone { level: self.top(), row: 0, column: 0 }
    }

    /// Whether this is a zone of the grid.
    pub fn contains(&self, zone: Zone) -> bool {
        let Zone { level, row, column } = zone;
        level <= self.top() && row < self.rows.n(level) && column < self.columns.n(level)
    }

    /// How many zones a level has.
    pub fn n_zones(&self, level: Level) -> usize {
        self.rows.n(level) as usize * self.columns.n(level) as usize
    }

    /// A zone's place in the array of its level: Address(level, row, column).
    #[inline]
    pub fn address(&self, zone: Zone) -> usize {
        zone.row as usize * self.columns.n(zone.level) as usize + zone.column as usize
    }

    /// The zone at a place in the array of a level; the inverse of [`address`](Self::address).
    pub fn zone_at(&self, level: Level, address: usize) -> Zone {
        let n = self.columns.n(level) as usize;
        Zone { level, row: (address / n) as u32, column: (address % n) as u32 }
    }

    /// The zone of the next coarser level in which a zone lies; `None` for the root.
    pub fn parent(&self, zone: Zone) -> Option<Zone> {
        let Zone { level, row, column } = zone;
        (level < self.top()).then(|| Zone {
            level: Level(level.0 + 1),
            row: self.rows.parent(level, row),
            column: self.columns.parent(level, column),
        })
    }

    /// The zones of the next finer level that lie in a zone, row by row: two or four, with slop three, six or nine, none of a final
    /// zone.
    pub fn children(&self, zone: Zone) -> impl Iterator<Item = Zone> + use<> {
        let Zone { level, row, column } = zone;
        let (rows, columns) = (self.rows.children(level, row), self.columns.children(level, column));
        rows.flat_map(move |row| {
            columns.clone().map(move |column| Zone { level: Level(level.0.wrapping_sub(1)), row, column })
        })
    }

    /// The zones of the same level that share an edge or a vertex with a zone: up to eight.
    pub fn siblings(&self, zone: Zone) -> impl Iterator<Item = Zone> + use<> {
        let Zone { level, row, column } = zone;
        let around = |i: u32, n: u32| i.saturating_sub(1)..(i + 2).min(n);
        let columns = around(column, self.columns.n(level));
        around(row, self.rows.n(level))
            .flat_map(move |row| columns.clone().map(move |column| Zone { level, row, column }))
            .filter(move |sibling| *sibling != zone)
    }

    /// The final zones that lie in a zone, in constant time.
    #[inline]
    pub fn descendants(&self, zone: Zone) -> ZoneRange {
        let Zone { level, row, column } = zone;
        ZoneRange { rows: self.rows.descendants(level, row), columns: self.columns.descendants(level, column) }
    }

    /// The zone of `level` in which a final zone lies, in constant time.
    #[inline]
    pub fn ancestor(&self, level: Level, row: u32, column: u32) -> Zone {
        Zone { level, row: self.rows.ancestor(level, row), column: self.columns.ancestor(level, column) }
    }

    /// All levels from the finest to the root.
    pub fn levels(&self) -> impl DoubleEndedIterator<Item = Level> + use<> {
        (0..=self.top().0).map(Level)
    }
}

impl ZoneRange {
    /// How many final zones there are.
    pub fn n_zones(&self) -> usize {
        self.rows.len() * self.columns.len()
    }
}

impl fmt::Display for Zone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "zone ({}, {}) of level {}", self.row, self.column, self.level.0)
    }
}
