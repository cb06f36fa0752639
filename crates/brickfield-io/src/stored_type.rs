//! The types in which files store samples, and the scalar types that they are read into.

use std::fmt;

use brickfield_core::{Scalar, ScalarType, ValueRange, Voxels, with_voxels};

use crate::numbers::{ByteOrder, FileScalar, with_room};
use crate::{Note, ReadError};

/// The type of a sample in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StoredType {
    Scalar(ScalarType),
    /// A byte; 0 is false, all else is true.
    #[allow(dead_code, reason = "no reader in every build has it")]
    Bool,
    /// IEEE 754 binary16.
    #[allow(dead_code, reason = "no reader in every build has it")]
    F16,
    I64,
    U64,
}

/// The greatest integer up to which f64 holds all of them.
const MAX_EXACT: u64 = 1 << 53;

/// An integer that f64 does not hold exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Inexact(i128);

impl StoredType {
    pub(crate) const fn n_bytes(self) -> usize {
        match self {
            StoredType::Scalar(scalar) => scalar.n_bytes(),
            StoredType::Bool => 1,
            StoredType::F16 => 2,
            StoredType::I64 | StoredType::U64 => 8,
        }
    }

    pub(crate) const fn name(self) -> &'static str {
        match self {
            StoredType::Scalar(scalar) => scalar.name(),
            StoredType::Bool => "bool",
            StoredType::F16 => "float16",
            StoredType::I64 => "int64",
            StoredType::U64 => "uint64",
        }
    }

    /// The type that samples are read into. Of 64-bit integers, [`converted`](Self::converted) makes a narrower one.
    pub(crate) const fn read_into(self) -> ScalarType {
        match self {
            StoredType::Scalar(scalar) => scalar,
            StoredType::Bool => ScalarType::U8,
            StoredType::F16 => ScalarType::F32,
            StoredType::I64 | StoredType::U64 => ScalarType::F64,
        }
    }

    /// The name of this type, if samples are read into another one.
    #[cfg(feature = "ome-zarr")]
    pub(crate) fn other_than(self, scalar: ScalarType) -> Option<&'static str> {
        (self != StoredType::Scalar(scalar)).then(|| self.name())
    }

    /// All voxels in the type that they are to have, with a note if the file's is another one: 64-bit integers become
    /// the narrowest integers that hold them, else f64.
    ///
    /// # Errors
    /// If there is no memory for a copy.
    pub(crate) fn converted(self, voxels: Voxels, notes: &mut Vec<Note>) -> Result<Voxels, ReadError> {
        let voxels = match self {
            StoredType::Scalar(_) => return Ok(voxels),
            StoredType::Bool | StoredType::F16 => voxels,
            StoredType::I64 | StoredType::U64 => narrowed(voxels)?,
        };
        notes.push(Note::Converted { from: self.name(), to: voxels.scalar_type() });
        Ok(voxels)
    }

    /// Appends the samples in `bytes`.
    ///
    /// # Errors
    /// The first integer that f64 does not hold exactly; those before it have been appended.
    pub(crate) fn append<T: FileScalar>(self, bytes: &[u8], order: ByteOrder, out: &mut Vec<T>) -> Result<(), Inexact> {
        match self {
            StoredType::Scalar(_) => T::append(bytes, order, out),
            StoredType::Bool => out.extend(bytes.iter().map(|b| T::from_f64(f64::from(u8::from(*b != 0))))),
            StoredType::F16 => {
                let numbers = little_endian::<2>(bytes, order).map(u16::from_le_bytes);
                out.extend(numbers.map(|bits| T::from_f64(f64::from(f32_of_f16(bits)))));
            }
            StoredType::I64 => {
                for number in little_endian::<8>(bytes, order).map(i64::from_le_bytes) {
                    out.push(T::from_f64(exact(number.into())?));
                }
            }
            StoredType::U64 => {
                for number in little_endian::<8>(bytes, order).map(u64::from_le_bytes) {
                    out.push(T::from_f64(exact(number.into())?));
                }
            }
        }
        Ok(())
    }

    /// The sample that is written as text.
    pub(crate) fn parse<T: FileScalar>(self, text: &str) -> Option<T> {
        match self {
            StoredType::Scalar(_) | StoredType::F16 => parse(text),
            StoredType::Bool => parse::<u8>(text).map(|v| T::from_f64(f64::from(u8::from(v != 0)))),
            StoredType::I64 | StoredType::U64 => {
                let number: f64 = match text.parse::<i128>() {
                    Ok(number) => exact(number).ok()?,
                    Err(_) => parse(text).filter(|v: &f64| v.fract() == 0.0 && v.abs() <= MAX_EXACT as f64)?,
                };
                (self == StoredType::I64 || number >= 0.0).then(|| T::from_f64(number))
            }
        }
    }

    /// What text is expected of a sample.
    pub(crate) fn expected_text(self) -> String {
        match self {
            StoredType::I64 | StoredType::U64 => format!("a number that fits {self}, {}", exact_range()),
            _ => format!("a number that fits {self}"),
        }
    }
}

impl Inexact {
    pub(crate) fn of_sample(self, i: usize, what: &str) -> ReadError {
        ReadError::field(format!("sample {i} of {what}"), self.0, exact_range())
    }
}

fn exact_range() -> String {
    format!("-{MAX_EXACT} to {MAX_EXACT}, all of which f64 holds exactly")
}

fn exact(number: i128) -> Result<f64, Inexact> {
    match number.unsigned_abs() <= u128::from(MAX_EXACT) {
        true => Ok(number as f64),
        false => Err(Inexact(number)),
    }
}

impl From<ScalarType> for StoredType {
    fn from(scalar: ScalarType) -> StoredType {
        StoredType::Scalar(scalar)
    }
}

impl fmt::Display for StoredType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The bytes of each number, the low end first.
fn little_endian<const N: usize>(bytes: &[u8], order: ByteOrder) -> impl Iterator<Item = [u8; N]> {
    bytes.as_chunks::<N>().0.iter().map(move |number| {
        let mut number = *number;
        if order == ByteOrder::Big {
            number.reverse();
        }
        number
    })
}

fn f32_of_f16(bits: u16) -> f32 {
    let sign = u32::from(bits >> 15) << 31;
    let (exponent, fraction) = (u32::from(bits >> 10) & 0x1f, u32::from(bits) & 0x3ff);
    match exponent {
        // Not normal: a multiple of 2^-24.
        0 => f32::from_bits(sign | (fraction as f32 * 2f32.powi(-24)).to_bits()),
        31 => f32::from_bits(sign | 0x7f80_0000 | fraction << 13),
        _ => f32::from_bits(sign | (exponent + 127 - 15) << 23 | fraction << 13),
    }
}

/// The number, also where an integer is written as a float ("3.0").
fn parse<T: FileScalar>(text: &str) -> Option<T> {
    text.parse().ok().or_else(|| {
        let wide: f64 = text.parse().ok()?;
        let value = T::from_f64(wide);
        (value.to_f64() == wide).then_some(value)
    })
}

/// Integers in the narrowest type that holds all of them. Luminances are rounded to integers.
fn narrowed(voxels: Voxels) -> Result<Voxels, ReadError> {
    fn of<T: Scalar>(values: &[impl Scalar]) -> Result<Voxels, ReadError> {
        let mut narrow = with_room::<T>(values.len())?;
        narrow.extend(values.iter().map(|v| T::from_f64(v.to_f64().round())));
        Ok(T::wrap(narrow))
    }
    with_voxels!(&voxels, values => {
        let range = values.iter().fold(ValueRange { min: 0.0, max: 0.0 }, |range, v| {
            let value = v.to_f64().round();
            range.union(ValueRange { min: value, max: value })
        });
        match narrowest_integer(range) {
            Some(ScalarType::U8) => of::<u8>(values),
            Some(ScalarType::I8) => of::<i8>(values),
            Some(ScalarType::U16) => of::<u16>(values),
            Some(ScalarType::I16) => of::<i16>(values),
            Some(ScalarType::U32) => of::<u32>(values),
            Some(ScalarType::I32) => of::<i32>(values),
            Some(ScalarType::F32 | ScalarType::F64) | None => of::<f64>(values),
        }
    })
}

/// The narrowest integer type that holds a range of values, unsigned first.
pub(crate) fn narrowest_integer(range: ValueRange) -> Option<ScalarType> {
    use ScalarType::{I8, I16, I32, U8, U16, U32};
    [U8, I8, U16, I16, U32, I32].into_iter().find(|scalar| holds(*scalar, range))
}

/// Whether an integer type holds a range of values; floats hold every range.
pub(crate) fn holds(scalar: ScalarType, range: ValueRange) -> bool {
    let (min, max) = match scalar {
        ScalarType::U8 => (0.0, f64::from(u8::MAX)),
        ScalarType::I8 => (f64::from(i8::MIN), f64::from(i8::MAX)),
        ScalarType::U16 => (0.0, f64::from(u16::MAX)),
        ScalarType::I16 => (f64::from(i16::MIN), f64::from(i16::MAX)),
        ScalarType::U32 => (0.0, f64::from(u32::MAX)),
        ScalarType::I32 => (f64::from(i32::MIN), f64::from(i32::MAX)),
        ScalarType::F32 | ScalarType::F64 => return true,
    };
    min <= range.min && range.max <= max
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_precision_is_exact() {
        let known: [(u16, f32); 8] = [
            (0x0000, 0.0),
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x7bff, 65504.0),
            (0x0001, 5.960_464_5e-8),
            (0x03ff, 6.097_555e-5),
            (0x7c00, f32::INFINITY),
            (0xfc00, f32::NEG_INFINITY),
        ];
        for (bits, value) in known {
            assert_eq!(f32_of_f16(bits), value, "{bits:04x}");
        }
        assert!(f32_of_f16(0x7e00).is_nan());
        assert_eq!(f32_of_f16(0x8000).to_bits(), (-0.0f32).to_bits());
    }

    #[test]
    fn wide_integers_become_the_narrowest_type() {
        let voxels = |values: &[i64], order| {
            let bytes: Vec<u8> = values
                .iter()
                .flat_map(|v| if order == ByteOrder::Big { v.to_be_bytes() } else { v.to_le_bytes() })
                .collect();
            let (mut out, mut notes) = (Vec::<f64>::new(), vec![]);
            StoredType::I64.append(&bytes, order, &mut out).unwrap();
            let voxels = StoredType::I64.converted(Voxels::from(out), &mut notes).unwrap();
            assert_eq!(notes, [Note::Converted { from: "int64", to: voxels.scalar_type() }]);
            voxels
        };
        for order in [ByteOrder::Little, ByteOrder::Big] {
            assert_eq!(voxels(&[0, 255], order), Voxels::from(vec![0u8, 255]));
            assert_eq!(voxels(&[-1, 127], order), Voxels::from(vec![-1i8, 127]));
            assert_eq!(voxels(&[7, 256], order), Voxels::from(vec![7u16, 256]));
            assert_eq!(voxels(&[-1, 128], order), Voxels::from(vec![-1i16, 128]));
            assert_eq!(voxels(&[7, 1 << 31], order), Voxels::from(vec![7u32, 1 << 31]));
            assert_eq!(voxels(&[-1, 1 << 16], order), Voxels::from(vec![-1i32, 1 << 16]));
            assert_eq!(voxels(&[-(1 << 53), 5], order), Voxels::from(vec![-9_007_199_254_740_992.0, 5.0]));
        }
    }

    #[test]
    fn integers_beyond_f64_are_refused() {
        let fault = |stored: StoredType, bytes: [u8; 8]| {
            let fault = stored.append(&bytes, ByteOrder::Little, &mut Vec::<f64>::new()).unwrap_err();
            fault.of_sample(3, "the data").to_string()
        };
        let expected = "expected -9007199254740992 to 9007199254740992, all of which f64 holds exactly";
        assert_eq!(
            fault(StoredType::I64, i64::MIN.to_le_bytes()),
            format!("sample 3 of the data is \"-9223372036854775808\"; {expected}")
        );
        assert_eq!(
            fault(StoredType::U64, ((1u64 << 53) + 1).to_le_bytes()),
            format!("sample 3 of the data is \"9007199254740993\"; {expected}")
        );
        assert_eq!(StoredType::U64.parse::<f64>("-1"), None);
        assert_eq!(StoredType::I64.parse::<f64>("9007199254740993"), None);
        assert_eq!(StoredType::I64.parse::<f64>("3.0"), Some(3.0));
        assert_eq!(StoredType::Bool.parse::<u8>("7"), Some(1));
    }
}
