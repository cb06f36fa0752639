//! Numbers from bytes and text, and room for them.

use std::str::FromStr;

use brickfield_core::Scalar;

use crate::ReadError;

/// Which end of a number comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum ByteOrder {
    Little,
    Big,
}

/// A scalar that can be read from bytes and from text.
pub(crate) trait FileScalar: Scalar + FromStr {
    fn append(bytes: &[u8], order: ByteOrder, out: &mut Vec<Self>);
}

macro_rules! sample {
    ($($t:ty)*) => { $(
        impl FileScalar for $t {
            fn append(bytes: &[u8], order: ByteOrder, out: &mut Vec<$t>) {
                let (numbers, _) = bytes.as_chunks::<{ size_of::<$t>() }>();
                match order {
                    ByteOrder::Little => out.extend(numbers.iter().map(|b| <$t>::from_le_bytes(*b))),
                    ByteOrder::Big => out.extend(numbers.iter().map(|b| <$t>::from_be_bytes(*b))),
                }
            }
        }
    )* };
}
sample! { u8 i8 u16 i16 u32 i32 f32 f64 }

/// No samples, with room for `n`.
///
/// # Errors
/// If there is no memory for them.
pub(crate) fn with_room<T>(n: usize) -> Result<Vec<T>, ReadError> {
    let mut values = Vec::new();
    let n_bytes = n as u128 * size_of::<T>() as u128;
    values.try_reserve_exact(n).map_err(|_| ReadError::OutOfMemory { n_bytes })?;
    Ok(values)
}
