//! Stored types that are no scalar type, in the formats that have them.

use std::io::Cursor;

use brickfield_core::{ScalarType, Voxels};
use brickfield_io::{ByteOrder, Limits, NoFiles, Note, Opened, ReadError, metaimage, nrrd};

use crate::common::*;

/// 24 integers of 64 bits, those of [`DIMS`].
pub(crate) fn wide(first: i64, step: i64) -> Vec<i64> {
    (0..24).map(|i| first + step * i).collect()
}

pub(crate) fn wide_bytes(values: &[i64], order: ByteOrder) -> Vec<u8> {
    let bytes = |v: &i64| if order == ByteOrder::Big { v.to_be_bytes() } else { v.to_le_bytes() };
    values.iter().flat_map(bytes).collect()
}

fn wide_text(values: &[i64]) -> Vec<u8> {
    values.iter().map(i64::to_string).collect::<Vec<_>>().join("\n").into_bytes()
}

fn nrrd(stored: &str, more: &str, data: &[u8]) -> Result<Opened, ReadError> {
    let header = format!("NRRD0005\ntype: {stored}\ndimension: 3\nsizes: 4 3 2\n{more}\n\n");
    nrrd::read(Cursor::new([header.as_bytes(), data].concat()), &NoFiles, &options())
}

fn meta(stored: &str, more: &str, data: &[u8]) -> Result<Opened, ReadError> {
    let header = format!("NDims = 3\nDimSize = 4 3 2\nElementType = {stored}\n{more}\nElementDataFile = LOCAL\n");
    metaimage::read(Cursor::new([header.as_bytes(), data].concat()), &NoFiles, &options())
}

#[track_caller]
pub(crate) fn assert_wide(opened: &Opened, from: &'static str, expected: &Voxels) {
    assert_eq!(opened.volume.voxels(), expected);
    assert_eq!(opened.notes, [Note::Converted { from, to: expected.scalar_type() }]);
}

#[test]
fn integers_of_64_bits_in_every_order_and_encoding() {
    let values = wide(-5, 1000);
    let expected = Voxels::from(values.iter().map(|v| *v as i16).collect::<Vec<_>>());
    for order in ORDERS {
        let data = wide_bytes(&values, order);
        let (endian, msb) = if order == ByteOrder::Big { ("big", "True") } else { ("little", "False") };
        let more = |encoding| format!("endian: {endian}\nencoding: {encoding}");
        assert_wide(&nrrd("int64", &more("raw"), &data).unwrap(), "int64", &expected);
        assert_wide(&nrrd("long long", &more("ascii"), &wide_text(&values)).unwrap(), "int64", &expected);
        let more = format!("BinaryDataByteOrderMSB = {msb}");
        assert_wide(&meta("MET_LONG_LONG", &more, &data).unwrap(), "int64", &expected);
        #[cfg(feature = "gzip")]
        {
            let more = format!("endian: {endian}\nencoding: gzip");
            assert_wide(&nrrd("int64_t", &more, &gzip(&data)).unwrap(), "int64", &expected);
            let more = format!("BinaryDataByteOrderMSB = {msb}\nCompressedData = True");
            assert_wide(&meta("MET_LONG_LONG", &more, &zlib(&data)).unwrap(), "int64", &expected);
        }
    }
    let unsigned = Voxels::from(wide(7, 1 << 40).iter().map(|v| *v as f64).collect::<Vec<_>>());
    let data = wide_bytes(&wide(7, 1 << 40), ByteOrder::Little);
    assert_wide(&nrrd("uint64", "endian: little\nencoding: raw", &data).unwrap(), "uint64", &unsigned);
    assert_wide(&meta("MET_ULONG_LONG", "", &data).unwrap(), "uint64", &unsigned);
}

#[test]
fn integers_that_f64_does_not_hold_are_refused() {
    let mut values = wide(0, 1);
    values[17] = (1 << 53) + 1;
    let data = wide_bytes(&values, ByteOrder::Little);
    let more = "endian: little\nencoding: raw";
    let expected =
        "is \"9007199254740993\"; expected -9007199254740992 to 9007199254740992, all of which f64 holds exactly";
    let said = nrrd("int64", more, &data).unwrap_err().to_string();
    assert_eq!(said, format!("sample 17 of the data after the header {expected}"));
    let said = nrrd("int64", "encoding: ascii", &wide_text(&values)).unwrap_err().to_string();
    assert!(said.starts_with("sample 17 is \"9007199254740993\"; expected a number that fits int64"), "{said}");
    values[17] = -1;
    let data = wide_bytes(&values, ByteOrder::Little);
    let said = nrrd("uint64", more, &data).unwrap_err().to_string();
    assert!(said.contains("is \"18446744073709551615\"; expected"), "{said}");
}

#[test]
fn limits_hold_for_the_file_and_for_the_voxels() {
    let header = "NRRD0005\ntype: int64\ndimension: 1\nsizes: 24\nendian: little\nencoding: raw\n\n".as_bytes();
    let file = [header, &wide_bytes(&wide(0, 1), ByteOrder::Little)].concat();
    let read = |max_bytes| nrrd::read(Cursor::new(&file), &NoFiles, &Limits { max_bytes }.into());
    assert_eq!(read(192).unwrap().volume.scalar_type(), ScalarType::U8);
    let said = read(191).unwrap_err().to_string();
    assert_eq!(said, "a volume of 24 x 1 x 1 voxels of int64 would take 192 bytes; the limit is 191 bytes");
}
