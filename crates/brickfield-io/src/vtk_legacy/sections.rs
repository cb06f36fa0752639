//! The sections of a legacy VTK file, one after the other: everything but the numbers, whose positions are noted.

use std::str::FromStr;

use brickfield_core::ScalarType;

use super::dataset::{Dataset, Wanted};
use super::types::{decoded, sample};
use crate::error::check_length;
use crate::files::{ByteSource, n_bytes_left};
use crate::lines::HeaderLines;
use crate::samples::skip_text;
use crate::stored::seek_forward;
use crate::vtk_arrays::{ImageGeometry, Support, VtkArray, VtkSample};
use crate::{Format, ReadError};

#[derive(Debug)]
pub(super) struct StoredArray {
    pub(super) about: VtkArray,
    pub(super) n_voxels: u64,
    pub(super) position: u64,
    /// Whether its numbers are shares of 255, from 0 to 1: bytes of colours as text.
    pub(super) are_shares: bool,
}

impl StoredArray {
    pub(super) fn what(&self) -> String {
        format!("array {:?}", self.about.name)
    }
}

pub(super) struct Sections {
    wanted: Wanted,
    pub(super) dataset: Dataset,
    /// X_COORDINATES, Y_COORDINATES and Z_COORDINATES, or POINTS.
    pub(super) points: Vec<StoredArray>,
    /// BLANKING: 0 for points that are left out.
    pub(super) blanking: Option<StoredArray>,
    pub(super) is_binary: bool,
    pub(super) geometry: ImageGeometry,
    pub(super) arrays: Vec<StoredArray>,
    has_dimensions: bool,
    /// POINT_DATA or CELL_DATA that the next arrays belong to, and how many there are.
    around: Option<(Support, u64)>,
}

impl Sections {
    pub(super) fn read(source: &mut dyn ByteSource, wanted: Wanted) -> Result<Sections, ReadError> {
        let first = HeaderLines::new(source).next_line()?.unwrap_or_default();
        if !first.starts_with("# vtk DataFile") {
            return Err(ReadError::wrong_start(Format::VtkLegacy, first.as_bytes(), "# vtk DataFile Version"));
        }
        let _title = HeaderLines::new(source).next_line()?;
        let storage = next_line(source)?.unwrap_or_default();
        let is_binary = match storage.to_ascii_lowercase().trim() {
            "ascii" => false,
            "binary" => true,
            _ => return Err(ReadError::field("line 3", storage, "ASCII or BINARY")),
        };
        let mut sections = Sections {
            wanted,
            dataset: Dataset::Image,
            points: Vec::new(),
            blanking: None,
            is_binary,
            geometry: ImageGeometry::default(),
            arrays: Vec::new(),
            has_dimensions: false,
            around: None,
        };
        while let Some(line) = next_line(source)? {
            sections.section(source, &line)?;
        }
        match sections.has_dimensions {
            true => Ok(sections),
            false => Err(ReadError::Missing { field: "DIMENSIONS" }),
        }
    }

    fn section(&mut self, source: &mut dyn ByteSource, line: &str) -> Result<(), ReadError> {
        let words = Words(line.split_whitespace().collect());
        match words.keyword().as_str() {
            "dataset" => self.enter_dataset(&words),
            "x_coordinates" | "y_coordinates" | "z_coordinates" => self.enter_points(source, &words, 1),
            "points" => self.enter_points(source, &words, 3),
            "blanking" => self.enter_blanking(source, &words),
            "dimensions" => self.enter_dimensions(&words),
            "extent" => {
                self.geometry.extent = words.numbers("EXTENT")?;
                self.has_dimensions = true;
                Ok(())
            }
            "origin" => words.numbers("ORIGIN").map(|origin| self.geometry.origin = origin),
            "spacing" | "aspect_ratio" => words.numbers("SPACING").map(|spacing| self.geometry.spacing = spacing),
            "point_data" => self.enter_data(Support::Points, &words),
            "cell_data" => self.enter_data(Support::Cells, &words),
            "metadata" => skip_metadata(source),
            "field" => self.read_field(source, &words),
            "lookup_table" => self.skip_table(source, &words),
            _ => self.read_attribute(source, &words),
        }
    }

    fn enter_dataset(&mut self, words: &Words) -> Result<(), ReadError> {
        self.dataset = Dataset::of_name(words.get(1), self.wanted)?;
        Ok(())
    }

    fn enter_points(&mut self, source: &mut dyn ByteSource, words: &Words, n_components: u64) -> Result<(), ReadError> {
        let n_points = words.number(1, "number of coordinates or POINTS")?;
        let about = array(words.get(0), words.get(2), Support::Points, n_components);
        let array = self.pass(source, about, n_points, false)?;
        self.points.push(array);
        Ok(())
    }

    fn enter_blanking(&mut self, source: &mut dyn ByteSource, words: &Words) -> Result<(), ReadError> {
        let n_points = words.number(1, "size of BLANKING")?;
        let about = array("BLANKING", words.get(2), Support::Points, 1);
        self.blanking = Some(self.pass(source, about, n_points, false)?);
        Ok(())
    }

    fn enter_dimensions(&mut self, words: &Words) -> Result<(), ReadError> {
        let [x, y, z] = words.numbers::<i64, 3>("DIMENSIONS")?.map(|n| n.saturating_sub(1));
        self.geometry.extent = [0, x, 0, y, 0, z];
        self.has_dimensions = true;
        Ok(())
    }

    fn enter_data(&mut self, support: Support, words: &Words) -> Result<(), ReadError> {
        self.around = Some((support, words.number(1, "size of POINT_DATA or CELL_DATA")?));
        Ok(())
    }

    /// An array of POINT_DATA or CELL_DATA: SCALARS, VECTORS, ...
    fn read_attribute(&mut self, source: &mut dyn ByteSource, words: &Words) -> Result<(), ReadError> {
        let keyword = words.keyword();
        let Some((support, n_voxels)) = self.around else {
            let supported = "before POINT_DATA and CELL_DATA, those of STRUCTURED_POINTS and grids are";
            return Err(ReadError::unsupported("section", words.get(0), supported));
        };
        let n_components: u64 = match keyword.as_str() {
            "scalars" if words.0.len() > 3 => words.number(3, "components of SCALARS")?,
            "scalars" | "global_ids" | "pedigree_ids" | "edge_flags" => 1,
            "color_scalars" => words.number(2, "components of COLOR_SCALARS")?,
            "vectors" | "normals" => 3,
            "tensors" => 9,
            "tensors6" => 6,
            "texture_coordinates" => words.number(2, "components of TEXTURE_COORDINATES")?,
            _ => {
                let supported = "SCALARS, COLOR_SCALARS, VECTORS, NORMALS, TENSORS, FIELD and the like are";
                return Err(ReadError::unsupported("section", words.get(0), supported));
            }
        };
        let are_colours = keyword == "color_scalars";
        let type_name = match keyword.as_str() {
            "color_scalars" => "unsigned_char",
            "texture_coordinates" => words.get(3),
            _ => words.get(2),
        };
        if keyword == "scalars" {
            check_table(source)?;
        }
        let has_active = self.arrays.iter().any(|a| a.about.is_active && a.about.support == support);
        let is_active = (keyword == "scalars" || are_colours) && !has_active;
        let about = array(words.get(1), type_name, support, n_components);
        let are_shares = are_colours && !self.is_binary;
        let array = self.pass(source, VtkArray { is_active, ..about }, n_voxels, are_shares)?;
        self.arrays.push(array);
        Ok(())
    }

    /// Arrays of any size; those before POINT_DATA and CELL_DATA are about the whole.
    fn read_field(&mut self, source: &mut dyn ByteSource, words: &Words) -> Result<(), ReadError> {
        let n_arrays: u64 = words.number(2, "number of FIELD arrays")?;
        for _ in 0..n_arrays {
            let line = loop {
                let line = next_line(source)?.ok_or(ReadError::Missing { field: "an array of FIELD" })?;
                match line.trim().eq_ignore_ascii_case("metadata") {
                    true => skip_metadata(source)?,
                    false => break line,
                }
            };
            let words = Words(line.split_whitespace().collect());
            let n_components = words.number(1, "components of a FIELD array")?;
            let n_voxels = words.number(2, "size of a FIELD array")?;
            let support = self.around.map_or(Support::Points, |(support, _)| support);
            let about = array(words.get(0), words.get(3), support, n_components);
            let array = self.pass(source, about, n_voxels, false)?;
            if self.around.is_some() {
                self.arrays.push(array);
            }
        }
        Ok(())
    }

    /// Notes where the array is, and passes over its numbers.
    fn pass(
        &self,
        source: &mut dyn ByteSource,
        about: VtkArray,
        n_voxels: u64,
        are_shares: bool,
    ) -> Result<StoredArray, ReadError> {
        let position = source.stream_position().map_err(|e| ReadError::io("the file", e))?;
        let array = StoredArray { about, n_voxels, position, are_shares };
        let n_samples = n_voxels.saturating_mul(array.about.n_components);
        self.skip(source, array.about.sample()?, n_samples, &array.what())?;
        Ok(array)
    }

    fn skip(
        &self,
        source: &mut dyn ByteSource,
        sample: VtkSample,
        n_samples: u64,
        what: &str,
    ) -> Result<(), ReadError> {
        match self.is_binary {
            true => {
                let n_bytes = sample.n_bytes(n_samples);
                check_length(what, n_bytes_left(source)?, n_bytes.into())?;
                seek_forward(source, n_bytes, what)
            }
            false => skip_text(source, usize::try_from(n_samples).unwrap_or(usize::MAX), what),
        }
    }

    /// A table of colours: four numbers each.
    fn skip_table(&self, source: &mut dyn ByteSource, words: &Words) -> Result<(), ReadError> {
        let n_colours: u64 = words.number(2, "size of LOOKUP_TABLE")?;
        self.skip(source, ScalarType::U8.into(), n_colours.saturating_mul(4), "LOOKUP_TABLE")
    }
}

fn array(name: &str, type_name: &str, support: Support, n_components: u64) -> VtkArray {
    VtkArray {
        name: decoded(name),
        type_name: type_name.to_owned(),
        sample: sample(type_name),
        support,
        n_components,
        component_names: Vec::new(),
        is_active: false,
    }
}

/// The line between SCALARS and their numbers.
fn check_table(source: &mut dyn ByteSource) -> Result<(), ReadError> {
    let line = next_line(source)?.unwrap_or_default();
    let words = Words(line.split_whitespace().collect());
    match words.keyword() == "lookup_table" {
        true => Ok(()),
        false => Err(ReadError::field("the line after SCALARS", line, "LOOKUP_TABLE and a name")),
    }
}

/// Information about an array ends with an empty line.
fn skip_metadata(source: &mut dyn ByteSource) -> Result<(), ReadError> {
    while HeaderLines::new(source).next_line()?.is_some_and(|line| !line.trim().is_empty()) {}
    Ok(())
}

/// The next line that is not empty.
fn next_line(source: &mut dyn ByteSource) -> Result<Option<String>, ReadError> {
    loop {
        match HeaderLines::new(source).next_line()? {
            Some(line) if line.trim().is_empty() => {}
            line => return Ok(line),
        }
    }
}

/// The words of a line; the first is its keyword.
struct Words<'a>(Vec<&'a str>);

impl Words<'_> {
    fn keyword(&self) -> String {
        self.get(0).to_ascii_lowercase()
    }

    /// The word, or nothing.
    fn get(&self, i: usize) -> &str {
        self.0.get(i).copied().unwrap_or_default()
    }

    fn number(&self, i: usize, field: &'static str) -> Result<u64, ReadError> {
        self.get(i).parse().map_err(|_| ReadError::field(field, self.get(i), "an integer of at least 0"))
    }

    /// The words after the keyword.
    fn numbers<T: FromStr, const N: usize>(&self, field: &'static str) -> Result<[T; N], ReadError> {
        let numbers: Option<Vec<T>> = self.0.iter().skip(1).map(|word| word.parse().ok()).collect();
        let numbers = numbers.and_then(|numbers| numbers.try_into().ok());
        numbers.ok_or_else(|| ReadError::field(field, self.0[1..].join(" "), format!("{N} numbers")))
    }
}
