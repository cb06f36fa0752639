//! What the times and errors say: ratios of times, and the time to an error.

use std::fmt;

use brickfield::BackendKind;
use brickfield::frame::Mode;
use serde::Serialize;

use super::lineup::{Build, Peer, Who};
use super::measure::{Measured, StepReport};
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

/// The measured step of least CPU time that reaches an error, if one does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)]
pub enum Reached {
    At { step_voxels: f64, wall_ms: f64, cpu_ms: f64 },
    Never { least_rmse: f64 },
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

/// For each contestant and bound, in the order of the first step's rows.
pub(super) fn times_to_errors(steps: &[StepReport]) -> Vec<TimeToError> {
    let mut names: Vec<&String> = Vec::new();
    for row in steps.iter().flat_map(|step| &step.rows) {
        if !names.contains(&&row.contestant) {
            names.push(&row.contestant);
        }
    }
    let of = |name: &String| -> Vec<&Measured> {
        steps.iter().flat_map(|step| &step.rows).filter(|row| row.contestant == *name).collect()
    };
    let times = |name: &String| {
        BOUNDS.map(|bound| TimeToError { contestant: name.clone(), bound, reached: reached(&of(name), bound) })
    };
    names.into_iter().flat_map(times).collect()
}

fn reached(rows: &[&Measured], bound: f64) -> Reached {
    let enough = rows.iter().filter(|row| row.rmse <= bound);
    match enough.min_by(|a, b| a.cpu.median.total_cmp(&b.cpu.median)) {
        Some(row) => Reached::At { step_voxels: row.step_voxels, wall_ms: row.wall.median, cpu_ms: row.cpu.median },
        None => Reached::Never { least_rmse: rows.iter().map(|row| row.rmse).fold(f64::INFINITY, f64::min) },
    }
}

impl fmt::Display for Reached {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reached::At { step_voxels, wall_ms, cpu_ms } => {
                write!(f, "step {}: {wall_ms:.1} ms, CPU {cpu_ms:.1} ms", step_label(*step_voxels))
            }
            Reached::Never { least_rmse } => write!(f, "never (least error {least_rmse:.2e})"),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
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

    #[test]
    fn peers_reach_an_error_at_their_cheapest_step_or_never() {
        let step = |step_voxels: f64, rows: Vec<Measured>| StepReport { step_voxels, rows, ratios: Vec::new() };
        // Of `a`, step 1 is cheaper than step 2: the cheapest step counts, not the largest.
        let steps = [
            step(0.5, vec![row("a", 0.5, 40.0, 9e-5), row("b", 0.5, 30.0, 1.7e-3)]),
            step(1.0, vec![row("a", 1.0, 20.0, 8e-4), row("b", 1.0, 20.0, 1.6e-3)]),
            step(2.0, vec![row("a", 2.0, 25.0, 9e-4)]),
        ];
        let found = times_to_errors(&steps);
        let words: Vec<String> =
            found.iter().map(|t| format!("{} {:e} {}", t.contestant, t.bound, t.reached)).collect();
        let expected = [
            "a 1e-3 step 1: 10.0 ms, CPU 20.0 ms",
            "a 1e-4 step 1/2: 20.0 ms, CPU 40.0 ms",
            "b 1e-3 never (least error 1.60e-3)",
            "b 1e-4 never (least error 1.60e-3)",
        ];
        assert_eq!(words, expected);
    }
}
