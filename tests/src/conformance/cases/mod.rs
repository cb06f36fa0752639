//! The cases.

mod blocks;
mod cells;
mod extremes;
mod fast;
mod fields;
mod functions;
mod grids;
mod levels;
mod light;
mod meshes;
mod pictures;
mod placements;
mod polygons;
mod prefiltered;
mod real;
mod setup;
mod storages;
mod trimmed;
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
        storages::cases(),
        blocks::cases(),
        light::cases(),
        prefiltered::cases(),
        trimmed::cases(),
        meshes::cases(),
        cells::cases(),
        extremes::cases(),
        real::cases(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn no_two_cases_have_one_name() {
        let mut names = HashSet::new();
        let twice: Vec<String> = all().into_iter().map(|case| case.name).filter(|n| !names.insert(n.clone())).collect();
        assert_eq!(twice, [""; 0]);
    }
}
