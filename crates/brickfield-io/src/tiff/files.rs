//! The files of a stack: the one that was opened, and those that its OME-XML names.

use super::directory::{PageStart, TiffFile, page_name};
use super::page::Page;
use crate::ReadError;
use crate::files::{ByteSource, DataFiles, open_named, stays_within};

/// The tag of the pages inside a page: its reduced copies in a pyramid.
pub(super) const SUB_IFDS: u16 = 330;

/// The files of a stack. One file besides the first is open at a time: there may be thousands.
pub(super) struct StackFiles<'a> {
    first: OneFile<'a>,
    /// Names of the others.
    others: Vec<String>,
    /// The number of the open one among the others, from 0.
    open: Option<(usize, OneFile<'a>)>,
    pub(super) files: &'a dyn DataFiles,
}

/// An open file and its pages.
pub(super) struct OneFile<'a> {
    pub(super) tiff: TiffFile<'a>,
    pub(super) pages: Vec<PageStart>,
}

/// A plane of the stack: a page of a file, 0 being the one that was opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Plane {
    pub(super) file: usize,
    pub(super) page: u64,
    /// What is added to the positions of its strips: planes may follow each other without pages of their own.
    pub(super) shift: u64,
}

impl<'a> OneFile<'a> {
    pub(super) fn open(source: Box<dyn ByteSource + 'a>) -> Result<OneFile<'a>, ReadError> {
        let mut tiff = TiffFile::open(source)?;
        let pages = tiff.pages()?;
        Ok(OneFile { tiff, pages })
    }

    /// A page, or of its reduced copies the one of a level above 0.
    pub(super) fn page(&mut self, page: u64, level: u64) -> Result<Page, ReadError> {
        let n_pages = self.pages.len();
        let start = usize::try_from(page).ok().and_then(|i| self.pages.get(i)).ok_or_else(|| {
            let expected = format!("{} or more, from the description", page.saturating_add(1));
            ReadError::field("number of pages", n_pages, expected)
        })?;
        let mut directory = self.tiff.directory(start.start, numbered(page, n_pages))?;
        if level > 0 {
            let levels = self.tiff.numbers(&directory, SUB_IFDS)?.unwrap_or_default();
            let start = usize::try_from(level - 1).ok().and_then(|i| levels.get(i)).ok_or_else(|| {
                let field = format!("number of levels of {}", directory.page);
                ReadError::field(field, levels.len() + 1, format!("{} or more", level + 1))
            })?;
            let name = format!("level {level} of {}", directory.page);
            directory = self.tiff.directory(*start, name)?;
        }
        Page::read(&mut self.tiff, directory)
    }
}

fn numbered(page: u64, n_pages: usize) -> String {
    format!("{} of {n_pages}", page_name(page))
}

impl<'a> StackFiles<'a> {
    pub(super) fn new(first: OneFile<'a>, files: &'a dyn DataFiles) -> StackFiles<'a> {
        StackFiles { first, others: Vec::new(), open: None, files }
    }

    pub(super) fn first(&mut self) -> &mut OneFile<'a> {
        &mut self.first
    }

    /// The number of a file that the OME-XML names. It must lie in the same folder.
    pub(super) fn number_of(&mut self, name: &str) -> Result<usize, ReadError> {
        check_name(name)?;
        let known = self.others.iter().position(|other| other == name);
        Ok(known.unwrap_or_else(|| {
            self.others.push(name.to_owned());
            self.others.len() - 1
        }) + 1)
    }

    /// Does something with a file, and names it in errors unless it is the one that was opened.
    pub(super) fn with<T>(
        &mut self,
        file: usize,
        read: impl FnOnce(&mut OneFile<'a>) -> Result<T, ReadError>,
    ) -> Result<T, ReadError> {
        let Some(other) = file.checked_sub(1) else { return read(&mut self.first) };
        let name = &self.others[other];
        let named = |fault| ReadError::decoder(format!("file {name:?}"), fault);
        let opened = match self.open.take().filter(|(i, _)| *i == other) {
            Some((_, opened)) => opened,
            None => OneFile::open(open_named(self.files, name)?).map_err(named)?,
        };
        let (_, opened) = self.open.insert((other, opened));
        read(opened).map_err(named)
    }
}

/// A name without a path.
pub(super) fn check_name(name: &str) -> Result<(), ReadError> {
    let is_plain = stays_within(name) && !name.contains('/');
    if is_plain { Ok(()) } else { Err(ReadError::field("FileName", name, "the name of a file in the same folder")) }
}
