//! The volumes that are rendered, and their blocks.

use std::path::PathBuf;
use std::sync::Arc;

use brickfield::bricks::{BlockOptions, BlockSource, BlockVolume, build_blocks};
use brickfield::frame::{Mode, SampleFormat};
use brickfield::io::WorldFrame;
use brickfield::lod::{
    BlockBudget, BlockErrors, BlockSelection, BudgetSize, OneSampleBlocks, Slab, select_block_levels,
};
use brickfield::{Scene, Viewpoint};
use brickfield_core::{ScalarType, TransferFunction, Volume};

use super::LjungArgs;
use crate::paper::{PaperError, Subject};

/// The data sets, as paths below the folder of real volumes.
const DATA: [&str; 3] = ["ct/LIDC2.mha", "ct/engine.vti", "mri/spm152.nii.gz"];

/// A volume as flat blocks, with its transfer function.
pub(super) struct DataSet {
    pub(super) name: String,
    pub(super) volume: Arc<Volume>,
    pub(super) blocks: BlockVolume,
    pub(super) transfer: TransferFunction,
    pub(super) frame: WorldFrame,
    errors: BlockErrors,
}

/// Whether the data that the parts need are there.
pub(super) fn check_data(args: &LjungArgs) -> Result<(), PaperError> {
    args.common.check_data(&DATA, args.parts().into_iter().any(|part| part.needs_data()))
}

/// The volumes that are asked for, one by one; behind the three data sets a generated one.
pub(super) fn data_sets<'a>(
    args: &'a LjungArgs,
) -> Result<impl Iterator<Item = Result<DataSet, PaperError>> + use<'a>, PaperError> {
    let is_own = args.common.files.is_empty() && args.common.only.is_none();
    let generated = is_own.then(|| of_subject(args, Subject::of_phantom(args.volume_side, ScalarType::U8)));
    Ok(args.common.named(&DATA)?.into_iter().map(|(name, path)| of_file(args, name, path)).chain(generated))
}

fn of_file(args: &LjungArgs, name: String, path: PathBuf) -> Result<DataSet, PaperError> {
    of_subject(args, Subject::of_file(name, &path)?)
}

fn of_subject(args: &LjungArgs, subject: Subject) -> Result<DataSet, PaperError> {
    let Subject { name, volume, transfer, frame } = subject;
    let options = BlockOptions { side: args.blocks, ..BlockOptions::default() };
    let blocks = build_blocks(Arc::clone(&volume), &options)?;
    let slab = Slab::of_block(blocks.layout(), blocks.grid());
    let errors = BlockErrors::estimate(blocks.layout(), blocks.summaries(), &transfer, slab)?;
    Ok(DataSet { name, volume, blocks, transfer, frame, errors })
}

impl DataSet {
    /// The levels that a budget buys, whatever the view: one-sample blocks take no texel.
    pub(super) fn select(&self, size: BudgetSize) -> Result<BlockSelection, PaperError> {
        self.select_beside(size, 0)
    }

    /// The same for samples with companions of so many bytes.
    pub(super) fn select_beside(&self, size: BudgetSize, companion_bytes: u8) -> Result<BlockSelection, PaperError> {
        let (scalar, one_sample) = (self.blocks.scalar_type(), OneSampleBlocks::Free);
        let sample_bytes = SampleFormat::of(scalar).n_bytes() as u8 + companion_bytes;
        let budget = BlockBudget { size, scalar, sample_bytes, one_sample };
        Ok(select_block_levels(self.blocks.layout(), self.errors.levels(), None, &budget)?)
    }

    pub(super) fn errors(&self) -> &BlockErrors {
        &self.errors
    }

    /// The whole volume, obliquely.
    pub(super) fn scene(&self, args: &LjungArgs, mode: Mode) -> Result<Scene, PaperError> {
        let camera = Viewpoint::default().camera(self.volume.grid(), self.frame, args.common.size)?;
        let scene = Scene::new(camera, args.common.size, self.transfer.clone());
        Ok(Scene { step_voxels: args.common.step, mode, ..scene })
    }
}
