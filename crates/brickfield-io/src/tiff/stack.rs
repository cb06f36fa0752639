//! Which pages are the slices of the volume: from the descriptions of ImageJ and OME-TIFF, else all pages.

use brickfield_core::glam::DVec3;

use super::chunks::Chunks;
use super::files::{OneFile, Plane, StackFiles, check_name};
use super::imagej::ImageJ;
use super::ome::{FileRef, OmePage, OmeXml, PlaneIndex, PlaneTable};
use super::page::Page;
use crate::choice::Entries;
use crate::files::{open_named, read_head};
use crate::format::is_tiff;
use crate::length_unit::common_unit;
use crate::lines::MAX_HEADER_BYTES;
use crate::opened::FileFacts;
use crate::pixel::Pixel;
use crate::placement::AXES;
use crate::{ChoiceKind, Note, ReadError};

mod tag {
    pub(super) const IMAGE_DESCRIPTION: u16 = 270;
    pub(super) const SAMPLES_PER_PIXEL: u16 = 277;
    pub(super) const X_RESOLUTION: u16 = 282;
    pub(super) const Y_RESOLUTION: u16 = 283;
    /// UIC2Tag: a value for each plane.
    pub(super) const META_MORPH_PLANES: u16 = 33629;
}

/// The slices of a volume: an image, a channel and a time have been chosen.
pub(super) struct Stack {
    /// Slices, those of a page with depth being one.
    pub(super) n_planes: u64,
    order: PlaneOrder,
    /// Lengths along x, y, z and their units, as far as they are stated.
    spacing: [Option<f64>; 3],
    units: [Option<String>; 3],
    /// Whether the channels of the file are pages, and one of them was chosen.
    pub(super) has_channels: bool,
    /// Whether ImageJ or OME describes the image: its palette is how values are shown, not what they are.
    is_described: bool,
}

enum PlaneOrder {
    /// These pages.
    Pages(Vec<u64>),
    /// Planes of so many bytes after the first, in this order.
    Raw {
        plane_bytes: u64,
        planes: Vec<u64>,
    },
    Ome(Box<OmePlanes>),
}

struct OmePlanes {
    table: PlaneTable,
    channel: u64,
    time: u64,
    /// Names of the opened file: the document's own, and the one in it if it names a single file.
    own_uuid: Option<String>,
    own_name: Option<String>,
}

impl Stack {
    /// Reads the description of the first page, and chooses one image, channel and time.
    pub(super) fn describe(files: &mut StackFiles, found: &mut FileFacts) -> Result<Stack, ReadError> {
        let described = description(files.first())?;
        if let Described::Ome(document) = described {
            return Stack::of_ome(with_metadata_file(document, files)?, files, found);
        }
        note_reduced(files.first(), &mut found.notes);
        match described {
            Described::ImageJ(imagej) => Stack::of_imagej(imagej, files.first(), found),
            Described::RawPlanes(n_planes) => Stack::of_raw_planes(n_planes, files.first()),
            _ => Ok(Stack::of_pages(full_pages(files.first()))),
        }
    }

    fn of_raw_planes(n_planes: u64, file: &mut OneFile) -> Result<Stack, ReadError> {
        let Some(plane_bytes) = raw_plane_bytes(file, n_planes)? else {
            return Err(wrong_page_count(file.pages.len(), n_planes));
        };
        let order = PlaneOrder::Raw { plane_bytes, planes: (0..n_planes).collect() };
        Ok(Stack { n_planes, order, ..Stack::of_pages(Vec::new()) })
    }

    fn of_pages(pages: Vec<u64>) -> Stack {
        let n_planes = pages.len() as u64;
        let order = PlaneOrder::Pages(pages);
        let (spacing, units) = ([None; 3], [const { None }; 3]);
        Stack { n_planes, order, spacing, units, has_channels: false, is_described: false }
    }

    fn of_imagej(imagej: ImageJ, file: &mut OneFile, found: &mut FileFacts) -> Result<Stack, ReadError> {
        let pages = full_pages(file);
        let [x, y] = [resolution(file, tag::X_RESOLUTION)?, resolution(file, tag::Y_RESOLUTION)?];
        let n_described = imagej.n_pages();
        let (spacing, units) = ([x, y, imagej.spacing_z], imagej.units.clone());
        if n_described == 1 && pages.len() > 1 {
            return Ok(Stack { spacing, units, is_described: true, ..Stack::of_pages(pages) });
        }
        let plane_bytes = match pages.len() as u64 {
            n if n == n_described => None,
            1 => raw_plane_bytes(file, n_described)?,
            _ => None,
        };
        if plane_bytes.is_none() && pages.len() as u64 != n_described {
            return Err(wrong_page_count(pages.len(), n_described));
        }
        let channel = choose(found, ChoiceKind::Channel, Entries::Numbered(imagej.n_channels))?;
        let frame = choose(found, ChoiceKind::Time, Entries::Numbered(imagej.n_frames))?;
        let planes = (0..imagej.n_slices).map(|slice| imagej.page(channel, slice, frame));
        let order = match plane_bytes {
            Some(plane_bytes) => PlaneOrder::Raw { plane_bytes, planes: planes.collect() },
            None => PlaneOrder::Pages(planes.map(|i| pages[i as usize]).collect()),
        };
        let (n_planes, has_channels) = (imagej.n_slices, imagej.n_channels > 1);
        Ok(Stack { n_planes, order, spacing, units, has_channels, is_described: true })
    }

    fn of_ome(document: OmeXml, files: &mut StackFiles, found: &mut FileFacts) -> Result<Stack, ReadError> {
        let names = document.images.iter().map(|image| image.name.clone()).collect();
        let chosen = choose(found, ChoiceKind::Image, Entries::Named(names))?;
        let own_name = document.single_file();
        let image = &document.images[chosen as usize];
        let first = files.first();
        let directory = first.tiff.directory(first.pages[0].start, "page 1".to_owned())?;
        let samples_per_pixel = first.tiff.number(&directory, tag::SAMPLES_PER_PIXEL)?.unwrap_or(1).max(1);
        let n_channels = image.n_channels(samples_per_pixel);
        let entries = image.channel_names(n_channels).map_or(Entries::Numbered(n_channels), Entries::Named);
        let channel = if n_channels > 1 { choose(found, ChoiceKind::Channel, entries)? } else { 0 };
        let time = choose(found, ChoiceKind::Time, Entries::Numbered(image.size_t))?;
        let table = image.planes(n_channels);
        let planes = OmePlanes { table, channel, time, own_uuid: document.uuid.clone(), own_name };
        Ok(Stack {
            n_planes: image.size_z,
            order: PlaneOrder::Ome(Box::new(planes)),
            spacing: image.spacing,
            units: image.units.clone(),
            has_channels: n_channels > 1,
            is_described: true,
        })
    }

    /// A plane, or nothing where the file has none for it.
    pub(super) fn plane(&self, i: u64, files: &mut StackFiles) -> Result<Option<Plane>, ReadError> {
        match &self.order {
            PlaneOrder::Pages(pages) => Ok(Some(Plane { file: 0, page: pages[i as usize], shift: 0 })),
            PlaneOrder::Raw { plane_bytes, planes } => {
                Ok(Some(Plane { file: 0, page: 0, shift: plane_bytes.saturating_mul(planes[i as usize]) }))
            }
            PlaneOrder::Ome(planes) => planes.plane(i, files),
        }
    }

    /// The first plane that the file has.
    pub(super) fn first_plane(&self, files: &mut StackFiles) -> Result<Plane, ReadError> {
        for i in 0..self.n_planes {
            if let Some(plane) = self.plane(i, files)? {
                return Ok(plane);
            }
        }
        Err(ReadError::Missing { field: "a page for any plane of the image" })
    }

    /// World units per sample, 1 where none are stated, and their unit.
    pub(super) fn spacing(&self, notes: &mut Vec<Note>) -> (DVec3, Option<String>) {
        let units = [0, 1, 2].map(|i| self.units[i].as_deref().filter(|_| self.spacing[i].is_some()));
        let common = common_unit(units, notes);
        let is_used = [true, true, self.n_planes > 1];
        for (i, axis) in AXES.into_iter().enumerate() {
            if is_used[i] && self.spacing[i].is_none() && common.name.is_some() {
                notes.push(Note::SpacingAssumed { axis, reason: "is not stated" });
            }
        }
        let lengths = DVec3::from(self.spacing.map(|length| length.unwrap_or(1.0)));
        (lengths * common.factors, common.name)
    }

    /// The pixel, whose palette may be left aside.
    pub(super) fn pixel(&self, pixel: Pixel, notes: &mut Vec<Note>) -> Pixel {
        if pixel == Pixel::Palette && self.is_described {
            notes.push(Note::AsStored { shown: "through a palette" });
            return Pixel::Grey;
        }
        pixel
    }
}

impl OmePlanes {
    fn plane(&self, z: u64, files: &mut StackFiles) -> Result<Option<Plane>, ReadError> {
        let plane = PlaneIndex { z, c: self.channel, t: self.time };
        let Some(OmePage { file, page }) = self.table.page(plane) else { return Ok(None) };
        let file = match file.and_then(|file| self.other_name(file)) {
            Some(name) => files.number_of(name)?,
            None => 0,
        };
        Ok(Some(Plane { file, page, shift: 0 }))
    }

    /// The name of another file than the opened one. A file that was renamed still is its own.
    fn other_name<'a>(&self, file: &'a FileRef) -> Option<&'a str> {
        let name = file.name.as_deref()?;
        let is_own = match &self.own_uuid {
            Some(own) if !file.uuid.is_empty() => *own == file.uuid,
            _ => self.own_name.as_deref() == Some(name),
        };
        (!is_own).then_some(name)
    }
}

/// The choice of one of several. A single one without a name leaves the wish to others: the samples of a pixel are channels, too.
fn choose(found: &mut FileFacts, kind: ChoiceKind, entries: Entries) -> Result<u64, ReadError> {
    match entries {
        Entries::Numbered(1) => Ok(0),
        entries => found.choose(kind, entries),
    }
}

fn wrong_page_count(n_pages: usize, n_described: u64) -> ReadError {
    ReadError::field("number of pages", n_pages, format!("{n_described}, from the description"))
}

/// The description of the first page. A page may have several, and OME-XML goes before that of ImageJ.
pub(super) fn description(file: &mut OneFile) -> Result<Described, ReadError> {
    let directory = file.tiff.directory(file.pages[0].start, "page 1".to_owned())?;
    let texts = file.tiff.texts(&directory, tag::IMAGE_DESCRIPTION)?;
    if let Some(text) = texts.iter().find(|text| text.contains("<OME") || text.contains(":OME ")) {
        let document = OmeXml::of_text(text)?;
        if document.metadata_file.is_some() || !document.images.is_empty() {
            return Ok(Described::Ome(document));
        }
    }
    if let Some(text) = texts.iter().find(|text| text.starts_with("ImageJ=")) {
        return Ok(Described::ImageJ(ImageJ::of_text(text)));
    }
    let n_planes = match directory.n_values(tag::META_MORPH_PLANES) {
        0 => texts.iter().find_map(|text| truncated_planes(text)),
        n => Some(n),
    };
    let is_single = file.pages.len() == 1;
    Ok(n_planes.filter(|n| *n > 1 && is_single).map_or(Described::Otherwise, Described::RawPlanes))
}

/// The number of planes in a description by tifffile, where one page stands for all of them: the product of the shape but
/// for its last two axes, or the last three where there are samples of pixels.
fn truncated_planes(text: &str) -> Option<u64> {
    let (_, rest) = text.strip_prefix('{')?.split_once("\"shape\": [")?;
    let (shape, rest) = rest.split_once(']')?;
    let shape: Vec<u64> = shape.split(',').map(|n| n.trim().parse().ok()).collect::<Option<_>>()?;
    let n_page_axes = if rest.contains("YXS\"") { 3 } else { 2 };
    let n_stack_axes = shape.len().checked_sub(n_page_axes)?;
    let n_planes = shape[..n_stack_axes].iter().try_fold(1u64, |n, m| n.checked_mul(*m));
    n_planes.filter(|_| rest.contains("\"truncated\": true"))
}

/// What a description is.
pub(super) enum Described {
    Ome(OmeXml),
    ImageJ(ImageJ),
    /// So many planes, of which only the first has a page (MetaMorph, tifffile).
    RawPlanes(u64),
    Otherwise,
}

/// The document itself, or the one in the file that it refers to.
fn with_metadata_file(document: OmeXml, files: &mut StackFiles) -> Result<OmeXml, ReadError> {
    let Some(name) = &document.metadata_file else { return Ok(document) };
    check_name(name)?;
    let named = |fault| ReadError::decoder(format!("file {name:?}"), fault);
    let mut source = open_named(files.files, name)?;
    let bytes = read_head(&mut *source, MAX_HEADER_BYTES).map_err(named)?;
    let described = match is_tiff(&bytes) {
        false => OmeXml::of_text(&String::from_utf8_lossy(&bytes)),
        true => OneFile::open(source).and_then(|mut file| match description(&mut file)? {
            Described::Ome(document) => Ok(document),
            _ => Ok(OmeXml::default()),
        }),
    };
    let described = described.map_err(named)?;
    if described.images.is_empty() {
        return Err(named(ReadError::Missing { field: "the element Image of the OME-XML" }));
    }
    Ok(OmeXml { uuid: document.uuid, metadata_file: None, images: described.images })
}

/// Numbers of the pages that are no reduced copies of others.
fn full_pages(file: &OneFile) -> Vec<u64> {
    (0..).zip(&file.pages).filter(|(_, page)| !page.is_reduced).map(|(i, _)| i).collect()
}

fn note_reduced(file: &OneFile, notes: &mut Vec<Note>) {
    let n_pages = file.pages.iter().filter(|page| page.is_reduced).count();
    if n_pages > 0 {
        notes.push(Note::PagesSkipped { n_pages });
    }
}

/// Bytes of a plane, where the planes of a stack follow the only page without pages of their own. ImageJ writes stacks of
/// more than 4 GB so.
fn raw_plane_bytes(file: &mut OneFile, n_planes: u64) -> Result<Option<u64>, ReadError> {
    let page: Page = file.page(0, 0)?;
    let start = Chunks::read(&mut file.tiff, &page)?.contiguous_start(&page);
    let (Some(start), true) = (start, page.n_bits.is_multiple_of(8)) else { return Ok(None) };
    let plane_bytes = u64::try_from(page.shape.n_bytes()).unwrap_or(u64::MAX);
    let end = |n: u64| start.saturating_add(plane_bytes.saturating_mul(n));
    let n_file_bytes = file.tiff.n_bytes;
    // Planes before the tags end there at the latest.
    let is_before_tags = start < file.pages[0].start;
    if end(2) > n_file_bytes || (is_before_tags && end(n_planes) > file.pages[0].start) {
        return Ok(None);
    }
    if end(n_planes) > n_file_bytes {
        let n_whole = (n_file_bytes - start) / plane_bytes.max(1);
        let part = format!("plane {} of {n_planes}", n_whole + 1);
        return Err(ReadError::EndsWithin { part, n_file_bytes, end: Some(end(n_whole + 1)) });
    }
    Ok(Some(plane_bytes))
}

/// Units per pixel, from a tag of pixels per unit.
fn resolution(file: &mut OneFile, tag: u16) -> Result<Option<f64>, ReadError> {
    let directory = file.tiff.directory(file.pages[0].start, "page 1".to_owned())?;
    Ok(file.tiff.fraction(&directory, tag)?.map(|per_unit| 1.0 / per_unit))
}
