//! The multiscales metadata: which array is the finest level, its axes, and where it lies.

use brickfield_core::glam::DVec3;
use serde_json::Value;
use zarrs::storage::ReadableStorage;

use super::json::read_json;
use crate::choice::Entries;
use crate::error::counted;
use crate::opened::FileFacts;
use crate::placement::GridPlacement;
use crate::{ChoiceKind, Note, ReadError};

/// The finest level of one image.
pub(super) struct ZarrImage {
    /// Path of the array in the store, with a slash in front.
    pub(super) path: String,
    axes: Vec<Axis>,
    /// World units per index, and the world position of index 0, for each axis.
    scale: Vec<f64>,
    translation: Vec<f64>,
}

struct Axis {
    name: String,
    unit: Option<String>,
}

/// Which array axis is x, y, z; none where the array is flat.
pub(super) type VolumeAxes = [Option<usize>; 3];

impl ZarrImage {
    pub(super) fn read(store: &ReadableStorage, found: &mut FileFacts) -> Result<ZarrImage, ReadError> {
        let (prefix, multiscales) = find_multiscales(store)?;
        let names = multiscales.iter().map(|m| m["name"].as_str().unwrap_or_default().to_owned()).collect();
        let multiscale = &multiscales[found.choose(ChoiceKind::Image, Entries::Named(names))? as usize];
        let dataset = &multiscale["datasets"][0];
        let path = dataset["path"].as_str().ok_or(ReadError::Missing { field: "multiscales/datasets/path" })?;
        check_path(path)?;
        let axes: Vec<Axis> = multiscale["axes"].as_array().into_iter().flatten().map(Axis::of).collect();
        if axes.is_empty() || axes.len() > MAX_AXES {
            return Err(ReadError::field("number of axes", axes.len(), format!("1 to {MAX_AXES}")));
        }
        let (scale, translation) = (vec![1.0; axes.len()], vec![0.0; axes.len()]);
        let mut image = ZarrImage { path: format!("{prefix}/{path}"), axes, scale, translation };
        image.transform(&dataset["coordinateTransformations"])?;
        image.transform(&multiscale["coordinateTransformations"])?;
        Ok(image)
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

    /// Finds x, y and z by name; notes the parts that are left out of longer other axes.
    pub(super) fn volume_axes(&self, shape: &[u64], notes: &mut Vec<Note>) -> Result<VolumeAxes, ReadError> {
        if shape.len() != self.axes.len() {
            let expected = format!("{}, as the image has axes", self.axes.len());
            return Err(ReadError::field("number of array dimensions", shape.len(), expected));
        }
        let find = |name: &str| self.axes.iter().position(|a| a.name.eq_ignore_ascii_case(name));
        let volume_axes = ["x", "y", "z"].map(find);
        if volume_axes[0].is_none() || volume_axes[1].is_none() {
            return Err(ReadError::Missing { field: "an axis named x and one named y" });
        }
        for (axis, n_entries) in shape.iter().enumerate() {
            if !volume_axes.contains(&Some(axis)) && *n_entries > 1 {
                notes.push(Note::FirstOfAxis { axis: self.axes[axis].name.clone(), n_entries: *n_entries });
            }
        }
        Ok(volume_axes)
    }

    pub(super) fn placement(&self, volume_axes: VolumeAxes) -> GridPlacement {
        let scale = volume_axes.map(|axis| axis.map_or(1.0, |a| self.scale[a]));
        let translation = volume_axes.map(|axis| axis.map_or(0.0, |a| self.translation[a]));
        GridPlacement::axis_aligned(DVec3::from(scale), DVec3::from(translation))
    }

    pub(super) fn unit(&self, volume_axes: VolumeAxes) -> Option<String> {
        volume_axes.into_iter().flatten().find_map(|axis| self.axes[axis].unit.clone())
    }
}

const MAX_AXES: usize = 8;

impl Axis {
    /// An object with a name, or the bare name that versions before 0.4 had.
    fn of(value: &Value) -> Axis {
        let name = value.as_str().or(value["name"].as_str()).unwrap_or_default().to_owned();
        Axis { name, unit: value["unit"].as_str().map(str::to_owned) }
    }
}

/// The images of the folder, or of its part `0` where Bio-Formats wrote it; never an empty list.
fn find_multiscales(store: &ReadableStorage) -> Result<(String, Vec<Value>), ReadError> {
    for prefix in ["", "/0"] {
        let key = |name: &str| format!("{prefix}/{name}").trim_start_matches('/').to_owned();
        let v3 = read_json(store, &key("zarr.json"))?.map(|json| json["attributes"]["ome"].clone());
        let ome = match v3 {
            Some(ome) => Some(ome),
            None => read_json(store, &key(".zattrs"))?,
        };
        let multiscales = ome.and_then(|ome| ome["multiscales"].as_array().cloned()).unwrap_or_default();
        if !multiscales.is_empty() {
            return Ok((prefix.to_owned(), multiscales));
        }
    }
    Err(ReadError::Missing { field: "multiscales (in zarr.json or .zattrs)" })
}

/// A path must stay in the folder.
fn check_path(path: &str) -> Result<(), ReadError> {
    let stays =
        !path.is_empty() && path.split('/').all(|part| !matches!(part, "" | "." | "..")) && !path.contains('\\');
    if stays { Ok(()) } else { Err(ReadError::field("datasets/path", path, "a path within the folder")) }
}
