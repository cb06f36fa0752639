//! From the pixel data of slices to voxels.

use brickfield_core::{Scalar, ScalarType, ValueRange, Voxels, with_voxels};
use dicom_dictionary_std::tags;
use dicom_object::DefaultDicomObject;
use dicom_pixeldata::PixelDecoder;

use super::slice::{Bits, ReadExtent, Slice, read_object};
use crate::error::bytes;
use crate::error::check_length;
use crate::files::{DataFiles, open_named};
use crate::guard::guarded;
use crate::limits::{CheckedShape, Limits, check_bytes};
use crate::rescale::{Rescale, rescaled_type};
use crate::samples::{allocate, append_binary, with_room};
use crate::{ByteOrder, Note, ReadError};

/// The stored values of all slices, in the type that the first one has.
pub(super) fn read_stored(slices: &[Slice], shape: &CheckedShape, files: &dyn DataFiles) -> Result<Voxels, ReadError> {
    let mut voxels = allocate(shape)?;
    for slice in slices {
        let bytes = guarded("DICOM pixel", || decode(slice, files))?;
        append_binary(&mut voxels, &mut bytes.as_slice(), slice.n_samples(), ByteOrder::Little, &slice.name)?;
        keep_stored_bits(&mut voxels, slice.n_samples(), slice.bits);
    }
    Ok(voxels)
}

fn decode(slice: &Slice, files: &dyn DataFiles) -> Result<Vec<u8>, ReadError> {
    let object = read_object(&mut *open_named(files, &slice.name)?, ReadExtent::WithPixels)?;
    check_fragments(&object, slice)?;
    let expected_bytes = slice.n_samples() as u128 * u128::from(slice.bits.n_allocated / 8);
    let what = || format!("the pixels of {:?}, {} promised", slice.name, bytes(expected_bytes));
    let decoded = object.decode_pixel_data_frame(0).map_err(|e| ReadError::decoder(what(), e))?;
    check_length(&slice.name, decoded.data().len() as u64, expected_bytes)?;
    Ok(decoded.into_data())
}

/// JPEG states its size once more; a decoder would allocate by it.
fn check_fragments(object: &DefaultDicomObject, slice: &Slice) -> Result<(), ReadError> {
    let missing = || ReadError::decoder(format!("slice {:?}", slice.name), ReadError::Missing { field: "PixelData" });
    let element = object.get(tags::PIXEL_DATA).ok_or_else(missing)?;
    let Some(fragments) = element.fragments() else {
        let expected_bytes = slice.n_samples() as u128 * u128::from(slice.bits.n_allocated / 8);
        let n_bytes = element.to_bytes().map_or(0, |b| b.len() as u64);
        return check_length(&slice.name, n_bytes, expected_bytes);
    };
    if !object.meta().transfer_syntax().starts_with(JPEG_SYNTAXES) {
        return Ok(());
    }
    let size = jpeg_size(&fragments.concat()).ok_or(ReadError::Missing { field: "the JPEG frame header" })?;
    if size != [slice.columns, slice.rows] {
        let expected = format!("{} x {}, as the data set has it", slice.columns, slice.rows);
        return Err(ReadError::field("JPEG frame", format!("{} x {}", size[0], size[1]), expected));
    }
    Ok(())
}

const JPEG_SYNTAXES: &str = "1.2.840.10008.1.2.4.";

/// Columns and rows of the first frame header, if these bytes are the start of a JPEG.
fn jpeg_size(bytes: &[u8]) -> Option<[u64; 2]> {
    let mut at = bytes.strip_prefix(&[0xff, 0xd8])?;
    while let [0xff, marker, rest @ ..] = at {
        if *marker == 0xff {
            at = &at[1..];
            continue;
        }
        let length = usize::from(u16::from_be_bytes([*rest.first()?, *rest.get(1)?]));
        if matches!(marker, 0xc0..=0xcf) && !matches!(marker, 0xc4 | 0xc8 | 0xcc) {
            let word = |i: usize| Some(u64::from(u16::from_be_bytes([*rest.get(i)?, *rest.get(i + 1)?])));
            return Some([word(5)?, word(3)?]);
        }
        at = rest.get(length..)?;
    }
    None
}

/// Moves the stored bits of the last `n` samples to the low end, and fills the others with the sign.
fn keep_stored_bits(voxels: &mut Voxels, n: usize, bits: Bits) {
    let left = bits.n_allocated - 1 - bits.high;
    let right = bits.n_allocated - bits.n_stored;
    if right == 0 {
        return;
    }
    macro_rules! shift {
        ($values:expr) => {{
            let start = $values.len() - n;
            $values[start..].iter_mut().for_each(|v| *v = (*v << left) >> right);
        }};
    }
    match voxels {
        Voxels::U8(v) => shift!(v),
        Voxels::I8(v) => shift!(v),
        Voxels::U16(v) => shift!(v),
        Voxels::I16(v) => shift!(v),
        Voxels::U32(v) => shift!(v),
        Voxels::I32(v) => shift!(v),
        Voxels::F32(_) | Voxels::F64(_) => {}
    }
}

/// The values that the modality means, slice by slice.
pub(super) fn rescaled_slices(
    stored: Voxels,
    slices: &[Slice],
    limits: &Limits,
    notes: &mut Vec<Note>,
) -> Result<Voxels, ReadError> {
    let mut unusable = Vec::new();
    let rescales: Vec<Rescale> = slices.iter().map(|s| s.rescale.usable(&mut unusable)).collect();
    notes.extend(unusable.into_iter().take(1));
    if rescales.iter().all(|r| *r == Rescale::IDENTITY) {
        return Ok(stored);
    }
    let n_per_slice = slices[0].n_samples();
    let to = target_type(&stored, &rescales, n_per_slice);
    let n_bytes = stored.len() as u128 * to.n_bytes() as u128;
    check_bytes(n_bytes, limits, || format!("the volume rescaled to {to}"))?;
    match to {
        ScalarType::U8 => apply::<u8>(&stored, &rescales, n_per_slice),
        ScalarType::I8 => apply::<i8>(&stored, &rescales, n_per_slice),
        ScalarType::U16 => apply::<u16>(&stored, &rescales, n_per_slice),
        ScalarType::I16 => apply::<i16>(&stored, &rescales, n_per_slice),
        ScalarType::U32 => apply::<u32>(&stored, &rescales, n_per_slice),
        ScalarType::I32 => apply::<i32>(&stored, &rescales, n_per_slice),
        ScalarType::F32 => apply::<f32>(&stored, &rescales, n_per_slice),
        ScalarType::F64 => apply::<f64>(&stored, &rescales, n_per_slice),
    }
}

fn target_type(stored: &Voxels, rescales: &[Rescale], n_per_slice: usize) -> ScalarType {
    let is_integral = |r: &Rescale| r.slope.fract() == 0.0 && r.intercept.fract() == 0.0;
    if !rescales.iter().all(is_integral) {
        return rescaled_type(stored.scalar_type());
    }
    let range = with_voxels!(stored, v => rescaled_range(v, rescales, n_per_slice));
    let integers = [ScalarType::I16, ScalarType::U16, ScalarType::I32, ScalarType::U32];
    let mut candidates = std::iter::once(stored.scalar_type()).chain(integers);
    candidates.find(|t| fits(range, *t)).unwrap_or(ScalarType::F64)
}

fn rescaled_range<T: Scalar>(values: &[T], rescales: &[Rescale], n_per_slice: usize) -> ValueRange {
    let mut range = ValueRange { min: f64::INFINITY, max: f64::NEG_INFINITY };
    for (slice, rescale) in values.chunks(n_per_slice).zip(rescales) {
        for value in slice.iter().map(|v| rescale.apply(v.to_f64())) {
            range = ValueRange { min: range.min.min(value), max: range.max.max(value) };
        }
    }
    range
}

fn fits(range: ValueRange, scalar: ScalarType) -> bool {
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

fn apply<T: Scalar>(stored: &Voxels, rescales: &[Rescale], n_per_slice: usize) -> Result<Voxels, ReadError> {
    let mut values = with_room::<T>(stored.len())?;
    with_voxels!(stored, v => {
        for (slice, rescale) in v.chunks(n_per_slice).zip(rescales) {
            values.extend(slice.iter().map(|x| T::from_f64(rescale.apply(x.to_f64()))));
        }
    });
    Ok(T::wrap(values))
}
