//! From slices to a stack: which belong together, in which order, and where they lie.

use std::collections::BTreeMap;

use brickfield_core::glam::DVec3;

use super::slice::Slice;
use crate::placement::GridPlacement;
use crate::{Note, WorldFrame};

/// The largest set of slices of one series that have one size, type and orientation.
pub(super) fn largest_series(slices: Vec<Slice>, notes: &mut Vec<Note>) -> Vec<Slice> {
    let n_slices = slices.len();
    let mut series: BTreeMap<_, Vec<Slice>> = BTreeMap::new();
    for slice in slices {
        series.entry(key(&slice)).or_default().push(slice);
    }
    let n_series = series.len();
    // The first of the largest: the order of keys makes the choice repeatable.
    let largest = series.into_values().reduce(|best, next| if next.len() > best.len() { next } else { best });
    let largest = largest.unwrap_or_default();
    if n_series > 1 {
        let kept = largest.first().map(|s| s.series.clone()).unwrap_or_default();
        notes.push(Note::SeveralSeries { kept, n_series, n_slices_left_out: n_slices - largest.len() });
    }
    largest
}

fn key(slice: &Slice) -> (String, u64, u64, &'static str, Option<[i64; 6]>) {
    let rounded = |v: f64| (v * 1000.0).round() as i64;
    let orientation = slice.orientation.map(|[r, c]| [r.x, r.y, r.z, c.x, c.y, c.z].map(rounded));
    (slice.series.clone(), slice.columns, slice.rows, slice.scalar.name(), orientation)
}

/// Slices by position along their normal, one for each position; else by instance number.
pub(super) fn sorted(mut slices: Vec<Slice>, notes: &mut Vec<Note>) -> Vec<Slice> {
    let n_slices = slices.len();
    let Some(normal) = normal(&slices) else {
        slices.sort_by(|a, b| a.instance.total_cmp(&b.instance).then_with(|| a.name.cmp(&b.name)));
        return slices;
    };
    let height = |slice: &Slice| slice.position.map_or(0.0, |p| p.dot(normal));
    slices.sort_by(|a, b| height(a).total_cmp(&height(b)).then(a.instance.total_cmp(&b.instance)));
    slices.dedup_by(|later, earlier| (height(later) - height(earlier)).abs() < 1e-4);
    if slices.len() < n_slices {
        notes.push(Note::DuplicateSlices { n_slices: n_slices - slices.len() });
    }
    slices
}

/// The normal of the slices, if all of them have a position.
fn normal(slices: &[Slice]) -> Option<DVec3> {
    let [along_row, along_column] = slices.first()?.orientation?;
    let all_placed = slices.iter().all(|s| s.position.is_some());
    all_placed.then(|| along_row.cross(along_column).normalize())
}

/// Where the sorted slices lie.
pub(super) fn placement(slices: &[Slice], notes: &mut Vec<Note>) -> (GridPlacement, WorldFrame) {
    let first = &slices[0];
    let [dx, dy] = first.pixel_spacing.unwrap_or_else(|| {
        notes.extend(['x', 'y'].map(|axis| Note::SpacingAssumed { axis, reason: "is not stated" }));
        [1.0, 1.0]
    });
    let (Some(normal), Some([along_row, along_column])) = (normal(slices), first.orientation) else {
        notes.push(Note::OrientationIgnored { what: "position or orientation is missing in some slices" });
        let spacing = DVec3::new(dx, dy, stated_step(first, notes));
        return (GridPlacement::axis_aligned(spacing, DVec3::ZERO), WorldFrame::Plain);
    };
    let positions: Vec<DVec3> = slices.iter().filter_map(|s| s.position).collect();
    let step = match positions.len() {
        1 => normal * stated_step(first, notes),
        _ => step_through(&positions, normal, notes),
    };
    let placement = GridPlacement::from_axes(&[along_row * dx, along_column * dy, step], positions[0]);
    (placement, WorldFrame::Lps)
}

fn stated_step(slice: &Slice, notes: &mut Vec<Note>) -> f64 {
    slice.stated_step.unwrap_or_else(|| {
        notes.push(Note::SpacingAssumed { axis: 'z', reason: "is not stated" });
        1.0
    })
}

/// Steps may differ by this share of their median before they are called uneven.
const EVEN_WITHIN: f64 = 0.01;
const MIN_TILT_DEGREES: f64 = 0.05;

/// The step from slice to slice: along the line through first and last, of the median length.
fn step_through(positions: &[DVec3], normal: DVec3, notes: &mut Vec<Note>) -> DVec3 {
    let (first, last) = (positions[0], positions[positions.len() - 1]);
    let direction = (last - first).normalize_or(normal);
    let degrees = direction.dot(normal).clamp(-1.0, 1.0).acos().to_degrees();
    if degrees > MIN_TILT_DEGREES {
        notes.push(Note::GantryTilt { degrees });
    }
    let distances: Vec<f64> = positions.iter().map(|p| (*p - first).dot(direction)).collect();
    let mut steps: Vec<f64> = distances.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    let (min_step, median_step, max_step) = (steps[0], steps[steps.len() / 2], steps[steps.len() - 1]);
    if max_step - min_step > EVEN_WITHIN * median_step.abs() {
        let shift = |(i, d): (usize, &f64)| (d - i as f64 * median_step).abs();
        let max_shift = distances.iter().enumerate().map(shift).fold(0.0, f64::max);
        notes.push(Note::UnevenSpacing { positions: distances, min_step, median_step, max_step, max_shift });
        return direction * median_step;
    }
    (last - first) / steps.len() as f64
}
