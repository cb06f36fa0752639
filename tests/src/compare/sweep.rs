//! The sweep: every mode, rule and step, as plans.

use std::cmp::Ordering::Equal;
use std::collections::HashMap;

use brickfield::core::Ray;
use brickfield::frame::{FramePlan, Mode};
use brickfield::optics::QuadratureRule;
use brickfield::{Residency, Scene, prepare};

use super::subject::Exhibit;
use super::{CompareArgs, CompareError};

/// Steps of the fast mode, whose filter and early ends hide the gain of smaller ones.
const FAST: &[f64] = &[2.0, 1.0, 0.5, 0.25];
/// Steps of the exact mode, rules of order 1.
const FIRST_ORDER: &[f64] = &[2.0, 1.0, 0.5, 0.25, 0.125];
/// Steps of the exact mode, rules of order 2 and above.
const HIGH_ORDER: &[f64] = &[2.0, 1.0, 0.5, 0.25, 0.125, 0.0625];
/// Steps to which the rule of highest order is pursued in exact mode, as long as its error is not below [`REACHED`].
const PURSUIT: &[f64] = &[0.03125, 0.015625, 0.0078125];
/// The error (RMSE) at which the pursuit of smaller steps ends.
pub(super) const REACHED: f64 = 1e-5;

/// One point of the sweep, the same for all backends.
pub(super) struct SweepPoint {
    pub(super) mode: Mode,
    pub(super) rule: QuadratureRule,
    pub(super) step_voxels: f64,
    pub(super) priority: Priority,
    pub(super) plan: FramePlan,
    pub(super) n_samples: u64,
}

/// When a point is measured, and whether it may be left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Priority {
    /// The curve that shows how far the error falls: measured whatever it costs, within the time.
    First,
    /// Its continuation, unless it is [`REACHED`] already.
    Pursuit,
    /// Measured if half of the time allows.
    Normal,
}

/// All points, by priority, then from the largest step to the smallest.
pub(super) fn sweep_points(args: &CompareArgs, exhibit: &Exhibit) -> Result<Vec<SweepPoint>, CompareError> {
    // Rules differ in the bricks that they need; plans of one rule share theirs.
    let mut residencies: HashMap<QuadratureRule, Residency> = HashMap::new();
    let mut all = Vec::new();
    for (mode, rule, step_voxels, priority) in points(args) {
        let scene = Scene { step_voxels, rule, mode, ..exhibit.scene.clone() };
        let plan = prepare(&exhibit.subject.tree, &scene, residencies.entry(rule).or_default())?;
        all.push(SweepPoint { mode, rule, step_voxels, priority, n_samples: count_samples(&plan), plan });
    }
    all.sort_by(|a, b| (a.priority, b.step_voxels).partial_cmp(&(b.priority, a.step_voxels)).unwrap_or(Equal));
    Ok(all)
}

/// The points of the sweep: the points that are asked for, or else the points that are worth their time.
fn points(args: &CompareArgs) -> Vec<(Mode, QuadratureRule, f64, Priority)> {
    let best = args.rules.iter().copied().max_by_key(|r| r.order());
    let mut points = Vec::new();
    for &mode in &args.modes {
        for &rule in &args.rules {
            let leads = mode == Mode::Exact && Some(rule) == best;
            let priority = if leads { Priority::First } else { Priority::Normal };
            points.extend(steps(args, rule, mode).into_iter().map(|s| (mode, rule, s, priority)));
            if leads && args.steps.is_empty() {
                points.extend(PURSUIT.iter().map(|s| (mode, rule, *s, Priority::Pursuit)));
            }
        }
    }
    points
}

fn steps(args: &CompareArgs, rule: QuadratureRule, mode: Mode) -> Vec<f64> {
    let mut steps = match mode {
        _ if !args.steps.is_empty() => args.steps.clone(),
        Mode::Fast { .. } => FAST.to_vec(),
        Mode::Exact if rule.order() < 2 => FIRST_ORDER.to_vec(),
        Mode::Exact => HIGH_ORDER.to_vec(),
    };
    steps.sort_by(f64::total_cmp);
    steps.dedup();
    steps
}

/// Nodes of all segments in the domain, over all rays: the number of evaluations without skipping.
fn count_samples(plan: &FramePlan) -> u64 {
    let (size, h) = (plan.size(), plan.sampling().step_world());
    let n_segments = |x: u32, y: u32| {
        let r = plan.rays().ray(x, y);
        // The ray from the frame's start on; the domain's box, like the anchor, relative to the frame's centre.
        let ray = Ray { origin: plan.rays().center + r.at(0.0), direction: r.direction };
        ray.clip(plan.domain()).map_or(0, |s| ((s.end / h).ceil() - (s.start / h).floor()) as u64)
    };
    let total: u64 = (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y))).map(|(x, y)| n_segments(x, y)).sum();
    total * plan.sampling().rule().nodes().len() as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::options::parse;
    use crate::compare::subject::exhibit;
    use brickfield::cpu::discrete;

    fn args(words: &str) -> CompareArgs {
        parse(std::iter::once("compare").chain(words.split_whitespace()).map(Into::into).collect()).unwrap()
    }

    #[test]
    fn samples_are_the_discrete_references_count() {
        let args = args("--size 24x16 --steps 1,0.3 --rules gauss2,midpoint --modes exact");
        for point in sweep_points(&args, &exhibit(&args).unwrap()).unwrap() {
            let counted = discrete(&point.plan).n_samples;
            assert!(
                point.n_samples.abs_diff(counted) * 1000 <= counted && counted > 1000,
                "{counted} {}",
                point.n_samples
            );
        }
    }

    #[test]
    fn the_default_sweep_has_the_leading_curve_first_runs_to_small_steps_and_shares_bricks() {
        let args = args("--size 8x8");
        let points = sweep_points(&args, &exhibit(&args).unwrap()).unwrap();
        assert_eq!(points.len(), 5 * 4 + 2 * 5 + 3 * 6 + 3);
        assert!(points.windows(2).all(|c| c[0].priority < c[1].priority || c[0].step_voxels >= c[1].step_voxels));
        let first = |c: &&SweepPoint| c.priority == Priority::First;
        assert!(points.iter().take_while(first).all(|c| c.rule == QuadratureRule::Gauss2 && c.mode == Mode::Exact));
        assert_eq!(points.iter().filter(first).count(), HIGH_ORDER.len());
        let sets: std::collections::HashSet<_> =
            points.iter().map(|c| std::sync::Arc::as_ptr(c.plan.field().slots())).collect();
        assert_eq!(sets.len(), 5);
    }

    #[test]
    fn steps_that_are_asked_for_are_taken_once_by_every_rule_and_mode() {
        let args = args("--size 8x8 --steps 1/64,4,4 --rules gauss2,left-riemann");
        let points = sweep_points(&args, &exhibit(&args).unwrap()).unwrap();
        assert_eq!(points.len(), 2 * 2 * 2);
    }
}
