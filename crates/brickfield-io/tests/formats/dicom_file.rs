//! DICOM files, element by element.

use std::collections::BTreeMap;

use brickfield_io::{ChoiceKind, OpenOptions, Opened, ReadError, dicom};

use crate::common::options;
use crate::dicom::{Syntax, element, even};

pub(crate) const EXPLICIT: &str = "1.2.840.10008.1.2.1";

/// The elements of a data set or an item, in order.
#[derive(Clone, Default)]
pub(crate) struct Elements {
    pub(crate) bytes: Vec<u8>,
    syntax: Option<Syntax>,
}

impl Elements {
    pub(crate) fn new(syntax: Syntax) -> Elements {
        Elements { bytes: Vec::new(), syntax: Some(syntax) }
    }

    fn syntax(&self) -> Syntax {
        self.syntax.unwrap_or(Syntax::Explicit)
    }

    pub(crate) fn bytes(mut self, tag: (u16, u16), vr: &[u8; 2], value: &[u8]) -> Elements {
        let syntax = self.syntax();
        element(&mut self.bytes, syntax, tag, vr, value);
        self
    }

    pub(crate) fn text(self, tag: (u16, u16), vr: &[u8; 2], value: &str) -> Elements {
        self.bytes(tag, vr, &even(value, b' '))
    }

    pub(crate) fn shorts(self, tag: (u16, u16), values: &[u16]) -> Elements {
        let is_big = self.syntax() == Syntax::BigEndian;
        let bytes: Vec<u8> =
            values.iter().flat_map(|v| if is_big { v.to_be_bytes() } else { v.to_le_bytes() }).collect();
        self.bytes(tag, b"US", &bytes)
    }

    /// A sequence whose items have lengths.
    pub(crate) fn items(self, tag: (u16, u16), items: &[Elements]) -> Elements {
        let mut value = Vec::new();
        for item in items {
            value.extend([0xfe, 0xff, 0, 0xe0]);
            value.extend((item.bytes.len() as u32).to_le_bytes());
            value.extend(&item.bytes);
        }
        self.bytes(tag, b"SQ", &value)
    }

    /// A sequence of one item, both ended by delimiters.
    pub(crate) fn open_item(mut self, tag: (u16, u16), item: Elements) -> Elements {
        self = self.bytes(tag, b"SQ", &[]);
        let at = self.bytes.len() - 4;
        self.bytes[at..].fill(0xff);
        self.bytes.extend([0xfe, 0xff, 0, 0xe0, 255, 255, 255, 255]);
        self.bytes.extend(&item.bytes);
        self.bytes.extend([0xfe, 0xff, 0x0d, 0xe0, 0, 0, 0, 0, 0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0]);
        self
    }

    /// Encapsulated pixel data with an offset table.
    pub(crate) fn fragments(mut self, offsets: &[u32], fragments: &[&[u8]]) -> Elements {
        self.bytes.extend([0xe0, 0x7f, 0x10, 0, b'O', b'B', 0, 0, 255, 255, 255, 255]);
        let table: Vec<u8> = offsets.iter().flat_map(|o| o.to_le_bytes()).collect();
        for fragment in std::iter::once(&table[..]).chain(fragments.iter().copied()) {
            self.bytes.extend([0xfe, 0xff, 0, 0xe0]);
            self.bytes.extend(((fragment.len() + fragment.len() % 2) as u32).to_le_bytes());
            self.bytes.extend(fragment);
            self.bytes.extend(&[0][..fragment.len() % 2]);
        }
        self.bytes.extend([0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0]);
        self
    }

    /// The file: preamble, meta group, these elements.
    pub(crate) fn file(&self, transfer_syntax: &str) -> Vec<u8> {
        [meta(transfer_syntax), self.bytes.clone()].concat()
    }
}

pub(crate) fn meta(transfer_syntax: &str) -> Vec<u8> {
    let group = Elements::default().bytes((2, 0x10), b"UI", &even(transfer_syntax, 0)).bytes;
    let length = (group.len() as u32).to_le_bytes();
    let length = Elements::default().bytes((2, 0), b"UL", &length).bytes;
    [vec![0; 128], b"DICM".to_vec(), length, group].concat()
}

/// What a picture of so many columns, rows and bits states.
#[derive(Clone, Copy)]
pub(crate) struct Shape {
    pub(crate) columns: u16,
    pub(crate) rows: u16,
    pub(crate) n_bits: u16,
    pub(crate) signed: u16,
    pub(crate) n_samples: u16,
    pub(crate) photometric: &'static str,
}

pub(crate) const GREY_16: Shape =
    Shape { columns: 2, rows: 1, n_bits: 16, signed: 0, n_samples: 1, photometric: "MONOCHROME2" };

impl Elements {
    pub(crate) fn series(self, uid: &str) -> Elements {
        self.text((8, 0x16), b"UI", "1.2.840.10008.5.1.4.1.1.2")
            .text((8, 0x60), b"CS", "CT")
            .text((8, 0x70), b"LO", "none")
            .text((0x20, 0xe), b"UI", uid)
    }

    /// How thick a slice is: the step of a stack that has one.
    pub(crate) fn thick(self) -> Elements {
        self.text((0x18, 0x50), b"DS", "2.5")
    }

    /// Where the first voxel lies, and that the axes are the patient's.
    pub(crate) fn placed(self, [x, y, z]: [f64; 3]) -> Elements {
        self.text((0x20, 0x32), b"DS", &format!("{x}\\{y}\\{z}")).text((0x20, 0x37), b"DS", "1\\0\\0\\0\\1\\0")
    }

    pub(crate) fn shape(self, shape: Shape, n_frames: usize) -> Elements {
        self.shorts((0x28, 2), &[shape.n_samples])
            .text((0x28, 4), b"CS", shape.photometric)
            .shorts((0x28, 6), &[0])
            .text((0x28, 8), b"IS", &n_frames.to_string())
            .shorts((0x28, 0x10), &[shape.rows])
            .shorts((0x28, 0x11), &[shape.columns])
            .text((0x28, 0x30), b"DS", "1\\1")
            .shorts((0x28, 0x100), &[shape.n_bits])
            .shorts((0x28, 0x101), &[shape.n_bits])
            .shorts((0x28, 0x102), &[shape.n_bits - 1])
            .shorts((0x28, 0x103), &[shape.signed])
    }

    pub(crate) fn and(mut self, more: Elements) -> Elements {
        self.bytes.extend(more.bytes);
        self
    }

    pub(crate) fn words(self, values: &[u16]) -> Elements {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.bytes((0x7fe0, 0x10), b"OW", &bytes)
    }
}

pub(crate) fn read_one(file: Vec<u8>) -> Result<Opened, ReadError> {
    read_all(vec![file], &[])
}

pub(crate) fn read_all(files: Vec<Vec<u8>>, wanted: &[(ChoiceKind, &str)]) -> Result<Opened, ReadError> {
    let files: BTreeMap<String, Vec<u8>> =
        files.into_iter().enumerate().map(|(i, file)| (format!("{i:02}"), file)).collect();
    let names: Vec<String> = files.keys().cloned().collect();
    let mut options: OpenOptions = options();
    for (kind, entry) in wanted {
        options.wanted.want(*kind, *entry);
    }
    dicom::read(&names, &files, &options)
}

pub(crate) fn values(opened: &Opened) -> Vec<f64> {
    (0..opened.volume.voxels().len()).map(|i| opened.volume.value(i)).collect()
}
