//! Frame times on a scripted flight, with load that comes and goes: feedback as in the paper, and prediction.

use std::sync::Arc;
use std::time::{Duration, Instant};

use brickfield::curvilinear::{BudgetSelector, FeedbackBudget, FrameTarget, FrameTime, PredictiveBudget, View};
use brickfield::frame::Backend;
use brickfield_core::glam::DVec3;
use brickfield_core::{Camera, Projection};
use serde::Serialize;

use super::WynnArgs;
use super::data::{Terrain, terrains, timed_frame};
use crate::compare::rivals::Rivals;
use crate::metrics::quantile;
use crate::paper::{Missed, PaperError, print};

/// Controllers aim at this share of the time, because frames of equal numbers of zones do not take equal times.
const AIM: f64 = 0.85;

/// A flight.
#[derive(Clone, Debug, Serialize)]
struct FlightRow {
    data: String,
    backend: &'static str,
    controller: &'static str,
    /// The share of frames that took no longer than asked for, and than a tenth more.
    within: f64,
    nearly_within: f64,
    /// The median and the longest frame, in milliseconds.
    median_ms: f64,
    longest_ms: f64,
    mean_zones: f64,
    /// Frame by frame: the time in milliseconds, the budget, and the zones that were drawn.
    ms: Vec<f64>,
    budgets: Vec<usize>,
    zones: Vec<usize>,
}

/// A controller of the number of zones.
enum Controller {
    Feedback(FeedbackBudget),
    Predictive(PredictiveBudget),
}

impl Controller {
    const fn name(&self) -> &'static str {
        match self {
            Controller::Feedback(_) => "feedback",
            Controller::Predictive(_) => "prediction",
        }
    }

    fn budget(&self) -> u32 {
        match self {
            Controller::Feedback(budget) => budget.budget(),
            Controller::Predictive(budget) => budget.budget(),
        }
    }

    fn observe(&mut self, frame: FrameTime) {
        let observed = match self {
            Controller::Feedback(budget) => budget.observe(frame),
            Controller::Predictive(budget) => budget.observe(frame),
        };
        observed.expect("a frame takes some time");
    }
}

pub(super) fn run(args: &WynnArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    let n = args.flight_frames;
    print(&format!(
        "{n} frames of {} x {} pixels, to take {} ms each: a flight across the terrain that looks up to the sky for a while and back, and jumps once;\n\
         in its second third every other {} frames take twice as long. Controllers aim at {AIM} of the time. Within: frames that took no longer; nearly: no more than a tenth longer.\n",
        args.common.size.x,
        args.common.size.y,
        args.flight_ms,
        n / 12
    ))?;
    let mut rows = Vec::new();
    for terrain in terrains(args)? {
        let terrain = terrain?;
        print(&terrain.name)?;
        print("  backend  controller    within %   nearly %   median ms   longest ms   mean zones")?;
        for backend in &mut rivals.present {
            let target = FrameTarget::new(AIM * args.flight_ms / 1e3, 16, 1 << 22).expect("a time above 0");
            let controllers = [
                Controller::Feedback(FeedbackBudget::new(target, 2000)),
                Controller::Predictive(PredictiveBudget::new(target, 2000)),
            ];
            for controller in controllers {
                let row = fly(args, &terrain, backend.as_mut(), controller)?;
                print(&format!(
                    "  {:<8} {:<12} {:>9.1} {:>10.1} {:>11.1} {:>12.1} {:>12.0}",
                    row.backend,
                    row.controller,
                    100.0 * row.within,
                    100.0 * row.nearly_within,
                    row.median_ms,
                    row.longest_ms,
                    row.mean_zones
                ))?;
                rows.push(row);
            }
        }
    }
    args.common.write_rows("flight.json", &rows)?;
    Ok(Vec::new())
}

fn fly(
    args: &WynnArgs,
    terrain: &Terrain,
    backend: &mut dyn Backend,
    mut controller: Controller,
) -> Result<FlightRow, PaperError> {
    let n = args.flight_frames;
    let mut selector = BudgetSelector::new(Arc::clone(&terrain.tree));
    let (mut ms, mut budgets, mut zones) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..n {
        let view = seen(args, terrain, i)?;
        let begin = Instant::now();
        let budget = controller.budget() as usize;
        timed_frame(backend, || {
            selector.update(&view, budget);
            terrain.plan(&view, selector.selection(), None)
        })?;
        if is_loaded(i, n) {
            busy(begin.elapsed());
        }
        let seconds = begin.elapsed().as_secs_f64();
        let n_polygons = selector.selection().n_leaves() as u32;
        controller.observe(FrameTime { n_polygons, seconds });
        budgets.push(budget);
        zones.push(selector.selection().n_leaves());
        ms.push(seconds * 1e3);
    }
    let share = |most: f64| ms.iter().filter(|ms| **ms <= most).count() as f64 / f64::from(n);
    Ok(FlightRow {
        data: terrain.name.clone(),
        backend: backend.describe().backend,
        controller: controller.name(),
        within: share(args.flight_ms),
        nearly_within: share(1.1 * args.flight_ms),
        median_ms: quantile(ms.clone(), 0.5),
        longest_ms: quantile(ms.clone(), 1.0),
        mean_zones: zones.iter().sum::<usize>() as f64 / f64::from(n),
        ms,
        budgets,
        zones,
    })
}

/// Whether another program takes half of the machine.
fn is_loaded(i: u32, n: u32) -> bool {
    let third = n / 3;
    (third..2 * third).contains(&i) && (i / (n / 12).max(1)).is_multiple_of(2)
}

/// Works for so long.
fn busy(time: Duration) {
    let begin = Instant::now();
    while begin.elapsed() < time {
        std::hint::spin_loop();
    }
}

/// The view of a frame.
fn seen(args: &WynnArgs, terrain: &Terrain, i: u32) -> Result<View, PaperError> {
    let extent = terrain.tree.extent(terrain.tree.layout().root());
    let (around, n) = (extent.extent(), f64::from(args.flight_frames));
    let way = f64::from(i) / n;
    // Behind two thirds of the way the flight goes on somewhere else.
    let lane = if way < 2.0 / 3.0 { 0.3 } else { 0.7 };
    let height = extent.max.z + 0.06 * around.x;
    let eye = DVec3::new(extent.min.x + lane * around.x, extent.min.y + way * 0.8 * around.y, height);
    // It looks up from a fifth of the way to a quarter: nearly nothing of the terrain is seen.
    let slope = if (0.2..0.25).contains(&way) { 0.6 } else { -0.35 };
    let target = eye + DVec3::new(0.1, 1.0, slope);
    let camera = Camera::look_at(eye, target, DVec3::Z, Projection::Perspective { fov_y: 0.8 })?;
    Ok(View::new(camera, args.common.size).expect("a picture has pixels"))
}
