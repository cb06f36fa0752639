//! On to smaller steps (`--to-error`), until each contestant has reached all errors that are asked for, or its error stays.
//!
//! ```text
//!  half the least step --> one picture of each contestant that is still on its way --> its error
//!                               |                          |                             |
//!                     an error is reached:         the error falls:              it stays:
//!                     a step as any other          half that step, too           out
//! ```

use super::PeersError;
use super::measure::Measuring;
use super::standing::{BOUNDS, Standing};
use super::table;

/// The least step that is drawn.
pub(super) const LEAST_STEP: f64 = 1.0 / 64.0;

pub(super) fn descend(measuring: &mut Measuring, say: &mut dyn FnMut(&str)) -> Result<(), PeersError> {
    let least = measuring.report.steps.iter().map(|step| step.step_voxels).fold(f64::INFINITY, f64::min);
    let mut step = 0.5 * least;
    while step >= LEAST_STEP {
        let before: Vec<(String, Standing)> = on_their_way(measuring);
        if before.is_empty() {
            return Ok(());
        }
        before.iter().for_each(|(contestant, _)| measuring.probe(contestant, step));
        let probes = &measuring.report.probes;
        let found = probes.iter().filter(|probe| probe.step_voxels == step);
        say(&table::probes(&measuring.report.name, step, found.clone()));
        let arrives = |name: &str, rmse: f64| {
            let standing = before.iter().find(|(contestant, _)| contestant == name);
            standing.is_some_and(|(_, s)| BOUNDS.iter().any(|bound| rmse <= *bound && s.least_rmse() > *bound))
        };
        let arrived: Vec<String> =
            found.filter(|p| arrives(&p.contestant, p.rmse)).map(|p| p.contestant.clone()).collect();
        if !arrived.is_empty() {
            measuring.step(step, &|name| arrived.iter().any(|a| a == name), say)?;
        }
        step *= 0.5;
    }
    Ok(())
}

/// The contestants that have not reached all errors, and may.
fn on_their_way(measuring: &Measuring) -> Vec<(String, Standing)> {
    let present = measuring.report.contestants.iter().filter(|info| info.absent.is_none());
    let standings = present.map(|info| (info.name.clone(), Standing::of(&measuring.report, &info.name)));
    let least_bound = BOUNDS.into_iter().fold(f64::INFINITY, f64::min);
    standings.filter(|(_, standing)| standing.least_rmse() > least_bound && standing.may_fall()).collect()
}
