//! Requests to a process that draws, and its answers: lines of JSON. `tests/peers/serve.py` has the same by example.

use std::path::PathBuf;

use brickfield::core::glam::DVec3;
use brickfield::core::{Camera, CameraError, Knot, Projection, ScalarType};
use serde::{Deserialize, Serialize};

/// A request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "ask", rename_all = "kebab-case")]
pub(super) enum Ask {
    /// Read a volume, and be ready to draw it. Comes first, and once.
    Open(Box<Opening>),
    /// Draw a frame.
    Frame(Drawing),
    /// Draw a frame, and write its picture: rows from the top, RGBA, f32, little-endian, linear, over black.
    Picture { frame: Drawing, path: PathBuf },
}

/// Who is to draw what.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Opening {
    /// `cpu fast`, `vtk-gpu`.
    pub(super) contestant: String,
    pub(super) scene: SceneFile,
    /// Samples along a brick's side, and the adapter: for contestants that have them.
    pub(super) brick: u32,
    pub(super) adapter: Option<String>,
}

/// A scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct SceneFile {
    /// An NRRD file, and where in it the voxels begin. Sample (0, 0, 0) lies at the world's origin.
    pub(super) path: PathBuf,
    pub(super) offset: u64,
    pub(super) dims: [u32; 3],
    pub(super) spacing: [f64; 3],
    /// As numpy names it.
    pub(super) dtype: String,
    /// The side of the picture in pixels.
    pub(super) size: u32,
    pub(super) fov_degrees: f64,
    pub(super) knots: Vec<Knot>,
}

/// A frame to draw.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Drawing {
    pub(super) step_voxels: f64,
    pub(super) camera: View,
}

/// Where a picture is taken from, in world units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct View {
    pub(super) eye: [f64; 3],
    pub(super) target: [f64; 3],
    pub(super) up: [f64; 3],
}

/// An answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "answer", rename_all = "kebab-case")]
pub(super) enum Answer {
    Opened(Opened),
    /// The frame is complete.
    Frame(Drawn),
    Failed {
        reason: String,
    },
}

/// A contestant that is ready.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Opened {
    /// Of the software.
    pub(super) version: String,
    /// What it draws with.
    pub(super) device: String,
    pub(super) domain: Domain,
    /// The tangent of its field of view, as a part of what was asked for: below 1 where pixels lie on a grid of their own.
    pub(super) view: f64,
    /// What was done once, in its order.
    pub(super) phases: Vec<Part>,
}

/// Where a contestant ends the volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Domain {
    /// At the faces of the outer voxels; values are constant beyond the outer sample centres.
    Voxels,
    /// At the outer sample centres.
    Centres,
}

/// A frame's times: all of it, by the clock and of all threads of the process; and its parts, where they are known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Drawn {
    pub(super) wall_ms: f64,
    pub(super) cpu_ms: f64,
    pub(super) parts: Vec<Part>,
}

/// A part of the work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Part {
    pub name: String,
    pub wall_ms: f64,
    /// Where it was counted.
    #[serde(default)]
    pub cpu_ms: Option<f64>,
}

impl View {
    /// The camera of a field of view.
    ///
    /// # Errors
    /// As [`Camera::look_at`].
    pub(super) fn camera(&self, fov_y: f64) -> Result<Camera, CameraError> {
        let [eye, target, up] = [self.eye, self.target, self.up].map(DVec3::from);
        Camera::look_at(eye, target, up, Projection::Perspective { fov_y })
    }
}

/// A type's name in numpy, little-endian.
pub(super) const fn numpy_name(scalar: ScalarType) -> &'static str {
    match scalar {
        ScalarType::U8 => "u1",
        ScalarType::I8 => "i1",
        ScalarType::U16 => "<u2",
        ScalarType::I16 => "<i2",
        ScalarType::U32 => "<u4",
        ScalarType::I32 => "<i4",
        ScalarType::F32 => "<f4",
        ScalarType::F64 => "<f8",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The form that the Python side reads and writes.
    #[test]
    fn peers_are_asked_and_answer_in_lines_of_json() {
        let camera = View { eye: [9.0, 0.0, 0.0], target: [0.0; 3], up: [0.0, 0.0, 1.0] };
        let frame = Drawing { step_voxels: 0.5, camera };
        let text = serde_json::to_string(&Ask::Frame(frame)).unwrap();
        let camera = r#"{"eye":[9.0,0.0,0.0],"target":[0.0,0.0,0.0],"up":[0.0,0.0,1.0]}"#;
        assert_eq!(text, format!(r#"{{"ask":"frame","step_voxels":0.5,"camera":{camera}}}"#));
        let ask = Ask::Picture { frame, path: "a.f32".into() };
        let text = serde_json::to_string(&ask).unwrap();
        let expected = format!(r#"{{"ask":"picture","frame":{{"step_voxels":0.5,"camera":{camera}}},"path":"a.f32"}}"#);
        assert_eq!(text, expected);
        assert_eq!(serde_json::from_str::<Ask>(&text).unwrap(), ask);
        let opened = r#"{"answer":"opened","version":"VTK 9","device":"2 threads","domain":"centres","view":0.5,
            "phases":[{"name":"read","wall_ms":3.5,"cpu_ms":2}]}"#;
        let Answer::Opened(opened) = serde_json::from_str(opened).unwrap() else { panic!("{opened}") };
        assert_eq!((opened.domain, opened.phases[0].cpu_ms), (Domain::Centres, Some(2.0)));
        let failed = serde_json::from_str(r#"{"answer":"failed","reason":"no module"}"#).unwrap();
        assert_eq!(Answer::Failed { reason: "no module".to_owned() }, failed);
    }
}
