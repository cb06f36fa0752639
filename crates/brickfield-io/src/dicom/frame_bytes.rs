//! The stored bytes of one frame: a piece of plain pixel data, or the unpacked fragments that make up the frame.

use std::io::SeekFrom;
use std::rc::Rc;

use super::codecs::{FrameShape, decode};
use super::elements::{Extent, PixelParts};
use super::headers::{Syntax, reverse_words};
use super::image::{Colour, Image};
use super::source::{Codec, DataSetSource, open_data_set};
use crate::error::check_length;
use crate::files::{ByteSource, DataFiles};
use crate::limits::check_bytes;
use crate::numbers::with_room;
use crate::samples::fill;
use crate::{Limits, ReadError};

/// Reads frames; the last file stays open.
pub(super) struct FrameReader<'a> {
    files: &'a dyn DataFiles,
    limits: &'a Limits,
    current: Option<OpenFile<'a>>,
}

struct OpenFile<'a> {
    image: Rc<Image>,
    data_set: DataSetSource<'a>,
    /// The first fragment of each frame, and the end of the last one; without the offset table.
    frame_starts: Vec<usize>,
}

impl<'a> FrameReader<'a> {
    pub(super) fn new(files: &'a dyn DataFiles, limits: &'a Limits) -> FrameReader<'a> {
        FrameReader { files, limits, current: None }
    }

    /// The words of a frame, low byte first. Those that had been packed have the samples of a pixel side by side.
    pub(super) fn read(&mut self, image: &Rc<Image>, frame: u32) -> Result<Vec<u8>, ReadError> {
        let n_bytes = u128::from(image.n_stored_samples()) * u128::from(image.bits.n_allocated.div_ceil(8));
        check_bytes(n_bytes, self.limits, || format!("a frame of {:?}", image.name))?;
        let file = self.opened(image)?;
        match &image.pixels.parts {
            PixelParts::Whole(extent) => file.plain(*extent, frame),
            PixelParts::Fragments(fragments) => file.unpacked(&fragments[1..], frame),
        }
    }

    fn opened(&mut self, image: &Rc<Image>) -> Result<&mut OpenFile<'a>, ReadError> {
        let is_open = self.current.as_ref().is_some_and(|file| Rc::ptr_eq(&file.image, image));
        if !is_open {
            let mut data_set = open_data_set(&image.name, self.files, self.limits)?;
            let frame_starts = match &image.pixels.parts {
                PixelParts::Whole(_) => Vec::new(),
                PixelParts::Fragments(fragments) => frame_starts(image, fragments, &mut *data_set.source)?,
            };
            self.current = Some(OpenFile { image: image.clone(), data_set, frame_starts });
        }
        self.current.as_mut().ok_or(ReadError::Empty)
    }
}

impl OpenFile<'_> {
    fn plain(&mut self, extent: Extent, frame: u32) -> Result<Vec<u8>, ReadError> {
        let image = self.image.clone();
        check_length(&image.name, extent.n_bytes, image.n_plain_bytes())?;
        let (n_samples, n_bits) = (image.n_stored_samples(), u64::from(image.bits.n_allocated));
        if n_bits == 1 {
            let first = n_samples * u64::from(frame);
            let packed = self.bytes(extent.start + first / 8, (first % 8 + n_samples).div_ceil(8))?;
            let bit = |i: u64| (packed[(i / 8) as usize] >> (i % 8)) & 1;
            return Ok((first % 8..first % 8 + n_samples).map(bit).collect());
        }
        let n_bytes = n_samples * n_bits / 8;
        let start = extent.start + n_bytes * u64::from(frame);
        if self.data_set.syntax != Syntax::ExplicitBig {
            return self.bytes(start, n_bytes);
        }
        // Bytes are stored as words where the representation says so.
        let word_bytes = if n_bits == 8 && &image.pixels.vr == b"OW" { 2 } else { n_bits / 8 };
        let n_before = (start - extent.start) % word_bytes;
        let mut bytes = self.bytes(start - n_before, (n_before + n_bytes).next_multiple_of(word_bytes))?;
        reverse_words(&mut bytes, word_bytes as usize);
        bytes.drain(..n_before as usize);
        bytes.truncate(n_bytes as usize);
        Ok(bytes)
    }

    fn unpacked(&mut self, fragments: &[Extent], frame: u32) -> Result<Vec<u8>, ReadError> {
        let image = self.image.clone();
        let (first, end) = (self.frame_starts[frame as usize], self.frame_starts[frame as usize + 1]);
        let mut packed = Vec::new();
        for fragment in &fragments[first..end] {
            packed.append(&mut self.bytes(fragment.start, fragment.n_bytes)?);
        }
        let shape = FrameShape {
            columns: image.columns as usize,
            rows: image.rows as usize,
            n_channels: (image.n_stored_samples() / image.n_pixels()) as usize,
            n_bits_allocated: image.bits.n_allocated,
            is_ybr: matches!(image.colour, Colour::Ybr | Colour::Ybr422),
        };
        let what = || format!("frame {frame} of {:?}", image.name);
        if image.bits.n_allocated < 8 {
            return Err(ReadError::unsupported(
                "BitsAllocated of packed frames",
                image.bits.n_allocated,
                "8 to 32 are",
            ));
        }
        decode(&image.codec, &packed, &shape).map_err(|e| ReadError::decoder(what(), e))
    }

    /// Bytes that lie within the file, by the walk over its elements.
    fn bytes(&mut self, start: u64, n_bytes: u64) -> Result<Vec<u8>, ReadError> {
        let bytes = read_at(&mut *self.data_set.source, start, n_bytes, "the pixel data")?;
        check_length(&self.image.name, bytes.len() as u64, n_bytes.into())?;
        Ok(bytes)
    }
}

const ITEM_HEADER_BYTES: u64 = 8;

/// Which fragment each frame begins with: one for each, or as offset tables say, or where codestreams begin.
fn frame_starts(image: &Image, all: &[Extent], source: &mut dyn ByteSource) -> Result<Vec<usize>, ReadError> {
    let (n_frames, table, fragments) = (image.n_frames as usize, all[0], &all[1..]);
    if n_frames == fragments.len() {
        return Ok((0..=n_frames).collect());
    }
    let offsets = match &image.extended_offsets {
        Some(offsets) => offsets.clone(),
        None => basic_offsets(table, source)?,
    };
    let of_offset = |offset: &u64| {
        let start = fragments[0].start.checked_add(*offset)?;
        fragments.binary_search_by_key(&start, |fragment| fragment.start).ok()
    };
    let of_table: Option<Vec<usize>> = offsets.iter().map(of_offset).collect();
    let is_usable =
        |starts: &Vec<usize>| starts.len() == n_frames && starts[0] == 0 && starts.is_sorted_by(|a, b| a < b);
    let starts = match of_table.filter(is_usable) {
        Some(starts) => Some(starts),
        None if n_frames == 1 => Some(vec![0]),
        None => Some(codestream_starts(image, fragments, source)?).filter(is_usable),
    };
    let expected = || format!("one for each of {n_frames} frames, or an offset table");
    let mut starts = starts.ok_or_else(|| ReadError::field("fragments", fragments.len(), expected()))?;
    starts.push(fragments.len());
    Ok(starts)
}

/// The first item of encapsulated pixel data: offsets of the frames' items, counted from the first fragment's.
fn basic_offsets(table: Extent, source: &mut dyn ByteSource) -> Result<Vec<u64>, ReadError> {
    debug_assert!(table.start >= ITEM_HEADER_BYTES);
    let bytes = read_at(source, table.start, table.n_bytes, FRAGMENTS)?;
    Ok(bytes.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b).into()).collect())
}

fn codestream_starts(
    image: &Image,
    fragments: &[Extent],
    source: &mut dyn ByteSource,
) -> Result<Vec<usize>, ReadError> {
    let magic: &[u8] = match image.codec {
        Codec::Jpeg | Codec::JpegLs => &[0xff, 0xd8, 0xff],
        _ => &[0xff, 0x4f, 0xff, 0x51],
    };
    let mut starts = Vec::new();
    for (i, fragment) in fragments.iter().enumerate() {
        if read_at(source, fragment.start, fragment.n_bytes.min(magic.len() as u64), FRAGMENTS)? == magic {
            starts.push(i);
        }
    }
    Ok(starts)
}

const FRAGMENTS: &str = "the fragments";

/// The bytes at a position, as far as the file goes; `what` names them in errors.
fn read_at(source: &mut dyn ByteSource, start: u64, n_bytes: u64, what: &str) -> Result<Vec<u8>, ReadError> {
    let fault = |e| ReadError::io(what, e);
    source.seek(SeekFrom::Start(start)).map_err(fault)?;
    let mut bytes = with_room(n_bytes as usize)?;
    bytes.resize(n_bytes as usize, 0);
    let n_read = fill(source, &mut bytes).map_err(fault)?;
    bytes.truncate(n_read);
    Ok(bytes)
}
