//! VTK XML ImageData, .vti and .pvti (vtk.org, "VTK XML Formats"). XML by `quick-xml`.
//!
//! Data as text, inline base64, appended raw and appended base64; blocks of zlib, LZ4 (`lz4_flex`) and LZMA
//! (`lzma-rust2`); headers of 32 and 64 bits; both byte orders; pieces in one file or in several.

mod attributes;
mod blocks;
mod compressor;
mod document;
mod elements;
mod grids;
mod inline;
mod metered;
mod pieces;

use std::io::{BufRead, Read, Seek, SeekFrom};

use brickfield_core::Voxels;

use crate::error::check_length;
use crate::files::{ByteSource, DataFiles, n_bytes_left, open_named, stays_within};
use crate::grids::OPENED_BY;
use crate::guard::guarded;
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
use crate::samples::{allocate, append_text, least_text_bytes};
use crate::vtk_arrays::{VtkArray, VtkSample, choose, dims};
use crate::{Format, OpenOptions, Opened, ReadError};
use blocks::{WordReader, check_plain, read_blocks};
use document::{Array, ArrayStorage, Document, Piece};
use elements::read_document;
pub(crate) use grids::read_grids;
use inline::{Base64Reader, UntilTag};
use pieces::Assembly;

/// Reads a .vti or .pvti file; `files` finds the pieces of the latter.
///
/// The active scalars of PointData are read, else its first array of one component, else CellData's in the same way.
/// Cell values are samples at cell centres. The world is the file's own. Pieces have to cover the whole extent.
///
/// # Errors
/// As [`ReadError`] lists them: a document that is wrong, unsupported or beyond the limits; data that are missing.
pub fn read(mut input: impl BufRead + Seek, files: &dyn DataFiles, options: &OpenOptions) -> Result<Opened, ReadError> {
    guarded("VTK", || read_from(&mut input, files, options))
}

fn read_from(source: &mut dyn ByteSource, files: &dyn DataFiles, options: &OpenOptions) -> Result<Opened, ReadError> {
    let document = read_document(source)?;
    if let Some(name) = document.dataset.name_of_grid() {
        return Err(ReadError::unsupported("VTKFile type", name, OPENED_BY));
    }
    let mut found = FileFacts::plain(Format::Vti, options);
    let arrays = document.arrays();
    let chosen = choose(&arrays, &mut found)?;
    let about = chosen.map(|i| arrays[i]).ok_or_else(|| document.missing("a DataArray in PointData or CellData"))?;
    let geometry = &document.geometry;
    let voxel = about.voxel(&mut found)?;
    let shape = CheckedShape::claim(dims(&geometry.extent, about.support)?, voxel, &options.limits)?;
    let grid = geometry.placement(about.support, &mut found.notes).grid(shape.dims)?;
    let voxels = match &document.pieces[..] {
        [piece] if piece.extent == geometry.extent && !document.is_parallel => {
            read_array(source, &document, piece.array(0, about)?, &shape)?
        }
        _ => read_pieces(source, &document, files, about, &shape)?,
    };
    let voxels = shape.converted(voxels, &mut found.notes)?;
    found.finish(grid, voxels)
}

impl Piece {
    /// The array that the image has in all pieces; `i` counts them from 0.
    fn array(&self, i: usize, about: &VtkArray) -> Result<&Array, ReadError> {
        let is_same = |a: &&Array| a.about.name == about.name && a.about.support == about.support;
        let array = self.arrays.iter().find(is_same).ok_or_else(|| {
            let names: Vec<_> = self.arrays.iter().map(|a| a.about.name.as_str()).collect();
            ReadError::field(
                format!("arrays of piece {}", i + 1),
                names.join(", "),
                format!("one named {:?}", about.name),
            )
        })?;
        let kind = |a: &VtkArray| format!("{} of {}", a.n_components, a.type_name);
        match kind(&array.about) == kind(about) {
            true => Ok(array),
            false => {
                let field = format!("components of array {:?} in piece {}", about.name, i + 1);
                Err(ReadError::field(field, kind(&array.about), kind(about)))
            }
        }
    }
}

/// Reads the pieces of this document, or of the files that it names.
fn read_pieces(
    source: &mut dyn ByteSource,
    document: &Document,
    files: &dyn DataFiles,
    about: &VtkArray,
    shape: &CheckedShape,
) -> Result<Voxels, ReadError> {
    let mut assembly = Assembly::new(shape, document.geometry.extent, about.support)?;
    if !document.is_parallel {
        put_pieces(source, document, about, &mut assembly)?;
        return assembly.finish();
    }
    for piece in &document.pieces {
        let name = piece.source.as_deref().ok_or(ReadError::Missing { field: "the Source of a Piece" })?;
        if !stays_within(name) {
            return Err(ReadError::field("Source of a piece", name, "a path within the folder"));
        }
        let in_piece = |fault| ReadError::decoder(format!("data file {name:?}"), fault);
        let mut file = open_named(files, name)?;
        read_piece_file(&mut *file, about, &mut assembly).map_err(in_piece)?;
    }
    assembly.finish()
}

fn read_piece_file(file: &mut dyn ByteSource, about: &VtkArray, assembly: &mut Assembly) -> Result<(), ReadError> {
    let document = read_document(file)?;
    if let Some(name) = document.dataset.name_of_grid() {
        return Err(ReadError::unsupported("VTKFile type", name, "ImageData is, of a piece"));
    }
    match document.is_parallel {
        true => Err(ReadError::unsupported("VTKFile type", "PImageData", "ImageData is, of a piece")),
        false => put_pieces(file, &document, about, assembly),
    }
}

fn put_pieces(
    source: &mut dyn ByteSource,
    document: &Document,
    about: &VtkArray,
    assembly: &mut Assembly,
) -> Result<(), ReadError> {
    for (i, piece) in document.pieces.iter().enumerate() {
        let Some(place) = assembly.place_of(i, &piece.extent)? else { continue };
        let shape = assembly.shape_of(place)?;
        let voxels = read_array(source, document, piece.array(i, about)?, &shape)?;
        assembly.put(&voxels, place);
    }
    Ok(())
}

fn read_array(
    source: &mut dyn ByteSource,
    document: &Document,
    array: &Array,
    shape: &CheckedShape,
) -> Result<Voxels, ReadError> {
    let what = format!("DataArray {:?}", array.about.name);
    let sample = array.about.sample()?;
    let position = document.position(array)?;
    source.seek(SeekFrom::Start(position)).map_err(|e| ReadError::io(&what, e))?;
    let n_left = n_bytes_left(source)?;
    match document.storage(array)? {
        ArrayStorage::Text => {
            let n_numbers = shape.n_voxels() as u128 * u128::from(shape.voxel.n_components);
            check_length(&what, n_left, least_text_bytes(n_numbers))?;
            let mut voxels = allocate(shape)?;
            append_text(&mut voxels, &mut UntilTag::new(source), shape.n_voxels(), shape.voxel, &what)?;
            Ok(voxels)
        }
        ArrayStorage::Raw => {
            let n_tail = n_closing_bytes(source, n_left).map_err(|e| ReadError::io(&what, e))?;
            read_binary(source, n_left - n_tail, document, sample, shape, &what)
        }
        ArrayStorage::Base64 => {
            let mut decoded = Base64Reader::new(UntilTag::new(source));
            read_binary(&mut decoded, n_left / 4 * 3 + 3, document, sample, shape, &what)
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
    sample: VtkSample,
    shape: &CheckedShape,
    what: &str,
) -> Result<Voxels, ReadError> {
    let n_bytes = sample.n_bytes(shape.n_voxels() as u64 * shape.voxel.n_components);
    let mut words = WordReader { reader, size: document.word, order: document.order, what };
    let mut blocks;
    let bytes: &mut dyn Read = match document.compressor {
        None => {
            check_plain(&mut words, n_left, n_bytes)?;
            words.reader
        }
        Some(compressor) => {
            blocks = read_blocks(words, n_left, compressor, n_bytes)?;
            &mut blocks
        }
    };
    let mut voxels = allocate(shape)?;
    sample.append(&mut voxels, bytes, shape, document.order, what)?;
    Ok(voxels)
}
