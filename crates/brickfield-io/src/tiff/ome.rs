//! OME-XML: the images of an OME-TIFF, and which page of which file is which plane (OME model 2016-06).

use std::collections::BTreeMap;

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use crate::ReadError;

/// What the document says.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct OmeXml {
    /// The name of the file in which the document stands, as others call it.
    pub(super) uuid: Option<String>,
    /// The file that has the metadata, where this document only refers to it.
    pub(super) metadata_file: Option<String>,
    pub(super) images: Vec<OmeImage>,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct OmeImage {
    pub(super) name: String,
    /// Numbers of slices, channels and points in time; SizeC counts the samples of pixels.
    pub(super) size_z: u64,
    size_c: u64,
    pub(super) size_t: u64,
    /// The axes between planes, the fastest first.
    order: [Axis; 3],
    /// Lengths along x, y, z and their units, as far as they are stated.
    pub(super) spacing: [Option<f64>; 3],
    pub(super) units: [Option<String>; 3],
    channels: Vec<OmeChannel>,
    data: Vec<TiffData>,
}

#[derive(Clone, Debug, Default, PartialEq)]
struct OmeChannel {
    name: Option<String>,
    n_samples: u64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Axis {
    #[default]
    Z,
    C,
    T,
}

/// A run of pages, and the plane that the first of them is.
#[derive(Clone, Debug, Default, PartialEq)]
struct TiffData {
    first: PlaneIndex,
    page: u64,
    /// How many; without it, all up to the next run.
    n_planes: Option<u64>,
    file: Option<FileRef>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PlaneIndex {
    pub(super) z: u64,
    pub(super) c: u64,
    pub(super) t: u64,
}

/// The file of a run of pages.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct FileRef {
    pub(super) name: Option<String>,
    pub(super) uuid: String,
}

/// The pages of one image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlaneTable {
    sizes: [u64; 3],
    order: [Axis; 3],
    /// From the number of a plane to the run that begins with it.
    runs: BTreeMap<u64, TiffData>,
}

/// The page of a plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct OmePage<'a> {
    pub(super) file: Option<&'a FileRef>,
    pub(super) page: u64,
}

/// More planes than this are not looked for.
const MAX_PLANES: u64 = 1 << 24;

impl OmeXml {
    pub(super) fn of_text(text: &str) -> Result<OmeXml, ReadError> {
        let mut reader = Reader::from_str(text.trim_start_matches('\u{feff}').trim());
        reader.config_mut().check_end_names = false;
        let mut document = OmeXml::default();
        let mut is_in_uuid = false;
        loop {
            match reader.read_event().map_err(|e| ReadError::decoder("the OME-XML", e))? {
                Event::Eof => return Ok(document),
                Event::Start(e) => {
                    document.enter(&e)?;
                    is_in_uuid = e.local_name().as_ref() == "UUID";
                }
                Event::Empty(e) => document.enter(&e)?,
                Event::End(_) => is_in_uuid = false,
                Event::Text(e) if is_in_uuid => {
                    if let Some(file) = document.last_data().and_then(|data| data.file.as_mut()) {
                        file.uuid = e.trim().to_owned();
                    }
                }
                _ => {}
            }
        }
    }

    /// The name of the file if the document names just one.
    pub(super) fn single_file(&self) -> Option<String> {
        let mut names = self.file_names();
        let first = names.next()?;
        names.all(|name| name == first).then(|| first.to_owned())
    }

    pub(super) fn names_several_files(&self) -> bool {
        self.file_names().next().is_some() && self.single_file().is_none()
    }

    fn file_names(&self) -> impl Iterator<Item = &str> {
        self.images.iter().flat_map(OmeImage::files).filter_map(|file| file.name.as_deref())
    }

    fn last_data(&mut self) -> Option<&mut TiffData> {
        self.images.last_mut()?.data.last_mut()
    }

    fn enter(&mut self, e: &BytesStart) -> Result<(), ReadError> {
        match e.local_name().as_ref() {
            "OME" => self.uuid = attribute(e, "UUID")?,
            "BinaryOnly" => {
                self.metadata_file = attribute(e, "MetadataFile")?;
                self.uuid = attribute(e, "UUID")?.or(self.uuid.take());
            }
            "Image" => {
                let name = attribute(e, "Name")?.or(attribute(e, "ID")?).unwrap_or_default();
                self.images.push(OmeImage { name, ..OmeImage::default() });
            }
            "Pixels" => {
                // Documents of before 2008 have several Pixels in an Image; the first counts.
                if let Some(image) = self.images.last_mut().filter(|image| image.size_z == 0) {
                    image.enter_pixels(e)?;
                }
            }
            "Channel" | "LogicalChannel" => {
                let n_samples = integer(e, "SamplesPerPixel")?.unwrap_or(1).max(1);
                let channel = OmeChannel { name: attribute(e, "Name")?, n_samples };
                self.images.last_mut().into_iter().for_each(|image| image.channels.push(channel.clone()));
            }
            "TiffData" => {
                let data = TiffData::of_element(e)?;
                self.images.last_mut().into_iter().for_each(|image| image.data.push(data.clone()));
            }
            "UUID" => {
                let file = FileRef { name: attribute(e, "FileName")?, uuid: String::new() };
                self.last_data().into_iter().for_each(|data| data.file = Some(file.clone()));
            }
            _ => {}
        }
        Ok(())
    }
}

impl OmeImage {
    fn enter_pixels(&mut self, e: &BytesStart) -> Result<(), ReadError> {
        let [z, c, t] = ["SizeZ", "SizeC", "SizeT"].map(|name| integer(e, name));
        let (z, c, t) = (z?.unwrap_or(1).max(1), c?.unwrap_or(1).max(1), t?.unwrap_or(1).max(1));
        let n_planes = z.saturating_mul(c).saturating_mul(t);
        if n_planes > MAX_PLANES {
            return Err(ReadError::field("number of planes", n_planes, format!("at most {MAX_PLANES}")));
        }
        (self.size_z, self.size_c, self.size_t) = (z, c, t);
        self.order = dimension_order(attribute(e, "DimensionOrder")?.as_deref().unwrap_or("XYZCT"))?;
        for (i, axis) in ["X", "Y", "Z"].into_iter().enumerate() {
            let length = attribute(e, &format!("PhysicalSize{axis}"))?.and_then(|v| v.trim().parse::<f64>().ok());
            self.spacing[i] = length.filter(|v| v.is_finite() && *v > 0.0);
            // The unit that the model takes where none is stated.
            let unit = attribute(e, &format!("PhysicalSize{axis}Unit"))?.unwrap_or_else(|| "um".to_owned());
            self.units[i] = self.spacing[i].map(|_| unit);
        }
        Ok(())
    }

    /// The number of channels, a pixel of several samples being one.
    pub(super) fn n_channels(&self, samples_per_pixel: u64) -> u64 {
        let n_samples = self.channels.iter().fold(0u64, |n, channel| n.saturating_add(channel.n_samples));
        match self.channels.len() as u64 {
            n if n > 0 && n_samples == self.size_c => n,
            _ if self.size_c.is_multiple_of(samples_per_pixel) => self.size_c / samples_per_pixel,
            _ => self.size_c,
        }
    }

    /// Names of the channels; none if they have no names.
    pub(super) fn channel_names(&self, n_channels: u64) -> Option<Vec<String>> {
        let is_named = self.channels.iter().any(|c| c.name.is_some()) && self.channels.len() as u64 == n_channels;
        let name = |(i, channel): (usize, &OmeChannel)| channel.name.clone().unwrap_or_else(|| i.to_string());
        is_named.then(|| self.channels.iter().enumerate().map(name).collect())
    }

    /// The pages of the planes. Without any run, pages are in order.
    pub(super) fn planes(&self, n_channels: u64) -> PlaneTable {
        let mut table =
            PlaneTable { sizes: [self.size_z, n_channels, self.size_t], order: self.order, runs: BTreeMap::new() };
        for data in &self.data {
            if data.n_planes != Some(0)
                && let Some(number) = table.number(data.first)
            {
                table.runs.insert(number, data.clone());
            }
        }
        if self.data.is_empty() {
            table.runs.insert(0, TiffData::default());
        }
        table
    }

    /// The files that the runs name.
    fn files(&self) -> impl Iterator<Item = &FileRef> {
        self.data.iter().filter_map(|data| data.file.as_ref())
    }
}

impl PlaneTable {
    /// The number of a plane in the order of the document; nothing for one that is out of range.
    fn number(&self, plane: PlaneIndex) -> Option<u64> {
        let (mut number, mut step) = (0, 1);
        for axis in self.order {
            let (i, n) = match axis {
                Axis::Z => (plane.z, self.sizes[0]),
                Axis::C => (plane.c, self.sizes[1]),
                Axis::T => (plane.t, self.sizes[2]),
            };
            if i >= n {
                return None;
            }
            number += step * i;
            step *= n;
        }
        Some(number)
    }

    /// The page of a plane; nothing where the file has none for it.
    pub(super) fn page(&self, plane: PlaneIndex) -> Option<OmePage<'_>> {
        let number = self.number(plane)?;
        let (first, run) = self.runs.range(..=number).next_back()?;
        let i = number - first;
        let is_inside = run.n_planes.is_none_or(|n| i < n);
        is_inside.then(|| OmePage { file: run.file.as_ref(), page: run.page.saturating_add(i) })
    }
}

impl TiffData {
    fn of_element(e: &BytesStart) -> Result<TiffData, ReadError> {
        let number = |name| integer(e, name).map(Option::unwrap_or_default);
        Ok(TiffData {
            first: PlaneIndex { z: number("FirstZ")?, c: number("FirstC")?, t: number("FirstT")? },
            page: number("IFD")?,
            n_planes: integer(e, "PlaneCount")?.or(integer(e, "NumPlanes")?),
            file: None,
        })
    }
}

/// The axes after X and Y.
fn dimension_order(text: &str) -> Result<[Axis; 3], ReadError> {
    let axis = |c: char| match c {
        'Z' => Some(Axis::Z),
        'C' => Some(Axis::C),
        'T' => Some(Axis::T),
        _ => None,
    };
    let axes: Option<Vec<Axis>> = text.strip_prefix("XY").and_then(|rest| rest.chars().map(axis).collect());
    let axes = axes.and_then(|axes| <[Axis; 3]>::try_from(axes).ok());
    let distinct = axes.filter(|[a, b, c]| a != b && b != c && a != c);
    distinct.ok_or_else(|| ReadError::field("DimensionOrder", text, "XY and then Z, C and T in any order"))
}

fn attribute(e: &BytesStart, name: &str) -> Result<Option<String>, ReadError> {
    let malformed = |source| ReadError::decoder(format!("attribute {name} of the OME-XML"), source);
    let Some(found) = e.try_get_attribute(name).map_err(|e| malformed(quick_xml::Error::from(e)))? else {
        return Ok(None);
    };
    let value = found.normalized_value(XmlVersion::Implicit1_0).map_err(malformed)?;
    Ok(Some(value.into_owned()))
}

fn integer(e: &BytesStart, name: &str) -> Result<Option<u64>, ReadError> {
    let Some(text) = attribute(e, name)? else { return Ok(None) };
    text.trim().parse().map(Some).map_err(|_| ReadError::field(name, text, "an integer of at least 0"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(pixels: &str, inside: &str) -> OmeImage {
        let text =
            format!("<OME:OME><OME:Image Name=\"a\"><OME:Pixels {pixels}>{inside}</OME:Pixels></OME:Image></OME:OME>");
        OmeXml::of_text(&text).unwrap().images.remove(0)
    }

    fn pages(table: &PlaneTable, n: u64) -> Vec<Option<u64>> {
        (0..n).map(|z| table.page(PlaneIndex { z, c: 0, t: 0 }).map(|p| p.page)).collect()
    }

    #[test]
    fn planes_without_runs_are_in_the_stated_order() {
        let image = image("DimensionOrder=\"XYCTZ\" SizeC=\"2\" SizeT=\"3\" SizeZ=\"5\" PhysicalSizeX=\"0.25\"", "");
        let table = image.planes(2);
        assert_eq!(pages(&table, 3), [Some(0), Some(6), Some(12)]);
        assert_eq!(table.page(PlaneIndex { z: 4, c: 1, t: 2 }).map(|p| p.page), Some(29));
        assert_eq!(table.page(PlaneIndex { z: 5, c: 0, t: 0 }), None);
        assert_eq!(image.spacing, [Some(0.25), None, None]);
        assert_eq!(image.units[0].as_deref(), Some("um"));
    }

    #[test]
    fn runs_without_a_count_go_on_to_the_next() {
        let data = "<TiffData IFD=\"7\"/><TiffData FirstZ=\"2\" IFD=\"1\" PlaneCount=\"1\"/><TiffData FirstZ=\"4\"/>";
        let table = image("SizeZ=\"6\"", data).planes(1);
        assert_eq!(pages(&table, 6), [Some(7), Some(8), Some(1), None, Some(0), Some(1)]);
    }

    #[test]
    fn files_and_channels_have_names() {
        let inside = "<Channel Name=\"DAPI\"/><Channel Name=\"GFP &amp; RFP\"/>\
                      <TiffData><UUID FileName=\"b.ome.tif\">urn:uuid:1</UUID></TiffData>";
        let image = image("SizeZ=\"2\" SizeC=\"2\"", inside);
        assert_eq!(image.channel_names(image.n_channels(1)).unwrap(), ["DAPI", "GFP & RFP"]);
        let file = FileRef { name: Some("b.ome.tif".to_owned()), uuid: "urn:uuid:1".to_owned() };
        assert_eq!(image.files().collect::<Vec<_>>(), [&file]);
    }

    #[test]
    fn samples_of_a_pixel_are_one_channel() {
        assert_eq!(image("SizeC=\"3\"", "<Channel SamplesPerPixel=\"3\"/>").n_channels(3), 1);
        assert_eq!(image("SizeC=\"6\"", "").n_channels(3), 2);
    }

    #[test]
    fn what_is_malformed_is_refused_on_one_line() {
        for text in ["<OME><Image", "<OME><Image><Pixels SizeZ=\"-1\"/></Image></OME>", "<OME a=\"1></OME>"] {
            assert!(!OmeXml::of_text(text).unwrap_err().to_string().contains('\n'));
        }
        let huge = "<OME><Image><Pixels SizeZ=\"4294967295\" SizeT=\"4294967295\"/></Image></OME>";
        assert!(OmeXml::of_text(huge).unwrap_err().to_string().contains("at most 16777216"));
        let order = "<OME><Image><Pixels DimensionOrder=\"XYZZT\"/></Image></OME>";
        assert!(OmeXml::of_text(order).is_err());
    }
}
