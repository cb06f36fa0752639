//! Right-triangulated irregular networks (Evans, Kirkpatrick and Townsend 2001), as Martini builds them: a square is halved along its
//! diagonal, and triangles at the middle of their longest side, as long as that is needed.

use brickfield::curvilinear::{CurvilinearGrid, Node};

/// A network over a square grid of 2^k + 1 nodes a side.
pub(super) struct Rtin {
    n: u32,
    /// For each node, the greatest deviation of a middle from its longest side, of the triangle that is halved there and of all that are
    /// halved because it is.
    errors: Vec<f32>,
}

/// Column and row.
type Point = [u32; 2];

impl Rtin {
    /// The network over the first (2^k + 1)^2 nodes of a grid without holes; `None` if it is smaller.
    pub(super) fn new(grid: &CurvilinearGrid, k: u32) -> Option<Rtin> {
        let side = 1u32 << k;
        if grid.n_rows() < side || grid.n_columns() < side {
            return None;
        }
        let n = side + 1;
        let mut rtin = Rtin { n, errors: vec![0.0; (n as usize).pow(2)] };
        // The triangles of a halving, the finest first: each takes the errors of its two halves.
        let finest = (side as usize).pow(2) * 2 - 2;
        for i in (0..finest).rev() {
            rtin.add_error(grid, i + 2, i + 2 >= (side as usize).pow(2));
        }
        Some(rtin)
    }

    /// Triangle number `id`: the bits behind its first say on which side of each halving it lies.
    fn corners(&self, id: usize) -> [Point; 3] {
        let side = self.n - 1;
        let mut corners = match id & 1 {
            1 => [[0, 0], [side, side], [side, 0]],
            _ => [[side, side], [0, 0], [0, side]],
        };
        let mut rest = id >> 1;
        while rest > 1 {
            corners = halves(corners)[usize::from(rest & 1 == 0)];
            rest >>= 1;
        }
        corners
    }

    fn add_error(&mut self, grid: &CurvilinearGrid, id: usize, is_finest: bool) {
        let corners @ [a, b, _] = self.corners(id);
        let middle = between(a, b);
        let value = |[column, row]: Point| grid.value(Node { row, column });
        let mut error = (0.5 * (value(a) + value(b)) - value(middle)).abs();
        if !is_finest {
            for [a, b, _] in halves(corners) {
                error = error.max(self.errors[self.number(between(a, b))]);
            }
        }
        let number = self.number(middle);
        self.errors[number] = self.errors[number].max(error);
    }

    fn number(&self, [column, row]: Point) -> usize {
        row as usize * self.n as usize + column as usize
    }

    /// The triangles whose errors are at most `bound`: nodes, and corners.
    pub(super) fn triangles(&self, bound: f32) -> (Vec<Node>, Vec<[u32; 3]>) {
        let side = self.n - 1;
        let mut open = vec![[[0, 0], [side, side], [side, 0]], [[side, side], [0, 0], [0, side]]];
        let (mut nodes, mut corners) = (Vec::new(), Vec::new());
        let mut numbers = vec![u32::MAX; self.errors.len()];
        while let Some(triangle @ [a, b, c]) = open.pop() {
            let is_divisible = a[0].abs_diff(c[0]) + a[1].abs_diff(c[1]) > 1;
            if is_divisible && self.errors[self.number(between(a, b))] > bound {
                open.extend(halves(triangle));
                continue;
            }
            corners.push([a, b, c].map(|p| {
                let number = &mut numbers[self.number(p)];
                if *number == u32::MAX {
                    *number = nodes.len() as u32;
                    nodes.push(Node { row: p[1], column: p[0] });
                }
                *number
            }));
        }
        (nodes, corners)
    }
}

/// A triangle's halves; its longest side is from the first corner to the second, its right angle at the third.
fn halves([a, b, c]: [Point; 3]) -> [[Point; 3]; 2] {
    let middle = between(a, b);
    [[c, a, middle], [b, c, middle]]
}

fn between(a: Point, b: Point) -> Point {
    [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]
}

#[cfg(test)]
mod tests {
    use brickfield::curvilinear::{HeightField, Positions};
    use brickfield_core::glam::DVec3;

    use super::*;
    use crate::wynn::deviation::{Triangles, deviation};

    fn grid(n: u32, height: impl Fn(u32, u32) -> f32) -> CurvilinearGrid {
        let field =
            HeightField { origin: DVec3::ZERO, along_column: DVec3::X, along_row: DVec3::Y, along_value: DVec3::Z };
        let values = (0..=n).flat_map(|row| (0..=n).map(move |column| (row, column)));
        let values = values.map(|(row, column)| height(row, column)).collect();
        CurvilinearGrid::new(n, n, Positions::Heights(field), values).unwrap()
    }

    #[test]
    fn a_plane_is_two_triangles_and_noise_is_all() {
        let plane = Rtin::new(&grid(16, |row, column| (3 * row + column) as f32), 4).unwrap();
        assert_eq!(plane.triangles(0.0).1.len(), 2);
        let value = |row, column| (row as f32 * 12.9898 + column as f32 * 78.233).sin() * 97.0;
        let noise = Rtin::new(&grid(16, value), 4).unwrap();
        assert_eq!(noise.triangles(0.0).1.len(), 2 * 16 * 16);
        assert!(Rtin::new(&grid(15, |_, _| 0.0), 4).is_none());
    }

    #[test]
    fn all_nodes_of_a_network_without_error_lie_on_it() {
        let grid = grid(32, |row, column| ((row as f32 / 5.0).sin() * (column as f32 / 7.0).cos() * 50.0).round());
        let (nodes, corners) = Rtin::new(&grid, 5).unwrap().triangles(0.0);
        let values: Vec<f32> = nodes.iter().map(|node| grid.value(*node)).collect();
        assert!(deviation(&grid, &Triangles { nodes: &nodes, values: &values, corners: &corners }) < 1e-4);
        assert!(corners.len() < 2 * 32 * 32);
    }
}
