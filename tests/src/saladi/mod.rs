//! Saladi, Pinnamaneni and Meyer 2003 on this project's data: normals of surface voxels, and tables 1 and 2.
//!
//! - `normals`: figures 9 and 10, pictures on normals of every kind, their differences and times; edits of the transfer function.
//! - `stores`: stores with level 0 as details, next to ordinary ones: sizes, equal samples.
//! - `bytes`: bytes against error, in several orders.
//! - `served`: a store that is served over a slow link, and over one that fails.
//! - `tables`: tables 1 and 2, times of loading, of processing without and with light, and of rendering, by the number of slices.

mod args;
mod bytes;
mod data;
mod edits;
mod normals;
mod plot;
mod served;
mod stores;
mod tables;

pub use args::{Part, SaladiArgs};

use crate::paper::{Findings, PaperError};

/// Runs the parts that `args` ask for, and prints their findings.
///
/// # Errors
/// Data or a folder that cannot be had, a scene that is refused, a backend that fails.
pub fn saladi(args: &SaladiArgs) -> Result<Findings, PaperError> {
    data::check_data(args)?;
    args.common.run(args.parts(), Part::title, |part, rivals| match part {
        Part::Normals => normals::run(args, rivals),
        Part::Tables => tables::run(args, rivals),
        Part::Stores => stores::run(args),
        Part::Bytes => bytes::run(args, rivals),
        Part::Served => served::run(args, rivals),
    })
}
