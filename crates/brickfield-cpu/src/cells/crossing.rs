//! Where a line crosses the twelve triangles around a cell.
//!
//! On which side a line passes an edge is decided by the signs of 18 numbers: twelve edges, and a diagonal of each face. The signs are
//! exact for the rounded u and v of nodes, and a line through an edge is taken for one that is shifted by an infinitely small way along u, and
//! a much smaller one along v. So all cells around an edge agree, and no ray slips between cells.

use std::sync::LazyLock;

use brickfield_core::glam::Vec3;
use brickfield_frame::CellFace;

use super::lanes::{Areas, EDGES, Lanes, N_EDGES};
use super::line::Corners;

/// A triangle: twice the face, and 0 or 1 for its half.
pub(super) type Triangle = usize;

/// A triangle's corners, and the edge opposite to each.
#[derive(Clone, Copy)]
struct Shape {
    corners: [usize; 3],
    edges: [usize; 3],
    /// The bits of its edges; and those of them that are set where a line leaves a cell of a right-handed grid. Where one enters, the others are.
    mask: u32,
    leaving: u32,
}

const SHAPES: [Shape; 12] = {
    let mut shapes = [Shape { corners: [0; 3], edges: [0; 3], mask: 0, leaving: 0 }; 12];
    let mut i = 0;
    while i < 12 {
        shapes[i] = shape(CellFace::triangles(i as u32 / 2)[i % 2]);
        i += 1;
    }
    shapes
};

const fn shape(corners: [usize; 3]) -> Shape {
    let mut shape = Shape { corners, edges: [0; 3], mask: 0, leaving: 0 };
    let mut i = 0;
    while i < 3 {
        let (from, to) = (corners[(i + 1) % 3], corners[(i + 2) % 3]);
        let (low, high) = if from < to { (from, to) } else { (to, from) };
        let mut edge = 0;
        while EDGES[edge][0] != low || EDGES[edge][1] != high {
            edge += 1;
        }
        shape.edges[i] = edge;
        shape.mask |= 1 << edge;
        if from < to {
            shape.leaving |= 1 << edge;
        }
        i += 1;
    }
    shape
}

/// The local coordinates of corners.
const LOCAL: [Vec3; 8] = {
    let mut local = [Vec3::ZERO; 8];
    let mut i = 0;
    while i < 8 {
        local[i] = Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
        i += 1;
    }
    local
};

/// For all signs: the triangle that is entered, and 16 times the one that is left; or [`MANY`].
static PAIRS: LazyLock<Vec<u8>> = LazyLock::new(|| (0..1 << N_EDGES).map(pair).collect());

/// Not one triangle that is entered, and one that is left.
const MANY: u8 = 0xff;

fn pair(signs: u32) -> u8 {
    let mut found = [None; 2];
    for (i, shape) in SHAPES.iter().enumerate() {
        if let Some(leaves) = crossed(shape, signs)
            && found[usize::from(leaves)].replace(i as u8).is_some()
        {
            return MANY;
        }
    }
    match found {
        [Some(entered), Some(left)] => entered | left << 4,
        _ => MANY,
    }
}

/// Whether a triangle is crossed, and whether a cell of a right-handed grid is left there.
#[inline(always)]
fn crossed(shape: &Shape, signs: u32) -> Option<bool> {
    let own = signs & shape.mask;
    if own == shape.leaving { Some(true) } else { (own == shape.mask ^ shape.leaving).then_some(false) }
}

/// The table of all signs.
#[derive(Clone, Copy)]
pub(super) struct Crossings {
    pairs: &'static [u8],
}

/// On which sides a line passes a cell's edges.
pub(super) struct Sides<'a, L: Lanes> {
    corners: &'a Corners<L>,
    /// Twice the areas of the triangles between the line and edges.
    areas: [f32; 24],
    signs: u32,
}

/// Where a line crosses a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    pub(super) triangle: Triangle,
    pub(super) w: f32,
    /// The place in the cell, by linear interpolation between the triangle's corners.
    pub(super) local: Vec3,
}

impl Crossings {
    pub(super) fn new() -> Crossings {
        Crossings { pairs: &PAIRS }
    }

    /// The triangles that a line enters and leaves a cell of a right-handed grid by, if it does so once.
    #[inline(always)]
    pub(super) fn once<L: Lanes>(&self, sides: &Sides<L>) -> Option<[Triangle; 2]> {
        let pair = self.pairs[sides.signs as usize];
        (pair != MANY).then_some([usize::from(pair & 15), usize::from(pair >> 4)])
    }
}

impl<'a, L: Lanes> Sides<'a, L> {
    #[inline(always)]
    pub(super) fn of(corners: &'a Corners<L>) -> Sides<'a, L> {
        let Areas { areas, signs, is_unsure } = corners.lanes.areas(corners.u, corners.v);
        let signs = if is_unsure { corners.exact_signs() } else { signs };
        Sides { corners, areas, signs }
    }

    /// Where the line crosses a triangle that it is known to cross.
    #[inline(always)]
    pub(super) fn crossing(&self, triangle: Triangle) -> Crossing {
        let Shape { corners: [a, b, c], edges, .. } = SHAPES[triangle];
        let [x, y, z] = edges.map(|edge| self.areas[edge].abs());
        let sum = (x + y) + z;
        let (x, y, z) = if sum > 0.0 { (x / sum, y / sum, z / sum) } else { (0.25, 0.25, 0.5) };
        let w = self.corners.lanes.array(self.corners.w);
        let local = LOCAL[a] * x + LOCAL[b] * y + LOCAL[c] * z;
        Crossing { triangle, w: (w[a & 7] * x + w[b & 7] * y) + w[c & 7] * z, local }
    }

    /// Whether a triangle is crossed, and whether a cell of a right-handed grid is left there.
    #[inline(always)]
    pub(super) fn crosses(&self, triangle: Triangle) -> Option<bool> {
        crossed(&SHAPES[triangle], self.signs)
    }

    /// All triangles that are left, or entered, along the line.
    pub(super) fn all(&self, leaves: bool) -> Vec<Crossing> {
        let crossed = (0..12).filter(|triangle| self.crosses(*triangle) == Some(leaves));
        let mut crossings: Vec<Crossing> = crossed.map(|triangle| self.crossing(triangle)).collect();
        crossings.sort_by(|a, b| a.w.total_cmp(&b.w).then(a.triangle.cmp(&b.triangle)));
        crossings
    }
}

impl<L: Lanes> Corners<L> {
    /// The signs in f64, in which products of f32 are exact.
    #[cold]
    #[inline(never)]
    fn exact_signs(&self) -> u32 {
        let (u, v) = (self.lanes.array(self.u), self.lanes.array(self.v));
        let at = |i: usize| [f64::from(u[i]), f64::from(v[i])];
        let is_positive = |[a, b]: [usize; 2]| {
            let ([ua, va], [ub, vb]) = (at(a), at(b));
            let area = ua * vb - ub * va;
            // Shifted along u; where the edge is parallel to u, along v.
            let shifted = if area != 0.0 { area } else { va - vb };
            if shifted != 0.0 { shifted > 0.0 } else { ub > ua }
        };
        let edges = EDGES.into_iter().enumerate().take(N_EDGES);
        edges.fold(0, |signs, (i, edge)| signs | u32::from(is_positive(edge)) << i)
    }
}
