//! From bytes and text to voxels: checked before it is allocated, read in pieces, never more than claimed.

use std::io::{BufRead, Read};

use brickfield_core::{Scalar, ScalarType, Voxels, with_voxels};

use crate::ReadError;
use crate::colour::{ColourPart, luminance};
#[cfg(feature = "gzip")]
use crate::error::check_length;
use crate::limits::CheckedShape;
use crate::numbers::{ByteOrder, FileScalar, with_room};
use crate::stored_voxel::{StoredVoxel, keep_components};

/// Empty voxels with room for the whole shape.
///
/// # Errors
/// If there is no memory for them.
pub(crate) fn allocate(shape: &CheckedShape) -> Result<Voxels, ReadError> {
    room_for(shape.scalar, shape.n_voxels())
}

/// No voxels, with room for `n`.
///
/// # Errors
/// If there is no memory for them.
pub(crate) fn room_for(scalar: ScalarType, n: usize) -> Result<Voxels, ReadError> {
    fn reserve<T: Scalar>(n: usize) -> Result<Voxels, ReadError> {
        with_room(n).map(T::wrap)
    }
    match scalar {
        ScalarType::U8 => reserve::<u8>(n),
        ScalarType::I8 => reserve::<i8>(n),
        ScalarType::U16 => reserve::<u16>(n),
        ScalarType::I16 => reserve::<i16>(n),
        ScalarType::U32 => reserve::<u32>(n),
        ScalarType::I32 => reserve::<i32>(n),
        ScalarType::F32 => reserve::<f32>(n),
        ScalarType::F64 => reserve::<f64>(n),
    }
}

/// Appends `n` zeros.
#[cfg(any(feature = "tiff", feature = "vti"))]
pub(crate) fn append_zeros(voxels: &mut Voxels, n: usize) {
    fn append<T: Scalar>(values: &mut Vec<T>, n: usize) {
        values.resize(values.len() + n, T::from_f64(0.0));
    }
    with_voxels!(voxels, v => append(v, n));
}

/// Appends the part that is read of `n` binary voxels; `what` names the source in errors.
pub(crate) fn append_binary(
    voxels: &mut Voxels,
    reader: &mut dyn Read,
    n: usize,
    voxel: impl Into<StoredVoxel>,
    order: ByteOrder,
    what: &str,
) -> Result<(), ReadError> {
    with_voxels!(voxels, v => append_binary_as(v, reader, n, voxel.into(), order, what))
}

const CHUNK_BYTES: usize = 1 << 18;

fn append_binary_as<T: FileScalar>(
    out: &mut Vec<T>,
    reader: &mut dyn Read,
    n: usize,
    voxel: StoredVoxel,
    order: ByteOrder,
    what: &str,
) -> Result<(), ReadError> {
    let expected_bytes = n * voxel.n_bytes();
    // Whole voxels; at least one, for MAX_COMPONENTS of the widest samples are one chunk.
    let chunk_bytes = CHUNK_BYTES / voxel.n_bytes() * voxel.n_bytes();
    let mut chunk = vec![0; chunk_bytes.min(expected_bytes)];
    let mut n_bytes = 0;
    while n_bytes < expected_bytes {
        let piece = &mut chunk[..chunk_bytes.min(expected_bytes - n_bytes)];
        let mut n_read = 0;
        let outcome = fill_counted(reader, piece, &mut n_read);
        n_bytes += n_read;
        outcome.map_err(|e| ReadError::reading(what, n_bytes as u64, expected_bytes as u128, e))?;
        if n_read < piece.len() {
            let (n_bytes, expected_bytes) = (n_bytes as u64, expected_bytes as u128);
            return Err(ReadError::Truncated { what: what.to_owned(), n_bytes, expected_bytes });
        }
        append_piece(out, piece, voxel, order, what)?;
    }
    Ok(())
}

/// Appends the part that is read of whole voxels.
fn append_piece<T: FileScalar>(
    out: &mut Vec<T>,
    piece: &mut [u8],
    voxel: StoredVoxel,
    order: ByteOrder,
    what: &str,
) -> Result<(), ReadError> {
    let stored = voxel.stored;
    let n_kept = keep_components(piece, voxel.n_components as usize, stored.n_bytes(), voxel.kept());
    let kept = &piece[..n_kept];
    match voxel.part {
        ColourPart::Channel(_) => stored.append(kept, order, out).map_err(|e| e.of_sample(out.len(), what)),
        ColourPart::Luminance => {
            let mut colours: Vec<T> = with_room(n_kept / stored.n_bytes())?;
            let outcome = stored.append(kept, order, &mut colours);
            outcome.map_err(|e| e.of_sample(3 * out.len() + colours.len(), what))?;
            out.extend(colours.as_chunks::<3>().0.iter().map(|rgb| luminance(*rgb)));
            Ok(())
        }
    }
}

/// Reads until the buffer is full or the source ends; bytes read.
#[cfg(feature = "dicom")]
pub(crate) fn fill(reader: &mut dyn Read, buffer: &mut [u8]) -> std::io::Result<usize> {
    let mut n = 0;
    fill_counted(reader, buffer, &mut n)?;
    Ok(n)
}

/// Reads until the buffer is full or the source ends; bytes that were read before a fault are counted as well.
fn fill_counted(reader: &mut dyn Read, buffer: &mut [u8], n: &mut usize) -> std::io::Result<()> {
    while *n < buffer.len() {
        match reader.read(&mut buffer[*n..]) {
            Ok(0) => break,
            Ok(m) => *n += m,
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(())
}

/// Reads until the buffer is full or the source ends, and names `what` in errors; bytes read.
#[cfg(any(feature = "nifti", feature = "mgh", feature = "vti"))]
pub(crate) fn fill_named(reader: &mut dyn Read, buffer: &mut [u8], what: &str) -> Result<usize, ReadError> {
    let (mut n, expected_bytes) = (0, buffer.len() as u128);
    let outcome = fill_counted(reader, buffer, &mut n);
    outcome.map(|()| n).map_err(|e| ReadError::reading(what, n as u64, expected_bytes, e))
}

/// Reads `n_bytes` and drops them; `what` names them in errors.
#[cfg(feature = "gzip")]
pub(crate) fn skip(reader: &mut dyn Read, n_bytes: u64, what: &str) -> Result<(), ReadError> {
    let (mut n_done, mut chunk) = (0, [0; 4096]);
    while n_done < n_bytes {
        let piece = &mut chunk[..(n_bytes - n_done).min(4096) as usize];
        let (mut n_read, n_wanted) = (0, piece.len());
        let outcome = fill_counted(reader, piece, &mut n_read);
        n_done += n_read as u64;
        outcome.map_err(|e| ReadError::reading(what, n_done, u128::from(n_bytes), e))?;
        if n_read < n_wanted {
            return check_length(what, n_done, u128::from(n_bytes));
        }
    }
    Ok(())
}

/// Appends the part that is read of `n` voxels written as text, with white space or commas between numbers; `what` names
/// the source in errors.
pub(crate) fn append_text(
    voxels: &mut Voxels,
    reader: &mut dyn BufRead,
    n: usize,
    voxel: impl Into<StoredVoxel>,
    what: &str,
) -> Result<(), ReadError> {
    with_voxels!(voxels, v => append_text_as(v, reader, n, voxel.into(), what))
}

fn append_text_as<T: FileScalar>(
    out: &mut Vec<T>,
    reader: &mut dyn BufRead,
    n: usize,
    voxel: StoredVoxel,
    what: &str,
) -> Result<(), ReadError> {
    let n_components = voxel.n_components as usize;
    let (mut token, mut kept) = (Vec::new(), Vec::new());
    for i in 0..n {
        kept.clear();
        for component in 0..n_components {
            let sample = i * n_components + component;
            next_token(reader, &mut token).map_err(|e| ReadError::io(what, e))?;
            if token.is_empty() {
                let expected = n * n_components;
                return Err(ReadError::TooFewSamples { what: what.to_owned(), found: sample, expected });
            }
            if voxel.kept().contains(&component) {
                kept.push(parse::<T>(&token, voxel, sample)?);
            }
        }
        out.push(match *kept {
            [red, green, blue] => luminance([red, green, blue]),
            _ => kept[0],
        });
    }
    Ok(())
}

fn parse<T: FileScalar>(token: &[u8], voxel: StoredVoxel, sample: usize) -> Result<T, ReadError> {
    let text = String::from_utf8_lossy(token);
    let bad = || ReadError::field(format!("sample {sample}"), &text, voxel.stored.expected_text());
    voxel.stored.parse(&text).ok_or_else(bad)
}

/// Passes over `n` samples written as text; `what` names the source in errors.
pub(crate) fn skip_text(reader: &mut dyn BufRead, n: usize, what: &str) -> Result<(), ReadError> {
    let mut token = Vec::new();
    for i in 0..n {
        next_token(reader, &mut token).map_err(|e| ReadError::io(what, e))?;
        if token.is_empty() {
            return Err(ReadError::TooFewSamples { what: what.to_owned(), found: i, expected: n });
        }
    }
    Ok(())
}

const MAX_TOKEN_BYTES: usize = 400;

/// The next word, white space and commas left out; empty at the end. A word that is too long for a number comes in parts.
pub(crate) fn next_token(reader: &mut dyn BufRead, token: &mut Vec<u8>) -> std::io::Result<()> {
    let separates = |b: &u8| b.is_ascii_whitespace() || *b == b',';
    token.clear();
    loop {
        let bytes = reader.fill_buf()?;
        if bytes.is_empty() {
            return Ok(());
        }
        let start = if token.is_empty() { bytes.iter().take_while(|b| separates(b)).count() } else { 0 };
        let length = bytes[start..].iter().take_while(|b| !separates(b)).count();
        token.extend_from_slice(&bytes[start..start + length]);
        let ended = start + length < bytes.len();
        reader.consume(start + length);
        if (ended && !token.is_empty()) || token.len() > MAX_TOKEN_BYTES {
            return Ok(());
        }
    }
}

/// Least bytes in which `n` numbers can be written as text.
pub(crate) fn least_text_bytes(n: u128) -> u128 {
    n.saturating_mul(2).saturating_sub(1)
}
