//! Where interpolated values come from: the eight samples around a position.

use brickfield::frame::{FramePlan, IndexEntry, Reach};
use brickfield_core::Volume;
use brickfield_core::glam::{DVec3, UVec3};

/// The eight data values around a position, x varying fastest, and where it lies between them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corners {
    values: [f64; 8],
    fraction: DVec3,
}

/// Something that has samples around a position in sample space.
pub(crate) trait Samples: Sync {
    /// The cell that holds `q`; `None` where nothing is visible.
    fn around(&self, q: DVec3) -> Option<Corners>;
}

/// A volume's own voxels: neither bricks nor an index.
pub(crate) struct VolumeSamples<'a>(pub(crate) &'a Volume);

/// The bricks of a plan.
pub(crate) struct PlanSamples<'a>(pub(crate) &'a FramePlan);

impl Corners {
    /// The trilinear value: the weighted sum of the corners.
    pub(crate) fn value(&self) -> f64 {
        self.values.iter().enumerate().map(|(c, v)| v * weight(self.fraction, c)).sum()
    }
}

impl Samples for VolumeSamples<'_> {
    fn around(&self, q: DVec3) -> Option<Corners> {
        let (voxels, fraction) = voxels_around(self.0.grid().dims(), q);
        Some(Corners { values: voxels.map(|i| self.0.value(i)), fraction })
    }
}

/// The voxels around a position in a volume, and where it lies between them.
fn voxels_around(dims: UVec3, q: DVec3) -> ([usize; 8], DVec3) {
    let last = (dims - 1).as_dvec3();
    let q = q.clamp(DVec3::ZERO, last);
    let low = q.floor().min((last - 1.0).max(DVec3::ZERO));
    let voxel = |c: usize| {
        let p = (low.as_uvec3() + UVec3::new(c as u32 & 1, c as u32 >> 1 & 1, c as u32 >> 2)).min(dims - 1);
        p.x as usize + dims.x as usize * (p.y as usize + dims.y as usize * p.z as usize)
    };
    (std::array::from_fn(voxel), q - low)
}

/// The voxels around a position in a volume, each with its trilinear weight.
pub(crate) fn weights_around(dims: UVec3, q: DVec3) -> [(usize, f64); 8] {
    let (voxels, fraction) = voxels_around(dims, q);
    std::array::from_fn(|c| (voxels[c], weight(fraction, c)))
}

/// The trilinear weight of a corner.
fn weight(fraction: DVec3, corner: usize) -> f64 {
    (0..3).map(|axis| if corner >> axis & 1 == 1 { fraction[axis] } else { 1.0 - fraction[axis] }).product()
}

impl Samples for PlanSamples<'_> {
    fn around(&self, q: DVec3) -> Option<Corners> {
        let field = self.0.field();
        let slots = field.slots();
        let n = slots.brick_side()?.n_samples() as usize;
        let q = q.clamp(DVec3::ZERO, field.last_sample());
        let at = (q / (n - 1) as f64).floor().as_uvec3().min(field.index().dims() - 1);
        let IndexEntry::Resident { slot, reach: Reach(level) } = field.index().at(at) else { return None };
        let bytes = slots.samples(slot)?.bytes();
        let first = (at >> u32::from(level) << u32::from(level)).as_dvec3() * (n - 1) as f64;
        let s = (q - first) / f64::from(1u32 << level);
        let low = s.floor().clamp(DVec3::ZERO, DVec3::splat((n - 2) as f64));
        let value = |c: usize| {
            let p = low.as_uvec3() + UVec3::new(c as u32 & 1, c as u32 >> 1 & 1, c as u32 >> 2);
            let i = p.x as usize + n * (p.y as usize + n * p.z as usize);
            slots.decode().value(slots.format().read(bytes, i))
        };
        Some(Corners { values: std::array::from_fn(value), fraction: s - low })
    }
}
