//! The bricks of a volume: their min-max arrays, and what is kept of each.

use brickfield_core::glam::UVec3;
use brickfield_core::{BrickId, BrickLayout, BrickSide, Level, Volume, with_voxels};
use rayon::prelude::*;

use crate::slices::scan;
use crate::{Class, DarkValues, Interpolation, MinMaxArrays, SampleBox, kept_box};

/// The min-max arrays of all bricks of level 0: what every classification of the volume starts from, made once.
///
/// Bricks share their border samples. Along an axis of n samples, bricks of 2^d samples are ceil((n - 1) / (2^d - 1)) (Tong et al.
/// 1999, equation 1), and 1 where n is 1.
#[derive(Clone, Debug, PartialEq)]
pub struct BrickArrays {
    layout: BrickLayout,
    arrays: Vec<MinMaxArrays>,
}

/// Why arrays are not those of a layout's bricks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum ArraysError {
    #[error("min-max arrays of {n_arrays} bricks; the layout has {n_bricks}")]
    Count { n_arrays: usize, n_bricks: usize },
    #[error("{brick} has {} x {} x {} slices; it has {} x {} x {} samples", n_slices.x, n_slices.y, n_slices.z, n.x, n.y, n.z)]
    Slices { brick: BrickId, n_slices: UVec3, n: UVec3 },
}

impl BrickArrays {
    /// The arrays of a volume's bricks of `side` samples a side. Runs on rayon's current thread pool.
    pub fn of_volume(volume: &Volume, side: BrickSide) -> BrickArrays {
        let layout = BrickLayout::new(volume.grid().dims(), side);
        let (dims, rescale) = (layout.dims(), volume.rescale());
        let ids: Vec<BrickId> = layout.bricks(Level(0)).collect();
        let arrays = with_voxels!(volume.voxels(), voxels => {
            let of_brick = |id: &BrickId| scan(voxels, dims, brick_samples(&layout, *id), rescale);
            ids.par_iter().map(of_brick).collect()
        });
        BrickArrays { layout, arrays }
    }

    /// The arrays of bricks that came one by one, in the order of [`BrickLayout::bricks`]; of a last brick, those of its samples
    /// inside the volume ([`brick_samples`]).
    ///
    /// # Errors
    /// If there is not one for each brick of level 0, or one has not a brick's slices.
    pub fn new(layout: BrickLayout, arrays: Vec<MinMaxArrays>) -> Result<BrickArrays, ArraysError> {
        let (n_arrays, n_bricks) = (arrays.len(), layout.n_bricks_total(Level(0)));
        if n_arrays != n_bricks {
            return Err(ArraysError::Count { n_arrays, n_bricks });
        }
        for (brick, of_brick) in layout.bricks(Level(0)).zip(&arrays) {
            let (n_slices, n) = (of_brick.n_slices(), brick_samples(&layout, brick).n);
            if n_slices != n {
                return Err(ArraysError::Slices { brick, n_slices, n });
            }
        }
        Ok(BrickArrays { layout, arrays })
    }

    /// Which bricks there are.
    pub fn layout(&self) -> &BrickLayout {
        &self.layout
    }

    /// The arrays of each brick, in the order of [`BrickLayout::bricks`].
    pub fn arrays(&self) -> &[MinMaxArrays] {
        &self.arrays
    }
}

/// The samples of the volume that a brick of level 0 has: 2^d along each axis, or less where a last brick is not full.
pub fn brick_samples(layout: &BrickLayout, id: BrickId) -> SampleBox {
    let first = id.coords * layout.side().n_cells();
    SampleBox { first, n: (layout.dims() - first).min(UVec3::splat(layout.side().n_samples())) }
}

/// What a classification leaves of each brick of a volume.
#[derive(Clone, Debug, PartialEq)]
pub struct TrimmedBricks {
    layout: BrickLayout,
    interpolation: Interpolation,
    kept: Vec<SampleBox>,
}

/// Bricks that are those of another layout.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "bricks of {found_side}^3 samples over {} x {} x {}; the trimmed ones have {side}^3 samples, over {} x {} x {}",
    found.x, found.y, found.z, dims.x, dims.y, dims.z
)]
#[allow(missing_docs)]
pub struct OtherLayout {
    pub side: BrickSide,
    pub dims: UVec3,
    pub found_side: BrickSide,
    pub found: UVec3,
}

/// Classifies and trims every brick (Tong et al. 1999, section 3.2.2).
pub fn trim_bricks(arrays: &BrickArrays, dark: &DarkValues, interpolation: Interpolation) -> TrimmedBricks {
    let kept = arrays.arrays.iter().map(|of_brick| kept_box(of_brick, dark, interpolation)).collect();
    TrimmedBricks { layout: arrays.layout, interpolation, kept }
}

/// Classifies again after an edit of the threshold or of the transfer function. Returns the bricks whose class or box is another one
/// now, ascending: no other has to be moved, stored or drawn in another way.
///
/// # Errors
/// If the arrays are those of another layout.
pub fn reclassify(
    trimmed: &mut TrimmedBricks,
    arrays: &BrickArrays,
    dark: &DarkValues,
) -> Result<Vec<usize>, OtherLayout> {
    if arrays.layout != trimmed.layout {
        let (of, found) = (&trimmed.layout, &arrays.layout);
        return Err(OtherLayout { side: of.side(), dims: of.dims(), found_side: found.side(), found: found.dims() });
    }
    let mut changed = Vec::new();
    for (ordinal, (kept, of_brick)) in trimmed.kept.iter_mut().zip(&arrays.arrays).enumerate() {
        let now = kept_box(of_brick, dark, trimmed.interpolation);
        if now != *kept {
            *kept = now;
            changed.push(ordinal);
        }
    }
    Ok(changed)
}

/// Number of bricks of each class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct ClassCounts {
    pub n_white: usize,
    pub n_grey: usize,
    pub n_black: usize,
}

impl TrimmedBricks {
    /// Every brick of a layout whole, whatever may be seen of it.
    pub fn whole(layout: BrickLayout) -> TrimmedBricks {
        let whole = |id| SampleBox::whole(brick_samples(&layout, id).n);
        let kept = layout.bricks(Level(0)).map(whole).collect();
        TrimmedBricks { layout, interpolation: Interpolation::default(), kept }
    }

    /// The bricks of which something is kept, whole.
    #[must_use]
    pub fn untrimmed(&self) -> TrimmedBricks {
        let mut all = TrimmedBricks::whole(self.layout);
        let white = self.kept.iter().zip(&mut all.kept).filter(|(kept, _)| kept.is_empty());
        white.for_each(|(_, kept)| *kept = SampleBox::EMPTY);
        all
    }

    /// The boxes that hold every sample within `reach` of a kept one along each axis, in whichever brick it lies: what gradients and rules
    /// that look at a segment's two ends read.
    #[must_use]
    pub fn grown(&self, reach: u32) -> TrimmedBricks {
        if reach == 0 {
            return self.clone();
        }
        let layout = self.layout;
        let of_volume: Vec<Option<[UVec3; 2]>> = layout
            .bricks(Level(0))
            .zip(&self.kept)
            .map(|(id, kept)| {
                let first = brick_samples(&layout, id).first + kept.first;
                (!kept.is_empty()).then(|| [first.saturating_sub(UVec3::splat(reach)), first + kept.n + reach])
            })
            .collect();
        let beside = reach.div_ceil(layout.side().n_cells());
        let grown = |id: BrickId| {
            let own = brick_samples(&layout, id);
            let low = id.coords.saturating_sub(UVec3::splat(beside));
            let high = (id.coords + beside + 1).min(layout.n_bricks(Level(0)));
            let around = (low.z..high.z)
                .flat_map(|z| (low.y..high.y).flat_map(move |y| (low.x..high.x).map(move |x| UVec3::new(x, y, z))));
            let ordinals = around.map(|coords| layout.ordinal(BrickId { coords, ..id }));
            let boxes = ordinals.filter_map(|i| of_volume[i]);
            let own_parts = boxes.filter_map(|[from, to]| own.part(from, to));
            own_parts.reduce(SampleBox::union).unwrap_or_default()
        };
        TrimmedBricks { kept: layout.bricks(Level(0)).map(grown).collect(), ..*self }
    }

    /// Which bricks there are.
    pub fn layout(&self) -> &BrickLayout {
        &self.layout
    }

    /// What is kept of each brick, in its own samples, by [`BrickLayout::ordinal`]; the paper's bounding boxes.
    pub fn kept(&self) -> &[SampleBox] {
        &self.kept
    }

    /// The class of a brick, by its ordinal.
    ///
    /// # Panics
    /// If the layout has no such brick.
    pub fn class(&self, ordinal: usize) -> Class {
        Class::of(&self.kept[ordinal], self.layout.side().n_samples())
    }

    /// Number of bricks of each class.
    pub fn counts(&self) -> ClassCounts {
        let mut counts = ClassCounts::default();
        for ordinal in 0..self.kept.len() {
            match self.class(ordinal) {
                Class::White => counts.n_white += 1,
                Class::Grey { .. } => counts.n_grey += 1,
                Class::Black => counts.n_black += 1,
            }
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use brickfield_core::Grid;
    use brickfield_core::glam::DVec3;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn grown_boxes_hold_every_sample_within_reach(
            n in prop::array::uniform3(1u32..50), object in prop::array::uniform3(0u32..50), reach in 0..40u32
        ) {
            let dims = UVec3::from(n);
            let object = UVec3::from(object) % dims;
            let grid = Grid::axis_aligned(dims, DVec3::ONE).unwrap();
            let mut voxels = vec![0u8; grid.n_voxels()];
            voxels[(object.x + dims.x * (object.y + dims.y * object.z)) as usize] = 1;
            let arrays = BrickArrays::of_volume(&Volume::new(grid, voxels).unwrap(), BrickSide::S16);
            let trimmed = trim_bricks(&arrays, &DarkValues::below(1.0).unwrap(), Interpolation::Nearest);
            let grown = trimmed.grown(reach);
            let layout = trimmed.layout();
            for id in layout.bricks(Level(0)) {
                let (samples, kept) = (brick_samples(layout, id), grown.kept()[layout.ordinal(id)]);
                for i in 0..samples.n.element_product() {
                    let own = UVec3::new(i % samples.n.x, i / samples.n.x % samples.n.y, i / (samples.n.x * samples.n.y));
                    let distance = (samples.first + own).as_ivec3() - object.as_ivec3();
                    prop_assert_eq!(distance.abs().max_element() <= reach as i32, kept.contains(own), "{} {}", id, own);
                }
            }
            let whole = trimmed.untrimmed();
            prop_assert!(whole.kept().iter().zip(trimmed.kept()).all(|(w, k)| w.is_empty() == k.is_empty()));
        }
    }
}
