//! Tiles of the Shuttle Radar Topography Mission, .hgt (USGS 2005, "SRTM Topography", SRTM_Topo.txt): elevations in metres
//! on one degree, each a big-endian integer of 16 bits, row by row from the north.

use std::io::{BufRead, Seek};
use std::path::Path;

use brickfield_core::glam::{DVec2, UVec2};
use brickfield_core::{NodeField, StructuredGrid};

use super::check_nodes;
use super::geographic::{GeoPlacement, Horizontal};
use crate::files::{ByteSource, n_bytes_left};
use crate::numbers::{FileScalar, with_room};
use crate::{ByteOrder, GridFormat, GridOptions, OpenedGrids, ReadError};

/// The south-western corner of a tile, in whole degrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct TileCorner {
    /// -180 to 179, positive to the east.
    pub longitude: i32,
    /// -90 to 89, positive to the north.
    pub latitude: i32,
}

impl TileCorner {
    /// The corner that the file's name begins with: `N00E010.hgt`, `s34w059.SRTMGL1.hgt`.
    ///
    /// # Errors
    /// Another name, or a corner that is not on Earth.
    pub fn of_name(path: &Path) -> Result<TileCorner, ReadError> {
        let name = path.file_name().map(|n| n.to_string_lossy().to_ascii_uppercase()).unwrap_or_default();
        let part = |from: usize, to: usize, signs: [char; 2]| {
            let text = name.get(from..to)?;
            let degrees = text.get(1..).filter(|t| t.bytes().all(|b| b.is_ascii_digit()))?.parse::<i32>().ok()?;
            match text.chars().next()? {
                sign if sign == signs[0] => Some(degrees),
                sign if sign == signs[1] => Some(-degrees),
                _ => None,
            }
        };
        let corner = part(0, 3, ['N', 'S']).zip(part(3, 7, ['E', 'W']));
        let on_earth =
            corner.filter(|(latitude, longitude)| (-90..90).contains(latitude) && (-180..180).contains(longitude));
        let expected = "the tile's south-western corner, S90 to N89 and W180 to E179, such as N00E010.hgt";
        let (latitude, longitude) = on_earth.ok_or_else(|| ReadError::field("name of the file", &name, expected))?;
        Ok(TileCorner { longitude, latitude })
    }
}

/// Samples along a side of a tile: of 3 and of 1 second of arc.
const SIDES: [u32; 2] = [1201, 3601];
/// A sample without a value.
const VOID: i16 = -32768;

/// Reads a tile whose corner is known. -32768 is a hole.
///
/// Node (0, 0) is the south-western one, i goes east and j north, so that the grid is right-handed with z up: the file's last
/// row is j = 0. Positions are metres east and north of the corner on a sphere of [`EARTH_RADIUS_M`](super::EARTH_RADIUS_M),
/// longitudes scaled by the cosine of the tile's middle latitude; their z is 0. The field is "elevation" in m.
///
/// # Errors
/// A length that is not one of 1201 x 1201 and 3601 x 3601 samples; a tile beyond the limits.
pub fn read(
    mut input: impl BufRead + Seek,
    corner: TileCorner,
    options: &GridOptions,
) -> Result<OpenedGrids, ReadError> {
    read_from(&mut input, corner, options)
}

fn read_from(source: &mut dyn ByteSource, corner: TileCorner, options: &GridOptions) -> Result<OpenedGrids, ReadError> {
    let n = side(n_bytes_left(source)?)?;
    let n_nodes = UVec2::splat(n);
    check_nodes(&[n_nodes.extend(1)], 5, 0, &options.limits)?;
    let degree = 1.0 / f64::from(n - 1);
    let first = DVec2::new(corner.longitude.into(), corner.latitude.into());
    let placement = GeoPlacement { n_nodes, first, steps: [DVec2::X * degree, DVec2::Y * degree] };
    let mut notes = Vec::new();
    let points = placement.points(Horizontal::Degrees, &mut notes)?;
    let (values, holes) = read_values(source, n as usize)?;
    let elevation = NodeField { name: "elevation".to_owned(), unit: Some("m".to_owned()), values };
    let grid = StructuredGrid::new(n_nodes.extend(1), points)?.with_field(elevation)?.with_holes(&holes)?;
    let unit = Some("m".to_owned());
    Ok(OpenedGrids { unit, notes, ..OpenedGrids::new(vec![grid], GridFormat::Hgt) })
}

fn side(n_bytes: u64) -> Result<u32, ReadError> {
    let length = |side: u32| 2 * u64::from(side) * u64::from(side);
    SIDES.into_iter().find(|side| length(*side) == n_bytes).ok_or_else(|| {
        let [small, large] = SIDES.map(|side| format!("{} ({side} x {side} samples)", length(side)));
        ReadError::field("number of bytes", n_bytes, format!("{small} or {large}"))
    })
}

/// Values and holes, the last row of the file first.
fn read_values(source: &mut dyn ByteSource, n: usize) -> Result<(Vec<f32>, Vec<bool>), ReadError> {
    let mut values: Vec<f32> = with_room(n * n)?;
    let mut holes: Vec<bool> = with_room(n * n)?;
    values.resize(n * n, 0.0);
    holes.resize(n * n, false);
    let (mut bytes, mut row) = (vec![0; 2 * n], Vec::with_capacity(n));
    for j in (0..n).rev() {
        source.read_exact(&mut bytes).map_err(|e| ReadError::io("the elevations", e))?;
        row.clear();
        i16::append(&bytes, ByteOrder::Big, &mut row);
        for (i, value) in row.iter().enumerate() {
            values[j * n + i] = f32::from(*value);
            holes[j * n + i] = *value == VOID;
        }
    }
    Ok((values, holes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_corners() {
        let corner = |name: &str| TileCorner::of_name(Path::new(name));
        assert_eq!(corner("a/N00E010.hgt").unwrap(), TileCorner { longitude: 10, latitude: 0 });
        assert_eq!(corner("s34w059.SRTMGL1.hgt").unwrap(), TileCorner { longitude: -59, latitude: -34 });
        for bad in ["tile.hgt", "N90E000.hgt", "N00E180.hgt", "N+1E010.hgt", "N0E010.hgt", "N0\u{e9}E010.hgt", ""] {
            let said = corner(bad).unwrap_err().to_string();
            assert!(said.starts_with("name of the file is ") && said.contains("N00E010.hgt"), "{said}");
        }
    }
}
