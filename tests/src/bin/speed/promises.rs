//! The ratios and rates that the project promises.

use std::time::Instant;

use brickfield::cpu::{Discrete, discrete};
use brickfield::frame::{Backend, FramePlan, Mode};
use brickfield::{Residency, Skipping, prepare};
use brickfield_conformance::conformance::Tolerance;
use brickfield_conformance::metrics::median;
use brickfield_conformance::turns::{Bound, Claim, Ratio};
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BrickSide, Grid, Image, Volume};

use crate::volumes::{TimedVolume, tree};
use crate::{Arguments, Backends, EntrantTimes};

/// Skipping, an empty frame and the pictures of each backend; the CPU path against wgpu.
pub(crate) fn of_skipping(
    options: &Arguments,
    volume: &TimedVolume,
    times: &[EntrantTimes],
    backends: &mut Backends,
) -> anyhow::Result<Vec<Claim>> {
    let name = volume.name;
    let rounds = |backend: &str, what: &str| {
        let what = format!("{name}, {what}");
        times.iter().find(|t| t.backend == backend && t.what == what).map(|t| t.rounds.as_slice())
    };
    let plan = |skipping| {
        let scene = volume.scene(options, Mode::FAST, skipping)?;
        anyhow::Ok(prepare(volume.middle(), &scene, &mut Residency::default())?)
    };
    let (with, without) = (plan(Skipping::On)?, plan(Skipping::Off)?);
    let reference = discrete(&with);
    let mut claims = Vec::new();
    for (kind, backend) in backends.iter_mut() {
        let of = |what: &str| rounds(kind.name(), what);
        let pair = (of("fast, no skipping"), of("fast, skipping"));
        let what = format!("{name}, {kind}: without skipping / with, fast mode");
        claims.push(ratio(what, pair, Bound::AtLeast(volume.skipping_gains)));
        let empty_ms = of(crate::volumes::NOTHING_TO_SEE).map_or(f64::NAN, |ms| median(ms.to_vec()));
        let what = format!("{name}, {kind}: 20 ms / a frame with nothing to see");
        claims.push(Claim::of(what, 20.0 / empty_ms.max(1e-3), Bound::AtLeast(1.0)));
        claims.push(equal_images(name, backend.as_mut(), [&with, &without], &reference)?);
    }
    if let (Some(wgpu), Some(cpu)) = (rounds("wgpu", "fast, skipping"), rounds("cpu", "fast, skipping")) {
        let what = format!("{name}: wgpu's time / cpu's, fast mode, skipping");
        claims.push(ratio(what, (Some(wgpu), Some(cpu)), Bound::AtLeast(0.7)));
    }
    Ok(claims)
}

/// A claim about a ratio of times; it is missed where there are none.
fn ratio(what: String, times: (Option<&[f64]>, Option<&[f64]>), bound: Bound) -> Claim {
    match times {
        (Some(first), Some(second)) => Claim::of_ratio(what, Ratio::of(first, second), bound),
        _ => Claim::of(what, f64::NAN, bound),
    }
}

/// Whether the pictures with and without skipping are within the rule: 1 if they are.
fn equal_images(
    name: &str,
    backend: &mut dyn Backend,
    [with, without]: [&FramePlan; 2],
    reference: &Discrete,
) -> anyhow::Result<Claim> {
    let tolerance = Tolerance::of(with, reference, &backend.describe().capabilities)?;
    let holds = |image: &Image<f32>| tolerance.judge(image, &reference.image).complaint.is_none();
    let what =
        format!("{name}, {}: pictures with and without skipping are within the rule", backend.describe().backend);
    let both = [backend.render(with)?.image, backend.render(without)?.image];
    Ok(Claim::of(what, f64::from(u8::from(both.iter().all(holds))), Bound::AtLeast(1.0)))
}

/// The octree of 512^3 voxels of 8 bits, in MB of voxels a second.
pub(crate) fn octree(n_rounds: u32) -> anyhow::Result<Claim> {
    let n = 512usize;
    let grid = Grid::axis_aligned(UVec3::splat(n as u32), DVec3::ONE)?;
    let voxel = |i: usize| ((i % n) ^ (i / n % n) ^ (i / n / n)) as u8;
    let volume = Volume::new(grid, (0..n * n * n).map(voxel).collect::<Vec<u8>>())?;
    let mut rates = Vec::new();
    for _ in 0..n_rounds {
        let begin = Instant::now();
        let built = tree(&volume, BrickSide::S32)?;
        rates.push((n * n * n) as f64 / 1e6 / begin.elapsed().as_secs_f64());
        drop(built);
    }
    Ok(Claim::of("octree of 512^3 u8, average, MB/s", median(rates), Bound::AtLeast(200.0)))
}
