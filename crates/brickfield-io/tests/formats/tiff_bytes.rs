//! TIFF files of any kind, byte by byte.

use std::collections::BTreeMap;

use brickfield_io::ByteOrder::{self, Big, Little};

/// Values of a tag.
#[derive(Clone, Debug)]
pub(crate) enum Values {
    Short(Vec<u16>),
    Long(Vec<u64>),
    Text(Vec<u8>),
    /// Rational.
    Fraction(u32, u32),
    Double(Vec<f64>),
}

/// A page: its tags, its strips or tiles, and the pages inside it.
#[derive(Clone, Debug)]
pub(crate) struct PageBytes {
    pub(crate) tags: BTreeMap<u16, Values>,
    pub(crate) chunks: Vec<Vec<u8>>,
    pub(crate) levels: Vec<PageBytes>,
}

impl PageBytes {
    /// One uncompressed strip of grey samples, `n_bits` each.
    pub(crate) fn grey(width: u16, height: u16, n_bits: u16, samples: Vec<u8>) -> PageBytes {
        let tags = [(256, width), (257, height), (258, n_bits), (259, 1), (262, 1), (277, 1), (278, height)];
        let tags = tags.map(|(tag, value)| (tag, Values::Short(vec![value])));
        PageBytes { tags: tags.into(), chunks: vec![samples], levels: vec![] }
    }

    /// A page of `samples` a pixel, those of one pixel together.
    pub(crate) fn colours(photometric: u16, n_samples: u16, width: u16, height: u16, samples: Vec<u8>) -> PageBytes {
        PageBytes::grey(width, height, 8, samples)
            .with(258, &vec![8; n_samples.into()])
            .with(262, &[photometric])
            .with(277, &[n_samples])
    }

    pub(crate) fn with(mut self, tag: u16, values: &[u16]) -> PageBytes {
        self.tags.insert(tag, Values::Short(values.to_vec()));
        self
    }

    pub(crate) fn with_text(mut self, text: impl AsRef<[u8]>) -> PageBytes {
        self.tags.insert(270, Values::Text([text.as_ref(), &[0]].concat()));
        self
    }

    pub(crate) fn with_resolution(mut self, x: u32, y: u32) -> PageBytes {
        self.tags.insert(282, Values::Fraction(x, 1));
        self.tags.insert(283, Values::Fraction(y, 1));
        self
    }

    /// Its strip as it comes out of a compressor.
    pub(crate) fn packed(self, compression: u16, pack: impl Fn(&[u8]) -> Vec<u8>) -> PageBytes {
        let chunks = self.chunks.iter().map(|chunk| pack(chunk)).collect();
        PageBytes { chunks, ..self.with(259, &[compression]) }
    }

    /// The same samples in tiles, those beyond the edges 0.
    pub(crate) fn tiled(mut self, page: [usize; 3], tile: [usize; 3], sample_bytes: usize) -> PageBytes {
        let samples = self.chunks.concat();
        self.tags.remove(&278);
        self = self.with(322, &[tile[0] as u16]).with(323, &[tile[1] as u16]).with(32998, &[tile[2] as u16]);
        let n = [0, 1, 2].map(|a| page[a].div_ceil(tile[a]));
        self.chunks = (0..n[0] * n[1] * n[2])
            .map(|t| {
                let first = [t % n[0] * tile[0], t / n[0] % n[1] * tile[1], t / (n[0] * n[1]) * tile[2]];
                let mut bytes = vec![];
                for i in 0..tile[0] * tile[1] * tile[2] {
                    let at = [i % tile[0], i / tile[0] % tile[1], i / (tile[0] * tile[1])];
                    let [x, y, z] = [0, 1, 2].map(|a| first[a] + at[a]);
                    let sample = ((z * page[1] + y) * page[0] + x) * sample_bytes;
                    let is_inside = x < page[0] && y < page[1] && z < page[2];
                    (0..sample_bytes).for_each(|b| bytes.push(if is_inside { samples[sample + b] } else { 0 }));
                }
                bytes
            })
            .collect();
        self
    }
}

/// A file of these pages: classic or big.
pub(crate) fn tiff_file(pages: &[PageBytes], order: ByteOrder, magic: u16) -> Vec<u8> {
    let mut out = Out { bytes: vec![], order, is_big: magic == 43 };
    out.bytes.extend(if order == Big { b"MM" } else { b"II" });
    out.number(magic.into(), 2);
    if out.is_big {
        out.number(8, 2);
        out.number(0, 2);
    }
    out.chain(pages);
    out.bytes
}

/// A little-endian classic file.
pub(crate) fn tiff(pages: &[PageBytes]) -> Vec<u8> {
    tiff_file(pages, Little, 42)
}

struct Out {
    bytes: Vec<u8>,
    order: ByteOrder,
    is_big: bool,
}

impl Out {
    fn number(&mut self, value: u64, n_bytes: usize) {
        match self.order {
            Little => self.bytes.extend(&value.to_le_bytes()[..n_bytes]),
            Big => self.bytes.extend(&value.to_be_bytes()[8 - n_bytes..]),
        }
    }

    fn offset_bytes(&self) -> usize {
        if self.is_big { 8 } else { 4 }
    }

    fn patch(&mut self, at: usize, value: u64) {
        let n = self.offset_bytes();
        let mut patch = Out { bytes: vec![], order: self.order, is_big: self.is_big };
        patch.number(value, n);
        self.bytes[at..at + n].copy_from_slice(&patch.bytes);
    }

    /// Pages, each with its samples in front, and the positions of their directories.
    fn chain(&mut self, pages: &[PageBytes]) {
        let mut link = self.bytes.len();
        self.number(0, self.offset_bytes());
        for page in pages {
            let start = self.page(page);
            self.patch(link, start);
            link = self.bytes.len() - self.offset_bytes();
        }
    }

    /// Samples, pages inside, values and the directory, which comes last.
    fn page(&mut self, page: &PageBytes) -> u64 {
        let mut tags = page.tags.clone();
        let starts: Vec<u64> = page.chunks.iter().map(|chunk| self.append(chunk)).collect();
        let lengths = page.chunks.iter().map(|chunk| chunk.len() as u64).collect();
        let is_tiled = tags.contains_key(&322);
        tags.entry(if is_tiled { 324 } else { 273 }).or_insert(Values::Long(starts));
        tags.entry(if is_tiled { 325 } else { 279 }).or_insert(Values::Long(lengths));
        if !page.levels.is_empty() {
            let levels = page.levels.iter().map(|level| self.page(level)).collect();
            tags.insert(330, Values::Long(levels));
        }
        let fields: Vec<_> = tags.iter().map(|(tag, values)| (*tag, self.values(values))).collect();
        let start = self.bytes.len() as u64;
        self.number(fields.len() as u64, if self.is_big { 8 } else { 2 });
        for (tag, (kind, n, field)) in fields {
            self.number(tag.into(), 2);
            self.number(kind, 2);
            self.number(n, self.offset_bytes());
            self.bytes.extend(field);
        }
        self.number(0, self.offset_bytes());
        start
    }

    fn append(&mut self, bytes: &[u8]) -> u64 {
        let start = self.bytes.len() as u64;
        self.bytes.extend(bytes);
        start
    }

    /// Kind, number of values, and the field: the values or where they lie.
    fn values(&mut self, values: &Values) -> (u64, u64, Vec<u8>) {
        let mut bytes = Out { bytes: vec![], order: self.order, is_big: self.is_big };
        let (kind, n) = match values {
            Values::Short(v) => {
                v.iter().for_each(|v| bytes.number((*v).into(), 2));
                (3, v.len())
            }
            Values::Long(v) => {
                v.iter().for_each(|v| bytes.number(*v, 4));
                (4, v.len())
            }
            Values::Text(v) => {
                bytes.bytes.extend(v);
                (2, v.len())
            }
            Values::Fraction(n, d) => {
                [n, d].into_iter().for_each(|v| bytes.number((*v).into(), 4));
                (5, 1)
            }
            Values::Double(v) => {
                v.iter().for_each(|v| bytes.number(v.to_bits(), 8));
                (12, v.len())
            }
        };
        let mut field = bytes.bytes;
        if field.len() > self.offset_bytes() {
            let start = self.append(&field);
            let mut position = Out { bytes: vec![], order: self.order, is_big: self.is_big };
            position.number(start, self.offset_bytes());
            field = position.bytes;
        }
        field.resize(self.offset_bytes(), 0);
        (kind, n as u64, field)
    }
}
