//! This build's side of the protocol: a backend in a mode, which draws frames of a scene on request.

use std::io::{self, BufRead, Write};

use brickfield::bricks::{BrickTree, BuildOptions, build_tree};
use brickfield::core::glam::UVec2;
use brickfield::core::{Image, TransferFunction};
use brickfield::frame::{Backend, Timing};
use brickfield::options::values;
use brickfield::{BackendKind, Residency, Scene};

use super::protocol::{Answer, Ask, Domain, Drawing, Drawn, Opened, Opening, Part};
use crate::compare::rivals::Rivals;
use crate::frames::Phase;
use crate::memory::cpu_seconds;
use crate::report::{Machine, commit};
use crate::turns::tree_frame;

/// A backend that has read a volume.
struct Drawer {
    tree: BrickTree,
    backend: Box<dyn Backend>,
    residency: Residency,
    /// But for the camera and the step.
    scene: Scene,
    fov_y: f64,
}

/// Draws on request, until the requests end.
///
/// # Errors
/// A stream that fails. What is wrong with a request is an answer.
pub(super) fn serve(requests: impl BufRead, mut answers: impl Write) -> io::Result<()> {
    let mut drawer = None;
    for line in requests.lines() {
        let answer = answer(&line?, &mut drawer).unwrap_or_else(|reason| Answer::Failed { reason });
        writeln!(answers, "{}", serde_json::to_string(&answer).expect("an answer is plain data"))?;
        answers.flush()?;
    }
    Ok(())
}

fn answer(line: &str, drawer: &mut Option<Drawer>) -> Result<Answer, String> {
    let ask = serde_json::from_str(line).map_err(|e| format!("{line:?} is no request: {e}"))?;
    if let Ask::Open(opening) = ask {
        let (opened, ready) = Drawer::open(*opening)?;
        *drawer = Some(ready);
        return Ok(Answer::Opened(opened));
    }
    let drawer = drawer.as_mut().ok_or("no scene is open")?;
    match ask {
        Ask::Frame(drawing) => Ok(Answer::Frame(drawer.draw(&drawing)?.0)),
        Ask::Picture { frame, path } => {
            let (drawn, image) = drawer.draw(&frame)?;
            let bytes: Vec<u8> = image.pixels().iter().flatten().flat_map(|channel| channel.to_le_bytes()).collect();
            std::fs::write(&path, bytes).map_err(|e| format!("{}: {e}", path.display()))?;
            Ok(Answer::Frame(drawn))
        }
        Ask::Open(_) => unreachable!("it has been answered"),
    }
}

impl Drawer {
    fn open(opening: Opening) -> Result<(Opened, Drawer), String> {
        let Opening { contestant, scene, brick, adapter } = opening;
        let (kind, mode) =
            contestant.split_once(' ').ok_or_else(|| format!("{contestant:?} is no backend and mode"))?;
        let kind: BackendKind = kind.parse().map_err(|e| format!("{e}"))?;
        let side = values::brick_side(&brick.to_string())?;
        let transfer = TransferFunction::new(scene.knots).map_err(|e| e.to_string())?;
        let camera = super::protocol::View { eye: [0.0; 3], target: [1.0, 0.0, 0.0], up: [0.0, 0.0, 1.0] };
        let fov_y = scene.fov_degrees.to_radians();
        let camera = camera.camera(fov_y).map_err(|e| e.to_string())?;
        let base = Scene::new(camera, UVec2::splat(scene.size), transfer);
        let (read, opened) = Phase::of(|| brickfield::io::open(&scene.path, &Default::default()));
        let volume = opened.map_err(|e| e.to_string())?.volume;
        let (octree, tree) = Phase::of(|| build_tree(&volume, &BuildOptions { side, ..BuildOptions::default() }));
        let (device, mut rivals) = Phase::of(|| Rivals::open(&[kind], adapter.as_deref()));
        let backend = rivals.present.pop().ok_or_else(|| rivals.infos[0].absent.clone().unwrap_or_default())?;
        let description = backend.describe();
        let opened = Opened {
            version: format!("{}, {} build", commit(), Machine::here().build),
            device: format!("{}, {}", description.adapter, description.driver),
            domain: Domain::Voxels,
            view: 1.0,
            phases: vec![part("read", read), part("octree", octree), part("device", device)],
        };
        let scene = Scene { mode: values::mode(mode)?, ..base };
        let tree = tree.map_err(|e| e.to_string())?;
        Ok((opened, Drawer { tree, backend, residency: Residency::default(), scene, fov_y }))
    }

    fn draw(&mut self, drawing: &Drawing) -> Result<(Drawn, Image<f32>), String> {
        self.scene.camera = drawing.camera.camera(self.fov_y).map_err(|e| e.to_string())?;
        self.scene.step_voxels = drawing.step_voxels;
        let before = cpu_seconds();
        let frame = tree_frame(&self.tree, &self.scene, &mut self.residency, self.backend.as_mut());
        let taken = cpu_seconds().zip(before).map(|(after, before)| 1e3 * (after - before));
        let cpu_ms = taken.ok_or("this system does not tell the CPU time of a process")?;
        let frame = frame.map_err(|e| e.to_string())?;
        let Timing { upload_ms, wall_ms, read_back_ms, .. } = frame.timing;
        let parts =
            [("prepare", frame.prepare_ms), ("upload", upload_ms), ("render", wall_ms), ("read-back", read_back_ms)];
        let parts = parts.map(|(name, wall_ms)| Part { name: name.to_owned(), wall_ms, cpu_ms: None });
        Ok((Drawn { wall_ms: frame.ms, cpu_ms, parts: parts.into() }, frame.image))
    }
}

fn part(name: &str, phase: Phase) -> Part {
    Part { name: name.to_owned(), wall_ms: phase.wall_ms, cpu_ms: phase.cpu_ms }
}
