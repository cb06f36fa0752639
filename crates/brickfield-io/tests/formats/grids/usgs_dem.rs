//! USGS DEM: profiles from south to north, each from a row of its own.

use std::io::Cursor;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{GridPoints, StructuredGrid};
use brickfield_io::grids::{EARTH_RADIUS_M, usgs_dem};
use brickfield_io::{GridNote, OpenedGrids, ReadError};
use proptest::prelude::*;

use super::{Example, options};

/// What a record of type A says.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Model {
    pub(crate) reference: i32,
    pub(crate) unit: i32,
    pub(crate) elevation_unit: i32,
    pub(crate) start: [f64; 2],
    pub(crate) resolution: [f64; 3],
}

/// Metres of UTM, every 30.
pub(crate) const UTM: Model =
    Model { reference: 1, unit: 2, elevation_unit: 2, start: [557_820.0, 5_108_010.0], resolution: [30.0, 30.0, 1.0] };

/// A number as Fortran writes it.
fn real(x: f64, width: usize) -> String {
    let text = format!("{x:.12e}").replace('e', "D+0");
    format!("{text:>width$}").replace("D+0-", "D-0")
}

impl Model {
    /// Profiles: their first rows, and their samples.
    pub(crate) fn file(&self, profiles: &[(u32, Vec<i32>)]) -> Vec<u8> {
        let mut a = format!("{:144}{:6}{:6}{:6}{:6}", "A MODEL", 1, 1, self.reference, 10);
        (0..15).for_each(|_| a += &real(0.0, 24));
        a += &format!("{:6}{:6}{:6}", self.unit, self.elevation_unit, 4);
        (0..8 + 2 + 1).for_each(|_| a += &real(0.0, 24));
        a += &format!("{:6}", 1);
        self.resolution.iter().for_each(|x| a += &format!("{:>12}", format!("{x:.5E}")));
        a += &format!("{:6}{:6}", 1, profiles.len());
        assert_eq!(a.len(), 864);
        let mut out = format!("{a:1024}");
        for (i, (row, samples)) in profiles.iter().enumerate() {
            out += &self.profile(i, *row, samples);
        }
        out.into_bytes()
    }

    fn profile(&self, i: usize, row: u32, samples: &[i32]) -> String {
        let mut out = format!("{:6}{:6}{:6}{:6}", 1, i + 1, samples.len(), 1);
        out += &real(self.start[0] + self.resolution[0] * i as f64, 24);
        out += &real(self.start[1] + self.resolution[1] * f64::from(row), 24);
        (0..3).for_each(|_| out += &real(0.0, 24));
        let (first, rest) = samples.split_at(samples.len().min(146));
        let text = |samples: &[i32]| samples.iter().map(|s| format!("{s:6}")).collect::<String>();
        out = format!("{:1024}", out + &text(first));
        rest.chunks(170).for_each(|samples| out += &format!("{:1024}", text(samples)));
        out
    }
}

pub(crate) fn read(bytes: &[u8]) -> Result<OpenedGrids, ReadError> {
    usgs_dem::read(Cursor::new(bytes), &options())
}

pub(crate) fn examples() -> Vec<Example> {
    let long = (0..400).collect::<Vec<i32>>();
    let bytes = UTM.file(&[(3, vec![5, 6, 7]), (0, long), (1, vec![-32767, 8])]);
    vec![Example { name: "v.dem", bytes, read }]
}

/// The value of a node, `None` for a hole.
fn at(grid: &StructuredGrid, i: u32, j: u32) -> Option<f32> {
    let number = grid.number(UVec3::new(i, j, 0));
    let is_hole = grid.holes().is_some_and(|holes| holes[number]);
    (!is_hole).then(|| grid.fields()[0].values[number])
}

#[test]
fn profiles_begin_where_they_please() {
    let opened = read(&UTM.file(&[(2, vec![20, 30]), (1, vec![11, 21, 31]), (4, vec![42, -32767])])).unwrap();
    let grid = &opened.grids[0];
    assert_eq!(grid.n_nodes(), UVec3::new(3, 5, 1));
    // The lowest profile begins one row above the model's start.
    let origin = DVec3::new(557_820.0, 5_108_040.0, 0.0);
    let steps = [DVec3::X * 30.0, DVec3::Y * 30.0, DVec3::Z];
    assert_eq!(*grid.points(), GridPoints::Even { origin, steps });
    let column = |i| [0, 1, 2, 3, 4].map(|j| at(grid, i, j));
    assert_eq!(column(0), [None, Some(20.0), Some(30.0), None, None]);
    assert_eq!(column(1), [Some(11.0), Some(21.0), Some(31.0), None, None]);
    assert_eq!(column(2), [None, None, None, Some(42.0), None]);
    assert_eq!((opened.unit.as_deref(), grid.fields()[0].unit.as_deref()), (Some("m"), Some("m")));
}

#[test]
fn feet_and_tenths_are_kept() {
    let feet = Model { unit: 1, elevation_unit: 1, resolution: [20.0, 10.0, 0.1], reference: 2, ..UTM };
    let opened = read(&feet.file(&[(0, vec![5, -15])])).unwrap();
    let grid = &opened.grids[0];
    assert_eq!((opened.unit.as_deref(), grid.fields()[0].unit.as_deref()), (Some("ft"), Some("ft")));
    assert_eq!([at(grid, 0, 0), at(grid, 0, 1)], [Some(0.5), Some(-1.5)]);
}

#[test]
fn seconds_of_arc_become_metres() {
    let start = [-122.0 * 3600.0, 46.0 * 3600.0];
    let seconds = Model { reference: 0, unit: 3, resolution: [3.0, 3.0, 1.0], start, ..UTM };
    let opened = read(&seconds.file(&[(0, vec![1, 2, 3]), (0, vec![4, 5, 6])])).unwrap();
    let GridPoints::Even { origin, steps: [i, j, _] } = opened.grids[0].points() else { panic!("not even") };
    let north = EARTH_RADIUS_M.to_radians() * 3.0 / 3600.0;
    assert_eq!(*origin, DVec3::ZERO);
    assert!((j.y - north).abs() < 1e-6 && (i.x - north * (46.0 + 3.0 / 3600.0f64).to_radians().cos()).abs() < 1e-6);
    let [GridNote::Degrees { west, south, .. }] = opened.notes[..] else { panic!("{:?}", opened.notes) };
    assert!((west + 122.0).abs() < 1e-9 && (south - 46.0).abs() < 1e-9);
}

proptest! {
    #[test]
    fn any_profiles_come_back(
        profiles in prop::collection::vec((0..9u32, prop::collection::vec(-9999..99999i32, 1..500)), 1..6)
    ) {
        let opened = read(&UTM.file(&profiles)).unwrap();
        let grid = &opened.grids[0];
        let south = profiles.iter().map(|p| p.0).min().unwrap();
        let north = profiles.iter().map(|p| p.0 + p.1.len() as u32).max().unwrap();
        prop_assert_eq!(grid.n_nodes(), UVec3::new(profiles.len() as u32, north - south, 1));
        for (i, (row, samples)) in profiles.iter().enumerate() {
            for j in 0..north - south {
                let sample = (south + j).checked_sub(*row).and_then(|k| samples.get(k as usize));
                prop_assert_eq!(at(grid, i as u32, j), sample.map(|s| *s as f32));
            }
        }
    }
}
