//! Writing attached MetaImage files.

use std::fmt::Write as _;
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

/// Saves a volume as attached MetaImage (`.mha`): whole or not at all, for the file is renamed into place.
///
/// # Errors
/// If the folder cannot be written to.
pub fn save(path: &Path, volume: &Volume, options: &SaveOptions) -> Result<Saved, SaveError> {
    save_atomically(path, |out| write(out, volume, options))
}

/// Writes a volume as attached MetaImage, little-endian. Of units it states um, mm and cm. A frame of pictures is a key of our own.
///
/// # Errors
/// The errors of `out`.
pub fn write(mut out: impl Write, volume: &Volume, options: &SaveOptions) -> io::Result<Saved> {
    let voxels = values(volume);
    let packed: Option<Vec<u8>> = match options.compression {
        #[cfg(feature = "gzip")]
        Compression::Lossless => {
            let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
            write_samples(&mut zlib, &voxels, ByteOrder::Little)?;
            Some(zlib.finish()?)
        }
        _ => None,
    };
    let n_packed = packed.as_ref().map(Vec::len);
    out.write_all(header(volume.grid(), voxels.scalar_type(), options, n_packed).as_bytes())?;
    match packed {
        Some(packed) => out.write_all(&packed)?,
        None => write_samples(&mut out, &voxels, ByteOrder::Little)?,
    }
    let stated = Stated { frame: options.frame, unit: unit(options).is_some() };
    Ok(Saved::of(Format::MetaImage, volume, voxels.scalar_type(), options, stated))
}

/// The units of length that MetaIO knows.
pub(super) const UNITS: [&str; 3] = ["um", "mm", "cm"];

fn unit(options: &SaveOptions) -> Option<&'static str> {
    unit_among(options.unit.as_deref()?, &UNITS)
}

fn header(grid: &Grid, scalar: ScalarType, options: &SaveOptions, n_packed: Option<usize>) -> String {
    let map = grid.index_to_world();
    let (spacing, first_sample) = (grid.spacing(), map.transform_point3(DVec3::splat(0.5)));
    let directions = [0, 1, 2].map(|axis| map.matrix3.col(axis) / spacing[axis]);
    let numbers = |list: &[DVec3]| {
        let all = list.iter().flat_map(|v| v.to_array()).map(|x| x.to_string());
        all.collect::<Vec<_>>().join(" ")
    };
    let mut text = "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n".to_owned();
    match n_packed {
        Some(n) => text += &format!("CompressedData = True\nCompressedDataSize = {n}\n"),
        None => text += "CompressedData = False\n",
    }
    text += &match options.frame {
        // The letters of the directions in which the axes of the identity go.
        WorldFrame::Lps => "AnatomicalOrientation = RAI\n".to_owned(),
        WorldFrame::Pictures => format!("{} = {}\n", WorldFrame::KEY, options.frame.name()),
        WorldFrame::Plain => String::new(),
    };
    if let Some(unit) = unit(options) {
        text += &format!("DistanceUnits = {unit}\n");
    }
    let dims = grid.dims();
    let _ = write!(
        text,
        "TransformMatrix = {}\nOffset = {}\nCenterOfRotation = 0 0 0\nElementSpacing = {}\nDimSize = {} {} {}\n\
         ElementType = {}\nElementDataFile = LOCAL\n",
        numbers(&directions),
        numbers(&[first_sample]),
        numbers(&[spacing]),
        dims.x,
        dims.y,
        dims.z,
        type_name(scalar)
    );
    text
}

fn type_name(scalar: ScalarType) -> &'static str {
    match scalar {
        ScalarType::U8 => "MET_UCHAR",
        ScalarType::I8 => "MET_CHAR",
        ScalarType::U16 => "MET_USHORT",
        ScalarType::I16 => "MET_SHORT",
        ScalarType::U32 => "MET_UINT",
        ScalarType::I32 => "MET_INT",
        ScalarType::F32 => "MET_FLOAT",
        ScalarType::F64 => "MET_DOUBLE",
    }
}
