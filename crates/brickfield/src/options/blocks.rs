//! Options of flat blocks.

use std::path::Path;
use std::sync::Arc;

use brickfield_bricks::{BlockOptions, BlockSource, build_blocks};
use brickfield_core::{BlockSide, Companion, TransferFunction, Volume};
use brickfield_frame::Join;
use brickfield_io::WorldFrame;
use brickfield_lod::{
    BlockBudget, BlockErrors, BlockLevels, BlockSelection, BlockView, BudgetSize, Importance, OneSampleBlocks, Slab,
    block_weights, select_block_levels,
};
use clap::Args;

use super::{InputOptions, OptionError, ViewOptions, values};
use crate::{BlockStyle, Classification, Scene, TransparentBlocks};

/// Flat blocks instead of an octree.
#[derive(Args, Clone, Debug)]
pub struct BlockArgs {
    /// Draw flat blocks of N voxels a side (8, 16 or 32), each at a resolution that the transfer function asks for, instead of
    /// an octree of bricks (--brick, --downsampling and --lod are not for blocks)
    #[arg(long, value_name = "N", value_parser = values::block_side)]
    pub blocks: Option<BlockSide>,
    /// Bytes that the samples of all blocks may take, in MiB
    #[arg(long, value_name = "MIB", requires = "blocks", conflicts_with_all = ["ratio", "block_level"], value_parser = values::positive)]
    pub budget_mib: Option<f64>,
    /// The same as a ratio: 32 for a 32nd of the volume's bytes
    #[arg(long, value_name = "N", requires = "blocks", conflicts_with = "block_level", value_parser = values::positive)]
    pub ratio: Option<f64>,
    /// One level for all blocks, whatever they show: 0 is the finest, and the one of all unless stated
    #[arg(long, value_name = "LEVEL", requires = "blocks")]
    pub block_level: Option<u8>,
    /// Values between blocks: nearest (the block that holds the position alone), minimum-distance, boundary-split or
    /// maximum-distance (Ljung, Lundstroem and Ynnerman 2006)
    #[arg(long, value_name = "SCHEME", requires = "blocks", default_value = "maximum-distance", value_parser = values::join)]
    pub between: Join,
    /// Inside of transparent blocks: empty (as in the paper) or blended (as between others)
    #[arg(long, value_name = "HOW", requires = "blocks", default_value = "empty", value_parser = values::transparent_blocks)]
    pub transparent: TransparentBlocks,
    /// Optics of coarse samples: mean (of the average) or prefiltered (the mean of those of its voxels, by a byte more for each sample)
    #[arg(long, value_name = "HOW", requires = "blocks", default_value = "mean", value_parser = values::classification)]
    pub classify: Classification,
    /// Choose levels by what the transfer function shows alone, whatever part of it the camera sees
    #[arg(long, requires = "blocks")]
    pub any_view: bool,
}

/// Flat blocks that are ready to be rendered.
pub struct BlockSubject {
    /// The blocks.
    pub source: Box<dyn BlockSource>,
    /// The names of the world's axes, where they are known.
    pub frame: WorldFrame,
    /// The transfer function that was asked for.
    pub transfer: TransferFunction,
    /// The volume, if it is in memory.
    pub volume: Option<Arc<Volume>>,
}

impl BlockSubject {
    /// Opens a file and cuts it into blocks; what the reader noticed is printed. Uneven slices are made even.
    ///
    /// # Errors
    /// What the reader, the transfer function or the builder says.
    pub fn open(
        path: &Path,
        input: &InputOptions,
        side: BlockSide,
        view: &ViewOptions,
    ) -> Result<BlockSubject, OptionError> {
        let (volume, frame, transfer) = input.open_to_render(path, view)?;
        let volume = Arc::new(volume);
        let blocks = build_blocks(Arc::clone(&volume), &BlockOptions { side, ..BlockOptions::default() })?;
        Ok(BlockSubject { source: Box::new(blocks), frame, transfer, volume: Some(volume) })
    }
}

impl BlockArgs {
    /// How blocks are drawn.
    pub fn style(&self) -> BlockStyle {
        BlockStyle { join: self.between, transparent: self.transparent, classification: self.classify }
    }

    /// The level of each block: what the budget buys, or one for all.
    ///
    /// # Errors
    /// A budget that is too small; a level that blocks do not have.
    pub fn select(&self, subject: &BlockSubject, scene: &Scene) -> Result<BlockSelection, OptionError> {
        let source = subject.source.as_ref();
        let (layout, scalar) = (*source.layout(), source.scalar_type());
        let size = match (self.budget_mib, self.ratio) {
            (Some(mib), _) => BudgetSize::Bytes((mib * f64::from(1 << 20)) as u64),
            (None, Some(ratio)) => BudgetSize::Ratio(ratio),
            (None, None) => {
                let level = brickfield_core::Level(self.block_level.unwrap_or(0));
                let most = layout.side().one_sample();
                if level > most {
                    return Err(OptionError::BlockLevel { level: level.0, side: layout.side(), most: most.0 });
                }
                let levels = BlockLevels::uniform(layout, level);
                return Ok(BlockSelection { n_bytes: levels.n_bytes(scalar), levels, cost: 0.0 });
            }
        };
        let slab = Slab::of_block(&layout, source.grid());
        let errors = BlockErrors::estimate(&layout, source.summaries(), &scene.transfer, slab)?;
        let view = BlockView { view: scene.view(), clip: scene.clip, importance: Importance::default() };
        let weights = (!self.any_view).then(|| block_weights(&layout, source.grid(), &view));
        let companion_bytes = match self.classify {
            Classification::OfMean => 0,
            Classification::Prefiltered => Companion::Spread.n_bytes() as u8,
        };
        let budget = BlockBudget { size, scalar, companion_bytes, one_sample: OneSampleBlocks::Free };
        Ok(select_block_levels(&layout, errors.levels(), weights.as_deref(), &budget)?)
    }
}
