//! What has arrived.

use std::collections::HashMap;
use std::error::Error;
use std::io;
use std::ops::Range;
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use brickfield_core::Objects;

use crate::pieces::Pieces;

/// The ranges of objects that have arrived, and nothing else: no network, no file.
///
/// A reader of it sees a prefix of a delivery by its own bytes alone. Reading what has not arrived is an error with a
/// [`NotArrived`] inside, of kind [`io::ErrorKind::WouldBlock`], so that it differs from damage. Several threads may insert
/// and read at once; what has arrived stays.
#[derive(Debug, Default)]
pub struct Arrived {
    objects: RwLock<HashMap<String, Object>>,
}

#[derive(Debug)]
enum Object {
    Absent,
    Present { n_bytes: Option<u64>, pieces: Pieces },
}

/// What has not arrived: inside of the [`io::Error`] of a read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{} of {key} not arrived", missing(range))]
#[non_exhaustive]
pub struct NotArrived {
    /// The object's key.
    pub key: String,
    /// The first missing part of the range that was read; `None`: the size of the object, or whether there is one.
    pub range: Option<Range<u64>>,
}

fn missing(range: &Option<Range<u64>>) -> String {
    match range {
        Some(range) => format!("bytes {}..{}", range.start, range.end),
        None => "the size".to_owned(),
    }
}

impl NotArrived {
    /// The one inside of an error, however deep; `None`: the error is another one.
    ///
    /// ```
    /// use brickfield_core::Objects;
    /// use brickfield_fetch::{Arrived, NotArrived};
    ///
    /// let error = Arrived::default().read("c/0", &[4..8]).unwrap_err();
    /// assert_eq!(NotArrived::within(&error).unwrap().range, Some(4..8));
    /// assert_eq!(NotArrived::within(&std::fmt::Error), None);
    /// ```
    pub fn within<'a>(error: &'a (dyn Error + 'static)) -> Option<&'a NotArrived> {
        let mut next = Some(error);
        while let Some(error) = next {
            if let Some(found) = error.downcast_ref() {
                return Some(found);
            }
            // The source of an `io::Error` is the source of the error inside.
            let inside = error.downcast_ref::<io::Error>().and_then(io::Error::get_ref);
            next = inside.map(|e| e as &(dyn Error + 'static)).or_else(|| error.source());
        }
        None
    }

    fn io(key: &str, range: Option<Range<u64>>) -> io::Error {
        io::Error::new(io::ErrorKind::WouldBlock, NotArrived { key: key.to_owned(), range })
    }
}

/// What arrives does not fit what has arrived; nothing of it was taken.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ArrivedError {
    /// Another byte.
    #[error("byte {at} of {key} is another one than before")]
    Differs {
        /// The object's key.
        key: String,
        /// The first byte that differs.
        at: u64,
    },
    /// Another size.
    #[error("{key} has {now} bytes; it had {was}")]
    OtherSize {
        /// The object's key.
        key: String,
        /// Bytes as stated before.
        was: u64,
        /// Bytes as stated now.
        now: u64,
    },
    /// Bytes behind the end of the object.
    #[error("bytes of {key} up to {end} are behind its end: it has {n_bytes}")]
    BeyondEnd {
        /// The object's key.
        key: String,
        /// The byte behind the last that arrives, or has arrived.
        end: u64,
        /// Bytes of the object.
        n_bytes: u64,
    },
    /// An object that was said to be absent arrives, or one that has arrived is said to be absent.
    #[error("{key} is present and absent")]
    PresentAndAbsent {
        /// The object's key.
        key: String,
    },
}

impl Arrived {
    /// Adds `bytes` of an object from byte `offset` on; `n_object_bytes` is the size of the whole, where it is known. No
    /// bytes are fine: they say that there is such an object.
    ///
    /// # Errors
    /// If they contradict what has arrived: another size, another byte, bytes behind the end, or an object that is absent.
    pub fn insert(
        &self,
        key: &str,
        n_object_bytes: Option<u64>,
        offset: u64,
        bytes: &[u8],
    ) -> Result<(), ArrivedError> {
        let end = offset.saturating_add(bytes.len() as u64);
        // A range has an end that is a number: no object has 2^64 bytes.
        let most = n_object_bytes.unwrap_or(u64::MAX - 1);
        if end > most {
            return Err(ArrivedError::BeyondEnd { key: key.to_owned(), end, n_bytes: most });
        }
        let mut objects = self.write();
        let new = Object::Present { n_bytes: n_object_bytes, pieces: Pieces::default() };
        let object = objects.entry(key.to_owned()).or_insert(new);
        let key = || key.to_owned();
        let Object::Present { n_bytes, pieces } = object else {
            return Err(ArrivedError::PresentAndAbsent { key: key() });
        };
        if let (Some(was), Some(now)) = (*n_bytes, n_object_bytes)
            && was != now
        {
            return Err(ArrivedError::OtherSize { key: key(), was, now });
        }
        let end = pieces.end().max(end);
        if let Some(n_bytes) = n_bytes.or(n_object_bytes)
            && end > n_bytes
        {
            return Err(ArrivedError::BeyondEnd { key: key(), end, n_bytes });
        }
        pieces.insert(offset, bytes).map_err(|differs| ArrivedError::Differs { key: key(), at: differs.at })?;
        *n_bytes = n_bytes.or(n_object_bytes);
        Ok(())
    }

    /// Adds a whole object.
    ///
    /// # Errors
    /// As [`Arrived::insert`].
    pub fn insert_whole(&self, key: &str, bytes: &[u8]) -> Result<(), ArrivedError> {
        self.insert(key, Some(bytes.len() as u64), 0, bytes)
    }

    /// Notes that there is no object of a key: reading it gives `None`.
    ///
    /// # Errors
    /// If bytes of it have arrived.
    pub fn insert_absent(&self, key: &str) -> Result<(), ArrivedError> {
        match self.write().entry(key.to_owned()).or_insert(Object::Absent) {
            Object::Absent => Ok(()),
            Object::Present { .. } => Err(ArrivedError::PresentAndAbsent { key: key.to_owned() }),
        }
    }

    /// The parts of a range that have not arrived, in order; none of an absent object.
    pub fn missing(&self, key: &str, range: Range<u64>) -> Vec<Range<u64>> {
        match self.read_lock().get(key) {
            Some(Object::Absent) => vec![],
            Some(Object::Present { pieces, .. }) => pieces.gaps(&range),
            None => Pieces::default().gaps(&range),
        }
    }

    /// Bytes that have arrived, of all objects.
    pub fn n_arrived_bytes(&self) -> u64 {
        let of_object = |object: &Object| match object {
            Object::Absent => 0,
            Object::Present { pieces, .. } => pieces.n_bytes(),
        };
        self.read_lock().values().map(of_object).sum()
    }

    // No method leaves an object half changed, so that a lock is good after a panic.
    fn read_lock(&self) -> RwLockReadGuard<'_, HashMap<String, Object>> {
        self.objects.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn write(&self) -> RwLockWriteGuard<'_, HashMap<String, Object>> {
        self.objects.write().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Objects for Arrived {
    fn n_bytes(&self, key: &str) -> io::Result<Option<u64>> {
        match self.read_lock().get(key) {
            Some(Object::Absent) => Ok(None),
            Some(Object::Present { n_bytes: Some(n_bytes), .. }) => Ok(Some(*n_bytes)),
            Some(Object::Present { n_bytes: None, .. }) | None => Err(NotArrived::io(key, None)),
        }
    }

    fn read(&self, key: &str, ranges: &[Range<u64>]) -> io::Result<Option<Vec<Vec<u8>>>> {
        let objects = self.read_lock();
        let (n_bytes, pieces) = match objects.get(key) {
            Some(Object::Absent) => return Ok(None),
            Some(Object::Present { n_bytes, pieces }) => (*n_bytes, pieces),
            None => return Err(NotArrived::io(key, ranges.first().cloned())),
        };
        let read = |range: &Range<u64>| match n_bytes {
            Some(n_bytes) if range.end > n_bytes => Err(io::Error::new(
                io::ErrorKind::UnexpectedEof,
                format!("{key} has {n_bytes} bytes; bytes {}..{} were read", range.start, range.end),
            )),
            _ => pieces.read(range).map_err(|gap| NotArrived::io(key, Some(gap))),
        };
        ranges.iter().map(read).collect::<io::Result<Vec<_>>>().map(Some)
    }
}

#[cfg(test)]
#[expect(clippy::single_range_in_vec_init, reason = "a list of ranges may have one")]
mod tests {
    use super::*;

    #[test]
    fn what_has_not_arrived_is_named_and_no_damage() {
        let arrived = Arrived::default();
        let error = arrived.read("c/0", &[0..4]).unwrap_err();
        assert_eq!(
            (error.kind(), error.to_string().as_str()),
            (io::ErrorKind::WouldBlock, "bytes 0..4 of c/0 not arrived")
        );
        arrived.insert("c/0", None, 0, &[1, 2, 3]).unwrap();
        assert_eq!(arrived.read("c/0", &[1..3]).unwrap(), Some(vec![vec![2, 3]]));
        let error = arrived.read("c/0", &[0..2, 2..5]).unwrap_err();
        assert_eq!(NotArrived::within(&error).unwrap().range, Some(3..5));
        let error = arrived.n_bytes("c/0").unwrap_err();
        assert_eq!(error.to_string(), "the size of c/0 not arrived");
        assert_eq!(arrived.missing("c/0", 2..9), [3..9]);

        arrived.insert("c/0", Some(4), 3, &[]).unwrap();
        assert_eq!(arrived.n_bytes("c/0").unwrap(), Some(4));
        let error = arrived.read("c/0", &[2..5]).unwrap_err();
        assert_eq!((error.kind(), NotArrived::within(&error)), (io::ErrorKind::UnexpectedEof, None));
    }

    #[test]
    fn contradictions_are_refused_and_leave_what_was_there() {
        let arrived = Arrived::default();
        arrived.insert("a", Some(4), 0, &[1, 2]).unwrap();
        let told = |result: Result<(), ArrivedError>| result.unwrap_err().to_string();
        assert_eq!(told(arrived.insert("a", None, 1, &[3])), "byte 1 of a is another one than before");
        assert_eq!(told(arrived.insert("a", Some(5), 2, &[3])), "a has 5 bytes; it had 4");
        assert_eq!(told(arrived.insert("a", None, 3, &[3, 4])), "bytes of a up to 5 are behind its end: it has 4");
        assert_eq!(told(arrived.insert_absent("a")), "a is present and absent");
        arrived.insert_absent("b").unwrap();
        assert_eq!(told(arrived.insert_whole("b", &[1])), "b is present and absent");
        assert_eq!((arrived.n_bytes("b").unwrap(), arrived.read("b", &[0..9]).unwrap()), (None, None));
        assert_eq!((arrived.missing("b", 0..9), arrived.n_arrived_bytes()), (vec![], 2));
        arrived.insert("c", None, 6, &[1]).unwrap();
        assert_eq!(told(arrived.insert("c", Some(6), 0, &[1])), "bytes of c up to 7 are behind its end: it has 6");
    }
}
