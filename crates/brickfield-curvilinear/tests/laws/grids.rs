//! Generated grids, for the tests in `src` and for those beside this file.

use std::f64::consts::TAU;

use brickfield_core::glam::DVec3;
use brickfield_curvilinear::*;

/// The kinds of grids that meshes are tried on.
pub(crate) const KINDS: [Kind; 5] = [Kind::Flat, Kind::Waves, Kind::Annulus, Kind::Sheared, Kind::Torus];

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    /// An even grid in a plane.
    Flat,
    /// A height field.
    Waves,
    /// Polar coordinates; columns are closed.
    Annulus,
    /// In a plane: sheared, and stretched along both axes.
    Sheared,
    /// Rows and columns are closed.
    Torus,
}

impl Kind {
    /// A grid of n_rows x n_columns zones, each number at least 3.
    pub(crate) fn grid(self, n_rows: u32, n_columns: u32) -> CurvilinearGrid {
        let values = self.values(n_rows, n_columns);
        if self == Kind::Waves {
            let field = HeightField {
                origin: DVec3::new(-3.0, 5.0, 1.0),
                along_column: DVec3::X * 0.5,
                along_row: DVec3::Y * 0.25,
                along_value: DVec3::Z,
            };
            return CurvilinearGrid::new(n_rows, n_columns, Positions::Heights(field), values).unwrap();
        }
        let at =
            |row, column| self.position(f64::from(row) / f64::from(n_rows), f64::from(column) / f64::from(n_columns));
        let ends = self.ends();
        let wrapped = |i: u32, n: u32, end: End| if end == End::Closed { i % n } else { i };
        let nodes = (0..=n_rows).flat_map(|row| (0..=n_columns).map(move |column| (row, column)));
        let positions = nodes
            .map(|(row, column)| at(wrapped(row, n_rows, ends.rows), wrapped(column, n_columns, ends.columns)))
            .collect();
        let grid = CurvilinearGrid::new(n_rows, n_columns, Positions::Curvilinear(positions), values);
        grid.unwrap().with_ends(ends).unwrap()
    }

    pub(crate) fn ends(self) -> GridEnds {
        let end = |closed: bool| if closed { End::Closed } else { End::Open };
        GridEnds { rows: end(self == Kind::Torus), columns: end(matches!(self, Kind::Torus | Kind::Annulus)) }
    }

    /// Whether all nodes lie in the plane of x and y, columns against rows counter-clockwise.
    pub(crate) fn is_planar(self) -> bool {
        !matches!(self, Kind::Waves | Kind::Torus)
    }

    fn position(self, row: f64, column: f64) -> DVec3 {
        match self {
            Kind::Flat | Kind::Waves => DVec3::new(column * 7.0, row * 5.0, 0.0),
            Kind::Annulus => {
                // Rows run inwards, so that columns against rows are counter-clockwise.
                let (radius, angle) = (2.0 - row, TAU * column);
                DVec3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
            }
            Kind::Sheared => DVec3::new(column * column + 0.1 * column + 0.7 * row, row * (0.4 + row), 0.0),
            Kind::Torus => {
                let (ring, tube) = (TAU * column, TAU * row);
                let radius = 3.0 + tube.cos();
                DVec3::new(radius * ring.cos(), radius * ring.sin(), tube.sin())
            }
        }
    }

    /// Waves over both axes, which meet themselves at closed ends.
    fn values(self, n_rows: u32, n_columns: u32) -> Vec<f32> {
        let value = |row: u32, column: u32| {
            let (v, u) = (TAU * f64::from(row) / f64::from(n_rows), TAU * f64::from(column) / f64::from(n_columns));
            ((u + v).sin() + 0.3 * (3.0 * u - v).cos() + 0.1 * (7.0 * u + 5.0 * v).sin()) as f32
        };
        let nodes = (0..=n_rows).flat_map(|row| (0..=n_columns).map(move |column| (row, column)));
        nodes.map(|(row, column)| value(row % n_rows, column % n_columns)).collect()
    }
}

/// All zones of a layout from level 1 on.
pub(crate) fn coarse_zones(layout: &QuadLayout) -> impl Iterator<Item = Zone> {
    layout.levels().skip(1).flat_map(move |level| (0..layout.n_zones(level)).map(move |i| layout.zone_at(level, i)))
}

/// Nice zones that cover most of the grid, by dividing the root at random; some parts of the grid are out.
pub(crate) fn random_leaves(tree: &QuadTree, seed: u64) -> Vec<Zone> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut dice = |n: u64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 20) % n
    };
    let (mut open, mut leaves) = (vec![tree.layout().root()], Vec::new());
    let is_whole = dice(2) == 0;
    while let Some(zone) = open.pop() {
        let summary = tree.summary(zone);
        let is_drawn = summary.is_nice() && (zone.level.0 == 0 || dice(3) == 0) && zone != tree.layout().root();
        if is_drawn {
            leaves.push(zone);
        } else if !summary.is_void() && (is_whole || dice(25) > 0) {
            open.extend(tree.layout().children(zone));
        }
    }
    leaves
}
