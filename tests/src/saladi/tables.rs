//! Tables 1 and 2: loading, processing without and with light, and rendering, by the number of slices.
//!
//! ```text
//! loading      the file, to voxels in memory
//! processing   from the blocks of the volume to a plan: the texture's bytes, with light the normals of surface voxels, and the planes
//! rendering    a frame, blocks resident, on each backend
//! ```
//!
//! Departures from the paper: slices are samples along the volume's longest axis at a level of 2^l averages, in place of every n-th slice
//! of the file; blocks, with all levels, are built once. Normals are those of the voxels at full resolution, averaged: processing with light
//! does not fall with the slices. The shade is computed while a frame is rendered, not before: the light may move.

use std::time::Instant;

use brickfield::bricks::BlockSource;
use brickfield::frame::{Division, Placement, Target};
use brickfield::lod::BlockLevels;
use brickfield::{BlockResidency, Scene, Technique, prepare_blocks};
use brickfield_core::glam::DVec3;
use brickfield_core::{BlockSide, Level};
use brickfield_optics::Normals;
use serde::Serialize;

use super::SaladiArgs;
use super::data::{DataSet, files, style};
use crate::compare::rivals::Rivals;
use crate::metrics::median;
use crate::paper::{Missed, PaperError, print};
use crate::turns::{Contestant, Ratio, Spread, take_turns};

/// A line of the table.
#[derive(Clone, Debug, Serialize)]
struct TableRow {
    data: String,
    n_slices: u32,
    n_planes: u32,
    level: u8,
    loading_ms: f64,
    blocks_ms: f64,
    /// Without and with light.
    processing_ms: [f64; 2],
    rendering: Vec<Rendering>,
}

/// Frames of a backend.
#[derive(Clone, Debug, Serialize)]
struct Rendering {
    backend: &'static str,
    /// Without and with light.
    ms: [Spread; 2],
    /// Of the time with light over that without.
    ratio: Ratio,
}

/// Largest blocks: their level of one sample is the coarsest.
const SIDE: BlockSide = BlockSide::V32;
/// The coarsest level that has several samples a block.
const COARSEST: u8 = SIDE.one_sample().0 - 1;
/// Rounds of the processing, which no backend takes part in.
const N_PROCESSINGS: usize = 3;
/// Without and with light.
const LIGHTS: [Option<Normals>; 2] = [None, Some(Normals::Surface)];

pub(super) fn run(args: &SaladiArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    print(&format!(
        "{} x {} pixels, exact, flat blocks of {SIDE}, planes parallel to the picture (the cpu casts rays to their samples), objects from {} % of the range\n\
         of values on, light at a place on surface voxels. Processing: medians of {N_PROCESSINGS} from the blocks to the plan; rendering: medians of {} rounds.",
        args.common.size.x, args.common.size.y, args.threshold, args.common.frames
    ))?;
    let mut rows = Vec::new();
    for (name, path) in files(args)? {
        let data = DataSet::of_file(SIDE, name, &path)?;
        let dims = data.blocks.layout().dims();
        print(&format!(
            "\n{}: {} x {} x {}; loading {:.0} ms, blocks of all levels {:.0} ms\n{}",
            data.name,
            dims.x,
            dims.y,
            dims.z,
            data.loading_ms,
            data.blocks_ms,
            header(rivals)
        ))?;
        for level in (0..=COARSEST).rev().map(Level) {
            let row = of_level(args, rivals, &data, level)?;
            print(&line(&row))?;
            rows.push(row);
        }
    }
    args.common.write_rows("tables.json", &rows)?;
    Ok(Vec::new())
}

fn header(rivals: &Rivals) -> String {
    let backends = rivals.present.iter().map(|backend| backend.describe().backend);
    let columns: Vec<String> = backends.map(|name| format!("{:<28}", format!("{name} ms, lit, ratio"))).collect();
    format!("  slices/planes  level  processing ms, with light   {}", columns.join(" "))
}

fn line(row: &TableRow) -> String {
    let rendering = row.rendering.iter().map(|rendering| {
        let [unlit, lit] = rendering.ms.map(|ms| ms.median);
        format!("{:<28}", format!("{unlit:.1}, {lit:.1}, {:.2}", rendering.ratio.median))
    });
    let [unlit, lit] = row.processing_ms;
    format!(
        "  {:<13} {:>6}  {:<27} {}",
        format!("{}/{}", row.n_slices, row.n_planes),
        row.level,
        format!("{unlit:.0}, {lit:.0} ({:.2})", lit / unlit),
        rendering.collect::<Vec<_>>().join(" ")
    )
}

fn of_level(args: &SaladiArgs, rivals: &mut Rivals, data: &DataSet, level: Level) -> Result<TableRow, PaperError> {
    let n_slices = level.dims_of(data.blocks.layout().dims()).max_element();
    let n_planes = 2 * n_slices;
    let levels = BlockLevels::uniform(*data.blocks.layout(), level);
    let scene = |normals| sliced(args, data, normals, (level, n_planes));
    let scenes = [scene(LIGHTS[0])?, scene(LIGHTS[1])?];
    let processing = |scene: &Scene| {
        let mut times = Vec::new();
        for _ in 0..N_PROCESSINGS {
            let begin = Instant::now();
            prepare_blocks(&data.blocks, scene, levels.levels(), style(), &mut BlockResidency::default())?;
            times.push(begin.elapsed().as_secs_f64() * 1e3);
        }
        Ok::<_, PaperError>(median(times))
    };
    let processing_ms = [processing(&scenes[0])?, processing(&scenes[1])?];
    let mut rendering = Vec::new();
    for backend in &mut rivals.present {
        let contestant =
            |scene: &Scene| Contestant::of_blocks(&data.blocks, levels.levels().to_vec(), style(), scene.clone());
        let mut contestants = scenes.each_ref().map(contestant);
        let ms = take_turns::<PaperError>(LIGHTS.len(), args.common.frames, |turn| {
            Ok(contestants[turn.contestant].take(turn, backend.as_mut())?.ms)
        })?;
        let backend = backend.describe().backend;
        let ratio = Ratio::of(&ms[1], &ms[0]);
        rendering.push(Rendering { backend, ms: [Spread::of(&ms[0]), Spread::of(&ms[1])], ratio });
    }
    let (loading_ms, blocks_ms) = (data.loading_ms, data.blocks_ms);
    let data = data.name.clone();
    Ok(TableRow { data, n_slices, n_planes, level: level.0, loading_ms, blocks_ms, processing_ms, rendering })
}

/// The volume on so many planes, parallel to the picture.
fn sliced(
    args: &SaladiArgs,
    data: &DataSet,
    normals: Option<Normals>,
    (level, n_planes): (Level, u32),
) -> Result<Scene, PaperError> {
    let scene = data.scene(args, normals)?;
    let (grid, forward) = (data.blocks.grid(), scene.camera.forward());
    let b = grid.world_box();
    let corner =
        |i: usize| DVec3::from([0, 1, 2].map(|axis| if i >> axis & 1 == 1 { b.max[axis] } else { b.min[axis] }));
    let depths = (0..8).map(|i| corner(i).dot(forward));
    let (near, far) = depths.fold((f64::INFINITY, f64::NEG_INFINITY), |(near, far), d| (near.min(d), far.max(d)));
    // Planes of a block are as many times farther apart as its samples.
    let step = (far - near) / f64::from(n_planes) / f64::from(level.stride());
    Ok(Scene {
        technique: Technique::Polygons(Target::Float32),
        placement: Placement::ViewportPlanes,
        division: Division::Brick,
        step_voxels: step / grid.spacing().min_element(),
        ..scene
    })
}
