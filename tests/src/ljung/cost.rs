//! Schemes against the nearest block: time, on the same data in the same run.

use brickfield::bricks::BlockSource;
use brickfield::frame::{Backend, Join, Mode};
use brickfield::lod::{BlockLevels, BudgetSize};
use brickfield_core::{Interblock, Level};

use super::LjungArgs;
use super::data::{DataSet, data_sets};
use super::schemes::style;
use crate::compare::rivals::Rivals;
use crate::paper::{Missed, PaperError, print};
use crate::turns::{Bound, Claim, Contestant, Ratio, take_turns};

/// The paper: 3 to 15 times. Aims for blocks at 32:1, and where all resolutions are equal.
const AIMS: [f64; 2] = [1.3, 1.05];

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

fn ratio(
    args: &LjungArgs,
    backend: &mut dyn Backend,
    data: &DataSet,
    levels: &[Level],
    mode: Mode,
) -> Result<Ratio, PaperError> {
    let scene = data.scene(args, mode)?;
    let joins = [Join::Blend(Interblock::MaximumDistance), Join::Shared];
    let mut contestants =
        joins.map(|join| Contestant::of_blocks(&data.blocks, levels.to_vec(), style(join), scene.clone()));
    let ms = take_turns::<PaperError>(2, args.common.frames, |turn| {
        Ok(contestants[turn.contestant].take(turn, backend)?.ms)
    })?;
    Ok(Ratio::of(&ms[0], &ms[1]))
}
