//! An image of several boxes, which share points or overlap: each sample is put in its place.

use brickfield_core::Voxels;

use crate::ReadError;
use crate::limits::CheckedShape;
use crate::numbers::with_room;
use crate::samples::{allocate, append_zeros};
use crate::vtk_arrays::{Support, dims};

/// The part of an image that is there so far.
pub(super) struct Assembly<'a> {
    shape: &'a CheckedShape,
    whole: [i64; 6],
    support: Support,
    voxels: Voxels,
    /// A bit for each voxel that a piece gave.
    given: Vec<u64>,
    n_given: usize,
}

/// Where a piece lies in the image.
#[derive(Clone, Copy, Debug)]
pub(super) struct PieceBox {
    start: [usize; 3],
    dims: [u64; 3],
}

impl PieceBox {
    /// Nothing for a piece without samples.
    ///
    /// # Errors
    /// If it is not within the image; `i` counts pieces from 0.
    pub(super) fn find(
        i: usize,
        extent: &[i64; 6],
        whole: &[i64; 6],
        support: Support,
    ) -> Result<Option<PieceBox>, ReadError> {
        let is_flat = |e: &[i64; 6], axis: usize| e[2 * axis] == e[2 * axis + 1];
        let is_empty = |axis: usize| {
            let has_no_cells = support == Support::Cells && is_flat(extent, axis) && !is_flat(whole, axis);
            extent[2 * axis] > extent[2 * axis + 1] || has_no_cells
        };
        if (0..3).any(is_empty) {
            return Ok(None);
        }
        let is_within = (0..3).all(|a| whole[2 * a] <= extent[2 * a] && extent[2 * a + 1] <= whole[2 * a + 1]);
        if !is_within {
            let expected = format!("within the WholeExtent {}", spaced(whole));
            return Err(ReadError::field(format!("Extent of piece {}", i + 1), spaced(extent), expected));
        }
        let start = [0, 1, 2].map(|axis| extent[2 * axis].abs_diff(whole[2 * axis]) as usize);
        Ok(Some(PieceBox { start, dims: dims(extent, support)? }))
    }
}

fn spaced(extent: &[i64; 6]) -> String {
    extent.map(|e| e.to_string()).join(" ")
}

impl<'a> Assembly<'a> {
    pub(super) fn new(shape: &'a CheckedShape, whole: [i64; 6], support: Support) -> Result<Assembly<'a>, ReadError> {
        let n_voxels = shape.n_voxels();
        let mut voxels = allocate(shape)?;
        append_zeros(&mut voxels, n_voxels);
        let mut given = with_room(n_voxels.div_ceil(64))?;
        given.resize(n_voxels.div_ceil(64), 0);
        Ok(Assembly { shape, whole, support, voxels, given, n_given: 0 })
    }

    /// Nothing for a piece without samples.
    pub(super) fn place_of(&self, i: usize, extent: &[i64; 6]) -> Result<Option<PieceBox>, ReadError> {
        PieceBox::find(i, extent, &self.whole, self.support)
    }

    /// The shape of a piece in the type of the image.
    pub(super) fn shape_of(&self, place: PieceBox) -> Result<CheckedShape, ReadError> {
        CheckedShape::claim(place.dims, self.shape.voxel, &self.shape.limits)
    }

    pub(super) fn put(&mut self, piece: &Voxels, place: PieceBox) {
        let [image_x, image_y, _] = self.shape.dims.to_array().map(|n| n as usize);
        let [nx, ny, nz] = place.dims.map(|n| n as usize);
        for z in 0..nz {
            for y in 0..ny {
                let to = ((place.start[2] + z) * image_y + place.start[1] + y) * image_x + place.start[0];
                copy_samples(&mut self.voxels, to, piece, (z * ny + y) * nx, nx);
                self.mark(to, nx);
            }
        }
    }

    fn mark(&mut self, start: usize, n: usize) {
        for i in start..start + n {
            let bit = 1 << (i % 64);
            self.n_given += usize::from(self.given[i / 64] & bit == 0);
            self.given[i / 64] |= bit;
        }
    }

    /// # Errors
    /// If there are samples that no piece gave.
    pub(super) fn finish(self) -> Result<Voxels, ReadError> {
        let n_voxels = self.shape.n_voxels();
        match self.n_given == n_voxels {
            true => Ok(self.voxels),
            false => {
                let what = "all pieces together".to_owned();
                Err(ReadError::TooFewSamples { what, found: self.n_given, expected: n_voxels })
            }
        }
    }
}

/// Copies samples between voxels of one type.
fn copy_samples(to: &mut Voxels, to_start: usize, from: &Voxels, from_start: usize, n: usize) {
    macro_rules! copy {
        ($($kind:ident)*) => {
            match (to, from) {
                $((Voxels::$kind(to), Voxels::$kind(from)) => {
                    to[to_start..to_start + n].copy_from_slice(&from[from_start..from_start + n]);
                })*
                // All pieces are read into the type of the image.
                _ => {}
            }
        };
    }
    copy!(U8 I8 U16 I16 U32 I32 F32 F64);
}
