//! NIfTI-1, .nii and .hdr with .img, each plain or gzipped (Cox et al. 2004, nifti1.h). Header by the `nifti` crate.
//!
//! Orientation: sform if its code is above 0, else qform, else pixdim alone. Not: NIfTI-2, ANALYZE, colours, complex
//! and 64-bit integers. Of a time series the first volume is read.

mod write;

pub use write::{save, write};

use std::io::{BufRead, Cursor, Read, Seek};

use brickfield_core::glam::{DMat3, DQuat, DVec3};
use brickfield_core::{Rescale, ScalarType};
use nifti::NiftiHeader;

use crate::deflate::{check_ratio, inflate};
use crate::error::Shown;
use crate::error::check_length;
use crate::files::{ByteSource, n_bytes_left, open_named};
use crate::limits::{CheckedShape, check_bytes};
use crate::opened::FileFacts;
use crate::placement::{AXES, GridPlacement, usable_spacing};
use crate::rescale::StatedRescale;
use crate::samples::{allocate, append_binary, fill_named, skip};
use crate::{ByteOrder, DataFiles, Format, Note, OpenOptions, Opened, ReadError, WorldFrame};

const HEADER_BYTES: usize = 348;

/// Reads a NIfTI-1 file from its header on. The image of a pair is `files`' `{stem}.img` or `{stem}.img.gz`.
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
    let mut stream = Stream::new(&mut input)?;
    let header = read_header(&mut stream)?;
    match &header.magic {
        b"n+1\0" => {
            let at = Position { n_read: HEADER_BYTES as u64, offset: data_offset(&header)? };
            read_image(&header, stream, at, options)
        }
        _ => {
            let mut image = open_image(stem, files)?;
            let at = Position { n_read: 0, offset: header_offset(&header)? };
            read_image(&header, Stream::new(&mut *image)?, at, options)
        }
    }
}

/// A plain or gzipped source, read once from start to end.
struct Stream<'a> {
    reader: Box<dyn Read + 'a>,
    n_stored_bytes: u64,
    is_gzip: bool,
}

impl<'a> Stream<'a> {
    fn new(source: &'a mut dyn ByteSource) -> Result<Stream<'a>, ReadError> {
        let n_stored_bytes = n_bytes_left(source)?;
        if n_stored_bytes == 0 {
            return Err(ReadError::Empty);
        }
        let is_gzip = source.fill_buf().map_err(|e| ReadError::io("the file", e))?.first() == Some(&0x1f);
        let reader: Box<dyn Read + 'a> = match is_gzip {
            true => inflate(source).map_err(|e| ReadError::io("the file", e))?,
            false => Box::new(source),
        };
        Ok(Stream { reader, n_stored_bytes, is_gzip })
    }

    /// Whether the source can hold so many bytes at all, before they are allocated.
    fn check_can_hold(&self, n_bytes: u128) -> Result<(), ReadError> {
        match self.is_gzip {
            true => check_ratio("the file", self.n_stored_bytes, n_bytes),
            false => check_length("the file", self.n_stored_bytes, n_bytes),
        }
    }
}

fn open_image<'a>(stem: &str, files: &'a dyn DataFiles) -> Result<Box<dyn ByteSource + 'a>, ReadError> {
    let plain = format!("{stem}.img");
    open_named(files, &plain).or_else(|e| open_named(files, &format!("{plain}.gz")).map_err(|_| e))
}

fn read_header(stream: &mut Stream) -> Result<NiftiHeader, ReadError> {
    let mut bytes = [0; HEADER_BYTES];
    let n = fill_named(&mut stream.reader, &mut bytes, "the header")?;
    let begins_with = |size: u32| {
        let found = &bytes[..n.min(4)];
        size.to_le_bytes().starts_with(found) || size.to_be_bytes().starts_with(found)
    };
    if !begins_with(348) && !begins_with(540) {
        return Err(ReadError::wrong_start(Format::Nifti, &bytes[..n], "348, the length of its header"));
    }
    check_length("the header", n as u64, HEADER_BYTES as u128)?;
    if begins_with(540) {
        return Err(ReadError::unsupported("version", "NIfTI-2", "NIfTI-1 is"));
    }
    if !matches!(&bytes[344..], b"n+1\0" | b"ni1\0") {
        let found = Shown::of_bytes(&bytes[344..]);
        return Err(ReadError::WrongMagic { format: Format::Nifti, what: "magic", found, expected: "n+1 or ni1" });
    }
    NiftiHeader::from_reader(Cursor::new(&bytes[..])).map_err(|e| ReadError::decoder("NIfTI header", e))
}

/// Where the samples begin in a file of their own.
fn header_offset(header: &NiftiHeader) -> Result<u64, ReadError> {
    let offset = header.vox_offset;
    match offset.is_finite() && (0.0..=1e15).contains(&offset) {
        true => Ok(offset as u64),
        false => Err(ReadError::field("vox_offset", offset, "0 to 1e15")),
    }
}

/// Where the samples begin in a file that has the header too; some writers leave it 0.
fn data_offset(header: &NiftiHeader) -> Result<u64, ReadError> {
    match header_offset(header)? {
        0 => Ok(352),
        offset if offset >= HEADER_BYTES as u64 => Ok(offset),
        offset => Err(ReadError::field("vox_offset", offset, "0 or at least 348")),
    }
}

/// Where the samples begin, and how much has been read before.
struct Position {
    n_read: u64,
    offset: u64,
}

fn read_image(
    header: &NiftiHeader,
    mut stream: Stream,
    at: Position,
    options: &OpenOptions,
) -> Result<Opened, ReadError> {
    let mut found = FileFacts::plain(Format::Nifti, options);
    let (dims, n_all) = dims(header, &mut found.notes)?;
    let stored = scalar(header)?;
    let rescale = rescale(header, &mut found.notes);
    let shape = CheckedShape::claim(dims, stored, &options.limits)?;
    let (placement, frame) = placement(header, &mut found.notes);
    let grid = placement.grid(shape.dims)?;
    stream.check_can_hold(u128::from(at.offset) + n_all.saturating_mul(stored.n_bytes() as u128))?;
    check_bytes(u128::from(at.offset), &options.limits, || "the space before vox_offset".to_owned())?;
    skip(&mut stream.reader, at.offset - at.n_read, "the space before vox_offset")?;
    let mut voxels = allocate(&shape)?;
    append_binary(&mut voxels, &mut stream.reader, shape.n_voxels(), shape.voxel, order(header), "the image")?;
    if stream.is_gzip && n_all == shape.n_voxels() as u128 {
        crate::deflate::check_end(&mut stream.reader, "the image", shape.n_stored_bytes(), &mut found.notes)?;
    }
    (found.frame, found.unit) = (frame, unit(header));
    found.finish_rescaled(grid, voxels, rescale)
}

fn order(header: &NiftiHeader) -> ByteOrder {
    match header.endianness {
        nifti::Endianness::Little => ByteOrder::Little,
        nifti::Endianness::Big => ByteOrder::Big,
    }
}

/// The dimensions of the first volume, and the number of samples of all volumes.
fn dims(header: &NiftiHeader, notes: &mut Vec<Note>) -> Result<([u64; 3], u128), ReadError> {
    let n_axes = usize::from(header.dim[0]);
    if !(1..=7).contains(&n_axes) {
        return Err(ReadError::field("dim[0]", n_axes, "1 to 7"));
    }
    let mut sizes = [1u64; 7];
    for (i, (size, stated)) in sizes.iter_mut().zip(&header.dim[1..=n_axes]).enumerate() {
        if !(1..=0x7fff).contains(stated) {
            return Err(ReadError::field(format!("dim[{}]", i + 1), *stated as i16, "1 to 32767"));
        }
        *size = u64::from(*stated);
    }
    for (axis, n_entries) in ["t", "u", "v", "w"].into_iter().zip(sizes[3..].iter().copied()) {
        if n_entries > 1 {
            notes.push(Note::FirstOfAxis { axis: axis.to_owned(), n_entries });
        }
    }
    Ok(([sizes[0], sizes[1], sizes[2]], sizes.iter().fold(1u128, |n, s| n.saturating_mul(u128::from(*s)))))
}

fn scalar(header: &NiftiHeader) -> Result<ScalarType, ReadError> {
    Ok(match header.datatype {
        2 => ScalarType::U8,
        4 => ScalarType::I16,
        8 => ScalarType::I32,
        16 => ScalarType::F32,
        64 => ScalarType::F64,
        256 => ScalarType::I8,
        512 => ScalarType::U16,
        768 => ScalarType::U32,
        code => return Err(ReadError::unsupported("datatype", datatype_name(code), crate::SCALARS)),
    })
}

fn datatype_name(code: i16) -> String {
    let name = match code {
        1 => "binary",
        32 => "complex64",
        128 => "RGB24",
        1024 => "int64",
        1280 => "uint64",
        1536 => "float128",
        1792 => "complex128",
        2048 => "complex256",
        2304 => "RGBA32",
        _ => "unknown",
    };
    format!("{name} (code {code})")
}

/// A slope of 0 means: not rescaled.
fn rescale(header: &NiftiHeader, notes: &mut Vec<Note>) -> Rescale {
    match header.scl_slope {
        0.0 => Rescale::IDENTITY,
        slope => StatedRescale { slope: f64::from(slope), intercept: f64::from(header.scl_inter) }.usable(notes),
    }
}

fn placement(header: &NiftiHeader, notes: &mut Vec<Note>) -> (GridPlacement, WorldFrame) {
    if header.sform_code > 0 {
        match by_sform(header) {
            Some(placement) => return (placement.negated_xy(), WorldFrame::Lps),
            None => notes.push(Note::OrientationIgnored { what: "the sform is singular or not finite" }),
        }
    }
    let spacing = DVec3::from([0, 1, 2].map(|i| usable_spacing(f64::from(header.pixdim[i + 1]), AXES[i], notes).abs()));
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
    let rows = [header.srow_x, header.srow_y, header.srow_z].map(|row| row.map(f64::from));
    let column = |i: usize| DVec3::new(rows[0][i], rows[1][i], rows[2][i]);
    let steps = DMat3::from_cols(column(0), column(1), column(2));
    let first_sample = column(3);
    let unit =
        DMat3::from_cols_array_2d(&steps.to_cols_array_2d().map(|c| DVec3::from(c).normalize_or_zero().to_array()));
    let usable = unit.determinant().abs() > 1e-6 && first_sample.is_finite();
    usable.then_some(GridPlacement { first_sample, steps })
}

/// nifti1.h, method 2: a rotation by the quaternion (a, b, c, d), z mirrored if pixdim[0] is -1.
fn by_qform(header: &NiftiHeader, spacing: DVec3) -> Option<GridPlacement> {
    let [b, c, d] = [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from);
    let a = (1.0 - (b * b + c * c + d * d)).max(0.0).sqrt();
    let first_sample = DVec3::from([header.quatern_x, header.quatern_y, header.quatern_z].map(f64::from));
    if !(first_sample.is_finite() && DVec3::new(b, c, d).is_finite()) {
        return None;
    }
    let mirror = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
    let rotation = DMat3::from_quat(DQuat::from_xyzw(b, c, d, a).normalize());
    let steps = rotation * DMat3::from_diagonal(spacing * DVec3::new(1.0, 1.0, mirror));
    Some(GridPlacement { first_sample, steps })
}

fn unit(header: &NiftiHeader) -> Option<String> {
    let name = match header.xyzt_units & 7 {
        1 => "m",
        2 => "mm",
        3 => "um",
        _ => return None,
    };
    Some(name.to_owned())
}
