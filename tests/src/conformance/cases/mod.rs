//! The cases.

mod extremes;
mod fast;
mod fields;
mod functions;
mod levels;
mod pictures;
mod placements;
mod polygons;
mod real;
mod setup;
mod views;

use super::case::Case;

/// All cases, in the order in which they run.
pub fn all() -> Vec<Case> {
    [
        functions::cases(),
        pictures::cases(),
        views::cases(),
        levels::cases(),
        placements::cases(),
        polygons::cases(),
        fast::cases(),
        extremes::cases(),
        real::cases(),
    ]
    .into_iter()
    .flatten()
    .collect()
}
