//! How a frame is cut into dispatches: none takes long, no loop goes round too often, no sum grows too long.

use brickfield_frame::{CellsPlan, Division, FramePlan, Join, Pass, QuadratureRule, RenderError};

use crate::KnotSearch;

/// All loops of an invocation together end after so many rounds on Mesa's llvmpipe (`LP_MAX_TGSI_LOOP_ITERATIONS`), without
/// a word.
const MOST_ROUNDS: f64 = 65_535.0;
/// Most segments that are added up one by one: the rounding errors of longer sums would show.
const MOST_SEGMENTS: f64 = 8192.0;
/// Most values of the field in one dispatch: about a second on a slow device, whose driver may end a longer dispatch.
const MOST_VALUES: f64 = (1u32 << 28) as f64;

/// The dispatches of a plan's frame, in order; rows are cut at multiples of `group_height`. Those of a batch go on with what rays have
/// seen, unless it is the first.
pub fn passes(plan: &FramePlan, group_height: u32, is_first_batch: bool) -> Vec<Pass> {
    let (height, n_rows) = (plan.size().y, rows_per_pass(plan, group_height));
    let ranges = segment_ranges(plan);
    let bands = (0..height).step_by(n_rows as usize).map(|first| first..height.min(first + n_rows));
    let of_band = |rows: std::ops::Range<u32>| {
        let pass = move |(i, segments): (usize, &std::ops::Range<f32>)| Pass {
            segments: segments.clone(),
            first_seen_row: if plan.is_batch() { 0 } else { rows.start },
            goes_on: i > 0 || !is_first_batch,
            rows: rows.clone(),
        };
        ranges.iter().enumerate().map(pass)
    };
    bands.flat_map(of_band).collect()
}

/// How many rays must remember what they have seen: of a batch all, of a whole frame those of one pass.
pub fn n_rays_that_go_on(plan: &FramePlan, group_height: u32) -> u64 {
    let rows = rows_per_pass(plan, group_height).min(plan.size().y);
    u64::from(if plan.is_batch() { plan.size().y } else { rows }) * u64::from(plan.size().x)
}

/// The dispatches of a picture of cells: bands of rows.
///
/// # Errors
/// Rays that may pass so many cells and segments that an invocation's loops would end without a word.
pub fn passes_of_cells(plan: &CellsPlan) -> Result<Vec<Pass>, RenderError> {
    let n_cells = f64::from(plan.cells().n_cells().element_sum());
    let n_segments = 2.0 * plan.cells().radius() / plan.sampling().step_world();
    let rule = plan.sampling().rule();
    let n_knots = plan.transfer().knots().len();
    // A ray may pass a bent axis there and back. A cell goes round the walk once, and once for its segments, and the last segment walks
    // again. A segment goes round once, and for each node as often as its place in a cell is improved.
    let of_places = rule.nodes().len() as f64 * ROUNDS_OF_PLACE;
    let of_segment = 2.0 + of_places + rounds_of_knots(rule, n_knots, KnotSearch::among(n_knots));
    let rounds = ROUNDS_OF_FACES + 6.0 * n_cells + of_segment * n_segments;
    if rounds > MOST_ROUNDS {
        return Err(RenderError::Unsupported { what: "walk rays of so many cells and segments in one dispatch" });
    }
    let height = plan.size().y;
    let per_row = f64::from(plan.size().x) * (CELL_VALUES * n_cells + n_segments);
    let n_rows = ((MOST_VALUES / per_row) as u32 / CELL_ROWS).max(1).saturating_mul(CELL_ROWS);
    let band = |first: u32| Pass::whole_rays(first..height.min(first.saturating_add(n_rows)));
    Ok((0..height).step_by(n_rows as usize).map(band).collect())
}

/// Rows of a workgroup.
const CELL_ROWS: u32 = 8;
/// The work of a cell, in values of a field.
const CELL_VALUES: f64 = 8.0;
/// The most rounds in which a place in a cell is found (`cells.wesl`).
const ROUNDS_OF_PLACE: f64 = 12.0;
/// Rounds of the searches for faces where a ray enters: of some hundred rows of cells.
const ROUNDS_OF_FACES: f64 = 8192.0;

/// Whether rays need several passes.
pub(crate) fn has_long_rays(plan: &FramePlan) -> bool {
    plan.rays().n_segments > segments_per_pass(plan)
}

/// Ranges that cover all segments; the outer ones are open, so that rounding loses none.
fn segment_ranges(plan: &FramePlan) -> Vec<std::ops::Range<f32>> {
    let most = segments_per_pass(plan);
    let n = (plan.rays().n_segments / most).ceil().max(1.0) as u32;
    let cut = |i: u32| match i {
        0 => f32::MIN,
        i if i == n => f32::MAX,
        i => (f64::from(i) * most) as f32,
    };
    (0..n).map(|i| cut(i)..cut(i + 1)).collect()
}

fn segments_per_pass(plan: &FramePlan) -> f64 {
    let rounds = MOST_ROUNDS - rounds_of_bricks(plan);
    (rounds / rounds_per_segment(plan)).min(MOST_SEGMENTS).floor().max(1.0)
}

/// How often the loops go round for the bricks that a ray crosses, in every pass: once for each, once to pass the segments of earlier passes in
/// it, and twice for the segments that its faces cut.
fn rounds_of_bricks(plan: &FramePlan) -> f64 {
    match plan.sampling().division() {
        Division::Ray => 0.0,
        Division::Brick => {
            f64::from(plan.field().index().dims().element_sum()) * (3.0 + 2.0 * rounds_per_segment(plan))
        }
    }
}

/// How often the loops of the march go round for a segment, at most: once each to find its block, to enter it and to
/// integrate; for each piece between knots; for each halving of a search that is a loop; for each block of a blended value; and for
/// each bit of a light's shininess.
fn rounds_per_segment(plan: &FramePlan) -> f64 {
    let rule = plan.sampling().rule();
    let n_knots = plan.transfer().knots().len();
    let n_nodes = rule.nodes().len() as f64;
    let halves = match plan.spreads() {
        Some(_) if rule != QuadratureRule::PreIntegrated => (n_knots as f64 + 3.0) * n_nodes,
        _ => 0.0,
    };
    let blocks = if plan.field().dense_level().is_none() && plan.field().join() != Join::Shared { 8.0 } else { 0.0 };
    let bits = plan.lighting().map_or(0, |l| u32::BITS - l.light.terms().shininess.leading_zeros());
    let nodes = n_nodes * (blocks * values_per_node(plan) + f64::from(bits));
    3.0 + halves + rounds_of_knots(rule, n_knots, KnotSearch::of(plan)) + nodes
}

/// How often the loops over knots go round for a segment, at most: for each piece between knots, and for each halving of a search that is a loop.
fn rounds_of_knots(rule: QuadratureRule, n_knots: usize, search: KnotSearch) -> f64 {
    let n_knots = n_knots as f64;
    let pieces = if rule == QuadratureRule::PreIntegrated { n_knots + 1.0 } else { 0.0 };
    match search {
        KnotSearch::Unrolled(_) | KnotSearch::Table(_) => pieces,
        KnotSearch::Loop => pieces + (n_knots.log2() + 1.0).floor() * rule.nodes().len() as f64,
    }
}

/// Values of the field that a node asks for: with light, six more for its gradient, or the stored one.
fn values_per_node(plan: &FramePlan) -> f64 {
    match (plan.lighting(), plan.gradients()) {
        (None, _) => 1.0,
        (_, Some(_)) => 2.0,
        (_, None) => 7.0,
    }
}

fn rows_per_pass(plan: &FramePlan, group_height: u32) -> u32 {
    let voxels_per_segment =
        plan.rays().direction[0].length() * plan.sampling().step_world() * plan.rays().least_stretch();
    let n_segments = (plan.visible().diagonal() / voxels_per_segment).clamp(1.0, segments_per_pass(plan));
    let n_nodes = n_segments * plan.sampling().rule().nodes().len() as f64 * f64::from(plan.size().x);
    let values_per_row = n_nodes * values_per_node(plan);
    // A float that is too large becomes the largest integer.
    ((MOST_VALUES / values_per_row) as u32 / group_height).max(1).saturating_mul(group_height)
}
