//! The volumes that are rendered, as flat blocks, and their scenes.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use brickfield::bricks::{BlockOptions, BlockSource, BlockVolume, build_blocks};
use brickfield::frame::Join;
use brickfield::io::WorldFrame;
use brickfield::{BlockStyle, Scene, TransparentBlocks, Viewpoint};
use brickfield_core::{BlockSide, Interblock, Knot, LinearRgb, TransferFunction};
use brickfield_optics::{Light, LightSource, LightTerms, Normals, flat_below};

use super::SaladiArgs;
use crate::paper::{PaperError, Subject};

/// A computed tomogram and a magnetic resonance image, as in the paper; as paths below the folder of real volumes.
pub(super) const DATA: [&str; 2] = ["ct/engine.vti", "mri/spm152.nii.gz"];

const WARM: LinearRgb = [0.85, 0.55, 0.35];
const BRIGHT: LinearRgb = [0.95, 0.9, 0.8];
/// A dull surface: the paper's light is Lambert's alone, and a little shows from everywhere.
const TERMS: LightTerms = LightTerms { ambient: 0.1, diffuse: 0.9, specular: 0.0, shininess: 1 };
/// From transparent to opaque, as a part of the range of values.
const EDGE: f64 = 1.0 / 32.0;

/// A volume as flat blocks.
pub(super) struct DataSet {
    pub(super) name: String,
    pub(super) blocks: BlockVolume,
    pub(super) frame: WorldFrame,
    /// From the file to the volume in memory.
    pub(super) loading_ms: f64,
    /// From the volume to its blocks.
    pub(super) blocks_ms: f64,
}

/// Whether the data that the parts need are there.
pub(super) fn check_data(args: &SaladiArgs) -> Result<(), PaperError> {
    args.parts().into_iter().try_for_each(|part| args.common.check_data(part.data(), true))
}

/// The names of the volumes that are asked for, and their paths.
pub(super) fn files(args: &SaladiArgs) -> Result<Vec<(String, PathBuf)>, PaperError> {
    args.common.named(&DATA)
}

/// Values between blocks are blended; transparent blocks serve their neighbours.
pub(super) fn style() -> BlockStyle {
    let join = Join::Blend(Interblock::MaximumDistance);
    BlockStyle { join, transparent: TransparentBlocks::Blended, ..BlockStyle::default() }
}

impl DataSet {
    /// A volume of a file.
    pub(super) fn of_file(side: BlockSide, name: String, path: &Path) -> Result<DataSet, PaperError> {
        let begin = Instant::now();
        let Subject { name, volume, frame, .. } = Subject::of_file(name, path)?;
        let loading_ms = begin.elapsed().as_secs_f64() * 1e3;
        let begin = Instant::now();
        let blocks = build_blocks(Arc::clone(&volume), &BlockOptions { side, ..BlockOptions::default() })?;
        let blocks_ms = begin.elapsed().as_secs_f64() * 1e3;
        Ok(DataSet { name, blocks, frame, loading_ms, blocks_ms })
    }

    /// Shows what lies above a part of the range of values, nearly opaque.
    pub(super) fn transfer(&self, part: f64) -> TransferFunction {
        let (range, grid) = (self.blocks.range(), self.blocks.grid());
        let opaque = 1.0 / grid.spacing().min_element();
        let at = |part: f64| range.min + part * (range.max - range.min);
        let knot = |part, extinction, color| Knot { value: at(part), extinction, color };
        let knots = vec![knot(part, 0.0, WARM), knot(part + EDGE, opaque, WARM), knot(part + 2.0, opaque, BRIGHT)];
        TransferFunction::new(knots).expect("knots ascend")
    }

    /// The whole volume, in the light of a place on the upper left behind the eye, or without any.
    pub(super) fn scene(&self, args: &SaladiArgs, normals: Option<Normals>) -> Result<Scene, PaperError> {
        let grid = self.blocks.grid();
        let camera = Viewpoint::default().camera(grid, self.frame, args.common.size)?;
        let transfer = self.transfer(f64::from(args.threshold) / 100.0);
        let beside = (camera.up() - camera.right()) * (0.6 * grid.world_box().diagonal());
        let steepness = flat_below(self.blocks.range(), grid.spacing().min_element());
        let light = Light::new(LightSource::Place(camera.eye() + beside), TERMS, steepness).expect("a light");
        let light = normals.map(|normals| light.on_normals(normals));
        Ok(Scene { step_voxels: args.common.step, light, ..Scene::new(camera, args.common.size, transfer) })
    }
}
