//! The plane of a coarse zone, in which its final zones are compared with it.

use brickfield_core::glam::{DVec2, DVec3};

use crate::{CurvilinearGrid, Node, Positions, ZoneRange};

/// The four corners of a zone, counter-clockwise where columns run to the right and rows up.
pub(crate) fn corners(range: &ZoneRange) -> [Node; 4] {
    let ([top, bottom], [left, right]) = ([range.rows.start, range.rows.end], [range.columns.start, range.columns.end]);
    [(top, left), (top, right), (bottom, right), (bottom, left)].map(|(row, column)| Node { row, column })
}

/// The corners of a zone with their positions and values.
pub(crate) struct Quad {
    pub(crate) nodes: [Node; 4],
    pub(crate) positions: [DVec3; 4],
    /// NaN for a hole.
    pub(crate) values: [f64; 4],
}

impl Quad {
    pub(crate) fn of(grid: &CurvilinearGrid, range: &ZoneRange) -> Quad {
        let nodes = corners(range);
        Quad {
            nodes,
            positions: nodes.map(|node| grid.position(node)),
            values: nodes.map(|node| f64::from(grid.value(node))),
        }
    }

    /// The lengths of both diagonals, in world units.
    fn diagonals(&self) -> [f64; 2] {
        let p = &self.positions;
        [p[0].distance(p[2]), p[1].distance(p[3])]
    }

    /// The length of the shorter diagonal.
    pub(crate) fn size(&self) -> f64 {
        let [main, other] = self.diagonals();
        main.min(other)
    }

    /// The diagonal that cuts the zone into the two triangles that are drawn: the shorter one; in height fields, and of two equal ones,
    /// that from corner 0 to corner 2. The result is the corner, 0 or 1, at which it begins.
    pub(crate) fn cut(&self, grid: &CurvilinearGrid) -> usize {
        let [main, other] = match grid.positions() {
            Positions::Heights(_) => return 0,
            Positions::Curvilinear(_) | Positions::Offsets { .. } => self.diagonals(),
        };
        usize::from(other < main)
    }
}

/// How far along the edge from node `a` to node `b` a node lies: 0 at `a`, 1 at `b`.
///
/// On a height field that is its fraction of the rows or columns. On other grids it is the node's projection onto the edge
/// (Wynn et al. 1999, figure 6); `None` if the edge has no length.
pub(crate) fn along_edge(grid: &CurvilinearGrid, [a, b]: [Node; 2], node: Node) -> Option<f64> {
    if let Positions::Heights(_) = grid.positions() {
        let (way, whole) = (
            node.row.abs_diff(a.row) + node.column.abs_diff(a.column),
            a.row.abs_diff(b.row) + a.column.abs_diff(b.column),
        );
        return (whole > 0).then(|| f64::from(way) / f64::from(whole));
    }
    let (start, edge) = (grid.position(a), grid.position(b) - grid.position(a));
    let t = (grid.position(node) - start).dot(edge) / edge.length_squared();
    t.is_finite().then_some(t)
}

/// Coordinates in the plane of a zone.
pub(crate) enum Chart {
    /// Column and row. The nodes of a height field are even, seen along its values.
    Index,
    /// Seen along the normal of both diagonals.
    Plane { origin: DVec3, axes: [DVec3; 2] },
}

impl Chart {
    /// `None` if the zone's diagonals are parallel, or one has no length.
    pub(crate) fn of(grid: &CurvilinearGrid, quad: &Quad) -> Option<Chart> {
        if let Positions::Heights(_) = grid.positions() {
            return Some(Chart::Index);
        }
        let p = &quad.positions;
        let x = (p[2] - p[0]).try_normalize()?;
        let normal = x.cross((p[3] - p[1]).try_normalize()?).try_normalize()?;
        Some(Chart::Plane { origin: p[0], axes: [x, normal.cross(x)] })
    }

    #[inline]
    pub(crate) fn at(&self, grid: &CurvilinearGrid, node: Node) -> DVec2 {
        match self {
            Chart::Index => DVec2::new(f64::from(node.column), f64::from(node.row)),
            Chart::Plane { origin, axes } => {
                let p = grid.position(node) - *origin;
                DVec2::new(axes[0].dot(p), axes[1].dot(p))
            }
        }
    }
}

/// A coarse zone as it is drawn: two triangles with values that are linear in each.
pub(crate) struct DrawnZone {
    /// From the first end of the diagonal on, counter-clockwise.
    corners: [DVec2; 4],
    /// The value at `corners[0]`, and the gradients of the triangles right and left of the diagonal.
    value: f64,
    gradients: [DVec2; 2],
}

impl DrawnZone {
    /// Cut along the diagonal that begins at corner `cut`. `None` if the quadrilateral is not convex, so that a triangle would lie outside of it.
    pub(crate) fn new(corners: [DVec2; 4], values: [f64; 4], cut: usize) -> Option<DrawnZone> {
        let at = |i: usize| (corners[(i + cut) % 4], values[(i + cut) % 4]);
        let (p, v): ([DVec2; 4], [f64; 4]) = (std::array::from_fn(|i| at(i).0), std::array::from_fn(|i| at(i).1));
        let is_convex = (0..4).all(|i| (p[(i + 1) % 4] - p[i]).perp_dot(p[(i + 2) % 4] - p[(i + 1) % 4]) > 0.0);
        let gradient = |b: usize, c: usize| {
            let (to_b, to_c) = (p[b] - p[0], p[c] - p[0]);
            let (rise_b, rise_c) = (v[b] - v[0], v[c] - v[0]);
            (-to_c.perp() * rise_b + to_b.perp() * rise_c) / to_b.perp_dot(to_c)
        };
        is_convex.then(|| DrawnZone { corners: p, value: v[0], gradients: [gradient(1, 2), gradient(2, 3)] })
    }

    /// Whether a point lies inside, not on an edge.
    #[inline]
    pub(crate) fn contains(&self, at: DVec2) -> bool {
        let p = &self.corners;
        (0..4).all(|i| (p[(i + 1) % 4] - p[i]).perp_dot(at - p[i]) > 0.0)
    }

    /// The value that is drawn at a point.
    #[inline]
    pub(crate) fn value(&self, at: DVec2) -> f64 {
        let from_first = at - self.corners[0];
        let is_left = (self.corners[2] - self.corners[0]).perp_dot(from_first) > 0.0;
        self.value + self.gradients[usize::from(is_left)].dot(from_first)
    }
}
