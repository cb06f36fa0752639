//! Where a line crosses the twelve triangles around a cell.
//!
//! On which side a line passes an edge is decided by the signs of 18 numbers: twelve edges, and a diagonal of each face. The signs are
//! exact for the rounded u and v of nodes, and a line through an edge is taken for one that is shifted by an infinitely small way along u, and
//! a much smaller one along v. So all cells around an edge agree, and no ray slips between cells.

use std::sync::LazyLock;

use brickfield_frame::CellFace;

use super::line::Corners;

/// The edges of a cell, then the diagonals of its faces: lower corner, upper corner.
const EDGES: [[usize; 2]; N_EDGES] = [
    [0, 1],
    [2, 3],
    [4, 5],
    [6, 7],
    [0, 2],
    [1, 3],
    [4, 6],
    [5, 7],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
    [0, 6],
    [1, 7],
    [0, 5],
    [2, 7],
    [0, 3],
    [4, 7],
];
const N_EDGES: usize = 18;

/// A triangle: twice the face, and 0 or 1 for its half.
pub(super) type Triangle = usize;

/// The edge opposite to each corner of a triangle, and whether the triangle runs along it from its lower corner.
#[derive(Clone, Copy)]
struct Shape {
    corners: [usize; 3],
    edges: [usize; 3],
    /// The signs of its edges where a line leaves a cell of a right-handed grid through it; where one enters, all are the others.
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
fn crossed(shape: &Shape, signs: u32) -> Option<bool> {
    let own = signs & shape.mask;
    if own == shape.leaving { Some(true) } else { (own == shape.mask ^ shape.leaving).then_some(false) }
}

/// The table of all signs.
#[derive(Clone, Copy)]
pub(super) struct Crossings {
    pairs: &'static [u8],
}

/// Twice the areas of the triangles between the line and edges, and their signs.
#[derive(Clone, Copy)]
pub(super) struct Sides {
    areas: [f32; N_EDGES],
    signs: u32,
}

/// Where a line crosses a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    pub(super) triangle: Triangle,
    pub(super) w: f32,
    /// The place in the cell, by linear interpolation between the triangle's corners.
    pub(super) local: [f32; 3],
}

impl Crossings {
    pub(super) fn new() -> Crossings {
        Crossings { pairs: &PAIRS }
    }

    /// The triangles that a line enters and leaves a cell of a right-handed grid by, if it does so once.
    #[inline(always)]
    pub(super) fn once(&self, sides: &Sides) -> Option<[Triangle; 2]> {
        let pair = self.pairs[sides.signs as usize];
        (pair != MANY).then_some([usize::from(pair & 15), usize::from(pair >> 4)])
    }
}

impl Sides {
    #[inline(always)]
    pub(super) fn of(corners: &Corners) -> Sides {
        let Corners { u, v, .. } = corners;
        let (mut areas, mut signs, mut unsure) = ([0f32; N_EDGES], 0u32, 0u32);
        for (i, [a, b]) in EDGES.into_iter().enumerate() {
            let less = u[b] * v[a];
            let area = u[a] * v[b] - less;
            areas[i] = area;
            signs |= u32::from(area > 0.0) << i;
            // Of three roundings each is at most 2^-24 of a product, or of their difference.
            unsure |= u32::from(area.abs() <= less.abs() * UNSURE) << i;
        }
        if unsure != 0 {
            signs = exact_signs(corners);
        }
        Sides { areas, signs }
    }

    /// Where the line crosses a triangle that it is known to cross.
    #[inline(always)]
    pub(super) fn crossing(&self, corners: &Corners, triangle: Triangle) -> Crossing {
        let shape = &SHAPES[triangle];
        let weights = shape.edges.map(|edge| self.areas[edge].abs());
        let sum = weights[0] + weights[1] + weights[2];
        let weights = if sum > 0.0 { weights.map(|w| w / sum) } else { [1.0 / 3.0; 3] };
        let mix = |of: &dyn Fn(usize) -> f32| (0..3).map(|i| weights[i] * of(shape.corners[i])).sum::<f32>();
        let local = std::array::from_fn(|axis| mix(&|corner| (corner >> axis & 1) as f32));
        Crossing { triangle, w: mix(&|corner| corners.w[corner]), local }
    }

    /// Whether a triangle is crossed, and whether a cell of a right-handed grid is left there.
    pub(super) fn crosses(&self, triangle: Triangle) -> Option<bool> {
        crossed(&SHAPES[triangle], self.signs)
    }

    /// All triangles that are left, or entered, along the line.
    #[cold]
    pub(super) fn all(&self, corners: &Corners, leaves: bool) -> Vec<Crossing> {
        let crossed = (0..12).filter(|triangle| self.crosses(*triangle) == Some(leaves));
        let mut crossings: Vec<Crossing> = crossed.map(|triangle| self.crossing(corners, triangle)).collect();
        crossings.sort_by(|a, b| a.w.total_cmp(&b.w).then(a.triangle.cmp(&b.triangle)));
        crossings
    }
}

const UNSURE: f32 = 1.0 / (1 << 22) as f32;

/// The signs in f64, in which products of f32 are exact.
#[cold]
#[inline(never)]
fn exact_signs(corners: &Corners) -> u32 {
    let at = |i: usize| [f64::from(corners.u[i]), f64::from(corners.v[i])];
    let is_positive = |[a, b]: [usize; 2]| {
        let ([ua, va], [ub, vb]) = (at(a), at(b));
        let area = ua * vb - ub * va;
        // Shifted along u; where the edge is parallel to u, along v.
        let shifted = if area != 0.0 { area } else { va - vb };
        if shifted != 0.0 { shifted > 0.0 } else { ub > ua }
    };
    EDGES.into_iter().enumerate().fold(0, |signs, (i, edge)| signs | u32::from(is_positive(edge)) << i)
}
