//! What a client keeps of the objects that it fetched.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::sync::Arc;

use crate::pieces::{Differs, Pieces};
use crate::version::Version;

/// Objects by key: what is known of them, and pieces of at most some bytes, the ones that were used last.
#[derive(Debug, Default)]
pub(crate) struct Cache {
    objects: HashMap<Arc<str>, Known>,
    used: Used,
    n_bytes: u64,
    max_bytes: u64,
}

#[derive(Debug)]
enum Known {
    Absent,
    Present { version: Version, pieces: Pieces },
}

/// What is known of an object.
pub(crate) enum Found {
    Absent,
    Present(Version),
    Unknown,
}

impl Cache {
    pub(crate) fn new(max_bytes: u64) -> Cache {
        Cache { max_bytes, ..Cache::default() }
    }

    pub(crate) fn found(&self, key: &str) -> Found {
        match self.objects.get(key) {
            Some(Known::Absent) => Found::Absent,
            Some(Known::Present { version, .. }) => Found::Present(version.clone()),
            None => Found::Unknown,
        }
    }

    pub(crate) fn insert_absent(&mut self, key: &Arc<str>) {
        self.objects.entry(key.clone()).or_insert(Known::Absent);
    }

    /// Adds bytes of an object, and removes what was used longest ago until all fit.
    pub(crate) fn insert(
        &mut self,
        key: &Arc<str>,
        version: &Version,
        offset: u64,
        bytes: &[u8],
    ) -> Result<(), Differs> {
        let new = || Known::Present { version: version.clone(), pieces: Pieces::default() };
        let object = self.objects.entry(key.clone()).or_insert_with(new);
        if let Known::Absent = object {
            *object = new();
        }
        let Known::Present { pieces, .. } = object else { unreachable!("it was made present") };
        for start in pieces.insert(offset, bytes)? {
            self.n_bytes += pieces.piece_bytes(start).unwrap_or(0);
            self.used.touch(key, start);
        }
        self.shrink();
        Ok(())
    }

    /// Hands over the parts of a range that are kept; the parts that are not, in order.
    pub(crate) fn take(
        &mut self,
        key: &Arc<str>,
        range: &Range<u64>,
        mut part: impl FnMut(u64, &[u8]),
    ) -> Vec<Range<u64>> {
        let Some(Known::Present { pieces, .. }) = self.objects.get(key) else { return Pieces::default().gaps(range) };
        for kept in pieces.within(range) {
            part(kept.start, kept.bytes);
            self.used.touch(key, kept.piece);
        }
        pieces.gaps(range)
    }

    fn shrink(&mut self) {
        while self.n_bytes > self.max_bytes {
            let Some((key, start)) = self.used.pop_oldest() else { return };
            if let Some(Known::Present { pieces, .. }) = self.objects.get_mut(&key) {
                self.n_bytes -= pieces.piece_bytes(start).unwrap_or(0);
                pieces.remove(start);
            }
        }
    }
}

/// Pieces in the order of their last use.
#[derive(Debug, Default)]
struct Used {
    by_time: BTreeMap<u64, (Arc<str>, u64)>,
    times: HashMap<(Arc<str>, u64), u64>,
    now: u64,
}

impl Used {
    fn touch(&mut self, key: &Arc<str>, start: u64) {
        self.now += 1;
        if let Some(before) = self.times.insert((key.clone(), start), self.now) {
            self.by_time.remove(&before);
        }
        self.by_time.insert(self.now, (key.clone(), start));
    }

    fn pop_oldest(&mut self) -> Option<(Arc<str>, u64)> {
        let (_, piece) = self.by_time.pop_first()?;
        self.times.remove(&piece);
        Some(piece)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(cache: &mut Cache, key: &str, range: Range<u64>) -> Vec<u8> {
        let mut bytes = vec![];
        cache.take(&key.into(), &range, |_, part| bytes.extend_from_slice(part));
        bytes
    }

    #[test]
    fn the_piece_that_was_used_longest_ago_goes_first() {
        let (version, a, b): (_, Arc<str>, Arc<str>) = (Version::of_size(100), "a".into(), "b".into());
        let mut cache = Cache::new(10);
        cache.insert(&a, &version, 0, &[1; 4]).unwrap();
        cache.insert(&b, &version, 0, &[2; 4]).unwrap();
        assert_eq!(kept(&mut cache, "a", 1..3), [1, 1]);
        cache.insert(&b, &version, 50, &[3; 4]).unwrap();
        assert_eq!((kept(&mut cache, "a", 0..4), kept(&mut cache, "b", 0..60)), (vec![1; 4], vec![3; 4]));
        assert_eq!(cache.n_bytes, 8);
        assert!(matches!(cache.found("b"), Found::Present(_)), "sizes are kept");

        // More than there is room for: nothing of it stays, nor does anything else.
        cache.insert(&a, &version, 4, &[4; 11]).unwrap();
        assert_eq!((cache.n_bytes, kept(&mut cache, "a", 0..100)), (0, vec![]));
    }
}
