//! From a file to its slices: one frame, many frames with functional groups, frames at even or stated steps, mosaics.

use std::rc::Rc;

use brickfield_core::glam::DVec3;

use super::elements::DataSet;
use super::image::{Image, series};
use super::mosaic;
use super::slice::{SPACING_BETWEEN_SLICES, Scopes, Slice, StepFrom};
use super::source::open_data_set;
use super::tags;
use crate::{DataFiles, Limits, ReadError};

/// A file that gave no slices.
pub(super) struct Unread {
    pub(super) name: String,
    /// The series it is of, if that much could be read.
    pub(super) series: Option<String>,
    pub(super) fault: ReadError,
}

impl Unread {
    /// The fault with the name of the file.
    pub(super) fn into_fault(self) -> ReadError {
        ReadError::decoder(format!("slice {:?}", self.name), self.fault)
    }
}

/// The slices of a file; none of an index (DICOMDIR).
pub(super) fn read_slices(name: &str, files: &dyn DataFiles, limits: &Limits) -> Result<Vec<Slice>, Box<Unread>> {
    let unread = |series, fault| Box::new(Unread { name: name.to_owned(), series, fault });
    let mut data_set = open_data_set(name, files, limits).map_err(|fault| unread(None, fault))?;
    let (parsed, outcome) = data_set.parse();
    let elements = parsed.elements;
    if elements.has(tags::DIRECTORY_RECORDS) {
        return Ok(Vec::new());
    }
    let slices = outcome
        .and_then(|()| Image::new(name, &elements, parsed.pixels, data_set.codec))
        .and_then(|image| slices_of(Rc::new(image), &elements));
    slices.map_err(|fault| unread(Some(series(&elements)).filter(|uid| !uid.is_empty()), fault))
}

fn slices_of(image: Rc<Image>, elements: &DataSet) -> Result<Vec<Slice>, ReadError> {
    if mosaic::is_mosaic(elements) {
        return mosaic::tiles(image, elements);
    }
    let own = elements.items(tags::PER_FRAME_FUNCTIONAL_GROUPS);
    let shared = elements.items(tags::SHARED_FUNCTIONAL_GROUPS).first();
    let scopes = |frame: u32| Scopes { frame: own.get(frame as usize), shared, file: elements };
    let mut slices: Vec<Slice> = (0..image.n_frames).map(|frame| scopes(frame).slice(&image, frame)).collect();
    let are_placed = own.iter().any(|frame| !frame.items(tags::PLANE_POSITION).is_empty());
    if slices.len() > 1 && !are_placed {
        place_evenly(&mut slices, elements);
    }
    Ok(slices)
}

/// The elements state the first frame's position only: the others follow along the normal.
fn place_evenly(slices: &mut [Slice], elements: &DataSet) {
    let first = &slices[0];
    let (Some(position), Some(normal)) = (first.position, first.normal()) else { return };
    let Some((offsets, step_from)) = offsets(first, slices.len(), normal, elements) else {
        slices.iter_mut().for_each(|slice| slice.position = None);
        return;
    };
    for (slice, offset) in slices.iter_mut().zip(offsets) {
        slice.position = Some(position + normal * offset);
        slice.step_from = step_from;
    }
}

/// The distance of each frame from the first, along the normal; and the element that states the step, if a step is stated.
fn offsets(first: &Slice, n_frames: usize, normal: DVec3, elements: &DataSet) -> Option<(Vec<f64>, Option<StepFrom>)> {
    let stated = elements.all_numbers(tags::GRID_FRAME_OFFSETS);
    if stated.len() == n_frames && stated.iter().all(|offset| offset.is_finite()) {
        // Those that begin with 0 are distances along the normal, others are positions along the patient's z (PS3.3,
        // C.8.8.3.2).
        let sign = if stated[0] != 0.0 && normal.z < 0.0 { -1.0 } else { 1.0 };
        return Some((stated.iter().map(|offset| sign * (offset - stated[0])).collect(), None));
    }
    let step = first.stated_step?;
    let is_backwards = step.from == SPACING_BETWEEN_SLICES
        && elements.text(tags::SOP_CLASS_UID).as_deref() == Some(NUCLEAR_MEDICINE)
        && elements.number(tags::SPACING_BETWEEN_SLICES).is_some_and(|spacing| spacing < 0.0);
    let step_length = if is_backwards { -step.length } else { step.length };
    Some(((0..n_frames).map(|i| i as f64 * step_length).collect(), Some(step.from)))
}

/// The one class whose SpacingBetweenSlices may be negative: against the normal (PS3.3, C.8.4.15).
const NUCLEAR_MEDICINE: &str = "1.2.840.10008.5.1.4.1.1.20";
