//! The colours of all values, so that no block converts one.

use brickfield_core::glam::Vec4;
use brickfield_core::{Optics, TransferFunction, ValueRange};
use rayon::prelude::*;

use super::Slab;
use super::bumps::Bumps;

/// Cells of the table, evenly spaced between values: a power of two. Every value of 8 bits lies near a cell's end.
const N_CELLS: usize = 4096;

/// A few roundings below the number of cells.
const GREATEST_PLACE: f32 = N_CELLS as f32 * (1.0 - 4.0 * f32::EPSILON);

/// Added to a number from 0 to 2^22 it leaves the nearest integer in the lowest bits of an f32.
const INTEGER: f32 = 1.5 * (1 << 23) as f32;

/// L*, u*, v* of a slab over evenly spaced values, linear between.
///
/// The values depend on the range alone, so that tables of two transfer functions agree where these do.
#[derive(Clone, Debug)]
pub(crate) struct ColorTable {
    range: ValueRange,
    /// Places per unit of value; 0 for a range of one value.
    scale: f64,
    /// Three components and 0, at both ends of every cell.
    luv: Box<[Vec4; N_CELLS + 1]>,
    bumps: Bumps,
}

impl ColorTable {
    pub(crate) fn new(range: ValueRange, transfer: &TransferFunction, slab: &Slab) -> ColorTable {
        let mut luv = Box::new([Vec4::ZERO; N_CELLS + 1]);
        luv.par_iter_mut().with_min_len(256).enumerate().for_each(|(i, color)| {
            let t = i as f64 / N_CELLS as f64;
            let [l, u, v] = slab.luv(transfer.at(range.min * (1.0 - t) + range.max * t));
            *color = Vec4::new(l as f32, u as f32, v as f32, 0.0);
        });
        let scale = N_CELLS as f64 / (range.max - range.min);
        let [l, u, v] = slab.luv(Optics { extinction: 0.0, color: [0.0; 3] });
        let bumps = Bumps::new(&luv[..], Vec4::new(l as f32, u as f32, v as f32, 0.0));
        ColorTable { range, scale: if scale.is_finite() { scale } else { 0.0 }, luv, bumps }
    }

    /// The place of a value of the range: from 0 to the number of cells, which it does not reach.
    pub(crate) fn place(&self, value: f64) -> f32 {
        (((value - self.range.min) * self.scale) as f32).clamp(0.0, GREATEST_PLACE)
    }

    /// Places per unit of value.
    pub(crate) fn scale(&self) -> f64 {
        self.scale
    }

    /// The values of a cell.
    pub(crate) fn step(&self) -> f64 {
        (self.range.max - self.range.min) / N_CELLS as f64
    }

    /// Whether values `spacing` places apart, or closer, may step over a colour between two places; see [`Bumps`].
    ///
    /// The answer depends on the colours of these places alone.
    pub(crate) fn has_bump(&self, first: f32, last: f32, spacing: f32) -> bool {
        self.bumps.any(first, last, spacing)
    }

    /// The colour at a place; a place beyond the table has some colour.
    #[inline]
    pub(crate) fn at(&self, place: f32) -> Vec4 {
        // Of an integer place it may be the cell before: f is 1 then.
        let cell = (place - 0.5) + INTEGER;
        let (i, f) = (cell.to_bits() as usize % N_CELLS, place - (cell - INTEGER));
        let (low, high) = (self.luv[i], self.luv[i + 1]);
        low + (high - low) * f
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::Knot;

    #[test]
    fn colors_are_those_of_the_values_in_the_table_and_linear_between() {
        let knot = |value, extinction| Knot { value, extinction, color: [1.0, 0.5, 0.2] };
        let transfer = TransferFunction::new(vec![knot(0.0, 0.0), knot(300.0, 0.2)]).unwrap();
        let slab = Slab::new(8.0, [0.1; 3]).unwrap();
        let table = ColorTable::new(ValueRange { min: -1000.0, max: 3096.0 }, &transfer, &slab);
        for value in -1000..=3096 {
            let [l, u, v] = slab.luv(transfer.at(f64::from(value)));
            let found = table.at(table.place(f64::from(value)));
            assert!((found - Vec4::new(l as f32, u as f32, v as f32, 0.0)).length() < 1e-4, "{value}: {found}");
            let middle = table.at(table.place(f64::from(value) + 0.25));
            let next = table.at(table.place(f64::from(value + 1)));
            assert!((middle - found.lerp(next, 0.25)).length() < 1e-3, "{value}: {middle}");
        }
    }
}
