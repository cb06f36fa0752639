//! How fast a device reads trilinear values, to compare the march with.

use brickfield::frame::{Fetch, Probe, SampleFormat, TextureWork};
use brickfield_core::glam::{UVec2, UVec3};

use super::budget::{Deadline, Unmeasured};
use super::report::TextureRate;
use crate::metrics::median;
use crate::turns::Spread;

/// Longest run, in seconds: no driver should end it, and no display freeze.
const MOST_SECONDS: f64 = 0.5;
/// Rays that are looked at to see whether textures were read.
const N_CHECKED: u32 = 16;

/// Which texture is read how.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    pub(super) format: SampleFormat,
    /// Along each side.
    pub(super) texels: u32,
    pub(super) fetch: Fetch,
    /// Most rays along both sides.
    pub(super) rays: u32,
    pub(super) n_runs: usize,
}

impl Reading {
    fn name(&self, backend: &str) -> String {
        let Reading { format, texels, fetch, .. } = self;
        format!("{backend}, {} {format:?} texels, {texels}^3", fetch.name())
    }

    /// Half a texel from value to value, as frames have it.
    fn work(&self, rays: u32) -> TextureWork {
        let Reading { format, texels, fetch, .. } = *self;
        TextureWork { format, texels: UVec3::splat(texels), fetch, n_rays: UVec2::splat(rays), n_samples: 2 * texels }
    }
}

/// Measures, first with few rays, then with as many as make a run of reasonable length.
pub(super) fn texture_rate(
    probe: &mut dyn Probe,
    reading: &Reading,
    deadline: Deadline,
    failures: &mut Vec<String>,
) -> Result<TextureRate, Unmeasured> {
    let backend = probe.describe().backend;
    let what = reading.name(backend);
    deadline.admit(&what, 0.0)?;
    let few = reading.rays.clamp(1, 64);
    let mut read = |work: &TextureWork, n_runs| {
        probe.texture_reads(work, n_runs).map_err(|e| Unmeasured::new(&what, e.to_string()))
    };
    let seconds_few = 1e-3 * median(read(&reading.work(few), 1)?.wall_ms);
    let rays = rays_for(seconds_few, few, reading.rays);
    let work = reading.work(rays);
    let reads = read(&work, reading.n_runs.max(1))?;
    let sub_texel_bits = probe.describe().capabilities.sub_texel_bits;
    failures.extend(wrong(&work, &reads.means, sub_texel_bits).map(|e| format!("{what}: {e}")));
    let wall_ms = Spread::of(&reads.wall_ms);
    let device_ms = (!reads.device_ms.is_empty()).then(|| Spread::of(&reads.device_ms));
    let (ms, timed_by) = match device_ms {
        Some(device_ms) if !contradicts(device_ms, wall_ms) => (device_ms.median, "device"),
        _ => (wall_ms.median, "wait"),
    };
    Ok(TextureRate {
        backend: backend.to_owned(),
        fetch: reading.fetch.name().to_owned(),
        bytes_per_texel: reading.format.n_bytes(),
        texels: reading.texels,
        rays,
        n_samples: work.n_values(),
        n_runs: reading.n_runs as u32,
        device_ms,
        wall_ms,
        timed_by: timed_by.to_owned(),
        msamples_per_s: work.n_values() as f64 * 1e-3 / ms,
    })
}

/// Whether the device says that it worked for less than half of the time that the caller waited, and that was no trifle.
///
/// lavapipe (Mesa 22.3) does so where wgpu puts its timestamps around a dispatch that writes no image: 0.03 ms of 25.
fn contradicts(device_ms: Spread, wall_ms: Spread) -> bool {
    device_ms.median < 0.5 * wall_ms.median && wall_ms.median - device_ms.median > 2.0
}

/// Rays along both sides, halved from `most` until a run is short enough.
fn rays_for(seconds_few: f64, few: u32, most: u32) -> u32 {
    let seconds = |rays: u32| seconds_few * (f64::from(rays) / f64::from(few)).powi(2);
    let halved = std::iter::successors(Some(most), |rays| Some(rays / 2));
    halved.take_while(|rays| *rays > few).find(|rays| seconds(*rays) <= MOST_SECONDS).unwrap_or(few)
}

/// The fault of the means of some rays, if there is one: reads that were not made have no rate.
fn wrong(work: &TextureWork, means: &[f32], sub_texel_bits: u32) -> Option<String> {
    let bound = match work.fetch {
        Fetch::Gathered => 1e-4,
        Fetch::Filtered => 3.0 * (-f64::from(sub_texel_bits)).exp2(),
    };
    let n = work.n_rays.element_product();
    let checked = (0..n).step_by((n / N_CHECKED).max(1) as usize);
    checked.into_iter().find_map(|i| {
        let expected = work.mean(UVec2::new(i % work.n_rays.x, i / work.n_rays.x));
        let mean = f64::from(*means.get(i as usize).unwrap_or(&f32::NAN));
        let is_right = (mean - expected).abs() <= bound;
        (!is_right).then(|| format!("the mean of ray {i} is {mean}, but {expected} by the texels"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const READING: Reading =
        Reading { format: SampleFormat::Unorm8, texels: 8, fetch: Fetch::Gathered, rays: 512, n_runs: 2 };

    #[test]
    fn runs_are_of_reasonable_length() {
        assert_eq!(rays_for(1e-6, 64, 512), 512);
        assert_eq!(rays_for(0.1, 64, 512), 128);
        assert_eq!(rays_for(9.0, 64, 512), 64);
        assert_eq!(rays_for(9.0, 8, 8), 8);
    }

    #[test]
    fn timestamps_that_miss_the_work_are_noticed() {
        let ms = |median| Spread { median, min: median, max: median };
        assert!(contradicts(ms(0.03), ms(25.0)) && contradicts(ms(0.0), ms(2.5)));
        // Submitting and waiting takes a while, too.
        assert!(!contradicts(ms(0.4), ms(0.9)) && !contradicts(ms(20.0), ms(25.0)));
    }

    #[test]
    fn a_texture_that_was_not_read_is_noticed() {
        let work = READING.work(4);
        let right: Vec<f32> = (0..16).map(|i| work.mean(UVec2::new(i % 4, i / 4)) as f32).collect();
        assert_eq!(wrong(&work, &right, 8), None);
        assert!(wrong(&work, &[0.0; 16], 8).is_some() && wrong(&work, &[], 8).is_some());
        assert!(wrong(&work, &[f32::NAN; 16], 8).is_some());
    }
}
