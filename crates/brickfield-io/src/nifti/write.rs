//! Writing NIfTI files: NIfTI-1 where it loses nothing that NIfTI-2 keeps, else NIfTI-2.

use std::io::{self, Write};
use std::path::Path;

use brickfield_core::glam::DVec3;
use brickfield_core::{Rescale, ScalarType, Volume};

use crate::saved::{save_atomically, write_samples};
use crate::{ByteOrder, SaveError, SaveOptions, WorldFrame};

/// Saves a volume as NIfTI (`.nii`, `.nii.gz`): whole or not at all, for the file is renamed into place.
///
/// NIfTI-1 stores lengths in 32 bits and dimensions up to 32,767; NIfTI-2 (2011) stores 64 bits. The first is written if
/// all of the volume's numbers are f32 numbers, else the second. The end of the name, `.nii` or `.nii.gz`, says whether it is
/// compressed. Voxels keep their type, with slope and intercept.
///
/// # Errors
/// If the folder cannot be written to.
pub fn save(path: &Path, volume: &Volume, options: &SaveOptions) -> Result<(), SaveError> {
    let is_gz = path.to_string_lossy().to_ascii_lowercase().ends_with(".gz");
    save_atomically(path, |out| match is_gz {
        true => {
            let mut gz = flate2::write::GzEncoder::new(out, flate2::Compression::default());
            write(&mut gz, volume, options)?;
            gz.finish()?.flush()
        }
        false => write(out, volume, options),
    })
}

/// Writes a volume as NIfTI, little-endian and not compressed. The world is right-anterior-superior, so that x and y change
/// their sign; a frame that is not anatomical is written likewise, for NIfTI has no other.
///
/// # Errors
/// The errors of `out`.
pub fn write(mut out: impl Write, volume: &Volume, options: &SaveOptions) -> io::Result<()> {
    let statements = Statements::of(volume, options);
    match statements.fit_nifti_1() {
        true => out.write_all(&statements.nifti_1())?,
        false => out.write_all(&statements.nifti_2())?,
    }
    write_samples(&mut out, volume.voxels(), ByteOrder::Little)
}

/// The numbers of a header.
struct Statements {
    dims: [u32; 3],
    scalar: ScalarType,
    spacing: DVec3,
    /// The rows of the map from index to a right-anterior-superior world.
    rows: [[f64; 4]; 3],
    rescale: Rescale,
    units: u8,
    /// nifti1.h: 1 is the scanner's world, 2 another one.
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
        let units = match options.unit.as_deref() {
            Some("m" | "meter") => 1,
            Some("mm" | "millimeter") => 2,
            Some("um" | "micrometer") => 3,
            _ => 0,
        };
        Statements {
            dims: grid.dims().to_array(),
            scalar: volume.scalar_type(),
            spacing: grid.spacing(),
            rows: [row(0), row(1), row(2)],
            rescale: volume.rescale(),
            units,
            code: if options.frame == WorldFrame::Lps { 1 } else { 2 },
        }
    }

    fn fit_nifti_1(&self) -> bool {
        let is_f32 = |v: &f64| f64::from(*v as f32) == *v;
        let lengths = self.rows.as_flattened().iter().chain([&self.spacing.x, &self.spacing.y, &self.spacing.z]);
        let rescale = [self.rescale.slope(), self.rescale.intercept()];
        self.dims.iter().all(|n| *n <= 32_767) && lengths.chain(&rescale).all(is_f32)
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

/// A header's bytes.
struct Header(Vec<u8>);

impl Header {
    fn put<const N: usize, const M: usize>(&mut self, at: usize, numbers: [[u8; N]; M]) {
        self.0[at..at + N * M].copy_from_slice(numbers.as_flattened());
    }
}
