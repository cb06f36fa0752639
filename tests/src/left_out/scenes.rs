//! The scenes: each needs something else of a shader.

use std::sync::Arc;

use brickfield::bricks::{BlockOptions, BlockVolume, BrickTree, BuildOptions, build_blocks, build_tree};
use brickfield::frame::{Division, FramePlan, Join, Placement, Target};
use brickfield::lod::{BlockLevels, Criterion};
use brickfield::optics::{Light, LightSource, LightTerms, Normals, flat_below};
use brickfield::{
    BlockResidency, BlockStyle, Classification, Residency, Scene, Skipping, Technique, TransparentBlocks,
    TrimResidency, TrimmedVolume, Trimming, prepare, prepare_blocks, prepare_trimmed,
};
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Aabb, BlockSide, BrickSide, Interblock, Level, TransferFunction};

use super::edits::finer_and_finer;
use crate::paper::PaperError;
use crate::volumes::phantom;

/// A scene of the phantom.
pub(super) struct LeftOutScene {
    pub(super) name: &'static str,
    pub(super) plan: FramePlan,
    /// The same by casting rays, nothing skipped.
    pub(super) complete: FramePlan,
}

/// What is drawn.
enum Drawn<'a> {
    Octree,
    Blocks(Vec<Level>, BlockStyle),
    Trimmed(&'a TrimmedVolume),
}

struct Stage {
    tree: BrickTree,
    blocks: BlockVolume,
    trimmed: TrimmedVolume,
    scene: Scene,
    light: Light,
}

const SIDE: BrickSide = BrickSide::S16;
/// Of random levels.
const SEED: u64 = 1;

impl Stage {
    fn new(size: UVec2) -> Result<Stage, PaperError> {
        let phantom = phantom();
        let volume = Arc::new(phantom.volume);
        let tree = build_tree(&volume, &BuildOptions { side: SIDE, ..BuildOptions::default() })?;
        let blocks =
            build_blocks(Arc::clone(&volume), &BlockOptions { side: BlockSide::V16, ..BlockOptions::default() })?;
        let flat = flat_below(volume.range(), volume.grid().spacing().min_element());
        let terms = LightTerms { ambient: 0.2, diffuse: 0.8, specular: 0.3, ..LightTerms::default() };
        let light = Light::new(LightSource::Head, terms, flat).expect("terms of a light");
        let scene = Scene::new(phantom.camera, size, phantom.transfer);
        Ok(Stage { tree, blocks, trimmed: TrimmedVolume::new(volume, SIDE), scene, light })
    }

    /// The light from a direction.
    fn light_from_the_side(&self) -> Light {
        let source = LightSource::Direction(DVec3::new(0.5, -0.7, 0.6));
        Light::new(source, self.light.terms(), self.light.flat_below()).expect("terms of a light")
    }

    fn with(
        &self,
        name: &'static str,
        drawn: Drawn<'_>,
        change: impl FnOnce(&mut Scene),
    ) -> Result<LeftOutScene, PaperError> {
        let mut scene = self.scene.clone();
        change(&mut scene);
        let plan = |scene: &Scene| -> Result<FramePlan, PaperError> {
            Ok(match &drawn {
                Drawn::Octree => prepare(&self.tree, scene, &mut Residency::default())?,
                Drawn::Blocks(levels, style) => {
                    prepare_blocks(&self.blocks, scene, levels, *style, &mut BlockResidency::default())?
                }
                Drawn::Trimmed(source) => {
                    prepare_trimmed(source, scene, Trimming::Packed, &mut TrimResidency::default())?
                }
            })
        };
        let complete = Scene { skipping: Skipping::Off, technique: Technique::RayCasting, ..scene.clone() };
        Ok(LeftOutScene { name, plan: plan(&scene)?, complete: plan(&complete)? })
    }
}

/// A scene before and after edits of its transfer function, each of which needs another shader.
pub(super) fn edited(size: UVec2) -> Result<Vec<FramePlan>, PaperError> {
    let stage = Stage::new(size)?;
    let mut residency = Residency::default();
    let plan = |transfer| Ok(prepare(&stage.tree, &Scene { transfer, ..stage.scene.clone() }, &mut residency)?);
    finer_and_finer(&stage.scene.transfer).into_iter().map(plan).collect()
}

/// All scenes.
pub(super) fn scenes(size: UVec2) -> Result<Vec<LeftOutScene>, PaperError> {
    let stage = Stage::new(size)?;
    let layout = *brickfield::bricks::BlockSource::layout(&stage.blocks);
    let equal = BlockLevels::uniform(layout, Level(1)).levels().to_vec();
    let mixed = BlockLevels::random(layout, SEED).levels().to_vec();
    let nearest = BlockStyle { join: Join::Shared, ..BlockStyle::default() };
    let blended = BlockStyle { join: Join::Blend(Interblock::MaximumDistance), ..nearest };
    let prefiltered = BlockStyle { classification: Classification::Prefiltered, ..blended };
    let everything = BlockStyle { transparent: TransparentBlocks::Blended, ..prefiltered };
    let box_of_voxels = Aabb { min: DVec3::new(10.0, 20.5, 5.0), max: DVec3::new(100.0, 90.0, 111.0) };
    let fog = TransferFunction::constant(0.004, [0.9, 0.8, 0.7]).expect("a constant");
    let all = |s: &mut Scene| s.skipping = Skipping::Off;
    let slices = |s: &mut Scene| {
        (s.division, s.placement) = (Division::Brick, Placement::ViewportPlanes);
        s.technique = Technique::Polygons(Target::Float32);
    };
    Ok(vec![
        stage.with("flat colour", Drawn::Octree, |s| s.transfer = fog)?,
        stage.with("unlit, nothing left out", Drawn::Octree, all)?,
        stage.with("unlit", Drawn::Octree, |_| ())?,
        stage.with("lit", Drawn::Octree, |s| s.light = Some(stage.light))?,
        stage.with("lit from the side", Drawn::Octree, |s| s.light = Some(stage.light_from_the_side()))?,
        stage.with("several resolutions", Drawn::Octree, |s| s.detail = vec![Criterion::Distance { factor: 0.25 }])?,
        stage.with("clip box", Drawn::Octree, |s| s.clip = Some(box_of_voxels))?,
        stage.with("polygons", Drawn::Octree, slices)?,
        stage.with("trimmed bricks", Drawn::Trimmed(&stage.trimmed), |_| ())?,
        stage.with("blocks of one resolution", Drawn::Blocks(equal, blended), |_| ())?,
        stage.with("blocks, nearest", Drawn::Blocks(mixed.clone(), nearest), |_| ())?,
        stage.with("blocks, blended", Drawn::Blocks(mixed.clone(), blended), |_| ())?,
        stage.with("blocks, prefiltered", Drawn::Blocks(mixed.clone(), prefiltered), |_| ())?,
        stage.with("everything", Drawn::Blocks(mixed, everything), |s| {
            s.light = Some(stage.light_from_the_side().on_normals(Normals::Stored));
            s.clip = Some(box_of_voxels);
        })?,
    ])
}
