//! TIFF and BigTIFF stacks: each page a slice, or several where it has a depth.
//!
//! The description that ImageJ or OME-TIFF write says which page is which slice, and the spacing. Without a description the
//! pages are in order and the spacing is 1, for the resolution tags of other writers are about paper. Strips and tiles
//! are decoded here, with decompressors from crates. Not: fax, JPEG 2000.

mod chunks;
mod directory;
mod elevation;
mod files;
mod imagej;
mod ome;
mod page;
mod predict;
mod slice;
mod stack;
mod unpack;

use std::io::{BufRead, Seek};

use brickfield_core::Voxels;
use brickfield_core::glam::DVec3;

use crate::choice::Entries;
use crate::files::{ByteSource, DataFiles};
use crate::guard::guarded;
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
use crate::pixel::{KeptSamples, PictureShape, PixelPart};
use crate::placement::GridPlacement;
use crate::samples::{allocate, append_zeros};
use crate::{ChoiceKind, Format, Limits, Note, OpenOptions, Opened, ReadError};
pub(crate) use elevation::{Elevations, GeoTags};
use files::{OneFile, Plane, SUB_IFDS, StackFiles};
use page::Page;
pub(crate) use slice::{TiffSlice, names_other_files};
use stack::Stack;

/// Reads a TIFF stack; the outer corner of the first voxel is the world's origin. `files` are those that OME-XML may name.
///
/// # Errors
/// As [`ReadError`] lists them: pages that are wrong, unsupported, unlike each other or beyond the limits.
pub fn read(mut input: impl BufRead + Seek, files: &dyn DataFiles, options: &OpenOptions) -> Result<Opened, ReadError> {
    guarded("TIFF", || read_from(&mut input, files, options))
}

fn read_from(source: &mut dyn ByteSource, files: &dyn DataFiles, options: &OpenOptions) -> Result<Opened, ReadError> {
    let mut found = FileFacts::pictures(Format::Tiff, options);
    let mut files = StackFiles::new(OneFile::open(Box::new(source))?, files);
    let stack = Stack::describe(&mut files, &mut found)?;
    let first = stack.first_plane(&mut files)?;
    let finest = files.with(first.file, |file| file.page(first.page, 0))?;
    let level = choose_level(&mut files, first, &finest, &mut found)?;
    let page = files.with(first.file, |file| file.page(first.page, level))?;
    files.with(first.file, |file| page.check_length(file.tiff.n_bytes, &options.limits))?;
    let part = choose_part(&stack, &page, &mut found)?;
    let PictureShape { width, height, depth, stored, .. } = page.shape;
    let dims = [width.into(), height.into(), stack.n_planes.saturating_mul(depth.into())];
    let shape = CheckedShape::claim(dims, part.stored(stored), &options.limits)?;
    let (spacing, unit) = stack.spacing(&mut found.notes);
    let spacing = spacing * coarsening(&finest.shape, &page.shape);
    let grid = GridPlacement::axis_aligned(spacing, 0.5 * spacing).grid(shape.dims)?;
    found.unit = unit;
    let planes =
        PlaneReader { level, part, like: page.shape, limits: options.limits, n_chunks: 0, n_missing_chunks: 0 };
    let voxels = planes.read_all(&stack, &mut files, &shape, &mut found.notes)?;
    let voxels = shape.converted(voxels, &mut found.notes)?;
    found.finish(grid, voxels)
}

/// The resolution that is wanted of a pyramid, else the finest.
fn choose_level(files: &mut StackFiles, first: Plane, finest: &Page, found: &mut FileFacts) -> Result<u64, ReadError> {
    let reduced = files.with(first.file, |file| file.tiff.numbers(&finest.directory, SUB_IFDS))?;
    let n_levels = 1 + reduced.map_or(0, |pages| pages.len() as u64);
    match n_levels {
        1 => Ok(0),
        n => Ok(found.choices.choose(ChoiceKind::Level, Entries::Numbered(n), 0)?.entry),
    }
}

fn choose_part(stack: &Stack, page: &Page, found: &mut FileFacts) -> Result<PixelPart, ReadError> {
    if let Some(shown) = page.shown {
        found.notes.push(Note::AsStored { shown });
    }
    let pixel = stack.pixel(page.shape.pixel, &mut found.notes);
    match stack.has_channels {
        true => Ok(pixel.default_part(&mut found.notes)),
        false => pixel.choose(found),
    }
}

/// Samples of the finest level for one of a coarser one.
fn coarsening(finest: &PictureShape, level: &PictureShape) -> DVec3 {
    let ratio = |finest: u32, level: u32| f64::from(finest) / f64::from(level);
    DVec3::new(ratio(finest.width, level.width), ratio(finest.height, level.height), 1.0)
}

/// Reads planes that are all alike.
struct PlaneReader {
    level: u64,
    part: PixelPart,
    like: PictureShape,
    limits: Limits,
    n_chunks: u64,
    n_missing_chunks: u64,
}

impl PlaneReader {
    fn read_all(
        mut self,
        stack: &Stack,
        files: &mut StackFiles,
        shape: &CheckedShape,
        notes: &mut Vec<Note>,
    ) -> Result<Voxels, ReadError> {
        let mut voxels = None;
        let mut n_missing = 0;
        for i in 0..stack.n_planes {
            match stack.plane(i, files)? {
                Some(plane) => files.with(plane.file, |file| self.append(&mut voxels, file, plane, shape))?,
                None => {
                    n_missing += 1;
                    append_zeros(made(&mut voxels, shape)?, self.like.n_pixels() as usize);
                }
            }
        }
        if n_missing > 0 {
            notes.push(Note::MissingPlanes { n_missing, n_planes: stack.n_planes });
        }
        if self.n_missing_chunks > 0 {
            notes.push(Note::MissingChunks { n_missing: self.n_missing_chunks, n_chunks: self.n_chunks });
        }
        voxels.ok_or(ReadError::Missing { field: "a page" })
    }

    fn append(
        &mut self,
        voxels: &mut Option<Voxels>,
        file: &mut OneFile,
        plane: Plane,
        shape: &CheckedShape,
    ) -> Result<(), ReadError> {
        let page = file.page(plane.page, self.level)?;
        if page.shape != self.like {
            let value = format!("{} ({})", page.shape, page.name());
            return Err(ReadError::field("page", value, format!("{}, as the first page", self.like)));
        }
        let samples = chunks::read_samples(&mut file.tiff, &page, self.part.kept(), plane.shift, &self.limits)?;
        self.n_chunks += samples.n_chunks;
        self.n_missing_chunks += samples.n_missing;
        let palette = page.palette(&mut file.tiff)?;
        let (order, stored, n_pixels) = (samples.order, page.shape.stored, page.shape.n_pixels() as usize);
        let kept = KeptSamples { bytes: &samples.bytes, order, stored, n_pixels, palette: &palette };
        // Allocated when the first page has been decoded, so that a page which cannot be costs nothing.
        self.part.append(made(voxels, shape)?, kept, &self.limits, page.name())
    }
}

/// The voxels, with room for all of them from the first use on.
fn made<'v>(voxels: &'v mut Option<Voxels>, shape: &CheckedShape) -> Result<&'v mut Voxels, ReadError> {
    match voxels {
        Some(voxels) => Ok(voxels),
        None => Ok(voxels.insert(allocate(shape)?)),
    }
}
