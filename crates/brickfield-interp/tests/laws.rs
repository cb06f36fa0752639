//! The laws of interblock interpolation, against the equations written out.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BlockLayout, BlockSide, Interblock, Level};
use brickfield_interp::{Neighbourhood, block_weights, edge_weight, interpolate};
use proptest::prelude::*;

/// Blocks of random resolutions, with random samples.
#[derive(Clone, Debug)]
struct Blocks {
    layout: BlockLayout,
    levels: Vec<Level>,
    seed: u64,
}

impl Blocks {
    fn level(&self, block: UVec3) -> Level {
        self.levels[self.layout.ordinal(block)]
    }

    /// A number of [0, 1) for a sample.
    fn sample(&self, block: UVec3, i: UVec3) -> f64 {
        let key = [block.x, block.y, block.z, i.x, i.y, i.z].into_iter();
        let hash = key.fold(self.seed, |h, k| {
            (h ^ u64::from(k)).wrapping_add(0x9e37_79b9_7f4a_7c15).wrapping_mul(0xbf58_476d_1ce4_e5b9).rotate_left(31)
        });
        (hash >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Trilinear among the samples of a block, limited to them.
    fn fetch(&self, block: UVec3, q: DVec3, sample: impl Fn(UVec3, UVec3) -> f64) -> f64 {
        let level = self.level(block);
        let (n, (first, last)) = (self.layout.n_samples(block, level), self.layout.sample_ends(block, level));
        let mut at = [(0, 0, 0.0); 3];
        for axis in 0..3 {
            let positions: Vec<f64> = (0..n[axis])
                .map(|i| if i + 1 == n[axis] { last[axis] } else { first[axis] + f64::from(i * level.stride()) })
                .collect();
            let p = q[axis].clamp(first[axis], last[axis]);
            let i = positions.iter().rposition(|x| *x <= p).unwrap_or(0);
            let next = (i + 1).min(positions.len() - 1);
            let gap = positions[next] - positions[i];
            at[axis] = (i as u32, next as u32, if gap > 0.0 { (p - positions[i]) / gap } else { 0.0 });
        }
        let corner = |c: u32| {
            let pick = |axis: usize| match c >> axis & 1 {
                0 => (at[axis].0, 1.0 - at[axis].2),
                _ => (at[axis].1, at[axis].2),
            };
            let (x, y, z) = (pick(0), pick(1), pick(2));
            x.1 * y.1 * z.1 * sample(block, UVec3::new(x.0, y.0, z.0))
        };
        (0..8).map(corner).sum()
    }

    fn value(&self, scheme: Interblock, q: DVec3) -> f64 {
        let fetch = |block| self.fetch(block, q, |block, i| self.sample(block, i));
        interpolate(&self.layout, scheme, q.to_array(), |block| self.level(block), fetch)
    }
}

fn blocks(n_levels: u8) -> impl Strategy<Value = Blocks> {
    let dims = prop::array::uniform3(1..40u32).prop_map(UVec3::from);
    (dims, any::<u64>()).prop_flat_map(move |(dims, seed)| {
        let layout = BlockLayout::new(dims, BlockSide::V8);
        let levels = prop::collection::vec((0..n_levels).prop_map(Level), layout.n_blocks_total());
        levels.prop_map(move |levels| Blocks { layout, levels, seed })
    })
}

fn scheme() -> impl Strategy<Value = Interblock> {
    prop::sample::select(Interblock::ALL.to_vec())
}

/// A position in the volume, a part of the way along each axis.
fn position(blocks: &Blocks, part: [f64; 3]) -> DVec3 {
    DVec3::from(part) * blocks.layout.dims().as_dvec3() - 0.5
}

/// The position on the nearest face between two blocks, on some axes.
fn onto_faces(blocks: &Blocks, q: DVec3, axes: u32) -> DVec3 {
    let side = f64::from(blocks.layout.side().n_voxels());
    let mut q = q;
    for axis in (0..3).filter(|axis| axes >> axis & 1 == 1) {
        let most = blocks.layout.n_blocks()[axis] - 1;
        q[axis] = ((q[axis] + 0.5) / side).round().min(f64::from(most)) * side - 0.5;
    }
    q
}

#[test]
fn figure_4() {
    // In units of a block: one sample at -1/2, four samples from 1/8 on.
    let weight = |scheme, rho| edge_weight(scheme, rho, 0.5, 0.125);
    for scheme in Interblock::ALL {
        assert_eq!((weight(scheme, -0.5), weight(scheme, 0.125)), (0.0, 1.0), "{scheme:?}");
    }
    assert_eq!(weight(Interblock::MinimumDistance, -0.125), 0.0);
    assert_eq!(weight(Interblock::MinimumDistance, 0.0625), 0.75);
    assert_eq!(weight(Interblock::BoundarySplit, -0.25), 0.25);
    assert_eq!(weight(Interblock::BoundarySplit, 0.0625), 0.75);
    assert_eq!(weight(Interblock::MaximumDistance, -0.1875), 0.5);
    assert_eq!(weight(Interblock::MaximumDistance, 0.0), 0.8);
}

#[test]
fn equation_6_lets_a_block_across_an_edge_count_among_the_samples_of_another() {
    // Block 0 has eight samples a side, blocks 1 and 2 one; the position is a voxel within block 0's samples.
    let level = |b: usize| [0.5, 4.0, 4.0, 2.0][b % 4];
    let insets: [[f64; 3]; 8] = std::array::from_fn(|b| [level(b); 3]);
    let rho = [-1.5, -1.5, f64::NEG_INFINITY];
    let edge = |axis: usize, lower: f64, upper: f64| edge_weight(Interblock::MaximumDistance, rho[axis], lower, upper);
    let literal = edge(0, level(2), level(3)) * edge(1, level(1), level(3));
    assert!(literal > 0.17, "{literal}");
    let weights = block_weights(Interblock::MaximumDistance, rho, 0, &insets);
    assert_eq!(weights, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
}

#[test]
fn missing_neighbours_have_no_weight_at_upper_and_lower_faces() {
    let layout = BlockLayout::new(UVec3::new(16, 8, 8), BlockSide::V8);
    for (x, own, missing) in [(-0.5, 7, [0, 2, 4, 6]), (15.5, 6, [1, 3, 5, 7])] {
        let around = Neighbourhood::around(&layout, [x, 1.0, 1.0]);
        assert_eq!(around.own(), own);
        assert!(missing.into_iter().all(|b| around.block(b).is_none()));
        let weights = block_weights(Interblock::MaximumDistance, around.rho(), own, &[[4.0; 3]; 8]);
        assert!(weights.into_iter().enumerate().all(|(b, w)| w == if b == own { 1.0 } else { 0.0 }));
    }
}

proptest! {
    #[test]
    fn weights_are_parts_of_one(
        scheme in scheme(),
        levels in prop::array::uniform8(0..=5u32),
        own in 0..8usize,
        past in prop::array::uniform3(0.0..16.0f64),
    ) {
        let insets = levels.map(|l| [0.5 * f64::from(1u32 << l); 3]);
        let rho: [f64; 3] = std::array::from_fn(|a| if own >> a & 1 == 1 { past[a] } else { -past[a] });
        let weights = block_weights(scheme, rho, own, &insets);
        prop_assert!(weights.iter().all(|w| (0.0..=1.0).contains(w)));
        prop_assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        let own_inset = insets[own][0];
        if past.iter().all(|p| *p >= own_inset) {
            prop_assert_eq!(weights[own], 1.0);
        }
        let in_f32 = block_weights(scheme, rho.map(|r| r as f32), own, &insets.map(|i| i.map(|x| x as f32)));
        prop_assert!(weights.iter().zip(in_f32).all(|(a, b)| (a - f64::from(b)).abs() < 1e-5));
    }

    #[test]
    fn equation_6_holds_where_two_blocks_differ_along_one_axis(
        scheme in scheme(), lower in 0..=4u32, upper in 0..=4u32, past in prop::array::uniform3(-1.0..1.0f64)
    ) {
        // All four pairs along x are alike, so that e13 = e02 and so on: the product of the axes' weights, nothing is limited.
        let inset = |l: u32| 0.5 * f64::from(1u32 << l);
        let insets: [[f64; 3]; 8] = std::array::from_fn(|b| [[inset(lower), inset(upper)][b & 1], 4.0, 4.0]);
        let rho = [past[0] * 8.0, past[1] * 4.0, past[2] * 4.0];
        let own = (0..3).map(|a| usize::from(rho[a] >= 0.0) << a).sum();
        let weights = block_weights(scheme, rho, own, &insets);
        for (b, weight) in weights.into_iter().enumerate() {
            let along = |axis: usize, e: f64| if b >> axis & 1 == 1 { e } else { 1.0 - e };
            let x = edge_weight(scheme, rho[0], inset(lower), inset(upper));
            let expected = along(0, x) * along(1, 0.5 + rho[1] / 8.0) * along(2, 0.5 + rho[2] / 8.0);
            prop_assert!((weight - expected).abs() < 1e-12, "block {b}: {weight} {expected}");
        }
    }

    #[test]
    fn values_are_continuous_across_faces_edges_and_corners(
        blocks in blocks(4), scheme in scheme(), part in prop::array::uniform3(0.0..1.0f64), axes in 1..8u32
    ) {
        const AWAY: f64 = 1e-7;
        let q = onto_faces(&blocks, position(&blocks, part), axes);
        let side = |corner: u32, axis: u32| if corner >> axis & 1 == 1 { AWAY } else { -AWAY };
        let beside = |c: u32| blocks.value(scheme, q + DVec3::new(side(c, 0), side(c, 1), side(c, 2)));
        let values: Vec<f64> = (0..8).map(beside).collect();
        let (least, most) = values.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
        // Values of [0, 1) change by at most a few per voxel.
        prop_assert!(most - least < 40.0 * AWAY, "{values:?} at {q}");
    }

    #[test]
    fn values_are_continuous_everywhere(
        blocks in blocks(4), scheme in scheme(), part in prop::array::uniform3(0.0..1.0f64),
        way in prop::array::uniform3(-1.0..1.0f64)
    ) {
        let q = position(&blocks, part);
        let step = DVec3::from(way) * 1e-7;
        let change = (blocks.value(scheme, q + step) - blocks.value(scheme, q)).abs();
        prop_assert!(change < 40e-7, "{change} at {q}");
    }

    #[test]
    fn the_middle_planes_of_blocks_where_the_neighbourhood_changes_are_no_jumps(
        blocks in blocks(4), scheme in scheme(), part in prop::array::uniform3(0.0..1.0f64), axis in 0..3usize
    ) {
        let mut q = position(&blocks, part);
        q[axis] = ((q[axis] + 0.5) / 8.0).floor() * 8.0 + 3.5;
        prop_assume!(q[axis] < f64::from(blocks.layout.dims()[axis]) - 0.5);
        let mut step = DVec3::ZERO;
        step[axis] = 1e-7;
        let change = (blocks.value(scheme, q + step) - blocks.value(scheme, q - step)).abs();
        prop_assert!(change < 40e-7, "{change} at {q}");
    }

    #[test]
    fn equal_resolutions_are_trilinear(
        dims in prop::array::uniform3(1..40u32), seed in any::<u64>(), scheme in scheme(),
        part in prop::array::uniform3(0.0..1.0f64)
    ) {
        let layout = BlockLayout::new(UVec3::from(dims), BlockSide::V8);
        let levels = vec![Level(0); layout.n_blocks_total()];
        let blocks = Blocks { layout, levels, seed };
        let q = position(&blocks, part);
        let voxel = |v: UVec3| blocks.sample(v / 8, v % 8);
        let last = (layout.dims() - 1).as_dvec3();
        let (p, mut expected) = (q.clamp(DVec3::ZERO, last), 0.0);
        let i = p.floor().as_uvec3().min((layout.dims() - 1).saturating_sub(UVec3::ONE));
        for c in 0..8u32 {
            let up = UVec3::new(c & 1, c >> 1 & 1, c >> 2);
            let f = p - i.as_dvec3();
            let weight: f64 = (0..3).map(|a| if up[a] == 1 { f[a] } else { 1.0 - f[a] }).product();
            expected += weight * voxel((i + up).min(layout.dims() - 1));
        }
        let found = blocks.value(scheme, q);
        prop_assert!((found - expected).abs() < 1e-12, "{found} {expected} at {q}");
    }

    #[test]
    fn a_linear_field_is_exact_among_the_samples_of_a_block(
        blocks in blocks(4), scheme in scheme(), part in prop::array::uniform3(0.0..1.0f64),
        slope in prop::array::uniform3(-1.0..1.0f64)
    ) {
        let (q, slope) = (position(&blocks, part), DVec3::from(slope));
        let block = UVec3::from(((q + 0.5) / 8.0).floor().to_array().map(|b| b as u32)).min(blocks.layout.n_blocks() - 1);
        let (first, last) = blocks.layout.sample_ends(block, blocks.level(block));
        prop_assume!(q.cmpge(first).all() && q.cmple(last).all());
        let linear = |block: UVec3, i: UVec3| {
            let (level, layout) = (blocks.level(block), blocks.layout);
            let (first, last) = layout.sample_ends(block, level);
            let at = first + i.as_dvec3() * f64::from(level.stride());
            slope.dot(at.min(last))
        };
        let fetch = |block| blocks.fetch(block, q, linear);
        let found = interpolate(&blocks.layout, scheme, q.to_array(), |block| blocks.level(block), fetch);
        prop_assert!((found - slope.dot(q)).abs() < 1e-11, "{found} {}", slope.dot(q));
    }
}
