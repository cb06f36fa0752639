//! MGH and MGZ of FreeSurfer (surfer.nmr.mgh.harvard.edu, "MghFormat"), plain or gzipped; big-endian throughout.
//!
//! Of several frames one is read. What comes after the samples (scan parameters, tags) is not.

use std::io::{BufRead, Seek};

use brickfield_core::ScalarType;
use brickfield_core::glam::{DMat3, DVec3};

use crate::error::check_length;
use crate::files::ByteSource;
use crate::limits::{CheckedShape, n_samples};
use crate::opened::FileFacts;
use crate::placement::{AXES, GridPlacement, usable_spacing};
use crate::series::{OuterAxis, choose_volume};
use crate::stored::{ByteSkip, DataFile, Encoding, StoredSamples};
use crate::wrapped::{HeaderNumbers, encoding_of, read_start};
use crate::{ByteOrder, ChoiceKind, Format, Note, OpenOptions, Opened, ReadError, WorldFrame};

/// The header, and space that is kept for later versions.
const HEADER_BYTES: usize = 284;

/// Reads an MGH or MGZ file.
///
/// The world becomes left-posterior-superior: the file's right-anterior-superior with x and y negated. A file without an
/// orientation is taken for coronal with a spacing of 1, as FreeSurfer does, with notes.
///
/// # Errors
/// As [`ReadError`] lists them: a header that is wrong, unsupported or beyond the limits; data that are missing.
pub fn read(mut input: impl BufRead + Seek, options: &OpenOptions) -> Result<Opened, ReadError> {
    read_from(&mut input, options)
}

fn read_from(source: &mut dyn ByteSource, options: &OpenOptions) -> Result<Opened, ReadError> {
    let encoding = encoding_of(source)?;
    let bytes = header_bytes(source, encoding)?;
    let header = HeaderNumbers { bytes: &bytes, order: ByteOrder::Big };
    let sizes = sizes(&header)?;
    let [x, y, z, n_frames] = sizes;
    let mut found = FileFacts::plain(Format::Mgh, options);
    let frames = OuterAxis { name: "frames".to_owned(), n_entries: n_frames, kind: Some(ChoiceKind::Time) };
    let n_before = choose_volume(vec![frames], &mut found)?;
    let shape = CheckedShape::claim([x, y, z], scalar(&header)?, &options.limits)?;
    let grid = placement(&header, [x, y, z], &mut found.notes).negated_xy().grid(shape.dims)?;
    let byte_skip = ByteSkip::Bytes(HEADER_BYTES as u64);
    let stored = StoredSamples { encoding, order: ByteOrder::Big, line_skip: 0, byte_skip };
    let n_wanted = shape.n_voxels();
    let n_before = n_before * n_wanted as u128;
    let part = DataFile { name: "the image", n_voxels: n_samples("sizes", &sizes)?, n_before, n_wanted };
    let voxels = stored.read(source, &part, &shape, &mut found.notes)?;
    // Scan parameters and tags are no samples.
    found.notes.retain(|note| *note != Note::SurplusData);
    (found.frame, found.unit) = (WorldFrame::Lps, Some("mm".to_owned()));
    found.finish(grid, voxels)
}

/// Whether this is how an MGH file begins: version 1, sizes above 0, a known type, a flag of 0 or 1.
pub(crate) fn has_magic(head: &[u8]) -> bool {
    let numbers = HeaderNumbers { bytes: head, order: ByteOrder::Big };
    let [version, sizes @ .., code] = numbers.i32s::<6>(0);
    let is_flag = matches!(numbers.i16s::<1>(28), [0 | 1]);
    head.len() >= HEADER_BYTES && version == 1 && sizes.iter().all(|n| *n > 0) && (0..=10).contains(&code) && is_flag
}

fn header_bytes(source: &mut dyn ByteSource, encoding: Encoding) -> Result<[u8; HEADER_BYTES], ReadError> {
    let mut bytes = [0; HEADER_BYTES];
    let n = read_start(source, encoding, &mut bytes)?;
    if !1u32.to_be_bytes().starts_with(&bytes[..n.min(4)]) {
        return Err(ReadError::wrong_start(Format::Mgh, &bytes[..n], "1, the version, in four bytes"));
    }
    check_length("the header", n as u64, HEADER_BYTES as u128)?;
    Ok(bytes)
}

/// Width, height, depth and frames.
fn sizes(header: &HeaderNumbers) -> Result<[u64; 4], ReadError> {
    let sizes = header.i32s::<4>(4);
    let mut checked = [0; 4];
    for ((out, size), name) in checked.iter_mut().zip(sizes).zip(["width", "height", "depth", "number of frames"]) {
        let in_range = u64::try_from(size).ok().filter(|n| *n >= 1);
        *out = in_range.ok_or_else(|| ReadError::field(name, size, format!("1 to {}", i32::MAX)))?;
    }
    Ok(checked)
}

fn scalar(header: &HeaderNumbers) -> Result<ScalarType, ReadError> {
    let [code] = header.i32s::<1>(20);
    Ok(match code {
        0 => ScalarType::U8,
        1 => ScalarType::I32,
        3 => ScalarType::F32,
        4 => ScalarType::I16,
        10 => ScalarType::U16,
        _ => return Err(ReadError::unsupported("type", code, "0 (u8), 1 (i32), 3 (f32), 4 (i16) and 10 (u16) are")),
    })
}

/// The right-anterior-superior place: directions of the axes, and the position of the voxel of index dims / 2.
fn placement(header: &HeaderNumbers, dims: [u64; 3], notes: &mut Vec<Note>) -> GridPlacement {
    let half = DVec3::from(dims.map(|n| n as f64 / 2.0));
    let stated = (header.i16s::<1>(28) != [0]).then(|| {
        let spacing = header.f32s_wide::<3>(30);
        let spacing = DVec3::from([0, 1, 2].map(|i| usable_spacing(spacing[i], AXES[i], notes).abs()));
        let directions = DMat3::from_cols_array(&header.f32s_wide::<9>(42));
        (directions * DMat3::from_diagonal(spacing), DVec3::from(header.f32s_wide::<3>(78)))
    });
    let (steps, centre) = stated.unwrap_or_else(|| {
        notes.extend(AXES.map(|axis| Note::SpacingAssumed { axis, reason: "is not stated" }));
        (DMat3::from_cols(DVec3::NEG_X, DVec3::NEG_Z, DVec3::Y), DVec3::ZERO)
    });
    GridPlacement { first_sample: centre - steps * half, steps }
}
