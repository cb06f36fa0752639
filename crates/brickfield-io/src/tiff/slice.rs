//! One TIFF file of a folder of slices.

use brickfield_core::Voxels;

use super::chunks::read_samples;
use super::files::OneFile;
use super::page::Page;
use super::stack::{Described, description};
use crate::files::ByteSource;
use crate::pixel::{KeptSamples, PictureShape, Pixel, PixelPart};
use crate::{Limits, Note, ReadError};

/// A file of one page.
pub(crate) struct TiffSlice<'a> {
    file: OneFile<'a>,
    page: Page,
}

impl<'a> TiffSlice<'a> {
    /// # Errors
    /// If it has several pages, reduced copies not counted, or a depth.
    pub(crate) fn open(source: Box<dyn ByteSource + 'a>) -> Result<TiffSlice<'a>, ReadError> {
        let mut file = OneFile::open(source)?;
        let full: Vec<usize> = (0..file.pages.len()).filter(|i| !file.pages[*i].is_reduced).collect();
        let [i] = full[..] else {
            return Err(ReadError::field("number of pages", full.len(), "1, as a slice of a folder has"));
        };
        let mut page = file.page(i as u64, 0)?;
        if page.shape.depth > 1 {
            return Err(ReadError::field("depth of a page", page.shape.depth, "1, as a slice of a folder has"));
        }
        let is_imagej = matches!(description(&mut file)?, Described::ImageJ(_));
        if is_imagej && page.shape.pixel == Pixel::Palette {
            (page.shape.pixel, page.shown) = (Pixel::Grey, Some("through a palette"));
        }
        Ok(TiffSlice { file, page })
    }

    pub(crate) fn shape(&self) -> PictureShape {
        self.page.shape
    }

    pub(crate) fn shown(&self) -> Option<&'static str> {
        self.page.shown
    }

    /// Appends one value for each pixel.
    pub(crate) fn append(
        &mut self,
        voxels: &mut Voxels,
        part: PixelPart,
        limits: &Limits,
        notes: &mut Vec<Note>,
    ) -> Result<(), ReadError> {
        let samples = read_samples(&mut self.file.tiff, &self.page, part.kept(), 0, limits)?;
        if samples.n_missing > 0 {
            note_missing(samples.n_missing, samples.n_chunks, notes);
        }
        let palette = self.page.palette(&mut self.file.tiff)?;
        let (stored, n_pixels) = (self.page.shape.stored, self.page.shape.n_pixels() as usize);
        let kept = KeptSamples { bytes: &samples.bytes, order: samples.order, stored, n_pixels, palette: &palette };
        part.append(voxels, kept, limits, self.page.name())
    }
}

/// One note for all slices.
fn note_missing(n_more: u64, n_more_chunks: u64, notes: &mut Vec<Note>) {
    for note in notes.iter_mut() {
        if let Note::MissingChunks { n_missing, n_chunks } = note {
            *n_missing += n_more;
            *n_chunks += n_more_chunks;
            return;
        }
    }
    notes.push(Note::MissingChunks { n_missing: n_more, n_chunks: n_more_chunks });
}

/// Whether the file's OME-XML names several files, so that it is a part of their stack.
pub(crate) fn names_other_files(source: &mut dyn ByteSource) -> Result<bool, ReadError> {
    let mut file = OneFile::open(Box::new(source))?;
    match description(&mut file)? {
        Described::Ome(document) => Ok(document.metadata_file.is_some() || document.names_several_files()),
        _ => Ok(false),
    }
}
