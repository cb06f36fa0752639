//! Ljung, Lundstroem and Ynnerman 2006 on this project's data: figures 4, 5, 7 and 9, error against time and bytes, the cost of
//! interpolation between blocks, and reselection.
//!
//! - `gradient`: figure 7, a rotated linear gradient at random resolutions. `weights`: figures 4 and 5, read back from backends.
//! - `continuity`: jumps on faces, edges and corners; equal resolutions against trilinear interpolation.
//! - `light`: a ball whose normals are known, in the light.
//! - `accounting`: figure 9. `table`: error, time, samples and bytes at several budgets. `cost`: schemes against the nearest block.
//! - `rank`: estimated errors of blocks against exact ones. `reselect`: after an edit of the transfer function. `classify`: prefiltered
//!   classification. `store`: a volume on disk, larger than its budget. `figures`: pictures.

mod accounting;
mod args;
mod classify;
mod continuity;
mod cost;
mod data;
mod error;
mod figures;
mod gradient;
mod light;
mod rank;
mod reselect;
mod schemes;
mod store;
mod table;
mod warped;
mod weights;

pub use args::{LjungArgs, Part};

use crate::paper::{Findings, PaperError};

/// Runs the parts that `args` ask for, and prints their findings.
///
/// # Errors
/// Data or a folder that cannot be had, a scene that is refused, a backend that fails.
pub fn ljung(args: &LjungArgs) -> Result<Findings, PaperError> {
    data::check_data(args)?;
    args.common.run(args.parts(), Part::title, |part, rivals| match part {
        Part::Gradient => gradient::run(args, rivals),
        Part::Weights => weights::run(args, rivals),
        Part::Continuity => continuity::run(args, rivals),
        Part::Light => light::run(args, rivals),
        Part::Accounting => accounting::run(),
        Part::Table => table::run(args, rivals),
        Part::Cost => cost::run(args, rivals),
        Part::Rank => rank::run(args),
        Part::Reselect => reselect::run(args),
        Part::Classify => classify::run(args, rivals),
        Part::Store => store::run(args, rivals),
        Part::Figures => figures::run(args, rivals),
    })
}
