//! Flat blocks of any resolution, blended by the equations of Ljung, Lundstroem and Ynnerman 2006, written out here.

use crate::field::{Field, field, transfer, trilinear};
use brickfield_core::glam::{DVec3, IVec3, UVec3};
use brickfield_core::{BlockLayout, BlockSide, Interblock, Level, Rescale, TransferFunction};
use brickfield_trim::*;
use proptest::prelude::*;

/// A field in blocks of 8 voxels, each at a level.
#[derive(Clone, Debug)]
struct Blocks {
    field: Field,
    layout: BlockLayout,
    levels: Vec<Level>,
}

/// What is left of each block.
type Kept<'a> = &'a dyn Fn(UVec3) -> SampleBox;

impl Blocks {
    fn level(&self, block: UVec3) -> Level {
        self.levels[self.layout.ordinal(block)]
    }

    fn whole(&self, block: UVec3) -> SampleBox {
        SampleBox::whole(self.layout.n_samples(block, self.level(block)))
    }

    /// Sample `i` of a block: the voxel nearest to it stands for the average.
    fn sample(&self, block: UVec3, i: UVec3) -> u8 {
        let (first, last) = self.layout.sample_ends(block, self.level(block));
        let at = (first + i.as_dvec3() * f64::from(self.level(block).stride())).min(last);
        self.field.voxel(at.round().as_uvec3().min(self.layout.dims() - 1))
    }

    fn arrays(&self) -> Vec<MinMaxArrays> {
        let of_block = |block: UVec3| {
            let n = self.whole(block).n;
            let sample = |i: u32| self.sample(block, UVec3::new(i % n.x, i / n.x % n.y, i / n.x / n.y));
            let samples: Vec<u8> = (0..n.element_product()).map(sample).collect();
            MinMaxArrays::of_box(&samples, n, SampleBox::whole(n), Rescale::IDENTITY).unwrap()
        };
        self.layout.blocks().map(of_block).collect()
    }

    fn kept(&self, transfer: &TransferFunction) -> Vec<SampleBox> {
        trim_blocks(&self.layout, &self.levels, &self.arrays(), &DarkValues::of(transfer)).unwrap()
    }

    /// A block's own value: of an empty block, that of its first sample.
    fn own_value(&self, block: UVec3, q: DVec3, kept: SampleBox) -> f64 {
        if kept.is_empty() {
            return f64::from(self.sample(block, UVec3::ZERO));
        }
        let (first, last) = self.layout.sample_ends(block, self.level(block));
        let before_last = (self.whole(block).n.as_dvec3() - 2.0).max(DVec3::ZERO);
        let stride = f64::from(self.level(block).stride());
        let local = (q - first) / stride;
        // The last gap may be shorter.
        let past = (q - first - before_last * stride) / (last - first - before_last * stride);
        let s = DVec3::select(local.cmpgt(before_last), before_last + past, local);
        let s = DVec3::select(self.whole(block).n.cmpeq(UVec3::ONE), DVec3::ZERO, s);
        trilinear(s, [kept.first, kept.first + kept.n - 1], |i| f64::from(self.sample(block, i)))
    }

    /// Equations 6 to 10 at a position, of what is left of the blocks.
    fn value(&self, scheme: Interblock, q: DVec3, kept: Kept<'_>) -> f64 {
        let side = f64::from(self.layout.side().n_voxels());
        let n_blocks = self.layout.n_blocks();
        let own = ((q + 0.5) / side).floor().as_uvec3().min(n_blocks - 1);
        // Past the nearest face along each axis, and whether the own block is the upper one of two.
        let past = q + 0.5 - own.as_dvec3() * side;
        let is_upper = past.cmplt(DVec3::splat(side / 2.0));
        let rho = DVec3::select(is_upper, past, past - side);
        let inset = |block: UVec3| self.layout.inset(block, self.level(block));
        if rho.abs().cmpge(inset(own)).all() {
            return self.own_value(own, q, kept(own));
        }
        let lower = own.as_ivec3() - IVec3::select(is_upper, IVec3::ONE, IVec3::ZERO);
        let block = |b: i32| {
            let block = lower + UVec3::new(b as u32 & 1, b as u32 >> 1 & 1, b as u32 >> 2).as_ivec3();
            (block.min_element() >= 0 && block.cmplt(n_blocks.as_ivec3()).all()).then(|| block.as_uvec3())
        };
        let outside = (1.0 - rho.abs() / inset(own)).clamp(DVec3::ZERO, DVec3::ONE).max_element();
        let (mut sum, mut weights) = (0.0, 0.0);
        for b in 0..8 {
            let Some(of) = block(b) else { continue };
            let towards = |axis: usize| {
                let Some(other) = block(b ^ 1 << axis) else { return 1.0 };
                let (below, above) = if b >> axis & 1 == 1 { (other, of) } else { (of, other) };
                let upper = edge(scheme, rho[axis], inset(below)[axis], inset(above)[axis]);
                if b >> axis & 1 == 1 { upper } else { 1.0 - upper }
            };
            let product = towards(0) * towards(1) * towards(2);
            let weight = if of == own { product } else { product.min(outside) };
            if weight > 0.0 {
                sum += weight * self.own_value(of, q, kept(of));
                weights += weight;
            }
        }
        sum / weights
    }
}

/// Equations 8 to 10.
fn edge(scheme: Interblock, rho: f64, lower: f64, upper: f64) -> f64 {
    let at_face = |inset: f64| 0.5 + 0.5 * rho / inset;
    let weight = match scheme {
        Interblock::MinimumDistance => at_face(lower.min(upper)),
        Interblock::BoundarySplit => at_face(if rho < 0.0 { lower } else { upper }),
        Interblock::MaximumDistance => (rho + lower) / (lower + upper),
    };
    weight.clamp(0.0, 1.0)
}

fn blocks() -> impl Strategy<Value = Blocks> {
    field(34).prop_flat_map(|field| {
        let layout = BlockLayout::new(field.dims, BlockSide::V8);
        let levels = prop::collection::vec((0..=3u8).prop_map(Level), layout.n_blocks_total());
        levels.prop_map(move |levels| Blocks { field: field.clone(), layout, levels })
    })
}

/// Two blocks of 8 voxels along x at full resolution, of the values 0 and 9.
fn step() -> (BlockLayout, Vec<MinMaxArrays>) {
    let layout = BlockLayout::new(UVec3::new(16, 1, 1), BlockSide::V8);
    let of = |value: u8| {
        let n = UVec3::new(8, 1, 1);
        MinMaxArrays::of_box(&[value; 8], n, SampleBox::whole(n), Rescale::IDENTITY).unwrap()
    };
    (layout, vec![of(0), of(9)])
}

#[test]
fn a_block_whose_own_values_are_dark_is_seen_in_its_blend() {
    let (layout, arrays) = step();
    let dark = DarkValues::below(8.0).unwrap();
    assert_eq!(kept_box(&arrays[0], &dark, Interpolation::Trilinear), SampleBox::EMPTY);
    let kept = trim_blocks(&layout, &[Level(0); 2], &arrays, &dark).unwrap();
    // Its outer slice alone has a part in values that are seen.
    assert_eq!((kept[0].first.x, kept[0].n.x), (7, 1));
    assert_eq!((kept[1].first.x, kept[1].n.x), (0, 8));
}

/// The samples of block 1 that are kept where block 2 has a visible slice at voxel `x`, and all else is dark:
///
/// ```text
/// +---------+---------+
/// |   2 | fine        3 one sample at 11.5    samples of block 2 at 0 to 7
/// +---------+---------+
/// | 0 one sample at 3.5  1 | samples at 8.5, 10.5, 12.5, 14.5
/// +---------+---------+
/// ```
fn kept_beside_a_visible_slice(x: u32) -> SampleBox {
    let layout = BlockLayout::new(UVec3::new(16, 16, 1), BlockSide::V8);
    let levels = [3, 1, 0, 3].map(Level);
    let arrays = |(block, level): (UVec3, Level)| {
        let n = layout.n_samples(block, level);
        let value = |i: u32| match level {
            Level(0) if i % n.x == x => 9,
            Level(1) => 5 * (i % 2) as u8,
            _ => 0,
        };
        let samples: Vec<u8> = (0..n.element_product()).map(value).collect();
        MinMaxArrays::of_box(&samples, n, SampleBox::whole(n), Rescale::IDENTITY).unwrap()
    };
    let arrays: Vec<MinMaxArrays> = layout.blocks().zip(levels).map(arrays).collect();
    trim_blocks(&layout, &levels, &arrays, &DarkValues::below(8.0).unwrap()).unwrap()[1]
}

#[test]
fn a_finer_block_across_an_edge_is_seen_as_far_as_coarser_ones_let_it() {
    // Block 1 counts from 3.5 on, past slice 5 of block 2.
    let kept = kept_beside_a_visible_slice(5);
    assert_eq!((kept.first.x, kept.n.x), (0, 1));
    // The outer slice of block 2 counts as far as 11.5, and from 3.5 on along y.
    let kept = kept_beside_a_visible_slice(7);
    assert_eq!((kept.first.x, kept.n.x), (0, 3));
    assert_eq!((kept.first.y, kept.n.y), (1, 3));
    // Slice 2 lies before block 1 counts.
    assert_eq!(kept_beside_a_visible_slice(2), SampleBox::EMPTY);
}

#[test]
fn blocks_that_do_not_fit_are_named() {
    let (layout, arrays) = step();
    let dark = DarkValues::below(8.0).unwrap();
    let error = |levels: &[Level], arrays: &[MinMaxArrays]| {
        trim_blocks(&layout, levels, arrays, &dark).unwrap_err().to_string()
    };
    assert_eq!(error(&[Level(0)], &arrays), "1 levels; the layout has 2 blocks");
    assert_eq!(error(&[Level(0); 2], &arrays[..1]), "1 min-max arrays; the layout has 2 blocks");
    assert_eq!(
        error(&[Level(0), Level(4)], &arrays),
        "block (1, 0, 0) is at level 4; blocks of 8 voxels have levels 0 to 3"
    );
    assert_eq!(
        error(&[Level(1), Level(0)], &arrays),
        "block (0, 0, 0) has 8 x 1 x 1 slices; at level 1 it has 4 x 1 x 1 samples"
    );
}

proptest! {
    // Few random blends are seen through a gap that one block alone keeps open.
    #![proptest_config(ProptestConfig::with_cases(1024))]

    #[test]
    fn no_visible_blend_is_lost(
        blocks in blocks(), transfer in transfer(), scheme in prop::sample::select(Interblock::ALL.to_vec()),
        parts in prop::collection::vec(prop::array::uniform3(0.0..1.0f64), 200)
    ) {
        let kept = blocks.kept(&transfer);
        for part in parts {
            let q = DVec3::from(part) * blocks.layout.dims().as_dvec3() - 0.5;
            let whole = blocks.value(scheme, q, &|block| blocks.whole(block));
            let left = blocks.value(scheme, q, &|block| kept[blocks.layout.ordinal(block)]);
            let seen = |value: f64| transfer.at(value).extinction;
            prop_assert!((seen(left) - seen(whole)).abs() < 1e-9, "{} not {} at {}", left, whole, q);
        }
    }

    #[test]
    fn places_lead_back_to_the_samples_of_the_block(blocks in blocks(), transfer in transfer()) {
        for (block, kept) in blocks.layout.blocks().zip(blocks.kept(&transfer)).filter(|(_, kept)| !kept.is_empty()) {
            let level = blocks.level(block);
            let place = block_place(&blocks.layout, block, level, &kept, UVec3::new(1, 2, 3));
            prop_assert_eq!((place.texel, place.n, place.level), (UVec3::new(1, 2, 3), kept.n, level));
            let (first, last) = blocks.layout.sample_ends(block, level);
            for i in 0..kept.n.element_product() {
                let i = UVec3::new(i % kept.n.x, i / kept.n.x % kept.n.y, i / kept.n.x / kept.n.y);
                let at = (first + (kept.first + i).as_dvec3() * f64::from(level.stride())).min(last);
                prop_assert!((place.local(at) - i.as_dvec3()).abs().max_element() < 1e-12, "{} at {} of {:?}", i, at, place);
            }
        }
    }

    #[test]
    fn at_least_the_nearest_blocks_own_part_is_kept(blocks in blocks(), transfer in transfer()) {
        let dark = DarkValues::of(&transfer);
        for (alone, blended) in blocks.arrays().iter().zip(blocks.kept(&transfer)) {
            let alone = kept_box(alone, &dark, Interpolation::Trilinear);
            let ends = |b: &SampleBox| (b.first, b.first + b.n);
            let (a, b) = (ends(&alone), ends(&blended));
            prop_assert!(alone.is_empty() || (b.0.cmple(a.0).all() && b.1.cmpge(a.1).all()));
        }
    }
}
