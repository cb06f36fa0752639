//! Third-party decoders on hostile data: a panic becomes an error.

use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::ReadError;

/// Runs a decoder; a panic in it becomes [`ReadError::DecoderPanicked`]. Its unfinished work is dropped.
pub(crate) fn guarded<T>(what: &'static str, decode: impl FnOnce() -> Result<T, ReadError>) -> Result<T, ReadError> {
    catch_unwind(AssertUnwindSafe(decode)).unwrap_or(Err(ReadError::DecoderPanicked { what }))
}
