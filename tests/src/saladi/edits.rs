//! Edits of the transfer function: the normals that they concern, against all computed anew.

use std::time::Instant;

use brickfield::bricks::{BlockSource, SurfaceNormals};
use brickfield_core::{Knot, Level, TransferFunction};
use serde::Serialize;

use super::SaladiArgs;
use super::data::DataSet;
use crate::paper::{Missed, PaperError, print};
use crate::turns::{Bound, Claim, Ratio, Spread, take_turns};

/// An edit.
#[derive(Clone, Debug, Serialize)]
pub(super) struct EditRow {
    data: String,
    edit: &'static str,
    n_voxels: u64,
    n_examined: u64,
    n_recomputed: u64,
    n_changed_blocks: usize,
    n_blocks: usize,
    edit_ms: Spread,
    anew_ms: Spread,
    /// Of the time of all over that of the edit.
    ratio: Ratio,
}

/// Of so many voxels an edit that computes one or fewer is claimed to take less time than all.
const FEW: u64 = 50;
/// An edit, and the part of the range at which objects begin after it.
const EDITS: [(&str, f64); 3] =
    [("1/256 of the range", 1.0 / 256.0), ("1/32 of the range", 1.0 / 32.0), ("1/8 of the range", 0.125)];

pub(super) fn run(args: &SaladiArgs, data: &DataSet, missed: &mut Vec<Missed>) -> Result<Vec<EditRow>, PaperError> {
    let part = f64::from(args.threshold) / 100.0;
    let before = data.transfer(part);
    let (normals, first) = SurfaceNormals::none(&data.blocks).after(&data.blocks, &before)?;
    print(&format!(
        "  normals of all: {} of {} voxels read, {} computed, in {} of {} blocks; {:.1} MiB\n{HEADER}",
        first.n_examined,
        first.n_voxels,
        first.n_recomputed,
        first.changed.len(),
        data.blocks.layout().n_blocks_total(),
        normals.n_bytes() as f64 / f64::from(1 << 20)
    ))?;
    let moved = EDITS.map(|(what, by)| (what, data.transfer(part + by)));
    let mut rows = Vec::new();
    for (edit, transfer) in moved.into_iter().chain([("colours and opacities alone", recoloured(&before))]) {
        let row = timed(args, data, &normals, (edit, &transfer), missed)?;
        print(&line(&row))?;
        // Of a large edit most blocks are concerned.
        if row.n_recomputed <= row.n_voxels / FEW {
            let what = format!("{}, {edit}: the normals of all over those of the edit, time", data.name);
            missed.extend(Missed::of_claim(&Claim::of_ratio(what, row.ratio, Bound::Above(1.0))));
        }
        rows.push(row);
    }
    Ok(rows)
}

const HEADER: &str = "  threshold moved by              read    computed  blocks    edit ms (min to max)      all ms (min to max)       all of the edit's";

fn line(row: &EditRow) -> String {
    let ms = |ms: &Spread| format!("{:.1} ({:.1} to {:.1})", ms.median, ms.min, ms.max);
    format!(
        "  {:<27} {:>8} {:>11} {:>7}    {:<25} {:<25} {}",
        row.edit,
        row.n_examined,
        row.n_recomputed,
        row.n_changed_blocks,
        ms(&row.edit_ms),
        ms(&row.anew_ms),
        row.ratio
    )
}

/// Other colours and opacities; no value becomes transparent, or visible.
fn recoloured(transfer: &TransferFunction) -> TransferFunction {
    let change = |knot: &Knot| Knot { extinction: 0.7 * knot.extinction, color: [0.4, 0.6, 0.9], ..*knot };
    TransferFunction::new(transfer.knots().iter().map(change).collect()).expect("knots at the same values")
}

/// The edit and all anew take turns; their bytes are equal.
fn timed(
    args: &SaladiArgs,
    data: &DataSet,
    before: &SurfaceNormals,
    (edit, transfer): (&'static str, &TransferFunction),
    missed: &mut Vec<Missed>,
) -> Result<EditRow, PaperError> {
    let none = SurfaceNormals::none(&data.blocks);
    let mut last = [None, None];
    let ms = take_turns::<PaperError>(2, args.common.frames, |turn| {
        let from = if turn.contestant == 0 { before } else { &none };
        let begin = Instant::now();
        let after = from.after(&data.blocks, transfer)?;
        let ms = begin.elapsed().as_secs_f64() * 1e3;
        last[turn.contestant] = Some(after);
        Ok(ms)
    })?;
    let [Some((edited, work)), Some((anew, _))] = last else { unreachable!("both had their turns") };
    let layout = data.blocks.layout();
    for block in layout.blocks() {
        if edited.codes(block, Level(0))? != anew.codes(block, Level(0))? {
            missed
                .push(Missed::of_pictures(format!("{}, {edit}: block {block} has other normals than anew", data.name)));
        }
    }
    Ok(EditRow {
        data: data.name.clone(),
        edit,
        n_voxels: work.n_voxels,
        n_examined: work.n_examined,
        n_recomputed: work.n_recomputed,
        n_changed_blocks: work.changed.len(),
        n_blocks: layout.n_blocks_total(),
        edit_ms: Spread::of(&ms[0]),
        anew_ms: Spread::of(&ms[1]),
        ratio: Ratio::of(&ms[1], &ms[0]),
    })
}
