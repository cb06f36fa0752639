//! The header of a NIfTI file: version 1 of 348 bytes, version 2 of 540 bytes, either byte order.

use crate::error::{Shown, check_length};
use crate::files::ByteSource;
use crate::limits::n_samples;
use crate::stored::Encoding;
use crate::wrapped::{HeaderNumbers, encoding_of, read_header, read_start};
use crate::{ByteOrder, Format, ReadError};

/// The fields of either version that a volume needs.
pub(super) struct NiftiHeader {
    pub(super) order: ByteOrder,
    /// The samples are in another file.
    pub(super) is_of_pair: bool,
    n_bytes: u64,
    /// x, y, z, t, u, v, w; those that are not there are 1.
    pub(super) sizes: [u64; 7],
    pub(super) n_samples: u128,
    pub(super) datatype: i16,
    pub(super) pixdim: [f64; 8],
    offset: f64,
    pub(super) slope: f64,
    pub(super) intercept: f64,
    pub(super) qform_code: i32,
    pub(super) sform_code: i32,
    /// b, c, d, and the offsets of x, y, z.
    pub(super) quaternion: [f64; 6],
    pub(super) rows: [[f64; 4]; 3],
    pub(super) units: i32,
}

/// nifti1.h: the units of length, from code 1 on.
pub(super) const UNITS: [&str; 3] = ["m", "mm", "um"];

const N_BYTES_1: usize = 348;
const N_BYTES_2: usize = 540;

#[derive(Clone, Copy)]
enum Version {
    One,
    Two,
}

impl NiftiHeader {
    /// The header at the start of the source, gzipped or not; the source stays where it is.
    pub(super) fn read(source: &mut dyn ByteSource) -> Result<NiftiHeader, ReadError> {
        let encoding = encoding_of(source)?;
        let (version, order) = version_of(source, encoding)?;
        match version {
            Version::One => {
                let bytes = read_header::<N_BYTES_1>(source, encoding)?;
                let is_of_pair = is_of_pair(&bytes[344..], b"n+1\0", b"ni1\0", "n+1 or ni1")?;
                NiftiHeader::version_1(&HeaderNumbers { bytes: &bytes, order }, is_of_pair)
            }
            Version::Two => {
                let bytes = read_header::<N_BYTES_2>(source, encoding)?;
                let is_of_pair = is_of_pair(&bytes[4..12], b"n+2\0\r\n\x1a\n", b"ni2\0\r\n\x1a\n", "n+2 or ni2")?;
                NiftiHeader::version_2(&HeaderNumbers { bytes: &bytes, order }, is_of_pair)
            }
        }
    }

    /// nifti1.h.
    fn version_1(numbers: &HeaderNumbers, is_of_pair: bool) -> Result<NiftiHeader, ReadError> {
        let [offset, slope, intercept] = numbers.f32s_wide(108);
        let [qform_code, sform_code] = numbers.i16s(252).map(i32::from);
        let (sizes, n_samples) = sizes(numbers.i16s::<8>(40).map(i64::from), i64::from(i16::MAX))?;
        Ok(NiftiHeader {
            order: numbers.order,
            is_of_pair,
            n_bytes: N_BYTES_1 as u64,
            sizes,
            n_samples,
            datatype: numbers.i16s::<1>(70)[0],
            pixdim: numbers.f32s_wide(76),
            offset,
            slope,
            intercept,
            qform_code,
            sform_code,
            quaternion: numbers.f32s_wide(256),
            rows: [280, 296, 312].map(|at| numbers.f32s_wide(at)),
            units: i32::from(numbers.bytes[123]),
        })
    }

    /// nifti2.h.
    fn version_2(numbers: &HeaderNumbers, is_of_pair: bool) -> Result<NiftiHeader, ReadError> {
        let [slope, intercept] = numbers.f64s(176);
        let [qform_code, sform_code] = numbers.i32s(344);
        let (sizes, n_samples) = sizes(numbers.i64s(16), i64::MAX)?;
        Ok(NiftiHeader {
            order: numbers.order,
            is_of_pair,
            n_bytes: N_BYTES_2 as u64,
            sizes,
            n_samples,
            datatype: numbers.i16s::<1>(12)[0],
            pixdim: numbers.f64s(104),
            offset: numbers.i64s::<1>(168)[0] as f64,
            slope,
            intercept,
            qform_code,
            sform_code,
            quaternion: numbers.f64s(352),
            rows: [400, 432, 464].map(|at| numbers.f64s(at)),
            units: numbers.i32s::<1>(500)[0],
        })
    }

    /// Where the samples begin in their file. In one that has the header too, some writers leave it 0.
    pub(super) fn data_offset(&self) -> Result<u64, ReadError> {
        let offset = match self.offset.is_finite() && (0.0..=1e15).contains(&self.offset) {
            true => self.offset as u64,
            false => return Err(ReadError::field("vox_offset", self.offset, "0 to 1e15")),
        };
        match offset {
            _ if self.is_of_pair => Ok(offset),
            // Four bytes say whether there are extensions.
            0 => Ok(self.n_bytes + 4),
            offset if offset >= self.n_bytes => Ok(offset),
            offset => Err(ReadError::field("vox_offset", offset, format!("0 or at least {}", self.n_bytes))),
        }
    }
}

/// The header's length says which version it is, and in which order its bytes are.
fn version_of(source: &mut dyn ByteSource, encoding: Encoding) -> Result<(Version, ByteOrder), ReadError> {
    let mut start = [0; N_BYTES_1];
    let n = read_start(source, encoding, &mut start)?;
    let size = start.first_chunk::<4>().copied().unwrap_or_default();
    for (version, n_bytes) in [(Version::One, N_BYTES_1), (Version::Two, N_BYTES_2)] {
        let orders =
            [(ByteOrder::Little, (n_bytes as u32).to_le_bytes()), (ByteOrder::Big, (n_bytes as u32).to_be_bytes())];
        if let Some((order, _)) = orders.into_iter().find(|(_, bytes)| *bytes == size && n >= 4) {
            return Ok((version, order));
        }
        if n < 4 && orders.iter().any(|(_, bytes)| bytes.starts_with(&start[..n])) {
            check_length("the header", n as u64, n_bytes as u128)?;
        }
    }
    Err(ReadError::wrong_start(Format::Nifti, &start[..n], "348 or 540, the length of its header"))
}

fn is_of_pair(magic: &[u8], single: &[u8], pair: &[u8], expected: &'static str) -> Result<bool, ReadError> {
    match magic {
        magic if magic == single => Ok(false),
        magic if magic == pair => Ok(true),
        _ => {
            let found = Shown::of_bytes(magic);
            Err(ReadError::WrongMagic { format: Format::Nifti, what: "magic", found, expected })
        }
    }
}

/// Sizes of all axes, and how many samples there are.
fn sizes([n_axes, dim @ ..]: [i64; 8], max: i64) -> Result<([u64; 7], u128), ReadError> {
    if !(1..=7).contains(&n_axes) {
        return Err(ReadError::field("dim[0]", n_axes, "1 to 7"));
    }
    let mut sizes = [1u64; 7];
    for (i, (size, stated)) in sizes.iter_mut().zip(dim).enumerate().take(n_axes as usize) {
        *size = u64::try_from(stated)
            .ok()
            .filter(|_| (1..=max).contains(&stated))
            .ok_or_else(|| ReadError::field(format!("dim[{}]", i + 1), stated, format!("1 to {max}")))?;
    }
    Ok((sizes, n_samples("dim", &sizes)?))
}
