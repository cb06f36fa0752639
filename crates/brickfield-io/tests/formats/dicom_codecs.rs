//! Packed pixel data, from fixtures that independent software wrote; and colours.

use brickfield_core::ScalarType;
use brickfield_io::{ChoiceKind, Note};

use crate::dicom_file::{EXPLICIT, Elements, GREY_16, Shape, read_all, read_one, values};

const JPEG_LS_SYNTAX: &str = "1.2.840.10008.1.2.4.80";
const JPEG_2000_SYNTAX: &str = "1.2.840.10008.1.2.4.90";
const JPEG_LOSSLESS_SYNTAX: &str = "1.2.840.10008.1.2.4.70";

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len() / 2).map(|i| u8::from_str_radix(&hex[2 * i..2 * i + 2], 16).unwrap()).collect()
}

fn packed(shape: Shape, syntax: &str, fragments: &[&[u8]]) -> Vec<u8> {
    Elements::default().series("1.2.3").placed([0.0; 3]).shape(shape, 1).fragments(&[], fragments).file(syntax)
}

const GREY_8: Shape = Shape { n_bits: 8, ..GREY_16 };
const OF_18_BY_12: Shape = Shape { columns: 18, rows: 12, ..GREY_16 };

fn grid(columns: usize, rows: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..rows).flat_map(move |y| (0..columns).map(move |x| (x, y)))
}

fn ramp_16() -> Vec<f64> {
    let value = |(x, y): (usize, usize)| match (2..4).contains(&y) && (2..9).contains(&x) {
        true => 777.0,
        false => ((x * x * 300 + y * 4000) % 65536) as f64,
    };
    grid(18, 12).map(value).collect()
}

fn ramp_8() -> Vec<f64> {
    grid(18, 12).map(|(x, y)| if y >= 8 { 7.0 } else { ((x * 20 + y * 9) % 256) as f64 }).collect()
}

fn rgb() -> [Vec<f64>; 3] {
    let red = ramp_8();
    let green = red.chunks(18).rev().flatten().copied().collect();
    let blue = red.iter().map(|v| 255.0 - v).collect();
    [red, green, blue]
}

#[test]
fn jpeg_ls_lossless_is_exact() {
    let shape = Shape { columns: 4, rows: 4, ..GREY_8 };
    let opened = read_one(packed(shape, JPEG_LS_SYNTAX, &[&bytes(EXAMPLE_H3)])).unwrap();
    let expected = [0, 0, 90, 74, 68, 50, 43, 205, 64, 145, 145, 145, 100, 145, 145, 145].map(f64::from);
    assert_eq!((values(&opened), opened.volume.scalar_type()), (expected.to_vec(), ScalarType::U8));
    let opened = read_one(packed(OF_18_BY_12, JPEG_LS_SYNTAX, &[&bytes(JPEG_LS_16)])).unwrap();
    assert_eq!((values(&opened), opened.volume.scalar_type()), (ramp_16(), ScalarType::U16));
}

#[test]
fn jpeg_ls_near_lossless_keeps_its_bound() {
    let shape = Shape { n_bits: 8, ..OF_18_BY_12 };
    let found = values(&read_one(packed(shape, "1.2.840.10008.1.2.4.81", &[&bytes(JPEG_LS_NEAR)])).unwrap());
    let greatest = found.iter().zip(ramp_8()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!((1.0..=2.0).contains(&greatest), "{greatest}");
}

#[test]
fn jpeg_ls_in_colour_has_three_orders() {
    let shape = Shape { n_bits: 8, n_samples: 3, photometric: "RGB", ..OF_18_BY_12 };
    for hex in [JPEG_LS_PLANES, JPEG_LS_LINES, JPEG_LS_SAMPLES] {
        let file = packed(shape, JPEG_LS_SYNTAX, &[&bytes(hex)]);
        for (channel, expected) in ["red", "green", "blue"].iter().zip(rgb()) {
            let opened = read_all(vec![file.clone()], &[(ChoiceKind::Channel, channel)]).unwrap();
            assert_eq!(values(&opened), expected, "{channel}");
        }
    }
}

#[test]
fn jpeg_2000_keeps_signs() {
    let shape = Shape { columns: 32, rows: 32, signed: 1, ..GREY_16 };
    let opened = read_one(packed(shape, JPEG_2000_SYNTAX, &[&bytes(JPEG_2000)])).unwrap();
    let expected: Vec<f64> = grid(32, 32).map(|(x, y)| 40.0 * x as f64 - 30.0 * y as f64 - 200.0).collect();
    assert_eq!((values(&opened), opened.volume.scalar_type()), (expected, ScalarType::I16));
}

#[test]
fn jpeg_lossless_is_exact() {
    let shape = Shape { columns: 9, rows: 6, ..GREY_16 };
    let opened = read_one(packed(shape, JPEG_LOSSLESS_SYNTAX, &[&bytes(JPEG_LOSSLESS)])).unwrap();
    let expected: Vec<f64> = grid(9, 6).map(|(x, y)| (70 * x + 11 * y + 5) as f64).collect();
    assert_eq!(values(&opened), expected);
}

#[test]
fn a_frame_may_have_several_fragments() {
    let example = bytes(EXAMPLE_H3);
    let (head, tail) = example.split_at(20);
    let shape = Shape { columns: 4, rows: 4, ..GREY_8 };
    let n_frame_bytes = (example.len() + 16).next_multiple_of(2) as u32;
    // By the offset table, and by where codestreams begin if there is none or a wrong one.
    for offsets in [&[0, n_frame_bytes][..], &[], &[0, 7]] {
        let elements = Elements::default().series("1.2.3").shape(shape, 2);
        let file = elements.fragments(offsets, &[head, tail, head, tail]).file(JPEG_LS_SYNTAX);
        let opened = read_one(file).unwrap();
        assert_eq!(opened.volume.grid().dims().z, 2);
        assert_eq!(values(&opened)[..16], values(&opened)[16..]);
    }
    let elements = Elements::default().series("1.2.3").shape(shape, 3);
    let fault = read_one(elements.fragments(&[], &[head, tail, head, tail]).file(JPEG_LS_SYNTAX)).unwrap_err();
    assert_eq!(fault.to_string(), "fragments is \"4\"; expected one for each of 3 frames, or an offset table");
}

#[test]
fn a_codec_that_states_another_size_is_refused_before_it_allocates() {
    let shape = Shape { columns: 5, rows: 4, ..GREY_8 };
    let cases = [(JPEG_LS_SYNTAX, EXAMPLE_H3), (JPEG_2000_SYNTAX, JPEG_2000), (JPEG_LOSSLESS_SYNTAX, JPEG_LOSSLESS)];
    for (syntax, hex) in cases {
        let fault = read_one(packed(shape, syntax, &[&bytes(hex)])).unwrap_err().to_string();
        assert!(fault.contains("expected 5 x 4 x 1, as the data set has it"), "{fault}");
    }
}

#[test]
fn packed_frames_cut_anywhere_are_refused_or_read() {
    let cases = [
        (OF_18_BY_12, JPEG_LS_SYNTAX, JPEG_LS_16),
        (Shape { columns: 32, rows: 32, signed: 1, ..GREY_16 }, JPEG_2000_SYNTAX, JPEG_2000),
        (Shape { columns: 9, rows: 6, ..GREY_16 }, JPEG_LOSSLESS_SYNTAX, JPEG_LOSSLESS),
    ];
    for (shape, syntax, hex) in cases {
        let whole = bytes(hex);
        for n in 0..whole.len() {
            if let Err(fault) = read_one(packed(shape, syntax, &[&whole[..n]])) {
                assert!(!fault.to_string().contains('\n'), "{fault}");
            }
            let mut flipped = whole.clone();
            flipped[n] ^= 0x55;
            let _ = read_one(packed(shape, syntax, &[&flipped]));
        }
    }
    // JPEG-LS has no slack: what is cut off is missed.
    let whole = bytes(JPEG_LS_16);
    let fault = read_one(packed(OF_18_BY_12, JPEG_LS_SYNTAX, &[&whole[..whole.len() / 2]])).unwrap_err().to_string();
    assert!(fault.contains("a JPEG-LS frame is \"cut off or corrupt in its scan\""), "{fault}");
}

fn coloured(photometric: &'static str, n_samples: u16, planes: u16, pixels: &[u8]) -> Elements {
    let shape = Shape { n_bits: 8, n_samples, photometric, ..GREY_16 };
    let mut elements = Elements::default().series("1.2.3").thick().placed([0.0; 3]).shape(shape, 1);
    let at = elements.bytes.windows(6).position(|w| w == b"\x28\0\x06\0US").unwrap() + 8;
    elements.bytes[at] = planes as u8;
    elements.bytes((0x7fe0, 0x10), b"OB", pixels)
}

#[test]
fn colours_are_read_as_luminance_or_one_channel() {
    // 2.126 + 14.304 + 2.166 = 18.596; grey stays itself.
    for (planes, pixels) in [(0, [10, 20, 30, 7, 7, 7]), (1, [10, 7, 20, 7, 30, 7])] {
        let file = coloured("RGB", 3, planes, &pixels).file(EXPLICIT);
        let opened = read_one(file.clone()).unwrap();
        assert_eq!((values(&opened), &opened.notes[..]), (vec![19.0, 7.0], &[Note::Luminance][..]));
        let green = read_all(vec![file], &[(ChoiceKind::Channel, "green")]).unwrap();
        assert_eq!((values(&green), &green.notes[..]), (vec![20.0, 7.0], &[][..]));
    }
}

#[test]
fn luma_and_chroma_become_red_green_and_blue() {
    // 100 + 1.402 * 28 = 139.3; 100 - 0.344 * 22 - 0.714 * 28 = 72.4; 100 + 1.772 * 22 = 139.0.
    let channels = |elements: Elements| {
        ["red", "green", "blue"].map(|channel| {
            let file = elements.file(EXPLICIT);
            values(&read_all(vec![file], &[(ChoiceKind::Channel, channel)]).unwrap())
        })
    };
    let expected = [[139.0, 200.0], [72.0, 200.0], [139.0, 200.0]].map(|v| v.to_vec());
    assert_eq!(channels(coloured("YBR_FULL", 3, 0, &[100, 150, 156, 200, 128, 128])), expected);
    let expected = [[139.0, 239.0], [72.0, 172.0], [139.0, 239.0]].map(|v| v.to_vec());
    assert_eq!(channels(coloured("YBR_FULL_422", 3, 0, &[100, 200, 150, 156])), expected);
}

#[test]
fn colours_by_number_are_looked_up() {
    let tables = |mut elements: Elements, n_bits: u16| {
        for channel in 0..3u16 {
            elements = elements.shorts((0x28, 0x1101 + channel), &[2, 5, n_bits]);
        }
        for channel in 0..3u16 {
            let entries = [(channel + 1) * 10, 700];
            let bytes: Vec<u8> = match n_bits {
                8 => entries.iter().map(|v| *v as u8).collect(),
                _ => entries.iter().flat_map(|v| v.to_le_bytes()).collect(),
            };
            elements = elements.bytes((0x28, 0x1201 + channel), b"OW", &bytes);
        }
        elements
    };
    let shape = Shape { n_bits: 8, photometric: "PALETTE COLOR", ..GREY_16 };
    let plain = Elements::default().series("1.2.3").thick().placed([0.0; 3]).shape(shape, 1);
    // Entries begin with stored value 5; lower ones have the first colour, higher ones the last.
    for (n_bits, last, scalar) in [(16, 700.0, ScalarType::U16), (8, f64::from(700u16 as u8), ScalarType::U8)] {
        let file = tables(plain.clone(), n_bits).bytes((0x7fe0, 0x10), b"OB", &[3, 9]).file(EXPLICIT);
        let opened = read_one(file).unwrap();
        assert_eq!((values(&opened), opened.volume.scalar_type()), (vec![19.0, last], scalar));
    }
    // Without tables the numbers themselves are read.
    let opened = read_one(plain.bytes((0x7fe0, 0x10), b"OB", &[3, 9]).file(EXPLICIT)).unwrap();
    assert_eq!((values(&opened), &opened.notes[..]), (vec![3.0, 9.0], &[Note::PaletteIgnored][..]));
}

/// The example of T.87, H.3.
const EXAMPLE_H3: &str = "\
    ffd8fff7000b080004000401011100ffda0008010100000000c000006c80208e01c00000574000006ee6000001bc18000005d8000091\
    60ffd9\
    ";

/// 18 x 12 samples of 16 bits, [`ramp_16`], by CharLS.
const JPEG_LS_16: &str = "\
    ffd8fff7000b10000c001201011100fff8000d01ffff0012004301140040ffda0008010100000000b2bb839ed486334444df8e6d2636\
    5f24e3b88928ae98d408f9791ee9445969c80e81961c18f681188d10137c39b07993e60f973e58f953e50039fc007c9807407c924743\
    5ca7b72194d131382f37931d000f3d3e44f903e3cf8e3e7a13fc7c69f3e7c6225501d03e00e80f8b3e28f893e77003e20f873e78f864\
    9440887d72f822e9e7cd0fc9e01ca1f0a7c21f067c11f371f527c09f007ce9efe90a5b0b6e080f2998cbd3c50f773dd8f753dd0f9bc0\
    0f733dc8f713e70f7047dad49b5240014ae6571e0a7b41ece7b31eca7cd46a91ec87b19ec47cd9ec28ec5a1b669fe2524193e77b1eb2\
    7ac1eaefcd600f563d54f543d4cf9a3d491bab346c5bf88a393240ee73d28f493d21f99b5f67a39e8c7a29e887cc9e868ce592b5f1fa\
    6515190276c1e7679d3f33628cf393ce0f373cd8f353e60f3445fac59adafc4286cc723b24f2c7e67007959e547949e507939e4c7cb9\
    e4a8b0583b579f6a50698ca75e9e42fcc564c3c84f213c84f213c84f213e58ffd9\
    ";

/// 18 x 12 samples of 8 bits, [`ramp_8`], within 2, by CharLS.
const JPEG_LS_NEAR: &str = "\
    ffd8fff7000b08000c001201011100ffda00080101000200008631babaaaf5ea37bc8891124a29d22229152554c244a4b579d1d1122f\
    e8c9e48e4ff7d17a2ffe4bfec9f40061abbf7ea140011fff43bfff70ffd9\
    ";

/// Three planes of 18 x 12, [`rgb`], a scan each, by CharLS.
const JPEG_LS_PLANES: &str = "\
    ffd8fff7001108000c001203011100021100031100ffda0008010100000000801c01c01ca9322fbadb2baa9803a3ff430621cc523bb3\
    302ccaa0db6db6db68f00249089249554daa9d555552cb5532aaae9beaff7ffa3ff794ff00000060001ca9322fbadb2004a803803aea\
    a68803cfff7cffda00080102000000000b2bff7cff7fc0001e00e549917dd6d95d504e0000024c9a3fff21657e050027e05ffcff67ff\
    737f37ff125bebff74fd3ffda53fff7fbeffda0008010300000000400216284883ce34c2ca2400443dee060c4398a4776660599541b6\
    db6db6d1e1d242249255536aa7555554b2954caaaba6fabfff7e8ffde4bfc0000030000e549917dd6d90025c01c01d75534401e7ff7e\
    ffd9\
    ";

/// The same, interleaved by lines.
const JPEG_LS_LINES: &str = "\
    ffd8fff7001108000c001203011100021100031100ffda000c03010002000300000100801c01c01ca9322fbadb2baa9803a3ff5d94a2\
    224924aaa40c0407871d386cd19305cb00000254a13260c18873148eeccc0b32a834ff70db6db6db67d24224924aaa68754efaaaaaa5\
    94a995555d37abff7ffd1fff24bf80001ead4a94e952a3468d0827002a1fff7fefff690fefff3ff0595f814009f9ff77fcff77fe05ff\
    67feff77fe7fef7bf8ff7e6feffdee7f00000060001ca9322fbadb2004e803800000932eaa68803b7ff24b7c000005fbff77bbdef65b\
    a540000049b39ce4acff6b55555a5577ff74affda53fff7fff3fc0ffd9\
    ";

/// The same, interleaved by samples.
const JPEG_LS_SAMPLES: &str = "\
    ffd8fff7001108000c001203011100021100031100ffda000c030100020003000002004015002400200000e8b1ba4cae932b84cae265\
    7132b8995c4cae265713298994c00001003d4ca6a6535329a98340c1a243a2c54a3a7b273272ad6bb5daed705af96d76b25800a912c9\
    64b2ebaebaebaebae6eb0eca5d75ced975d75dff7fff7a7fbfff7d5a2000002dba9d4e9f4ba5d1e8f43a1d0f401349001487ff7fefef\
    bde85e777fff73a176004fff7f4c85ff7fff7eebbfff7f965fff7fff7be7bcd73fff724000001806800000bf003ca93917eeb7657aa9\
    d1ff7efa00496efa00e495000001262c0000024db77b7797397200f2b1777f7f7f7f7f7f7f6d6d6dda9b5b5b5b5bfd3efbff7fff7fff\
    7fedf29fff7fff7fff7fff7fff7fff7eff7fff00ffd9\
    ";

/// 32 x 32 signed samples, 40 x - 30 y - 200, lossless, by OpenJPEG.
const JPEG_2000: &str = "\
    ff4fff5100290000000000200000002000000000000000000000002000000020000000000000000000018b0101ff52000c0000000100\
    0504040001ff5c00134060686870686870686870686870686870ff640025000143726561746564206279204f70656e4a504547207665\
    7273696f6e20322e352e32ff90000a0000000000710001ff93c0fb4080081fc3f60387ec0403293f072fc1f98241f982000d0055bf0c\
    180513c0fc01607e00c02219d31c0b00cfde502aefc07da1101f684836a19ac4ceb486a73e62a2b0201d0107bfc03ea09803e7125fa7\
    c789e3a4d090979d96a91d9f0e5600c1ffd9\
    ";

/// 9 x 6 samples of 16 bits, 70 x + 11 y + 5, by GDCM.
const JPEG_LOSSLESS: &str = "\
    ffd8ffc3000b100006000901011100ffc40016000101010000000000000000000000000007040fffda0008010100010000c001119191\
    9191919191ab4646464646464646ad191919191919191ab4646464646464646ad191919191919191ab4646464646464646ffd900\
    ";
