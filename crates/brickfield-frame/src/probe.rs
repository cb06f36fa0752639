//! How fast a device reads textures, to compare a renderer's speed with.

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use crate::{Backend, RenderError, SampleFormat, TextureLayout};

/// A backend whose device reads textures, which can be measured apart from rendering.
pub trait Probe: Backend {
    /// Makes a texture, lets the device do `work` on it `n_runs` times, and frees it.
    ///
    /// # Errors
    /// A format that the device cannot read this way, a texture that it cannot hold.
    fn texture_reads(&mut self, work: &TextureWork, n_runs: usize) -> Result<TextureReads, RenderError>;
}

/// How a trilinear value is read from a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fetch {
    /// By the texture unit's filter, as in fast mode.
    Filtered,
    /// By two gathers of four texels and f32 arithmetic, as in exact mode.
    Gathered,
}

/// Trilinear values at even distances on rays through a texture of three axes, added up: the reads of a march without the rest of it.
///
/// Ray (x, y) runs through the whole depth of the texture, from 0 to 4/5 of its width and height at the front to 1/5 to 1 at
/// the back, so that neighbours run side by side as a picture's rays do, along no axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureWork {
    /// How a texel is stored.
    pub format: SampleFormat,
    /// Texels along x, y, z.
    pub texels: UVec3,
    /// How a value is read.
    pub fetch: Fetch,
    /// Rays along x and y.
    pub n_rays: UVec2,
    /// Values on each ray.
    pub n_samples: u32,
}

/// The times and means of a probe's runs.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureReads {
    /// Milliseconds of each run, as the device's timestamps say; none where it has none.
    pub device_ms: Vec<f64>,
    /// Milliseconds of each run, as the caller waits for it.
    pub wall_ms: Vec<f64>,
    /// The mean of each ray's values after the last run, row by row: whether they were read at all.
    pub means: Vec<f32>,
}

/// The work as shaders read it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct ProbeUniforms {
    /// Rays along x and y; z: values on each ray; w: reserved.
    pub work: [u32; 4],
}

impl Fetch {
    /// Both.
    pub const ALL: [Fetch; 2] = [Fetch::Filtered, Fetch::Gathered];

    /// The name in shaders and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Fetch::Filtered => "filtered",
            Fetch::Gathered => "gathered",
        }
    }

    /// How the texture is held.
    pub const fn layout(self) -> TextureLayout {
        match self {
            Fetch::Filtered => TextureLayout::Volume,
            Fetch::Gathered => TextureLayout::Layers,
        }
    }
}

impl TextureWork {
    /// Values that a run reads.
    pub fn n_values(&self) -> u64 {
        u64::from(self.n_rays.x) * u64::from(self.n_rays.y) * u64::from(self.n_samples)
    }

    /// The bytes of `n` layers of texels from layer `z` on, x fastest: noise, which no device can compress.
    pub fn layers(&self, z: u32, n: u32) -> Vec<u8> {
        let (width, height) = (self.texels.x as usize, self.texels.y as usize);
        let first = z as usize * height;
        let row_bytes = width * self.format.n_bytes();
        let mut bytes = vec![0; n as usize * height * row_bytes];
        bytes.par_chunks_exact_mut(row_bytes.max(1)).enumerate().for_each(|(row, bytes)| {
            let texels = (((first + row) * width) as u64..).flat_map(|i| self.stored(i));
            bytes.iter_mut().zip(texels).for_each(|(to, from)| *to = from);
        });
        bytes
    }

    /// The work as shaders read it.
    pub fn uniforms(&self) -> ProbeUniforms {
        ProbeUniforms { work: [self.n_rays.x, self.n_rays.y, self.n_samples, 0] }
    }

    /// The mean of a ray's values in f64.
    pub fn mean(&self, ray: UVec2) -> f64 {
        let sum: f64 = (0..self.n_samples).map(|k| self.value(self.position(ray, k))).sum();
        sum / f64::from(self.n_samples)
    }

    /// Where sample `k` of a ray lies, in texels.
    fn position(&self, ray: UVec2, k: u32) -> DVec3 {
        let depth = (f64::from(k) + 0.5) / f64::from(self.n_samples);
        let across = 0.8 * (ray.as_dvec2() + 0.5) / self.n_rays.as_dvec2() + 0.2 * depth;
        across.extend(depth) * self.texels.as_dvec3()
    }

    /// The trilinear value at a position in texels, clamped to their centres.
    fn value(&self, p: DVec3) -> f64 {
        let last = (self.texels - 1).as_dvec3();
        let s = (p - 0.5).clamp(DVec3::ZERO, last);
        let low = s.floor();
        let f = s - low;
        let corner = |c: u32| {
            let at = (low.as_uvec3() + UVec3::new(c & 1, c >> 1 & 1, c >> 2)).min(self.texels - 1);
            let w = DVec3::select((UVec3::new(c, c >> 1, c >> 2) & 1).cmpeq(UVec3::ONE), f, 1.0 - f);
            self.texel(at) * w.element_product()
        };
        (0..8).map(corner).sum()
    }

    fn texel(&self, at: UVec3) -> f64 {
        let [x, y, z] = at.to_array().map(u64::from);
        let i = x + u64::from(self.texels.x) * (y + u64::from(self.texels.y) * z);
        let bytes: Vec<u8> = self.stored(i).collect();
        match self.format {
            SampleFormat::Unorm8 | SampleFormat::Unorm8x4 => f64::from(bytes[0]) / 255.0,
            SampleFormat::Unorm16 => f64::from(u16::from_le_bytes([bytes[0], bytes[1]])) / 65535.0,
            SampleFormat::Float32 => f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
        }
    }

    /// The bytes of texel `i`: from the high bits of a multiplicative hash.
    fn stored(&self, i: u64) -> impl Iterator<Item = u8> + use<> {
        let noise = (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as u32; // 24 bits
        let bytes = match self.format {
            SampleFormat::Unorm8 => noise >> 16,
            SampleFormat::Unorm8x4 => noise,
            SampleFormat::Unorm16 => noise >> 8,
            SampleFormat::Float32 => (noise as f32 / (1 << 24) as f32).to_bits(),
        };
        bytes.to_le_bytes().into_iter().take(self.format.n_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WORK: TextureWork = TextureWork {
        format: SampleFormat::Unorm8,
        texels: UVec3::new(8, 6, 10),
        fetch: Fetch::Gathered,
        n_rays: UVec2::new(3, 4),
        n_samples: 40,
    };

    #[test]
    fn rays_stay_in_the_texture_and_run_side_by_side() {
        for (x, y) in [(0, 0), (2, 3), (0, 3)] {
            for k in [0, 39] {
                let p = WORK.position(UVec2::new(x, y), k);
                assert!(p.cmpgt(DVec3::ZERO).all() && p.cmplt(WORK.texels.as_dvec3()).all(), "{p}");
            }
        }
        let apart = |k| WORK.position(UVec2::new(1, 2), k) - WORK.position(UVec2::new(0, 2), k);
        assert!((apart(0) - apart(39)).length() < 1e-12);
    }

    #[test]
    fn values_are_those_of_the_texels_and_lie_between_them() {
        for format in [SampleFormat::Unorm8, SampleFormat::Unorm16, SampleFormat::Float32] {
            let work = TextureWork { format, ..WORK };
            assert_eq!(work.layers(0, 10).len(), 8 * 6 * 10 * format.n_bytes());
            assert_eq!(work.layers(3, 1), work.layers(0, 10)[3 * 48 * format.n_bytes()..4 * 48 * format.n_bytes()]);
            let (a, b) = (work.texel(UVec3::new(3, 2, 5)), work.texel(UVec3::new(4, 2, 5)));
            assert!(a != b && (0.0..=1.0).contains(&a));
            assert_eq!(work.value(DVec3::new(3.5, 2.5, 5.5)), a);
            assert!((work.value(DVec3::new(3.75, 2.5, 5.5)) - (0.75 * a + 0.25 * b)).abs() < 1e-12);
            let mean = work.mean(UVec2::new(1, 1));
            assert!((0.3..0.7).contains(&mean), "{mean}");
        }
    }
}
