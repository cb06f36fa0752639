//! What the XML of a .vti or .pvti file says: everything but the numbers, whose positions are noted.

use brickfield_core::ScalarType;
use quick_xml::events::BytesStart;

use super::attributes::{attribute, integer, several};
use super::compressor::Compressor;
use super::metered::ends_within_document;
use crate::stored_type::StoredType;
use crate::vtk_arrays::{ImageGeometry, Support, VtkArray, VtkSample};
use crate::{ByteOrder, ReadError};

/// The bytes of the words that precede binary data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WordSize {
    Four,
    Eight,
}

/// How the numbers of an array are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ArrayStorage {
    Text,
    Base64,
    Raw,
}

#[derive(Clone, Debug)]
pub(super) struct Array {
    pub(super) about: VtkArray,
    format: String,
    /// Position of inline data in the file.
    position: u64,
    /// Position of appended data after the underscore.
    offset: u64,
}

/// What a document is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dataset {
    Image,
    Rectilinear,
    Structured,
}

impl Dataset {
    /// The name of a structured grid in files; an image has none here.
    pub(super) fn name_of_grid(self) -> Option<&'static str> {
        match self {
            Dataset::Image => None,
            Dataset::Rectilinear => Some("RectilinearGrid"),
            Dataset::Structured => Some("StructuredGrid"),
        }
    }
}

/// What the arrays inside an element are.
#[derive(Clone, Debug)]
pub(super) enum Around {
    /// Values; the name of the active scalars.
    Data(Support, Option<String>),
    /// Where the points of a grid lie.
    Geometry,
}

/// A box of the image, in this file or in another one.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// First and last point along x, y, z.
    pub(super) extent: [i64; 6],
    pub(super) arrays: Vec<Array>,
    /// Arrays of Points or Coordinates.
    pub(super) geometry: Vec<Array>,
    /// The file that holds it (.pvti).
    pub(super) source: Option<String>,
}

#[derive(Clone, Debug)]
pub(super) struct Document {
    pub(super) dataset: Dataset,
    pub(super) order: ByteOrder,
    pub(super) word: WordSize,
    pub(super) compressor: Option<Compressor>,
    /// Whether its pieces are other files (.pvti).
    pub(super) is_parallel: bool,
    /// The whole image.
    pub(super) geometry: ImageGeometry,
    pub(super) pieces: Vec<Piece>,
    /// The arrays that all pieces of a .pvti have.
    declared: Vec<Array>,
    pub(super) appended: Option<(ArrayStorage, u64)>,
    /// The element around an array.
    pub(super) around: Option<Around>,
    /// The length of a file that ends before its root element does.
    pub(super) cut_off_at: Option<u64>,
}

impl Document {
    /// The error of a part that is not there, or would have been if the file went on.
    pub(super) fn missing(&self, field: &'static str) -> ReadError {
        match self.cut_off_at {
            None => ReadError::Missing { field },
            Some(n_file_bytes) => ends_within_document(n_file_bytes),
        }
    }

    /// The arrays of the image: those of its first piece that has any.
    pub(super) fn arrays(&self) -> Vec<&VtkArray> {
        let of_piece = self.pieces.iter().map(|piece| &piece.arrays).find(|arrays| !arrays.is_empty());
        let arrays = if self.is_parallel { Some(&self.declared) } else { of_piece };
        arrays.into_iter().flatten().map(|array| &array.about).collect()
    }

    pub(super) fn storage(&self, array: &Array) -> Result<ArrayStorage, ReadError> {
        match (array.format.as_str(), self.appended) {
            ("ascii", _) => Ok(ArrayStorage::Text),
            ("binary", _) => Ok(ArrayStorage::Base64),
            ("appended", Some((storage, _))) => Ok(storage),
            ("appended", None) => Err(self.missing("the element AppendedData")),
            (other, _) => Err(ReadError::unsupported("DataArray format", other, "ascii, binary and appended are")),
        }
    }

    /// Where the array's numbers begin.
    pub(super) fn position(&self, array: &Array) -> Result<u64, ReadError> {
        match (array.format.as_str(), self.appended) {
            ("appended", Some((_, start))) => start
                .checked_add(array.offset)
                .filter(|p| *p <= i64::MAX as u64)
                .ok_or_else(|| ReadError::field("offset", array.offset, "a position in the file")),
            _ => Ok(array.position),
        }
    }

    pub(super) fn of_root(e: &BytesStart) -> Result<Document, ReadError> {
        let kind = attribute(e, "type")?.unwrap_or_default();
        let dataset = match kind.as_str() {
            "ImageData" | "PImageData" => Dataset::Image,
            "RectilinearGrid" => Dataset::Rectilinear,
            "StructuredGrid" => Dataset::Structured,
            "PRectilinearGrid" | "PStructuredGrid" => {
                return Err(ReadError::unsupported("VTKFile type", kind, "the grids that it names are, one by one"));
            }
            _ => return Err(ReadError::unsupported("VTKFile type", kind, "ImageData and PImageData are")),
        };
        let order = match attribute(e, "byte_order")?.as_deref() {
            Some("LittleEndian") | None => ByteOrder::Little,
            Some("BigEndian") => ByteOrder::Big,
            Some(other) => return Err(ReadError::field("byte_order", other, "LittleEndian or BigEndian")),
        };
        let word = match attribute(e, "header_type")?.as_deref() {
            Some("UInt32") | None => WordSize::Four,
            Some("UInt64") => WordSize::Eight,
            Some(other) => return Err(ReadError::field("header_type", other, "UInt32 or UInt64")),
        };
        Ok(Document {
            dataset,
            order,
            word,
            compressor: attribute(e, "compressor")?.as_deref().map_or(Ok(None), Compressor::named)?,
            is_parallel: kind == "PImageData",
            geometry: ImageGeometry::default(),
            pieces: Vec::new(),
            declared: Vec::new(),
            appended: None,
            around: None,
            cut_off_at: None,
        })
    }

    pub(super) fn enter_image(&mut self, e: &BytesStart) -> Result<(), ReadError> {
        let geometry = &mut self.geometry;
        geometry.extent = several(e, "WholeExtent")?.ok_or(ReadError::Missing { field: "WholeExtent" })?;
        geometry.origin = several(e, "Origin")?.unwrap_or(geometry.origin);
        geometry.spacing = several(e, "Spacing")?.unwrap_or(geometry.spacing);
        geometry.direction = several(e, "Direction")?.unwrap_or(geometry.direction);
        Ok(())
    }

    pub(super) fn enter_piece(&mut self, e: &BytesStart) -> Result<(), ReadError> {
        let extent = several(e, "Extent")?.unwrap_or(self.geometry.extent);
        self.pieces.push(Piece { extent, arrays: Vec::new(), geometry: Vec::new(), source: attribute(e, "Source")? });
        Ok(())
    }

    pub(super) fn enter_array(&mut self, e: &BytesStart, position: u64) -> Result<(), ReadError> {
        let (arrays, support, active) = match (&self.around, self.pieces.last_mut()) {
            (Some(Around::Data(support, active)), Some(piece)) => (&mut piece.arrays, *support, active.as_ref()),
            (Some(Around::Data(support, active)), None) => (&mut self.declared, *support, active.as_ref()),
            (Some(Around::Geometry), Some(piece)) => (&mut piece.geometry, Support::Points, None),
            _ => return Ok(()),
        };
        let (name, type_name) = (attribute(e, "Name")?.unwrap_or_default(), attribute(e, "type")?.unwrap_or_default());
        let n_components = integer(e, "NumberOfComponents")?.unwrap_or(1);
        let about = VtkArray {
            sample: sample(&type_name),
            support,
            n_components,
            component_names: component_names(e, n_components)?,
            is_active: active == Some(&name),
            name,
            type_name,
        };
        arrays.push(Array {
            about,
            format: attribute(e, "format")?.unwrap_or_else(|| "ascii".to_owned()),
            position,
            offset: integer(e, "offset")?.unwrap_or(0),
        });
        Ok(())
    }
}

fn sample(type_name: &str) -> Option<VtkSample> {
    Some(match type_name {
        "Bit" => VtkSample::Bit,
        "UInt8" => ScalarType::U8.into(),
        "Int8" => ScalarType::I8.into(),
        "UInt16" => ScalarType::U16.into(),
        "Int16" => ScalarType::I16.into(),
        "UInt32" => ScalarType::U32.into(),
        "Int32" => ScalarType::I32.into(),
        "Float32" => ScalarType::F32.into(),
        "Float64" => ScalarType::F64.into(),
        "Int64" => VtkSample::Bytes(StoredType::I64),
        "UInt64" => VtkSample::Bytes(StoredType::U64),
        _ => return None,
    })
}

/// The names of all components, or none.
fn component_names(e: &BytesStart, n_components: u64) -> Result<Vec<String>, ReadError> {
    const KEYS: [&str; 9] = [
        "ComponentName0",
        "ComponentName1",
        "ComponentName2",
        "ComponentName3",
        "ComponentName4",
        "ComponentName5",
        "ComponentName6",
        "ComponentName7",
        "ComponentName8",
    ];
    let mut names = Vec::new();
    for key in KEYS.iter().take(n_components.min(KEYS.len() as u64) as usize) {
        let Some(name) = attribute(e, key)? else { return Ok(Vec::new()) };
        names.push(name);
    }
    Ok(names)
}
