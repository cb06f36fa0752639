//! The interpolation cells along a line, and the field in each as a cubic.

use brickfield_core::glam::{DVec3, IVec3, UVec3};
use brickfield_core::{Aabb, Span, TransferFunction, ValueRange, Volume};
use rayon::prelude::*;

use super::cubic::Cubic;

/// A line in sample space; its parameter is in world units and may be negative.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// The point at parameter 0, near the volume.
    pub(super) anchor: DVec3,
    /// Voxels per world unit.
    pub(super) direction: DVec3,
    /// The parameter where the ray begins.
    pub(super) least: f64,
}

impl Line {
    fn at(&self, s: f64) -> DVec3 {
        self.anchor + self.direction * s
    }

    /// Where the ray runs in a half-open box.
    pub(super) fn clip(&self, b: &Aabb) -> Option<Span> {
        let mut span = Span { start: self.least, end: f64::INFINITY };
        for axis in 0..3 {
            let (o, d) = (self.anchor[axis], self.direction[axis]);
            if d == 0.0 && !(b.min[axis] <= o && o < b.max[axis]) {
                return None;
            }
            if d != 0.0 {
                let (x, y) = ((b.min[axis] - o) / d, (b.max[axis] - o) / d);
                span = Span { start: span.start.max(x.min(y)), end: span.end.min(x.max(y)) };
            }
        }
        (span.start < span.end).then_some(span)
    }

    /// Where the line passes a plane of an axis, ahead of it; infinity if it is parallel.
    fn passes(&self, axis: usize, planes: [i32; 2]) -> f64 {
        let d = self.direction[axis];
        let plane = if d > 0.0 { planes[1] } else { planes[0] };
        if d == 0.0 { f64::INFINITY } else { (f64::from(plane) - self.anchor[axis]) / d }
    }
}

/// The field along a line's way through one cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct CellPath {
    pub(super) values: Cubic,
    /// World units.
    pub(super) length: f64,
}

/// A volume's interpolation cells.
///
/// Cell i of an axis is [i, i + 1) in sample space; -1 is the clamped half voxel before the first sample, N - 1 the one
/// behind the last.
pub(super) struct Cells<'a> {
    volume: &'a Volume,
    last: IVec3,
    blocks: Option<EmptyBlocks>,
}

impl<'a> Cells<'a> {
    pub(super) fn new(volume: &'a Volume) -> Cells<'a> {
        Cells { volume, last: volume.grid().dims().as_ivec3() - 1, blocks: None }
    }

    /// With blocks of cells that are skipped where the transfer function is 0 over their range.
    pub(super) fn with_blocks(volume: &'a Volume, transfer: &TransferFunction) -> Cells<'a> {
        Cells { blocks: Some(EmptyBlocks::new(volume, transfer)), ..Cells::new(volume) }
    }

    /// The cells along a line, in order; cells of transparent blocks are left out.
    pub(super) fn along<'b>(&'b self, line: &'b Line, span: Span) -> impl Iterator<Item = CellPath> + use<'a, 'b> {
        let mut at = span.start;
        let mut cell = self.cell_at(line, at, IVec3::splat(-1), self.last);
        std::iter::from_fn(move || {
            while at < span.end {
                let transparent = self.blocks.as_ref().and_then(|b| b.transparent(cell, self.last));
                let (low, high) = transparent.unwrap_or((cell, cell));
                let passes = [0, 1, 2].map(|axis| line.passes(axis, [low[axis], high[axis] + 1]));
                let exit = passes[0].min(passes[1]).min(passes[2]);
                let (begin, here) = (at, cell);
                at = exit.max(at);
                cell = if transparent.is_some() { self.cell_at(line, at, low, high) } else { cell };
                cell = leave(line, cell, passes, (low, high), exit);
                let length = exit.min(span.end) - begin;
                if transparent.is_none() && length > 0.0 {
                    return Some(CellPath { values: self.values(line, here, begin, begin + length), length });
                }
            }
            None
        })
    }

    /// The cell of the point at `s`, within bounds; a point on a face belongs to the cell that the line enters.
    fn cell_at(&self, line: &Line, s: f64, low: IVec3, high: IVec3) -> IVec3 {
        let q = line.at(s);
        let floor = q.floor();
        let on_upper = floor.cmpeq(q) & line.direction.cmplt(DVec3::ZERO);
        let cell = floor - DVec3::select(on_upper, DVec3::ONE, DVec3::ZERO);
        cell.max(DVec3::splat(-2.0)).as_ivec3().clamp(low, high)
    }

    /// The field between parameters `a` and `b` in a cell.
    ///
    /// Along a line a trilinear function is the diagonal of its blossom: the Bernstein coefficients are its values where
    /// some coordinates are taken at one end and some at the other.
    fn values(&self, line: &Line, cell: IVec3, a: f64, b: f64) -> Cubic {
        let low = cell.clamp(IVec3::ZERO, (self.last - 1).max(IVec3::ZERO));
        let fraction = |s| (line.at(s) - low.as_dvec3()).clamp(DVec3::ZERO, DVec3::ONE);
        let (f, g) = (fraction(a), fraction(b));
        let v = self.corners(low.as_uvec3());
        let mix = |a: f64, b: f64, f: f64| a * (1.0 - f) + b * f;
        let row = |i: usize, x: f64| mix(v[i], v[i + 1], x);
        // w[x][y][z]: x, y, z at the near (0) or the far end.
        let w = [f.x, g.x].map(|x| {
            let rows = [row(0, x), row(2, x), row(4, x), row(6, x)];
            [f.y, g.y].map(|y| {
                let (below, above) = (mix(rows[0], rows[1], y), mix(rows[2], rows[3], y));
                [f.z, g.z].map(|z| mix(below, above, z))
            })
        });
        let one = w[1][0][0] + w[0][1][0] + w[0][0][1];
        let two = w[0][1][1] + w[1][0][1] + w[1][1][0];
        Cubic([w[0][0][0], one / 3.0, two / 3.0, w[1][1][1]])
    }

    /// The samples at the corners of the cell at `low`, x varying fastest.
    fn corners(&self, low: UVec3) -> [f64; 8] {
        let dims = self.volume.grid().dims();
        let high = (low + 1).min(dims - 1);
        let (nx, nxy) = (dims.x as usize, dims.x as usize * dims.y as usize);
        std::array::from_fn(|i| {
            let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] } as usize;
            self.volume.value(pick(0) + nx * pick(1) + nxy * pick(2))
        })
    }
}

/// The cell behind the face (or faces) that the line passes at `exit`.
fn leave(line: &Line, mut cell: IVec3, passes: [f64; 3], (low, high): (IVec3, IVec3), exit: f64) -> IVec3 {
    for axis in 0..3 {
        if passes[axis] <= exit {
            cell[axis] = if line.direction[axis] > 0.0 { high[axis] + 1 } else { low[axis] - 1 };
        }
    }
    cell
}

/// Cells along a block's side.
const BLOCK: i32 = 8;

/// Which blocks of cells contribute nothing.
struct EmptyBlocks {
    dims: IVec3,
    transparent: Vec<bool>,
}

impl EmptyBlocks {
    fn new(volume: &Volume, transfer: &TransferFunction) -> EmptyBlocks {
        let last = volume.grid().dims().as_ivec3() - 1;
        let dims = (last + BLOCK - 1).max(IVec3::ONE) / BLOCK;
        let dims = dims.max(IVec3::ONE);
        let block = |i: usize| {
            let i = i as i32;
            let low = IVec3::new(i % dims.x, i / dims.x % dims.y, i / (dims.x * dims.y)) * BLOCK;
            transfer.is_transparent(range(volume, low.as_uvec3(), (low + BLOCK).min(last).as_uvec3()))
        };
        let transparent = (0..dims.x as usize * dims.y as usize * dims.z as usize).into_par_iter().map(block).collect();
        EmptyBlocks { dims, transparent }
    }

    /// First and last cell of the block around `cell`, if it is transparent.
    fn transparent(&self, cell: IVec3, last: IVec3) -> Option<(IVec3, IVec3)> {
        let block = (cell.max(IVec3::ZERO) / BLOCK).min(self.dims - 1);
        let i = block.x as usize + self.dims.x as usize * (block.y as usize + self.dims.y as usize * block.z as usize);
        let is_first = block.cmpeq(IVec3::ZERO);
        let is_last = block.cmpeq(self.dims - 1);
        let low = IVec3::select(is_first, IVec3::splat(-1), block * BLOCK);
        let high = IVec3::select(is_last, last, block * BLOCK + BLOCK - 1);
        self.transparent[i].then_some((low, high))
    }
}

/// Least and greatest sample of a box of samples, both ends included.
fn range(volume: &Volume, low: UVec3, high: UVec3) -> ValueRange {
    let dims = volume.grid().dims();
    let mut range = ValueRange { min: f64::INFINITY, max: f64::NEG_INFINITY };
    for z in low.z..=high.z {
        for y in low.y..=high.y {
            let row = dims.x as usize * (y as usize + dims.y as usize * z as usize);
            for x in low.x..=high.x {
                let value = volume.value(row + x as usize);
                range = ValueRange { min: range.min.min(value), max: range.max.max(value) };
            }
        }
    }
    range
}
