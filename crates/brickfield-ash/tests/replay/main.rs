//! The backend on whatever Vulkan device there is; without one each test says `no device` and passes.

mod functions;
mod pictures;
mod plans;
mod probe;
mod refusals;
mod validation;

use brickfield_ash::{AshBackend, ConnectError, Options, Validation};

/// A backend, if this machine has one.
fn connect(validation: Validation) -> Option<AshBackend> {
    connect_with(&Options { validation, ..Options::default() })
}

fn connect_with(options: &Options) -> Option<AshBackend> {
    match AshBackend::new(options) {
        Ok(backend) => Some(backend),
        Err(e @ (ConnectError::NoLoader { .. } | ConnectError::NoDevice | ConnectError::NoValidationLayer)) => {
            println!("no device: {e}");
            None
        }
        Err(e) => panic!("{e}"),
    }
}

#[test]
fn a_backend_may_move_to_another_thread() {
    fn check<T: Send>() {}
    check::<AshBackend>();
}
