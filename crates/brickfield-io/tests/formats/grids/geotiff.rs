//! GeoTIFF: samples of every type, and their places.

use std::io::Cursor;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{GridPoints, ScalarType, Voxels};
use brickfield_io::grids::{EARTH_RADIUS_M, geotiff};
use brickfield_io::{ByteOrder, GridNote, OpenedGrids, ReadError};
use proptest::prelude::*;

use super::{Example, options};
use crate::common::{ORDERS, bytes, ramp, zlib};
use crate::tiff_bytes::{PageBytes, Values, tiff, tiff_file};

const UTM_POINT: [u64; 16] = [1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 2, 3076, 0, 1, 9003];
const UTM_AREA: [u64; 12] = [1, 1, 0, 2, 1024, 0, 1, 1, 3076, 0, 1, 9001];
const DEGREES: [u64; 12] = [1, 1, 0, 2, 1024, 0, 1, 2, 4099, 0, 1, 9001];

fn with(mut page: PageBytes, tag: u16, values: Values) -> PageBytes {
    page.tags.insert(tag, values);
    page
}

fn with_keys(page: PageBytes, keys: &[u64]) -> PageBytes {
    with(page, 34735, Values::Short(keys.iter().map(|key| *key as u16).collect()))
}

/// Pixels of 10 x 20, the corner of the first one at (500, 900).
fn placed(page: PageBytes, keys: &[u64]) -> PageBytes {
    let page = with(page, 33550, Values::Double(vec![10.0, 20.0, 0.0]));
    let page = with(page, 33922, Values::Double(vec![0.0, 0.0, 0.0, 500.0, 900.0, 0.0]));
    with_keys(page, keys)
}

/// 4 x 3 samples: 0 to 11.
fn page() -> PageBytes {
    PageBytes::grey(4, 3, 8, (0..12).collect())
}

fn read(bytes: &[u8]) -> Result<OpenedGrids, ReadError> {
    geotiff::read(Cursor::new(bytes), &options())
}

fn read_page(page: PageBytes) -> Result<OpenedGrids, ReadError> {
    read(&tiff(&[page]))
}

pub(crate) fn examples() -> Vec<Example> {
    let packed = placed(page(), &UTM_POINT).packed(8, zlib);
    vec![
        Example { name: "area.tif", bytes: tiff(&[placed(page(), &UTM_AREA)]), read },
        Example { name: "packed.tif", bytes: tiff_file(&[packed], ByteOrder::Big, 43), read },
    ]
}

fn even(opened: &OpenedGrids) -> (DVec3, [DVec3; 2]) {
    let GridPoints::Even { origin, steps: [i, j, k] } = opened.grids[0].points() else { panic!("not even") };
    assert!(i.cross(*j).dot(*k) > 0.0, "left-handed");
    (*origin, [*i, *j])
}

#[test]
fn pixels_are_areas_or_points() {
    let opened = read_page(placed(page(), &UTM_AREA)).unwrap();
    // The middle of the last row, 2.5 pixels below the corner.
    assert_eq!(even(&opened), (DVec3::new(505.0, 850.0, 0.0), [DVec3::X * 10.0, DVec3::Y * 20.0]));
    assert_eq!((opened.unit.as_deref(), opened.grids[0].n_nodes()), (Some("m"), UVec3::new(4, 3, 1)));
    assert_eq!(opened.grids[0].fields()[0].values[..5], [8.0, 9.0, 10.0, 11.0, 4.0]);
    let opened = read_page(placed(page(), &UTM_POINT)).unwrap();
    assert_eq!(even(&opened).0, DVec3::new(500.0, 860.0, 0.0));
    assert_eq!(opened.unit.as_deref(), Some("US survey ft"));
    let opened = read_page(placed(page(), &[])).unwrap();
    assert_eq!((even(&opened).0, opened.unit), (DVec3::new(505.0, 850.0, 0.0), None));
}

#[test]
fn a_transformation_may_turn_and_need_not_turn_rows_over() {
    let matrix = |values: [f64; 6]| {
        let [a, b, x, c, d, y] = values;
        let rows = vec![a, b, 0.0, x, c, d, 0.0, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        with_keys(with(page(), 34264, Values::Double(rows)), &UTM_POINT)
    };
    // Rows go north: they stay.
    let opened = read_page(matrix([2.0, 0.0, 7.0, 0.0, 3.0, 8.0])).unwrap();
    assert_eq!(even(&opened), (DVec3::new(7.0, 8.0, 0.0), [DVec3::X * 2.0, DVec3::Y * 3.0]));
    assert_eq!(opened.grids[0].fields()[0].values[0], 0.0);
    // Columns go north and rows east: turned over, they go west.
    let opened = read_page(matrix([0.0, 3.0, 7.0, 2.0, 0.0, 8.0])).unwrap();
    assert_eq!(even(&opened), (DVec3::new(13.0, 8.0, 0.0), [DVec3::Y * 2.0, DVec3::X * -3.0]));
    assert_eq!(opened.grids[0].fields()[0].values[0], 8.0);
    let said = read_page(matrix([2.0, 4.0, 0.0, 1.0, 2.0, 0.0])).unwrap_err().to_string();
    assert!(said.starts_with("steps of a pixel is \"[2, 1] and [4, 2] from [0, 0]\""), "{said}");
}

#[test]
fn degrees_become_metres() {
    let page = with(page(), 33550, Values::Double(vec![0.5, 0.25, 0.0]));
    let page = with(page, 33922, Values::Double(vec![0.0, 0.0, 0.0, 7.0, 60.375, 0.0]));
    let opened = read_page(with_keys(page, &DEGREES)).unwrap();
    let (origin, [i, j]) = even(&opened);
    let degree = EARTH_RADIUS_M.to_radians();
    assert_eq!(origin, DVec3::ZERO);
    assert!((i.x - 0.5 * degree * 60f64.to_radians().cos()).abs() < 1e-6 && (j.y - 0.25 * degree).abs() < 1e-6);
    assert_eq!(opened.notes, [GridNote::Degrees { west: 7.25, south: 59.75, scale_latitude: 60.0 }]);
    assert_eq!(opened.grids[0].fields()[0].unit.as_deref(), Some("m"));
}

#[test]
fn no_data_is_a_hole_if_the_type_has_it() {
    let text = |page: PageBytes, text: &str| with(page, 42113, Values::Text([text.as_bytes(), &[0]].concat()));
    let holes = |page| {
        let opened = read_page(page).unwrap();
        opened.grids[0].holes().map(|holes| holes.iter().filter(|hole| **hole).count())
    };
    assert_eq!(holes(text(placed(page(), &UTM_AREA), "7 ")), Some(1));
    assert_eq!(holes(text(placed(page(), &UTM_AREA), "-9999")), None);
    assert_eq!(holes(text(placed(page(), &UTM_AREA), "0.25")), None);
    let float = |values: [f32; 2]| {
        let samples = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        placed(PageBytes::grey(2, 1, 32, samples).with(339, &[3]), &UTM_AREA)
    };
    assert_eq!(holes(text(float([-3.402_823_5e38, 1.0]), "-3.4028234663852886e+38")), Some(1));
    assert_eq!(holes(text(float([f32::NAN, 1.0]), "nan")), Some(1));
    let said = read_page(text(placed(page(), &UTM_AREA), "none")).unwrap_err().to_string();
    assert_eq!(said, "GDAL_NODATA is \"none\"; expected a number");
}

#[test]
fn nodes_of_tiles_that_are_not_stored_are_holes() {
    let samples: Vec<u8> = (0..20 * 18).map(|i| (i % 200) as u8 + 1).collect();
    let page = placed(PageBytes::grey(20, 18, 8, samples), &UTM_AREA).tiled([20, 18, 1], [16, 16, 1], 1);
    let page = page.packed(8, zlib);
    let mut lengths: Vec<u64> = page.chunks.iter().map(|chunk| chunk.len() as u64).collect();
    lengths[1] = 0;
    let opened = read_page(with(page, 325, Values::Long(lengths))).unwrap();
    let grid = &opened.grids[0];
    assert_eq!(opened.notes, [GridNote::MissingChunks { n_missing: 1, n_chunks: 4 }]);
    for j in 0..18 {
        for i in 0..20 {
            // Columns from 16 on, of the 16 northern rows.
            assert_eq!(grid.holes().unwrap()[grid.number(UVec3::new(i, j, 0))], i >= 16 && j >= 2, "{i} {j}");
        }
    }
}

#[test]
fn places_pages_and_bands_that_are_not_read_are_named() {
    let said = |page| read_page(page).unwrap_err().to_string();
    assert_eq!(
        said(page()),
        "the place of a GeoTIFF (ModelPixelScale with ModelTiepoint, or ModelTransformation) is missing"
    );
    let scale_only = with(page(), 33550, Values::Double(vec![1.0, 1.0, 0.0]));
    assert!(said(scale_only).ends_with("is missing"));
    let geocentric = [1, 1, 0, 1, 1024, 0, 1, 3];
    assert_eq!(
        said(placed(page(), &geocentric)),
        "GTModelTypeGeoKey \"3\" is not supported; 1 (projected) and 2 (geographic) are"
    );
    let grads = [1, 1, 0, 2, 1024, 0, 1, 2, 2054, 0, 1, 9105];
    assert!(said(placed(page(), &grads)).starts_with("GeogAngularUnitsGeoKey \"9105\" is not supported"));
    assert!(said(placed(page(), &DEGREES)).starts_with("range of latitudes is \"850 to 890\"; expected -90 to 90"));
    let rgb = placed(PageBytes::colours(2, 3, 2, 2, vec![0; 12]), &UTM_AREA);
    assert!(said(rgb).starts_with("page of \"2 x 2 samples of u8 RGB\" is not supported"));
    let two = tiff(&[placed(page(), &UTM_AREA), placed(page(), &UTM_AREA)]);
    assert!(read(&two).unwrap_err().to_string().starts_with("number of pages is \"2\"; expected 1"));
}

fn format_of(scalar: ScalarType) -> (u16, u16) {
    match scalar {
        ScalarType::U8 => (8, 1),
        ScalarType::I8 => (8, 2),
        ScalarType::U16 => (16, 1),
        ScalarType::I16 => (16, 2),
        ScalarType::U32 => (32, 1),
        ScalarType::I32 => (32, 2),
        ScalarType::F32 => (32, 3),
        ScalarType::F64 => (64, 3),
    }
}

#[test]
fn every_type_order_and_size_of_offsets() {
    for scalar in ScalarType::ALL {
        for order in ORDERS {
            for magic in [42, 43] {
                let (bits, format) = format_of(scalar);
                let samples = ramp(scalar);
                let page = PageBytes::grey(4, 6, bits, bytes(&samples, order)).with(339, &[format]);
                let opened = read(&tiff_file(&[placed(page, &UTM_AREA)], order, magic)).unwrap();
                let expected: Vec<f32> =
                    (0..6).rev().flat_map(|j| (0..4).map(move |i| 4 * j + i)).map(|at| samples.at(at) as f32).collect();
                // Numbers beyond f32 are infinite, and holes.
                assert_eq!(opened.grids[0].fields()[0].values, expected, "{scalar}");
                assert_eq!(opened.grids[0].holes().is_some(), scalar == ScalarType::F64);
            }
        }
    }
}

proptest! {
    #[test]
    fn any_samples_come_back((width, height, samples) in (1..20u16, 1..20u16).prop_flat_map(|(w, h)| {
        (Just(w), Just(h), prop::collection::vec(any::<i16>(), usize::from(w) * usize::from(h)))
    }), no_data in any::<i16>(), is_packed in any::<bool>(), is_tiled in any::<bool>()) {
        let stored = bytes(&Voxels::from(samples.clone()), ByteOrder::Little);
        let mut page = PageBytes::grey(width, height, 16, stored).with(339, &[2]);
        if is_tiled {
            page = page.tiled([width.into(), height.into(), 1], [16, 16, 1], 2);
        }
        if is_packed {
            page = page.packed(8, zlib);
        }
        let page = with(placed(page, &UTM_AREA), 42113, Values::Text(format!("{no_data}\0").into_bytes()));
        let opened = read_page(page).unwrap();
        let grid = &opened.grids[0];
        let (width, height) = (u32::from(width), u32::from(height));
        prop_assert_eq!(grid.n_nodes(), UVec3::new(width, height, 1));
        for (at, sample) in samples.iter().enumerate() {
            let (column, row) = (at as u32 % width, at as u32 / width);
            let number = grid.number(UVec3::new(column, height - 1 - row, 0));
            prop_assert_eq!(grid.fields()[0].values[number], f32::from(*sample));
            prop_assert_eq!(grid.holes().is_some_and(|holes| holes[number]), *sample == no_data);
        }
    }
}
