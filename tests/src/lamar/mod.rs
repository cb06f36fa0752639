//! LaMar, Hamann and Joy 1999 on this project's data: table 1 with its errors, figures 8 and 14, and the paper's other claims.
//!
//! - `selection`: how many tiles the distance filter selects, figures 4 and 5.
//! - `table`: fixed tiles against multiresolution, three proxy geometries and the ray caster, time and error on every backend.
//! - `downsampling`: subsampling against averaging. `memory`: the formula for shared voxels against the stored ones.
//! - `seams`: a constant field, with and without opacity correction. `shells`: tessellated shells against spheres.
//! - `figures`: pictures. `views`: a screen-space error of a pixel, over views of a large volume.

mod args;
mod downsampling;
mod figures;
mod measure;
mod memory;
mod scenes;
mod seams;
mod selection;
mod shells;
mod table;
mod views;

pub use args::{LamarArgs, Part};

use crate::paper::{Findings, PaperError};

/// Runs the parts that `args` ask for, and prints their findings.
///
/// # Errors
/// Data or a folder that cannot be had, a scene that is refused, a backend that fails.
pub fn lamar(args: &LamarArgs) -> Result<Findings, PaperError> {
    scenes::check_data(args)?;
    args.common.run(args.parts(), Part::title, |part, rivals| match part {
        Part::Selection => selection::run(args),
        Part::Table => table::run(args, rivals),
        Part::Downsampling => downsampling::run(args),
        Part::Memory => memory::run(args),
        Part::Seams => seams::run(args, rivals),
        Part::Shells => shells::run(args, rivals),
        Part::Figures => figures::run(args, rivals),
        Part::Views => views::run(args, rivals),
    })
}
