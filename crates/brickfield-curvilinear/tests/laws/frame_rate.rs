//! Polygon budgets, on a simulated machine.

use brickfield_curvilinear::*;

const TARGET: f64 = 0.04;

/// A frame takes 2 ms, and 1 microsecond a polygon, all times `slowness`.
fn frame(n_polygons: u32, slowness: f64) -> FrameTime {
    FrameTime { n_polygons, seconds: (0.002 + 1e-6 * f64::from(n_polygons)) * slowness }
}

fn target() -> FrameTarget {
    FrameTarget::new(TARGET, 100, 10_000_000).unwrap()
}

/// The times of frames of views that show so many polygons, and a machine that slows down.
fn times(mut observe: impl FnMut(FrameTime) -> u32, first: u32, frames: &[(u32, f64)]) -> Vec<f64> {
    let mut budget = first;
    let mut one = |(shown, slowness): &(u32, f64)| {
        let drawn = frame(budget.min(*shown), *slowness);
        budget = observe(drawn);
        drawn.seconds
    };
    frames.iter().map(&mut one).collect()
}

fn feedback(frames: &[(u32, f64)]) -> Vec<f64> {
    let mut controller = FeedbackBudget::new(target(), 1_000);
    times(|frame| controller.observe(frame).unwrap(), 1_000, frames)
}

fn predictive(frames: &[(u32, f64)]) -> Vec<f64> {
    let mut controller = PredictiveBudget::new(target(), 1_000);
    times(|frame| controller.observe(frame).unwrap(), 1_000, frames)
}

#[test]
fn both_reach_the_target() {
    let frames = [(u32::MAX, 1.0); 40];
    for times in [feedback(&frames), predictive(&frames)] {
        let last = times.last().unwrap();
        assert!((last / TARGET - 1.0).abs() < 0.01, "{times:?}");
    }
}

#[test]
fn prediction_needs_a_few_frames_and_stays_below_the_target() {
    let times = predictive(&[(u32::MAX, 1.0); 6]);
    assert!(times.iter().all(|seconds| *seconds < 1.001 * TARGET), "{times:?}");
    assert!((times[3] / TARGET - 1.0).abs() < 0.01, "{times:?}");
}

#[test]
fn when_the_view_jumps_feedback_overshoots_and_prediction_does_not() {
    // A full view, a view of the sky with 200 polygons, and back.
    let frames: Vec<(u32, f64)> = [(u32::MAX, 30), (200, 20), (u32::MAX, 10)]
        .into_iter()
        .flat_map(|(shown, n)| std::iter::repeat_n((shown, 1.0), n))
        .collect();
    let back = |times: Vec<f64>| times[50..].iter().fold(0.0, |most: f64, seconds| most.max(*seconds));
    assert!(back(feedback(&frames)) > 10.0 * TARGET);
    assert!(back(predictive(&frames)) < 1.01 * TARGET);
}

#[test]
fn a_slower_view_costs_one_frame() {
    // From frame 20 on every frame takes three times as long, and from frame 40 on a third of that.
    let slowness = |i: usize| if (20..40).contains(&i) { 3.0 } else { 1.0 };
    let frames: Vec<(u32, f64)> = (0..60).map(|i| (u32::MAX, slowness(i))).collect();
    let times = predictive(&frames);
    let late: Vec<usize> = (0..60).filter(|i| times[*i] > 1.1 * TARGET).collect();
    assert_eq!(late, [20], "{times:?}");
    assert!([25, 45].iter().all(|i| times[*i] > 0.95 * TARGET), "{times:?}");
}

#[test]
fn noise_does_not_upset_the_prediction() {
    let noise = |i: u32| 1.0 + 0.1 * (f64::from(i.wrapping_mul(2_654_435_761) >> 16) / 65_536.0 - 0.5);
    let frames: Vec<(u32, f64)> = (0..200).map(|i| (u32::MAX, noise(i))).collect();
    let times = predictive(&frames);
    assert!(times[10..].iter().all(|seconds| (0.75..1.25).contains(&(seconds / TARGET))), "{times:?}");
}

#[test]
fn budgets_stay_in_their_limits() {
    let target = FrameTarget::new(TARGET, 500, 2_000).unwrap();
    let mut controllers = (FeedbackBudget::new(target, 1), PredictiveBudget::new(target, 9_000));
    assert_eq!((controllers.0.budget(), controllers.1.budget()), (500, 2_000));
    for seconds in [1e-9, 1e9, 0.04, 1e-3] {
        let frame = FrameTime { n_polygons: 700, seconds };
        let budgets = [controllers.0.observe(frame).unwrap(), controllers.1.observe(frame).unwrap()];
        assert!(budgets.iter().all(|budget| (500..=2_000).contains(budget)), "{budgets:?}");
    }
}

#[test]
fn bad_times_are_named_and_change_nothing() {
    let mut controller = PredictiveBudget::new(target(), 1_000);
    let before = controller;
    let error = controller.observe(FrameTime { n_polygons: 3, seconds: f64::NAN }).unwrap_err().to_string();
    assert_eq!(error, "a frame time of NaN seconds; it must be finite and above 0");
    assert_eq!(controller, before);
    let error = |seconds, least, most| FrameTarget::new(seconds, least, most).unwrap_err().to_string();
    assert_eq!(error(0.0, 1, 2), "a frame time to keep to of 0 seconds; it must be finite and above 0");
    assert_eq!(
        error(0.1, 5, 2),
        "budgets from 5 to 2 polygons; the least must be at least 1, and at most the greatest"
    );
}

/// Frames that show nothing take next to no time, and do not tell that polygons have become faster.
#[test]
fn a_view_of_the_sky_does_not_raise_the_budget() {
    let target = FrameTarget::new(0.050, 16, 1 << 22).unwrap();
    let mut budget = PredictiveBudget::new(target, 2_000);
    let seconds = |n: u32| if n == 0 { 0.0002 } else { 0.004 + 4e-6 * f64::from(n) };
    for _ in 0..40 {
        let n_polygons = budget.budget();
        budget.observe(FrameTime { n_polygons, seconds: seconds(n_polygons) }).unwrap();
    }
    let before = budget.budget();
    assert!((11_000..12_500).contains(&before), "{before}");
    for _ in 0..30 {
        budget.observe(FrameTime { n_polygons: 0, seconds: seconds(0) }).unwrap();
    }
    let after = budget.budget();
    assert!(seconds(after) < 1.2 * 0.050, "{before} became {after}");
}
