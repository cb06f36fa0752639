//! A folder of pictures, TIFF or PNG, each of them a slice.
//!
//! Slices are in natural order of their names: 2 comes before 10. All are of one size and type. Their spacing is 1, for
//! pictures state none along the stack.

mod order;
#[cfg(feature = "png")]
mod png;

use brickfield_core::Voxels;
use brickfield_core::glam::DVec3;

use crate::files::{DataFiles, open_named, read_head};
use crate::guard::guarded;
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
use crate::pixel::{PictureShape, PixelPart};
use crate::placement::GridPlacement;
use crate::samples::allocate;
#[cfg(feature = "tiff")]
use crate::tiff::{TiffSlice, names_other_files};
use crate::{Format, Limits, Note, OpenOptions, Opened, ReadError};

/// Reads the pictures among the named files, the first of them on top; the outer corner of the first voxel is the world's
/// origin. TIFF goes before PNG where both are there. A single TIFF, or one whose description names other files, is read as
/// [`tiff::read`](crate::tiff::read) does.
///
/// # Errors
/// As [`ReadError`] lists them: no picture at all, and one that is wrong, unsupported, unlike the first or beyond the limits.
pub fn read(names: &[String], files: &dyn DataFiles, options: &OpenOptions) -> Result<Opened, ReadError> {
    guarded("picture", || read_from(names, files, options))
}

/// The formats of pictures that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum PictureKind {
    #[cfg(feature = "tiff")]
    Tiff,
    #[cfg(feature = "png")]
    Png,
}

impl PictureKind {
    /// The kind that a file begins as; 8 bytes suffice.
    pub(crate) fn of_head(head: &[u8]) -> Option<PictureKind> {
        match head {
            #[cfg(feature = "tiff")]
            _ if crate::format::is_tiff(head) => Some(PictureKind::Tiff),
            #[cfg(feature = "png")]
            _ if head.starts_with(b"\x89PNG\r\n\x1a\n") => Some(PictureKind::Png),
            _ => None,
        }
    }
}

fn read_from(names: &[String], files: &dyn DataFiles, options: &OpenOptions) -> Result<Opened, ReadError> {
    let mut found = FileFacts::pictures(Format::Pictures, options);
    let (kind, names) = pictures(names, files, &mut found.notes)?;
    #[cfg(feature = "tiff")]
    if kind == PictureKind::Tiff && (names.len() == 1 || names_other_files(&mut *open_named(files, names[0])?)?) {
        let mut opened = crate::tiff::read(open_named(files, names[0])?, files, options)?;
        opened.notes.extend(found.notes);
        return Ok(opened);
    }
    if let Some((n_missing, at)) = order::missing_numbers(&names) {
        let (before, after) = (names[at].to_owned(), names[at + 1].to_owned());
        found.notes.push(Note::NumbersMissing { n_missing, before, after });
    }
    let first = Slice::open(kind, names[0], files, &options.limits)?;
    let like = first.shape();
    first.shown().into_iter().for_each(|shown| found.notes.push(Note::AsStored { shown }));
    let part = like.pixel.choose(&mut found)?;
    let dims = [like.width.into(), like.height.into(), names.len() as u64];
    let shape = CheckedShape::claim(dims, part.stored(like.stored), &options.limits)?;
    let grid = GridPlacement::axis_aligned(DVec3::ONE, DVec3::splat(0.5)).grid(shape.dims)?;
    let mut voxels = None;
    for name in &names {
        let slice = Slice::open(kind, name, files, &options.limits)?;
        check_like(slice.shape(), name, like, names[0])?;
        slice.append(&mut voxels, &shape, part, &options.limits, &mut found.notes)?;
    }
    let voxels = shape.converted(voxels.ok_or(ReadError::Missing { field: "a picture" })?, &mut found.notes)?;
    found.finish(grid, voxels)
}

/// The kind of picture that is read, and the files of it in natural order.
fn pictures<'n>(
    names: &'n [String],
    files: &dyn DataFiles,
    notes: &mut Vec<Note>,
) -> Result<(PictureKind, Vec<&'n str>), ReadError> {
    let mut sorted: Vec<&str> = names.iter().map(String::as_str).collect();
    sorted.sort_by(|a, b| order::natural_order(a, b));
    let mut kinds = Vec::new();
    for name in &sorted {
        kinds.push(PictureKind::of_head(&read_head(&mut *open_named(files, name)?, 8)?));
    }
    let kind = kinds.iter().flatten().min().copied().ok_or(ReadError::Missing { field: "a TIFF or PNG picture" })?;
    let is_slice = |found: &Option<PictureKind>| *found == Some(kind);
    let mut skipped = sorted.iter().zip(&kinds).filter(|(_, found)| !is_slice(found));
    if let Some((first, found)) = skipped.next() {
        let reason = match found {
            None => "it is neither TIFF nor PNG",
            Some(_) => "the slices are TIFF files",
        };
        let (first, reason) = ((*first).to_owned(), reason.to_owned());
        notes.push(Note::FilesSkipped { n_files: 1 + skipped.count(), first, reason });
    }
    let slices = sorted.iter().zip(&kinds).filter(|(_, found)| is_slice(found)).map(|(name, _)| *name);
    Ok((kind, slices.collect()))
}

fn check_like(found: PictureShape, name: &str, like: PictureShape, first: &str) -> Result<(), ReadError> {
    if found == like {
        return Ok(());
    }
    Err(ReadError::field(format!("slice {name:?}"), found, format!("{like}, as {first:?}")))
}

/// An open picture.
struct Slice<'a> {
    name: &'a str,
    picture: Picture<'a>,
}

enum Picture<'a> {
    #[cfg(feature = "tiff")]
    Tiff(Box<TiffSlice<'a>>),
    #[cfg(feature = "png")]
    Png(Box<png::PngSlice<'a>>),
}

impl<'a> Slice<'a> {
    fn open(
        kind: PictureKind,
        name: &'a str,
        files: &'a dyn DataFiles,
        limits: &Limits,
    ) -> Result<Slice<'a>, ReadError> {
        let source = open_named(files, name)?;
        let picture = match kind {
            #[cfg(feature = "tiff")]
            PictureKind::Tiff => TiffSlice::open(source).map(|slice| Picture::Tiff(Box::new(slice))),
            #[cfg(feature = "png")]
            PictureKind::Png => png::PngSlice::open(source, limits).map(|slice| Picture::Png(Box::new(slice))),
        };
        let _ = limits;
        let picture = picture.map_err(|fault| ReadError::decoder(format!("slice {name:?}"), fault))?;
        Ok(Slice { name, picture })
    }

    fn shape(&self) -> PictureShape {
        match &self.picture {
            #[cfg(feature = "tiff")]
            Picture::Tiff(slice) => slice.shape(),
            #[cfg(feature = "png")]
            Picture::Png(slice) => slice.shape,
        }
    }

    /// How the file wants its values shown, where it matters.
    fn shown(&self) -> Option<&'static str> {
        match &self.picture {
            #[cfg(feature = "tiff")]
            Picture::Tiff(slice) => slice.shown(),
            #[cfg(feature = "png")]
            Picture::Png(_) => None,
        }
    }

    /// Appends one value for each pixel to the voxels, which the first slice makes.
    fn append(
        self,
        voxels: &mut Option<Voxels>,
        shape: &CheckedShape,
        part: PixelPart,
        limits: &Limits,
        notes: &mut Vec<Note>,
    ) -> Result<(), ReadError> {
        let voxels = match voxels {
            Some(voxels) => voxels,
            None => voxels.insert(allocate(shape)?),
        };
        let name = self.name;
        let appended = match self.picture {
            #[cfg(feature = "tiff")]
            Picture::Tiff(mut slice) => slice.append(voxels, part, limits, notes),
            #[cfg(feature = "png")]
            Picture::Png(mut slice) => slice.append(voxels, part, limits, name),
        };
        let _ = notes;
        appended.map_err(|fault| ReadError::decoder(format!("slice {name:?}"), fault))
    }
}
