//! Levels after an edit of the transfer function: time, and the bytes that move.

use std::sync::Arc;
use std::time::Instant;

use brickfield::bricks::{BlockOptions, BlockSource, build_blocks};
use brickfield::frame::Join;
use brickfield::io::WorldFrame;
use brickfield::lod::{BlockBudget, BlockErrors, BudgetSize, OneSampleBlocks, Slab, select_block_levels};
use brickfield::{BlockResidency, Scene, Viewpoint, prepare_blocks};
use brickfield_core::glam::UVec3;
use brickfield_core::{BlockSide, Interblock, Knot, ScalarType, TransferFunction};

use super::LjungArgs;
use super::schemes::style;
use crate::metrics::median;
use crate::paper::{Missed, PaperError, print};
use crate::turns::{Bound, Claim};
use crate::volumes::{Phantom, phantom_of};

/// 32 x 32 x 64 blocks of 8.
const DIMS: UVec3 = UVec3::new(256, 256, 512);
/// Milliseconds on two cores.
const BOUND: f64 = 50.0;
/// Edits.
const N_EDITS: usize = 9;

pub(super) fn run(args: &LjungArgs) -> Result<Vec<Missed>, PaperError> {
    let Phantom { volume, transfer, .. } = phantom_of(DIMS, ScalarType::U8);
    let blocks = build_blocks(Arc::new(volume), &BlockOptions { side: BlockSide::V8, ..BlockOptions::default() })?;
    let layout = *blocks.layout();
    let slab = Slab::of_block(&layout, blocks.grid());
    let budget = BlockBudget {
        size: BudgetSize::Ratio(32.0),
        scalar: blocks.scalar_type(),
        sample_bytes: 1,
        one_sample: OneSampleBlocks::Free,
    };
    let camera = Viewpoint::default().camera(blocks.grid(), WorldFrame::Lps, args.common.size)?;
    let mut errors = BlockErrors::estimate(&layout, blocks.summaries(), &transfer, slab)?;
    let mut residency = BlockResidency::default();
    let (mut times, mut lines) = (Vec::new(), Vec::new());
    for edit in 0..=N_EDITS {
        let edited = edited(&transfer, edit);
        let begin = Instant::now();
        let n_concerned = errors.update(blocks.summaries(), &edited)?;
        let selection = select_block_levels(&layout, errors.levels(), None, &budget)?;
        let ms = begin.elapsed().as_secs_f64() * 1e3;
        let scene = Scene::new(camera, args.common.size, edited);
        let join = Join::Blend(Interblock::MaximumDistance);
        prepare_blocks(&blocks, &scene, selection.levels.levels(), style(join), &mut residency)?;
        // The first is no edit: all blocks are new.
        if edit > 0 {
            times.push(ms);
            let copied = residency.copied();
            lines.push(format!(
                "edit {edit}: {n_concerned} blocks estimated anew, {ms:.1} ms; {} blocks with other levels, {} bytes moved of {} held",
                copied.n_bricks, copied.n_bytes, selection.n_bytes
            ));
        }
    }
    print(&format!("{} blocks of 8, at 32:1, on {} threads", layout.n_blocks_total(), rayon::current_num_threads()))?;
    lines.iter().try_for_each(|line| print(line))?;
    let claim = Claim::of("reselection after an edit, median, ms".to_owned(), median(times), Bound::AtMost(BOUND));
    print(&claim.to_string())?;
    Ok(Missed::of_claim(&claim).into_iter().collect())
}

/// The transfer function with one knot moved, another one in each edit.
fn edited(transfer: &TransferFunction, edit: usize) -> TransferFunction {
    let mut knots: Vec<Knot> = transfer.knots().to_vec();
    if edit > 0 && knots.len() > 2 {
        let i = 1 + (edit - 1) % (knots.len() - 2);
        knots[i].extinction = 1.3 * knots[i].extinction + 0.01;
    }
    TransferFunction::new(knots).expect("knots at the same values")
}
