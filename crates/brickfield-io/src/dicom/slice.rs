//! One slice: a frame of a file, or a tile of one; where it lies, and what its values mean.

use std::rc::Rc;

use brickfield_core::glam::DVec3;

use super::elements::DataSet;
use super::image::Image;
use super::tags::{self, Tag};
use crate::rescale::StatedRescale;

#[derive(Clone, Debug)]
pub(super) struct Slice {
    pub(super) image: Rc<Image>,
    pub(super) frame: u32,
    /// The first column and row of the slice within its frame.
    pub(super) corner: [u64; 2],
    pub(super) columns: u64,
    pub(super) rows: u64,
    pub(super) instance: f64,
    pub(super) position: Option<DVec3>,
    /// Where [`position`](Self::position) comes from, if it is not the slice's own.
    pub(super) step_from: Option<StepFrom>,
    /// Directions of increasing column and row number.
    pub(super) orientation: Option<[DVec3; 2]>,
    /// World units between columns and between rows.
    pub(super) pixel_spacing: Option<[f64; 2]>,
    pub(super) location: Option<f64>,
    /// The step to the next slice as the file states it, for want of positions.
    pub(super) stated_step: Option<StatedStep>,
    pub(super) rescale: StatedRescale,
    /// The frame's numbers along dimensions that are none of space: time, echo, diffusion.
    pub(super) phase: Vec<i64>,
    /// The segment of a segmentation.
    pub(super) segment: Option<u32>,
    pub(super) stack: Option<String>,
}

/// The step between slices, and the element that states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StatedStep {
    pub(super) length: f64,
    pub(super) from: StepFrom,
}

/// The name of the element that a step comes from.
pub(super) type StepFrom = &'static str;
pub(super) const SPACING_BETWEEN_SLICES: StepFrom = "SpacingBetweenSlices";
pub(super) const SLICE_THICKNESS: StepFrom = "SliceThickness";

/// The elements that speak of one frame: its own functional groups, the shared ones, the file's.
#[derive(Clone, Copy)]
pub(super) struct Scopes<'a> {
    pub(super) frame: Option<&'a DataSet>,
    pub(super) shared: Option<&'a DataSet>,
    pub(super) file: &'a DataSet,
}

impl<'a> Scopes<'a> {
    /// The innermost data set that has an element, which functional groups hold in the sequence `group`.
    fn holder(&self, group: Tag, tag: Tag) -> Option<&'a DataSet> {
        let of_groups = |groups: Option<&'a DataSet>| groups?.items(group).first().filter(|item| item.has(tag));
        let of_file = || Some(self.file).filter(|file| file.has(tag));
        // Nuclear medicine has positions and orientations for each detector.
        let of_detector = || self.file.items(tags::DETECTOR_INFORMATION).first().filter(|item| item.has(tag));
        of_groups(self.frame).or_else(|| of_groups(self.shared)).or_else(of_file).or_else(of_detector)
    }

    fn number(&self, group: Tag, tag: Tag) -> Option<f64> {
        self.holder(group, tag)?.number(tag)
    }

    fn numbers<const N: usize>(&self, group: Tag, tag: Tag) -> Option<[f64; N]> {
        self.holder(group, tag)?.numbers(tag)
    }

    pub(super) fn position(&self) -> Option<DVec3> {
        self.numbers(tags::PLANE_POSITION, tags::IMAGE_POSITION).map(DVec3::from)
    }

    fn orientation(&self) -> Option<[DVec3; 2]> {
        let [a, b, c, d, e, f] = self.numbers(tags::PLANE_ORIENTATION, tags::IMAGE_ORIENTATION)?;
        let (along_row, along_column) = (DVec3::new(a, b, c), DVec3::new(d, e, f));
        let usable = along_row.normalize_or_zero().cross(along_column.normalize_or_zero()).length() > 1e-3;
        usable.then(|| [along_row.normalize(), along_column.normalize()])
    }

    /// PixelSpacing gives the step between rows first.
    fn pixel_spacing(&self) -> Option<[f64; 2]> {
        let spacing = self.numbers(tags::PIXEL_MEASURES, tags::PIXEL_SPACING);
        let [between_rows, between_columns] = spacing.or_else(|| self.file.numbers(tags::IMAGER_PIXEL_SPACING))?;
        (between_rows > 0.0 && between_columns > 0.0).then_some([between_columns, between_rows])
    }

    /// Some writers state a negative step; 0 says nothing.
    fn stated_step(&self) -> Option<StatedStep> {
        let spacing = self.number(tags::PIXEL_MEASURES, tags::SPACING_BETWEEN_SLICES).filter(|s| *s != 0.0);
        let thickness = self.number(tags::PIXEL_MEASURES, tags::SLICE_THICKNESS).filter(|t| *t > 0.0);
        let spacing = spacing.map(|s| StatedStep { length: s.abs(), from: SPACING_BETWEEN_SLICES });
        spacing.or_else(|| thickness.map(|length| StatedStep { length, from: SLICE_THICKNESS }))
    }

    /// A dose grid has a factor instead of a slope.
    fn rescale(&self) -> StatedRescale {
        let slope = self.number(tags::PIXEL_VALUE_TRANSFORMATION, tags::RESCALE_SLOPE);
        let intercept = self.number(tags::PIXEL_VALUE_TRANSFORMATION, tags::RESCALE_INTERCEPT);
        StatedRescale {
            slope: slope.or_else(|| self.file.number(tags::DOSE_GRID_SCALING)).unwrap_or(1.0),
            intercept: intercept.unwrap_or(0.0),
        }
    }

    fn segment(&self) -> Option<u32> {
        self.number(tags::SEGMENT_IDENTIFICATION, tags::REFERENCED_SEGMENT_NUMBER).map(|n| n as u32)
    }

    fn stack(&self) -> Option<String> {
        self.frame?.items(tags::FRAME_CONTENT).first()?.text(tags::STACK_ID)
    }

    /// The numbers along the dimensions that are none of space, else the position in time and the echo.
    fn phase(&self) -> Vec<i64> {
        let content = self.frame.and_then(|frame| frame.items(tags::FRAME_CONTENT).first());
        let values = content.map(|c| c.all_numbers(tags::DIMENSION_INDEX_VALUES)).unwrap_or_default();
        let dimensions = self.file.items(tags::DIMENSION_INDICES);
        if !values.is_empty() && values.len() == dimensions.len() {
            let of_other_kind = |dimension: &DataSet| !is_spatial(dimension);
            let numbered = dimensions.iter().zip(&values).filter(|(dimension, _)| of_other_kind(dimension));
            return numbered.map(|(_, value)| *value as i64).collect();
        }
        let time = content.and_then(|c| c.number(tags::TEMPORAL_POSITION_INDEX));
        let time = time.or_else(|| self.file.number(tags::TEMPORAL_POSITION));
        [time, self.file.number(tags::ECHO_NUMBERS)].map(|n| n.unwrap_or(0.0) as i64).to_vec()
    }

    pub(super) fn slice(&self, image: &Rc<Image>, frame: u32) -> Slice {
        Slice {
            image: image.clone(),
            frame,
            corner: [0, 0],
            columns: image.columns,
            rows: image.rows,
            instance: self.file.number(tags::INSTANCE_NUMBER).unwrap_or(0.0),
            position: self.position(),
            step_from: None,
            orientation: self.orientation(),
            pixel_spacing: self.pixel_spacing(),
            location: self.file.number(tags::SLICE_LOCATION).filter(|_| image.n_frames == 1),
            stated_step: self.stated_step(),
            rescale: self.rescale(),
            phase: self.phase(),
            segment: self.segment(),
            stack: self.stack(),
        }
    }
}

/// Whether a dimension counts positions, stacks or segments, which have fields of their own.
fn is_spatial(dimension: &DataSet) -> bool {
    let [group, element] = dimension.numbers(tags::DIMENSION_INDEX_POINTER).unwrap_or([0.0; 2]);
    matches!(
        (group as u16, element as u16),
        tags::IN_STACK_POSITION
            | tags::IMAGE_POSITION
            | tags::IMAGE_POSITION_VOLUME
            | tags::STACK_ID
            | tags::REFERENCED_SEGMENT_NUMBER
    )
}

impl Slice {
    pub(super) fn n_samples(&self) -> usize {
        (self.columns * self.rows) as usize
    }

    pub(super) fn normal(&self) -> Option<DVec3> {
        let [along_row, along_column] = self.orientation?;
        Some(along_row.cross(along_column).normalize())
    }
}
