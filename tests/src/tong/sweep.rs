//! A threshold that runs over its range: bricks that change, time and bytes, next to the time of a frame.

use std::time::Instant;

use brickfield::trim::{DarkValues, Interpolation, MergeOptions, TrimmedBricks, reclassify, trim_bricks};
use brickfield::{TrimResidency, Trimming, prepare_trimmed};
use brickfield_core::{Knot, TransferFunction, Volume};
use serde::Serialize;

use super::TongArgs;
use super::data::{DataSet, Renderer, data_sets};
use crate::compare::rivals::Rivals;
use crate::metrics::median;
use crate::paper::{Missed, PaperError, frame_of, mib, print};

/// An edit of the threshold.
#[derive(Clone, Debug, Serialize)]
struct Edit {
    data: String,
    trimming: &'static str,
    threshold: f64,
    /// Bricks of another class or box.
    n_reclassified: usize,
    /// Classification alone; the whole way to the plan.
    classify_ms: f64,
    prepare_ms: f64,
    /// Bytes of bricks whose box or place is another; bytes that went to the device.
    gathered_bytes: u64,
    uploaded_bytes: u64,
    /// Of the first backend.
    frame_ms: f64,
}

/// How opaque values above the threshold are: a tenth of the volume's diagonal is nearly opaque.
const OPACITY: f64 = 30.0;

pub(super) fn run(args: &TongArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    let Some(backend) = rivals.present.last_mut() else { return Ok(Vec::new()) };
    let name = backend.describe().backend;
    print(&format!(
        "{} thresholds over the range of values, downwards, bricks of {}; frames of {} x {} pixels on {name}. Gathered: bytes of bricks whose box or place is another.\n",
        args.thresholds, args.side, args.common.size.x, args.common.size.y
    ))?;
    let mut edits = Vec::new();
    for data_set in data_sets(args)? {
        let data_set = data_set?;
        let ways =
            [("merged", Trimming::Merged(MergeOptions::of_bricks(args.side))), ("all axes, packed", Trimming::Packed)];
        for (trimming, how) in ways {
            let mut residency = TrimResidency::default();
            let mut of_data = Vec::new();
            let mut before: Option<TrimmedBricks> = None;
            for i in 0..args.thresholds {
                let (threshold, transfer) = at_threshold(&data_set.subject.volume, i, args.thresholds);
                let classify_ms = classify(&data_set, &mut before, &transfer);
                let scene = data_set.scene(args, Renderer::Rays, transfer)?;
                let begin = Instant::now();
                let plan = prepare_trimmed(&data_set.trimmed, &scene, how, &mut residency)?;
                let prepare_ms = begin.elapsed().as_secs_f64() * 1e3;
                let begin = Instant::now();
                let frame = frame_of(backend.as_mut(), &plan)?;
                let frame_ms = begin.elapsed().as_secs_f64() * 1e3;
                of_data.push(Edit {
                    data: data_set.subject.name.clone(),
                    trimming,
                    threshold,
                    n_reclassified: residency.n_reclassified(),
                    classify_ms,
                    prepare_ms,
                    gathered_bytes: residency.copied().n_bytes as u64,
                    uploaded_bytes: frame.uploaded_bytes,
                    frame_ms,
                });
            }
            // The first is no edit: all bricks are new.
            print(&summary(&data_set.subject.name, trimming, &of_data[1..]))?;
            edits.extend(of_data);
        }
    }
    args.common.write_rows("sweep.json", &edits)?;
    Ok(Vec::new())
}

/// Milliseconds of a classification after that of the edit before.
fn classify(data: &DataSet, before: &mut Option<TrimmedBricks>, transfer: &TransferFunction) -> f64 {
    let arrays = data.trimmed.arrays();
    let begin = Instant::now();
    let dark = DarkValues::of(transfer);
    match before {
        Some(trimmed) => {
            reclassify(trimmed, arrays, &dark).expect("bricks of one volume");
        }
        None => *before = Some(trim_bricks(arrays, &dark, Interpolation::Trilinear)),
    }
    begin.elapsed().as_secs_f64() * 1e3
}

/// Threshold `i` of `n`, from the greatest value down, and a transfer function that shows values from it on.
fn at_threshold(volume: &Volume, i: u32, n: u32) -> (f64, TransferFunction) {
    let range = volume.range();
    let threshold = range.max - (range.max - range.min) * f64::from(i + 1) / f64::from(n + 1);
    let extinction = OPACITY / volume.grid().world_box().diagonal();
    let knot = |value: f64, extinction: f64| Knot { value, extinction, color: [1.0, 0.9, 0.8] };
    let knots = vec![knot(threshold, 0.0), knot(threshold, extinction), knot(range.max, extinction)];
    (threshold, TransferFunction::new(knots).expect("knots ascend"))
}

fn summary(name: &str, trimming: &str, edits: &[Edit]) -> String {
    let of = |number: fn(&Edit) -> f64| {
        let numbers: Vec<f64> = edits.iter().map(number).collect();
        let worst = numbers.iter().copied().fold(0.0, f64::max);
        (median(numbers), worst)
    };
    let (classify, prepare, frame) = (of(|e| e.classify_ms), of(|e| e.prepare_ms), of(|e| e.frame_ms));
    let (n, gathered) = (of(|e| e.n_reclassified as f64), of(|e| mib(e.gathered_bytes)));
    let uploaded = of(|e| mib(e.uploaded_bytes));
    format!(
        "{name}, {trimming}: median (worst) of {} edits: {:.0} ({:.0}) bricks reclassified in {:.2} ({:.2}) ms; to the plan {:.1} ({:.1}) ms; gathered {:.2} ({:.2}) MiB, uploaded {:.2} ({:.2}) MiB; a frame {:.0} ({:.0}) ms",
        edits.len(),
        n.0,
        n.1,
        classify.0,
        classify.1,
        prepare.0,
        prepare.1,
        gathered.0,
        gathered.1,
        uploaded.0,
        uploaded.1,
        frame.0,
        frame.1
    )
}
