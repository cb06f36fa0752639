//! Tong, Wang, Tsang and Tang 1999 on this project's data: the block counts of table 1, its algorithms and newer ones, edits of the
//! threshold, and merging.
//!
//! - `counts`: blocks by equation 1. `merge`: chunks and padding of every way to store trimmed bricks.
//! - `table`: samples, bytes, times and savings of algorithms I to IV and of their alternatives, on every backend.
//! - `sweep`: a threshold that runs over its range. `batches`: caches smaller than a view's bricks, and an orbit. `memory`: peaks on the host and the device.

mod algorithm;
mod args;
mod batches;
mod counts;
mod data;
mod memory;
mod merge;
mod samples;
mod sweep;
mod table;

pub use args::{Part, TongArgs};

use crate::paper::{Findings, PaperError};

/// Runs the parts that `args` ask for, and prints their findings.
///
/// # Errors
/// Data or a folder that cannot be had, a scene that is refused, a backend that fails.
pub fn tong(args: &TongArgs) -> Result<Findings, PaperError> {
    data::check_data(args)?;
    if let Some(name) = &args.memory_of {
        return memory::print_own(args, name).map(|()| Findings::default());
    }
    args.common.run(args.parts(), Part::title, |part, rivals| match part {
        Part::Counts => counts::run(),
        Part::Merge => merge::run(args),
        Part::Table => table::run(args, rivals),
        Part::Sweep => sweep::run(args, rivals),
        Part::Batches => batches::run(args, rivals),
        Part::Memory => memory::run(args, rivals),
    })
}
