//! From a scene and flat blocks to a frame plan.

use brickfield_bricks::{BlockSource, FetchError};
use brickfield_core::glam::UVec3;
use brickfield_core::{Aabb, BlockLayout, BlockSide, Companion, Level, Projection, TransferFunction, ValueRange};
use brickfield_frame::{
    Drawing, FramePlan, IndexEntry, Join, Lighting, PlanError, PlanParts, QuadratureRule, SampleFormat, Slices,
};
use rayon::prelude::*;

use crate::course::{Course, segment_reach, to_sample_space};
use crate::prepare::{check_size, check_values};
use crate::{BlockResidency, PrepareError, Quality, Scene, Skipping, Technique};

/// How flat blocks are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BlockStyle {
    /// How values between blocks come about: of the nearest block alone ([`Join::Shared`]), or blended.
    pub join: Join,
    /// What is drawn inside blocks that are transparent.
    pub transparent: TransparentBlocks,
    /// The order of a polygon's fragments, where polygons are drawn.
    pub slices: Slices,
    /// Which optics coarse samples have.
    pub classification: Classification,
}

/// Which optics a node between coarse samples has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Classification {
    /// Those of the interpolated average: narrow features vanish at coarse levels.
    #[default]
    OfMean,
    /// The mean of those of the voxels around it, by the spreads of samples ([`Companion::Spread`]). A byte more for each sample; not with
    /// [`QuadratureRule::PreIntegrated`].
    Prefiltered,
}

/// What is drawn inside a block all of whose voxels are transparent, next to one that is not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TransparentBlocks {
    /// Nothing, as Ljung, Lundstroem and Ynnerman 2006 have it: the picture jumps at its faces where blended values are visible.
    #[default]
    Empty,
    /// The blended values: only blocks are left out whose neighbours are transparent, too.
    Blended,
}

/// Why flat blocks could not be prepared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum PrepareBlocksError {
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    #[error("{n_levels} levels for {n_blocks} flat blocks")]
    Levels { n_levels: usize, n_blocks: usize },
    #[error("block ({}, {}, {}) at level {}; blocks of {side} voxels have levels up to {}", block.x, block.y, block.z, level.0, most.0)]
    NoSuchLevel { block: UVec3, level: Level, side: BlockSide, most: Level },
    #[error("{n_blocks} blocks; an index tells at most {limit} apart: take larger blocks")]
    TooManyBlocks { n_blocks: usize, limit: u32 },
    #[error(transparent)]
    Fetch(#[from] FetchError),
}

impl From<PlanError> for PrepareBlocksError {
    fn from(error: PlanError) -> PrepareBlocksError {
        PrepareBlocksError::Prepare(error.into())
    }
}

/// The plan of a frame of flat blocks, each at a level of its own, by number. Criteria of the scene about levels are not asked.
///
/// # Errors
/// As [`prepare`](crate::prepare()); levels that are no levels of the blocks; blocks that cannot be fetched. Then the residency is as before.
pub fn prepare_blocks(
    source: &dyn BlockSource,
    scene: &Scene,
    levels: &[Level],
    style: BlockStyle,
    residency: &mut BlockResidency,
) -> Result<FramePlan, PrepareBlocksError> {
    check_size(scene.size)?;
    check_values(source.range())?;
    check_levels(source.layout(), levels)?;
    if style.classification == Classification::Prefiltered && scene.rule == QuadratureRule::PreIntegrated {
        return Err(PlanError::PreIntegratedSpreads.into());
    }
    let coarsest = levels.iter().copied().max().unwrap_or(Level(0));
    let Course { domain, sampling, rays } = Course::new(source.grid(), scene, coarsest)?;
    let is_coarse = coarsest > Level(0);
    let companions = companions(scene, style.classification).filter(|c| is_coarse || *c != Companion::Spread);
    residency.serve(scene.upload);
    residency.hold(source, levels, &companions.collect::<Vec<_>>(), &scene.transfer)?;
    let style = match scene.quality {
        Quality::Final => style,
        Quality::Draft => BlockStyle { join: Join::Shared, ..style },
    };
    let drawn = drawn_blocks(source, scene, style, &domain);
    let drawing = match scene.technique {
        Technique::RayCasting => Drawing::Rays,
        Technique::Polygons(target) => {
            Drawing::Polygons { back_to_front: back_to_front(source, scene, &drawn), target, slices: style.slices }
        }
    };
    let field = residency.field(source, drawn, style.join);
    let parts = PlanParts::new(field, rays, domain, sampling, scene.transfer.clone());
    let lighting = scene.light.map(|light| Lighting::new(light, source.grid()));
    Ok(FramePlan::new(PlanParts { lighting, drawing, ..parts })?)
}

/// The bytes that each sample of flat blocks takes on a device, with its companions: those of a [`BlockBudget`](brickfield_lod::BlockBudget).
/// Voxels of 64 bits take four.
pub fn sample_bytes(source: &dyn BlockSource, scene: &Scene, classification: Classification) -> u8 {
    let companions = companions(scene, classification).map(|companion| companion.n_bytes());
    (SampleFormat::of(source.scalar_type()).n_bytes() + companions.sum::<usize>()) as u8
}

/// The companions of samples that a frame needs. Where all values look alike, spreads change nothing; nor where all samples are voxels.
fn companions(scene: &Scene, classification: Classification) -> impl Iterator<Item = Companion> {
    let is_prefiltered = classification == Classification::Prefiltered && scene.transfer.knots().len() > 1;
    let of_normals = scene.light.and_then(|light| light.normals().companion());
    Companion::ALL.into_iter().filter(move |companion| match companion {
        Companion::Spread => is_prefiltered,
        Companion::Gradient | Companion::SurfaceNormal => of_normals == Some(*companion),
    })
}

fn check_levels(layout: &BlockLayout, levels: &[Level]) -> Result<(), PrepareBlocksError> {
    let (n_levels, n_blocks, most) = (levels.len(), layout.n_blocks_total(), layout.side().one_sample());
    if n_blocks >= IndexEntry::MAX_SLOTS as usize {
        return Err(PrepareBlocksError::TooManyBlocks { n_blocks, limit: IndexEntry::MAX_SLOTS });
    }
    if n_levels != n_blocks {
        return Err(PrepareBlocksError::Levels { n_levels, n_blocks });
    }
    match levels.iter().position(|level| *level > most) {
        Some(i) => {
            let (block, level, side) = (layout.block(i), levels[i], layout.side());
            Err(PrepareBlocksError::NoSuchLevel { block, level, side, most })
        }
        None => Ok(()),
    }
}

/// Whether something is drawn in each block.
fn drawn_blocks(source: &dyn BlockSource, scene: &Scene, style: BlockStyle, domain: &Aabb) -> Vec<bool> {
    let layout = source.layout();
    if scene.skipping == Skipping::Off {
        return vec![true; layout.n_blocks_total()];
    }
    let mut drawn = match (style.join, style.transparent) {
        (Join::Blend(_), TransparentBlocks::Blended) => visible_with_neighbours(source, &scene.transfer),
        _ => source.summaries().par_iter().map(|s| !scene.transfer.is_transparent(s.range)).collect(),
    };
    let reach = segment_reach(source.grid(), scene, layout.side().n_voxels());
    if reach > 0 {
        let range = |i: usize| f64::from(u8::from(drawn[i]));
        drawn = over_neighbours(layout, reach, range, f64::max).into_iter().map(|any| any > 0.0).collect();
    }
    let is_in_domain = |block: UVec3| {
        let low = layout.first_voxel(block);
        let b = Aabb { min: low.as_dvec3(), max: (low + layout.extent(block)).as_dvec3() };
        !to_sample_space(b).intersection(domain).is_empty()
    };
    drawn.iter_mut().zip(layout.blocks()).for_each(|(is_drawn, block)| *is_drawn &= is_in_domain(block));
    drawn
}

/// Whether the transfer function shows something between the values of each block and its neighbours.
fn visible_with_neighbours(source: &dyn BlockSource, transfer: &TransferFunction) -> Vec<bool> {
    let (layout, summaries) = (source.layout(), source.summaries());
    let min = over_neighbours(layout, 1, |i| summaries[i].range.min, f64::min);
    let max = over_neighbours(layout, 1, |i| summaries[i].range.max, f64::max);
    min.into_iter().zip(max).map(|(min, max)| !transfer.is_transparent(ValueRange { min, max })).collect()
}

/// For each block a number of it and the blocks within `reach` along each axis, one axis after the other.
fn over_neighbours(
    layout: &BlockLayout,
    reach: u32,
    number: impl Fn(usize) -> f64,
    pick: impl Fn(f64, f64) -> f64,
) -> Vec<f64> {
    let n = layout.n_blocks();
    let mut numbers: Vec<f64> = (0..layout.n_blocks_total()).map(number).collect();
    for (axis, stride) in [1, n.x as usize, n.x as usize * n.y as usize].into_iter().enumerate() {
        let before = numbers.clone();
        for (i, to) in numbers.iter_mut().enumerate() {
            let at = layout.block(i)[axis];
            let (low, high) = (at.saturating_sub(reach), at.saturating_add(reach).min(n[axis] - 1));
            *to = (low..=high).map(|k| before[i + k as usize * stride - at as usize * stride]).fold(*to, &pick);
        }
    }
    numbers
}

/// The blocks that are drawn, the farthest first: along each axis by their distance from the eye.
fn back_to_front(source: &dyn BlockSource, scene: &Scene, drawn: &[bool]) -> Vec<UVec3> {
    let (layout, grid) = (source.layout(), source.grid());
    let to_index = grid.world_to_index();
    let side = f64::from(layout.side().n_voxels());
    let eye = (to_index.transform_point3(scene.camera.eye()) / side).floor().as_ivec3();
    let forward = to_index.transform_vector3(scene.camera.forward());
    let distance = |block: UVec3| match scene.camera.projection() {
        Projection::Perspective { .. } => (block.as_ivec3() - eye).abs().to_array(),
        Projection::Orthographic { .. } => {
            [0, 1, 2].map(|axis| if forward[axis] < 0.0 { -(block[axis] as i32) } else { block[axis] as i32 })
        }
    };
    let mut blocks: Vec<UVec3> =
        layout.blocks().zip(drawn).filter(|(_, is_drawn)| **is_drawn).map(|(b, _)| b).collect();
    blocks.sort_by_key(|block| std::cmp::Reverse(distance(*block)));
    blocks
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use brickfield_bricks::{BlockOptions, BlockVolume, BuildOptions, build_blocks, build_tree};
    use brickfield_core::glam::{DVec3, UVec2};
    use brickfield_core::{Camera, Grid, Interblock, Knot, Volume};
    use brickfield_frame::Feature;
    use brickfield_optics::{Light, LightSource, LightTerms, Normals};
    use proptest::prelude::*;

    use super::*;
    use crate::{BackendKind, Validation, open_backend};

    const BLENDED: BlockStyle = BlockStyle {
        join: Join::Blend(Interblock::MaximumDistance),
        transparent: TransparentBlocks::Empty,
        slices: Slices::Together,
        classification: Classification::OfMean,
    };

    fn blocks(dims: UVec3) -> BlockVolume {
        let grid = Grid::axis_aligned(dims, DVec3::ONE).unwrap();
        let voxels: Vec<u16> =
            (0..grid.n_voxels() as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 16) as u16).collect();
        let volume = Arc::new(Volume::new(grid, voxels).unwrap());
        build_blocks(volume, &BlockOptions { side: BlockSide::V8, ..BlockOptions::default() }).unwrap()
    }

    fn scene(source: &dyn BlockSource) -> Scene {
        let camera = Camera::framing(&source.grid().world_box(), DVec3::new(1.0, 2.0, 3.0), DVec3::Z).unwrap();
        let knot = |value: f64, extinction: f64| Knot { value, extinction, color: [0.2, 0.5, 1.0] };
        let transfer = TransferFunction::new(vec![knot(0.0, 0.01), knot(65535.0, 0.2)]).unwrap();
        Scene::new(camera, UVec2::new(16, 16), transfer)
    }

    /// The samples of a block, wherever they are kept.
    fn kept(plan: &FramePlan, i: usize) -> Vec<u8> {
        let slots = plan.field().slots();
        match slots.samples(i as u32) {
            Some(chunk) => chunk.bytes().to_vec(),
            None => (slots.one_sample(i as u32).unwrap() as u16).to_le_bytes().to_vec(),
        }
    }

    #[test]
    fn stored_normals_bring_gradients_which_bricks_do_not_have() {
        let source = blocks(UVec3::new(20, 17, 9));
        let levels: Vec<Level> = (0..source.layout().n_blocks_total()).map(|i| Level(i as u8 % 4)).collect();
        let light = Light::new(LightSource::Head, LightTerms::default(), 900.0).unwrap();
        let on = |normals| Scene { light: Some(light.on_normals(normals)), ..scene(&source) };
        let mut residency = BlockResidency::default();
        let mut plan = |normals| prepare_blocks(&source, &on(normals), &levels, BLENDED, &mut residency).unwrap();
        let n_samples = |plan: &FramePlan| plan.field().slots().n_bytes() / 2;
        let stored = plan(Normals::Stored);
        let gradients = stored.gradients().unwrap();
        assert_eq!(gradients.n_bytes(), 4 * n_samples(&stored));
        assert!(stored.features().contains(Feature::StoredGradients));
        let central = plan(Normals::Central);
        assert!(central.gradients().is_none() && central.field().companions(Companion::Gradient).is_none());
        let bytes = |normals| sample_bytes(&source, &on(normals), Classification::OfMean);
        assert_eq!((bytes(Normals::Stored), bytes(Normals::Central)), (6, 2));
        assert_eq!(sample_bytes(&source, &on(Normals::Stored), Classification::Prefiltered), 7);
        let tree = build_tree(source.volume(), &BuildOptions::default()).unwrap();
        let refused = crate::prepare(&tree, &on(Normals::Stored), &mut crate::Residency::default());
        assert_eq!(
            refused.err(),
            Some(PrepareError::Plan(PlanError::NoNormals { normals: Normals::Stored, companion: Companion::Gradient }))
        );
    }

    #[test]
    fn a_draft_takes_longer_steps_and_the_nearest_block_and_brings_nothing() {
        let source = blocks(UVec3::new(20, 17, 9));
        let levels: Vec<Level> = (0..source.layout().n_blocks_total()).map(|i| Level(i as u8 % 4)).collect();
        let (last, mut residency) = (scene(&source), BlockResidency::default());
        let mut plan = |scene: &Scene, style| prepare_blocks(&source, scene, &levels, style, &mut residency).unwrap();
        let fine = plan(&last, BLENDED);
        let draft = plan(&Scene { quality: Quality::Draft, ..last.clone() }, BLENDED);
        let stated = plan(&Scene { step_voxels: 1.0, ..last }, BlockStyle { join: Join::Shared, ..BLENDED });
        let mut backend = open_backend(BackendKind::Cpu, None, Validation::Off).unwrap();
        let mut picture = |plan: &FramePlan| backend.render(plan).unwrap().image;
        assert_eq!(picture(&draft), picture(&stated));
        assert_ne!(picture(&draft), picture(&fine));
        let chunks =
            |plan: &FramePlan| plan.field().slots().all_samples().iter().flatten().map(|c| c.id()).collect::<Vec<_>>();
        assert_eq!((chunks(&draft), residency.copied().n_bytes), (chunks(&fine), 0));
        assert!(Arc::ptr_eq(draft.field().slots(), fine.field().slots()), "slots are not made anew");
    }

    #[test]
    fn spreads_are_brought_where_they_change_something() {
        let source = blocks(UVec3::new(20, 17, 9));
        let (scene, mut residency) = (scene(&source), BlockResidency::default());
        let style = BlockStyle { classification: Classification::Prefiltered, ..BLENDED };
        let n_blocks = source.layout().n_blocks_total();
        let mut has_spreads = |scene: &Scene, level| {
            let plan = prepare_blocks(&source, scene, &vec![Level(level); n_blocks], style, &mut residency).unwrap();
            assert_eq!(plan.spreads().is_some(), plan.field().companions(Companion::Spread).is_some());
            plan.spreads().is_some()
        };
        assert!(has_spreads(&scene, 2) && has_spreads(&scene, 3) && !has_spreads(&scene, 0));
        let fog = Scene { transfer: TransferFunction::constant(0.1, [1.0; 3]).unwrap(), ..scene.clone() };
        assert!(!has_spreads(&fog, 2));
        let refused = Scene { rule: QuadratureRule::PreIntegrated, ..scene };
        let levels = vec![Level(0); n_blocks];
        let error = prepare_blocks(&source, &refused, &levels, style, &mut residency).unwrap_err().to_string();
        assert!(error.starts_with("spreads of samples with the rule pre-integrated"), "{error}");
    }

    #[test]
    fn prefiltered_blocks_of_one_value_look_as_their_mean() {
        let grid = Grid::axis_aligned(UVec3::new(20, 17, 9), DVec3::ONE).unwrap();
        let volume = Arc::new(Volume::new(grid, vec![30_000u16; 20 * 17 * 9]).unwrap());
        let source = build_blocks(volume, &BlockOptions { side: BlockSide::V8, ..BlockOptions::default() }).unwrap();
        let mut backend = open_backend(BackendKind::Cpu, None, Validation::Off).unwrap();
        let mut picture = |classification| {
            let levels: Vec<Level> = (0..source.layout().n_blocks_total()).map(|i| Level(i as u8 % 4)).collect();
            let style = BlockStyle { classification, ..BLENDED };
            let plan = prepare_blocks(&source, &scene(&source), &levels, style, &mut BlockResidency::default());
            backend.render(&plan.unwrap()).unwrap().image
        };
        assert_eq!(picture(Classification::OfMean), picture(Classification::Prefiltered));
    }

    #[test]
    fn blocks_in_which_long_pre_integrated_segments_end_are_drawn() {
        let dims = UVec3::new(48, 16, 16);
        let grid = Grid::axis_aligned(dims, DVec3::ONE).unwrap();
        // One layer of blocks shows something.
        let voxels: Vec<u16> = (0..grid.n_voxels() as u32).map(|i| if i % 48 / 8 == 2 { 40_000 } else { 0 }).collect();
        let volume = Arc::new(Volume::new(grid, voxels).unwrap());
        let source = build_blocks(volume, &BlockOptions { side: BlockSide::V8, ..BlockOptions::default() }).unwrap();
        let levels = vec![Level(0); source.layout().n_blocks_total()];
        let knot = |value: f64, extinction: f64| Knot { value, extinction, color: [1.0; 3] };
        let transfer = TransferFunction::new(vec![knot(10_000.0, 0.0), knot(40_000.0, 0.1)]).unwrap();
        let camera = Camera::framing(&grid.world_box(), DVec3::new(1.0, 0.1, 0.2), DVec3::Z).unwrap();
        let mut backend = open_backend(BackendKind::Cpu, None, Validation::Off).unwrap();
        let mut picture = |skipping| {
            let scene = Scene::new(camera, UVec2::new(16, 16), transfer.clone());
            let scene = Scene { rule: QuadratureRule::PreIntegrated, step_voxels: 12.0, skipping, ..scene };
            let style = BlockStyle { join: Join::Shared, ..BLENDED };
            let plan = prepare_blocks(&source, &scene, &levels, style, &mut BlockResidency::default()).unwrap();
            backend.render(&plan).unwrap().image
        };
        assert_eq!(picture(Skipping::On), picture(Skipping::Off));
    }

    #[test]
    fn levels_that_are_none_are_named() {
        let source = blocks(UVec3::new(20, 8, 8));
        let error = |levels: &[Level]| {
            let plan = prepare_blocks(&source, &scene(&source), levels, BLENDED, &mut BlockResidency::default());
            plan.unwrap_err().to_string()
        };
        assert!(error(&[Level(0); 2]).contains("2 levels for 3 flat blocks"));
        assert!(
            error(&[Level(0), Level(4), Level(0)])
                .contains("block (1, 0, 0) at level 4; blocks of 8 voxels have levels up to 3")
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn blocks_keep_their_samples_and_places_from_frame_to_frame(
            frames in prop::collection::vec(prop::collection::vec(0..4u8, 3 * 3 * 2), 1..5)
        ) {
            let source = blocks(UVec3::new(20, 17, 9));
            let (scene, mut residency) = (scene(&source), BlockResidency::default());
            let mut before: Option<(Vec<Level>, FramePlan)> = None;
            for levels in frames {
                let levels: Vec<Level> = levels.into_iter().map(Level).collect();
                let plan = prepare_blocks(&source, &scene, &levels, BLENDED, &mut residency).unwrap();
                for (i, level) in levels.iter().enumerate() {
                    let mut expected = Vec::new();
                    source.fetch(source.layout().block(i), *level, &mut expected).unwrap();
                    prop_assert_eq!(kept(&plan, i), expected);
                }
                let changed = |(last, _): &(Vec<Level>, FramePlan)| last.iter().zip(&levels).filter(|(a, b)| a != b).count();
                let copied = residency.copied().n_bricks;
                if let Some(before) = &before {
                    let is_dense = |plan: &FramePlan| plan.field().dense_level();
                    prop_assert!(copied == changed(before) || is_dense(&before.1) != is_dense(&plan));
                }
                before = Some((levels, plan));
            }
        }
    }
}
