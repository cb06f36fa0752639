//! Writing attached NRRD files.

use std::io::{self, Write};
use std::path::Path;

use brickfield_core::glam::DVec3;
use brickfield_core::{Grid, ScalarType, Volume};

#[cfg(feature = "gzip")]
use crate::Compression;
use crate::length_unit::unit_among;
use crate::save_note::Stated;
use crate::saved::{save_atomically, values, write_samples};
use crate::{ByteOrder, Format, SaveError, SaveOptions, Saved, WorldFrame};

/// Saves a volume as attached NRRD (`.nrrd`): whole or not at all, for the file is renamed into place.
///
/// # Errors
/// If the folder cannot be written to.
pub fn save(path: &Path, volume: &Volume, options: &SaveOptions) -> Result<Saved, SaveError> {
    save_atomically(path, |out| write(out, volume, options))
}

/// Writes a volume as attached NRRD, little-endian. A frame of pictures is a key of our own, for NRRD has no such space.
///
/// # Errors
/// The errors of `out`.
pub fn write(mut out: impl Write, volume: &Volume, options: &SaveOptions) -> io::Result<Saved> {
    let voxels = values(volume);
    let mut write_header =
        |encoding: &str| out.write_all(header(volume.grid(), voxels.scalar_type(), options, encoding).as_bytes());
    match options.compression {
        #[cfg(feature = "gzip")]
        Compression::Lossless => {
            write_header("gzip")?;
            let mut gz = flate2::write::GzEncoder::new(out, flate2::Compression::default());
            write_samples(&mut gz, &voxels, ByteOrder::Little)?;
            gz.finish()?.flush()?;
        }
        _ => {
            write_header("raw")?;
            write_samples(&mut out, &voxels, ByteOrder::Little)?;
        }
    }
    let stated = Stated { frame: options.frame, unit: unit(options).is_some() };
    Ok(Saved::of(Format::Nrrd, volume, voxels.scalar_type(), options, stated))
}

/// The unit as the header can have it: without quotes, and in ASCII, for some readers drop all else: of µm they have m.
fn unit(options: &SaveOptions) -> Option<&str> {
    let unit = options.unit.as_deref()?;
    let is_plain = unit.is_ascii() && !unit.contains(['"', '\n', '\r']);
    is_plain.then_some(unit).or_else(|| unit_among(unit, &["um", "angstrom", "in"]))
}

fn header(grid: &Grid, scalar: ScalarType, options: &SaveOptions, encoding: &str) -> String {
    let dims = grid.dims();
    let map = grid.index_to_world();
    let steps = map.matrix3;
    let first_sample = map.transform_point3(DVec3::splat(0.5));
    let (mut space, frame) = match options.frame {
        WorldFrame::Lps => ("space: left-posterior-superior".to_owned(), String::new()),
        WorldFrame::Plain => ("space dimension: 3".to_owned(), String::new()),
        WorldFrame::Pictures => {
            ("space dimension: 3".to_owned(), format!("{}:={}\n", WorldFrame::KEY, options.frame.name()))
        }
    };
    if let Some(unit) = unit(options) {
        space += &format!("\nspace units: \"{unit}\" \"{unit}\" \"{unit}\"");
    }
    format!(
        "NRRD0004\ntype: {}\ndimension: 3\n{space}\nsizes: {} {} {}\nspace directions: {} {} {}\n\
         kinds: domain domain domain\nendian: little\nencoding: {encoding}\nspace origin: {}\n{frame}\n",
        type_name(scalar),
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
