//! Frames by turns: with and without skipping, brick sides, backends, an empty frame, and the octree's build.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use brickfield::bricks::{BrickTree, BuildOptions, Downsampling, build_tree};
use brickfield::frame::{Backend, Mode};
use brickfield::io::{OpenOptions, WorldFrame, open};
use brickfield::optics::automatic;
use brickfield::{BackendKind, Scene, Skipping, Validation, Viewpoint, open_backend};
use brickfield_core::glam::UVec2;
use brickfield_core::{BrickSide, ScalarType, TransferFunction, Volume};

use super::budget::{Deadline, Unmeasured};
use super::phantoms::Phantoms;
use super::report::Times;
use super::{Form, PartResult};
use crate::turns::{Contestant, Spread, Turn, order};
use crate::volumes::{phantom_camera, phantom_transfer};

/// Real volumes of the data folder.
const REAL: [(&str, &str); 2] = [("engine", "ct/engine.vti"), ("aneurism", "ct/aneurism.vti")];
/// Least and most rounds.
const ROUNDS: [u32; 2] = [1, 9];

/// A volume, and how it is shown.
struct Exhibit {
    name: String,
    volume: Arc<Volume>,
    scene: Scene,
}

/// A contestant on a backend.
struct Entrant<'a> {
    what: String,
    /// Its place among the backends.
    backend: usize,
    contestant: Contestant<'a>,
}

type Backends = Vec<(BackendKind, Box<dyn Backend>)>;

impl Entrant<'_> {
    fn take(&mut self, turn: Turn, backends: &mut Backends) -> Result<f64, Unmeasured> {
        let (kind, backend) = &mut backends[self.backend];
        let frame = self.contestant.take(turn, backend.as_mut());
        frame.map(|frame| frame.ms).map_err(|e| Unmeasured::new(format!("{}, {kind}", self.what), e.to_string()))
    }
}

/// Times the contestants on every backend, the cpu's included.
pub(super) fn contest(
    form: Form,
    adapter: Option<&str>,
    data: Option<&Path>,
    phantoms: &mut Phantoms,
    deadline: Deadline,
) -> PartResult<(Vec<Times>, Option<f64>)> {
    let mut left_out = Vec::new();
    let octree = octree(form, phantoms, deadline).map_err(|e| left_out.push(e)).ok();
    let mut backends = backends(adapter, &mut left_out);
    let exhibits = exhibits(form, data, phantoms, &mut left_out);
    let mut times = Vec::new();
    for (i, exhibit) in exhibits.iter().enumerate() {
        let share = 1.0 / (exhibits.len() - i) as f64;
        times.extend(of_exhibit(exhibit, &mut backends, (deadline, share), &mut left_out));
    }
    let line = format!("{} contestants, octree {:.0} M voxels/s", times.len(), octree.unwrap_or(f64::NAN));
    PartResult { found: (times, octree), left_out, line }
}

fn backends(adapter: Option<&str>, left_out: &mut Vec<Unmeasured>) -> Backends {
    let mut backends = Backends::new();
    for kind in BackendKind::ALL {
        let adapter = adapter.filter(|_| kind != BackendKind::Cpu);
        match open_backend(kind, adapter, Validation::Off) {
            Ok(backend) => backends.push((kind, backend)),
            Err(e) => left_out.push(Unmeasured::new(format!("contestants on {kind}"), e.to_string())),
        }
    }
    backends
}

fn exhibits(form: Form, data: Option<&Path>, phantoms: &mut Phantoms, left_out: &mut Vec<Unmeasured>) -> Vec<Exhibit> {
    let (voxels, pixels) = form.sizes().contest;
    let size = UVec2::splat(pixels);
    let mut exhibits = Vec::new();
    let mut add = |name: &str, made: Result<Exhibit, String>| match made {
        Ok(exhibit) => exhibits.push(exhibit),
        Err(reason) => left_out.push(Unmeasured::new(format!("contestants of {name}"), reason)),
    };
    add("the phantom", phantom(voxels, phantoms, size));
    for (name, path) in REAL {
        add(
            name,
            match (form, data) {
                (Form::Short, _) => Err("the short form draws no real volumes".to_owned()),
                (_, None) => Err("no --data".to_owned()),
                (_, Some(folder)) => real(name, &folder.join(path), size),
            },
        );
    }
    exhibits
}

fn phantom(voxels: u32, phantoms: &mut Phantoms, size: UVec2) -> Result<Exhibit, String> {
    let volume = phantoms.of(voxels);
    let camera = phantom_camera(volume.grid()).map_err(|e| e.to_string())?;
    let scene = Scene::new(camera, size, phantom_transfer(ScalarType::U8));
    Ok(Exhibit { name: format!("phantom {voxels}^3"), volume, scene })
}

fn real(name: &str, path: &Path, size: UVec2) -> Result<Exhibit, String> {
    let volume = open(path, &OpenOptions::default()).map_err(|e| e.to_string())?.volume;
    let camera = Viewpoint::default().camera(volume.grid(), WorldFrame::Plain, size).map_err(|e| e.to_string())?;
    let scene = Scene::new(camera, size, automatic(&volume));
    Ok(Exhibit { name: name.to_owned(), volume: Arc::new(volume), scene })
}

/// The scenes of an exhibit in bricks of every side, by turns; its rounds have a share of the time that is left.
fn of_exhibit(
    exhibit: &Exhibit,
    backends: &mut Backends,
    (deadline, share): (Deadline, f64),
    left_out: &mut Vec<Unmeasured>,
) -> Vec<Times> {
    let mut trees = Vec::new();
    // 32 first: if time runs out, its scenes have had their turns.
    for side in [BrickSide::S32, BrickSide::S16, BrickSide::S64] {
        let options = BuildOptions { side, downsampling: Downsampling::Average, max_bytes: None };
        match build_tree(&exhibit.volume, &options) {
            Ok(tree) => trees.push((side, tree)),
            Err(e) => left_out.push(Unmeasured::new(format!("{} in bricks of {side}", exhibit.name), e.to_string())),
        }
    }
    let mut entrants = Vec::new();
    for (side, tree) in &trees {
        for (what, scene) in scenes(exhibit, *side) {
            entrants.extend((0..backends.len()).map(|backend| entrant(exhibit, &what, tree, &scene, backend)));
        }
    }
    in_turns(entrants, backends, (deadline, share), left_out)
}

fn entrant<'a>(exhibit: &Exhibit, what: &str, tree: &'a BrickTree, scene: &Scene, backend: usize) -> Entrant<'a> {
    let contestant = Contestant::new(tree, scene.clone());
    Entrant { what: format!("{}, {what}", exhibit.name), backend, contestant }
}

fn scenes(exhibit: &Exhibit, side: BrickSide) -> Vec<(String, Scene)> {
    let scene = |mode, skipping| Scene { mode, skipping, ..exhibit.scene.clone() };
    let sides = [("fast", Mode::FAST), ("exact", Mode::Exact)]
        .map(|(name, mode)| (format!("{name}, bricks of {side}"), scene(mode, Skipping::On)));
    if side != BrickSide::S32 {
        return sides.into();
    }
    let nothing = TransferFunction::constant(0.0, [1.0; 3]).expect("a constant is one");
    let more = [
        ("fast, no skipping".to_owned(), scene(Mode::FAST, Skipping::Off)),
        ("exact, no skipping".to_owned(), scene(Mode::Exact, Skipping::Off)),
        ("nothing to see".to_owned(), Scene { transfer: nothing, ..scene(Mode::FAST, Skipping::On) }),
    ];
    sides.into_iter().chain(more).collect()
}

/// A round that warms up, in a third of the time, for a timed one takes twice as long; then as many timed ones as the share of the rest holds: their number is fixed
/// before the first.
fn in_turns(
    mut entrants: Vec<Entrant<'_>>,
    backends: &mut Backends,
    (deadline, share): (Deadline, f64),
    left_out: &mut Vec<Unmeasured>,
) -> Vec<Times> {
    let (begin, third) = (Instant::now(), deadline.share(1.0 / 3.0));
    entrants.retain_mut(|entrant| {
        let warm_up = Turn { contestant: 0, round: 0, again: false };
        let what = format!("{}, {}", entrant.what, backends[entrant.backend].0);
        let taken = third.admit(&what, 0.0).and_then(|()| entrant.take(warm_up, backends));
        taken.map_err(|e| left_out.push(e)).is_ok()
    });
    // A timed turn has a frame before it that brings the bricks.
    let n_rounds = deadline.share(share).rounds(0.9, 2.0 * begin.elapsed().as_secs_f64(), ROUNDS);
    let mut times = vec![Vec::new(); entrants.len()];
    let mut before = None;
    for round in 0..n_rounds {
        for contestant in order(round, entrants.len()) {
            let turn = Turn { contestant, round: round + 1, again: before == Some(contestant) };
            match entrants[contestant].take(turn, backends) {
                Ok(ms) => times[contestant].push(ms),
                Err(e) => left_out.push(e),
            }
            before = Some(contestant);
        }
    }
    let of = |(e, ms): (&Entrant<'_>, Vec<f64>)| {
        let (what, backend) = (e.what.clone(), backends[e.backend].0.name().to_owned());
        (!ms.is_empty()).then(|| Times { what, backend, n_rounds: ms.len() as u32, ms: Spread::of(&ms) })
    };
    entrants.iter().zip(times).filter_map(of).collect()
}

/// The octree of a large volume, in millions of voxels a second.
fn octree(form: Form, phantoms: &mut Phantoms, deadline: Deadline) -> Result<f64, Unmeasured> {
    deadline.admit("the octree's build", 0.0)?;
    let volume = phantoms.of(form.sizes().octree);
    let begin = Instant::now();
    super::errors::tree(&volume).map_err(|e| Unmeasured::new("the octree's build", e))?;
    Ok(volume.grid().n_voxels() as f64 * 1e-6 / begin.elapsed().as_secs_f64())
}
