//! The volume that is rendered, a file's or the phantom, with its scene.

use brickfield::Scene;
use brickfield::core::glam::DVec3;
use brickfield::core::{Aabb, Camera, Projection};
use brickfield::io::WorldFrame;
use brickfield::options::Subject;

use super::{CompareArgs, CompareError};
use crate::volumes::{Phantom, phantom};

/// A volume, ready to be rendered, and its scene (steps, rules and modes vary).
pub(super) struct Exhibit {
    pub(super) name: String,
    pub(super) subject: Subject,
    pub(super) scene: Scene,
}

pub(super) fn exhibit(args: &CompareArgs) -> Result<Exhibit, CompareError> {
    match &args.file {
        Some(path) => {
            let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
            let subject = Subject::open(path, &args.input, &args.tree, &args.view)?;
            let scene = args.view.scene(&subject)?;
            Ok(Exhibit { name, subject, scene })
        }
        None => of_phantom(args),
    }
}

/// The phantom with its own transfer function and camera, unless others are asked for.
fn of_phantom(args: &CompareArgs) -> Result<Exhibit, CompareError> {
    let Phantom { volume, transfer, camera } = phantom();
    let transfer = if args.view.transfer == "auto" { transfer } else { args.view.transfer(&volume)? };
    let subject = Subject { frame: WorldFrame::Lps, tree: args.tree.build(&volume)?, transfer, volume };
    let mut scene = args.view.scene(&subject)?;
    if args.default_camera {
        scene.camera = camera;
    }
    Ok(Exhibit { name: "phantom".to_owned(), subject, scene })
}

/// The scene's clip box (index space) in sample space; without one, all space.
pub(super) fn clip_in_sample_space(exhibit: &Exhibit) -> Aabb {
    match exhibit.scene.clip {
        Some(b) => Aabb { min: b.min - 0.5, max: b.max - 0.5 },
        None => Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY },
    }
}

pub(crate) fn projection_text(camera: &Camera) -> String {
    match camera.projection() {
        Projection::Perspective { fov_y } => format!("perspective {:.3} degrees", fov_y.to_degrees()),
        Projection::Orthographic { height } => format!("orthographic {height} units"),
    }
}
