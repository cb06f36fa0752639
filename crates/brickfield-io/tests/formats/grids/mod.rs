//! Structured grids: every format and variant, from fixtures made here.

mod bad_input;
mod changed;
#[cfg(feature = "tiff")]
pub(crate) mod geotiff;
mod hgt;
mod open;
pub(crate) mod plot3d;
pub(crate) mod usgs_dem;
pub(crate) mod vtk;
#[cfg(feature = "vti")]
pub(crate) mod vtk_xml;

use brickfield_core::StructuredGrid;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_io::{GridOptions, Limits, OpenedGrids, ReadError};

/// Enough for every fixture but tiles, and little enough that a mistake shows.
pub(crate) fn options() -> GridOptions {
    Limits { max_bytes: 1 << 20 }.into()
}

/// A file of each format, its name, and a reader of its bytes.
pub(crate) struct Example {
    pub(crate) name: &'static str,
    pub(crate) bytes: Vec<u8>,
    pub(crate) read: fn(&[u8]) -> Result<OpenedGrids, ReadError>,
}

pub(crate) fn examples() -> Vec<Example> {
    let mut examples = plot3d::examples();
    examples.extend(usgs_dem::examples());
    examples.extend(vtk::examples());
    #[cfg(feature = "vti")]
    examples.extend(vtk_xml::examples());
    #[cfg(feature = "tiff")]
    examples.extend(geotiff::examples());
    examples
}

/// All nodes of a grid, i fastest.
fn nodes(n: UVec3) -> impl Iterator<Item = UVec3> {
    (0..n.z).flat_map(move |k| (0..n.y).flat_map(move |j| (0..n.x).map(move |i| UVec3::new(i, j, k))))
}

/// Where node (i, j, k) of all curvilinear fixtures lies: exact in f32.
fn place(node: UVec3) -> DVec3 {
    let [i, j, k] = node.to_array().map(f64::from);
    DVec3::new(i + 0.25 * j, 2.0 * j - 0.5 * k, 10.0 + k + 0.125 * i * j)
}

/// The value of a node in field number `field` of all fixtures.
fn value(field: usize, node: UVec3) -> f32 {
    let [i, j, k] = node.to_array().map(|n| n as f32);
    (100 * (field + 1)) as f32 + i - 2.0 * j + 0.5 * k
}

#[track_caller]
fn assert_places(grid: &StructuredGrid, n: UVec3) {
    assert_eq!(grid.n_nodes(), n);
    nodes(n).for_each(|node| assert_eq!(grid.position(node), place(node)));
}

#[track_caller]
fn assert_values(grid: &StructuredGrid, field: usize, name: &str) {
    let found = &grid.fields()[field];
    assert_eq!(found.name, name);
    let expected: Vec<f32> = nodes(grid.n_nodes()).map(|node| value(field, node)).collect();
    assert_eq!(found.values, expected);
}
