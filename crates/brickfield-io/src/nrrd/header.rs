//! The fields of an NRRD header.

use std::collections::BTreeMap;

use brickfield_core::ScalarType;

use crate::error::{Shown, counted};
use crate::file_list::FileNames;
use crate::files::ByteSource;
use crate::limits::n_samples;
use crate::lines::{HeaderLines, numbers};
use crate::stored::{ByteSkip, Encoding, StoredSamples};
use crate::stored_type::StoredType;
use crate::{ByteOrder, Format, ReadError};

#[derive(Default)]
/// Field names are in lower case and without spaces, so that "data file" and "datafile" are one.
pub(super) struct NrrdHeader {
    fields: BTreeMap<String, String>,
    /// Key/value pairs, as they are written.
    keys: BTreeMap<String, String>,
    data_files: Vec<String>,
    /// Samples along each axis of the file, fastest first.
    pub(super) sizes: Vec<u64>,
    pub(super) n_samples: u128,
}

const MAX_AXES: usize = 16;

impl NrrdHeader {
    /// Reads the header; the source is then at the first byte of attached data.
    pub(super) fn read(source: &mut dyn ByteSource) -> Result<NrrdHeader, ReadError> {
        let mut lines = HeaderLines::new(source);
        check_magic(&lines.next_line()?.unwrap_or_default())?;
        let mut header = NrrdHeader::default();
        while let Some(line) = lines.next_line()? {
            if line.is_empty() {
                break;
            }
            header.add(&line);
            if header.text("datafile").is_some_and(|v| v.split_whitespace().next() == Some("LIST")) {
                header.data_files = lines.rest()?;
                break;
            }
        }
        header.sizes = header.read_sizes()?;
        header.n_samples = n_samples("sizes", &header.sizes)?;
        Ok(header)
    }

    /// Comments, and lines that have neither a field nor a key, are passed over.
    fn add(&mut self, line: &str) {
        if line.starts_with('#') {
            return;
        }
        if let Some((key, value)) = line.split_once(":=") {
            self.keys.insert(key.to_owned(), value.to_owned());
        } else if let Some((name, value)) = line.split_once(':') {
            let name = name.to_ascii_lowercase().replace(' ', "");
            self.fields.insert(name, value.trim().to_owned());
        }
    }

    pub(super) fn text(&self, name: &str) -> Option<&str> {
        self.fields.get(name).map(String::as_str)
    }

    pub(super) fn key(&self, name: &str) -> Option<&str> {
        self.keys.get(name).map(String::as_str)
    }

    pub(super) fn kind(&self, axis: usize) -> Option<&str> {
        self.text("kinds")?.split_whitespace().nth(axis)
    }

    fn required(&self, name: &str, field: &'static str) -> Result<&str, ReadError> {
        self.text(name).ok_or(ReadError::Missing { field })
    }

    fn read_sizes(&self) -> Result<Vec<u64>, ReadError> {
        let dimension = self.required("dimension", "dimension")?;
        let expected = || format!("1 to {MAX_AXES}");
        let n_axes: usize = dimension.parse().map_err(|_| ReadError::field("dimension", dimension, expected()))?;
        if !(1..=MAX_AXES).contains(&n_axes) {
            return Err(ReadError::field("dimension", n_axes, expected()));
        }
        let text = self.required("sizes", "sizes")?;
        let sizes = numbers::<u64>("sizes", text)?;
        if sizes.len() != n_axes {
            return Err(ReadError::field(
                "sizes",
                text,
                format!("{}, one per axis", counted(n_axes, "number", "numbers")),
            ));
        }
        if sizes.contains(&0) {
            return Err(ReadError::field("sizes", text, "numbers of at least 1"));
        }
        Ok(sizes)
    }

    pub(super) fn stored_type(&self) -> Result<StoredType, ReadError> {
        let name = self.required("type", "type")?.to_ascii_lowercase();
        let scalar = match name.as_str() {
            "signed char" | "int8" | "int8_t" => ScalarType::I8,
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => ScalarType::U8,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => ScalarType::I16,
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => ScalarType::U16,
            "int" | "signed int" | "int32" | "int32_t" => ScalarType::I32,
            "uint" | "unsigned int" | "uint32" | "uint32_t" => ScalarType::U32,
            "float" => ScalarType::F32,
            "double" => ScalarType::F64,
            "longlong"
            | "long long"
            | "long long int"
            | "signed long long"
            | "signed long long int"
            | "int64"
            | "int64_t" => return Ok(StoredType::I64),
            "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => {
                return Ok(StoredType::U64);
            }
            _ => return Err(ReadError::unsupported("type", name, crate::STORED_TYPES)),
        };
        Ok(scalar.into())
    }

    pub(super) fn stored(&self, stored: StoredType) -> Result<StoredSamples, ReadError> {
        let encoding = self.encoding()?;
        let order = match self.text("endian").map(str::to_ascii_lowercase).as_deref() {
            Some("little") => ByteOrder::Little,
            Some("big") => ByteOrder::Big,
            Some(other) => return Err(ReadError::field("endian", other, "little or big")),
            None if stored.n_bytes() == 1 || encoding == Encoding::Text => ByteOrder::Little,
            None => return Err(ReadError::Missing { field: "endian" }),
        };
        Ok(StoredSamples { encoding, order, line_skip: self.line_skip()?, byte_skip: self.byte_skip()? })
    }

    fn encoding(&self) -> Result<Encoding, ReadError> {
        let name = self.required("encoding", "encoding")?.to_ascii_lowercase();
        match name.as_str() {
            "raw" => Ok(Encoding::Raw),
            "txt" | "text" | "ascii" => Ok(Encoding::Text),
            #[cfg(feature = "gzip")]
            "gz" | "gzip" => Ok(Encoding::Deflate),
            #[cfg(not(feature = "gzip"))]
            "gz" | "gzip" => Err(ReadError::FeatureOff { format: Format::Nrrd, feature: "gzip" }),
            _ => Err(ReadError::unsupported("encoding", name, "raw, ascii and gzip are")),
        }
    }

    fn line_skip(&self) -> Result<u64, ReadError> {
        let Some(text) = self.text("lineskip") else { return Ok(0) };
        text.parse().map_err(|_| ReadError::field("line skip", text, "an integer of at least 0"))
    }

    fn byte_skip(&self) -> Result<ByteSkip, ReadError> {
        match self.text("byteskip") {
            None => Ok(ByteSkip::Bytes(0)),
            Some("-1") => Ok(ByteSkip::ToFitEnd),
            Some(text) => text
                .parse()
                .map(ByteSkip::Bytes)
                .map_err(|_| ReadError::field("byte skip", text, "an integer of at least -1")),
        }
    }

    /// The detached data files, or nothing if the data are attached.
    pub(super) fn file_names(&self) -> Result<Option<FileNames>, ReadError> {
        let Some(text) = self.text("datafile") else { return Ok(None) };
        let words: Vec<&str> = text.split_whitespace().collect();
        let (names, subdim) = match *words.as_slice() {
            ["LIST"] => (FileNames::List(self.data_files.clone()), None),
            ["LIST", subdim] => (FileNames::List(self.data_files.clone()), Some(subdim)),
            [pattern, a, b, c] if pattern.contains('%') => (FileNames::numbered(pattern, [a, b, c])?, None),
            [pattern, a, b, c, subdim] if pattern.contains('%') => {
                (FileNames::numbered(pattern, [a, b, c])?, Some(subdim))
            }
            _ => (FileNames::One(text.to_owned()), None),
        };
        if let Some(subdim) = subdim {
            self.check_subdim(subdim, &names)?;
        }
        Ok(Some(names))
    }

    /// Files of fewer axes than the volume must be as many as the remaining axes have entries.
    fn check_subdim(&self, text: &str, names: &FileNames) -> Result<(), ReadError> {
        let expected = || format!("1 to the dimension {}", self.sizes.len());
        let subdim: usize = text.parse().map_err(|_| ReadError::field("data file subdim", text, expected()))?;
        if !(1..=self.sizes.len()).contains(&subdim) {
            return Err(ReadError::field("data file subdim", text, expected()));
        }
        let n_expected = self.sizes[subdim..].iter().fold(1u128, |n, s| n.saturating_mul(u128::from(*s)));
        if subdim < self.sizes.len() && names.n_files() != n_expected {
            let expected = format!("{n_expected} (files of {})", counted(subdim, "axis", "axes"));
            return Err(ReadError::field("number of data files", names.n_files(), expected));
        }
        Ok(())
    }
}

fn check_magic(line: &str) -> Result<(), ReadError> {
    match line.strip_prefix("NRRD00") {
        Some(version) if version.len() == 2 && version.bytes().all(|b| b.is_ascii_digit()) => Ok(()),
        _ => Err(ReadError::WrongMagic {
            format: Format::Nrrd,
            what: "the first line",
            found: Shown::of_bytes(line.as_bytes()),
            expected: "NRRD0001 to NRRD0005",
        }),
    }
}
