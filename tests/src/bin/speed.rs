//! Speed, in one alternating run: contestants take turns, so that whatever else the machine does befalls all alike.
//!
//! Times are printed, not asserted, unless `--check` is given: then the ratios that the project promises must hold.

use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Context;
use brickfield::bricks::{BrickTree, BuildOptions, Downsampling, build_tree};
use brickfield::cpu::{Discrete, discrete};
use brickfield::frame::{Backend, FramePlan, Mode};
use brickfield::io::{Limits, open};
use brickfield::optics::automatic;
use brickfield::{BackendKind, Residency, Scene, Skipping, Validation, Viewpoint, open_backend, prepare};
use brickfield_conformance::conformance::Tolerance;
use brickfield_conformance::metrics::median;
use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BrickSide, Grid, Image, TransferFunction, Volume};
use clap::Parser;
use serde::Serialize;

/// Times skipping, brick sides, backends, an empty frame and the octree's build, contestants alternating
#[derive(Parser)]
struct Options {
    /// The folder of real volumes
    #[arg(long, env = "BRICKFIELD_DATA", value_name = "FOLDER")]
    data: PathBuf,
    /// Rounds; every contestant runs once a round
    #[arg(long, default_value_t = 7)]
    rounds: usize,
    /// Side of the picture in pixels
    #[arg(long, default_value_t = 512)]
    size: u32,
    /// Only contestants whose name contains this; promises need all
    #[arg(long, value_name = "TEXT", conflicts_with = "check")]
    only: Option<String>,
    /// A part of the adapter's name, or its number
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Fail if a promised ratio is missed
    #[arg(long)]
    check: bool,
    /// Time nothing, but render frames on request, for the `speed` of another build
    #[arg(long, conflicts_with_all = ["check", "json"])]
    serve: bool,
    /// Write the table to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// The times of one contestant, in milliseconds.
#[derive(Clone, Debug, Serialize)]
struct Times {
    what: String,
    backend: String,
    median: f64,
    min: f64,
    max: f64,
}

/// A promise, and what was measured.
#[derive(Clone, Debug, Serialize)]
struct Promise {
    what: String,
    measured: f64,
    at_least: f64,
}

#[derive(Default, Serialize)]
struct Table {
    times: Vec<Times>,
    promises: Vec<Promise>,
}

/// A frame to be timed: from the scene to the picture in memory, bricks resident.
struct Contestant<'a> {
    what: String,
    backend: usize,
    tree: &'a BrickTree,
    scene: Scene,
    residency: Residency,
}

impl<'a> Contestant<'a> {
    /// A scene on each of the backends.
    fn on_each(what: &str, tree: &'a BrickTree, scene: &Scene, backends: &Backends) -> Vec<Contestant<'a>> {
        let on = |backend| Contestant {
            what: what.to_owned(),
            backend,
            tree,
            scene: scene.clone(),
            residency: Residency::default(),
        };
        (0..backends.len()).map(on).collect()
    }

    /// Renders the frame; milliseconds.
    fn frame(&mut self, backend: &mut dyn Backend) -> anyhow::Result<f64> {
        let begin = Instant::now();
        let plan = prepare(self.tree, &self.scene, &mut self.residency)?;
        backend.render(&plan)?;
        Ok(begin.elapsed().as_secs_f64() * 1e3)
    }
}

type Backends = Vec<(BackendKind, Box<dyn Backend>)>;

/// Name, path, and how many times as fast skipping must be.
const VOLUMES: [(&str, &str, f64); 2] = [("engine", "ct/engine.vti", 2.0), ("aneurism", "ct/aneurism.vti", 4.0)];

fn main() -> anyhow::Result<ExitCode> {
    let options = Options::parse();
    let mut table = Table::default();
    let mut backends = opened(&options);
    if options.serve {
        serve(&options, &mut backends)?;
        return Ok(ExitCode::SUCCESS);
    }
    for (name, path, at_least) in VOLUMES {
        let volume = read(&options, path)?;
        skipping(&options, name, at_least, &volume, &mut backends, &mut table)?;
        sides(&options, name, &volume, &mut backends, &mut table)?;
    }
    if options.only.is_none() {
        octree(&options, &mut table)?;
    }
    println!();
    for p in &table.promises {
        let verdict = if p.measured >= p.at_least { "" } else { "  MISSED" };
        println!("{:<72} {:>9.2} (at least {}){verdict}", p.what, p.measured, p.at_least);
    }
    if let Some(path) = &options.json {
        let text = serde_json::to_string_pretty(&table)?;
        fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    let kept = table.promises.iter().all(|p| p.measured >= p.at_least);
    Ok(if kept || !options.check { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn opened(options: &Options) -> Backends {
    let mut backends = Backends::new();
    for kind in BackendKind::ALL {
        match open_backend(kind, options.adapter.as_deref(), Validation::Off) {
            Ok(backend) => {
                let d = backend.describe();
                say(options, &format!("{kind}: {}, {}", d.adapter, d.driver));
                backends.push((kind, backend));
            }
            Err(e) => say(options, &format!("{kind}: absent: {e}")),
        }
    }
    backends
}

/// A line for people: standard output belongs to the asking program while frames are served.
fn say(options: &Options, line: &str) {
    match options.serve {
        true => eprintln!("{line}"),
        false => println!("{line}"),
    }
}

/// A contestant, as it is named to the asking program.
#[derive(Serialize)]
struct Offer<'a> {
    what: &'a str,
    backend: &'static str,
}

/// Renders frames on request. First a line of JSON for each contestant ([`Offer`]), and an empty line. Then for each line of
/// standard input, which is a contestant's number from 0, the milliseconds of a frame of it, until the input ends.
fn serve(options: &Options, backends: &mut Backends) -> anyhow::Result<()> {
    let volumes = VOLUMES.iter().map(|(name, path, _)| Ok((*name, read(options, path)?)));
    let volumes = volumes.collect::<anyhow::Result<Vec<(&str, Volume)>>>()?;
    let trees = volumes.iter().map(|(_, volume)| all_sides(volume)).collect::<anyhow::Result<Vec<_>>>()?;
    let mut contestants = Vec::new();
    for ((name, volume), trees) in volumes.iter().zip(&trees) {
        let middle = &trees.iter().find(|(side, _)| *side == BrickSide::S32).context("bricks of 32")?.1;
        for (what, scene) in skipping_scenes(options, volume)? {
            contestants.extend(Contestant::on_each(&format!("{name}, {what}"), middle, &scene, backends));
        }
        for (side, tree) in trees {
            for (what, scene) in side_scenes(options, volume, *side)? {
                contestants.extend(Contestant::on_each(&format!("{name}, {what}"), tree, &scene, backends));
            }
        }
    }
    contestants.retain(|c| options.only.as_ref().is_none_or(|only| c.what.contains(only)));
    let mut out = std::io::stdout();
    for c in &contestants {
        let offer = Offer { what: &c.what, backend: backends[c.backend].0.name() };
        writeln!(out, "{}", serde_json::to_string(&offer)?)?;
    }
    writeln!(out)?;
    let mut latest = vec![None; backends.len()];
    for line in std::io::stdin().lines() {
        let i: usize = line?.trim().parse().context("a contestant's number")?;
        let contestant = contestants.get_mut(i).with_context(|| format!("no contestant {i}"))?;
        let (latest, backend) = (&mut latest[contestant.backend], &mut backends[contestant.backend].1);
        // A backend holds one set of bricks: a frame that brings them is not timed.
        if *latest != Some(i) {
            contestant.frame(backend.as_mut())?;
            *latest = Some(i);
        }
        writeln!(out, "{}", contestant.frame(backend.as_mut())?)?;
    }
    Ok(())
}

fn read(options: &Options, path: &str) -> anyhow::Result<Volume> {
    Ok(open(&options.data.join(path), &Limits::default())?.volume)
}

fn tree(volume: &Volume, side: BrickSide) -> anyhow::Result<BrickTree> {
    Ok(build_tree(volume, &BuildOptions { side, downsampling: Downsampling::Average, max_bytes: None })?)
}

fn scene(options: &Options, volume: &Volume, mode: Mode, skipping: Skipping) -> anyhow::Result<Scene> {
    let size = UVec2::splat(options.size);
    let camera = Viewpoint::default().camera(volume.grid(), brickfield::io::WorldFrame::Plain, size)?;
    Ok(Scene { mode, skipping, step_voxels: 0.5, ..Scene::new(camera, size, automatic(volume)) })
}

/// With and without skipping in both modes, and a scene that shows nothing.
fn skipping_scenes(options: &Options, volume: &Volume) -> anyhow::Result<[(&'static str, Scene); 5]> {
    let invisible = Scene {
        transfer: TransferFunction::constant(0.0, [1.0; 3])?,
        ..scene(options, volume, Mode::FAST, Skipping::On)?
    };
    Ok([
        ("fast, skipping", scene(options, volume, Mode::FAST, Skipping::On)?),
        ("fast, no skipping", scene(options, volume, Mode::FAST, Skipping::Off)?),
        ("exact, skipping", scene(options, volume, Mode::Exact, Skipping::On)?),
        ("exact, no skipping", scene(options, volume, Mode::Exact, Skipping::Off)?),
        ("nothing to see", invisible),
    ])
}

/// Both modes in bricks of one side.
fn side_scenes(options: &Options, volume: &Volume, side: BrickSide) -> anyhow::Result<[(String, Scene); 2]> {
    Ok([
        (format!("fast, bricks of {side}"), scene(options, volume, Mode::FAST, Skipping::On)?),
        (format!("exact, bricks of {side}"), scene(options, volume, Mode::Exact, Skipping::On)?),
    ])
}

/// The octrees of a volume, one for each brick side.
fn all_sides(volume: &Volume) -> anyhow::Result<Vec<(BrickSide, BrickTree)>> {
    BrickSide::ALL.into_iter().map(|side| Ok((side, tree(volume, side)?))).collect()
}

/// Skipping on against off in fast mode and in exact mode, and a frame that shows nothing, on every backend.
fn skipping(
    options: &Options,
    name: &str,
    at_least: f64,
    volume: &Volume,
    backends: &mut Backends,
    table: &mut Table,
) -> anyhow::Result<()> {
    let tree = tree(volume, BrickSide::S32)?;
    let scenes = skipping_scenes(options, volume)?;
    let mut contestants = Vec::new();
    for (what, scene) in &scenes {
        contestants.extend(Contestant::on_each(&format!("{name}, {what}"), &tree, scene, backends));
    }
    let times = alternate(options, &mut contestants, backends)?;
    if options.only.is_some() {
        table.times.extend(times);
        return Ok(());
    }
    let plan = |i: usize| prepare(&tree, &scenes[i].1, &mut Residency::default());
    let (with, without) = (plan(0)?, plan(1)?);
    let reference = discrete(&with);
    for (kind, backend) in backends.iter_mut() {
        let of = |what: &str| {
            times
                .iter()
                .find(|t| t.backend == kind.name() && t.what == format!("{name}, {what}"))
                .map_or(f64::NAN, |t| t.median)
        };
        table.promises.push(Promise {
            what: format!("{name}, {kind}: without skipping / with, fast mode"),
            measured: of("fast, no skipping") / of("fast, skipping"),
            at_least,
        });
        table.promises.push(Promise {
            what: format!("{name}, {kind}: 20 ms / a frame with nothing to see"),
            measured: 20.0 / of("nothing to see").max(1e-3),
            at_least: 1.0,
        });
        table.promises.push(equal_images(name, kind.name(), backend.as_mut(), [&with, &without], &reference)?);
    }
    let of = |backend: &str| {
        times.iter().find(|t| t.backend == backend && t.what == format!("{name}, fast, skipping")).map(|t| t.median)
    };
    if let (Some(cpu), Some(wgpu)) = (of("cpu"), of("wgpu")) {
        let what = format!("{name}: wgpu's time / cpu's, fast mode, skipping");
        table.promises.push(Promise { what, measured: wgpu / cpu, at_least: 0.7 });
    }
    table.times.extend(times);
    Ok(())
}

/// Whether the pictures with and without skipping are within the rule: 1 if they are.
fn equal_images(
    name: &str,
    backend_name: &str,
    backend: &mut dyn Backend,
    [with, without]: [&FramePlan; 2],
    reference: &Discrete,
) -> anyhow::Result<Promise> {
    let tolerance = Tolerance::of(with, reference, &backend.describe().capabilities)?;
    let holds = |image: &Image<f32>| tolerance.judge(image, &reference.image).complaint.is_none();
    let both = [backend.render(with)?.image, backend.render(without)?.image];
    let equal = both.iter().all(holds);
    let what = format!("{name}, {backend_name}: pictures with and without skipping are within the rule");
    Ok(Promise { what, measured: f64::from(u8::from(equal)), at_least: 1.0 })
}

/// Brick sides against each other.
fn sides(
    options: &Options,
    name: &str,
    volume: &Volume,
    backends: &mut Backends,
    table: &mut Table,
) -> anyhow::Result<()> {
    let trees = all_sides(volume)?;
    let mut contestants = Vec::new();
    for (side, tree) in &trees {
        for (what, scene) in side_scenes(options, volume, *side)? {
            let bricks = prepare(tree, &scene, &mut Residency::default())?.bricks;
            if scene.mode == Mode::Exact {
                let megabytes = bricks.bytes().len() as f64 / 1e6;
                println!("{name}, bricks of {side}: {} resident, {megabytes:.1} MB", bricks.n_bricks());
            }
            contestants.extend(Contestant::on_each(&format!("{name}, {what}"), tree, &scene, backends));
        }
    }
    table.times.extend(alternate(options, &mut contestants, backends)?);
    Ok(())
}

/// Every contestant once a round. The first round warms up (uploads, shaders) and is not counted.
fn alternate(
    options: &Options,
    contestants: &mut [Contestant<'_>],
    backends: &mut Backends,
) -> anyhow::Result<Vec<Times>> {
    let wanted = |c: &Contestant<'_>| options.only.as_ref().is_none_or(|only| c.what.contains(only));
    let mut contestants: Vec<_> = contestants.iter_mut().filter(|c| wanted(c)).collect();
    let mut ms = vec![Vec::new(); contestants.len()];
    for round in 0..=options.rounds {
        for (contestant, ms) in contestants.iter_mut().zip(&mut ms) {
            let backend = &mut backends[contestant.backend].1;
            // A backend holds one set of bricks: the second frame in a row uploads nothing.
            contestant.frame(backend.as_mut())?;
            let frame_ms = contestant.frame(backend.as_mut())?;
            if round > 0 {
                ms.push(frame_ms);
            }
        }
    }
    let times = |(c, ms): (&&mut Contestant<'_>, Vec<f64>)| {
        let (min, max) = ms.iter().fold((f64::INFINITY, 0.0f64), |m, t| (m.0.min(*t), m.1.max(*t)));
        let t =
            Times { what: c.what.clone(), backend: backends[c.backend].0.name().into(), median: median(ms), min, max };
        println!("{:<32} {:<5} {:>9.2} ms  ({:.2} to {:.2})", t.what, t.backend, t.median, t.min, t.max);
        t
    };
    Ok(contestants.iter().zip(ms).map(times).collect())
}

/// The octree of 512^3 voxels of 8 bits, in MB of voxels a second.
fn octree(options: &Options, table: &mut Table) -> anyhow::Result<()> {
    let n = 512usize;
    let grid = Grid::axis_aligned(UVec3::splat(n as u32), DVec3::ONE)?;
    let voxel = |i: usize| ((i % n) ^ (i / n % n) ^ (i / n / n)) as u8;
    let volume = Volume::new(grid, (0..n * n * n).map(voxel).collect::<Vec<u8>>())?;
    let mut rates = Vec::new();
    for _ in 0..options.rounds.min(3) {
        let begin = Instant::now();
        let built = tree(&volume, BrickSide::S32)?;
        rates.push((n * n * n) as f64 / 1e6 / begin.elapsed().as_secs_f64());
        drop(built);
    }
    let measured = median(rates);
    table.promises.push(Promise { what: "octree of 512^3 u8, average, MB/s".into(), measured, at_least: 200.0 });
    Ok(())
}
