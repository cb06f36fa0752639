//! Files that may be gzipped as a whole, header and all.

use std::io::SeekFrom;

#[cfg(feature = "nifti")]
use crate::DataFiles;
use crate::deflate::inflate;
#[cfg(feature = "nifti")]
use crate::error::check_length;
use crate::files::ByteSource;
#[cfg(feature = "nifti")]
use crate::files::open_named;
use crate::samples::fill_named;
use crate::stored::Encoding;
use crate::{ByteOrder, ReadError};

/// Opens a file that may be gzipped, with `.gz` behind its name.
#[cfg(feature = "nifti")]
pub(crate) fn open_part<'a>(name: &str, files: &'a dyn DataFiles) -> Result<Box<dyn ByteSource + 'a>, ReadError> {
    open_named(files, name).or_else(|e| open_named(files, &format!("{name}.gz")).map_err(|_| e))
}

/// How the source is stored, by its first byte.
///
/// # Errors
/// If it is empty.
pub(crate) fn encoding_of(source: &mut dyn ByteSource) -> Result<Encoding, ReadError> {
    match source.fill_buf().map_err(|e| ReadError::io("the file", e))?.first() {
        None => Err(ReadError::Empty),
        Some(0x1f) => Ok(Encoding::Deflate),
        Some(_) => Ok(Encoding::Raw),
    }
}

/// Reads the start of what is stored, as far as it goes, into `header`; the source stays where it is. Bytes read.
pub(crate) fn read_start(
    source: &mut dyn ByteSource,
    encoding: Encoding,
    header: &mut [u8],
) -> Result<usize, ReadError> {
    let start = source.stream_position().map_err(|e| ReadError::io("the file", e))?;
    let n = match encoding {
        Encoding::Deflate => {
            let mut inflated = inflate(&mut *source).map_err(|e| ReadError::io("the file", e))?;
            fill_named(&mut inflated, header, "the header")?
        }
        Encoding::Raw | Encoding::Text => fill_named(&mut &mut *source, header, "the header")?,
    };
    source.seek(SeekFrom::Start(start)).map_err(|e| ReadError::io("the file", e))?;
    Ok(n)
}

#[cfg(feature = "nifti")]
/// A header of this length at the start of the source.
///
/// # Errors
/// If the file is shorter.
pub(crate) fn read_header<const N: usize>(
    source: &mut dyn ByteSource,
    encoding: Encoding,
) -> Result<[u8; N], ReadError> {
    let mut header = [0; N];
    let n = read_start(source, encoding, &mut header)?;
    check_length("the header", n as u64, N as u128)?;
    Ok(header)
}

/// Numbers at places of a header, in its byte order.
pub(crate) struct HeaderNumbers<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) order: ByteOrder,
}

macro_rules! numbers {
    ($($name:ident $t:ty;)*) => { $(
        /// The numbers from byte `at` on; 0 beyond the end.
        #[allow(dead_code, reason = "not every format has all types")]
        pub(crate) fn $name<const N: usize>(&self, at: usize) -> [$t; N] {
            std::array::from_fn(|i| {
                let bytes = self.bytes.get(at + i * size_of::<$t>()..).and_then(|rest| rest.first_chunk());
                match self.order {
                    ByteOrder::Little => <$t>::from_le_bytes(*bytes.unwrap_or(&[0; size_of::<$t>()])),
                    ByteOrder::Big => <$t>::from_be_bytes(*bytes.unwrap_or(&[0; size_of::<$t>()])),
                }
            })
        }
    )* };
}

impl HeaderNumbers<'_> {
    numbers! { i16s i16; i32s i32; i64s i64; f32s f32; f64s f64; }

    /// Numbers of 32 bits, as f64.
    pub(crate) fn f32s_wide<const N: usize>(&self, at: usize) -> [f64; N] {
        self.f32s::<N>(at).map(f64::from)
    }
}
