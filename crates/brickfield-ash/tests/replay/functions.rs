//! Single functions of the shaders.

use brickfield_ash::{AshBackend, Validation};
use brickfield_frame::{Evaluate, Mode, QuadratureRule, SampleFormat, ShaderFunction};
use brickfield_shaders::ShaderLibrary;

use crate::connect;
use crate::plans::{bumps, plan, ramp, rising};

fn alphas(backend: &mut AshBackend, depths: &[[f32; 4]]) -> Vec<f32> {
    let plan = plan(ramp(SampleFormat::Unorm8), rising(0.1), QuadratureRule::MidpointExponential, Mode::Exact);
    backend.evaluate(&plan, ShaderFunction::Alpha, depths).unwrap().iter().map(|v| v[0]).collect()
}

#[test]
fn opacity_is_that_of_the_depth_over_several_dispatches() {
    let Some(mut backend) = connect(Validation::Off) else { return };
    assert!(alphas(&mut backend, &[]).is_empty());
    let depths: Vec<_> = (0..(1 << 20) + 77).map(|i| [i as f32 * 1e-6, 0.0, 0.0, 0.0]).collect();
    let alphas = alphas(&mut backend, &depths);
    assert_eq!(alphas.len(), depths.len());
    for (depth, alpha) in depths.iter().zip(alphas) {
        let expected = -(-f64::from(depth[0])).exp_m1();
        assert!((f64::from(alpha) - expected).abs() <= 1e-6 * expected, "{depth:?}: {alpha}, expected {expected}");
    }
}

#[test]
fn every_sample_is_found_in_its_brick() {
    let Some(mut backend) = connect(Validation::Off) else { return };
    for format in [SampleFormat::Unorm8, SampleFormat::Unorm16, SampleFormat::Float32] {
        let slots = bumps(format);
        let plan = plan(slots.clone(), rising(0.1), QuadratureRule::MidpointExponential, Mode::Exact);
        let at = |i: u32| [i % 31, i / 31 % 16, i / (31 * 16)];
        let inputs: Vec<_> = (0..31 * 16 * 16)
            .map(|i| {
                let p = at(i).map(|c| c as f32);
                [p[0], p[1], p[2], 0.0]
            })
            .collect();
        let outputs = backend.evaluate(&plan, ShaderFunction::Sample, &inputs).unwrap();
        for (i, output) in outputs.iter().enumerate() {
            let [x, y, z] = at(i as u32);
            let slot = (x / 15).min(1);
            let sample = ((z * 16 + y) * 16 + x - slot * 15) as usize;
            let expected = slots.decode().value(format.read(slots.samples(slot).unwrap().bytes(), sample));
            assert!(
                (f64::from(output[0]) - expected).abs() < 1e-5,
                "{:?}: {output:?}, expected {expected}",
                at(i as u32)
            );
            assert_eq!(output[1], 1.0);
        }
    }
}

#[test]
fn other_shader_sources_are_compiled_anew() {
    let Some(mut backend) = connect(Validation::Off) else { return };
    let depth = [[1.0, 0.0, 0.0, 0.0]];
    let right = alphas(&mut backend, &depth);
    let (from, to) = ("return vec4f(alpha(x.x), 0.0, 0.0, 0.0);", "return vec4f(x.x, 0.0, 0.0, 0.0);");
    backend.set_library(ShaderLibrary::embedded().patched("evaluate", from, to).unwrap());
    assert_eq!(alphas(&mut backend, &depth), [1.0]);
    let mut backend = backend.with_library(ShaderLibrary::embedded());
    assert_eq!(alphas(&mut backend, &depth), right);
}
