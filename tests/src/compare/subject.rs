//! What is rendered: a file's volume or the phantom, with its scene.

use brickfield::Scene;
use brickfield::core::glam::DVec3;
use brickfield::core::{Aabb, Camera, Projection, Volume};
use brickfield::io::WorldFrame;
use brickfield::options::Subject;

use super::{CompareArgs, CompareError};
use crate::volumes::{Phantom, phantom};

/// A volume, ready to be rendered, and its scene (steps, rules and modes vary).
pub(super) struct Exhibit {
    pub(super) name: String,
    pub(super) volume: Volume,
    pub(super) subject: Subject,
    pub(super) scene: Scene,
}

pub(super) fn exhibit(args: &CompareArgs) -> Result<Exhibit, CompareError> {
    match &args.file {
        Some(path) => {
            let opened = args.input.open(path)?;
            opened.notes.iter().for_each(|note| eprintln!("note: {note}"));
            let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
            let transfer = args.view.transfer(&opened.volume)?;
            let subject = Subject { frame: opened.frame, tree: args.tree.build(&opened.volume)?, transfer };
            let scene = scene(args, &subject)?;
            Ok(Exhibit { name, volume: opened.volume, subject, scene })
        }
        None => of_phantom(args),
    }
}

/// The phantom with its own transfer function and camera, unless others are asked for.
fn of_phantom(args: &CompareArgs) -> Result<Exhibit, CompareError> {
    let Phantom { volume, transfer, camera } = phantom();
    let transfer = if args.view.transfer == "auto" { transfer } else { args.view.transfer(&volume)? };
    let subject = Subject { frame: WorldFrame::Lps, tree: args.tree.build(&volume)?, transfer };
    let mut scene = scene(args, &subject)?;
    if args.default_camera {
        scene.camera = camera;
    }
    Ok(Exhibit { name: "phantom".to_owned(), volume, subject, scene })
}

fn scene(args: &CompareArgs, subject: &Subject) -> Result<Scene, CompareError> {
    let view = &args.view;
    let camera = view.camera.camera(subject.tree.grid(), subject.frame, view.size)?;
    Ok(Scene { detail: view.lod, clip: view.clip, ..Scene::new(camera, view.size, subject.transfer.clone()) })
}

/// The scene's clip box (index space) in sample space; without one, all space.
pub(super) fn clip_in_sample_space(exhibit: &Exhibit) -> Aabb {
    match exhibit.scene.clip {
        Some(b) => Aabb { min: b.min - 0.5, max: b.max - 0.5 },
        None => Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY },
    }
}

pub(super) fn projection_text(camera: &Camera) -> String {
    match camera.projection() {
        Projection::Perspective { fov_y } => format!("perspective {:.3} degrees", fov_y.to_degrees()),
        Projection::Orthographic { height } => format!("orthographic {height} units"),
    }
}
