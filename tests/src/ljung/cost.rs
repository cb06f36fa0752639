//! Schemes against the nearest block: time, on the same data in the same run; slices of which the interiors come first; the inside of
//! transparent blocks.

use brickfield::bricks::BlockSource;
use brickfield::frame::{Backend, Division, Join, Mode, Placement, Slices, Target};
use brickfield::interp::Neighbourhood;
use brickfield::lod::{BlockLevels, BudgetSize};
use brickfield::{BlockStyle, Scene, Technique, TransparentBlocks};
use brickfield_core::glam::UVec3;
use brickfield_core::{Interblock, Level};

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
    n_positions: u64,
    /// Positions whose value comes from 1 to 8 blocks.
    by_blocks: [u64; 8],
    /// Sums of blocks: of all positions, and of the worst of each eight.
    n_blocks: u64,
    n_blocks_of_worst: u64,
}

impl Counts {
    /// At eight voxels in a row, everywhere in blocks that are not transparent.
    fn of(data: &DataSet, levels: &[Level]) -> Counts {
        let (layout, scheme) = (data.blocks.layout(), Interblock::MaximumDistance);
        let mut counts = Counts { n_positions: 0, by_blocks: [0; 8], n_blocks: 0, n_blocks_of_worst: 0 };
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
                    let row = (x..extent.x.min(x + ROW)).map(|x| n_at(first + UVec3::new(x, y, z)));
                    let mut worst = 0;
                    for n in row {
                        counts.by_blocks[n - 1] += 1;
                        (counts.n_positions, counts.n_blocks) = (counts.n_positions + 1, counts.n_blocks + n as u64);
                        worst = worst.max(n as u64);
                    }
                    counts.n_blocks_of_worst += worst * u64::from(ROW.min(extent.x - x));
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
        let share = |n: u64| n as f64 / self.n_positions.max(1) as f64;
        let by_blocks: Vec<String> = self.by_blocks.iter().map(|n| format!("{:.1} %", 100.0 * share(*n))).collect();
        write!(
            f,
            "values come from {:.2} blocks in the mean, {:.2} in the worst of {ROW} in a row; from 1, 2, ... 8 blocks: {}",
            share(self.n_blocks),
            share(self.n_blocks_of_worst),
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
        let mut contestants = [TransparentBlocks::Blended, TransparentBlocks::Empty]
            .map(|inside| Contestant::of_blocks(&data.blocks, levels.to_vec(), style(inside), scene.clone()));
        let mut pictures = [None, None];
        let ms = take_turns::<PaperError>(2, args.common.frames, |turn| {
            let frame = contestants[turn.contestant].take(turn, backend.as_mut())?;
            pictures[turn.contestant] = Some(frame.image);
            Ok(frame.ms)
        })?;
        let of_both = pictures.iter().flatten().map(|picture| Error::of(picture, &answer));
        let errors: Vec<String> =
            of_both.map(|error| error.map(|error| error.to_string())).collect::<Result<_, _>>()?;
        print(&format!(
            "{}, at 32:1, exact, {}: inside of transparent blocks blended or empty: {}; time {}",
            data.name,
            backend.describe().backend,
            errors.join("; or "),
            Ratio::of(&ms[0], &ms[1])
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
        let mut contestants = [Slices::InteriorsFirst, Slices::Together].map(|slices| {
            let style = BlockStyle { slices, ..style(BLENDED) };
            Contestant::of_blocks(&data.blocks, levels.to_vec(), style, scene.clone())
        });
        let ms = take_turns::<PaperError>(2, args.common.frames, |turn| {
            Ok(contestants[turn.contestant].take(turn, backend.as_mut())?.ms)
        })?;
        let name = backend.describe().backend;
        print(&format!(
            "{}, at 32:1, exact, {name}: slices with interiors first / together: {}",
            data.name,
            Ratio::of(&ms[0], &ms[1])
        ))?;
    }
    Ok(())
}

fn ratio(
    args: &LjungArgs,
    backend: &mut dyn Backend,
    data: &DataSet,
    levels: &[Level],
    mode: Mode,
) -> Result<Ratio, PaperError> {
    let scene = data.scene(args, mode)?;
    let joins = [BLENDED, Join::Shared];
    let mut contestants =
        joins.map(|join| Contestant::of_blocks(&data.blocks, levels.to_vec(), style(join), scene.clone()));
    let ms = take_turns::<PaperError>(2, args.common.frames, |turn| {
        Ok(contestants[turn.contestant].take(turn, backend)?.ms)
    })?;
    Ok(Ratio::of(&ms[0], &ms[1]))
}
