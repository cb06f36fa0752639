//! A fifth scheme: one filtered fetch everywhere, at warped texture coordinates (after Beyer, Hadwiger, Moeller and Fritz 2008).
//!
//! Rebuilt from the published summary: values are continuous across bricks of different resolution, samples are not modified, and the filter
//! of the texture unit does all, for coordinates of samples are warped in transition regions. In f64, as a texture unit would answer:
//!
//! ```text
//! fine brick                 a layer beside it        the zone between the outer samples of two bricks belongs to the
//!  o   o   o   o |  C C C C   copies of the coarse     finer one. Along the face's normal the layer is one texel away,
//!  o   o   o   o |  C C C C   brick's outer samples,   whatever the distance in space: the first warp. Copies are constant
//!  o   o   o   o |  D D D D   one for each fine one    where coarse samples change linearly: the second warp, along the face,
//!                                                      grows from none at the fine samples to all of it at the coarse ones.
//! ```
//!
//! Not in the summary, and so not rebuilt: how wide the original's transition regions are, which positions its coarse samples have, and how the
//! warps of two or three axes go together at edges and corners. There the maximum-distance scheme stands in, with up to eight fetches.

use brickfield::bricks::{BlockSource, BlockVolume, FetchError, fetch_values};
use brickfield::interp::{Neighbourhood, interpolate};
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BlockLayout, Interblock, Level};

/// Blocks at some levels, with their samples.
pub(super) struct Warped<'a> {
    layout: &'a BlockLayout,
    levels: &'a [Level],
    samples: Vec<Vec<f64>>,
}

impl<'a> Warped<'a> {
    pub(super) fn new(blocks: &'a BlockVolume, levels: &'a [Level]) -> Result<Warped<'a>, FetchError> {
        let layout = blocks.layout();
        let samples = layout.blocks().zip(levels).map(|(block, level)| fetch_values(blocks, block, *level));
        Ok(Warped { layout, levels, samples: samples.collect::<Result<_, _>>()? })
    }

    /// The value at a position in sample space.
    pub(super) fn value(&self, q: DVec3) -> f64 {
        let around = Neighbourhood::around(self.layout, q.to_array());
        let own = around.own_block();
        let inset = self.layout.inset(own, self.level(own));
        let rho = around.rho();
        let mut between = (0..3).filter(|axis| rho[*axis].abs() < inset[*axis]);
        match (between.next(), between.next()) {
            (None, _) => self.among(own, self.place(own, q)),
            (Some(axis), None) => {
                let other = around.block(around.own() ^ 1 << axis).expect("a block on the other side");
                self.in_zone(axis, own, other, q)
            }
            _ => {
                let fetch = |block| self.among(block, self.place(block, q));
                let level = |block| self.level(block);
                interpolate(self.layout, Interblock::MaximumDistance, q.to_array(), level, fetch)
            }
        }
    }

    /// Whether along all other axes a position lies among the samples of its own block and of the one across the nearest face of an axis.
    pub(super) fn is_off_edges(&self, q: DVec3, axis: usize) -> bool {
        let around = Neighbourhood::around(self.layout, q.to_array());
        let other = around.block(around.own() ^ 1 << axis);
        let is_off = |block: UVec3| {
            let (first, last) = self.layout.sample_ends(block, self.level(block));
            (0..3).all(|other| other == axis || (first[other] <= q[other] && q[other] <= last[other]))
        };
        is_off(around.own_block()) && other.is_none_or(is_off)
    }

    fn level(&self, block: UVec3) -> Level {
        self.levels[self.layout.ordinal(block)]
    }

    fn n(&self, block: UVec3) -> UVec3 {
        self.layout.n_samples(block, self.level(block))
    }

    /// A position in texels of a block, limited to its samples.
    fn place(&self, block: UVec3, q: DVec3) -> DVec3 {
        let level = self.level(block);
        let (first, last) = self.layout.sample_ends(block, level);
        let n = self.n(block).as_dvec3();
        let apart = (last - first) / (n - 1.0).max(DVec3::ONE);
        ((q - first) / apart.max(DVec3::splat(f64::MIN_POSITIVE))).clamp(DVec3::ZERO, n - 1.0)
    }

    /// The value between the zone's outer samples, by one fetch from the texture of the finer block.
    fn in_zone(&self, axis: usize, own: UVec3, other: UVec3, q: DVec3) -> f64 {
        let own_is_finer = self.level(own) <= self.level(other);
        let (fine, coarse) = if own_is_finer { (own, other) } else { (other, own) };
        let from = self.outer(fine, axis, coarse[axis] > fine[axis]);
        let to = self.outer(coarse, axis, fine[axis] > coarse[axis]);
        let t = ((q[axis] - from) / (to - from)).clamp(0.0, 1.0);
        let (fine_place, coarse_place) = (self.place(fine, q), self.place(coarse, q));
        let ratio = f64::from(1u32 << (self.level(coarse).0 - self.level(fine).0));
        let last = (self.n(fine) - 1).as_dvec3();
        // Between copies of two samples there is one texel, whatever their distance.
        let in_copies = (ratio * (coarse_place.floor() + 1.0) - 1.0 + coarse_place.fract()).clamp(DVec3::ZERO, last);
        let mut place = fine_place.lerp(in_copies, t);
        place[axis] = if coarse[axis] > fine[axis] { last[axis] } else { 0.0 };
        let copies = |texel: UVec3| {
            let mut at = (texel.as_dvec3() / ratio).floor().min((self.n(coarse) - 1).as_dvec3());
            at[axis] = if fine[axis] > coarse[axis] { f64::from(self.n(coarse)[axis] - 1) } else { 0.0 };
            self.sample(coarse, at.as_uvec3())
        };
        let near = self.among(fine, place);
        let beyond = filtered(place, self.n(fine), copies);
        near + (beyond - near) * t
    }

    /// Where the outer samples of a block lie along an axis.
    fn outer(&self, block: UVec3, axis: usize, upper: bool) -> f64 {
        let (first, last) = self.layout.sample_ends(block, self.level(block));
        if upper { last[axis] } else { first[axis] }
    }

    fn among(&self, block: UVec3, place: DVec3) -> f64 {
        filtered(place, self.n(block), |texel| self.sample(block, texel))
    }

    fn sample(&self, block: UVec3, texel: UVec3) -> f64 {
        let n = self.n(block);
        self.samples[self.layout.ordinal(block)][(texel.x + n.x * (texel.y + n.y * texel.z)) as usize]
    }
}

/// Trilinear, as a texture unit has it.
fn filtered(place: DVec3, n: UVec3, texel: impl Fn(UVec3) -> f64) -> f64 {
    let low = place.floor().as_uvec3().min(n - 1);
    let f = place - low.as_dvec3();
    let mut sum = 0.0;
    for corner in 0..8u32 {
        let bits = UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
        let weight: f64 = (0..3).map(|axis| if bits[axis] == 1 { f[axis] } else { 1.0 - f[axis] }).product();
        if weight > 0.0 {
            sum += weight * texel((low + bits).min(n - 1));
        }
    }
    sum
}
