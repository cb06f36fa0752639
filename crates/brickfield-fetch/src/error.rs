//! Why a fetch failed.

use std::io;
use std::ops::Range;

/// Why a fetch failed. What had arrived before is kept.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FetchError {
    /// An option is outside of its bound.
    #[error("{name} is {value}; it must be {bound}")]
    BadOption {
        /// The option's name.
        name: &'static str,
        /// Its value.
        value: String,
        /// What it may be.
        bound: &'static str,
    },
    /// A location is neither a folder that is there nor a URL that can be fetched from.
    #[error("cannot fetch from {location}: {reason}")]
    BadLocation {
        /// The location as it was given.
        location: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A key is no path inside a store.
    #[error("{key:?} is no key of an object: {reason}")]
    BadKey {
        /// The key.
        key: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A range ends before it begins.
    #[error("bytes {start}..{end} of {key} are no range: it ends before it begins")]
    BadRange {
        /// The object's key.
        key: String,
        /// First byte.
        start: u64,
        /// The byte behind the last.
        end: u64,
    },
    /// An object ends before the asked range does.
    #[error("{key} has {n_bytes} bytes; bytes {}..{} were asked for", range.start, range.end)]
    Short {
        /// The object's key.
        key: String,
        /// The asked range.
        range: Range<u64>,
        /// Bytes of the object.
        n_bytes: u64,
    },
    /// Another object has taken the place of the one whose parts were fetched.
    #[error("{key} changed while it was fetched: {was}, now {now}")]
    Changed {
        /// The object's key.
        key: String,
        /// Size and entity tag, or date, that it had.
        was: String,
        /// Those that it has.
        now: String,
    },
    /// A server sends whole objects where it is asked for ranges, and the object is too large to be fetched whole.
    #[error(
        "the server ignores ranges: asked for bytes {}..{} of {key}, it sends all {n_bytes}; the most that is fetched \
         whole is {most}",
        range.start, range.end
    )]
    RangeIgnored {
        /// The object's key.
        key: String,
        /// The asked range.
        range: Range<u64>,
        /// Bytes of the object.
        n_bytes: u64,
        /// [`FetchOptions::max_unasked_bytes`](crate::FetchOptions::max_unasked_bytes).
        most: u64,
    },
    /// An answer that another try would not change: access refused, or a request that the server does not take.
    #[error("{} of {key} were refused: {fault}", asked(range))]
    Refused {
        /// The object's key.
        key: String,
        /// The asked range; `None`: the whole.
        range: Option<Range<u64>>,
        /// The answer.
        fault: String,
    },
    /// Every attempt failed.
    #[error("{} of {key} did not arrive in {n_attempts} attempts; the last: {fault}", asked(range))]
    Failed {
        /// The object's key.
        key: String,
        /// The asked range; `None`: the whole.
        range: Option<Range<u64>>,
        /// Attempts, the first included.
        n_attempts: u32,
        /// What went wrong in the last.
        fault: String,
    },
    /// What arrived does not fit what had arrived before.
    #[error(transparent)]
    Arrived(#[from] crate::ArrivedError),
    /// The threads of the client could not be started.
    #[error("cannot start the client's threads: {0}")]
    Threads(#[source] io::Error),
}

fn asked(range: &Option<Range<u64>>) -> String {
    match range {
        Some(range) => format!("bytes {}..{}", range.start, range.end),
        None => "the bytes".to_owned(),
    }
}

impl From<FetchError> for io::Error {
    fn from(e: FetchError) -> io::Error {
        let kind = match &e {
            FetchError::BadOption { .. }
            | FetchError::BadLocation { .. }
            | FetchError::BadKey { .. }
            | FetchError::BadRange { .. } => io::ErrorKind::InvalidInput,
            FetchError::Short { .. } => io::ErrorKind::UnexpectedEof,
            FetchError::Changed { .. } | FetchError::Arrived(_) => io::ErrorKind::InvalidData,
            _ => io::ErrorKind::Other,
        };
        io::Error::new(kind, e)
    }
}
