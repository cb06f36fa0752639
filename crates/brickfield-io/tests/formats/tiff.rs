use std::io::Cursor;

use ::tiff::encoder::colortype::{self, ColorType};
use ::tiff::encoder::{Compression, TiffEncoder, TiffValue};
use ::tiff::tags::Tag;
use brickfield_core::glam::DVec3;
use brickfield_core::{ScalarType, Voxels};
use brickfield_io::{ChoiceKind, Limits, NoFiles, Note, Opened, ReadError, tiff};

use crate::common::*;

/// Pages of 4 x 3 samples, with a description on the first one.
fn stack<C: ColorType>(values: &[C::Inner], compression: Compression, description: &str) -> Vec<u8>
where
    [C::Inner]: TiffValue,
{
    let mut out = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut out).unwrap().with_compression(compression);
    for (i, page) in values.chunks(12).enumerate() {
        let mut image = encoder.new_image::<C>(4, 3).unwrap();
        if i == 0 && !description.is_empty() {
            image.encoder().write_tag(Tag::ImageDescription, description).unwrap();
            let quarter = ::tiff::encoder::Rational { n: 4, d: 1 };
            image.x_resolution(quarter);
            image.y_resolution(::tiff::encoder::Rational { n: 2, d: 1 });
        }
        image.write_data(page).unwrap();
    }
    out.into_inner()
}

pub(crate) fn read(file: Vec<u8>) -> Result<Opened, ReadError> {
    tiff::read(Cursor::new(file), &NoFiles, &options())
}

#[test]
fn every_type_plain_and_packed() {
    for compression in [Compression::Uncompressed, Compression::Lzw, Compression::Packbits] {
        for scalar in ScalarType::ALL {
            let file = match ramp(scalar) {
                Voxels::U8(v) => stack::<colortype::Gray8>(&v, compression, ""),
                Voxels::I8(v) => stack::<colortype::GrayI8>(&v, compression, ""),
                Voxels::U16(v) => stack::<colortype::Gray16>(&v, compression, ""),
                Voxels::I16(v) => stack::<colortype::GrayI16>(&v, compression, ""),
                Voxels::U32(v) => stack::<colortype::Gray32>(&v, compression, ""),
                Voxels::I32(v) => stack::<colortype::GrayI32>(&v, compression, ""),
                Voxels::F32(v) => stack::<colortype::Gray32Float>(&v, compression, ""),
                Voxels::F64(v) => stack::<colortype::Gray64Float>(&v, compression, ""),
            };
            let opened = read(file).unwrap();
            assert_ramp(&opened, scalar);
            assert_eq!((opened.volume.grid().spacing(), opened.unit), (DVec3::ONE, None));
        }
    }
}

#[test]
fn imagej_spacing_and_channels() {
    let values: Vec<u8> = (0..72).collect();
    let description = "ImageJ=1.53\nimages=6\nchannels=3\nslices=2\nspacing=1.5\nunit=micron\n";
    let opened = read(stack::<colortype::Gray8>(&values, Compression::Uncompressed, description)).unwrap();
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(0.25, 0.5, 1.5));
    assert_eq!(opened.unit.as_deref(), Some("micron"));
    let expected: Vec<u8> = (0..12).chain(36..48).collect();
    assert_eq!(opened.volume.voxels(), &Voxels::U8(expected));
    let note = Note::OneOfSeveral { kind: ChoiceKind::Channel, read: "0".to_owned(), n_entries: 3 };
    assert_eq!(opened.notes, [note]);
}

/// One big-endian page of 2 x 1 samples of 16 bits, by hand: the encoder only writes the machine's order.
fn big_endian(samples: [u8; 4]) -> Vec<u8> {
    let mut out = b"MM\0\x2a\0\0\0\x0c".to_vec();
    out.extend(samples);
    let tags: [(u16, u16); 8] = [(256, 2), (257, 1), (258, 16), (259, 1), (262, 1), (273, 8), (277, 1), (279, 4)];
    out.extend(directory(&tags, 0));
    out
}

/// A big-endian directory of tags with one 16-bit value each; `next` is where the following one lies, 0 if there is none.
pub(crate) fn directory(tags: &[(u16, u16)], next: u32) -> Vec<u8> {
    let mut out = (tags.len() as u16).to_be_bytes().to_vec();
    for (tag, value) in tags {
        out.extend(tag.to_be_bytes());
        out.extend([0, 3, 0, 0, 0, 1]);
        out.extend(value.to_be_bytes());
        out.extend([0, 0]);
    }
    out.extend(next.to_be_bytes());
    out
}

/// Fixtures in both byte orders.
pub(crate) fn examples() -> Vec<Vec<u8>> {
    let description = "ImageJ=1.53\nimages=2\nslices=2\nspacing=1.5\nunit=micron\n";
    let mut files = vec![
        stack::<colortype::Gray16>(&[7; 24], Compression::Lzw, description),
        stack::<colortype::Gray32Float>(&[0.5; 24], Compression::Deflate(Default::default()), ""),
        big_endian([1, 2, 3, 4]),
        crate::tiff_imagej::example(),
    ];
    files.extend(crate::tiff_layout::examples());
    files
}

#[test]
fn big_endian_pages() {
    assert_eq!(read(big_endian([1, 2, 3, 4])).unwrap().volume.voxels(), &Voxels::U16(vec![0x102, 0x304]));
}

#[test]
fn pages_that_lie() {
    let refusal = |file| read(file).unwrap_err().to_string();
    let mut huge = big_endian([0; 4]);
    huge[22..24].copy_from_slice(&[255, 255]);
    huge[34..36].copy_from_slice(&[255, 255]);
    assert!(refusal(huge.clone()).contains("a page of 65535 x 65535 samples of u16 would take"));
    // Found by fuzzing: the decoder made room for 256 MiB of values before it looked for them.
    let mut long_tag = big_endian([0; 4]);
    long_tag[42..46].copy_from_slice(&[0, 0x80, 0, 0]);
    assert!(
        refusal(long_tag).contains("number of a tag's values is \"8388608\"; expected at most 114, the file's bytes")
    );
    let roomy = Limits { max_bytes: 1 << 40 }.into();
    assert!(matches!(tiff::read(Cursor::new(huge), &NoFiles, &roomy), Err(ReadError::TooFewCompressed { .. })));
    let description = "ImageJ=1.53\nimages=99\nslices=99\n";
    let short = stack::<colortype::Gray8>(&[0; 24], Compression::Uncompressed, description);
    assert!(refusal(short).contains("number of pages is \"2\"; expected 99"));
    let whole = stack::<colortype::Gray16>(&[7; 24], Compression::Lzw, "");
    for n in 0..whole.len() {
        if let Err(fault) = read(whole[..n].to_vec()) {
            assert!(!fault.to_string().contains('\n'));
        }
    }
}
