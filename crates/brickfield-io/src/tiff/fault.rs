//! Faults of the decoder, told by the page and by where the file ends.

use std::io::ErrorKind;

use ::tiff::TiffError;
use ::tiff::tags::{IfdPointer, Tag};

use super::PageDecoder;
use crate::ReadError;

/// The names of pages in errors. They are counted from 0 here, and from 1 in the text.
pub(super) struct PageNames {
    pub(super) n_file_bytes: u64,
    /// From the description until the pages have been counted.
    pub(super) n_pages: Option<u64>,
}

impl PageNames {
    pub(super) fn page(&self, page: usize) -> String {
        match self.n_pages {
            Some(n_pages) if (page as u64) < n_pages => format!("page {} of {n_pages}", page + 1),
            _ => format!("page {}", page + 1),
        }
    }

    /// A fault in the tags of a page.
    pub(super) fn tags_fault(&self, page: usize, fault: TiffError) -> ReadError {
        self.fault(format!("the tags of {}", self.page(page)), fault)
    }

    /// A fault on the way from the directory `before` to that of the next page.
    pub(super) fn next_fault(
        &self,
        page: usize,
        decoder: &mut PageDecoder,
        before: Option<IfdPointer>,
        fault: TiffError,
    ) -> ReadError {
        let next = before.and_then(|pointer| decoder.read_directory(pointer).ok()?.next());
        match next {
            Some(IfdPointer(start)) if start >= self.n_file_bytes => self.ends_before_tags(page, start),
            _ => self.tags_fault(page, fault),
        }
    }

    /// A directory that the file does not reach.
    pub(super) fn ends_before_tags(&self, page: usize, start: u64) -> ReadError {
        let part = format!("the tags of {}", self.page(page));
        ReadError::EndsBefore { part, n_file_bytes: self.n_file_bytes, start }
    }

    /// A fault in the samples of a page: often that the file ends before they do.
    pub(super) fn samples_fault(&self, page: usize, decoder: &mut PageDecoder, fault: TiffError) -> ReadError {
        match samples_end(decoder).filter(|end| *end > self.n_file_bytes) {
            Some(end) => {
                let (part, n_file_bytes) = (self.page(page), self.n_file_bytes);
                ReadError::EndsWithin { part, n_file_bytes, end: Some(end) }
            }
            None => self.fault(self.page(page), fault),
        }
    }

    fn fault(&self, part: String, fault: TiffError) -> ReadError {
        match fault {
            TiffError::IoError(e) if e.kind() == ErrorKind::UnexpectedEof => {
                ReadError::EndsWithin { part, n_file_bytes: self.n_file_bytes, end: None }
            }
            other => ReadError::decoder(part, other),
        }
    }
}

/// The position after the last strip or tile of the current page.
fn samples_end(decoder: &mut PageDecoder) -> Option<u64> {
    let mut numbers = |tag| decoder.find_tag_unsigned_vec::<u64>(tag).ok().flatten();
    let (starts, lengths) = match numbers(Tag::StripOffsets) {
        Some(starts) => (starts, numbers(Tag::StripByteCounts)?),
        None => (numbers(Tag::TileOffsets)?, numbers(Tag::TileByteCounts)?),
    };
    starts.iter().zip(&lengths).map(|(start, n_bytes)| start.saturating_add(*n_bytes)).max()
}
