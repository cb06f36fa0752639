//! MetaImage, .mha and .mhd (MetaIO documentation, itk.org/Wiki/ITK/MetaIO/Documentation).
//!
//! Data LOCAL, in one file, a LIST or a pattern; binary, zlib and text; both byte orders; HeaderSize. Of several values
//! per voxel, and of a series, one is read. CenterOfRotation is ignored, as ITK does.

mod write;

use write::UNITS;
pub use write::{save, write};

use std::collections::BTreeMap;
use std::io::{BufRead, Seek};

use brickfield_core::glam::DVec3;
use brickfield_core::{Rescale, ScalarType};

use crate::choice::Entries;
use crate::colour::Colours;
use crate::detached::Promised;
use crate::error::{Shown, counted};
use crate::file_list::FileNames;
use crate::files::ByteSource;
use crate::length_unit::unit_among;
use crate::limits::{CheckedShape, n_samples};
use crate::lines::{HeaderLines, numbers};
use crate::opened::FileFacts;
use crate::placement::{AXES, GridPlacement, usable_spacing};
use crate::series::{OuterAxis, choose_volume};
use crate::slices::{SamplesAt, StoredVolume};
use crate::stored::{ByteSkip, Encoding, StoredSamples};
use crate::stored_type::StoredType;
use crate::stored_voxel::{MAX_COMPONENTS, StoredVoxel};
use crate::{ByteOrder, ChoiceKind, DataFiles, Format, Note, OpenOptions, Opened, ReadError, WorldFrame};

/// Reads a MetaImage from its header on; `files` finds detached data.
///
/// The world is the file's own. It is [`WorldFrame::Lps`] if the header has an AnatomicalOrientation, for that is what
/// ITK takes it to be, unless a key of our own (`brickfield_frame`) says otherwise. `Offset` is the first sample's centre; row i of TransformMatrix is the direction of axis i.
///
/// # Errors
/// As [`ReadError`] lists them: a header that is wrong, unsupported or beyond the limits; data that are missing.
pub fn read(mut input: impl BufRead + Seek, files: &dyn DataFiles, options: &OpenOptions) -> Result<Opened, ReadError> {
    read_from(&mut input, files, options)
}

fn read_from(source: &mut dyn ByteSource, files: &dyn DataFiles, options: &OpenOptions) -> Result<Opened, ReadError> {
    described(source, options)?.read(source, files)
}

/// The volume of the header; the source is then at the first byte of local data.
pub(crate) fn described(source: &mut dyn ByteSource, options: &OpenOptions) -> Result<StoredVolume, ReadError> {
    let header = MetaHeader::read(source)?;
    let stored = header.stored()?;
    let mut found = FileFacts::plain(Format::MetaImage, options);
    let voxel = header.voxel(&mut found)?;
    let n_before = header.n_volumes_before(&mut found)?;
    let shape = CheckedShape::claim(header.volume_dims(), voxel, &options.limits)?;
    let grid = header.placement(&mut found.notes)?.grid(shape.dims)?;
    let n_before = n_before * shape.n_voxels() as u128;
    let promised = Promised { n_voxels: n_samples("DimSize", &header.sizes)?, n_before };
    (found.frame, found.unit) = (header.frame(), header.unit());
    let place = header.data.map_or(SamplesAt::Here("the data after the header"), SamplesAt::Files);
    Ok(StoredVolume { found, grid, rescale: Rescale::IDENTITY, shape, stored, promised, place })
}

struct MetaHeader {
    fields: BTreeMap<String, String>,
    sizes: Vec<u64>,
    /// Nothing if the data follow the header.
    data: Option<FileNames>,
}

const MAX_AXES: usize = 10;

/// Keys with which a MetaImage header begins, in lower case.
const FIRST_KEYS: [&str; 8] =
    ["objecttype", "ndims", "comment", "name", "id", "objectsubtype", "transformtype", "binarydata"];

/// Whether this is how a MetaImage begins: a known key, then `=`; or any keys up to one that is in every MetaImage.
pub(crate) fn has_magic(head: &[u8]) -> bool {
    for (i, line) in head.split(|b| *b == b'\n').enumerate() {
        let line = String::from_utf8_lossy(line);
        let Some((key, separator, _)) = parted(&line) else { return false };
        match key.as_str() {
            "objecttype" | "ndims" => return true,
            key if i == 0 && separator == '=' && FIRST_KEYS.contains(&key) => return true,
            _ => {}
        }
    }
    false
}

/// Key in lower case, separator and value of a line: `Key = value` or `Key: value`.
fn parted(line: &str) -> Option<(String, char, &str)> {
    let at = line.find(['=', ':'])?;
    let key = line[..at].trim().to_ascii_lowercase();
    let is_key =
        !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.' | '|'));
    is_key.then(|| (key, if line[at..].starts_with('=') { '=' } else { ':' }, line[at + 1..].trim()))
}

impl MetaHeader {
    /// Reads up to ElementDataFile; the source is then at the first byte of local data.
    fn read(source: &mut dyn ByteSource) -> Result<MetaHeader, ReadError> {
        let mut lines = HeaderLines::new(source);
        let mut fields = BTreeMap::new();
        let mut is_first = true;
        while let Some(line) = lines.next_line()? {
            let is_first = std::mem::take(&mut is_first);
            let Some((key, _, value)) = parted(&line) else {
                if is_first {
                    return Err(wrong_magic(&line));
                }
                continue;
            };
            if key == "elementdatafile" {
                let sizes = read_sizes(&fields)?;
                let data = file_names(value, &sizes, &mut lines)?;
                return Ok(MetaHeader { fields, sizes, data });
            }
            fields.insert(key, value.to_owned());
        }
        Err(ReadError::Missing { field: "ElementDataFile" })
    }

    fn text(&self, keys: &[&str]) -> Option<&str> {
        keys.iter().find_map(|key| self.fields.get(*key)).map(String::as_str)
    }

    fn is_true(&self, keys: &[&str]) -> bool {
        self.text(keys).is_some_and(|v| matches!(v.as_bytes(), [b'T' | b't' | b'1' | b'Y' | b'y', ..]))
    }

    fn stored_type(&self) -> Result<StoredType, ReadError> {
        let name = self.text(&["elementtype"]).ok_or(ReadError::Missing { field: "ElementType" })?;
        let scalar = match name {
            "MET_UCHAR" => ScalarType::U8,
            "MET_CHAR" => ScalarType::I8,
            "MET_USHORT" => ScalarType::U16,
            "MET_SHORT" => ScalarType::I16,
            "MET_UINT" | "MET_ULONG" => ScalarType::U32,
            "MET_INT" | "MET_LONG" => ScalarType::I32,
            "MET_FLOAT" => ScalarType::F32,
            "MET_DOUBLE" => ScalarType::F64,
            "MET_LONG_LONG" => return Ok(StoredType::I64),
            "MET_ULONG_LONG" => return Ok(StoredType::U64),
            _ => return Err(ReadError::unsupported("ElementType", name, crate::STORED_TYPES)),
        };
        Ok(scalar.into())
    }

    fn stored(&self) -> Result<StoredSamples, ReadError> {
        let order = match self.is_true(&["binarydatabyteordermsb", "elementbyteordermsb"]) {
            true => ByteOrder::Big,
            false => ByteOrder::Little,
        };
        let byte_skip = match self.text(&["headersize"]) {
            None => ByteSkip::Bytes(0),
            Some("-1") => ByteSkip::ToFitEnd,
            Some(text) => text
                .parse()
                .map(ByteSkip::Bytes)
                .map_err(|_| ReadError::field("HeaderSize", text, "an integer of at least -1"))?,
        };
        Ok(StoredSamples { encoding: self.encoding()?, order, line_skip: 0, byte_skip })
    }

    fn encoding(&self) -> Result<Encoding, ReadError> {
        match (
            self.text(&["binarydata"]).is_some() && !self.is_true(&["binarydata"]),
            self.is_true(&["compresseddata"]),
        ) {
            (true, _) => Ok(Encoding::Text),
            (false, false) => Ok(Encoding::Raw),
            #[cfg(feature = "gzip")]
            (false, true) => Ok(Encoding::Deflate),
            #[cfg(not(feature = "gzip"))]
            (false, true) => Err(ReadError::FeatureOff { format: Format::MetaImage, feature: "gzip" }),
        }
    }

    /// Three or four unsigned numbers are colours, others are components.
    fn voxel(&self, found: &mut FileFacts) -> Result<StoredVoxel, ReadError> {
        let stored = self.stored_type()?;
        let text = self.text(&["elementnumberofchannels"]).unwrap_or("1");
        let bad = || ReadError::field("ElementNumberOfChannels", text, format!("1 to {MAX_COMPONENTS}"));
        let n_components: u64 = text.parse().ok().filter(|n| (1..=MAX_COMPONENTS).contains(n)).ok_or_else(bad)?;
        let is_colour = matches!(stored, StoredType::Scalar(ScalarType::U8 | ScalarType::U16));
        match Colours::of_channels(n_components).filter(|_| is_colour) {
            _ if n_components == 1 => Ok(stored.into()),
            Some(colours) => StoredVoxel::of_colours(stored, colours, found),
            None => StoredVoxel::of_components(stored, ChoiceKind::Channel, Entries::Numbered(n_components), found),
        }
    }

    fn volume_dims(&self) -> [u64; 3] {
        [0, 1, 2].map(|axis| self.sizes.get(axis).copied().unwrap_or(1))
    }

    /// The fourth axis is time.
    fn n_volumes_before(&self, found: &mut FileFacts) -> Result<u128, ReadError> {
        let outer = self.sizes.iter().enumerate().skip(3).map(|(axis, n_entries)| OuterAxis {
            name: axis.to_string(),
            n_entries: *n_entries,
            kind: (axis == 3).then_some(ChoiceKind::Time),
        });
        choose_volume(outer.collect(), found)
    }

    fn placement(&self, notes: &mut Vec<Note>) -> Result<GridPlacement, ReadError> {
        let n_axes = self.sizes.len();
        let spacing = self.numbers(&["elementspacing", "elementsize"], "ElementSpacing", n_axes)?;
        let offset = self.numbers(&["offset", "origin", "position"], "Offset", n_axes)?.unwrap_or_default();
        let matrix =
            self.numbers(&["transformmatrix", "orientation", "rotation"], "TransformMatrix", n_axes * n_axes)?;
        let steps = (0..n_axes.min(3)).map(|axis| {
            let length = spacing.as_ref().map_or(1.0, |s| usable_spacing(s[axis], AXES[axis], notes));
            let direction = matrix.as_ref().map_or(DVec3::AXES[axis], |m| vector(&m[axis * n_axes..][..n_axes]));
            direction * length
        });
        let steps: Vec<DVec3> = steps.collect();
        Ok(GridPlacement::from_axes(&steps, vector(&offset)))
    }

    fn numbers(&self, keys: &[&str], field: &'static str, n: usize) -> Result<Option<Vec<f64>>, ReadError> {
        let Some(text) = self.text(keys) else { return Ok(None) };
        let values = numbers::<f64>(field, text)?;
        match values.len() == n {
            true => Ok(Some(values)),
            false => Err(ReadError::field(field, text, counted(n, "number", "numbers"))),
        }
    }

    fn unit(&self) -> Option<String> {
        unit_among(self.text(&["distanceunits"])?, &UNITS).map(str::to_owned)
    }

    fn frame(&self) -> WorldFrame {
        let stated = self.text(&[WorldFrame::KEY]).and_then(WorldFrame::of_name);
        stated.unwrap_or_else(|| match self.text(&["anatomicalorientation"]) {
            Some(text) if !text.contains('?') && !text.is_empty() => WorldFrame::Lps,
            _ => WorldFrame::Plain,
        })
    }
}

/// Up to three components; missing ones are 0.
fn vector(components: &[f64]) -> DVec3 {
    let at = |i: usize| components.get(i).copied().unwrap_or(0.0);
    DVec3::new(at(0), at(1), at(2))
}

fn wrong_magic(line: &str) -> ReadError {
    ReadError::WrongMagic {
        format: Format::MetaImage,
        what: "the first line",
        found: Shown::new(line),
        expected: "a key such as ObjectType or NDims, and =",
    }
}

fn read_sizes(fields: &BTreeMap<String, String>) -> Result<Vec<u64>, ReadError> {
    let n_axes = fields.get("ndims").ok_or(ReadError::Missing { field: "NDims" })?;
    let expected = || format!("1 to {MAX_AXES}");
    let n: usize = n_axes.parse().map_err(|_| ReadError::field("NDims", n_axes, expected()))?;
    if !(1..=MAX_AXES).contains(&n) {
        return Err(ReadError::field("NDims", n_axes, expected()));
    }
    let text = fields.get("dimsize").ok_or(ReadError::Missing { field: "DimSize" })?;
    let sizes = numbers::<u64>("DimSize", text)?;
    if sizes.len() != n || sizes.contains(&0) {
        return Err(ReadError::field("DimSize", text, format!("{} of at least 1", counted(n, "number", "numbers"))));
    }
    Ok(sizes)
}

/// The value of ElementDataFile; after LIST, the names follow line by line.
fn file_names(value: &str, sizes: &[u64], lines: &mut HeaderLines) -> Result<Option<FileNames>, ReadError> {
    let words: Vec<&str> = value.split_whitespace().collect();
    Ok(Some(match *words.as_slice() {
        [] => return Err(ReadError::field("ElementDataFile", value, "LOCAL, LIST, a pattern or a file name")),
        ["LOCAL" | "Local" | "local"] => return Ok(None),
        ["LIST", ..] => FileNames::List(lines.rest()?),
        [pattern, first, last, step] if pattern.contains('%') => FileNames::numbered(pattern, [first, last, step])?,
        [pattern, first, last] if pattern.contains('%') => FileNames::numbered(pattern, [first, last, "1"])?,
        [pattern] if pattern.contains('%') => {
            let last = sizes.last().copied().unwrap_or(1).to_string();
            FileNames::numbered(pattern, ["1", &last, "1"])?
        }
        _ => FileNames::One(value.to_owned()),
    }))
}
