//! Wynn, Barnes, Hamann and Miller 1999 on terrains and generated grids: table 1, errors next to other triangulations, figures 15 and 16,
//! frame times that are kept, and large grids.
//!
//! - `table`: frame rates, polygons and errors. `zoom`, `mandelbrot`: the figures. `flight`: feedback and prediction.
//! - `errors`: zones next to a uniform grid and to `rtin`, right-triangulated irregular networks. `deviation`: the greatest error of triangles.
//! - `cells`: curvilinear volumes, next to VTK. `large`: grids of up to 16,385 x 16,385 nodes.

mod args;
mod cells;
mod data;
mod deviation;
mod errors;
mod flight;
mod large;
mod mandelbrot;
mod rtin;
mod table;
mod zoom;

pub use args::{Part, WynnArgs};

use crate::paper::{Findings, PaperError};

/// Runs the parts that `args` ask for, and prints their findings.
///
/// # Errors
/// Data or a folder that cannot be had, a backend that fails.
pub fn wynn(args: &WynnArgs) -> Result<Findings, PaperError> {
    data::check_data(args)?;
    if args.parts().contains(&Part::Cells) {
        cells::check_data(args)?;
    }
    args.common.run(args.parts(), Part::title, |part, rivals| match part {
        Part::Table => table::run(args, rivals),
        Part::Errors => errors::run(args),
        Part::Zoom => zoom::run(args, rivals),
        Part::Mandelbrot => mandelbrot::run(args, rivals),
        Part::Flight => flight::run(args, rivals),
        Part::Cells => cells::run(args, rivals),
        Part::Large => large::run(args),
    })
}
