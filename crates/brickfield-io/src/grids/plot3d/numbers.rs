//! The numbers of a PLOT3D file, one after the other.

use super::layout::{Encoding, Precision};
use crate::files::ByteSource;
use crate::numbers::FileScalar;
use crate::samples::next_token;
use crate::{ByteOrder, ReadError};

/// Numbers from the source's position on.
pub(super) struct Numbers<'a> {
    pub(super) source: &'a mut dyn ByteSource,
    pub(super) encoding: Encoding,
}

const CHUNK_BYTES: usize = 1 << 16;

impl Numbers<'_> {
    /// The mark before or after a record of so many bytes, in files that have marks.
    ///
    /// # Errors
    /// Another length.
    pub(super) fn mark(&mut self, n_record_bytes: u64, what: &str) -> Result<(), ReadError> {
        let Encoding::Binary(binary) = self.encoding else { return Ok(()) };
        if !binary.has_record_marks {
            return Ok(());
        }
        let mut mark = 0u32;
        binary_numbers::<u32>(self.source, binary.order, 1, what, &mut |_, n| mark = n)?;
        match u64::from(mark) == n_record_bytes {
            true => Ok(()),
            false => Err(ReadError::field(format!("record mark of {what}"), mark, format!("{n_record_bytes} bytes"))),
        }
    }

    /// Bytes of real and whole numbers, in files with marks.
    pub(super) fn n_bytes(&self, n_reals: u64, n_integers: u64) -> u64 {
        let real = match self.encoding {
            Encoding::Text => 0,
            Encoding::Binary(binary) => binary.precision.n_bytes() as u64,
        };
        n_reals.saturating_mul(real).saturating_add(4 * n_integers)
    }

    /// The next `n` real numbers, each with its place among them.
    pub(super) fn reals(&mut self, n: usize, what: &str, put: &mut dyn FnMut(usize, f64)) -> Result<(), ReadError> {
        match self.encoding {
            Encoding::Text => text_numbers(self.source, n, what, "a number", &real, put),
            Encoding::Binary(binary) => match binary.precision {
                Precision::F32 => {
                    binary_numbers::<f32>(self.source, binary.order, n, what, &mut |i, v| put(i, f64::from(v)))
                }
                Precision::F64 => binary_numbers::<f64>(self.source, binary.order, n, what, put),
            },
        }
    }

    /// The next `n` whole numbers.
    pub(super) fn integers(&mut self, n: usize, what: &str, put: &mut dyn FnMut(usize, i32)) -> Result<(), ReadError> {
        match self.encoding {
            Encoding::Text => text_numbers(self.source, n, what, "an integer", &|text| text.parse().ok(), put),
            Encoding::Binary(binary) => binary_numbers::<i32>(self.source, binary.order, n, what, put),
        }
    }
}

fn binary_numbers<T: FileScalar>(
    source: &mut dyn ByteSource,
    order: ByteOrder,
    n: usize,
    what: &str,
    put: &mut dyn FnMut(usize, T),
) -> Result<(), ReadError> {
    let per_chunk = CHUNK_BYTES / size_of::<T>();
    let mut bytes = vec![0; n.min(per_chunk) * size_of::<T>()];
    let mut numbers = Vec::new();
    for first in (0..n).step_by(per_chunk) {
        let piece = &mut bytes[..per_chunk.min(n - first) * size_of::<T>()];
        source.read_exact(piece).map_err(|e| ReadError::io(what, e))?;
        numbers.clear();
        T::append(piece, order, &mut numbers);
        numbers.iter().enumerate().for_each(|(i, number)| put(first + i, *number));
    }
    Ok(())
}

fn text_numbers<T>(
    source: &mut dyn ByteSource,
    n: usize,
    what: &str,
    expected: &str,
    parse: &dyn Fn(&str) -> Option<T>,
    put: &mut dyn FnMut(usize, T),
) -> Result<(), ReadError> {
    let mut token = Vec::new();
    for i in 0..n {
        next_token(source, &mut token).map_err(|e| ReadError::io(what, e))?;
        let text = String::from_utf8_lossy(&token);
        let number =
            parse(&text).ok_or_else(|| ReadError::field(format!("number {} of {what}", i + 1), &text, expected))?;
        put(i, number);
    }
    Ok(())
}

/// A real number, its exponent also as Fortran writes it: 1.5D+03.
pub(crate) fn real(text: &str) -> Option<f64> {
    text.parse().ok().or_else(|| text.replace(['D', 'd'], "E").parse().ok())
}
