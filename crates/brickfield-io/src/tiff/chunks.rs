//! The samples of a page from its strips or tiles.

use std::ops::Range;

use super::directory::TiffFile;
use super::page::Page;
use super::predict::{RowShape, undo};
use super::unpack::{JpegShape, PageCompression, unpack};
use crate::limits::{Limits, check_bytes};
use crate::numbers::with_room;
use crate::packed_bits::{packed_row_bytes, widen_bits};
use crate::{ByteOrder, ReadError};

mod tag {
    pub(super) const STRIP_OFFSETS: u16 = 273;
    pub(super) const ROWS_PER_STRIP: u16 = 278;
    pub(super) const STRIP_BYTE_COUNTS: u16 = 279;
    pub(super) const TILE_WIDTH: u16 = 322;
    pub(super) const TILE_LENGTH: u16 = 323;
    pub(super) const TILE_OFFSETS: u16 = 324;
    pub(super) const TILE_BYTE_COUNTS: u16 = 325;
    pub(super) const JPEG_TABLES: u16 = 347;
    pub(super) const TILE_DEPTH: u16 = 32998;
}

/// Samples of a page, and how they are ordered in memory.
pub(super) struct PageSamples {
    pub(super) bytes: Vec<u8>,
    pub(super) order: ByteOrder,
    pub(super) n_chunks: u64,
    /// Strips or tiles that are not stored; their samples are 0.
    pub(super) n_missing: u64,
}

/// Where the strips or tiles of a page lie in it and in the file.
pub(super) struct Chunks {
    /// Samples of one along x, y, z.
    dims: [u64; 3],
    /// How many there are along x, y, z, and for how many samples of a pixel.
    counts: [u64; 4],
    is_tiled: bool,
    starts: Vec<u64>,
    /// Empty where the file does not say: that is common for uncompressed samples.
    lengths: Vec<u64>,
}

/// One strip or tile: the box of the page that it covers.
#[derive(Clone, Copy, Debug)]
struct Chunk {
    /// Its first sample.
    first: [u64; 3],
    /// Its samples, those beyond the page's edge included.
    dims: [u64; 3],
    /// The first sample of a pixel that it holds, and how many.
    samples: (usize, usize),
}

impl Chunks {
    pub(super) fn read(file: &mut TiffFile, page: &Page) -> Result<Chunks, ReadError> {
        let directory = &page.directory;
        let page_dims = [page.shape.width, page.shape.height, page.shape.depth].map(u64::from);
        let is_tiled = directory.contains(tag::TILE_WIDTH);
        let mut number = |tag, default: u64| Ok::<_, ReadError>(file.number(directory, tag)?.unwrap_or(default));
        let dims = match is_tiled {
            true => [number(tag::TILE_WIDTH, 0)?, number(tag::TILE_LENGTH, 0)?, number(tag::TILE_DEPTH, 1)?],
            false => [page_dims[0], number(tag::ROWS_PER_STRIP, page_dims[1])?.min(page_dims[1]), 1],
        };
        if dims.iter().any(|n| !(1..=u64::from(u32::MAX)).contains(n)) {
            let value = format!("{} x {} x {}", dims[0], dims[1], dims[2]);
            return Err(ReadError::field(
                format!("strip or tile of {}", page.name()),
                value,
                "1 to 4294967295 samples",
            ));
        }
        let per_axis = [0, 1, 2].map(|a| page_dims[a].div_ceil(dims[a]));
        let n_planes = if page.is_planar { page.shape.pixel.n_samples() as u64 } else { 1 };
        let counts = [per_axis[0], per_axis[1], per_axis[2], n_planes];
        // Some writers list tiles in the tags of strips.
        let in_tile_tags = directory.contains(tag::TILE_OFFSETS);
        let tags = if in_tile_tags { TILE_TAGS } else { STRIP_TAGS };
        let [starts, lengths] = tags.map(|tag| file.numbers(directory, tag).map(Option::unwrap_or_default));
        let chunks = Chunks { dims, counts, is_tiled, starts: starts?, lengths: lengths? };
        chunks.check(file, page)?;
        Ok(chunks)
    }

    /// Holds the numbers of strips or tiles, their end, and the size of one against their bounds.
    fn check(&self, file: &TiffFile, page: &Page) -> Result<(), ReadError> {
        let n_chunks = self.n_chunks();
        let are = if self.is_tiled { "tiles" } else { "strips" };
        let is_enough = |n: usize| n as u128 >= n_chunks;
        if !is_enough(self.starts.len()) {
            let field = format!("number of {are} of {}", page.name());
            return Err(ReadError::field(field, self.starts.len(), format!("{n_chunks} or more")));
        }
        if !is_enough(self.lengths.len()) && (page.compression != PageCompression::None || !self.lengths.is_empty()) {
            let field = format!("number of lengths of {are} of {}", page.name());
            return Err(ReadError::field(field, self.lengths.len(), n_chunks.to_string()));
        }
        let ends = self.starts.iter().zip(&self.lengths).map(|(start, n_bytes)| start.saturating_add(*n_bytes));
        match ends.take(n_chunks as usize).max().filter(|end| *end > file.n_bytes) {
            Some(end) => {
                Err(ReadError::EndsWithin { part: page.name().to_owned(), n_file_bytes: file.n_bytes, end: Some(end) })
            }
            None => Ok(()),
        }
    }

    fn n_chunks(&self) -> u128 {
        self.counts.iter().fold(1, |n: u128, m| n.saturating_mul(u128::from(*m)))
    }

    /// The position of the samples if they are all there, uncompressed and in one piece.
    pub(super) fn contiguous_start(&self, page: &Page) -> Option<u64> {
        let end = |i: usize| self.starts[i].checked_add(*self.lengths.get(i)?);
        let is_whole = page.compression == PageCompression::None && !self.is_tiled && self.counts[3] == 1;
        let n = self.n_chunks() as usize;
        (is_whole && (0..n - 1).all(|i| end(i) == Some(self.starts[i + 1]))).then_some(self.starts[0])
    }

    /// Numbers of the chunks that have any of the samples of a pixel.
    fn numbers_with(&self, kept: &Range<usize>) -> Range<u64> {
        let per_plane = self.counts[0] * self.counts[1] * self.counts[2];
        match self.counts[3] {
            1 => 0..per_plane,
            _ => kept.start as u64 * per_plane..kept.end as u64 * per_plane,
        }
    }

    fn chunk(&self, i: u64, page: &Page) -> Chunk {
        let [nx, ny, nz, _] = self.counts;
        let [x, y, z, plane] = [i % nx, i / nx % ny, i / (nx * ny) % nz, i / (nx * ny * nz)];
        let first = [x * self.dims[0], y * self.dims[1], z * self.dims[2]];
        let mut dims = self.dims;
        if !self.is_tiled {
            dims[1] = dims[1].min(u64::from(page.shape.height) - first[1]);
        }
        let n_samples = if page.is_planar { 1 } else { page.shape.pixel.n_samples() };
        Chunk { first, dims, samples: (plane as usize, n_samples) }
    }
}

const STRIP_TAGS: [u16; 2] = [tag::STRIP_OFFSETS, tag::STRIP_BYTE_COUNTS];
const TILE_TAGS: [u16; 2] = [tag::TILE_OFFSETS, tag::TILE_BYTE_COUNTS];

impl Chunk {
    fn n_samples(&self) -> u128 {
        self.dims.iter().fold(self.samples.1 as u128, |n, m| n.saturating_mul(u128::from(*m)))
    }

    fn n_rows(&self) -> usize {
        (self.dims[1] * self.dims[2]) as usize
    }

    fn row_samples(&self) -> usize {
        self.dims[0] as usize * self.samples.1
    }
}

/// Reads the samples that are `kept` of each pixel. `shift` is added to the positions of all strips.
pub(super) fn read_samples(
    file: &mut TiffFile,
    page: &Page,
    kept: Range<usize>,
    shift: u64,
    limits: &Limits,
) -> Result<PageSamples, ReadError> {
    page.check_length(file.n_bytes, limits)?;
    let chunks = Chunks::read(file, page)?;
    let jpeg_tables = match page.compression {
        PageCompression::Jpeg => file.bytes(&page.directory, tag::JPEG_TABLES)?,
        _ => Vec::new(),
    };
    let mut samples = PageSamples { bytes: Vec::new(), order: file.order, n_chunks: 0, n_missing: 0 };
    for i in chunks.numbers_with(&kept) {
        let (chunk, stored) = (chunks.chunk(i, page), Stored::find(&chunks, i, shift));
        let decoded = stored.decode(file, page, &chunk, &jpeg_tables, limits)?;
        samples.add(decoded, page, &chunk, &kept)?;
    }
    Ok(samples)
}

/// Visits the samples of strips or tiles that are not stored: columns and rows of the page.
pub(super) fn visit_missing(
    file: &mut TiffFile,
    page: &Page,
    visit: &mut dyn FnMut(Range<u64>, Range<u64>),
) -> Result<(), ReadError> {
    let chunks = Chunks::read(file, page)?;
    for i in chunks.numbers_with(&(0..1)).filter(|i| Stored::find(&chunks, *i, 0).is_missing(page)) {
        let Chunk { first, dims, .. } = chunks.chunk(i, page);
        let [columns, rows] = [(0, page.shape.width), (1, page.shape.height)]
            .map(|(axis, n)| first[axis]..(first[axis] + dims[axis]).min(n.into()));
        visit(columns, rows);
    }
    Ok(())
}

impl PageSamples {
    /// Takes the samples of a chunk, or that it is not stored.
    fn add(
        &mut self,
        decoded: Option<(Vec<u8>, ByteOrder)>,
        page: &Page,
        chunk: &Chunk,
        kept: &Range<usize>,
    ) -> Result<(), ReadError> {
        // Allocated when the first strip has been decoded, so that a page which cannot be costs nothing.
        if self.bytes.is_empty() {
            let n_bytes = page.shape.n_pixels() as usize * kept.len() * page.shape.stored.n_bytes();
            self.bytes = with_room(n_bytes)?;
            self.bytes.resize(n_bytes, 0);
        }
        self.n_chunks += 1;
        match decoded {
            Some((bytes, order)) => {
                self.order = order;
                place(&mut self.bytes, &bytes, page, chunk, kept);
            }
            None => self.n_missing += 1,
        }
        Ok(())
    }
}

/// Copies the kept samples of a chunk to their places in the page.
fn place(out: &mut [u8], bytes: &[u8], page: &Page, chunk: &Chunk, kept: &Range<usize>) {
    let size = page.shape.stored.n_bytes();
    let page_dims = [page.shape.width, page.shape.height, page.shape.depth].map(|n| n as usize);
    let [x, y, z] = chunk.first.map(|n| n as usize);
    let [width, height, depth] = chunk.dims.map(|n| n as usize);
    let (first_sample, n_samples) = chunk.samples;
    let shared = kept.start.max(first_sample)..kept.end.min(first_sample + n_samples);
    let (n_in, n_out, n_shared) = (n_samples * size, kept.len() * size, shared.len() * size);
    let (skip_in, skip_out) = ((shared.start - first_sample) * size, (shared.start - kept.start) * size);
    let n_pixels = width.min(page_dims[0] - x);
    for k in 0..depth.min(page_dims[2] - z) {
        for j in 0..height.min(page_dims[1] - y) {
            let from = &bytes[(k * height + j) * width * n_in..][..n_pixels * n_in];
            let to = &mut out[(((z + k) * page_dims[1] + y + j) * page_dims[0] + x) * n_out..][..n_pixels * n_out];
            if n_shared == n_in && n_shared == n_out {
                to.copy_from_slice(from);
                continue;
            }
            for (to, from) in to.chunks_exact_mut(n_out).zip(from.chunks_exact(n_in)) {
                to[skip_out..skip_out + n_shared].copy_from_slice(&from[skip_in..skip_in + n_shared]);
            }
        }
    }
}

/// The bytes of a strip or tile in the file.
#[derive(Clone, Copy, Debug)]
struct Stored {
    start: u64,
    n_bytes: Option<u64>,
}

impl Stored {
    fn find(chunks: &Chunks, i: u64, shift: u64) -> Stored {
        let start = chunks.starts[i as usize];
        Stored { start: start.saturating_add(shift), n_bytes: chunks.lengths.get(i as usize).copied() }
    }

    fn is_missing(self, page: &Page) -> bool {
        let is_plain = page.compression == PageCompression::None;
        self.start == 0 || (self.n_bytes == Some(0) && !is_plain)
    }

    /// The samples, each of whole bytes, and their order; nothing where they are not stored.
    fn decode(
        self,
        file: &mut TiffFile,
        page: &Page,
        chunk: &Chunk,
        jpeg_tables: &[u8],
        limits: &Limits,
    ) -> Result<Option<(Vec<u8>, ByteOrder)>, ReadError> {
        if self.is_missing(page) {
            return Ok(None);
        }
        let what = || format!("a strip or tile of {}", page.name());
        let size = page.shape.stored.n_bytes();
        check_bytes(chunk.n_samples().saturating_mul(size as u128), limits, what)?;
        let packed_bytes = packed_row_bytes(chunk.row_samples(), page.n_bits) * chunk.n_rows();
        let packed = self.read(file, page, packed_bytes)?;
        let [width, height, ..] = [chunk.dims[0] as usize, chunk.n_rows()];
        let jpeg =
            JpegShape { width, height, n_samples: chunk.samples.1, is_ycbcr: page.is_ycbcr, tables: jpeg_tables };
        let mut bytes = unpack(packed, page.compression, packed_bytes, jpeg, page.name())?;
        if page.n_bits < 8 * size {
            let mut widened = with_room(chunk.n_samples() as usize * size)?;
            widen_bits(&bytes, chunk.row_samples(), page.n_bits, &mut widened);
            return Ok(Some((widened, ByteOrder::Little)));
        }
        let row = RowShape { n_samples: chunk.row_samples(), per_pixel: chunk.samples.1, sample_bytes: size };
        let order = undo(page.predictor, &mut bytes, row, file.order);
        Ok(Some((bytes, order)))
    }

    /// The compressed bytes, no more of them than may be of use.
    fn read(self, file: &mut TiffFile, page: &Page, unpacked_bytes: usize) -> Result<Vec<u8>, ReadError> {
        let n_unpacked = unpacked_bytes as u64;
        let n_bytes = match (page.compression, self.n_bytes) {
            (PageCompression::None, None | Some(0)) => n_unpacked,
            (PageCompression::None, Some(n)) => n.min(n_unpacked),
            (_, n) => n.unwrap_or(0).min(n_unpacked.saturating_mul(4).saturating_add(1 << 16)),
        };
        let end = self.start.saturating_add(n_bytes);
        if end > file.n_bytes {
            let part = page.name().to_owned();
            return Err(ReadError::EndsWithin { part, n_file_bytes: file.n_bytes, end: Some(end) });
        }
        let mut bytes = file.read_bytes(self.start, n_bytes).map_err(|e| ReadError::io(page.name(), e))?;
        if page.bits_are_reversed {
            bytes.iter_mut().for_each(|b| *b = b.reverse_bits());
        }
        Ok(bytes)
    }
}
