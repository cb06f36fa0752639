//! From the frames of slices to voxels.

use std::ops::Range;
use std::rc::Rc;

use brickfield_core::{Rescale, Scalar, ScalarType, ValueRange, Voxels, with_voxels};

use super::colours::interleaved_rgb;
use super::frame_bytes::FrameReader;
use super::image::{Bits, Image};
use super::slice::Slice;
use crate::colour::{ColourPart, Colours};
use crate::files::DataFiles;
use crate::guard::guarded;
use crate::limits::{CheckedShape, Limits, check_bytes};
use crate::numbers::with_room;
use crate::samples::{allocate, append_binary};
use crate::stored_type::{holds, narrowest_integer};
use crate::{ByteOrder, Note, ReadError};

/// The stored values of all slices, in the type of the shape; of colours the part that is wanted.
pub(super) fn read_stored(
    slices: &[Slice],
    shape: &CheckedShape,
    part: ColourPart,
    files: &dyn DataFiles,
    limits: &Limits,
) -> Result<Voxels, ReadError> {
    let mut voxels = allocate(shape)?;
    let mut reader = FrameReader::new(files, limits);
    let mut last: Option<(Rc<Image>, u32, Voxels)> = None;
    for slice in slices {
        // The tiles of a mosaic share a frame.
        let is_same =
            |(image, frame, _): &(Rc<Image>, u32, Voxels)| Rc::ptr_eq(image, &slice.image) && *frame == slice.frame;
        let frame = match last.take().filter(is_same) {
            Some((_, _, frame)) => frame,
            None => guarded("DICOM pixel", || frame_voxels(&mut reader, &slice.image, slice.frame, part, limits))?,
        };
        append_tile(&mut voxels, &frame, slice);
        last = Some((slice.image.clone(), slice.frame, frame));
    }
    Ok(voxels)
}

fn frame_voxels(
    reader: &mut FrameReader,
    image: &Rc<Image>,
    frame: u32,
    part: ColourPart,
    limits: &Limits,
) -> Result<Voxels, ReadError> {
    let bytes = reader.read(image, frame)?;
    let n_samples = image.n_stored_samples() as usize;
    let shape = CheckedShape::claim([n_samples as u64, 1, 1], image.scalar, limits)?;
    let mut samples = allocate(&shape)?;
    append_binary(&mut samples, &mut bytes.as_slice(), n_samples, image.scalar, ByteOrder::Little, &image.name)?;
    keep_stored_bits(&mut samples, image.bits);
    match image.colour.is_grey() {
        true => Ok(samples),
        false => Ok(Colours::Rgb.reduce(interleaved_rgb(samples, image)?, part)),
    }
}

/// Appends the slice's part of its frame, in the type of `out`.
fn append_tile(out: &mut Voxels, frame: &Voxels, slice: &Slice) {
    let [column, row] = slice.corner.map(|n| n as usize);
    let (columns, pitch) = (slice.columns as usize, slice.image.columns as usize);
    let rows = (row..row + slice.rows as usize).map(|r| r * pitch + column..r * pitch + column + columns);
    macro_rules! same_type {
        ($($t:ident)*) => {
            match (out, frame) {
                $((Voxels::$t(out), Voxels::$t(frame)) => rows.for_each(|row| out.extend_from_slice(&frame[row])),)*
                (out, frame) => with_voxels!(out, o => rows.for_each(|row| append_as(o, frame, row))),
            }
        };
    }
    same_type!(U8 I8 U16 I16 U32 I32 F32 F64);
}

fn append_as<T: Scalar>(out: &mut Vec<T>, frame: &Voxels, row: Range<usize>) {
    with_voxels!(frame, f => out.extend(f[row].iter().map(|v| T::from_f64(v.to_f64()))));
}

/// The type that holds the stored values of all slices.
pub(super) fn common_scalar(slices: &[Slice], notes: &mut Vec<Note>) -> ScalarType {
    let first = slices[0].image.value_scalar();
    if slices.iter().all(|slice| slice.image.value_scalar() == first) {
        return first;
    }
    let to = match slices.iter().any(|slice| slice.image.is_float()) {
        true => ScalarType::F64,
        false => {
            let none = ValueRange { min: f64::INFINITY, max: f64::NEG_INFINITY };
            let range = slices.iter().fold(none, |range, slice| range.union(slice.image.value_range()));
            narrowest_integer(range).unwrap_or(ScalarType::F64)
        }
    };
    notes.push(Note::Converted { from: "several types", to });
    to
}

/// Moves the stored bits of samples to the low end, and fills the others with the sign.
fn keep_stored_bits(voxels: &mut Voxels, bits: Bits) {
    let left = bits.n_allocated - 1 - bits.high;
    let right = bits.n_allocated - bits.n_stored;
    // Samples of one bit have been unpacked.
    if right == 0 {
        return;
    }
    macro_rules! shift {
        ($values:expr) => {
            $values.iter_mut().for_each(|v| *v = (*v << left) >> right)
        };
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

/// Voxels, and the map from them to values.
pub(super) struct Rescaled {
    pub(super) voxels: Voxels,
    pub(super) rescale: Rescale,
}

/// Values in the modality's unit. If all slices share a rescale that is not integral, it becomes the volume's rescale and voxels
/// stay as they are stored. Otherwise the values are computed, slice by slice.
pub(super) fn rescaled_slices(
    stored: Voxels,
    slices: &[Slice],
    limits: &Limits,
    notes: &mut Vec<Note>,
) -> Result<Rescaled, ReadError> {
    let mut unusable = Vec::new();
    let rescales: Vec<Rescale> = slices.iter().map(|s| s.rescale.usable(&mut unusable)).collect();
    notes.extend(unusable.into_iter().take(1));
    let is_integral = |r: &Rescale| r.slope().fract() == 0.0 && r.intercept().fract() == 0.0;
    let are_alike = rescales.iter().all(|r| *r == rescales[0]);
    if are_alike && (rescales[0] == Rescale::IDENTITY || !is_integral(&rescales[0])) {
        return Ok(Rescaled { voxels: stored, rescale: rescales[0] });
    }
    let n_per_slice = slices[0].n_samples();
    let to = match rescales.iter().all(is_integral) {
        true => integral_type(&stored, &rescales, n_per_slice),
        false => rescaled_type(stored.scalar_type()),
    };
    let n_bytes = stored.len() as u128 * to.n_bytes() as u128;
    check_bytes(n_bytes, limits, || format!("the volume rescaled to {to}"))?;
    let voxels = match to {
        ScalarType::U8 => apply::<u8>(&stored, &rescales, n_per_slice),
        ScalarType::I8 => apply::<i8>(&stored, &rescales, n_per_slice),
        ScalarType::U16 => apply::<u16>(&stored, &rescales, n_per_slice),
        ScalarType::I16 => apply::<i16>(&stored, &rescales, n_per_slice),
        ScalarType::U32 => apply::<u32>(&stored, &rescales, n_per_slice),
        ScalarType::I32 => apply::<i32>(&stored, &rescales, n_per_slice),
        ScalarType::F32 => apply::<f32>(&stored, &rescales, n_per_slice),
        ScalarType::F64 => apply::<f64>(&stored, &rescales, n_per_slice),
    }?;
    Ok(Rescaled { voxels, rescale: Rescale::IDENTITY })
}

/// The type that holds values of unlike slices: f64 where f32 would lose digits of the stored value.
fn rescaled_type(stored: ScalarType) -> ScalarType {
    match stored {
        ScalarType::U32 | ScalarType::I32 | ScalarType::F64 => ScalarType::F64,
        _ => ScalarType::F32,
    }
}

/// The stored type if all values fit it, else the first integer type that they fit, else f64.
fn integral_type(stored: &Voxels, rescales: &[Rescale], n_per_slice: usize) -> ScalarType {
    let range = with_voxels!(stored, v => rescaled_range(v, rescales, n_per_slice));
    let integers = [ScalarType::I16, ScalarType::U16, ScalarType::I32, ScalarType::U32];
    let mut candidates = std::iter::once(stored.scalar_type()).chain(integers);
    candidates.find(|scalar| holds(*scalar, range)).unwrap_or(ScalarType::F64)
}

fn rescaled_range<T: Scalar>(values: &[T], rescales: &[Rescale], n_per_slice: usize) -> ValueRange {
    let mut range = ValueRange { min: f64::INFINITY, max: f64::NEG_INFINITY };
    for (slice, rescale) in values.chunks(n_per_slice).zip(rescales) {
        for value in slice.iter().map(|v| rescale.value(v.to_f64())) {
            range = ValueRange { min: range.min.min(value), max: range.max.max(value) };
        }
    }
    range
}

fn apply<T: Scalar>(stored: &Voxels, rescales: &[Rescale], n_per_slice: usize) -> Result<Voxels, ReadError> {
    let mut values = with_room::<T>(stored.len())?;
    with_voxels!(stored, v => {
        for (slice, rescale) in v.chunks(n_per_slice).zip(rescales) {
            values.extend(slice.iter().map(|x| T::from_f64(rescale.value(x.to_f64()))));
        }
    });
    Ok(T::wrap(values))
}
