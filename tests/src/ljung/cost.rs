//! Schemes against the nearest block: time, on the same data in the same run; slices of which the interiors come first; the inside of
//! transparent blocks.

use brickfield::bricks::BlockSource;
use brickfield::frame::{Backend, Division, Join, Mode, Placement, Slices, Target};
use brickfield::interp::Neighbourhood;
use brickfield::lod::{BlockLevels, BudgetSize};
use brickfield::{BlockStyle, Scene, Technique, TransparentBlocks};
use brickfield_core::glam::UVec3;
use brickfield_core::{Image, Interblock, Level};

use super::LjungArgs;
use super::data::{DataSet, data_sets};
use super::error::Error;
use super::schemes::style;
use super::table::answer;
use crate::compare::rivals::Rivals;
use crate::paper::{Missed, PaperError, print};
use crate::turns::{Bound, Claim, Contestant, Ratio, take_turns};

/// The paper: 3 to 15 times. Aims for blocks at 32:1, and where all resolutions are equal.
const AIMS: [f64; 2] = [1.3, 1.05];
const BLENDED: Join = Join::Blend(Interblock::MaximumDistance);

pub(super) fn run(args: &LjungArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    print(&format!(
        "{} x {} pixels, steps of {} voxel(s), blocks of {}; maximum distance over the nearest block: the median ratio of {} rounds and its interval.\n",
        args.common.size.x, args.common.size.y, args.common.step, args.blocks, args.common.frames
    ))?;
    let mut claims = Vec::new();
    for data_set in data_sets(args)? {
        let data_set = data_set?;
        let layout = *data_set.blocks.layout();
        let selected = data_set.select(BudgetSize::Ratio(32.0))?.levels;
        print(&format!("{}, at 32:1: {}", data_set.name, Counts::of(&data_set, selected.levels())))?;
        compare_insides(args, rivals, &data_set, selected.levels())?;
        compare_slices(args, rivals, &data_set, selected.levels())?;
        let cases = [("at 32:1", selected, AIMS[0]), ("all equal", BlockLevels::uniform(layout, Level(0)), AIMS[1])];
        for (what, levels, aim) in cases {
            for mode in [Mode::Exact, Mode::FAST] {
                for backend in &mut rivals.present {
                    let ratio = ratio(args, backend.as_mut(), &data_set, levels.levels(), mode)?;
                    let mode_name = if mode == Mode::Exact { "exact" } else { "fast" };
                    let name = backend.describe().backend;
                    let claim = format!("{}, {what}, {mode_name}, {name}: maximum distance / nearest", data_set.name);
                    let claim = Claim::of_ratio(claim, ratio, Bound::AtMost(aim));
                    print(&claim.to_string())?;
                    claims.push(claim);
                }
            }
        }
    }
    args.common.write_rows("cost.json", &claims)?;
    // Aims, not claims: a miss is printed, and explained in the notes.
    Ok(Vec::new())
}

/// How many blocks a value is interpolated from.
struct Counts {
    /// Positions whose value comes from 1 to 8 blocks.
    by_blocks: [u64; 8],
    /// The same, each position counted as the worst of its row.
    by_blocks_of_worst: [u64; 8],
}

impl Counts {
    /// At eight voxels in a row, everywhere in blocks that are not transparent.
    fn of(data: &DataSet, levels: &[Level]) -> Counts {
        let (layout, scheme) = (data.blocks.layout(), Interblock::MaximumDistance);
        let mut counts = Counts { by_blocks: [0; 8], by_blocks_of_worst: [0; 8] };
        let n_at = |voxel: UVec3| {
            let around = Neighbourhood::around(layout, voxel.as_dvec3().to_array());
            let weights = around.weights(layout, scheme, |block| levels[layout.ordinal(block)]);
            weights.iter().enumerate().filter(|(b, weight)| **weight > 0.0 && around.block(*b).is_some()).count()
        };
        for (block, summary) in layout.blocks().zip(data.blocks.summaries()) {
            if data.transfer.is_transparent(summary.range) {
                continue;
            }
            let (first, extent) = (layout.first_voxel(block), layout.extent(block));
            for z in 0..extent.z {
                for (x, y) in (0..extent.y).flat_map(|y| (0..extent.x).step_by(ROW as usize).map(move |x| (x, y))) {
                    let row: Vec<usize> =
                        (x..extent.x.min(x + ROW)).map(|x| n_at(first + UVec3::new(x, y, z))).collect();
                    row.iter().for_each(|n| counts.by_blocks[n - 1] += 1);
                    let worst = row.iter().copied().max().unwrap_or(1);
                    counts.by_blocks_of_worst[worst - 1] += row.len() as u64;
                }
            }
        }
        counts
    }
}

/// Positions that a processor takes at once.
const ROW: u32 = 8;

impl std::fmt::Display for Counts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let n_positions = self.by_blocks.iter().sum::<u64>().max(1) as f64;
        let share = |n: u64| n as f64 / n_positions;
        let mean = |by_blocks: &[u64; 8]| share((1..).zip(by_blocks).map(|(n, times)| n * times).sum());
        let by_blocks: Vec<String> = self.by_blocks.iter().map(|n| format!("{:.1} %", 100.0 * share(*n))).collect();
        write!(
            f,
            "values come from {:.2} blocks in the mean, {:.2} in the worst of {ROW} in a row; from 1, 2, ... 8 blocks: {}",
            mean(&self.by_blocks),
            mean(&self.by_blocks_of_worst),
            by_blocks.join(", ")
        )
    }
}

/// The inside of transparent blocks, blended or empty: errors against the full resolution, and the ratio of times.
fn compare_insides(args: &LjungArgs, rivals: &mut Rivals, data: &DataSet, levels: &[Level]) -> Result<(), PaperError> {
    let scene = data.scene(args, Mode::Exact)?;
    let answer = answer(data, &scene);
    for backend in &mut rivals.present {
        let style = |transparent| BlockStyle { transparent, ..style(BLENDED) };
        let contestants = [TransparentBlocks::Blended, TransparentBlocks::Empty]
            .map(|inside| Contestant::of_blocks(&data.blocks, levels.to_vec(), style(inside), scene.clone()));
        let (ratio, pictures) = duel(args, backend.as_mut(), contestants)?;
        let of_both = pictures.iter().map(|picture| Error::of(picture, &answer));
        let errors: Vec<String> =
            of_both.map(|error| error.map(|error| error.to_string())).collect::<Result<_, _>>()?;
        print(&format!(
            "{}, at 32:1, exact, {}: inside of transparent blocks blended or empty: {}; time {}",
            data.name,
            backend.describe().backend,
            errors.join("; or "),
            ratio
        ))?;
    }
    Ok(())
}

/// Slices whose interiors come first, over slices drawn together: the ratio of times.
fn compare_slices(args: &LjungArgs, rivals: &mut Rivals, data: &DataSet, levels: &[Level]) -> Result<(), PaperError> {
    let scene = data.scene(args, Mode::Exact)?;
    let scene = Scene {
        technique: Technique::Polygons(Target::Float32),
        placement: Placement::ViewportPlanes,
        division: Division::Brick,
        ..scene
    };
    for backend in &mut rivals.present {
        let contestants = [Slices::InteriorsFirst, Slices::Together].map(|slices| {
            let style = BlockStyle { slices, ..style(BLENDED) };
            Contestant::of_blocks(&data.blocks, levels.to_vec(), style, scene.clone())
        });
        let (ratio, _) = duel(args, backend.as_mut(), contestants)?;
        let name = backend.describe().backend;
        print(&format!("{}, at 32:1, exact, {name}: slices with interiors first / together: {ratio}", data.name))?;
    }
    Ok(())
}

/// The blended blocks over the nearest.
fn ratio(
    args: &LjungArgs,
    backend: &mut dyn Backend,
    data: &DataSet,
    levels: &[Level],
    mode: Mode,
) -> Result<Ratio, PaperError> {
    let scene = data.scene(args, mode)?;
    let contestants = [BLENDED, Join::Shared]
        .map(|join| Contestant::of_blocks(&data.blocks, levels.to_vec(), style(join), scene.clone()));
    Ok(duel(args, backend, contestants)?.0)
}

/// Two contestants in turns: the time of the first over that of the second, and their pictures.
fn duel(
    args: &LjungArgs,
    backend: &mut dyn Backend,
    mut contestants: [Contestant<'_>; 2],
) -> Result<(Ratio, [Image<f32>; 2]), PaperError> {
    let mut pictures = [None, None];
    let ms = take_turns::<PaperError>(2, args.common.frames, |turn| {
        let frame = contestants[turn.contestant].take(turn, backend)?;
        pictures[turn.contestant] = Some(frame.image);
        Ok(frame.ms)
    })?;
    Ok((Ratio::of(&ms[0], &ms[1]), pictures.map(|picture| picture.expect("both had their turns"))))
}
