//! Table 1: algorithms I to IV and their alternatives.

use std::time::Instant;

use brickfield::frame::Backend;
use brickfield::{BackendKind, Scene};
use brickfield_core::Image;
use serde::Serialize;

use super::TongArgs;
use super::algorithm::Algorithm;
use super::data::{DataSet, Renderer, data_sets};
use super::samples::n_samples;
use crate::compare::rivals::Rivals;
use crate::metrics::{greatest_difference, median};
use crate::paper::{Missed, PaperError, mib, print};
use crate::turns::{Ratio, Spread, take_turns};

/// A line of the table.
#[derive(Clone, Debug, Serialize)]
struct TableRow {
    data: String,
    empty_share: f64,
    renderer: &'static str,
    backend: &'static str,
    algorithm: &'static str,
    /// Bytes of the texture's samples; bytes that the first frame brought to the device.
    stored_bytes: u64,
    uploaded_bytes: u64,
    n_samples: u64,
    /// From the volume's min-max arrays to the plan: classification, trimming, merging, gathering.
    processing_ms: f64,
    ms: Spread,
    /// Of its time over that of algorithm I.
    ratio: Ratio,
    /// The greatest difference of a channel from the picture of algorithm I.
    difference: f64,
}

/// Rounds of the processing, which no backend takes part in.
const N_PROCESSINGS: usize = 3;
/// Pictures may differ by this much: f32 leaves out samples that it rounds to nearly nothing.
const ROUNDING: f64 = 2e-5;

pub(super) fn run(args: &TongArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    print(&format!(
        "{} x {} pixels, steps of {} voxel(s), exact, bricks of {}. Samples: segments that are looked at. Processing: classification, trimming, merging and gathering;\n\
         frames: from the scene to the picture, bricks resident, medians of {} rounds in which the algorithms took turns. S: time saved of algorithm I's, with its interval.\n",
        args.common.size.x, args.common.size.y, args.common.step, args.side, args.common.frames
    ))?;
    let (mut rows, mut missed) = (Vec::new(), Vec::new());
    for data_set in data_sets(args)? {
        let data_set = data_set?;
        let empty_share = data_set.empty_share(&data_set.subject.transfer);
        print(&format!("{}: {:.1} % of voxels are empty", data_set.subject.name, 100.0 * empty_share))?;
        for renderer in Renderer::ALL {
            let scene = data_set.scene(args, renderer, data_set.subject.transfer.clone())?;
            let prepared = prepared(args, &data_set, &scene)?;
            // The cpu casts rays to the samples of slices: nothing new.
            let draws = |backend: &dyn Backend| {
                renderer == Renderer::Rays || backend.describe().backend != BackendKind::Cpu.name()
            };
            for backend in rivals.present.iter_mut().filter(|backend| draws(backend.as_ref())) {
                let of_backend =
                    contest(args, backend.as_mut(), (&data_set, empty_share), (renderer, &scene), &prepared)?;
                print(HEADER)?;
                for row in of_backend {
                    print(&line(&row))?;
                    missed.extend(other_picture(&row));
                    rows.push(row);
                }
            }
        }
    }
    args.common.write_rows("table.json", &rows)?;
    Ok(missed)
}

const HEADER: &str = "  renderer backend  algorithm            stored MiB  uploaded MiB     samples  processing ms   frame ms (min to max)        S                             difference";

/// What of an algorithm is the same on every backend.
struct Prepared {
    algorithm: Algorithm,
    stored_bytes: u64,
    n_samples: u64,
    processing_ms: f64,
}

fn prepared(args: &TongArgs, data: &DataSet, scene: &Scene) -> Result<Vec<Prepared>, PaperError> {
    let of = |algorithm: Algorithm| {
        let mut times = Vec::new();
        let mut plan = None;
        for _ in 0..N_PROCESSINGS {
            let begin = Instant::now();
            plan = Some(algorithm.plan(data, scene)?);
            times.push(begin.elapsed().as_secs_f64() * 1e3);
        }
        let plan = plan.expect("it was prepared");
        let stored_bytes = plan.field().slots().n_bytes() as u64;
        Ok(Prepared { algorithm, stored_bytes, n_samples: n_samples(&plan), processing_ms: median(times) })
    };
    Algorithm::all(args.side).into_iter().map(of).collect()
}

/// The algorithms take turns on a backend.
fn contest(
    args: &TongArgs,
    backend: &mut dyn Backend,
    (data, empty_share): (&DataSet, f64),
    (renderer, scene): (Renderer, &Scene),
    prepared: &[Prepared],
) -> Result<Vec<TableRow>, PaperError> {
    let mut contestants: Vec<_> = prepared.iter().map(|p| p.algorithm.contestant(data, scene.clone())).collect();
    let mut pictures: Vec<Option<Image<f32>>> = vec![None; contestants.len()];
    let mut uploaded = vec![0; contestants.len()];
    let ms = take_turns::<PaperError>(contestants.len(), args.common.frames, |turn| {
        let frame = contestants[turn.contestant].take(turn, backend)?;
        if turn.warms_up() {
            uploaded[turn.contestant] = frame.uploaded_bytes;
        }
        pictures[turn.contestant] = Some(frame.image);
        Ok(frame.ms)
    })?;
    let pictures: Vec<Image<f32>> = pictures.into_iter().map(|picture| picture.expect("all had their turns")).collect();
    let row = |(i, prepared): (usize, &Prepared)| TableRow {
        data: data.subject.name.clone(),
        empty_share,
        renderer: renderer.name(),
        backend: backend.describe().backend,
        algorithm: prepared.algorithm.name(),
        stored_bytes: prepared.stored_bytes,
        uploaded_bytes: uploaded[i],
        n_samples: prepared.n_samples,
        processing_ms: prepared.processing_ms,
        ms: Spread::of(&ms[i]),
        ratio: Ratio::of(&ms[i], &ms[0]),
        difference: greatest_difference(&pictures[i], &pictures[0]),
    };
    Ok(prepared.iter().enumerate().map(row).collect())
}

fn line(row: &TableRow) -> String {
    let ms = format!("{:.1} ({:.1} to {:.1})", row.ms.median, row.ms.min, row.ms.max);
    let saved = |ratio: f64| 100.0 * (1.0 - ratio);
    let Ratio { median, low, high, confidence, .. } = row.ratio;
    let saving = format!(
        "{:.1} % ({:.1} to {:.1}, {:.0} %)",
        saved(median),
        saved(high),
        saved(low),
        (100.0 * confidence).floor()
    );
    format!(
        "  {:<8} {:<8} {:<20} {:>10.2} {:>13.2} {:>11} {:>14.1}   {ms:<28} {saving:<29} {:.1e}",
        row.renderer,
        row.backend,
        row.algorithm,
        mib(row.stored_bytes),
        mib(row.uploaded_bytes),
        row.n_samples,
        row.processing_ms,
        row.difference
    )
}

/// Pictures are equal to that of algorithm I within rounding.
fn other_picture(row: &TableRow) -> Option<Missed> {
    // NaN is a difference, too.
    let is_equal = row.difference <= ROUNDING;
    (!is_equal).then(|| {
        let TableRow { data, renderer, backend, algorithm, difference, .. } = row;
        let what = format!(
            "{data}, {renderer}, {backend}, {algorithm}: a channel differs by {difference:.1e} from algorithm I"
        );
        Missed::of_pictures(what)
    })
}
