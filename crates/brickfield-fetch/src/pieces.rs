//! The bytes of one object that are there.

use std::collections::BTreeMap;
use std::ops::Range;

/// Pieces of an object by their first byte; no two overlap.
#[derive(Debug, Default)]
pub(crate) struct Pieces(BTreeMap<u64, Box<[u8]>>);

/// A byte that differs from the one that was there.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Differs {
    pub(crate) at: u64,
}

impl Pieces {
    /// The parts of the pieces that lie in a range, with the starts of their pieces and their own.
    pub(crate) fn within(&self, range: &Range<u64>) -> impl Iterator<Item = Part<'_>> {
        let range = range.clone();
        let first = self.0.range(..=range.start).next_back().map_or(range.start, |(&start, _)| start);
        let pieces = self.0.range(first..range.end.max(first));
        pieces.filter_map(move |(&piece, bytes)| {
            let start = piece.max(range.start);
            let end = (piece + bytes.len() as u64).min(range.end);
            (start < end).then(|| Part {
                piece,
                start,
                bytes: &bytes[(start - piece) as usize..(end - piece) as usize],
            })
        })
    }

    /// The parts of a range that are not there, in order.
    pub(crate) fn gaps(&self, range: &Range<u64>) -> Vec<Range<u64>> {
        let mut gaps = vec![];
        let mut at = range.start;
        for part in self.within(range) {
            if at < part.start {
                gaps.push(at..part.start);
            }
            at = part.end();
        }
        if at < range.end {
            gaps.push(at..range.end);
        }
        gaps
    }

    /// Adds bytes from an offset on; those that are there already must be the same. The starts of the new pieces.
    pub(crate) fn insert(&mut self, offset: u64, bytes: &[u8]) -> Result<Vec<u64>, Differs> {
        let range = offset..offset + bytes.len() as u64;
        for part in self.within(&range) {
            let new = &bytes[(part.start - offset) as usize..][..part.bytes.len()];
            if let Some(i) = part.bytes.iter().zip(new).position(|(old, new)| old != new) {
                return Err(Differs { at: part.start + i as u64 });
            }
        }
        let gaps = self.gaps(&range);
        for gap in &gaps {
            let new = &bytes[(gap.start - offset) as usize..(gap.end - offset) as usize];
            self.0.insert(gap.start, new.into());
        }
        Ok(gaps.iter().map(|gap| gap.start).collect())
    }

    /// The bytes of a range, or the first part of it that is not there.
    pub(crate) fn read(&self, range: &Range<u64>) -> Result<Vec<u8>, Range<u64>> {
        if let Some(gap) = self.gaps(range).into_iter().next() {
            return Err(gap);
        }
        let mut bytes = Vec::with_capacity(range.end.saturating_sub(range.start) as usize);
        self.within(range).for_each(|part| bytes.extend_from_slice(part.bytes));
        Ok(bytes)
    }

    /// Bytes of the piece that begins at an offset; `None` if there is none.
    pub(crate) fn piece_bytes(&self, start: u64) -> Option<u64> {
        self.0.get(&start).map(|bytes| bytes.len() as u64)
    }

    pub(crate) fn remove(&mut self, start: u64) {
        self.0.remove(&start);
    }

    /// The byte behind the last one that is there.
    pub(crate) fn end(&self) -> u64 {
        self.0.last_key_value().map_or(0, |(start, bytes)| start + bytes.len() as u64)
    }

    pub(crate) fn n_bytes(&self) -> u64 {
        self.0.values().map(|bytes| bytes.len() as u64).sum()
    }
}

/// A part of a piece.
pub(crate) struct Part<'a> {
    /// First byte of the piece.
    pub(crate) piece: u64,
    /// First byte of the part.
    pub(crate) start: u64,
    pub(crate) bytes: &'a [u8],
}

impl Part<'_> {
    fn end(&self) -> u64 {
        self.start + self.bytes.len() as u64
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Held against one flag for each byte.
        #[test]
        fn pieces_are_the_bytes_that_were_inserted(spans in prop::collection::vec((0u64..60, 0u64..20), 0..12), asked in (0u64..70, 0u64..30)) {
            let object: Vec<u8> = (0..100).map(|i| (i * 7) as u8).collect();
            let (mut pieces, mut there) = (Pieces::default(), [false; 100]);
            for (start, n) in spans {
                pieces.insert(start, &object[start as usize..(start + n) as usize]).unwrap();
                there[start as usize..(start + n) as usize].fill(true);
            }
            let range = asked.0..asked.0 + asked.1;
            let missing: Vec<u64> = range.clone().filter(|&i| !there[i as usize]).collect();
            prop_assert_eq!(pieces.gaps(&range).into_iter().flatten().collect::<Vec<_>>(), missing.clone());
            match pieces.read(&range) {
                Ok(bytes) => prop_assert_eq!(bytes, &object[range.start as usize..range.end as usize]),
                Err(gap) => prop_assert_eq!(gap.start, missing[0]),
            }
            prop_assert_eq!(pieces.n_bytes() as usize, there.iter().filter(|&&t| t).count());
            prop_assert_eq!(pieces.end() as usize, there.iter().rposition(|&t| t).map_or(0, |i| i + 1));
        }
    }

    #[test]
    fn another_byte_is_refused_and_nothing_is_added() {
        let mut pieces = Pieces::default();
        assert_eq!(pieces.insert(4, &[1, 2, 3]), Ok(vec![4]));
        assert_eq!(pieces.insert(2, &[9, 9, 1, 7, 3, 9]), Err(Differs { at: 5 }));
        assert_eq!(pieces.n_bytes(), 3);
        assert_eq!(pieces.insert(2, &[9, 9, 1, 2, 3, 9]), Ok(vec![2, 7]));
        assert_eq!(pieces.read(&(2..8)), Ok(vec![9, 9, 1, 2, 3, 9]));
    }
}
