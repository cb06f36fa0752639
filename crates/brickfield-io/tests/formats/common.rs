//! Voxels, bytes and comparisons that all formats share.

use std::collections::BTreeMap;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Scalar, ScalarType, Voxels, with_voxels};
use brickfield_io::{ByteOrder, ChoiceKind, Limits, OpenOptions, Opened};

pub(crate) const DIMS: UVec3 = UVec3::new(4, 3, 2);
pub(crate) const ORDERS: [ByteOrder; 2] = [ByteOrder::Little, ByteOrder::Big];

/// Enough for every fixture, and little enough that a mistake shows.
pub(crate) fn options() -> OpenOptions {
    Limits { max_bytes: 1 << 20 }.into()
}

/// The same, with an entry wanted.
pub(crate) fn selecting(kind: ChoiceKind, wanted: Option<&str>) -> OpenOptions {
    let mut options = options();
    wanted.into_iter().for_each(|entry| options.wanted.want(kind, entry));
    options
}

/// A different value in every voxel of [`DIMS`], negative ones where the type has them.
pub(crate) fn ramp(scalar: ScalarType) -> Voxels {
    fn values<T: Scalar>(first: f64, step: f64) -> Voxels {
        T::wrap((0..24).map(|i| T::from_f64(first + step * f64::from(i))).collect())
    }
    match scalar {
        ScalarType::U8 => values::<u8>(3.0, 10.0),
        ScalarType::I8 => values::<i8>(-120.0, 10.0),
        ScalarType::U16 => values::<u16>(3.0, 2800.0),
        ScalarType::I16 => values::<i16>(-32000.0, 2700.0),
        ScalarType::U32 => values::<u32>(3.0, 178_000_000.0),
        ScalarType::I32 => values::<i32>(-2_000_000_000.0, 170_000_000.0),
        ScalarType::F32 => values::<f32>(-1.5, 0.375),
        ScalarType::F64 => values::<f64>(-1e300, 7.77e298),
    }
}

pub(crate) fn bytes(voxels: &Voxels, order: ByteOrder) -> Vec<u8> {
    macro_rules! all {
        ($values:expr) => {
            $values
                .iter()
                .flat_map(|v| match order {
                    ByteOrder::Little => v.to_le_bytes().to_vec(),
                    ByteOrder::Big => v.to_be_bytes().to_vec(),
                })
                .collect()
        };
    }
    with_voxels!(voxels, v => all!(v))
}

pub(crate) fn text(voxels: &Voxels) -> String {
    with_voxels!(voxels, v => v.iter().map(|x| x.to_string()).collect::<Vec<_>>().join(" "))
}

#[cfg(feature = "gzip")]
pub(crate) fn gzip(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gz.write_all(bytes).unwrap();
    gz.finish().unwrap()
}

/// A gzip of one stored block: 10 bytes of header, 5 of the block's, the bytes as they are, 8 of checksum and length.
#[cfg(feature = "gzip")]
pub(crate) fn gzip_unpressed(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::none());
    gz.write_all(bytes).unwrap();
    gz.finish().unwrap()
}

/// A zlib stream of one stored block: 2 bytes of header, 5 of the block's, the bytes as they are, 4 of checksum.
#[cfg(feature = "gzip")]
pub(crate) fn zlib_unpressed(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut z = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::none());
    z.write_all(bytes).unwrap();
    z.finish().unwrap()
}

#[cfg(feature = "gzip")]
pub(crate) fn zlib(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut z = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    z.write_all(bytes).unwrap();
    z.finish().unwrap()
}

pub(crate) fn files<const N: usize>(files: [(&str, Vec<u8>); N]) -> BTreeMap<String, Vec<u8>> {
    files.into_iter().map(|(name, bytes)| (name.to_owned(), bytes)).collect()
}

/// World position of the centre of voxel (x, y, z).
pub(crate) fn centre(opened: &Opened, x: f64, y: f64, z: f64) -> DVec3 {
    opened.volume.grid().index_to_world().transform_point3(DVec3::new(x, y, z) + 0.5)
}

#[track_caller]
pub(crate) fn assert_near(found: DVec3, expected: [f64; 3]) {
    assert!((found - DVec3::from(expected)).abs().max_element() < 1e-6, "{found} is not {expected:?}");
}

#[track_caller]
pub(crate) fn assert_ramp(opened: &Opened, scalar: ScalarType) {
    assert_eq!(opened.volume.grid().dims(), DIMS);
    assert_eq!(opened.volume.voxels(), &ramp(scalar));
}
