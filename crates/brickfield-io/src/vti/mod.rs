//! VTK XML ImageData, .vti (vtk.org, "VTK XML Formats"). XML by `quick-xml`.
//!
//! Data as text, inline base64, appended raw and appended base64; zlib blocks; headers of 32 and 64 bits; both byte
//! orders. Not: lz4 and lzma, several pieces, more than one value per voxel.

mod blocks;
mod document;
mod inline;

use std::io::{BufRead, Read, Seek, SeekFrom};

use brickfield_core::glam::{DMat3, DVec3};
use brickfield_core::{ScalarType, Voxels};

use crate::choice::Entries;
use crate::error::check_length;
use crate::files::{ByteSource, n_bytes_left};
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
use crate::placement::GridPlacement;
use crate::samples::{allocate, append_binary, append_text, least_text_bytes};
use crate::{ChoiceKind, Format, OpenOptions, Opened, ReadError};
use blocks::{WordReader, check_plain, read_blocks};
use document::{Array, ArrayStorage, Document, Support};
use inline::{Base64Reader, UntilTag};

/// Reads a .vti file.
///
/// The active scalars of PointData are read, else its first array of one component, else CellData's in the same way.
/// Cell values are samples at cell centres. The world is the file's own.
///
/// # Errors
/// As [`ReadError`] lists them: a document that is wrong, unsupported or beyond the limits; data that are missing.
pub fn read(mut input: impl BufRead + Seek, options: &OpenOptions) -> Result<Opened, ReadError> {
    read_from(&mut input, options)
}

fn read_from(source: &mut dyn ByteSource, options: &OpenOptions) -> Result<Opened, ReadError> {
    let document = Document::read(source)?;
    let mut found = FileFacts::plain(Format::Vti, options);
    let array = choose(&document, &mut found)?;
    let scalar = scalar(&array.type_name)?;
    let shape = CheckedShape::claim(dims(&document.extent, array.support)?, scalar, &options.limits)?;
    let grid = placement(&document, array.support).grid(shape.dims)?;
    let voxels = read_array(source, &document, array, &shape)?;
    found.finish(grid, voxels)
}

/// The array that is wanted; without a wish the active scalars, else the first array of one component.
fn choose<'a>(document: &'a Document, found: &mut FileFacts) -> Result<&'a Array, ReadError> {
    let arrays = &document.arrays;
    let candidates = |support| arrays.iter().enumerate().filter(move |(_, a): &(usize, &Array)| a.support == support);
    let support = match candidates(Support::Points).next() {
        Some(_) => Support::Points,
        None => Support::Cells,
    };
    let active = match support {
        Support::Points => &document.point_scalars,
        Support::Cells => &document.cell_scalars,
    };
    let named = active.as_ref().and_then(|name| candidates(support).find(|(_, a)| a.name == *name));
    let single = || candidates(support).find(|(_, a)| a.n_components == 1 && scalar(&a.type_name).is_ok());
    let preferred = named.or_else(single).or_else(|| candidates(support).next());
    let (preferred, _) = preferred.ok_or_else(|| document.missing("a DataArray in PointData or CellData"))?;
    let names = arrays.iter().map(|a| a.name.clone()).collect();
    let array = &arrays[found.choose_or(ChoiceKind::Array, Entries::Named(names), preferred as u64)? as usize];
    if array.n_components != 1 {
        let value = format!("{} of array {}", array.n_components, array.name);
        return Err(ReadError::unsupported("NumberOfComponents", value, "1 is"));
    }
    Ok(array)
}

fn scalar(type_name: &str) -> Result<ScalarType, ReadError> {
    Ok(match type_name {
        "UInt8" => ScalarType::U8,
        "Int8" => ScalarType::I8,
        "UInt16" => ScalarType::U16,
        "Int16" => ScalarType::I16,
        "UInt32" => ScalarType::U32,
        "Int32" => ScalarType::I32,
        "Float32" => ScalarType::F32,
        "Float64" => ScalarType::F64,
        _ => return Err(ReadError::unsupported("DataArray type", type_name, crate::SCALARS)),
    })
}

/// Points from the first to the last of the extent; cells between them (at least one along a flat axis, as VTK has it).
fn dims(extent: &[i64; 6], support: Support) -> Result<[u64; 3], ReadError> {
    let mut dims = [0; 3];
    for (axis, dim) in dims.iter_mut().enumerate() {
        let [first, last] = [extent[2 * axis], extent[2 * axis + 1]].map(i128::from);
        let n_points = last - first + 1;
        let n = match support {
            Support::Points => n_points,
            Support::Cells if n_points == 1 => 1,
            Support::Cells => n_points - 1,
        };
        *dim =
            u64::try_from(n).map_err(|_| ReadError::field("Extent", format!("{first} to {last}"), "first <= last"))?;
    }
    Ok(dims)
}

fn placement(document: &Document, support: Support) -> GridPlacement {
    let to_sample = match support {
        Support::Points => DVec3::ZERO,
        Support::Cells => DVec3::splat(0.5),
    };
    let [x, _, y, _, z, _] = document.extent.map(|e| e as f64);
    // Direction is written row by row; column i is the direction of axis i.
    let direction = DMat3::from_cols_array(&document.direction).transpose();
    let steps = direction * DMat3::from_diagonal(DVec3::from(document.spacing));
    let first_sample = DVec3::from(document.origin) + steps * (DVec3::new(x, y, z) + to_sample);
    GridPlacement { first_sample, steps }
}

fn read_array(
    source: &mut dyn ByteSource,
    document: &Document,
    array: &Array,
    shape: &CheckedShape,
) -> Result<Voxels, ReadError> {
    let what = format!("DataArray {:?}", array.name);
    let position = document.position(array)?;
    source.seek(SeekFrom::Start(position)).map_err(|e| ReadError::io(&what, e))?;
    let n_left = n_bytes_left(source)?;
    match document.storage(array)? {
        ArrayStorage::Text => {
            check_length(&what, n_left, least_text_bytes(shape.n_voxels() as u128))?;
            let mut voxels = allocate(shape)?;
            append_text(&mut voxels, &mut UntilTag::new(source), shape.n_voxels(), shape.voxel, &what)?;
            Ok(voxels)
        }
        ArrayStorage::Raw => {
            let n_tail = n_closing_bytes(source, n_left).map_err(|e| ReadError::io(&what, e))?;
            read_binary(source, n_left - n_tail, document, shape, &what)
        }
        ArrayStorage::Base64 => {
            let mut decoded = Base64Reader::new(UntilTag::new(source));
            read_binary(&mut decoded, n_left / 4 * 3 + 3, document, shape, &what)
        }
    }
}

/// Bytes of the closing tags after raw data: of data that are cut short they must not become the last samples.
///
/// The source stays where it is.
fn n_closing_bytes(source: &mut dyn ByteSource, n_left: u64) -> std::io::Result<u64> {
    const TAG: &[u8] = b"</AppendedData";
    let n_tail = n_left.min(256);
    source.seek_relative((n_left - n_tail) as i64)?;
    let mut tail = vec![0; n_tail as usize];
    source.read_exact(&mut tail)?;
    source.seek_relative(-(n_left as i64))?;
    let tag = tail.windows(TAG.len()).rposition(|w| w == TAG);
    Ok(tag.map_or(0, |at| n_tail - at as u64))
}

/// `n_left` is the most bytes that the reader can give.
fn read_binary(
    reader: &mut dyn Read,
    n_left: u64,
    document: &Document,
    shape: &CheckedShape,
    what: &str,
) -> Result<Voxels, ReadError> {
    let mut words = WordReader { reader, size: document.word, order: document.order, what };
    let mut voxels;
    match document.is_compressed {
        false => {
            check_plain(&mut words, n_left, shape)?;
            voxels = allocate(shape)?;
            append_binary(&mut voxels, words.reader, shape.n_voxels(), shape.voxel, document.order, what)?;
        }
        true => {
            let mut blocks = read_blocks(words, n_left, shape)?;
            voxels = allocate(shape)?;
            append_binary(&mut voxels, &mut blocks, shape.n_voxels(), shape.voxel, document.order, what)?;
        }
    }
    Ok(voxels)
}
