//! Choosing adapters on the machine at hand.

use brickfield_wgpu::{AdapterChoice, OpenError, WgpuBackend, adapters};

#[test]
fn an_adapter_that_is_not_there_is_refused_with_a_list_of_those_that_are() {
    let there = adapters();
    let choice = AdapterChoice::Name("no such adapter".to_owned());
    match WgpuBackend::new(&choice).err() {
        Some(OpenError::NoAdapter) => {
            println!("no device");
            assert!(there.is_empty());
        }
        Some(error @ OpenError::NoSuchAdapter { .. }) => {
            assert!(there.iter().all(|a| error.to_string().contains(&a.to_string())), "{error}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_adapter_opens_by_its_place_and_name() {
    for adapter in adapters() {
        println!("{adapter}");
        assert!(WgpuBackend::new(&AdapterChoice::Index(adapter.index)).is_ok());
        assert!(WgpuBackend::new(&AdapterChoice::Name(adapter.name.to_uppercase())).is_ok());
    }
}

#[test]
fn a_backend_may_move_to_another_thread() {
    fn check<T: Send>() {}
    check::<WgpuBackend>();
}
