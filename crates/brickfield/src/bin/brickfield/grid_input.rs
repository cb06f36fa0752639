//! Structured grids of files, and what of them is shown.

use std::path::PathBuf;

use brickfield::core::glam::{DMat3, DVec3, UVec3};
use brickfield::core::{Aabb, Grid, StructuredGrid};
use brickfield::curvilinear::IndexPlane;
use brickfield::io::{GridOptions, Limits, OpenedGrids, open_grid};
use clap::Args;

use crate::Failure;

/// A structured grid of a file, and its values.
#[derive(Args)]
pub(crate) struct GridInput {
    /// File of structured grids: PLOT3D, HGT, USGS DEM, GeoTIFF, VTK (.vtr, .vts, .vtk)
    pub(crate) file: PathBuf,
    /// Most bytes that the grids may take, in MiB
    #[arg(long, value_name = "MIB", default_value_t = Limits::default().max_bytes >> 20,
          value_parser = clap::value_parser!(u64).range(1..1 << 43))]
    max_mib: u64,
    /// PLOT3D file with the values of the grid's nodes (q or f)
    #[arg(long, value_name = "FILE")]
    solution: Option<PathBuf>,
    /// Grid of a file that has several: its number, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    grid: usize,
    /// Values: their name or number; the first ones unless stated
    #[arg(long, value_name = "WHICH")]
    field: Option<String>,
}

/// What of a file cannot be shown.
#[derive(Debug, thiserror::Error)]
enum GridFault {
    #[error("--grid {wanted}: the file has {n} grids, 0 to {}", n - 1)]
    Grid { wanted: usize, n: usize },
    #[error("--field {wanted:?}: the grid has {}", if names.is_empty() { "no values; state the file that has them by --solution" } else { names })]
    Field { wanted: String, names: String },
    #[error("the grid has no values to be coloured by; state the file that has them by --solution")]
    Values,
    #[error("--plane {axis}={index}: the grid has {n} nodes along {axis}, 0 to {}", n - 1)]
    Plane { axis: char, index: u32, n: u32 },
    #[error("--plane {axis}: the grid has {} x {} x {} nodes, so that a plane of one {axis} is but a line", n.x, n.y, n.z)]
    Line { axis: char, n: UVec3 },
    #[error("the grid has no value that is no hole")]
    Holes,
    #[error("the grid reaches from {min} to {max}, which no camera sees")]
    Extent { min: DVec3, max: DVec3 },
}

impl GridInput {
    /// The grid, and the number of its field; what the reader noticed is printed.
    pub(crate) fn open(&self) -> Result<(StructuredGrid, usize), Failure> {
        let mut options = GridOptions::from(Limits { max_bytes: self.max_mib.saturating_mul(1 << 20) });
        options.solution.clone_from(&self.solution);
        let OpenedGrids { mut grids, notes, .. } = open_grid(&self.file, &options)?;
        notes.iter().for_each(|note| eprintln!("note: {note}"));
        let (wanted, n) = (self.grid, grids.len());
        if wanted >= n {
            return Err(Failure::usage(GridFault::Grid { wanted, n }));
        }
        let grid = grids.swap_remove(wanted);
        let field = self.field_of(&grid).map_err(Failure::usage)?;
        Ok((grid, field))
    }

    fn field_of(&self, grid: &StructuredGrid) -> Result<usize, GridFault> {
        let fields = grid.fields();
        let Some(wanted) = &self.field else {
            return if fields.is_empty() { Err(GridFault::Values) } else { Ok(0) };
        };
        let by_name = fields.iter().position(|field| field.name == *wanted);
        let by_number = wanted.parse().ok().filter(|i: &usize| *i < fields.len());
        by_name.or(by_number).ok_or_else(|| GridFault::Field {
            wanted: wanted.clone(),
            names: fields.iter().map(|field| format!("{:?}", field.name)).collect::<Vec<_>>().join(", "),
        })
    }
}

/// Refuses a plane that the grid does not have.
pub(crate) fn check_plane(grid: &StructuredGrid, plane: IndexPlane) -> Result<(), Failure> {
    let nodes = grid.n_nodes();
    let (axis, index, n) = (plane.letter(), plane.index(), nodes[plane.axis()]);
    if index >= n {
        return Err(Failure::usage(GridFault::Plane { axis, index, n }));
    }
    match plane.across().iter().any(|across| nodes[*across] < 2) {
        true => Err(Failure::usage(GridFault::Line { axis, n: nodes })),
        false => Ok(()),
    }
}

/// A grid of one voxel, which is a box: cameras find their place by it. Without a box there is nothing to be seen.
pub(crate) fn box_grid(around: Option<Aabb>) -> Result<Grid, Failure> {
    let around = around.ok_or(GridFault::Holes)?;
    let (min, max) = (around.min, around.max);
    let extent = around.extent();
    let size = extent.max(DVec3::splat(extent.max_element() * 1e-6)).max(DVec3::splat(f64::MIN_POSITIVE));
    Grid::from_first_sample(UVec3::ONE, size, around.min + 0.5 * size, DMat3::IDENTITY)
        .map_err(|_| GridFault::Extent { min, max }.into())
}
