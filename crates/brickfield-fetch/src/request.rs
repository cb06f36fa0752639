//! What to fetch.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use crate::FetchError;

/// A part of an object that is asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// The object's key, a path relative to the store.
    pub key: String,
    /// Bytes; `None`: all of them.
    pub range: Option<Range<u64>>,
}

impl Request {
    /// All bytes of an object.
    pub fn whole(key: impl Into<String>) -> Request {
        Request { key: key.into(), range: None }
    }

    /// Some bytes of an object.
    pub fn part(key: impl Into<String>, range: Range<u64>) -> Request {
        Request { key: key.into(), range: Some(range) }
    }
}

/// All that is asked for of one object.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Wanted {
    pub(crate) key: Arc<str>,
    pub(crate) whole: bool,
    pub(crate) ranges: Vec<Range<u64>>,
}

/// Requests by object, in the order in which the objects are first named.
pub(crate) fn by_object(requests: &[Request]) -> Result<Vec<Wanted>, FetchError> {
    let mut at: HashMap<&str, usize> = HashMap::new();
    let mut all: Vec<Wanted> = vec![];
    for Request { key, range } in requests {
        let i = *at.entry(key).or_insert(all.len());
        if i == all.len() {
            all.push(Wanted { key: key.as_str().into(), whole: false, ranges: vec![] });
        }
        match range {
            None => all[i].whole = true,
            Some(r) if r.start > r.end => {
                return Err(FetchError::BadRange { key: key.clone(), start: r.start, end: r.end });
            }
            Some(range) => all[i].ranges.push(range.clone()),
        }
    }
    Ok(all)
}

/// The same ranges, those with at most `max_gap` bytes between them as one; in order.
pub(crate) fn merged(mut ranges: Vec<Range<u64>>, max_gap: u64) -> Vec<Range<u64>> {
    ranges.sort_by_key(|range| (range.start, range.end));
    let mut merged: Vec<Range<u64>> = vec![];
    for range in ranges {
        match merged.last_mut() {
            Some(last) if range.start <= last.end.saturating_add(max_gap) => last.end = last.end.max(range.end),
            _ => merged.push(range),
        }
    }
    merged
}

#[cfg(test)]
#[expect(clippy::single_range_in_vec_init, reason = "a list of ranges may have one")]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn neighbours_become_one_request_up_to_the_gap() {
        assert_eq!(merged(vec![20..30, 0..10, 14..16, 5..8], 4), [0..30]);
        assert_eq!(merged(vec![20..30, 0..10, 14..16], 3), [0..10, 14..16, 20..30]);
    }

    #[test]
    fn objects_keep_the_order_of_their_first_request() {
        let requests = [Request::part("b", 0..1), Request::whole("a"), Request::part("b", 4..6)];
        let wanted = by_object(&requests).unwrap();
        let told: Vec<_> = wanted.iter().map(|w| (w.key.as_ref(), w.whole, w.ranges.as_slice())).collect();
        assert_eq!(told, [("b", false, [0..1, 4..6].as_slice()), ("a", true, &[])]);
        let reversed = by_object(&[Request { key: "c/0".into(), range: Some(Range { start: 9, end: 4 }) }]);
        assert_eq!(reversed.unwrap_err().to_string(), "bytes 9..4 of c/0 are no range: it ends before it begins");
    }

    proptest! {
        #[test]
        fn merged_ranges_hold_every_byte_and_lie_apart(spans in prop::collection::vec((0u64..200, 1u64..20), 0..12), gap in 0u64..20) {
            let ranges: Vec<_> = spans.iter().map(|&(start, n)| start..start + n).collect();
            let merged = merged(ranges.clone(), gap);
            prop_assert!(ranges.iter().all(|r| merged.iter().any(|m| m.start <= r.start && r.end <= m.end)));
            prop_assert!(merged.windows(2).all(|w| w[0].end + gap < w[1].start));
            prop_assert!(merged.iter().all(|m| ranges.iter().any(|r| r.start == m.start) && ranges.iter().any(|r| r.end == m.end)));
        }
    }
}
