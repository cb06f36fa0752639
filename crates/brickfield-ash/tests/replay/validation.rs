//! The validation layer, synchronisation included, has nothing to say.

use brickfield_ash::{AshBackend, Validation};
use brickfield_core::{TransferFunction, glam::UVec2};
use brickfield_frame::{
    Backend, Evaluate, FramePlan, Mode, Placement, QuadratureRule, SampleFormat, ShaderFunction, Target,
};

use crate::connect;
use crate::plans::{bumps, nothing, of_size, plan, polygons, ramp, rising, with_visible};

const FAST: Mode = Mode::Fast { transmittance_floor: 1e-3 };

#[test]
fn the_layer_is_silent_from_the_first_call_to_the_last() {
    let Some(mut backend) = connect(Validation::On) else { return };
    for format in [SampleFormat::Unorm8, SampleFormat::Unorm16, SampleFormat::Float32] {
        for mode in [Mode::Exact, FAST] {
            exercise(&mut backend, &plan(bumps(format), rising(0.05), QuadratureRule::MidpointExponential, mode));
        }
    }
    for rule in QuadratureRule::ALL {
        exercise(&mut backend, &plan(ramp(SampleFormat::Unorm8), rising(0.05), rule, Mode::Exact));
    }
    // Drawing and marching by turns, into both kinds of targets, in several batches.
    let rays = plan(bumps(SampleFormat::Unorm8), rising(0.05), QuadratureRule::Gauss2, Mode::Exact);
    for target in [Target::Float32, Target::Float16, Target::Float32] {
        let drawn = polygons(&rays, Placement::ObjectPlanes, target).in_batches_of(20);
        backend.render(&drawn).unwrap();
        backend.render(&rays).unwrap();
    }
    let constant = TransferFunction::constant(0.1, [1.0; 3]).unwrap();
    exercise(&mut backend, &plan(ramp(SampleFormat::Unorm8), constant, QuadratureRule::Gauss2, FAST));
    let log = backend.validation_log();
    assert_eq!(backend.validation_messages(), Vec::<String>::new());
    drop(backend);
    assert_eq!(log.drain(), Vec::<String>::new());
}

fn exercise(backend: &mut AshBackend, plan: &FramePlan) {
    let render = |backend: &mut AshBackend, plan: &FramePlan| backend.render(plan).unwrap();
    render(backend, plan);
    render(backend, plan);
    render(backend, &of_size(plan, UVec2::new(70, 30)));
    render(backend, &nothing(plan));
    render(backend, &with_visible(&nothing(plan), *plan.domain()));
    for function in ShaderFunction::ALL {
        backend.evaluate(plan, function, &[[0.5; 4]; 100]).unwrap();
    }
}

#[test]
fn on_another_thread_the_picture_is_the_same_and_the_layer_silent() {
    let Some(mut backend) = connect(Validation::On) else { return };
    let plan = plan(bumps(SampleFormat::Unorm16), rising(0.05), QuadratureRule::MidpointExponential, Mode::Exact);
    let here = backend.render(&plan).unwrap().image;
    let log = backend.validation_log();
    let moved = std::thread::spawn(move || backend.render(&plan).unwrap().image);
    assert_eq!(moved.join().unwrap(), here);
    // It ended on the other thread.
    assert_eq!(log.drain(), Vec::<String>::new());
}
