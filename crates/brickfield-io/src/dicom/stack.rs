//! From the slices of a series to a stack: one slice for each position, their order and their place.

use std::collections::{BTreeMap, HashSet};

use brickfield_core::glam::DVec3;

use super::slice::{Slice, StepFrom};
use crate::choice::Entries;
use crate::opened::FileFacts;
use crate::placement::GridPlacement;
use crate::{ChoiceKind, Note, ReadError, WorldFrame};

/// Slices closer than this, in world units, are at one position.
const SAME_POSITION: f64 = 1e-4;

/// What orders slices.
#[derive(Clone, Copy)]
enum Order {
    /// Positions along the normal.
    Normal(DVec3),
    /// SliceLocation, for want of positions.
    Location,
    /// Instance numbers only.
    Instance,
}

impl Order {
    fn of(slices: &[Slice]) -> Order {
        let normal = slices.first().and_then(Slice::normal).filter(|_| slices.iter().all(|s| s.position.is_some()));
        match normal {
            Some(normal) => Order::Normal(normal),
            None if slices.iter().all(|s| s.location.is_some()) => Order::Location,
            None => Order::Instance,
        }
    }

    fn height(self, slice: &Slice) -> f64 {
        match self {
            Order::Normal(normal) => slice.position.map_or(0.0, |p| p.dot(normal)),
            Order::Location => slice.location.unwrap_or(0.0),
            Order::Instance => 0.0,
        }
    }

    fn sort(self, slices: &mut [Slice]) {
        slices.sort_by(|a, b| {
            let by_height = self.height(a).total_cmp(&self.height(b));
            let by_number = || a.instance.total_cmp(&b.instance).then_with(|| a.image.name.cmp(&b.image.name));
            by_height
                .then_with(by_number)
                .then(a.frame.cmp(&b.frame))
                .then(a.corner[1].cmp(&b.corner[1]))
                .then(a.corner[0].cmp(&b.corner[0]))
        });
    }

    /// How many slices each position has; the slices are sorted.
    fn counts(self, slices: &[Slice]) -> Vec<usize> {
        let are_together = |a: &Slice, b: &Slice| (self.height(b) - self.height(a)).abs() < SAME_POSITION;
        slices.chunk_by(are_together).map(<[Slice]>::len).collect()
    }

    fn are_all_apart(self, slices: &[Slice]) -> bool {
        matches!(self, Order::Instance) || self.counts(slices).len() == slices.len()
    }
}

/// One slice for each position, in order.
pub(super) fn stacked(slices: Vec<Slice>, found: &mut FileFacts) -> Result<Vec<Slice>, ReadError> {
    let slices = one_segment(without_copies(slices, &mut found.notes), found)?;
    let order = Order::of(&slices);
    let mut slices = one_phase(slices, order, found)?;
    let n_slices = slices.len();
    if !matches!(order, Order::Instance) {
        slices.dedup_by(|later, earlier| (order.height(later) - order.height(earlier)).abs() < SAME_POSITION);
    }
    if slices.len() < n_slices {
        found.notes.push(Note::DuplicateSlices { n_slices: n_slices - slices.len() });
    }
    Ok(slices)
}

/// Files with the same SOPInstanceUID are copies: the first one is taken.
fn without_copies(slices: Vec<Slice>, notes: &mut Vec<Note>) -> Vec<Slice> {
    let n_slices = slices.len();
    let mut seen = HashSet::new();
    let mut is_new = |slice: &Slice| match &slice.image.instance_uid {
        Some(uid) => seen.insert((uid.clone(), slice.frame, slice.corner)),
        None => true,
    };
    let slices: Vec<Slice> = slices.into_iter().filter(|slice| is_new(slice)).collect();
    if slices.len() < n_slices {
        notes.push(Note::DuplicateSlices { n_slices: n_slices - slices.len() });
    }
    slices
}

/// Of a segmentation with several segments one: they may lie at different positions.
fn one_segment(slices: Vec<Slice>, found: &mut FileFacts) -> Result<Vec<Slice>, ReadError> {
    let mut segments: BTreeMap<Option<u32>, Vec<Slice>> = BTreeMap::new();
    for slice in slices {
        segments.entry(slice.segment).or_default().push(slice);
    }
    let name = |segment: &Option<u32>| segment.map_or_else(|| "none".to_owned(), |n| n.to_string());
    let names: Vec<String> = segments.keys().map(name).collect();
    let mut segments: Vec<Vec<Slice>> = segments.into_values().collect();
    match segments.len() {
        0 | 1 => Ok(segments.pop().unwrap_or_default()),
        _ => {
            let chosen = found.choose(ChoiceKind::Array, Entries::Named(names))?;
            Ok(segments.swap_remove(chosen as usize))
        }
    }
}

/// The slices of one time, where positions have several slices.
fn one_phase(mut slices: Vec<Slice>, order: Order, found: &mut FileFacts) -> Result<Vec<Slice>, ReadError> {
    order.sort(&mut slices);
    if order.are_all_apart(&slices) {
        return Ok(slices);
    }
    let groups = by_stated_phase(&slices, order).or_else(|| by_rank(&slices, order));
    let Some(mut groups) = groups else { return Ok(slices) };
    let chosen = found.choose(ChoiceKind::Time, Entries::Numbered(groups.len() as u64))?;
    Ok(groups.swap_remove(chosen as usize))
}

/// Groups by the numbers along dimensions other than space, if each group then has one slice for each position.
fn by_stated_phase(slices: &[Slice], order: Order) -> Option<Vec<Vec<Slice>>> {
    let mut groups: BTreeMap<&[i64], Vec<Slice>> = BTreeMap::new();
    for slice in slices {
        groups.entry(&slice.phase).or_default().push(slice.clone());
    }
    let are_apart = groups.len() > 1 && groups.values().all(|group| order.are_all_apart(group));
    are_apart.then(|| groups.into_values().collect())
}

/// Groups by the order of the slices at each position, if each has the same number of them.
fn by_rank(slices: &[Slice], order: Order) -> Option<Vec<Vec<Slice>>> {
    let counts = order.counts(slices);
    let n_groups = counts[0];
    let are_even = n_groups > 1 && counts.iter().all(|count| *count == n_groups);
    are_even.then(|| (0..n_groups).map(|i| slices.iter().skip(i).step_by(n_groups).cloned().collect()).collect())
}

/// Where the sorted slices lie.
pub(super) fn placement(slices: &[Slice], notes: &mut Vec<Note>) -> (GridPlacement, WorldFrame) {
    let first = &slices[0];
    let [dx, dy] = first.pixel_spacing.unwrap_or_else(|| {
        notes.extend(['x', 'y'].map(|axis| Note::SpacingAssumed { axis, reason: "is not stated" }));
        [1.0, 1.0]
    });
    let (Order::Normal(normal), Some([along_row, along_column])) = (Order::of(slices), first.orientation) else {
        notes.push(Note::OrientationIgnored { what: "position or orientation is missing in some slices" });
        let spacing = DVec3::new(dx, dy, step_without_positions(slices, notes));
        return (GridPlacement::axis_aligned(spacing, DVec3::ZERO), WorldFrame::Plain);
    };
    let positions: Vec<DVec3> = slices.iter().filter_map(|s| s.position).collect();
    let step = match positions.len() {
        1 => normal * stated_step(slices, notes),
        _ => step_through(&positions, normal, notes),
    };
    if let Some(from) = first.step_from.filter(|_| slices.len() > 1) {
        notes.push(Note::StepStated { from, step: step.length() });
    }
    let placement = GridPlacement::from_axes(&[along_row * dx, along_column * dy, step], positions[0]);
    (placement, WorldFrame::Lps)
}

const SLICE_LOCATION: StepFrom = "SliceLocation";

fn step_without_positions(slices: &[Slice], notes: &mut Vec<Note>) -> f64 {
    let locations: Vec<DVec3> = slices.iter().filter_map(|s| Some(DVec3::Z * s.location?)).collect();
    if locations.len() < slices.len() || slices.len() == 1 {
        return stated_step(slices, notes);
    }
    let step = step_through(&locations, DVec3::Z, notes).length();
    notes.push(Note::StepStated { from: SLICE_LOCATION, step });
    step
}

fn stated_step(slices: &[Slice], notes: &mut Vec<Note>) -> f64 {
    match slices[0].stated_step {
        Some(step) => {
            if slices.len() > 1 {
                notes.push(Note::StepStated { from: step.from, step: step.length });
            }
            step.length
        }
        None => {
            notes.push(Note::SpacingAssumed { axis: 'z', reason: "is not stated" });
            1.0
        }
    }
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
