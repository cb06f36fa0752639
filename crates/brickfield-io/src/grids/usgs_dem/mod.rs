//! USGS Digital Elevation Models as text, .dem (USGS 1998, "Standards for Digital Elevation Models", part 2).
//!
//! Records of 1024 bytes: one of type A about the whole, one or more of type B for each profile, one of type C that is not
//! needed. A profile runs from south to north; profiles begin and end where they please:
//!
//! ```text
//! row 3    . o o o        o  a sample
//! row 2    o o o o        .  a hole
//! row 1    o o o .
//! row 0    o o . .        profiles 0 to 3, from west to east
//! ```

mod records;

use std::io::{BufRead, Seek};

use brickfield_core::glam::{DVec2, UVec2};
use brickfield_core::{NodeField, StructuredGrid};

use super::geographic::{GeoPlacement, Horizontal};
use super::{check_nodes, checked_nodes};
use crate::files::{ByteSource, n_bytes_left};
use crate::numbers::with_room;
use crate::{GridFormat, GridOptions, OpenedGrids, ReadError};
pub(crate) use records::has_record_a;
use records::{Profile, RecordA, Records};

/// Reads a model of regular profiles.
///
/// Node (0, 0) is the south-western one, i goes east and j north, so that the grid is right-handed with z up. Positions are
/// eastings and northings in the file's unit, metres or feet; seconds of arc become metres as those of
/// [`hgt`](super::hgt::read). Their z is 0. The field is "elevation" in the file's unit. Nodes outside of profiles, and voids
/// (-32767 and below), are holes.
///
/// # Errors
/// A record that is wrong or missing; profiles that do not lie on the grid of the stated resolution; other patterns and
/// units, and turned models; grids beyond the limits, or of more nodes than the file has bytes.
pub fn read(mut input: impl BufRead + Seek, options: &GridOptions) -> Result<OpenedGrids, ReadError> {
    read_from(&mut input, options)
}

fn read_from(source: &mut dyn ByteSource, options: &GridOptions) -> Result<OpenedGrids, ReadError> {
    let n_file_bytes = n_bytes_left(source)?;
    let mut records = Records::new(source, n_file_bytes);
    let about = RecordA::read(&mut records)?;
    let mut profiles = Vec::new();
    for i in 0..about.n_profiles {
        profiles.push(records.profile(i, about.n_profiles)?);
    }
    let rows = Rows::of(&profiles, &about, n_file_bytes)?;
    check_nodes(&[rows.n_nodes.extend(1)], 5, 0, &options.limits)?;
    let (values, holes) = place(&mut records, &profiles, &about, &rows)?;
    finish(&about, &rows, values, &holes)
}

/// The grid around all profiles.
struct Rows {
    n_nodes: UVec2,
    south_west: DVec2,
}

impl Rows {
    fn of(profiles: &[Profile], about: &RecordA, n_file_bytes: u64) -> Result<Rows, ReadError> {
        let south = profiles.iter().map(|p| p.start.y).fold(f64::INFINITY, f64::min);
        let mut n_rows = 0;
        for (i, profile) in profiles.iter().enumerate() {
            let row = steps(south, profile.start.y, about.resolution.y)
                .ok_or_else(|| off_grid("northing", i, profile.start.y, south, about.resolution.y))?;
            n_rows = n_rows.max(row.saturating_add(profile.n_samples));
        }
        let n_nodes = checked_nodes([about.n_profiles, n_rows, 1])?.truncate();
        if u64::from(n_nodes.x) * u64::from(n_nodes.y) > n_file_bytes {
            let value = format!("{} profiles of {} rows", n_nodes.x, n_nodes.y);
            return Err(ReadError::field(
                "grid around all profiles",
                value,
                format!("at most {n_file_bytes} nodes, the file's bytes"),
            ));
        }
        Ok(Rows { n_nodes, south_west: DVec2::new(profiles[0].start.x, south) })
    }
}

/// Whole steps from the first to another coordinate, a quarter of a step aside at most.
fn steps(first: f64, other: f64, step: f64) -> Option<u64> {
    let n = (other - first) / step;
    let is_near = (n - n.round()).abs() <= 0.25 && (-0.25..9e15).contains(&n);
    is_near.then(|| n.round() as u64)
}

fn off_grid(what: &str, i: usize, value: f64, first: f64, step: f64) -> ReadError {
    ReadError::field(format!("{what} of profile {}", i + 1), value, format!("{first} and whole steps of {step}"))
}

/// Values and holes: each profile in its column, from its row on.
fn place(
    records: &mut Records,
    profiles: &[Profile],
    about: &RecordA,
    rows: &Rows,
) -> Result<(Vec<f32>, Vec<bool>), ReadError> {
    let [nx, ny] = rows.n_nodes.to_array().map(|n| n as usize);
    let mut values: Vec<f32> = with_room(nx * ny)?;
    let mut holes: Vec<bool> = with_room(nx * ny)?;
    values.resize(nx * ny, 0.0);
    holes.resize(nx * ny, true);
    for (i, profile) in profiles.iter().enumerate() {
        let (first, step) = (rows.south_west, about.resolution);
        if steps(first.x, profile.start.x, step.x) != Some(i as u64) {
            let expected = format!("{}", first.x + step.x * i as f64);
            return Err(ReadError::field(format!("easting of profile {}", i + 1), profile.start.x, expected));
        }
        let row = steps(first.y, profile.start.y, step.y).unwrap_or(0) as usize;
        records.samples(i, profile, &mut |k, sample| {
            let at = (row + k) * nx + i;
            if sample > VOID {
                values[at] = (f64::from(sample) * about.elevation_step + profile.datum) as f32;
                holes[at] = false;
            }
        })?;
    }
    Ok((values, holes))
}

/// Greater samples have a value.
const VOID: i32 = -32767;

fn finish(about: &RecordA, rows: &Rows, values: Vec<f32>, holes: &[bool]) -> Result<OpenedGrids, ReadError> {
    let (scale, unit) = match about.horizontal {
        // Seconds of arc.
        Horizontal::Degrees => (1.0 / 3600.0, "m"),
        Horizontal::Lengths => (1.0, about.unit),
    };
    let placement = GeoPlacement {
        n_nodes: rows.n_nodes,
        first: rows.south_west * scale,
        steps: [DVec2::X * about.resolution.x * scale, DVec2::Y * about.resolution.y * scale],
    };
    let mut notes = Vec::new();
    let points = placement.points(about.horizontal, &mut notes)?;
    let elevation = NodeField { name: "elevation".to_owned(), unit: Some(about.elevation_unit.to_owned()), values };
    let grid = StructuredGrid::new(rows.n_nodes.extend(1), points)?.with_field(elevation)?.with_holes(holes)?;
    let unit = Some(unit.to_owned());
    Ok(OpenedGrids { unit, notes, ..OpenedGrids::new(vec![grid], GridFormat::UsgsDem) })
}
