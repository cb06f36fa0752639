//! Writing attached NRRD files.

use std::io::{self, Write};
use std::path::Path;

use brickfield_core::glam::DVec3;
use brickfield_core::{ScalarType, Volume};

use crate::save::{SaveError, save_atomically, write_samples};
use crate::{ByteOrder, WorldFrame};

/// How the samples of an NRRD are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NrrdEncoding {
    /// As they are, little-endian.
    Raw,
    /// Compressed, little-endian.
    #[cfg(feature = "gzip")]
    Gzip,
}

/// Saves a volume as attached NRRD (`.nrrd`): whole or not at all, for the file is renamed into place.
///
/// # Errors
/// If the folder cannot be written to.
pub fn save(path: &Path, volume: &Volume, frame: WorldFrame, encoding: NrrdEncoding) -> Result<(), SaveError> {
    save_atomically(path, |out| write(out, volume, frame, encoding))
}

/// Writes a volume as attached NRRD.
///
/// # Errors
/// The errors of `out`.
pub fn write(mut out: impl Write, volume: &Volume, frame: WorldFrame, encoding: NrrdEncoding) -> io::Result<()> {
    out.write_all(header(volume, frame, encoding).as_bytes())?;
    match encoding {
        NrrdEncoding::Raw => write_samples(&mut out, volume.voxels(), ByteOrder::Little),
        #[cfg(feature = "gzip")]
        NrrdEncoding::Gzip => {
            let mut gz = flate2::write::GzEncoder::new(out, flate2::Compression::default());
            write_samples(&mut gz, volume.voxels(), ByteOrder::Little)?;
            gz.finish()?.flush()
        }
    }
}

fn header(volume: &Volume, frame: WorldFrame, encoding: NrrdEncoding) -> String {
    let grid = volume.grid();
    let dims = grid.dims();
    let map = grid.index_to_world();
    let steps = map.matrix3;
    let first_sample = map.transform_point3(DVec3::splat(0.5));
    let space = match frame {
        WorldFrame::Lps => "space: left-posterior-superior",
        WorldFrame::Pictures | WorldFrame::Plain => "space dimension: 3",
    };
    let encoding = match encoding {
        NrrdEncoding::Raw => "raw",
        #[cfg(feature = "gzip")]
        NrrdEncoding::Gzip => "gzip",
    };
    format!(
        "NRRD0004\ntype: {}\ndimension: 3\n{space}\nsizes: {} {} {}\nspace directions: {} {} {}\n\
         kinds: domain domain domain\nendian: little\nencoding: {encoding}\nspace origin: {}\n\n",
        type_name(volume.scalar_type()),
        dims.x,
        dims.y,
        dims.z,
        vector(steps.x_axis),
        vector(steps.y_axis),
        vector(steps.z_axis),
        vector(first_sample),
    )
}

fn vector(v: DVec3) -> String {
    format!("({},{},{})", v.x, v.y, v.z)
}

fn type_name(scalar: ScalarType) -> &'static str {
    match scalar {
        ScalarType::U8 => "uint8",
        ScalarType::I8 => "int8",
        ScalarType::U16 => "uint16",
        ScalarType::I16 => "int16",
        ScalarType::U32 => "uint32",
        ScalarType::I32 => "int32",
        ScalarType::F32 => "float",
        ScalarType::F64 => "double",
    }
}
