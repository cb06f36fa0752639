//! Writing OME-Zarr 0.5: one image at one level.

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;
use std::{fs, io};

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Grid, Level, ScalarType, Volume, Voxels};
use serde_json::{Value, json};
use zarrs::array::{Array, ArraySubset, CodecOptions};
use zarrs::filesystem::FilesystemStore;
use zarrs::storage::ReadableWritableListableStorage;

use crate::length_unit::unit_among;
use crate::placement::{AXES, is_turned};
use crate::save_note::Stated;
use crate::saved::{UNFINISHED, folder_of, values};
use crate::{Compression, Format, SaveError, SaveOptions, Saved, WorldFrame};

/// Samples along a chunk's side.
const CHUNK_SIDE: u32 = 64;

/// Saves a volume as OME-Zarr 0.5 (Zarr v3): a folder, whole or not at all, for it is renamed into place.
///
/// # Errors
/// If there is something of this name; if the volume's axes are not those of the world, for OME-Zarr states spacing and
/// translation only; if the folder cannot be written to.
pub fn save(path: &Path, volume: &Volume, options: &SaveOptions) -> Result<Saved, SaveError> {
    let fault = |source| SaveError::Io { path: path.to_owned(), source };
    if let Some(fault) = turned(volume.grid()) {
        return Err(SaveError::Unsupported { path: path.to_owned(), format: Format::OmeZarr, fault });
    }
    if path.exists() {
        return Err(SaveError::IsThere { path: path.to_owned() });
    }
    let unfinished = tempfile::Builder::new().prefix(UNFINISHED).tempdir_in(folder_of(path)).map_err(fault)?;
    let folder = unfinished.path().join("image");
    let scalar = write(&folder, volume, options).map_err(|e| fault(io::Error::other(e)))?;
    fs::rename(&folder, path).map_err(fault)?;
    let stated = Stated { frame: options.frame, unit: true };
    Ok(Saved::of(Format::OmeZarr, volume, scalar, options, stated))
}

/// The fault of a volume whose axes are not those of the world.
fn turned(grid: &Grid) -> Option<String> {
    let axis = (0..3).find(|axis| is_turned(grid, *axis))?;
    Some(format!(
        "states no direction, and axis {} of the volume goes along {} in the world; save it as .nrrd, .mha, .nii or .nii.gz",
        AXES[axis],
        grid.index_to_world().matrix3.col(axis) / grid.spacing()[axis]
    ))
}

fn write(
    folder: &Path,
    volume: &Volume,
    options: &SaveOptions,
) -> Result<ScalarType, Box<dyn std::error::Error + Send + Sync>> {
    fs::create_dir(folder)?;
    fs::write(
        folder.join("zarr.json"),
        serde_json::to_vec_pretty(&group(volume.grid(), options, Level(0)..=Level(0)))?,
    )?;
    let voxels = values(volume);
    let store: ReadableWritableListableStorage = Arc::new(FilesystemStore::new(folder)?);
    let metadata = serde_json::from_value(array(volume.grid(), voxels.scalar_type(), options.compression))?;
    let array = Array::new_with_metadata(store, "/0", metadata)?;
    array.store_metadata()?;
    let all = ArraySubset::new_with_shape(array.shape().to_vec());
    // Chunks of zeros as well: a chunk that is missing might be a loss.
    let whole = CodecOptions::default().with_store_empty_chunks(true);
    match &*voxels {
        Voxels::U8(v) => array.store_array_subset_opt(&all, &v[..], &whole)?,
        Voxels::I8(v) => array.store_array_subset_opt(&all, &v[..], &whole)?,
        Voxels::U16(v) => array.store_array_subset_opt(&all, &v[..], &whole)?,
        Voxels::I16(v) => array.store_array_subset_opt(&all, &v[..], &whole)?,
        Voxels::U32(v) => array.store_array_subset_opt(&all, &v[..], &whole)?,
        Voxels::I32(v) => array.store_array_subset_opt(&all, &v[..], &whole)?,
        Voxels::F32(v) => array.store_array_subset_opt(&all, &v[..], &whole)?,
        Voxels::F64(v) => array.store_array_subset_opt(&all, &v[..], &whole)?,
    }
    Ok(voxels.scalar_type())
}

/// The metadata of an image of some levels of a volume, each of half as many samples along each axis as the one below, rounded up.
///
/// The samples of level l are means of 2^l voxels along each axis: the first one lies (2^l - 1) / 2 voxels after that of level 0.
pub(super) fn group(grid: &Grid, options: &SaveOptions, levels: RangeInclusive<Level>) -> Value {
    let axis = |name: &str| match unit(options) {
        Some(unit) => json!({ "name": name, "type": "space", "unit": unit }),
        None => json!({ "name": name, "type": "space" }),
    };
    let axes = ["z", "y", "x"].map(axis);
    let levels = levels.start().0..=levels.end().0;
    let datasets: Vec<_> = levels.map(|l| dataset(grid, Level(l), &l.to_string())).collect();
    let image = json!({ "axes": axes, "datasets": datasets });
    let mut attributes = json!({ "ome": { "version": "0.5", "multiscales": [image] } });
    // OME-Zarr 0.5 has no words for a frame; without any, readers have one of pictures.
    if options.frame != WorldFrame::Pictures {
        attributes[WorldFrame::KEY] = options.frame.name().into();
    }
    json!({
        "zarr_format": 3,
        "node_type": "group",
        "attributes": attributes
    })
}

/// The metadata of a level whose array has this path.
pub(super) fn dataset(grid: &Grid, level: Level, path: &str) -> Value {
    let first_sample = grid.index_to_world().transform_point3(DVec3::splat(0.5));
    // Along a short axis there is one sample, of all voxels.
    let n_voxels = grid.dims().min(UVec3::splat(level.stride())).as_dvec3();
    let slowest_first = |v: DVec3| [v.z, v.y, v.x];
    let scale = slowest_first(grid.spacing() * n_voxels);
    let translation = slowest_first(first_sample + grid.spacing() * (0.5 * (n_voxels - 1.0)));
    let transformations = json!([
        { "type": "scale", "scale": scale },
        { "type": "translation", "translation": translation }
    ]);
    json!({ "path": path, "coordinateTransformations": transformations })
}

/// The names of units of length (OME-Zarr 0.5, "axes" metadata).
const UNITS: [&str; 26] = [
    "angstrom",
    "attometer",
    "centimeter",
    "decimeter",
    "exameter",
    "femtometer",
    "foot",
    "gigameter",
    "hectometer",
    "inch",
    "kilometer",
    "megameter",
    "meter",
    "micrometer",
    "mile",
    "millimeter",
    "nanometer",
    "parsec",
    "petameter",
    "picometer",
    "terameter",
    "yard",
    "yoctometer",
    "yottameter",
    "zeptometer",
    "zettameter",
];

/// The unit, spelled out.
fn unit(options: &SaveOptions) -> Option<&str> {
    let unit = options.unit.as_deref()?;
    Some(unit_among(unit, &UNITS).unwrap_or(unit))
}

/// The metadata of the array.
fn array(grid: &Grid, scalar: ScalarType, compression: Compression) -> Value {
    let dims = grid.dims();
    let shape = [dims.z, dims.y, dims.x];
    let mut codecs = vec![little_endian()];
    if compression == Compression::Lossless {
        codecs.push(json!({ "name": "zstd", "configuration": { "level": 3, "checksum": false } }));
    }
    let (chunk_shape, data_type) = (shape.map(|n| n.min(CHUNK_SIDE)), data_type(scalar));
    json!({
        "zarr_format": 3,
        "node_type": "array",
        "shape": shape,
        "data_type": data_type,
        "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": chunk_shape } },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
        "fill_value": 0,
        "codecs": codecs,
        "dimension_names": ["z", "y", "x"]
    })
}

/// The codec of samples as they are.
pub(super) fn little_endian() -> Value {
    json!({ "name": "bytes", "configuration": { "endian": "little" } })
}

pub(super) fn data_type(scalar: ScalarType) -> &'static str {
    match scalar {
        ScalarType::U8 => "uint8",
        ScalarType::I8 => "int8",
        ScalarType::U16 => "uint16",
        ScalarType::I16 => "int16",
        ScalarType::U32 => "uint32",
        ScalarType::I32 => "int32",
        ScalarType::F32 => "float32",
        ScalarType::F64 => "float64",
    }
}
