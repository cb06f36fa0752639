//! Rates of the f32 renderer and of the continuous answer.

#[path = "../tests/support/mod.rs"]
mod support;

use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{BrickSide, ScalarType, TransferFunction, Volume};
use brickfield_cpu::{ContinuousOptions, CpuBackend, continuous, discrete};
use brickfield_frame::{Backend, FramePlan, Mode};
use support::{Setup, Skip, knot, whole};

fn main() {
    divan::main();
}

/// Everything visible, rays never end early.
fn dense(scalar: ScalarType) -> (Volume, TransferFunction) {
    let field = |p: DVec3| 127.0 + 60.0 * (p.x * 0.06).sin() * (p.y * 0.05).cos() + 60.0 * (p.z * 0.03).sin();
    let knots =
        vec![knot(0.0, 0.0, [1.0, 0.2, 0.0]), knot(140.0, 0.003, [0.0, 0.8, 0.3]), knot(255.0, 0.015, [1.0; 3])];
    (support::volume([128; 3], DVec3::ONE, scalar, field), TransferFunction::new(knots).unwrap())
}

/// Eight balls in much empty space.
fn blobs() -> (Volume, TransferFunction) {
    let field = |p: DVec3| {
        let q = p / 64.0;
        255.0 * (-(q - q.floor() - 0.5).length_squared() * 20.0).exp()
    };
    let knots = vec![knot(100.0, 0.0, [1.0, 0.2, 0.0]), knot(140.0, 0.1, [0.0, 0.8, 0.3]), knot(250.0, 0.3, [1.0; 3])];
    (support::volume([128; 3], DVec3::ONE, ScalarType::U8, field), TransferFunction::new(knots).unwrap())
}

fn plan((volume, tf): &(Volume, TransferFunction), mode: Mode) -> FramePlan {
    let size = UVec2::splat(256);
    let setup = Setup { mode, size, side: BrickSide::S32, skip: Skip::Transparent, ..Setup::new(volume, tf.clone()) };
    setup.plan()
}

fn rate(bencher: divan::Bencher, plan: &FramePlan) {
    let n_samples = discrete(plan).n_samples;
    let mut backend = CpuBackend::new();
    bencher.counter(divan::counter::ItemsCount::new(n_samples)).bench_local(|| backend.render(plan).unwrap());
}

#[divan::bench(args = [ScalarType::U8, ScalarType::U16, ScalarType::F32], sample_count = 10)]
fn dense_exact(bencher: divan::Bencher, scalar: ScalarType) {
    rate(bencher, &plan(&dense(scalar), Mode::Exact));
}

#[divan::bench(sample_count = 10)]
fn blobs_fast(bencher: divan::Bencher) {
    rate(bencher, &plan(&blobs(), Mode::FAST));
}

#[divan::bench(sample_count = 3)]
fn blobs_continuous(bencher: divan::Bencher) {
    let (volume, tf) = blobs();
    let camera = support::framing(&volume, DVec3::new(1.0, 0.7, 0.4));
    let run = || continuous(&volume, &tf, &camera, UVec2::splat(64), &whole(&volume), &ContinuousOptions::default());
    bencher.counter(divan::counter::ItemsCount::new(run().n_pieces)).bench_local(run);
}
