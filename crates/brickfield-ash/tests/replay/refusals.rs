//! What the backend refuses, and how it says so.

use brickfield_ash::{AdapterChoice, AshBackend, ConnectError, Options, Validation, adapters};
use brickfield_core::glam::UVec2;
use brickfield_frame::{Backend, Mode, QuadratureRule, RenderError, SampleFormat};

use crate::connect;
use crate::plans::{of_size, plan, ramp, rising};

#[test]
fn an_adapter_that_is_not_there_is_answered_with_those_that_are() {
    let Some(backend) = connect(Validation::Off) else { return };
    let there = adapters().unwrap();
    assert!(there.iter().any(|a| a.name == backend.describe().adapter && a.driver == backend.describe().driver));
    let choice = |adapter| AshBackend::new(&Options { adapter, ..Options::default() }).err();
    let error = choice(AdapterChoice::Name("no such adapter".into()));
    assert!(matches!(error, Some(ConnectError::UnknownAdapter { there: list, .. }) if list.contains(&there[0].name)));
    assert!(choice(AdapterChoice::Index(there.len())).is_some());
    assert_eq!(choice(AdapterChoice::Index(0)), None);
}

#[test]
fn a_picture_beyond_the_limit_is_refused_and_the_backend_lives_on() {
    let Some(mut backend) = connect(Validation::Off) else { return };
    let small = plan(ramp(SampleFormat::Unorm8), rising(0.1), QuadratureRule::MidpointExponential, Mode::Exact);
    let limit = backend.describe().capabilities.max_image;
    let large = of_size(&small, UVec2::new(limit + 1, 1));
    assert!(matches!(backend.render(&large), Err(RenderError::ImageTooLarge { limit: l, .. }) if l == limit));
    assert!(backend.render(&small).is_ok());
}
