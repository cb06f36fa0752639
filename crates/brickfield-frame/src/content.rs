//! Contents that frames share, and the chunks of them that a device holds.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use brickfield_core::glam::UVec3;
use bytes::Bytes;

use crate::{PackedSamples, SampleFormat, Upload};

/// The identity of a content that does not change: equal bytes elsewhere are another content.
///
/// Contents are compared by identity, so that nothing of a frame is compared byte by byte, and nothing that a device holds is
/// kept alive on the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ContentId(u64);

impl ContentId {
    /// An identity that no other content of this process has.
    #[expect(clippy::new_without_default, reason = "each is another one: none is the default")]
    pub fn new() -> ContentId {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        ContentId(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// Bytes that do not change, with their identity; the samples of a slot may also be packed for devices.
#[derive(Debug)]
pub struct Chunk {
    id: ContentId,
    bytes: Bytes,
    packed: Option<PackedSamples>,
}

impl Chunk {
    /// A new content.
    pub fn new(bytes: impl Into<Box<[u8]>>) -> Chunk {
        Chunk::shared(Bytes::from(bytes.into()))
    }

    /// A new content of bytes that others may hold, too. Nothing is copied; what the bytes are a part of stays in memory as a whole.
    pub fn shared(bytes: Bytes) -> Chunk {
        Chunk { id: ContentId::new(), bytes, packed: None }
    }

    /// The samples of a slot, x of the texture fastest, as a device is to be brought them. With losses, they are the samples that come
    /// back.
    pub fn of_samples(extent: UVec3, format: SampleFormat, samples: Bytes, upload: Upload) -> Chunk {
        let packed = match upload {
            Upload::Plain => None,
            Upload::Packed { max_error } => PackedSamples::of(extent, format, &samples, max_error),
        };
        match packed {
            None => Chunk::shared(samples),
            Some((packed, restored)) => {
                Chunk { packed: Some(packed), ..Chunk::shared(restored.map_or(samples, Bytes::from)) }
            }
        }
    }

    /// The same content under another identity.
    #[must_use]
    pub fn renewed(&self) -> Chunk {
        Chunk { id: ContentId::new(), bytes: self.bytes.clone(), packed: self.packed.clone() }
    }

    /// The packed samples, which are what a device is brought if there are any.
    pub fn packed(&self) -> Option<&PackedSamples> {
        self.packed.as_ref()
    }

    /// Its identity.
    pub fn id(&self) -> ContentId {
        self.id
    }

    /// Its bytes.
    #[inline]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Chunks are equal if their bytes are.
impl PartialEq for Chunk {
    fn eq(&self, other: &Chunk) -> bool {
        self.id == other.id || self.bytes == other.bytes
    }
}

/// A list of bytes in chunks of equal size, each with an identity of its own: where one chunk changes, one is brought to the
/// device.
pub trait Chunked {
    /// The identity of the whole: the same while no chunk is another.
    fn id(&self) -> ContentId;
    /// Bytes of a chunk; the last one may have fewer.
    fn chunk_bytes(&self) -> usize;
    /// Number of chunks.
    fn n_chunks(&self) -> usize;
    /// A chunk; `None` if no shader reads it.
    fn chunk(&self, i: usize) -> Option<(ContentId, &[u8])>;

    /// Bytes of all chunks.
    fn n_bytes(&self) -> u64 {
        let Some(last) = self.n_chunks().checked_sub(1) else { return 0 };
        let of_last = self.chunk(last).map_or(self.chunk_bytes(), |(_, bytes)| bytes.len());
        (last * self.chunk_bytes() + of_last) as u64
    }
}

/// A table as shaders read it, in pages.
#[derive(Clone, Debug)]
pub(crate) struct Pages {
    bytes: Vec<u8>,
    page_bytes: usize,
    id: ContentId,
    pages: Vec<ContentId>,
}

/// Bytes of a table whose changes are brought to a device together.
const PAGE_BYTES: usize = 4096;

impl Pages {
    pub(crate) fn new(bytes: &[u8]) -> Pages {
        Pages::of(bytes, PAGE_BYTES)
    }

    /// A table in pages of so many bytes.
    pub(crate) fn of(bytes: &[u8], page_bytes: usize) -> Pages {
        let pages = (0..bytes.len().div_ceil(page_bytes)).map(|_| ContentId::new()).collect();
        Pages { bytes: bytes.to_vec(), page_bytes, id: ContentId::new(), pages }
    }

    /// Pages that are equal to those of a table before it keep their identity.
    pub(crate) fn follow(&mut self, before: &Pages) {
        if self.bytes == before.bytes {
            self.id = before.id;
        }
        let pages = self.bytes.chunks(self.page_bytes).zip(before.bytes.chunks(before.page_bytes));
        for ((own, (a, b)), id) in self.pages.iter_mut().zip(pages).zip(&before.pages) {
            if a == b {
                *own = *id;
            }
        }
    }
}

impl Chunked for Pages {
    fn id(&self) -> ContentId {
        self.id
    }

    fn chunk_bytes(&self) -> usize {
        self.page_bytes
    }

    fn n_chunks(&self) -> usize {
        self.pages.len()
    }

    fn chunk(&self, i: usize) -> Option<(ContentId, &[u8])> {
        let start = i * self.page_bytes;
        Some((self.pages[i], &self.bytes[start..self.bytes.len().min(start + self.page_bytes)]))
    }
}

/// Which chunks of a content a device holds copies of.
#[derive(Debug, Default)]
pub struct HeldChunks {
    whole: Option<ContentId>,
    chunks: Vec<Option<ContentId>>,
}

impl HeldChunks {
    /// Whether all of a content is held.
    pub fn has_all(&self, content: &dyn Chunked) -> bool {
        self.whole == Some(content.id())
    }

    /// The chunks that must be brought, in runs of chunks that follow one another.
    pub fn missing(&self, content: &dyn Chunked) -> Vec<Range<usize>> {
        if self.has_all(content) {
            return Vec::new();
        }
        let is_missing = |i: &usize| match (content.chunk(*i), self.chunks.get(*i)) {
            (Some((id, _)), held) => held != Some(&Some(id)),
            (None, _) => false,
        };
        let mut runs: Vec<Range<usize>> = Vec::new();
        for i in (0..content.n_chunks()).filter(is_missing) {
            match runs.last_mut() {
                Some(run) if run.end == i => run.end = i + 1,
                _ => runs.push(i..i + 1),
            }
        }
        runs
    }

    /// All of a content is held now.
    pub fn hold(&mut self, content: &dyn Chunked) {
        self.whole = Some(content.id());
        self.chunks.resize(self.chunks.len().max(content.n_chunks()), None);
        for (i, held) in self.chunks.iter_mut().enumerate().take(content.n_chunks()) {
            // A chunk that no shader reads stays as it is.
            if let Some((id, _)) = content.chunk(i) {
                *held = Some(id);
            }
        }
    }

    /// Nothing is held any more.
    pub fn forget(&mut self) {
        *self = HeldChunks::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    struct List(ContentId, Vec<Option<Arc<Chunk>>>);

    impl Chunked for List {
        fn id(&self) -> ContentId {
            self.0
        }
        fn chunk_bytes(&self) -> usize {
            1
        }
        fn n_chunks(&self) -> usize {
            self.1.len()
        }
        fn chunk(&self, i: usize) -> Option<(ContentId, &[u8])> {
            self.1[i].as_ref().map(|chunk| (chunk.id(), chunk.bytes()))
        }
    }

    fn chunk(byte: u8) -> Option<Arc<Chunk>> {
        Some(Arc::new(Chunk::new([byte])))
    }

    #[test]
    fn only_what_changed_is_missing() {
        let old = List(ContentId::new(), vec![chunk(1), chunk(2), None, chunk(4)]);
        let mut held = HeldChunks::default();
        assert_eq!(held.missing(&old), [0..2, 3..4]);
        held.hold(&old);
        assert!(held.has_all(&old) && held.missing(&old).is_empty());
        // One is another, with the same bytes; one is gone; two are new.
        let chunks = vec![old.1[0].clone(), chunk(2), chunk(3), None, chunk(5)];
        let new = List(ContentId::new(), chunks);
        assert_eq!(held.missing(&new), [1..3, 4..5]);
        held.hold(&new);
        // A chunk that no shader read meanwhile is still there.
        assert_eq!(held.missing(&List(ContentId::new(), vec![None, None, None, old.1[3].clone()])), []);
        held.forget();
        assert_eq!(held.missing(&new), [0..3, 4..5]);
    }
}
