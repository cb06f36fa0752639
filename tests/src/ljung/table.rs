//! Error against the full resolution, time, samples and bytes, at several budgets.

use brickfield::bricks::{BlockMemory, BlockSource, block_memory};
use brickfield::cpu::{ContinuousOptions, continuous, discrete};
use brickfield::frame::{Backend, Join, Mode};
use brickfield::lod::{BlockSelection, BudgetSize};
use brickfield::{BlockResidency, Scene, prepare_blocks};
use brickfield_core::glam::DVec3;
use brickfield_core::{Aabb, Image};
use serde::Serialize;

use super::LjungArgs;
use super::data::{DataSet, data_sets};
use super::error::Error;
use super::schemes::{joins, name, style};
use crate::compare::rivals::Rivals;
use crate::paper::{Missed, PaperError, mib, print};
use crate::turns::{Contestant, Spread, take_turns};

/// A line of the table.
#[derive(Clone, Debug, Serialize)]
struct TableRow {
    data: String,
    budget: String,
    backend: &'static str,
    scheme: &'static str,
    error: Error,
    ms: Spread,
    /// Samples along rays, and those at which something is visible.
    n_samples: u64,
    n_visible_samples: u64,
    memory: Memory,
}

/// Bytes of a budget's blocks.
#[derive(Clone, Debug, Serialize)]
struct Memory {
    n_blocks_per_level: Vec<usize>,
    ratio: f64,
    texture_bytes: u64,
    free_bytes: u64,
    ghost_one_side_bytes: u64,
    ghost_both_sides_bytes: u64,
}

pub(super) fn run(args: &LjungArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    print(&format!(
        "{} x {} pixels, steps of {} voxel(s), blocks of {}; levels by the transfer function, one-sample blocks take no texel. Errors are against the continuous\n\
         integral at full resolution. Times are medians of {} rounds in which the schemes took turns, from the scene to the picture, blocks resident. Ghost: bytes of\n\
         bricks of the same samples with a layer of neighbours' on one side, on both.\n",
        args.common.size.x, args.common.size.y, args.common.step, args.blocks, args.common.frames
    ))?;
    let mut rows = Vec::new();
    for data_set in data_sets(args)? {
        rows.extend(of_data_set(args, rivals, &data_set?)?);
    }
    args.common.write_rows("table.json", &rows)?;
    Ok(Vec::new())
}

fn of_data_set(args: &LjungArgs, rivals: &mut Rivals, data: &DataSet) -> Result<Vec<TableRow>, PaperError> {
    let scene = data.scene(args, Mode::Exact)?;
    let answer = answer(data, &scene);
    let mut rows = Vec::new();
    for (budget, size) in budgets(args) {
        let selection = data.select(size)?;
        let memory = Memory::of(data, &selection, &scene)?;
        print(&format!(
            "{}, {budget}: {:?} blocks of levels 0 to {}, {:.1}:1, texture {:.2} MiB ({:.2} free), ghost {:.2} and {:.2} MiB",
            data.name,
            memory.n_blocks_per_level,
            memory.n_blocks_per_level.len() - 1,
            memory.ratio,
            mib(memory.texture_bytes),
            mib(memory.free_bytes),
            mib(memory.ghost_one_side_bytes),
            mib(memory.ghost_both_sides_bytes)
        ))?;
        print(
            "  backend  scheme              RMSE      dE mean  dE 95 %   ms (min to max)               samples    visible",
        )?;
        let counts = counts(data, &selection, &scene)?;
        for backend in &mut rivals.present {
            let of_backend = contest(args, backend.as_mut(), data, &selection, &scene, &answer)?;
            for (i, (join, error, ms)) in of_backend.into_iter().enumerate() {
                let (n_samples, n_visible_samples) = counts[i];
                let backend = backend.describe().backend;
                let row = TableRow {
                    data: data.name.clone(),
                    budget: budget.clone(),
                    backend,
                    scheme: name(join),
                    error,
                    ms,
                    n_samples,
                    n_visible_samples,
                    memory: memory.clone(),
                };
                print(&line(&row))?;
                rows.push(row);
            }
        }
    }
    Ok(rows)
}

fn line(row: &TableRow) -> String {
    let ms = format!("{:.1} ({:.1} to {:.1})", row.ms.median, row.ms.min, row.ms.max);
    format!(
        "  {:<8} {:<18} {:.2e} {:>9.3} {:>8.2}   {ms:<28} {:>9} {:>10}",
        row.backend,
        row.scheme,
        row.error.rmse,
        row.error.delta_e_mean,
        row.error.delta_e_95,
        row.n_samples,
        row.n_visible_samples
    )
}

/// The budgets that are asked for, with their names.
fn budgets(args: &LjungArgs) -> Vec<(String, BudgetSize)> {
    let ratios = args.ratios.iter().map(|ratio| (format!("{ratio}:1"), BudgetSize::Ratio(*ratio)));
    let bytes = (args.budget_mib * f64::from(1 << 20)) as u64;
    ratios.chain([(format!("{} MiB", args.budget_mib), BudgetSize::Bytes(bytes))]).collect()
}

/// The continuous integral at full resolution.
pub(super) fn answer(data: &DataSet, scene: &Scene) -> Image<f64> {
    let options = ContinuousOptions { tolerance: 1e-6, transmittance_floor: 1e-6 };
    let everywhere = Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };
    continuous(&data.volume, &scene.transfer, &scene.camera, scene.size, &everywhere, &options).image
}

impl Memory {
    fn of(data: &DataSet, selection: &BlockSelection, scene: &Scene) -> Result<Memory, PaperError> {
        let (layout, levels) = (data.blocks.layout(), selection.levels.levels());
        let bytes: BlockMemory = block_memory(layout, data.blocks.scalar_type(), levels);
        let mut residency = BlockResidency::default();
        let plan = prepare_blocks(&data.blocks, scene, levels, style(Join::Shared), &mut residency)?;
        let n_levels = usize::from(layout.side().one_sample().0) + 1;
        let texel_bytes = plan.field().slots().format().n_bytes() as u64;
        Ok(Memory {
            n_blocks_per_level: selection.levels.n_blocks_per_level()[..n_levels].to_vec(),
            ratio: bytes.ratio(),
            texture_bytes: plan.field().slots().n_bytes() as u64,
            free_bytes: residency.n_free_texels() * texel_bytes,
            ghost_one_side_bytes: bytes.larger.single_sided_bytes,
            ghost_both_sides_bytes: bytes.larger.double_sided_bytes,
        })
    }
}

/// Samples along rays, and the visible ones, of each scheme: as the f64 sum has them, which looks at all.
fn counts(data: &DataSet, selection: &BlockSelection, scene: &Scene) -> Result<Vec<(u64, u64)>, PaperError> {
    let of = |join| {
        let mut residency = BlockResidency::default();
        let plan = prepare_blocks(&data.blocks, scene, selection.levels.levels(), style(join), &mut residency)?;
        let sum = discrete(&plan);
        Ok((sum.n_samples, sum.n_visible_samples))
    };
    joins().map(of).collect()
}

/// The schemes take turns on a backend.
fn contest(
    args: &LjungArgs,
    backend: &mut dyn Backend,
    data: &DataSet,
    selection: &BlockSelection,
    scene: &Scene,
    answer: &Image<f64>,
) -> Result<Vec<(Join, Error, Spread)>, PaperError> {
    let levels = selection.levels.levels();
    let contestant = |join| Contestant::of_blocks(&data.blocks, levels.to_vec(), style(join), scene.clone());
    let mut contestants: Vec<Contestant<'_>> = joins().map(contestant).collect();
    let mut images = vec![None; contestants.len()];
    let ms = take_turns::<PaperError>(contestants.len(), args.common.frames, |turn| {
        let frame = contestants[turn.contestant].take(turn, backend)?;
        images[turn.contestant] = Some(frame.image);
        Ok(frame.ms)
    })?;
    let row = |(join, (image, ms)): (Join, (Option<Image<f32>>, &Vec<f64>))| {
        let image = image.expect("every scheme has had its turn");
        Ok((join, Error::of(&image, answer)?, Spread::of(ms)))
    };
    joins().zip(images.into_iter().zip(&ms)).map(row).collect()
}
