//! The greatest error of triangles over a height field.

use brickfield::curvilinear::{CurvilinearGrid, Node};
use rayon::prelude::*;

/// Triangles between nodes of a height field, each with the value that it is drawn with.
pub(super) struct Triangles<'a> {
    pub(super) nodes: &'a [Node],
    pub(super) values: &'a [f32],
    pub(super) corners: &'a [[u32; 3]],
}

/// The greatest difference between the value of a node and that of the triangle over it: every node below every triangle is looked at. Holes
/// have no value.
pub(super) fn deviation(grid: &CurvilinearGrid, triangles: &Triangles<'_>) -> f64 {
    triangles.corners.par_iter().map(|corners| of_triangle(grid, triangles, *corners)).reduce(|| 0.0, f64::max)
}

fn of_triangle(grid: &CurvilinearGrid, triangles: &Triangles<'_>, corners: [u32; 3]) -> f64 {
    let p = corners.map(|v| triangles.nodes[v as usize]).map(|n| [i64::from(n.column), i64::from(n.row)]);
    let v = corners.map(|v| f64::from(triangles.values[v as usize]));
    let cross = |a: [i64; 2], b: [i64; 2], c: [i64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let area = cross(p[0], p[1], p[2]);
    if area == 0 {
        return 0.0;
    }
    let ends = |axis: usize| [p[0][axis].min(p[1][axis]).min(p[2][axis]), p[0][axis].max(p[1][axis]).max(p[2][axis])];
    let ([left, right], [top, bottom]) = (ends(0), ends(1));
    let mut most: f64 = 0.0;
    for row in top..=bottom {
        for column in left..=right {
            let at = [column, row];
            let weights =
                [cross(at, p[1], p[2]), cross(p[0], at, p[2]), cross(p[0], p[1], at)].map(|w| w * area.signum());
            let value = f64::from(grid.value(Node { row: row as u32, column: column as u32 }));
            if weights.iter().all(|w| *w >= 0) && !value.is_nan() {
                let drawn = (0..3).map(|i| weights[i] as f64 * v[i]).sum::<f64>() / area.abs() as f64;
                most = most.max((value - drawn).abs());
            }
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use brickfield::curvilinear::{HeightField, Positions};
    use brickfield_core::glam::DVec3;

    use super::*;

    #[test]
    fn the_node_that_is_farthest_from_its_triangle_decides() {
        let field =
            HeightField { origin: DVec3::ZERO, along_column: DVec3::X, along_row: DVec3::Y, along_value: DVec3::Z };
        // A plane with a bump in the middle.
        let values = (0..9).map(|i| (i % 3) as f32 + if i == 4 { 5.0 } else { 0.0 }).collect();
        let grid = CurvilinearGrid::new(2, 2, Positions::Heights(field), values).unwrap();
        let node = |row, column| Node { row, column };
        let nodes = [node(0, 0), node(0, 2), node(2, 2), node(2, 0)];
        let triangles =
            |corners: &'static [[u32; 3]]| Triangles { nodes: &nodes, values: &[0.0, 2.0, 2.0, 0.0], corners };
        assert_eq!(deviation(&grid, &triangles(&[[0, 1, 2], [0, 2, 3]])), 5.0);
        assert_eq!(deviation(&grid, &triangles(&[[2, 1, 0]])), 5.0);
        assert_eq!(deviation(&grid, &triangles(&[])), 0.0);
    }
}
