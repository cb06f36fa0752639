//! An image of a store: its array, its axes, and where it lies.

use brickfield_core::Rescale;
use brickfield_core::glam::{DMat3, DVec3};
use serde_json::Value;

use super::axes::{Axis, VolumeAxes, choose_entries, volume_axes_by_name, volume_axes_of_array};
use super::node::Node;
use crate::error::counted;
use crate::length_unit::common_unit;
use crate::opened::FileFacts;
use crate::placement::{AXES, GridPlacement};
use crate::{Note, ReadError, WorldFrame};

pub(super) struct ZarrImage {
    /// Path of the array in the store, without a slash in front.
    pub(super) path: String,
    /// Whether it is an image of OME-Zarr; a plain array has no place and no spacing.
    is_placed: bool,
    /// Whether all chunks are stored, for this crate packed them.
    pub(super) is_packed: bool,
    /// What samples mean.
    pub(super) rescale: Rescale,
    /// The direction of axes that are not those of the world.
    turn: Option<Turn>,
    axes: Vec<Axis>,
    /// World units per index, and the world position of index 0, for each axis.
    scale: Vec<f64>,
    translation: Vec<f64>,
    channel_names: Vec<String>,
}

/// The world steps of the finest level, and what its transformations say of them.
struct Turn {
    steps: DMat3,
    scale: Vec<f64>,
    translation: Vec<f64>,
}

/// Axes before version 0.3, which names none.
const OLD_AXES: [&str; 5] = ["t", "c", "z", "y", "x"];

const MAX_AXES: usize = 8;

impl ZarrImage {
    pub(super) fn of_multiscale(
        path: String,
        multiscale: &Value,
        dataset: &Value,
        ome: &Value,
    ) -> Result<ZarrImage, ReadError> {
        let axes = match multiscale["axes"].as_array() {
            Some(axes) => axes.iter().map(Axis::of).collect(),
            None => OLD_AXES.map(|name| Axis::of(&name.into())).into(),
        };
        let mut image = ZarrImage::new(path, axes)?;
        image.transform(&dataset["coordinateTransformations"])?;
        image.transform(&multiscale["coordinateTransformations"])?;
        image.is_placed = true;
        let channels = ome["omero"]["channels"].as_array().into_iter().flatten();
        image.channel_names = channels.map(|c| c["label"].as_str().unwrap_or_default().to_owned()).collect();
        Ok(image)
    }

    /// A plain array; `names` is a list of the names of its axes, or null.
    pub(super) fn of_array(path: String, names: &Value, n_axes: usize) -> Result<ZarrImage, ReadError> {
        let axes = (0..n_axes).map(|i| Axis::of(&names[i])).collect();
        ZarrImage::new(path, axes)
    }

    fn new(path: String, axes: Vec<Axis>) -> Result<ZarrImage, ReadError> {
        if axes.is_empty() || axes.len() > MAX_AXES {
            return Err(ReadError::field("number of axes", axes.len(), format!("1 to {MAX_AXES}")));
        }
        let (scale, translation) = (vec![1.0; axes.len()], vec![0.0; axes.len()]);
        let channel_names = Vec::new();
        Ok(ZarrImage {
            path,
            is_placed: false,
            is_packed: false,
            rescale: Rescale::IDENTITY,
            turn: None,
            axes,
            scale,
            translation,
            channel_names,
        })
    }

    /// The image with what its group says of it under keys of our own.
    pub(super) fn in_group(self, group: &Node) -> Result<ZarrImage, ReadError> {
        Ok(ZarrImage { is_packed: group.is_packed(), rescale: group.rescale()?, ..self })
    }

    /// The image with axes of these steps at the finest level, whose transformations are those of `finest`.
    pub(super) fn turned(self, steps: Option<DMat3>, finest: &ZarrImage) -> ZarrImage {
        let (scale, translation) = (finest.scale.clone(), finest.translation.clone());
        ZarrImage { turn: steps.map(|steps| Turn { steps, scale, translation }), ..self }
    }

    /// World units per index along x, y, z, before any direction; 1 where the array has no such axis.
    pub(super) fn scale(&self, volume_axes: VolumeAxes) -> DVec3 {
        along(volume_axes, &self.scale, 1.0)
    }

    /// Which axis is x, y, z, and the entry to read along each of the others.
    pub(super) fn choose(&self, shape: &[u64], found: &mut FileFacts) -> Result<(VolumeAxes, Vec<u64>), ReadError> {
        if shape.len() != self.axes.len() {
            let expected = format!("{}, as the image has axes", self.axes.len());
            return Err(ReadError::field("number of array dimensions", shape.len(), expected));
        }
        let volume_axes = match self.is_placed {
            true => volume_axes_by_name(&self.axes)?,
            false => volume_axes_of_array(&self.axes),
        };
        let entries = choose_entries(&self.axes, shape, volume_axes, &self.channel_names, found)?;
        Ok((volume_axes, entries))
    }

    /// Where the volume lies; lengths in the unit of x, which `found` is told.
    pub(super) fn placement(
        &self,
        volume_axes: VolumeAxes,
        is_spacing_wanted: bool,
        found: &mut FileFacts,
    ) -> GridPlacement {
        if !self.is_placed {
            let assumed = AXES.into_iter().zip(volume_axes).filter(|(_, axis)| axis.is_some() && !is_spacing_wanted);
            let reason = "is not stated";
            found.frame = WorldFrame::Plain;
            found.notes.extend(assumed.map(|(axis, _)| Note::SpacingAssumed { axis, reason }));
            return GridPlacement::axis_aligned(DVec3::ONE, DVec3::splat(0.5));
        }
        let units = volume_axes.map(|axis| axis.and_then(|a| self.axes[a].unit.as_deref()));
        let common = common_unit(units, &mut found.notes);
        found.unit = common.name;
        self.placement_in_own_units(volume_axes).scaled(common.factors)
    }

    fn placement_in_own_units(&self, volume_axes: VolumeAxes) -> GridPlacement {
        let scale = self.scale(volume_axes);
        let translation = along(volume_axes, &self.translation, 0.0);
        let Some(turn) = &self.turn else { return GridPlacement::axis_aligned(scale, translation) };
        let finest = along(volume_axes, &turn.scale, 1.0);
        let first = along(volume_axes, &turn.translation, 0.0);
        let first_sample = first + turn.steps * ((translation - first) / finest);
        GridPlacement { first_sample, steps: turn.steps * DMat3::from_diagonal(scale / finest) }
    }

    /// Applies a list of transformations after the earlier ones.
    fn transform(&mut self, transformations: &Value) -> Result<(), ReadError> {
        for transformation in transformations.as_array().into_iter().flatten() {
            match transformation["type"].as_str() {
                Some("scale") => {
                    let factors = self.vector(transformation, "scale")?;
                    for (i, factor) in factors.into_iter().enumerate() {
                        self.scale[i] *= factor;
                        self.translation[i] *= factor;
                    }
                }
                Some("translation") => {
                    let shifts = self.vector(transformation, "translation")?;
                    self.translation.iter_mut().zip(shifts).for_each(|(t, shift)| *t += shift);
                }
                Some("identity") => {}
                other => {
                    let value = other.unwrap_or("without a type");
                    return Err(ReadError::unsupported("transformation", value, "scale and translation are"));
                }
            }
        }
        Ok(())
    }

    fn vector(&self, transformation: &Value, field: &'static str) -> Result<Vec<f64>, ReadError> {
        let values: Option<Vec<f64>> =
            transformation[field].as_array().and_then(|list| list.iter().map(Value::as_f64).collect());
        let n_axes = self.axes.len();
        values.filter(|v| v.len() == n_axes).ok_or_else(|| {
            ReadError::field(
                field,
                &transformation[field],
                format!("{}, one per axis", counted(n_axes, "number", "numbers")),
            )
        })
    }
}

fn along(volume_axes: VolumeAxes, values: &[f64], missing: f64) -> DVec3 {
    DVec3::from(volume_axes.map(|axis| axis.map_or(missing, |a| values[a])))
}
