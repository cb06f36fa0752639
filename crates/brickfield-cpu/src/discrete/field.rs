//! The field that a plan describes: bricks found through the index, interpolated in f64.

use std::marker::PhantomData;

use brickfield_core::Level;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_frame::{FramePlan, IndexEntry};

/// How a sample is read from the bytes of a brick set.
pub(super) trait Stored: Sync {
    /// The stored number of sample `i`.
    fn read(bytes: &[u8], i: usize) -> f64;
}

pub(super) struct Unorm8;
pub(super) struct Unorm16;
pub(super) struct Float32;

impl Stored for Unorm8 {
    #[inline(always)]
    fn read(bytes: &[u8], i: usize) -> f64 {
        f64::from(bytes[i])
    }
}

impl Stored for Unorm16 {
    #[inline(always)]
    fn read(bytes: &[u8], i: usize) -> f64 {
        f64::from(u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]))
    }
}

impl Stored for Float32 {
    #[inline(always)]
    fn read(bytes: &[u8], i: usize) -> f64 {
        let b = &bytes[4 * i..4 * i + 4];
        f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }
}

/// The field of a plan.
pub(super) struct Field<'a, S> {
    pub(super) plan: &'a FramePlan,
    last: DVec3,
    n: usize,
    stored: PhantomData<S>,
}

/// The eight samples around a position, and where it lies between them.
pub(super) struct Cell {
    /// Stored numbers, x varying fastest.
    pub(super) samples: [f64; 8],
    /// Place in the cell, 0 to 1.
    pub(super) fraction: DVec3,
}

impl Cell {
    /// Least and greatest of the samples.
    pub(super) fn range(&self) -> (f64, f64) {
        self.samples.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)))
    }
}

impl<'a, S: Stored> Field<'a, S> {
    pub(super) fn new(plan: &'a FramePlan) -> Self {
        let n = plan.bricks.side().n_samples() as usize;
        Field { plan, last: plan.last_sample(), n, stored: PhantomData }
    }

    /// The data value at a sample position; `None` where its block is transparent.
    #[inline]
    pub(super) fn at(&self, q: DVec3) -> Option<f64> {
        let q = self.clamped(q);
        let cell = self.index_cell(q);
        self.in_block(cell, q)
    }

    /// Data values between two stored numbers, without sign.
    pub(super) fn gain(&self) -> f64 {
        (self.plan.bricks.decode().scale / self.plan.bricks.format().unit()).abs()
    }

    /// The position that the field is evaluated at.
    #[inline]
    pub(super) fn clamped(&self, q: DVec3) -> DVec3 {
        q.clamp(DVec3::ZERO, self.last)
    }

    /// The index cell that owns a clamped position.
    #[inline]
    pub(super) fn index_cell(&self, q: DVec3) -> UVec3 {
        // Truncation is floor where it is not negative, and 0 below.
        let cell = (q / (self.n - 1) as f64).as_uvec3();
        cell.min(self.plan.index.dims() - 1)
    }

    /// The data value at a clamped position, as the block around index cell `cell` has it.
    #[inline]
    pub(super) fn in_block(&self, cell: UVec3, q: DVec3) -> Option<f64> {
        let cell = self.interpolation_cell(cell, q)?;
        let read = trilinear(&cell) / self.plan.bricks.format().unit();
        Some(self.plan.bricks.decode().value(read))
    }

    /// The eight samples that the block around `cell` has for a clamped position.
    #[inline]
    pub(super) fn interpolation_cell(&self, cell: UVec3, q: DVec3) -> Option<Cell> {
        let IndexEntry::Resident { slot, level } = self.plan.index.at(cell) else { return None };
        let s = self.in_brick(cell, level, q);
        let i = s.as_uvec3().min(UVec3::splat(self.n as u32 - 2));
        let base = slot as usize * self.n.pow(3) + i.x as usize + self.n * (i.y as usize + self.n * i.z as usize);
        let sample = |c: usize| S::read(self.plan.bricks.bytes(), base + self.corner(c));
        Some(Cell { samples: std::array::from_fn(sample), fraction: s - i.as_dvec3() })
    }

    /// The position in the brick's own samples, [0, n - 1].
    fn in_brick(&self, cell: UVec3, level: Level, q: DVec3) -> DVec3 {
        let n_cells = (self.n - 1) as f64;
        let corner = (cell >> u32::from(level.0) << u32::from(level.0)).as_dvec3() * n_cells;
        ((q - corner) / f64::from(level.stride())).clamp(DVec3::ZERO, DVec3::splat(n_cells))
    }

    fn corner(&self, c: usize) -> usize {
        (c & 1) + self.n * ((c >> 1 & 1) + self.n * (c >> 2))
    }
}

/// Linear along x, then y, then z.
fn trilinear(cell: &Cell) -> f64 {
    let mix = |a: f64, b: f64, f: f64| a + (b - a) * f;
    let (v, f) = (&cell.samples, cell.fraction);
    let x = [0, 2, 4, 6].map(|i| mix(v[i], v[i + 1], f.x));
    mix(mix(x[0], x[1], f.y), mix(x[2], x[3], f.y), f.z)
}
