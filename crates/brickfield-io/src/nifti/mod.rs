//! NIfTI-1 and NIfTI-2, .nii and .hdr with .img, each plain or gzipped (Cox et al. 2004, nifti1.h; 2011, nifti2.h).
//!
//! Orientation: sform if its code is above 0, else qform, else pixdim alone. Of a series one time is read, of vectors and
//! complex numbers one component, of colours the luminance or a channel. Not: ANALYZE, bits, 128-bit floats.

mod header;
mod write;

pub use write::{save, write};

use std::io::{BufRead, Seek};

use brickfield_core::glam::{DMat3, DQuat, DVec3};
use brickfield_core::{Rescale, ScalarType};

use crate::choice::Entries;
use crate::colour::Colours;
use crate::detached::Promised;
use crate::files::ByteSource;
use crate::limits::{CheckedShape, check_bytes};
use crate::opened::FileFacts;
use crate::placement::{AXES, GridPlacement, usable_spacing};
use crate::rescale::StatedRescale;
use crate::series::{OuterAxis, choose_volume};
use crate::slices::{SamplesAt, StoredVolume};
use crate::stored::{ByteSkip, StoredSamples};
use crate::stored_type::StoredType;
use crate::stored_voxel::StoredVoxel;
use crate::wrapped::{encoding_of, open_part};
use crate::{ChoiceKind, DataFiles, Folder, Format, Note, OpenOptions, Opened, ReadError, WorldFrame};
use header::{NiftiHeader, UNITS};

/// Reads a NIfTI file from its header on. The image of a pair is `files`' `{stem}.img` or `{stem}.img.gz`.
///
/// With an sform or qform the world becomes left-posterior-superior: the file's right-anterior-superior with x and y
/// negated. Voxels keep their type; slope and intercept become the volume's rescale.
///
/// # Errors
/// As [`ReadError`] lists them: a header that is wrong, unsupported or beyond the limits; data that are missing.
pub fn read(
    mut input: impl BufRead + Seek,
    stem: &str,
    files: &dyn DataFiles,
    options: &OpenOptions,
) -> Result<Opened, ReadError> {
    let header = NiftiHeader::read(&mut input)?;
    match header.is_of_pair {
        false => described(&header, &mut input, options)?.read(&mut input, files),
        true => {
            let mut image = open_part(&format!("{stem}.img"), files)?;
            described(&header, &mut *image, options)?.read(&mut *image, files)
        }
    }
}

/// The volume of a header in a file, and the file that its samples are in, not read from yet.
pub(crate) fn described_on_disk(
    mut input: Box<dyn ByteSource>,
    stem: &str,
    folder: &Folder,
    options: &OpenOptions,
) -> Result<(StoredVolume, Box<dyn ByteSource>), ReadError> {
    let header = NiftiHeader::read(&mut *input)?;
    if header.is_of_pair {
        let name = format!("{stem}.img");
        input = folder.open_owned(&name).or_else(|e| folder.open_owned(&format!("{name}.gz")).map_err(|_| e))?;
    }
    Ok((described(&header, &mut *input, options)?, input))
}

fn described(
    header: &NiftiHeader,
    source: &mut dyn ByteSource,
    options: &OpenOptions,
) -> Result<StoredVolume, ReadError> {
    let mut found = FileFacts::plain(Format::Nifti, options);
    let [x, y, z, outer @ ..] = header.sizes;
    let voxel = voxel(header, &mut found)?;
    let n_before = choose_volume(outer_axes(outer), &mut found)?;
    let rescale = rescale(header, &mut found.notes);
    let shape = CheckedShape::claim([x, y, z], voxel, &options.limits)?;
    let (placement, frame) = placement(header, &mut found.notes);
    let grid = placement.grid(shape.dims)?;
    let offset = header.data_offset()?;
    check_bytes(u128::from(offset), &options.limits, || "the space before vox_offset".to_owned())?;
    let (encoding, byte_skip) = (encoding_of(source)?, ByteSkip::Bytes(offset));
    let stored = StoredSamples { encoding, order: header.order, line_skip: 0, byte_skip };
    let promised = Promised { n_voxels: header.n_samples, n_before: n_before * shape.n_voxels() as u128 };
    (found.frame, found.unit) = (frame, unit(header));
    Ok(StoredVolume { found, grid, rescale, shape, stored, promised, place: SamplesAt::Here("the image") })
}

/// nifti1.h: the fourth axis is time, the fifth has the components of a vector.
fn outer_axes(sizes: [u64; 4]) -> Vec<OuterAxis> {
    let axes = [("t", Some(ChoiceKind::Time)), ("u", Some(ChoiceKind::Channel)), ("v", None), ("w", None)];
    let axis = |((name, kind), n_entries): ((&str, _), u64)| OuterAxis { name: name.to_owned(), n_entries, kind };
    axes.into_iter().zip(sizes).map(axis).collect()
}

fn voxel(header: &NiftiHeader, found: &mut FileFacts) -> Result<StoredVoxel, ReadError> {
    let complex = |scalar: ScalarType, found: &mut FileFacts| {
        let names = ["real", "imaginary"].map(str::to_owned).to_vec();
        StoredVoxel::of_components(scalar.into(), ChoiceKind::Channel, Entries::Named(names), found)
    };
    Ok(match header.datatype {
        2 => ScalarType::U8.into(),
        4 => ScalarType::I16.into(),
        8 => ScalarType::I32.into(),
        16 => ScalarType::F32.into(),
        32 => complex(ScalarType::F32, found)?,
        64 => ScalarType::F64.into(),
        128 => StoredVoxel::of_colours(ScalarType::U8.into(), Colours::Rgb, found)?,
        256 => ScalarType::I8.into(),
        512 => ScalarType::U16.into(),
        768 => ScalarType::U32.into(),
        1024 => StoredType::I64.into(),
        1280 => StoredType::U64.into(),
        1792 => complex(ScalarType::F64, found)?,
        2304 => StoredVoxel::of_colours(ScalarType::U8.into(), Colours::Rgba, found)?,
        code => return Err(ReadError::unsupported("datatype", datatype_name(code), crate::STORED_TYPES)),
    })
}

fn datatype_name(code: i16) -> String {
    let name = match code {
        1 => "binary",
        1536 => "float128",
        2048 => "complex256",
        _ => "unknown",
    };
    format!("{name} (code {code})")
}

/// A slope of 0 means: not rescaled. Colours never are (nifti1.h).
fn rescale(header: &NiftiHeader, notes: &mut Vec<Note>) -> Rescale {
    let is_colour = matches!(header.datatype, 128 | 2304);
    match header.slope {
        slope if is_colour || slope == 0.0 => Rescale::IDENTITY,
        slope => StatedRescale { slope, intercept: header.intercept }.usable(notes),
    }
}

fn placement(header: &NiftiHeader, notes: &mut Vec<Note>) -> (GridPlacement, WorldFrame) {
    if header.sform_code > 0 {
        match by_sform(header) {
            Some(placement) => return (placement.negated_xy(), WorldFrame::Lps),
            None => notes.push(Note::OrientationIgnored { what: "the sform is singular or not finite" }),
        }
    }
    let spacing = DVec3::from([0, 1, 2].map(|i| usable_spacing(header.pixdim[i + 1], AXES[i], notes).abs()));
    if header.qform_code > 0 {
        match by_qform(header, spacing) {
            Some(placement) => return (placement.negated_xy(), WorldFrame::Lps),
            None => notes.push(Note::OrientationIgnored { what: "the qform is not finite" }),
        }
    }
    (GridPlacement::axis_aligned(spacing, DVec3::ZERO), WorldFrame::Plain)
}

/// nifti1.h, method 3: rows of the affine map from index to world.
fn by_sform(header: &NiftiHeader) -> Option<GridPlacement> {
    let column = |i: usize| DVec3::from(header.rows.map(|row| row[i]));
    let steps = DMat3::from_cols(column(0), column(1), column(2));
    let first_sample = column(3);
    let unit =
        DMat3::from_cols_array_2d(&steps.to_cols_array_2d().map(|c| DVec3::from(c).normalize_or_zero().to_array()));
    let usable = unit.determinant().abs() > 1e-6 && first_sample.is_finite();
    usable.then_some(GridPlacement { first_sample, steps })
}

/// nifti1.h, method 2: a rotation by the quaternion (a, b, c, d), z mirrored if pixdim[0] is -1.
fn by_qform(header: &NiftiHeader, spacing: DVec3) -> Option<GridPlacement> {
    let [b, c, d, x, y, z] = header.quaternion;
    let a = (1.0 - (b * b + c * c + d * d)).max(0.0).sqrt();
    let first_sample = DVec3::new(x, y, z);
    if !(first_sample.is_finite() && DVec3::new(b, c, d).is_finite()) {
        return None;
    }
    let mirror = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
    let rotation = DMat3::from_quat(DQuat::from_xyzw(b, c, d, a).normalize());
    let steps = rotation * DMat3::from_diagonal(spacing * DVec3::new(1.0, 1.0, mirror));
    Some(GridPlacement { first_sample, steps })
}

fn unit(header: &NiftiHeader) -> Option<String> {
    let code = usize::try_from(header.units & 7).ok()?;
    UNITS.get(code.checked_sub(1)?).map(|name| (*name).to_owned())
}
