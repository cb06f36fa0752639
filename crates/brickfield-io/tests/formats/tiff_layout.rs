//! How samples lie in a TIFF file: strips, tiles, depth, planes of a sample, compression, predictors, byte orders.

use brickfield_core::glam::UVec3;
use brickfield_core::{ScalarType, Voxels};
use brickfield_io::ByteOrder::{Big, Little};
use brickfield_io::{Note, Opened, ReadError};

use crate::common::*;
use crate::tiff::read;
use crate::tiff_bytes::{PageBytes, Values, tiff, tiff_file};

fn lzw(bytes: &[u8]) -> Vec<u8> {
    weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8).encode(bytes).unwrap()
}

fn le16(values: impl IntoIterator<Item = u16>) -> Vec<u8> {
    values.into_iter().flat_map(u16::to_le_bytes).collect()
}

#[track_caller]
fn voxels(file: Vec<u8>) -> Voxels {
    let opened = read(file).unwrap();
    assert_eq!(opened.notes, []);
    opened.volume.voxels().clone()
}

fn refusal(file: Vec<u8>) -> String {
    let message = read(file).unwrap_err().to_string();
    assert!(!message.contains('\n'));
    message
}

#[test]
fn a_page_is_cut_into_lzw_tiles_that_reach_beyond_it() {
    let samples = le16(0..17 * 17);
    let page = PageBytes::grey(17, 17, 16, samples).tiled([17, 17, 1], [16, 16, 1], 2).packed(5, lzw);
    assert_eq!(voxels(tiff(&[page])), Voxels::U16((0..17 * 17).collect()));
}

#[test]
fn lzw_of_many_codes() {
    // Longer than its table of 4096 codes, and of little repetition.
    let samples: Vec<u8> = (0..40_000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let page = PageBytes::grey(200, 200, 8, samples.clone()).packed(5, lzw);
    assert_eq!(voxels(tiff(&[page])), Voxels::U8(samples));
}

#[test]
fn a_page_with_depth_is_several_slices() {
    let samples = le16(0..21 * 17 * 9);
    let deep = || PageBytes::grey(21, 17, 16, samples.clone()).with(32997, &[9]);
    let expected = Voxels::U16((0..21 * 17 * 9).collect());
    let dims = |opened: &Opened| opened.volume.grid().dims();
    let strips = PageBytes { chunks: samples.chunks(21 * 17 * 2).map(<[u8]>::to_vec).collect(), ..deep() };
    let tiles = deep().tiled([21, 17, 9], [16, 16, 16], 2);
    let flat_tiles = deep().tiled([21, 17, 9], [16, 16, 1], 2);
    for page in [strips, tiles.clone(), flat_tiles] {
        let opened = read(tiff(&[page])).unwrap();
        assert_eq!((dims(&opened), opened.volume.voxels()), (UVec3::new(21, 17, 9), &expected));
    }
    let both = read(tiff(&[tiles.clone(), tiles])).unwrap();
    assert_eq!(dims(&both), UVec3::new(21, 17, 18));
}

#[test]
fn strips_in_any_order_and_a_short_last_one() {
    let samples: Vec<u8> = (0..70).collect();
    let mut page = PageBytes::grey(7, 10, 8, vec![]).with(278, &[4]);
    page.chunks = samples.chunks(28).map(<[u8]>::to_vec).collect();
    assert_eq!(voxels(tiff(&[page.clone()])), Voxels::U8(samples.clone()));
    // Padded to its full height, as some write it.
    page.chunks[2].resize(28, 99);
    assert_eq!(voxels(tiff(&[page])), Voxels::U8(samples));
}

#[test]
fn big_files_and_both_byte_orders() {
    let big_endian: Vec<u8> = (0..12u16).flat_map(u16::to_be_bytes).collect();
    for (order, samples) in [(Little, le16(0..12)), (Big, big_endian)] {
        for magic in [42, 43] {
            let page = PageBytes::grey(4, 3, 16, samples.clone()).with_text("longer than a field");
            assert_eq!(voxels(tiff_file(&[page], order, magic)), Voxels::U16((0..12).collect()));
        }
    }
}

#[test]
fn samples_of_less_than_a_byte_and_between() {
    let page = |n_bits, samples| tiff(&[PageBytes::grey(3, 2, n_bits, samples)]);
    assert_eq!(voxels(page(1, vec![0b1010_0000, 0b0110_0000])), Voxels::U8(vec![1, 0, 1, 0, 1, 1]));
    assert_eq!(voxels(page(4, vec![0x12, 0x30, 0x45, 0x60])), Voxels::U8(vec![1, 2, 3, 4, 5, 6]));
    let twelve = vec![0xab, 0xc1, 0x23, 0x45, 0x60, 0, 0, 0, 0x10, 0];
    assert_eq!(voxels(page(12, twelve)), Voxels::U16(vec![0xabc, 0x123, 0x456, 0, 0, 0x100]));
    let reversed = PageBytes::grey(3, 1, 1, vec![0b0000_0101]).with(266, &[2]);
    assert_eq!(voxels(tiff(&[reversed])), Voxels::U8(vec![1, 0, 1]));
}

#[test]
fn wide_integers_and_half_floats_become_a_scalar_type() {
    let page = |n_bits, format, samples| tiff(&[PageBytes::grey(2, 1, n_bits, samples).with(339, &[format])]);
    let converted = |file, from, to| {
        let opened = read(file).unwrap();
        assert_eq!(opened.notes, [Note::Converted { from, to }]);
        opened.volume.voxels().clone()
    };
    let le64 = |values: [i64; 2]| values.map(i64::to_le_bytes).concat();
    assert_eq!(converted(page(64, 1, le64([7, 300])), "uint64", ScalarType::U16), Voxels::U16(vec![7, 300]));
    assert_eq!(converted(page(64, 2, le64([-7, 3])), "int64", ScalarType::I8), Voxels::I8(vec![-7, 3]));
    let halves = le16([0x3c00, 0xc100]);
    assert_eq!(converted(page(16, 3, halves), "float16", ScalarType::F32), Voxels::F32(vec![1.0, -2.5]));
    assert!(refusal(page(64, 2, le64([1 << 53 | 1, 0]))).contains("9007199254740992"));
}

#[test]
fn differences_between_neighbours_are_summed() {
    let page = PageBytes::grey(4, 2, 8, vec![1, 1, 1, 1, 10, 255, 255, 2]).with(317, &[2]).packed(5, lzw);
    assert_eq!(voxels(tiff(&[page])), Voxels::U8(vec![1, 2, 3, 4, 10, 9, 8, 10]));
    // The tag means nothing where samples are not compressed.
    let page = PageBytes::grey(4, 1, 8, vec![1, 1, 1, 1]).with(317, &[2]);
    assert_eq!(voxels(tiff(&[page])), Voxels::U8(vec![1, 1, 1, 1]));
}

#[test]
fn floats_whose_bytes_are_sorted() {
    let floats = [1.5f32, -2.0, 1e-20, 3e8];
    let big: Vec<[u8; 4]> = floats.iter().map(|f| f.to_be_bytes()).collect();
    let mut bytes: Vec<u8> = (0..4).flat_map(|weight| big.iter().map(move |f| f[weight])).collect();
    for i in (1..bytes.len()).rev() {
        bytes[i] = bytes[i].wrapping_sub(bytes[i - 1]);
    }
    for order in [Little, Big] {
        let page = PageBytes::grey(4, 1, 32, bytes.clone()).with(339, &[3]).with(317, &[3]).packed(8, zlib);
        assert_eq!(voxels(tiff_file(&[page], order, 42)), Voxels::F32(floats.to_vec()));
    }
}

#[test]
fn every_compression() {
    let samples: Vec<u8> = (0..60).map(|i| i / 7).collect();
    let page = || PageBytes::grey(10, 6, 8, samples.clone());
    let literal = |bytes: &[u8]| [&[bytes.len() as u8 - 1], bytes].concat();
    let mut files = vec![page().packed(5, lzw), page().packed(32773, literal)];
    files.extend([8, 32946].map(|code| page().packed(code, zlib)));
    #[cfg(feature = "zstd")]
    files.push(page().packed(50000, |bytes| zstd::encode_all(bytes, 3).unwrap()));
    for file in files {
        assert_eq!(voxels(tiff(&[file])), Voxels::U8(samples.clone()));
    }
    let runs = PageBytes::grey(4, 1, 8, vec![(-2i8) as u8, 7, 128, 0, 9]).with(259, &[32773]);
    assert_eq!(voxels(tiff(&[runs])), Voxels::U8(vec![7, 7, 7, 9]));
    let refused = refusal(tiff(&[page().with(259, &[34712])]));
    assert!(refused.starts_with("compression \"JPEG 2000 (code 34712)\" is not supported"), "{refused}");
}

/// A JPEG of 8 x 8 samples of 77: its tables, and what differs from strip to strip.
fn jpeg_parts() -> [Vec<u8>; 2] {
    let table = |class: u8, code_length: usize, value: u8| {
        let mut lengths = [0; 16];
        lengths[code_length - 1] = 1;
        [&[0xff, 0xc4, 0, 20, class][..], &lengths, &[value]].concat()
    };
    let quantisation = [&[0xff, 0xdb, 0, 67, 0][..], &[1; 64]].concat();
    // One code each, the single bit 0: a difference of 9 bits, and the end of the block.
    let tables = [&[0xff, 0xd8][..], &quantisation, &table(0, 1, 9), &table(0x10, 1, 0), &[0xff, 0xd9]].concat();
    // 0, then -408 = 8 * (77 - 128) in 9 bits (its complement, 001100111), then 0, filled up with ones.
    let scan = [0b0001_1001, 0b1101_1111];
    let frame = [0xff, 0xc0, 0, 11, 8, 0, 8, 0, 8, 1, 1, 0x11, 0];
    let start = [0xff, 0xda, 0, 8, 1, 1, 0, 0, 63, 0];
    [tables, [&[0xff, 0xd8][..], &frame, &start, &scan, &[0xff, 0xd9]].concat()]
}

#[test]
fn jpeg_strips_share_their_tables() {
    let [tables, jpeg] = jpeg_parts();
    let mut page = PageBytes::grey(8, 16, 8, vec![]).with(278, &[8]).with(259, &[7]);
    page.chunks = vec![jpeg.clone(), jpeg.clone()];
    page.tags.insert(347, Values::Text(tables));
    assert_eq!(voxels(tiff(&[page.clone()])), Voxels::U8(vec![77; 128]));
    let wide = refusal(tiff(&[page.clone().with(256, &[16])]));
    assert!(wide.starts_with("JPEG of page 1 of 1 is \"8 x 8, 1 samples a pixel\"; expected 16 x 8"), "{wide}");
    let deep = refusal(tiff(&[page.with(258, &[16])]));
    assert!(deep.contains("not supported"), "{deep}");
}

#[test]
fn strips_that_are_not_stored_are_noted() {
    let mut page = PageBytes::grey(2, 3, 8, vec![]).with(278, &[1]).with(259, &[8]);
    page.chunks = vec![zlib(&[1, 2]), vec![], zlib(&[3, 4])];
    let opened = read(tiff(&[page])).unwrap();
    assert_eq!(opened.volume.voxels(), &Voxels::U8(vec![1, 2, 0, 0, 3, 4]));
    assert_eq!(opened.notes, [Note::MissingChunks { n_missing: 1, n_chunks: 3 }]);
}

#[test]
fn values_are_as_stored_where_the_file_wants_low_ones_bright() {
    let opened = read(tiff(&[PageBytes::grey(3, 1, 8, vec![0, 1, 121]).with(262, &[0])])).unwrap();
    assert_eq!(opened.volume.voxels(), &Voxels::U8(vec![0, 1, 121]));
    assert_eq!(
        opened.notes[0].to_string(),
        "the file wants its values shown with low ones bright (MINISWHITE); they are as stored"
    );
}

#[test]
fn damage_is_told_by_how_much_came_out() {
    let samples: Vec<u8> = (0..60).collect();
    let page = |code, pack: fn(&[u8]) -> Vec<u8>| PageBytes::grey(10, 6, 8, samples.clone()).packed(code, pack);
    let cut = |code, pack, n: usize| {
        let mut page: PageBytes = page(code, pack);
        page.chunks[0].truncate(n);
        refusal(tiff(&[page]))
    };
    let literal = |bytes: &[u8]| [&[bytes.len() as u8 - 1], bytes].concat();
    let said = "page 1 of 1 holds 30 bytes, then its compressed data are cut off; 60 are promised";
    assert_eq!(cut(32773, literal, 31), said);
    let said = cut(5, lzw, 40);
    assert!(said.contains("then its compressed data are cut off; 60 are promised"), "{said}");
    let said = cut(8, zlib_unpressed, 2 + 5 + 30);
    assert!(said.ends_with("its compressed data are cut off; 60 are promised"), "{said}");
    let mut corrupt: PageBytes = page(8, zlib);
    corrupt.chunks[0][2..8].fill(0xff);
    assert!(refusal(tiff(&[corrupt])).contains("its compressed data are corrupt"));
}

#[test]
fn numbers_that_lie_cost_nothing() {
    let page = || PageBytes::grey(4, 3, 8, (0..12).collect());
    let no_strips = PageBytes { chunks: vec![], ..page() };
    assert_eq!(refusal(tiff(&[no_strips])), "number of strips of page 1 of 1 is \"0\"; expected 1 or more");
    let mut huge_tile = page().with(322, &[65535]).with(323, &[65535]);
    huge_tile.tags.remove(&278);
    assert!(matches!(read(tiff(&[huge_tile])), Err(ReadError::TooLarge { .. })));
    let deep = page().with(32997, &[9]);
    assert!(refusal(tiff(&[deep])).contains("number of strips of page 1 of 1 is \"1\"; expected 9"));
    let short = refusal(tiff(&[page().with(256, &[5])]));
    assert_eq!(short, "page 1 of 1 holds 12 bytes; 15 are promised");
    assert!(refusal(tiff(&[page().with(256, &[0])])).contains("width of page 1 of 1 is \"0\""));
    assert!(refusal(tiff(&[page().with(258, &[24])])).contains("unsigned integers of 24 bits"));
    assert!(refusal(tiff(&[page().with(339, &[6])])).contains("complex or unknown numbers"));
    let mut circle = tiff(&[page(), page()]);
    let first = u32::from_le_bytes(circle[4..8].try_into().unwrap());
    let end = circle.len() - 4;
    circle[end..].copy_from_slice(&first.to_le_bytes());
    assert!(refusal(circle).starts_with("position of the tags of page 3 is"));
}

#[test]
fn a_file_cut_or_changed_anywhere_is_refused_or_read() {
    let page = PageBytes::grey(17, 17, 16, le16(0..17 * 17)).tiled([17, 17, 1], [16, 16, 1], 2).packed(5, lzw);
    let file = tiff(&[page]);
    for n in 0..file.len() {
        let _ = read(file[..n].to_vec()).map_err(|e| assert!(!e.to_string().contains('\n')));
        let mut changed = file.clone();
        changed[n] ^= 0xff;
        let _ = read(changed).map_err(|e| assert!(!e.to_string().contains('\n')));
    }
    assert_eq!(read(file).unwrap().volume.scalar_type(), ScalarType::U16);
}

/// Files for fuzzing: tiles with depth, JPEG, sorted bytes of floats, colours in planes of their own, a palette.
pub(crate) fn examples() -> Vec<Vec<u8>> {
    let samples = le16(0..21 * 17 * 3);
    let deep = PageBytes::grey(21, 17, 16, samples).with(32997, &[3]).tiled([21, 17, 3], [16, 16, 4], 2).packed(5, lzw);
    let [tables, jpeg] = jpeg_parts();
    let mut packed = PageBytes { chunks: vec![jpeg], ..PageBytes::grey(8, 8, 8, vec![]).with(259, &[7]) };
    packed.tags.insert(347, Values::Text(tables));
    let floats = PageBytes::grey(4, 1, 32, vec![1; 16]).with(339, &[3]).with(317, &[3]).packed(8, zlib);
    let planar = PageBytes { chunks: vec![vec![1; 12]; 3], ..PageBytes::colours(2, 3, 4, 3, vec![]).with(284, &[2]) };
    let palette: Vec<u16> = (0..768).collect();
    let numbered = PageBytes::grey(4, 3, 8, (0..12).collect()).with(262, &[3]).with(320, &palette);
    let bits = PageBytes::grey(3, 2, 12, vec![0x12; 10]).packed(32773, |bytes| [&[9], bytes].concat());
    [deep, packed, floats, planar, numbered, bits].map(|page| tiff(&[page])).to_vec()
}
