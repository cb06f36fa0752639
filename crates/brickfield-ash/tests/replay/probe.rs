//! Texture reads on their own.

use brickfield_ash::{AshBackend, Validation};
use brickfield_core::glam::{UVec2, UVec3};
use brickfield_frame::{Backend, Fetch, Probe, RenderError, SampleFormat, TextureWork};
use brickfield_shaders::ShaderLibrary;

use crate::connect;

const WORK: TextureWork = TextureWork {
    format: SampleFormat::Unorm8,
    texels: UVec3::new(37, 20, 50),
    fetch: Fetch::Gathered,
    n_rays: UVec2::new(13, 9),
    n_samples: 100,
};

/// How far the worst ray's mean is from that of the texels; `None` where the device cannot read such a texture.
fn worst(backend: &mut AshBackend, work: &TextureWork) -> Option<f64> {
    let reads = match backend.texture_reads(work, 2) {
        Ok(reads) => reads,
        Err(e @ RenderError::Unsupported { .. }) => {
            println!("{e}");
            return None;
        }
        Err(e) => panic!("{e}"),
    };
    assert!([0, 2].contains(&reads.device_ms.len()) && reads.device_ms.iter().all(|ms| *ms >= 0.0));
    assert_eq!((reads.wall_ms.len(), reads.means.len()), (2, 13 * 9));
    let expected = |i: u32| work.mean(UVec2::new(i % 13, i / 13));
    Some((0..).zip(reads.means).map(|(i, mean)| (f64::from(mean) - expected(i)).abs()).fold(0.0, f64::max))
}

#[test]
fn a_probe_reads_every_value_of_its_rays() {
    let Some(mut backend) = connect(Validation::On) else { return };
    for format in [SampleFormat::Unorm8, SampleFormat::Unorm16, SampleFormat::Float32] {
        for (fetch, bound) in [(Fetch::Gathered, 1e-5), (Fetch::Filtered, 3.0 / 256.0)] {
            let work = TextureWork { format, fetch, ..WORK };
            assert!(worst(&mut backend, &work).is_none_or(|worst| worst < bound), "{work:?}");
        }
    }
    assert_eq!(backend.validation_messages(), Vec::<String>::new());
}

#[test]
fn a_probe_that_skips_values_is_noticed() {
    let Some(mut backend) = connect(Validation::Off) else { return };
    let (from, to) = ("sum += interpolated(", "sum = interpolated(");
    backend.set_library(ShaderLibrary::embedded().patched("probe", from, to).unwrap());
    assert!(worst(&mut backend, &WORK).is_none_or(|worst| worst > 0.1));
}
