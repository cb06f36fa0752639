//! Writing NIfTI files: NIfTI-1, which every reader knows, unless its 32-bit numbers would be seen; then NIfTI-2.

use std::io::{self, Write};
use std::path::Path;

use brickfield_core::glam::{DVec3, DVec4, UVec3};
use brickfield_core::{Rescale, ScalarType, ValueRange, Volume};

use super::header::UNITS;
use crate::length_unit::unit_among;
use crate::placement::{AXES, is_upright};
use crate::save_note::Stated;
use crate::saved::{save_atomically, write_samples};
use crate::{ByteOrder, Format, SaveError, SaveNote, SaveOptions, Saved, WorldFrame};

/// Saves a volume as NIfTI (`.nii`, `.nii.gz`): whole or not at all, for the file is renamed into place.
///
/// Voxels keep their type, with slope and intercept. The end of the name, `.nii` or `.nii.gz`, says whether they are compressed.
///
/// NIfTI-1 has dimensions up to 32,767 and lengths in f32. NIfTI-2 (2011) has 64 bits, and many programs do not open it (ITK
/// 5.4). It is written only if a dimension is larger, if f32 would move a corner of the volume by more than 1e-3 of the least
/// spacing, or change a value by more than 1e-2 of the step between stored integers (of stored floats: 1e-6 of the values'
/// range).
///
/// # Errors
/// If the folder cannot be written to.
pub fn save(path: &Path, volume: &Volume, options: &SaveOptions) -> Result<Saved, SaveError> {
    let is_gz = path.to_string_lossy().to_ascii_lowercase().ends_with(".gz");
    save_atomically(path, |out| match is_gz {
        true => {
            let mut gz = flate2::write::GzEncoder::new(out, flate2::Compression::default());
            let saved = write(&mut gz, volume, options)?;
            gz.finish()?.flush()?;
            Ok(saved)
        }
        false => write(out, volume, options),
    })
}

/// Writes a volume as NIfTI, little-endian and not compressed. The world is right-anterior-superior, so that x and y change
/// their sign; a frame that is not anatomical is written likewise, for NIfTI has no other. Only a plain one whose axes are those
/// of the volume, from its first sample on, is left unstated.
///
/// # Errors
/// The errors of `out`.
pub fn write(mut out: impl Write, volume: &Volume, options: &SaveOptions) -> io::Result<Saved> {
    let statements = Statements::of(volume, options);
    let beyond = statements.beyond_nifti_1(volume.range());
    match beyond {
        None => out.write_all(&statements.nifti_1())?,
        Some(_) => out.write_all(&statements.nifti_2())?,
    }
    write_samples(&mut out, volume.voxels(), ByteOrder::Little)?;
    let stated = Stated { frame: statements.frame(), unit: statements.units != 0 };
    let mut saved = Saved::of(Format::Nifti, volume, volume.scalar_type(), options, stated);
    saved.notes.extend(beyond.map(|reason| SaveNote::Nifti2 { reason }));
    Ok(saved)
}

/// NIfTI-1's dimensions are i16.
const MAX_DIM: u32 = i16::MAX as u32;
/// Rounding to f32 may move a corner of the volume by this part of the least spacing.
const MAX_SHIFT: f64 = 1e-3;
/// It may change a value by this part of the step between two stored integers,
const MAX_CHANGE_OF_STEP: f64 = 1e-2;
/// and where floats are stored by this part of the values' range.
const MAX_CHANGE_OF_RANGE: f64 = 1e-6;

/// The numbers of a header.
struct Statements {
    dims: [u32; 3],
    scalar: ScalarType,
    spacing: DVec3,
    /// The rows of the map from index to a right-anterior-superior world.
    rows: [[f64; 4]; 3],
    rescale: Rescale,
    units: u8,
    /// nifti1.h: 1 is the scanner's world, 2 another one, 0 none: there are lengths of voxels, and nothing else.
    code: u8,
}

impl Statements {
    fn of(volume: &Volume, options: &SaveOptions) -> Statements {
        let grid = volume.grid();
        let map = grid.index_to_world();
        let first_sample = map.transform_point3(DVec3::splat(0.5));
        let row = |axis: usize| {
            let sign = if axis < 2 { -1.0 } else { 1.0 };
            let m = map.matrix3;
            [m.x_axis[axis], m.y_axis[axis], m.z_axis[axis], first_sample[axis]].map(|v| sign * v)
        };
        let unit = options.unit.as_deref().and_then(|unit| unit_among(unit, &UNITS));
        let units = UNITS.iter().position(|name| Some(*name) == unit).map_or(0, |i| i as u8 + 1);
        Statements {
            dims: grid.dims().to_array(),
            scalar: volume.scalar_type(),
            spacing: grid.spacing(),
            rows: [row(0), row(1), row(2)],
            rescale: volume.rescale(),
            units,
            code: match options.frame {
                WorldFrame::Lps => 1,
                WorldFrame::Plain if first_sample == DVec3::ZERO && is_upright(grid) => 0,
                WorldFrame::Plain | WorldFrame::Pictures => 2,
            },
        }
    }

    /// Why NIfTI-1 does not do.
    fn beyond_nifti_1(&self, values: ValueRange) -> Option<String> {
        let (axes, dims) = (AXES.into_iter(), self.dims);
        if let Some((axis, n)) = axes.zip(dims).find(|(_, n)| *n > MAX_DIM) {
            return Some(format!("dimension {axis} is {n}, and NIfTI-1 has at most {MAX_DIM}"));
        }
        if !self.keep_place_in_f32() {
            return Some(format!("in NIfTI-1 (f32) a corner would move by more than {MAX_SHIFT} of the least spacing"));
        }
        (!self.keep_values_in_f32(values)).then(|| {
            let (slope, intercept) = (self.rescale.slope(), self.rescale.intercept());
            format!("in NIfTI-1 (f32) slope {slope} and intercept {intercept} would give other values")
        })
    }

    /// The frame in which the file is read.
    fn frame(&self) -> WorldFrame {
        if self.code == 0 { WorldFrame::Plain } else { WorldFrame::Lps }
    }

    fn keep_place_in_f32(&self) -> bool {
        let dims = UVec3::from(self.dims).as_dvec3();
        // No corner moves by more than the errors of all its terms together.
        let shift = DVec3::from(self.rows.map(|row| DVec4::from(row.map(f32_error)).dot(dims.extend(1.0))));
        let keeps_length = |axis| f32_error(self.spacing[axis]) * dims[axis] <= MAX_SHIFT * self.spacing[axis];
        shift.length() <= MAX_SHIFT * self.spacing.min_element() && (0..3).all(keeps_length)
    }

    fn keep_values_in_f32(&self, values: ValueRange) -> bool {
        let (slope, intercept) = (self.rescale.slope(), self.rescale.intercept());
        let Ok(rounded) = Rescale::new(f64::from(slope as f32), f64::from(intercept as f32)) else { return false };
        let max_change = match self.scalar {
            ScalarType::F32 | ScalarType::F64 => MAX_CHANGE_OF_RANGE * values.max - MAX_CHANGE_OF_RANGE * values.min,
            _ => MAX_CHANGE_OF_STEP * slope.abs(),
        };
        let stored = self.rescale.stored_range(values);
        // A linear map differs most from another one at an end.
        let change = |stored| (rounded.value(stored) - self.rescale.value(stored)).abs();
        change(stored.min) <= max_change && change(stored.max) <= max_change
    }

    /// nifti1.h: 348 bytes, and four for extensions, of which there are none.
    fn nifti_1(&self) -> Vec<u8> {
        let mut header = Header(vec![0; 352]);
        let [nx, ny, nz] = self.dims.map(|n| n as i16);
        header.put(0, [348i32].map(i32::to_le_bytes));
        header.put(40, [3, nx, ny, nz, 1, 1, 1, 1].map(i16::to_le_bytes));
        header.put(70, [self.datatype(), self.n_bits()].map(i16::to_le_bytes));
        header.put(76, self.pixdim().map(|v| (v as f32).to_le_bytes()));
        let f32s = |values: [f64; 3]| values.map(|v| (v as f32).to_le_bytes());
        header.put(108, f32s([352.0, self.rescale.slope(), self.rescale.intercept()]));
        header.put(123, [[self.units]]);
        header.put(254, [i16::from(self.code)].map(i16::to_le_bytes));
        for (at, row) in [280, 296, 312].into_iter().zip(&self.rows) {
            header.put(at, row.map(|v| (v as f32).to_le_bytes()));
        }
        header.put(344, [*b"n+1\0"]);
        header.0
    }

    /// nifti2.h: 540 bytes, and four for extensions, of which there are none.
    fn nifti_2(&self) -> Vec<u8> {
        let mut header = Header(vec![0; 544]);
        let [nx, ny, nz] = self.dims.map(i64::from);
        header.put(0, [540i32].map(i32::to_le_bytes));
        header.put(4, [*b"n+2\0\r\n\x1a\n"]);
        header.put(12, [self.datatype(), self.n_bits()].map(i16::to_le_bytes));
        header.put(16, [3, nx, ny, nz, 1, 1, 1, 1].map(i64::to_le_bytes));
        header.put(104, self.pixdim().map(f64::to_le_bytes));
        header.put(168, [544i64].map(i64::to_le_bytes));
        header.put(176, [self.rescale.slope(), self.rescale.intercept()].map(f64::to_le_bytes));
        header.put(348, [i32::from(self.code)].map(i32::to_le_bytes));
        for (at, row) in [400, 432, 464].into_iter().zip(&self.rows) {
            header.put(at, row.map(f64::to_le_bytes));
        }
        header.put(500, [i32::from(self.units)].map(i32::to_le_bytes));
        header.0
    }

    fn pixdim(&self) -> [f64; 8] {
        let DVec3 { x, y, z } = self.spacing;
        [1.0, x, y, z, 1.0, 1.0, 1.0, 1.0]
    }

    fn datatype(&self) -> i16 {
        match self.scalar {
            ScalarType::U8 => 2,
            ScalarType::I16 => 4,
            ScalarType::I32 => 8,
            ScalarType::F32 => 16,
            ScalarType::F64 => 64,
            ScalarType::I8 => 256,
            ScalarType::U16 => 512,
            ScalarType::U32 => 768,
        }
    }

    fn n_bits(&self) -> i16 {
        8 * self.scalar.n_bytes() as i16
    }
}

/// How much a number changes when it is rounded to f32.
fn f32_error(v: f64) -> f64 {
    (f64::from(v as f32) - v).abs()
}

/// A header's bytes.
struct Header(Vec<u8>);

impl Header {
    fn put<const N: usize, const M: usize>(&mut self, at: usize, numbers: [[u8; N]; M]) {
        self.0[at..at + N * M].copy_from_slice(numbers.as_flattened());
    }
}
