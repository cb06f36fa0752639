//! What the times and errors say: ratios of times, and the time to an error.

use std::fmt;

use brickfield::BackendKind;
use brickfield::frame::Mode;
use serde::Serialize;

use super::lineup::{Build, Peer, Who};
use super::measure::{ContestantInfo, Measured, SceneReport};
use crate::report::step_label;
use crate::turns::Ratio;

/// The errors that are asked for.
pub(super) const BOUNDS: [f64; 2] = [1e-3, 1e-4];

/// How many times as long one contestant takes as another at a step.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct TimeRatio {
    pub of: String,
    pub to: String,
    pub cpu: Ratio,
    pub wall: Ratio,
}

/// What a contestant needs for an error of at most a bound.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct TimeToError {
    pub contestant: String,
    /// RMSE.
    pub bound: f64,
    pub reached: Reached,
}

/// The measured step of least CPU time that reaches an error, or why there is none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)]
pub enum Reached {
    At {
        step_voxels: f64,
        wall_ms: f64,
        cpu_ms: f64,
    },
    /// From `step_voxels` on, smaller steps do not lower the error.
    Stays {
        least_rmse: f64,
        step_voxels: f64,
    },
    /// The error at the least step that was drawn; at smaller ones it may fall.
    NotYet {
        rmse: f64,
        step_voxels: f64,
    },
    /// The contestant is absent, or failed on the way.
    Absent,
}

/// A contestant's errors, from the greatest step to the least.
pub(super) struct Standing {
    steps_and_rmse: Vec<(f64, f64)>,
}

/// Errors that fall by a lower order than this, over steps of at most [`ASYMPTOTIC`], stay: half a step lowers them by less than
/// a fifth. Orders of accuracy are 1 and more.
const LEAST_ORDER: f64 = 1.0 / 3.0;
/// Steps that are larger, in voxels, say nothing about the errors of small ones.
const ASYMPTOTIC: f64 = 1.0;

impl Standing {
    pub(super) fn of(scene: &SceneReport, contestant: &str) -> Standing {
        let rows = scene.steps.iter().flat_map(|step| &step.rows);
        let rows = rows.map(|row| (&row.contestant, (row.step_voxels, row.rmse)));
        let probes = scene.probes.iter().map(|probe| (&probe.contestant, (probe.step_voxels, probe.rmse)));
        let own = rows.chain(probes).filter(|(name, _)| *name == contestant);
        let mut steps_and_rmse: Vec<(f64, f64)> = own.map(|(_, point)| point).collect();
        steps_and_rmse.sort_by(|a, b| b.0.total_cmp(&a.0));
        // A step that was probed, then timed.
        steps_and_rmse.dedup_by_key(|point| point.0);
        Standing { steps_and_rmse }
    }

    /// Infinite before the first step.
    pub(super) fn least_rmse(&self) -> f64 {
        self.steps_and_rmse.iter().map(|(_, rmse)| *rmse).fold(f64::INFINITY, f64::min)
    }

    /// Whether smaller steps may lower the error.
    pub(super) fn may_fall(&self) -> bool {
        self.stays_from().is_none()
    }

    /// The step from which on the error stays.
    fn stays_from(&self) -> Option<f64> {
        let [.., (large, before), (small, after)] = self.steps_and_rmse.as_slice() else { return None };
        let order = (before / after).ln() / (large / small).ln();
        (*large <= ASYMPTOTIC && order < LEAST_ORDER).then_some(*large)
    }

    /// Why an error is not reached.
    fn missed(&self) -> Reached {
        match (self.stays_from(), self.steps_and_rmse.last()) {
            (Some(step_voxels), _) => Reached::Stays { least_rmse: self.least_rmse(), step_voxels },
            (None, Some((step_voxels, rmse))) => Reached::NotYet { rmse: *rmse, step_voxels: *step_voxels },
            (None, None) => Reached::Absent,
        }
    }
}

/// Whose times are stated as a part of whose.
pub(super) fn ratios(present: &[Who], rows: &[Measured]) -> Vec<TimeRatio> {
    let row = |who: &Who| rows.iter().find(|r| r.contestant == who.to_string());
    let mut ratios = Vec::new();
    for of in present {
        for to in present.iter().filter(|to| is_held_against(*of, **to)) {
            if let (Some(a), Some(b)) = (row(of), row(to)) {
                let (cpu, wall) = (Ratio::of(&a.cpu_ms, &b.cpu_ms), Ratio::of(&a.wall_ms, &b.wall_ms));
                ratios.push(TimeRatio { of: of.to_string(), to: to.to_string(), cpu, wall });
            }
        }
    }
    ratios
}

/// GPU paths are held against pygfx, the CPU path against VTK's fixed-point mapper, exact mode against fast mode, this build
/// against the other.
fn is_held_against(of: Who, to: Who) -> bool {
    let Who::Own { build, backend, mode } = of else { return false };
    match to {
        Who::Peer(Peer::VtkFixed) => backend == BackendKind::Cpu,
        Who::Peer(Peer::Pygfx) => backend != BackendKind::Cpu,
        Who::Peer(_) => false,
        Who::Own { build: b, backend: kind, mode: m } if kind == backend => {
            let to_fast = b == build && mode == Mode::Exact && m != mode;
            to_fast || (build == Build::This && b == Build::Other && m == mode)
        }
        Who::Own { .. } => false,
    }
}

/// For each contestant and bound.
pub(super) fn times_to_errors(scene: &SceneReport) -> Vec<TimeToError> {
    let of = |info: &ContestantInfo| {
        BOUNDS.map(|bound| TimeToError { contestant: info.name.clone(), bound, reached: reached(scene, info, bound) })
    };
    scene.contestants.iter().flat_map(of).collect()
}

fn reached(scene: &SceneReport, info: &ContestantInfo, bound: f64) -> Reached {
    let rows = scene.steps.iter().flat_map(|step| &step.rows);
    let enough = rows.filter(|row| row.contestant == info.name && row.rmse <= bound);
    match enough.min_by(|a, b| a.cpu.median.total_cmp(&b.cpu.median)) {
        Some(row) => Reached::At { step_voxels: row.step_voxels, wall_ms: row.wall.median, cpu_ms: row.cpu.median },
        None if info.absent.is_some() => Reached::Absent,
        None => Standing::of(scene, &info.name).missed(),
    }
}

impl fmt::Display for Reached {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reached::At { step_voxels, wall_ms, cpu_ms } => {
                write!(f, "step {}: {wall_ms:.1} ms, CPU {cpu_ms:.1} ms", step_label(*step_voxels))
            }
            Reached::Stays { least_rmse, step_voxels } => {
                write!(f, "never: it stays at {least_rmse:.2e} from step {} on", step_label(*step_voxels))
            }
            Reached::NotYet { rmse, step_voxels } => {
                write!(f, "not by step {}: {rmse:.2e}", step_label(*step_voxels))
            }
            Reached::Absent => f.write_str("absent, or failed"),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::beside::Beside;
    use super::super::measure::{Probe, StepReport};
    use super::*;
    use crate::turns::Spread;

    pub(in crate::peers) fn row(contestant: &str, step_voxels: f64, cpu: f64, rmse: f64) -> Measured {
        let cpu_ms = vec![cpu, 1.1 * cpu, 0.9 * cpu];
        let wall_ms: Vec<f64> = cpu_ms.iter().map(|ms| 0.5 * ms).collect();
        Measured {
            contestant: contestant.to_owned(),
            step_voxels,
            wall: Spread::of(&wall_ms),
            cpu: Spread::of(&cpu_ms),
            wall_ms,
            cpu_ms,
            rmse,
            max_abs: 10.0 * rmse,
            beside: Beside { pixels: [0.03, 0.04], share: 0.05 },
        }
    }

    fn own(build: Build, backend: BackendKind, mode: Mode) -> Who {
        Who::Own { build, backend, mode }
    }

    #[test]
    fn peers_are_what_times_are_a_part_of() {
        let cpu = own(Build::This, BackendKind::Cpu, Mode::FAST);
        let before = own(Build::Other, BackendKind::Cpu, Mode::FAST);
        let wgpu = own(Build::This, BackendKind::Wgpu, Mode::FAST);
        let exact = own(Build::This, BackendKind::Wgpu, Mode::Exact);
        let peers = [Peer::VtkFixed, Peer::VtkGpu, Peer::Pygfx].map(Who::Peer);
        let all: Vec<Who> = [cpu, before, wgpu, exact].into_iter().chain(peers).collect();
        let times = [10.0, 20.0, 30.0, 60.0, 40.0, 50.0, 15.0];
        let rows: Vec<Measured> = all.iter().zip(times).map(|(who, ms)| row(&who.to_string(), 0.5, ms, 1e-3)).collect();
        let ratio = |r: &TimeRatio| format!("{} / {}: {:.3}", r.of, r.to, r.cpu.median);
        let found: Vec<String> = ratios(&all, &rows).iter().map(ratio).collect();
        let expected = [
            "cpu fast / other cpu fast: 0.500",
            "cpu fast / vtk-fixed: 0.250",
            "other cpu fast / vtk-fixed: 0.500",
            "wgpu fast / pygfx: 2.000",
            "wgpu exact / wgpu fast: 2.000",
            "wgpu exact / pygfx: 4.000",
        ];
        assert_eq!(found, expected);
        // One that failed has no row.
        assert_eq!(ratios(&all, &rows[..4]).len(), 2);
    }

    /// A scene of steps, of which each has a row for each contestant.
    pub(in crate::peers) fn scene(contestants: &[&str], steps: Vec<Vec<Measured>>) -> SceneReport {
        let info = |name: &&str| ContestantInfo {
            who: Who::Peer(Peer::Vispy),
            name: (*name).to_owned(),
            version: String::new(),
            device: String::new(),
            domain: None,
            phases: Vec::new(),
            absent: None,
        };
        let step = |rows: Vec<Measured>| StepReport { step_voxels: rows[0].step_voxels, rows, ratios: Vec::new() };
        SceneReport {
            name: "blobs-256".to_owned(),
            dims: [256; 3],
            scalar: "u8".to_owned(),
            contestants: contestants.iter().map(info).collect(),
            steps: steps.into_iter().map(step).collect(),
            probes: Vec::new(),
            times_to_errors: Vec::new(),
        }
    }

    #[test]
    fn peers_reach_an_error_at_their_cheapest_step_or_say_why_not() {
        // Of `a`, step 1 is cheaper than step 2: the cheapest step counts, not the largest.
        let steps = vec![
            vec![row("a", 0.5, 40.0, 9e-5), row("b", 0.5, 30.0, 1.5e-3), row("c", 0.5, 9.0, 5e-4)],
            vec![row("a", 1.0, 20.0, 8e-4), row("b", 1.0, 20.0, 1.6e-3), row("c", 1.0, 8.0, 2e-3)],
            vec![row("a", 2.0, 25.0, 9e-4), row("b", 2.0, 25.0, 9e-3)],
        ];
        let mut scene = scene(&["a", "b", "c", "d"], steps);
        scene.contestants[3].absent = Some("no module".to_owned());
        scene.probes.push(Probe { contestant: "c".to_owned(), step_voxels: 0.25, rmse: 1.3e-4 });
        let words: Vec<String> =
            times_to_errors(&scene).iter().map(|t| format!("{} {:e} {}", t.contestant, t.bound, t.reached)).collect();
        let expected = [
            "a 1e-3 step 1: 10.0 ms, CPU 20.0 ms",
            "a 1e-4 step 1/2: 20.0 ms, CPU 40.0 ms",
            "b 1e-3 never: it stays at 1.50e-3 from step 1 on",
            "b 1e-4 never: it stays at 1.50e-3 from step 1 on",
            "c 1e-3 step 1/2: 4.5 ms, CPU 9.0 ms",
            "c 1e-4 not by step 1/4: 1.30e-4",
            "d 1e-3 absent, or failed",
            "d 1e-4 absent, or failed",
        ];
        assert_eq!(words, expected);
    }

    #[test]
    fn peers_errors_stay_only_where_small_steps_say_so() {
        let standing = |points: &[(f64, f64)]| {
            Standing::of(&scene(&["a"], points.iter().map(|(step, e)| vec![row("a", *step, 1.0, *e)]).collect()), "a")
        };
        assert!(standing(&[]).may_fall() && standing(&[(1.0, 1e-3)]).may_fall());
        // Half the step: order 1 falls, whatever the order of the steps; an eighth less does not, and more does not.
        assert!(standing(&[(0.25, 1e-3), (0.5, 2e-3)]).may_fall());
        assert_eq!(standing(&[(0.5, 8e-3), (0.25, 7e-3)]).stays_from(), Some(0.5));
        assert_eq!(standing(&[(1.0, 8e-3), (0.5, 9e-3)]).stays_from(), Some(1.0));
        // The same errors, of steps that are near to each other, and of steps of voxels.
        assert!(standing(&[(0.3, 8e-3), (0.25, 7e-3)]).may_fall());
        assert!(standing(&[(2.0, 8e-3), (1.0, 7.9e-3)]).may_fall());
    }
}
