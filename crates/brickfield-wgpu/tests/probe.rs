//! Texture reads on their own.

use brickfield_core::glam::{UVec2, UVec3};
use brickfield_frame::{Fetch, Probe, RenderError, SampleFormat, TextureWork};
use brickfield_wgpu::{AdapterChoice, OpenError, WgpuBackend};

const WORK: TextureWork = TextureWork {
    format: SampleFormat::Unorm8,
    texels: UVec3::new(37, 20, 50),
    fetch: Fetch::Gathered,
    n_rays: UVec2::new(13, 9),
    n_samples: 100,
};

#[test]
fn a_probe_reads_every_value_of_its_rays() {
    let mut backend = match WgpuBackend::new(&AdapterChoice::Default) {
        Err(e @ OpenError::NoAdapter) => return println!("no device: {e}"),
        opened => opened.unwrap(),
    };
    for format in [SampleFormat::Unorm8, SampleFormat::Unorm16, SampleFormat::Float32] {
        for (fetch, bound) in [(Fetch::Gathered, 1e-5), (Fetch::Filtered, 3.0 / 256.0)] {
            let work = TextureWork { format, fetch, ..WORK };
            let reads = match backend.texture_reads(&work, 2) {
                Ok(reads) => reads,
                Err(e @ RenderError::Unsupported { .. }) => {
                    println!("{e}");
                    continue;
                }
                Err(e) => panic!("{e}"),
            };
            assert!([0, 2].contains(&reads.device_ms.len()) && reads.device_ms.iter().all(|ms| *ms >= 0.0));
            assert_eq!((reads.wall_ms.len(), reads.means.len()), (2, 13 * 9));
            for (i, mean) in (0u32..).zip(reads.means) {
                let expected = work.mean(UVec2::new(i % 13, i / 13));
                assert!((f64::from(mean) - expected).abs() < bound, "{work:?}: {mean}, expected {expected}");
            }
        }
    }
}
