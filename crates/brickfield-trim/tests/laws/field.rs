//! Random fields and transfer functions that leave something to trim.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Grid, Knot, TransferFunction, Volume};
use proptest::prelude::*;

/// A background with some noise, and boxes of other values in it. Values are whole numbers from 0 to 20.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    pub(crate) dims: UVec3,
    background: u8,
    noise: u8,
    boxes: Vec<(UVec3, UVec3, u8)>,
    seed: u64,
}

impl Field {
    pub(crate) fn voxel(&self, p: UVec3) -> u8 {
        let inside = |(first, n, _): &&(UVec3, UVec3, u8)| p.cmpge(*first).all() && p.cmplt(*first + *n).all();
        let object = self.boxes.iter().rfind(inside).map(|(.., value)| *value);
        object.unwrap_or_else(|| (self.background + self.random(p) % (self.noise + 1)).min(20))
    }

    fn random(&self, p: UVec3) -> u8 {
        let key = [p.x, p.y, p.z].into_iter();
        let hash = key.fold(self.seed, |h, k| {
            (h ^ u64::from(k)).wrapping_add(0x9e37_79b9_7f4a_7c15).wrapping_mul(0xbf58_476d_1ce4_e5b9).rotate_left(31)
        });
        (hash >> 40) as u8
    }

    pub(crate) fn voxels(&self) -> Vec<u8> {
        let n = self.dims;
        (0..n.element_product()).map(|i| self.voxel(UVec3::new(i % n.x, i / n.x % n.y, i / n.x / n.y))).collect()
    }

    pub(crate) fn volume(&self) -> Volume {
        Volume::new(Grid::axis_aligned(self.dims, DVec3::ONE).unwrap(), self.voxels()).unwrap()
    }
}

pub(crate) fn field(most: u32) -> impl Strategy<Value = Field> {
    let dims = prop::array::uniform3(1..most).prop_map(UVec3::from);
    let corner = move || prop::array::uniform3(0..most).prop_map(UVec3::from);
    let size = prop::array::uniform3(1..12u32).prop_map(UVec3::from);
    let boxes = prop::collection::vec((corner(), size, 0..=20u8), 0..4);
    (dims, 0..=20u8, 0..=2u8, boxes, any::<u64>()).prop_map(|(dims, background, noise, boxes, seed)| Field {
        dims,
        background,
        noise,
        boxes,
        seed,
    })
}

/// Slopes, peaks, jumps and zeros between 0 and 20, most of them dark.
pub(crate) fn transfer() -> impl Strategy<Value = TransferFunction> {
    let extinction = prop::sample::select(vec![0.0, 0.0, 0.0, 0.5, 2.0]);
    prop::collection::vec((0..=40u8, extinction), 1..7).prop_map(|mut knots| {
        knots.sort_by_key(|(value, _)| *value);
        let third = |i: usize| i >= 2 && knots[i].0 == knots[i - 2].0;
        let knot =
            |&(value, extinction): &(u8, f64)| Knot { value: f64::from(value) / 2.0, extinction, color: [1.0; 3] };
        let kept = knots.iter().enumerate().filter(|(i, _)| !third(*i)).map(|(_, k)| knot(k)).collect();
        TransferFunction::new(kept).unwrap()
    })
}

/// Linear along each axis between the samples around `s`, which is limited to the samples `from` to `to`.
pub(crate) fn trilinear(s: DVec3, [from, to]: [UVec3; 2], sample: impl Fn(UVec3) -> f64) -> f64 {
    let s = s.clamp(from.as_dvec3(), to.as_dvec3());
    let i = s.floor().as_uvec3().min(to);
    let f = s - i.as_dvec3();
    let corner = |c: u32| {
        let up = UVec3::new(c & 1, c >> 1 & 1, c >> 2);
        let weight: f64 = (0..3).map(|a| if up[a] == 1 { f[a] } else { 1.0 - f[a] }).product();
        // A corner without weight may lie beyond the last sample.
        if weight > 0.0 { weight * sample((i + up).min(to)) } else { 0.0 }
    };
    (0..8).map(corner).sum()
}
