//! Files of a store, wherever they are.

use std::io;
use std::ops::Range;

/// The objects of a store: files that are found by a key, and read in ranges of bytes.
///
/// A key is a path relative to the store, with `/` between names, such as `0/c/1/0/2`. Several threads may read at once.
pub trait Objects: Send + Sync {
    /// The bytes of an object; `None` if there is none of this key.
    ///
    /// # Errors
    /// If that cannot be found out.
    fn n_bytes(&self, key: &str) -> io::Result<Option<u64>>;

    /// The bytes of an object in some ranges, each as many as asked for; `None` if there is none of this key.
    ///
    /// # Errors
    /// If they cannot be read; [`io::ErrorKind::UnexpectedEof`] if the object ends before a range does.
    fn read(&self, key: &str, ranges: &[Range<u64>]) -> io::Result<Option<Vec<Vec<u8>>>>;
}
