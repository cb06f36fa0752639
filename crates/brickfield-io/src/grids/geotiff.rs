//! GeoTIFF of one band, elevations (OGC 19-008r4, "GeoTIFF Standard", 1.1): integers or floats, in strips or tiles, with the
//! compressions of [`tiff`](crate::tiff). Not: several bands, masks, angles other than degrees.

use std::io::{BufRead, Seek};

use brickfield_core::glam::{DVec2, UVec2};
use brickfield_core::{NodeField, Scalar, ScalarType, StructuredGrid, with_voxels};

use super::{GeoPlacement, Horizontal};
use crate::files::ByteSource;
use crate::guard::guarded;
use crate::numbers::with_room;
use crate::tiff::{Elevations, GeoTags};
use crate::{GridFormat, GridNote, GridOptions, OpenedGrids, ReadError};

/// Reads elevations with their place.
///
/// Node rows are turned over where the file's run from north to south, so that the grid is right-handed with z up; node
/// (0, 0) is the south-western one of most files. A node lies at the middle of its pixel, or at its corner where the file has
/// `RasterPixelIsPoint`. Projected positions are the file's, in its unit ("m", "ft", "US survey ft"); degrees become metres as
/// those of [`hgt`](super::hgt::read). The field is "elevation", its unit that of the vertical coordinates, if stated. Samples
/// that equal `GDAL_NODATA` are holes, and those of strips or tiles that are not stored.
///
/// # Errors
/// As [`ReadError`] lists them: no place, or one that is no plane map; several pages or bands; samples beyond the limits.
pub fn read(mut input: impl BufRead + Seek, options: &GridOptions) -> Result<OpenedGrids, ReadError> {
    guarded("TIFF", || read_from(&mut input, options))
}

fn read_from(source: &mut dyn ByteSource, options: &GridOptions) -> Result<OpenedGrids, ReadError> {
    let elevations = Elevations::open(source)?;
    let keys = GeoKeys::read(&elevations.tags)?;
    let (n_nodes, mut notes) = (elevations.n_nodes(), Vec::new());
    let map = PixelMap::read(&elevations.tags, keys.pixel_is_point)?;
    let (placement, rows) = map.placement(n_nodes);
    let points = placement.points(keys.horizontal, &mut notes)?;
    let no_data = no_data(&elevations.tags)?;
    let band = elevations.read(&options.limits)?;
    if band.n_missing > 0 {
        notes.push(GridNote::MissingChunks { n_missing: band.n_missing, n_chunks: band.n_chunks });
    }
    let (values, mut holes) = with_voxels!(&band.samples, samples => nodes(samples, n_nodes, rows, no_data))?;
    for (j, row) in band.missing.chunks_exact(n_nodes.x as usize).enumerate() {
        let start = rows.node_row(j, n_nodes) * n_nodes.x as usize;
        holes[start..].iter_mut().zip(row).for_each(|(hole, is_missing)| *hole |= is_missing);
    }
    let elevation = NodeField { name: "elevation".to_owned(), unit: keys.vertical_unit, values };
    let grid = StructuredGrid::new(n_nodes.extend(1), points)?.with_field(elevation)?.with_holes(&holes)?;
    let unit = keys.unit;
    Ok(OpenedGrids { unit, notes, ..OpenedGrids::new(vec![grid], GridFormat::GeoTiff) })
}

/// The keys that are used of the directory of GeoTIFF.
struct GeoKeys {
    horizontal: Horizontal,
    unit: Option<String>,
    vertical_unit: Option<String>,
    pixel_is_point: bool,
}

mod key {
    pub(super) const MODEL_TYPE: u64 = 1024;
    pub(super) const RASTER_TYPE: u64 = 1025;
    pub(super) const ANGULAR_UNITS: u64 = 2054;
    pub(super) const LINEAR_UNITS: u64 = 3076;
    pub(super) const VERTICAL_UNITS: u64 = 4099;
}

const DEGREE: u64 = 9102;

impl GeoKeys {
    fn read(tags: &GeoTags) -> Result<GeoKeys, ReadError> {
        // Four numbers of a header, then four of each key: its name, where its value is (0: here), how many, the value.
        let entries = tags.geo_keys.get(4..).unwrap_or_default();
        let key = |name| entries.chunks_exact(4).find(|e| e[0] == name && e[1] == 0).map(|e| e[3]);
        let horizontal = match key(key::MODEL_TYPE) {
            Some(1) | None => Horizontal::Lengths,
            Some(2) => Horizontal::Degrees,
            Some(other) => {
                let supported = "1 (projected) and 2 (geographic) are";
                return Err(ReadError::unsupported("GTModelTypeGeoKey", other, supported));
            }
        };
        if let (Horizontal::Degrees, Some(unit)) = (horizontal, key(key::ANGULAR_UNITS).filter(|u| *u != DEGREE)) {
            return Err(ReadError::unsupported("GeogAngularUnitsGeoKey", unit, "9102 (degrees) is"));
        }
        let unit = match horizontal {
            Horizontal::Degrees => Some("m".to_owned()),
            Horizontal::Lengths => key(key::LINEAR_UNITS).map(unit_of_code),
        };
        Ok(GeoKeys {
            horizontal,
            unit,
            vertical_unit: key(key::VERTICAL_UNITS).map(unit_of_code),
            pixel_is_point: key(key::RASTER_TYPE) == Some(2),
        })
    }
}

/// The name of a unit of length, else its code in EPSG's list.
fn unit_of_code(code: u64) -> String {
    match code {
        9001 => "m".to_owned(),
        9002 => "ft".to_owned(),
        9003 => "US survey ft".to_owned(),
        code => format!("EPSG unit {code}"),
    }
}

/// From columns and rows of samples to positions: first + column * steps\[0\] + row * steps\[1\].
#[derive(Clone, Copy, Debug)]
struct PixelMap {
    first: DVec2,
    steps: [DVec2; 2],
}

/// The order of node rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rows {
    AsStored,
    TurnedOver,
}

impl Rows {
    /// The row of nodes of a row of samples, and the other way round.
    fn node_row(self, row: usize, n_nodes: UVec2) -> usize {
        match self {
            Rows::AsStored => row,
            Rows::TurnedOver => n_nodes.y as usize - 1 - row,
        }
    }
}

impl PixelMap {
    fn read(tags: &GeoTags, pixel_is_point: bool) -> Result<PixelMap, ReadError> {
        let GeoTags { pixel_scale, tiepoints, transformation, .. } = tags;
        let corner = match (&pixel_scale[..], &tiepoints[..], &transformation[..]) {
            (_, _, [a, b, _, x, c, d, _, y, ..]) if transformation.len() == 16 => {
                PixelMap { first: DVec2::new(*x, *y), steps: [DVec2::new(*a, *c), DVec2::new(*b, *d)] }
            }
            ([sx, sy, ..], [i, j, _, x, y, _, ..], _) => {
                PixelMap { first: DVec2::new(x - i * sx, y + j * sy), steps: [DVec2::X * *sx, DVec2::Y * -sy] }
            }
            _ => {
                return Err(ReadError::Missing {
                    field: "the place of a GeoTIFF (ModelPixelScale with ModelTiepoint, or ModelTransformation)",
                });
            }
        };
        let area = corner.steps[0].perp_dot(corner.steps[1]);
        let is_usable = area.is_finite() && area != 0.0 && corner.first.is_finite();
        if !is_usable {
            let [i, j] = corner.steps;
            let value = format!("{i} and {j} from {}", corner.first);
            return Err(ReadError::field("steps of a pixel", value, "two directions of finite lengths above 0"));
        }
        let to_sample = if pixel_is_point { 0.0 } else { 0.5 };
        Ok(PixelMap { first: corner.first + to_sample * (corner.steps[0] + corner.steps[1]), ..corner })
    }

    fn placement(self, n_nodes: UVec2) -> (GeoPlacement, Rows) {
        let PixelMap { first, steps: [i, j] } = self;
        match i.perp_dot(j) > 0.0 {
            true => (GeoPlacement { n_nodes, first, steps: [i, j] }, Rows::AsStored),
            false => {
                let first = first + j * f64::from(n_nodes.y - 1);
                (GeoPlacement { n_nodes, first, steps: [i, -j] }, Rows::TurnedOver)
            }
        }
    }
}

fn no_data(tags: &GeoTags) -> Result<Option<f64>, ReadError> {
    let Some(text) = tags.no_data.as_deref().map(str::trim).filter(|text| !text.is_empty()) else { return Ok(None) };
    text.parse().map(Some).map_err(|_| ReadError::field("GDAL_NODATA", text, "a number"))
}

/// Values and holes, in the order of nodes.
fn nodes<T: Scalar>(
    samples: &[T],
    n_nodes: UVec2,
    rows: Rows,
    no_data: Option<f64>,
) -> Result<(Vec<f32>, Vec<bool>), ReadError> {
    let mut values = with_room(samples.len())?;
    let mut holes = with_room(samples.len())?;
    // The text of a float is rounded as the samples are; no integer is -0.5, and no u8 is -9999.
    let is_float = matches!(T::TYPE, ScalarType::F32 | ScalarType::F64);
    let rounded = no_data.map(|value| (value, T::from_f64(value).to_f64()));
    let no_data = rounded.filter(|(value, rounded)| is_float || value == rounded).map(|(_, rounded)| rounded);
    for j in 0..n_nodes.y as usize {
        let row = rows.node_row(j, n_nodes);
        for sample in &samples[row * n_nodes.x as usize..][..n_nodes.x as usize] {
            let value = sample.to_f64();
            values.push(value as f32);
            holes.push(no_data == Some(value));
        }
    }
    Ok((values, holes))
}
