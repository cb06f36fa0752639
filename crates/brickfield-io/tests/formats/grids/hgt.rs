//! Tiles of SRTM, whose rows come from the north.

use std::io::Cursor;

use brickfield_core::GridPoints;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_io::grids::EARTH_RADIUS_M;
use brickfield_io::grids::hgt::{self, TileCorner};
use brickfield_io::{GridOptions, OpenedGrids, ReadError};
use proptest::prelude::*;

fn tile(side: u32, sample: impl Fn(u32, u32) -> i16) -> Vec<u8> {
    (0..side)
        .flat_map(|row| (0..side).map(move |column| (row, column)))
        .flat_map(|(r, c)| sample(r, c).to_be_bytes())
        .collect()
}

fn read(bytes: &[u8], latitude: i32) -> Result<OpenedGrids, ReadError> {
    hgt::read(Cursor::new(bytes), TileCorner { longitude: -60, latitude }, &GridOptions::default())
}

#[test]
fn rows_come_from_the_north() {
    for side in [1201, 3601] {
        let bytes = tile(side, |row, column| ((7 * row + column) % 30_000) as i16);
        let opened = read(&bytes, 59).unwrap();
        let grid = &opened.grids[0];
        assert_eq!((grid.n_nodes(), grid.holes()), (UVec3::new(side, side, 1), None));
        let value = |i, j| grid.fields()[0].values[grid.number(UVec3::new(i, j, 0))];
        let last = side - 1;
        assert_eq!(value(0, last), 0.0);
        assert_eq!(value(last, last), last as f32);
        assert_eq!(value(3, 0), ((7 * last + 3) % 30_000) as f32);
        let north_east = grid.position(UVec3::new(last, last, 0));
        let degree = EARTH_RADIUS_M.to_radians();
        assert!((north_east.y - degree).abs() < 1e-6);
        assert!((north_east.x - degree * 59.5f64.to_radians().cos()).abs() < 1e-6);
        let GridPoints::Even { origin, steps: [i, j, k] } = grid.points() else { panic!("not even") };
        assert_eq!(*origin, DVec3::ZERO);
        assert!(i.cross(*j).dot(*k) > 0.0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]
    #[test]
    fn any_samples_come_back(seed in 0..u64::MAX, latitude in -90..90) {
        // Multiplicative hashing: about one of 16 is a void.
        let sample = |row: u32, column: u32| {
            let hash = (u64::from(row) << 32 | u64::from(column)).wrapping_add(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            if hash >> 60 == 0 { i16::MIN } else { (hash >> 20) as i16 }
        };
        let opened = read(&tile(1201, sample), latitude).unwrap();
        let grid = &opened.grids[0];
        for row in 0..1201 {
            for column in 0..1201 {
                let number = grid.number(UVec3::new(column, 1200 - row, 0));
                let stored = sample(row, column);
                prop_assert_eq!(grid.holes().unwrap()[number], stored == i16::MIN);
                prop_assert_eq!(grid.fields()[0].values[number], f32::from(stored));
            }
        }
    }
}

#[test]
fn another_length_and_a_limit_are_named() {
    let said = |bytes: &[u8]| read(bytes, 0).unwrap_err().to_string();
    let expected = "expected 2884802 (1201 x 1201 samples) or 25934402 (3601 x 3601 samples)";
    assert_eq!(said(&[0; 100]), format!("number of bytes is \"100\"; {expected}"));
    assert_eq!(said(&vec![0; 2_884_801]), format!("number of bytes is \"2884801\"; {expected}"));
    let mut options = GridOptions::default();
    options.limits.max_bytes = 1_000_000;
    let corner = TileCorner { longitude: 0, latitude: 0 };
    let limited = hgt::read(Cursor::new(vec![0; 2_884_802]), corner, &options).unwrap_err().to_string();
    assert_eq!(limited, "a grid of 1201 x 1201 x 1 nodes would take 7212005 bytes; the limit is 1000000 bytes");
}
