//! Generated grids, and selections of their zones.

use std::f64::consts::TAU;

use brickfield::curvilinear::{CurvilinearGrid, End, GridEnds, HeightField, Positions, QuadTree, Selection, Zone};
use brickfield_core::glam::DVec3;

/// The kinds of grids.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum GridKind {
    /// Even, in a plane.
    Flat,
    /// A height field.
    Heights,
    /// Polar coordinates; columns are closed.
    Annulus,
    /// In a plane: sheared, and stretched along both axes.
    Sheared,
    /// Rows and columns are closed.
    Torus,
}

impl GridKind {
    pub(super) const ALL: [GridKind; 5] =
        [GridKind::Flat, GridKind::Heights, GridKind::Annulus, GridKind::Sheared, GridKind::Torus];

    pub(super) const fn name(self) -> &'static str {
        match self {
            GridKind::Flat => "flat",
            GridKind::Heights => "heights",
            GridKind::Annulus => "annulus",
            GridKind::Sheared => "sheared",
            GridKind::Torus => "torus",
        }
    }

    /// A grid of n_rows x n_columns zones around `center`.
    pub(super) fn grid(self, [n_rows, n_columns]: [u32; 2], center: DVec3) -> CurvilinearGrid {
        let ends = GridEnds {
            rows: if self == GridKind::Torus { End::Closed } else { End::Open },
            columns: if matches!(self, GridKind::Torus | GridKind::Annulus) { End::Closed } else { End::Open },
        };
        let nodes = (0..=n_rows).flat_map(|row| (0..=n_columns).map(move |column| [row, column]));
        let share = |i: u32, n: u32, end: End| f64::from(if end == End::Closed { i % n } else { i }) / f64::from(n);
        let shares: Vec<[f64; 2]> = nodes
            .map(|[row, column]| [share(row, n_rows, ends.rows), share(column, n_columns, ends.columns)])
            .collect();
        let values: Vec<f32> = shares.iter().map(|[v, u]| wave(*u, *v) as f32).collect();
        let positions = match self {
            GridKind::Heights => Positions::Heights(HeightField {
                origin: center - DVec3::new(2.0, 1.5, 0.0),
                along_column: DVec3::X * (4.0 / f64::from(n_columns)),
                along_row: DVec3::Y * (3.0 / f64::from(n_rows)),
                along_value: DVec3::Z * 0.4,
            }),
            _ => Positions::Curvilinear(shares.iter().map(|[v, u]| center + self.position(*u, *v)).collect()),
        };
        let grid = CurvilinearGrid::new(n_rows, n_columns, positions, values).expect("a grid of waves");
        grid.with_ends(ends).expect("waves meet themselves")
    }

    fn position(self, u: f64, v: f64) -> DVec3 {
        match self {
            GridKind::Flat | GridKind::Heights => DVec3::new(4.0 * u - 2.0, 3.0 * v - 1.5, 0.0),
            GridKind::Annulus => {
                let (radius, angle) = (2.0 - v, TAU * u);
                DVec3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
            }
            GridKind::Sheared => DVec3::new(2.0 * u * u + 0.2 * u + 1.4 * v - 1.8, 2.0 * v * (0.4 + v) - 1.4, 0.0),
            GridKind::Torus => {
                let (ring, tube) = (TAU * u, TAU * v);
                let radius = 1.5 + 0.5 * tube.cos();
                DVec3::new(radius * ring.cos(), radius * ring.sin(), 0.5 * tube.sin())
            }
        }
    }
}

/// From -1.4 to 1.4; it meets itself at 1.
fn wave(u: f64, v: f64) -> f64 {
    (TAU * (u + v)).sin() + 0.3 * (TAU * (3.0 * u - v)).cos() + 0.1 * (TAU * (7.0 * u + 5.0 * v)).sin()
}

/// Nice zones that cover the grid, by dividing at random.
pub(super) fn random_selection(tree: &QuadTree, seed: u64) -> Selection {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut dice = |n: u64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 20) % n
    };
    let root = tree.layout().root();
    let (mut open, mut leaves): (Vec<Zone>, Vec<Zone>) = (vec![root], Vec::new());
    while let Some(zone) = open.pop() {
        let summary = tree.summary(zone);
        if summary.is_nice() && zone != root && (zone.level.0 == 0 || dice(3) == 0) {
            leaves.push(zone);
        } else if !summary.is_void() {
            open.extend(tree.layout().children(zone));
        }
    }
    Selection::of_leaves(tree, leaves).expect("nice zones, none within another")
}
