use std::io::Cursor;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{ScalarType, Voxels};
use brickfield_io::{ByteOrder, ChoiceKind, NoFiles, Note, Opened, ReadError, vti};

use crate::common::*;

fn read(file: impl AsRef<[u8]>) -> Result<Opened, ReadError> {
    vti::read(Cursor::new(file.as_ref()), &NoFiles, &options())
}

fn type_name(scalar: ScalarType) -> &'static str {
    match scalar {
        ScalarType::U8 => "UInt8",
        ScalarType::I8 => "Int8",
        ScalarType::U16 => "UInt16",
        ScalarType::I16 => "Int16",
        ScalarType::U32 => "UInt32",
        ScalarType::I32 => "Int32",
        ScalarType::F32 => "Float32",
        ScalarType::F64 => "Float64",
    }
}

/// Everything around the array.
#[derive(Clone, Copy)]
struct Style {
    order: ByteOrder,
    word_bytes: usize,
    compressor: &'static str,
}

impl Style {
    fn root(&self) -> String {
        let order = if self.order == ByteOrder::Big { "BigEndian" } else { "LittleEndian" };
        let (bits, compressor) = (8 * self.word_bytes, self.compressor);
        format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" byte_order=\"{order}\" header_type=\"UInt{bits}\"{compressor}>"
        )
    }

    fn words(&self, words: &[usize]) -> Vec<u8> {
        let word = |w: &usize| match (self.order, self.word_bytes) {
            (ByteOrder::Little, n) => w.to_le_bytes()[..n].to_vec(),
            (ByteOrder::Big, n) => w.to_be_bytes()[8 - n..].to_vec(),
        };
        words.iter().flat_map(word).collect()
    }

    /// The header, and the data in zlib blocks of 10 bytes, the last one partial.
    fn blocks(&self, data: &[u8]) -> (Vec<u8>, Vec<u8>) {
        let blocks: Vec<Vec<u8>> = data.chunks(10).map(zlib).collect();
        let mut words = vec![blocks.len(), 10, data.len() % 10];
        words.extend(blocks.iter().map(Vec::len));
        (self.words(&words), blocks.concat())
    }
}

const PLAIN: Style = Style { order: ByteOrder::Little, word_bytes: 4, compressor: "" };

fn inline(style: Style, array: &str, numbers: &str) -> String {
    format!(
        "{}<ImageData WholeExtent=\"0 3 0 2 0 1\" Origin=\"0 0 0\" Spacing=\"1 1 1\"><Piece Extent=\"0 3 0 2 0 1\">\
         <PointData Scalars=\"a\"><DataArray Name=\"a\" {array}>\n {numbers}\n</DataArray></PointData></Piece></ImageData></VTKFile>",
        style.root()
    )
}

fn appended(style: Style, array: &str, encoding: &str, data: &[u8]) -> Vec<u8> {
    let head = format!(
        "{}<ImageData WholeExtent=\"0 3 0 2 0 1\"><Piece Extent=\"0 3 0 2 0 1\"><PointData Scalars=\"a\">\
         <DataArray Name=\"a\" format=\"appended\" {array}/></PointData><CellData/></Piece></ImageData>\
         <AppendedData encoding=\"{encoding}\">\n  _",
        style.root()
    );
    [head.as_bytes(), data, b"\n</AppendedData></VTKFile>"].concat()
}

#[test]
fn every_type_order_word_and_encoding() {
    for scalar in ScalarType::ALL {
        let ramp = ramp(scalar);
        let type_name = type_name(scalar);
        assert_ramp(
            &read(inline(PLAIN, &format!("type=\"{type_name}\" format=\"ascii\""), &text(&ramp))).unwrap(),
            scalar,
        );
        for (order, word_bytes) in [(ORDERS[0], 4), (ORDERS[0], 8), (ORDERS[1], 4), (ORDERS[1], 8)] {
            let data = bytes(&ramp, order);
            let style = Style { order, word_bytes, compressor: "" };
            let header = style.words(&[data.len()]);
            check(style, type_name, scalar, &header, &data);
            let style = Style { compressor: " compressor=\"vtkZLibDataCompressor\"", ..style };
            let (header, blocks) = style.blocks(&data);
            check(style, type_name, scalar, &header, &blocks);
        }
    }
}

/// Inline and appended, raw and in base64, the latter as one run and as two.
fn check(style: Style, type_name: &str, scalar: ScalarType, header: &[u8], data: &[u8]) {
    let one_run = STANDARD.encode([header, data].concat());
    let two_runs = STANDARD.encode(header) + &STANDARD.encode(data);
    for text in [&one_run, &two_runs] {
        let broken = format!("{}\n  {}", &text[..7], &text[7..]);
        let file = inline(style, &format!("type=\"{type_name}\" format=\"binary\""), &broken);
        assert_ramp(&read(file).unwrap(), scalar);
        let file =
            appended(style, &format!("type=\"{type_name}\" offset=\"4\""), "base64", format!("abc={text}").as_bytes());
        assert_ramp(&read(file).unwrap(), scalar);
    }
    let raw = [b"<_&", header, data].concat();
    let file = appended(style, &format!("type=\"{type_name}\" offset=\"3\""), "raw", &raw);
    assert_ramp(&read(file).unwrap(), scalar);
}

#[test]
fn extent_origin_spacing_and_direction() {
    let file = inline(PLAIN, "type=\"UInt8\"", &"1 ".repeat(24))
        .replace("Extent=\"0 3 0 2 0 1\"", "Extent=\"-1 2 10 12 5 6\"")
        .replace(
            "Origin=\"0 0 0\" Spacing=\"1 1 1\"",
            "Origin=\"1 2 3\" Spacing=\"2 3 4\" Direction=\"0 1 0 1 0 0 0 0 -1\"",
        );
    let opened = read(file).unwrap();
    assert_eq!(opened.volume.grid().dims(), DIMS);
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(2.0, 3.0, 4.0));
    assert_near(centre(&opened, 0.0, 0.0, 0.0), [31.0, 0.0, -17.0]);
    assert_near(centre(&opened, 1.0, 0.0, 0.0), [31.0, 2.0, -17.0]);
}

#[test]
fn cell_data_lie_at_cell_centres() {
    let file = inline(PLAIN, "type=\"UInt8\"", "1 2 3 4 5 6").replace("PointData", "CellData");
    let opened = read(file).unwrap();
    assert_eq!(opened.volume.grid().dims(), UVec3::new(3, 2, 1));
    assert_near(centre(&opened, 0.0, 0.0, 0.0), [0.5, 0.5, 0.5]);
    assert_eq!(opened.volume.voxels(), &Voxels::U8(vec![1, 2, 3, 4, 5, 6]));
}

#[test]
fn the_active_scalars_of_several_arrays() {
    let other = "<DataArray type=\"Float32\" Name=\"b\" NumberOfComponents=\"3\">0</DataArray><DataArray Name=\"a\"";
    let zeros = "0 ".repeat(24);
    let file = inline(PLAIN, "type=\"UInt8\"", &zeros).replace("<DataArray Name=\"a\"", other);
    let opened = read(&file).unwrap();
    assert_eq!(opened.notes, [Note::OneOfSeveral { kind: ChoiceKind::Array, read: "1 (a)".to_owned(), n_entries: 2 }]);
    assert_eq!(read(file.replace("Scalars=\"a\"", "")).unwrap().notes, opened.notes);
    let named = file.replace("Scalars=\"a\"", "Scalars=\"b\"");
    let vector = read(&named).unwrap_err().to_string();
    assert_eq!(vector, "DataArray \"b\" holds 1 sample; 72 are promised");
    let mut options = options();
    options.wanted.want(ChoiceKind::Array, "a");
    assert!(vti::read(Cursor::new(named), &NoFiles, &options).unwrap().notes.is_empty());
}

/// 0 to 23 in blocks of 10 bytes, each packed by `pack`.
fn packed_file(compressor: &'static str, pack: impl Fn(&[u8]) -> Vec<u8>) -> Vec<u8> {
    let style = Style { compressor, ..PLAIN };
    let data: Vec<u8> = (0..24).collect();
    let blocks: Vec<Vec<u8>> = data.chunks(10).map(pack).collect();
    let words: Vec<usize> = [3, 10, 4].into_iter().chain(blocks.iter().map(Vec::len)).collect();
    appended(style, "type=\"UInt8\" offset=\"0\"", "raw", &[style.words(&words), blocks.concat()].concat())
}

fn packed(compressor: &'static str, pack: impl Fn(&[u8]) -> Vec<u8>) -> Result<Opened, ReadError> {
    read(packed_file(compressor, pack))
}

const LZ4: &str = " compressor=\"vtkLZ4DataCompressor\"";
const LZMA: &str = " compressor=\"vtkLZMADataCompressor\"";

fn xz(block: &[u8]) -> Vec<u8> {
    STANDARD.decode(XZ_BLOCKS[usize::from(block[0]) / 10]).unwrap()
}

/// Files of blocks, by the name of their compressor.
pub(crate) fn examples() -> [(&'static str, Vec<u8>); 2] {
    [("lz4", packed_file(LZ4, lz4_flex::block::compress)), ("lzma", packed_file(LZMA, xz))]
}

/// Blocks of [`packed`] as .xz streams, by Python's lzma (liblzma, as VTK).
const XZ_BLOCKS: [&str; 3] = [
    "/Td6WFoAAAFpIt42AgAhAQwAAACPmEGcAQAJAAECAwQFBgcICQAAAEbXbEUAAR4K6mMSFJBCmQ0BAAAAAAFZWg==",
    "/Td6WFoAAAFpIt42AgAhAQwAAACPmEGcAQAJCgsMDQ4PEBESEwAAAJlLaEkAAR4K6mMSFJBCmQ0BAAAAAAFZWg==",
    "/Td6WFoAAAFpIt42AgAhAQwAAACPmEGcAQADFBUWFwBfTpl7AAEYBGvp8KWQQpkNAQAAAAABWVo=",
];
/// The first of them with a dictionary of 1 GiB.
const XZ_HUGE_DICTIONARY: &str =
    "/Td6WFoAAAFpIt42AgAhASQAAABeH8f5AQAJAAECAwQFBgcICQAAAEbXbEUAAR4K6mMSFJBCmQ0BAAAAAAFZWg==";

#[test]
fn blocks_of_lz4_and_lzma() {
    let expected = Voxels::U8((0..24).collect());
    assert_eq!(packed(LZ4, lz4_flex::block::compress).unwrap().volume.voxels(), &expected);
    assert_eq!(packed(LZMA, xz).unwrap().volume.voxels(), &expected);
    let short = |block: &[u8]| lz4_flex::block::compress(&block[..block.len() - 1]);
    assert_eq!(
        packed(LZ4, short).unwrap_err().to_string(),
        "DataArray \"a\" holds 9 bytes, then a block ends after 9 of its 10 bytes; 24 are promised"
    );
    let corrupt = "DataArray \"a\" holds 0 bytes, then its compressed data are corrupt; 24 are promised";
    assert_eq!(packed(LZ4, |_| vec![0xff; 8]).unwrap_err().to_string(), corrupt);
    assert_eq!(packed(LZMA, |_| vec![0xff; 40]).unwrap_err().to_string(), corrupt);
    let wrong_sum = |block: &[u8]| {
        let mut bytes = xz(block);
        let n = bytes.len();
        bytes[n - 32] ^= 1;
        bytes
    };
    assert!(packed(LZMA, wrong_sum).is_err());
    let huge = packed(LZMA, |_| STANDARD.decode(XZ_HUGE_DICTIONARY).unwrap()).unwrap_err().to_string();
    assert!(huge.contains("memory"), "{huge}");
}

#[test]
fn components_colours_wide_integers_and_bits() {
    let wanting = |file: String, entry: &str| {
        let mut options = options();
        options.wanted.want(ChoiceKind::Channel, entry);
        vti::read(Cursor::new(file), &NoFiles, &options)
    };
    let numbers = |n: i32| (0..n).map(|i| i.to_string()).collect::<Vec<_>>().join(" ");
    let vectors =
        "type=\"Float32\" NumberOfComponents=\"3\" ComponentName0=\"u\" ComponentName1=\"v\" ComponentName2=\"w\"";
    let opened = wanting(inline(PLAIN, vectors, &numbers(72)), "v").unwrap();
    assert_eq!(opened.volume.voxels(), &Voxels::F32((0..24).map(|i| (3 * i + 1) as f32).collect()));
    let opened = read(inline(PLAIN, vectors, &numbers(72))).unwrap();
    let note = Note::OneOfSeveral { kind: ChoiceKind::Channel, read: "0 (u)".to_owned(), n_entries: 3 };
    assert_eq!(opened.notes, [note]);
    let colours = || inline(PLAIN, "type=\"UInt8\" NumberOfComponents=\"3\"", &numbers(72));
    assert_eq!(wanting(colours(), "blue").unwrap().volume.voxels(), &Voxels::U8((0..24).map(|i| 3 * i + 2).collect()));
    assert_eq!(read(colours()).unwrap().notes, [Note::Luminance]);
    let opened = read(inline(PLAIN, "type=\"Int64\"", &numbers(24))).unwrap();
    assert_eq!(opened.volume.voxels(), &Voxels::U8((0..24).collect()));
    assert_eq!(opened.notes, [Note::Converted { from: "int64", to: ScalarType::U8 }]);
    let bits = [PLAIN.words(&[3]), vec![0b1000_0001, 0, 0xff]].concat();
    let opened = read(appended(PLAIN, "type=\"Bit\" offset=\"0\"", "raw", &bits)).unwrap();
    let expected = [[1, 0, 0, 0, 0, 0, 0, 1], [0; 8], [1; 8]].concat();
    assert_eq!(opened.volume.voxels(), &Voxels::U8(expected));
}

#[test]
fn a_spacing_of_0_or_below() {
    let file = inline(PLAIN, "type=\"UInt8\"", &"1 ".repeat(24)).replace("Spacing=\"1 1 1\"", "Spacing=\"-2 3 0\"");
    let opened = read(file).unwrap();
    assert_eq!(opened.volume.grid().spacing(), DVec3::new(2.0, 3.0, 1.0));
    assert_near(centre(&opened, 1.0, 1.0, 1.0), [-2.0, 3.0, 1.0]);
    assert_eq!(opened.notes, [Note::SpacingAssumed { axis: 'z', reason: "is 0" }]);
}

#[test]
fn documents_that_lie() {
    let zeros = "0 ".repeat(24);
    let file = inline(PLAIN, "type=\"UInt8\"", &zeros);
    let refusal = |from: &str, to: &str| {
        assert!(file.contains(from), "{from}");
        read(file.replace(from, to)).unwrap_err().to_string()
    };
    assert!(refusal("0 3 0 2 0 1", "0 3 0 2 0 9223372036854775807").contains("dimension z"));
    assert!(refusal("0 3 0 2 0 1", "0 3 0 2 0 -7").contains("Extent"));
    assert!(refusal("0 3 0 2 0 1", "0 3").contains("6 numbers"));
    assert!(refusal("type=\"UInt8\"", "type=\"String\"").contains("array type \"String\" is not supported"));
    assert!(refusal("type=\"ImageData\"", "type=\"PolyData\"").contains("PolyData"));
    assert!(refusal("<VTKFile", "<HTML").contains("root element"));
    assert!(refusal("DataArray ", "NoArray ").contains("DataArray"));
    assert!(refusal("0 \n</Data", "</Data").contains("23 samples"));
    assert!(refusal("0 \n</Data", "x</Data").contains("sample 23"));
    assert!(refusal("UInt32\"", "UInt32\" compressor=\"vtkNoCompressor\"").contains("vtkNoCompressor"));
    let bad = |data: &[u8], compressor| {
        let style = Style { compressor, ..PLAIN };
        read(appended(style, "type=\"UInt8\" offset=\"0\"", "raw", data)).unwrap_err().to_string()
    };
    assert!(bad(&PLAIN.words(&[25]), "").contains("length of DataArray"));
    assert!(bad(&PLAIN.words(&[24]), "").contains("24 are promised"));
    let zlib = " compressor=\"vtkZLibDataCompressor\"";
    assert!(bad(&PLAIN.words(&[1, 24, 0, 5, 0]), zlib).contains("holds 0 bytes, then its compressed data are"));
    assert!(bad(&PLAIN.words(&[usize::MAX, 24, 0]), zlib).contains("length of DataArray"));
    assert!(bad(&PLAIN.words(&[u32::MAX as usize, 0, 24]), zlib).contains("block size"));
}
