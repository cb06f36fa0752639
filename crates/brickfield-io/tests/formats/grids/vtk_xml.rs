//! .vtr and .vts in every encoding.

use std::io::Cursor;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use brickfield_core::StructuredGrid;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_io::ByteOrder;
use brickfield_io::grids::vtk_xml;
use brickfield_io::{OpenedGrids, ReadError};
use proptest::prelude::*;

use super::vtk::{AXES, N, assert_axes, assert_fixture, marks, positions, tuples};
use super::{Example, assert_places, options};
use crate::common::zlib;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Storage {
    Text,
    Inline,
    AppendedRaw,
    AppendedBase64,
}

#[derive(Clone, Copy, Debug)]
struct Style {
    storage: Storage,
    order: ByteOrder,
    is_packed: bool,
    is_wide: bool,
}

const TEXT: Style = Style { storage: Storage::Text, order: ByteOrder::Little, is_packed: false, is_wide: false };

fn styles() -> Vec<Style> {
    let storages = [Storage::Text, Storage::Inline, Storage::AppendedRaw, Storage::AppendedBase64];
    (0..32)
        .map(|bits: usize| Style {
            storage: storages[bits & 3],
            order: if bits & 4 == 0 { ByteOrder::Little } else { ByteOrder::Big },
            is_packed: bits & 8 != 0,
            is_wide: bits & 16 != 0,
        })
        .collect()
}

/// A document that is being written, and its appended data.
struct Xml {
    style: Style,
    out: String,
    appended: Vec<u8>,
}

impl Xml {
    fn new(style: Style, kind: &str) -> Xml {
        let order = if style.order == ByteOrder::Big { "BigEndian" } else { "LittleEndian" };
        let word = if style.is_wide { "UInt64" } else { "UInt32" };
        let compressor = if style.is_packed { " compressor=\"vtkZLibDataCompressor\"" } else { "" };
        let out = format!(
            "<VTKFile type=\"{kind}\" byte_order=\"{order}\" header_type=\"{word}\"{compressor}><{kind} WholeExtent=\"0 3 0 2 0 1\">"
        );
        Xml { style, out, appended: Vec::new() }
    }

    fn tag(mut self, tag: &str) -> Xml {
        self.out += &format!("<{tag}>");
        self
    }

    fn doubles(self, name: &str, n_components: usize, numbers: &[f64]) -> Xml {
        let order = self.style.order;
        let text = numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        let bytes = numbers.iter().flat_map(|x| match order {
            ByteOrder::Little => x.to_le_bytes(),
            ByteOrder::Big => x.to_be_bytes(),
        });
        let bytes = bytes.collect();
        self.array(&format!("type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"{n_components}\""), &text, bytes)
    }

    fn marks(self, name: &str, numbers: &[u8]) -> Xml {
        let text = numbers.iter().map(u8::to_string).collect::<Vec<_>>().join(" ");
        self.array(&format!("type=\"UInt8\" Name=\"{name}\""), &text, numbers.to_vec())
    }

    fn array(mut self, about: &str, text: &str, bytes: Vec<u8>) -> Xml {
        let (header, data) = self.packed(&bytes);
        let offset = self.appended.len();
        match self.style.storage {
            Storage::Text => self.out += &format!("<DataArray {about} format=\"ascii\">{text}</DataArray>"),
            Storage::Inline => {
                let text = STANDARD.encode(header) + &STANDARD.encode(data);
                self.out += &format!("<DataArray {about} format=\"binary\">{text}</DataArray>");
            }
            Storage::AppendedRaw => {
                self.appended.extend([header, data].concat());
                self.out += &format!("<DataArray {about} format=\"appended\" offset=\"{offset}\"/>");
            }
            Storage::AppendedBase64 => {
                let text = STANDARD.encode(header) + &STANDARD.encode(data);
                self.appended.extend(text.bytes());
                self.out += &format!("<DataArray {about} format=\"appended\" offset=\"{offset}\"/>");
            }
        }
        self
    }

    /// The words before the data, and the data, in blocks of 64 bytes if they are packed.
    fn packed(&self, bytes: &[u8]) -> (Vec<u8>, Vec<u8>) {
        if !self.style.is_packed {
            return (self.words(&[bytes.len()]), bytes.to_vec());
        }
        let blocks: Vec<_> = bytes.chunks(64).map(zlib).collect();
        let mut words = vec![blocks.len(), 64, bytes.len() % 64];
        words.extend(blocks.iter().map(Vec::len));
        (self.words(&words), blocks.concat())
    }

    fn words(&self, words: &[usize]) -> Vec<u8> {
        let n = if self.style.is_wide { 8 } else { 4 };
        let word = |w: &usize| match self.style.order {
            ByteOrder::Little => w.to_le_bytes()[..n].to_vec(),
            ByteOrder::Big => w.to_be_bytes()[8 - n..].to_vec(),
        };
        words.iter().flat_map(word).collect()
    }

    fn data(self) -> Xml {
        self.tag("PointData Scalars=\"p\"")
            .doubles("p", 1, &tuples(1))
            .doubles("u", 3, &tuples(3))
            .marks("vtkGhostType", &marks(2))
            .tag("/PointData")
    }

    fn end(self, kind: &str) -> Vec<u8> {
        let end = self.tag("/Piece").tag(&format!("/{kind}"));
        let encoding = match end.style.storage {
            Storage::AppendedRaw => "raw",
            Storage::AppendedBase64 => "base64",
            _ => return (end.out + "</VTKFile>").into_bytes(),
        };
        let head = format!("{}<AppendedData encoding=\"{encoding}\">_", end.out);
        [head.as_bytes(), &end.appended, b"</AppendedData></VTKFile>"].concat()
    }
}

fn rectilinear(style: Style) -> Vec<u8> {
    let kind = "RectilinearGrid";
    let mut file = Xml::new(style, kind).tag("Piece Extent=\"0 3 0 2 0 1\"").data().tag("Coordinates");
    for (name, axis) in ["x", "y", "z"].iter().zip(AXES) {
        file = file.doubles(name, 1, axis);
    }
    file.tag("/Coordinates").end(kind)
}

fn structured(style: Style) -> Vec<u8> {
    let kind = "StructuredGrid";
    let file = Xml::new(style, kind).tag("Piece Extent=\"0 3 0 2 0 1\"").tag("Points");
    file.doubles("Points", 3, &positions()).tag("/Points").data().end(kind)
}

pub(crate) fn read(bytes: &[u8]) -> Result<OpenedGrids, ReadError> {
    vtk_xml::read(Cursor::new(bytes), &options())
}

pub(crate) fn examples() -> Vec<Example> {
    let raw = Style { storage: Storage::AppendedRaw, is_packed: true, ..TEXT };
    let inline = Style { storage: Storage::Inline, ..TEXT };
    vec![
        Example { name: "text.vts", bytes: structured(TEXT), read },
        Example { name: "inline.vtr", bytes: rectilinear(inline), read },
        Example { name: "raw.vts", bytes: structured(raw), read },
    ]
}

#[test]
fn every_encoding() {
    for style in styles() {
        let opened = read(&rectilinear(style)).unwrap_or_else(|fault| panic!("{style:?}: {fault}"));
        assert_axes(&opened.grids[0]);
        assert_fixture(&opened.grids[0]);
        let opened = read(&structured(style)).unwrap_or_else(|fault| panic!("{style:?}: {fault}"));
        assert_places(&opened.grids[0], N);
        assert_fixture(&opened.grids[0]);
    }
}

/// The first two layers of x, and the last three: they share one.
#[test]
fn each_piece_is_a_grid() {
    let mut file = Xml::new(TEXT, "RectilinearGrid");
    for (extent, axis) in [("0 1 0 2 0 1", &AXES[0][..2]), ("1 3 0 2 0 1", &AXES[0][1..])] {
        file = file.tag(&format!("Piece Extent=\"{extent}\"")).tag("Coordinates");
        file = file.doubles("x", 1, axis).doubles("y", 1, AXES[1]).doubles("z", 1, AXES[2]).tag("/Coordinates");
        file = if extent.starts_with('0') { file.tag("/Piece") } else { file };
    }
    let opened = read(&file.end("RectilinearGrid")).unwrap();
    let sizes: Vec<_> = opened.grids.iter().map(StructuredGrid::n_nodes).collect();
    assert_eq!(sizes, [UVec3::new(2, 3, 2), UVec3::new(3, 3, 2)]);
    assert_eq!(opened.grids[1].position(UVec3::ZERO), DVec3::new(1.0, -1.0, 10.0));
}

#[test]
fn other_documents_are_named() {
    let said = |kind: &str| {
        let file = String::from_utf8(rectilinear(TEXT)).unwrap().replace("RectilinearGrid", kind);
        read(file.as_bytes()).unwrap_err().to_string()
    };
    assert!(said("ImageData").ends_with("`open` reads it as a volume"));
    assert!(said("PStructuredGrid").ends_with("the grids that it names are, one by one"));
    assert_eq!(said("StructuredGrid"), "components of array \"x\" is \"1\"; expected 3, of positions");
}

proptest! {
    #[test]
    fn any_values_come_back(numbers in prop::collection::vec(any::<f32>(), 24), style in prop::sample::select(styles())) {
        let wide: Vec<f64> = numbers.iter().map(|x| f64::from(*x)).collect();
        let kind = "StructuredGrid";
        let file = Xml::new(style, kind).tag("Piece Extent=\"0 3 0 2 0 1\"").tag("Points");
        let file = file.doubles("Points", 3, &positions()).tag("/Points").tag("PointData").doubles("p", 1, &wide);
        let opened = read(&file.tag("/PointData").end(kind)).unwrap();
        let grid = &opened.grids[0];
        for (i, number) in numbers.iter().enumerate() {
            prop_assert_eq!(grid.holes().is_some_and(|holes| holes[i]), !number.is_finite());
            prop_assert!(!number.is_finite() || grid.fields()[0].values[i].to_bits() == number.to_bits());
        }
    }
}
