//! Options of flat blocks.

use std::path::Path;
use std::sync::Arc;

use brickfield_bricks::{BlockOptions, BlockSource, BlockVolume, build_blocks};
use brickfield_core::{BlockSide, TransferFunction, Volume};
use brickfield_frame::{Join, Slices};
use brickfield_io::WorldFrame;
use brickfield_lod::{
    BlockBudget, BlockErrors, BlockLevels, BlockSelection, BlockView, BudgetSize, Importance, OneSampleBlocks, Slab,
    block_weights, select_block_levels, spend_rest,
};
use clap::Args;

#[cfg(feature = "formats")]
use super::progress_bar;
use super::{FinestVoxels, InputOptions, OptionError, ViewOptions, note, values};
use crate::{BlockStyle, Classification, Scene, TransparentBlocks, sample_bytes};
#[cfg(feature = "formats")]
use crate::{StoreBlocks, StoreLimits, SummaryProgress};

/// Flat blocks instead of an octree.
#[derive(Args, Clone, Debug)]
pub struct BlockArgs {
    /// Draw flat blocks of N voxels a side (8, 16 or 32), each at a resolution that the transfer function asks for, instead of
    /// an octree of bricks (--brick, --downsampling and --lod are not for blocks)
    #[arg(long, value_name = "N", value_parser = values::block_side)]
    pub blocks: Option<BlockSide>,
    /// Bytes that the samples of all blocks and their spreads and gradients may take, in MiB: on the host, and on the device. They go where the
    /// picture gains most; what is left goes to transparent blocks beside visible ones. Of an OME-Zarr, which is read in parts, a quarter is for
    /// unpacked chunks, and the summaries of blocks come on top
    #[arg(long, value_name = "MIB", requires = "blocks", conflicts_with_all = ["ratio", "block_level"], value_parser = values::positive, allow_hyphen_values = true)]
    pub budget_mib: Option<f64>,
    /// The same as a ratio: 32 for a 32nd of the volume's bytes
    #[arg(long, value_name = "N", requires = "blocks", conflicts_with = "block_level", value_parser = values::positive, allow_hyphen_values = true)]
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
    /// With --polygons: together, or interiors-first (each polygon twice, first among the block's own samples, then between blocks, as in
    /// the paper: the same picture)
    #[arg(long, value_name = "ORDER", requires_all = ["blocks", "polygons"], default_value = "together", value_parser = values::slices)]
    pub slices: Slices,
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
    pub blocks: Blocks,
    /// The names of the world's axes, where they are known.
    pub frame: WorldFrame,
    /// The transfer function that was asked for.
    pub transfer: TransferFunction,
    /// Most bytes that blocks of a store may take where no budget says so.
    pub max_bytes: u64,
}

/// Where flat blocks come from.
pub enum Blocks {
    /// A volume in memory.
    Memory(BlockVolume),
    /// A store, of which the chunks at the selected resolutions are read.
    #[cfg(feature = "formats")]
    Store(Box<StoreBlocks>),
}

impl Blocks {
    /// The blocks as a source.
    pub fn source(&self) -> &dyn BlockSource {
        match self {
            Blocks::Memory(blocks) => blocks,
            #[cfg(feature = "formats")]
            Blocks::Store(blocks) => blocks.as_ref(),
        }
    }

    /// Their voxels.
    pub fn finest_voxels(&self) -> FinestVoxels<'_> {
        match self {
            Blocks::Memory(blocks) => FinestVoxels::Volume(blocks.volume()),
            #[cfg(feature = "formats")]
            Blocks::Store(blocks) => FinestVoxels::Blocks(blocks.as_ref()),
        }
    }

    /// The volume, if it is in memory.
    pub fn volume(&self) -> Option<&Volume> {
        match self {
            Blocks::Memory(blocks) => Some(blocks.volume()),
            #[cfg(feature = "formats")]
            Blocks::Store(_) => None,
        }
    }
}

impl BlockArgs {
    /// Opens a file as blocks of a side; the notes of its reader are printed. An OME-Zarr stays on disk. Any other volume is read and cut;
    /// its uneven slices are made even.
    ///
    /// # Errors
    /// What the reader, the transfer function or the builder says.
    pub fn open(
        &self,
        path: &Path,
        input: &InputOptions,
        side: BlockSide,
        view: &ViewOptions,
    ) -> Result<BlockSubject, OptionError> {
        #[cfg(feature = "formats")]
        if input.raw.is_none() && brickfield_io::detect(path)? == brickfield_io::Format::OmeZarr {
            return self.open_store(path, input, side, view);
        }
        let (volume, frame, transfer) = input.open_to_render(path, view)?;
        let blocks = build_blocks(Arc::new(volume), &BlockOptions { side, ..BlockOptions::default() })?;
        Ok(BlockSubject { blocks: Blocks::Memory(blocks), frame, transfer, max_bytes: input.limits().max_bytes })
    }

    #[cfg(feature = "formats")]
    fn open_store(
        &self,
        path: &Path,
        input: &InputOptions,
        side: BlockSide,
        view: &ViewOptions,
    ) -> Result<BlockSubject, OptionError> {
        let max_bytes = input.limits().max_bytes;
        let limits = StoreLimits { max_bytes, ..self.store_limits() };
        let bar = progress_bar("summing up");
        let mut told = |p: SummaryProgress| {
            bar.set_length(p.n_total.into());
            bar.set_position(p.n_done.into());
        };
        let opened = StoreBlocks::open(path, side, limits, &input.open_options(), &mut told);
        bar.finish_and_clear();
        let store = opened?;
        store.facts().notes.iter().chain(&store.note()).for_each(|text| note(text));
        let transfer = view.transfer_of_store(&store)?;
        Ok(BlockSubject { frame: store.facts().frame, transfer, max_bytes, blocks: Blocks::Store(Box::new(store)) })
    }

    #[cfg(feature = "formats")]
    fn store_limits(&self) -> StoreLimits {
        self.budget_mib.map_or(StoreLimits::default(), |mib| StoreLimits::of_budget(bytes_of(mib)))
    }

    /// How blocks are drawn.
    pub fn style(&self) -> BlockStyle {
        BlockStyle {
            join: self.between,
            transparent: self.transparent,
            slices: self.slices,
            classification: self.classify,
        }
    }

    /// The level of each block: what the budget buys, or one for all.
    ///
    /// # Errors
    /// A budget that is too small; a level that blocks do not have; blocks of a store that take more than the reader's limit.
    pub fn select(&self, subject: &BlockSubject, scene: &Scene) -> Result<BlockSelection, OptionError> {
        let source = subject.blocks.source();
        let (layout, scalar) = (*source.layout(), source.scalar_type());
        let size = match (self.budget_mib, self.ratio) {
            (Some(mib), _) => BudgetSize::Bytes(bytes_of(mib) - self.reserved_bytes(&subject.blocks)),
            (None, Some(ratio)) => BudgetSize::Ratio(ratio),
            (None, None) => {
                let level = brickfield_core::Level(self.block_level.unwrap_or(0));
                let most = layout.side().one_sample();
                if level > most {
                    return Err(OptionError::BlockLevel { level: level.0, side: layout.side(), most: most.0 });
                }
                let levels = BlockLevels::uniform(layout, level);
                let n_bytes = levels.n_bytes(scalar);
                return match subject.blocks.volume().is_none() && n_bytes > subject.max_bytes {
                    true => Err(OptionError::BlocksTooLarge { level: level.0, n_bytes, max_bytes: subject.max_bytes }),
                    false => Ok(BlockSelection { n_bytes, levels, cost: 0.0 }),
                };
            }
        };
        let slab = Slab::of_block(&layout, source.grid());
        let errors = BlockErrors::estimate(&layout, source.summaries(), &scene.transfer, slab)?;
        let view = BlockView { view: scene.view(), clip: scene.clip, importance: Importance::default() };
        let weights = (!self.any_view).then(|| block_weights(&layout, source.grid(), &view));
        let sample_bytes = sample_bytes(source, scene, self.classify);
        let budget = BlockBudget { size, scalar, sample_bytes, one_sample: OneSampleBlocks::Free };
        let mut selection = select_block_levels(&layout, errors.levels(), weights.as_deref(), &budget)?;
        if let Join::Blend(_) = self.between {
            selection =
                spend_rest(&layout, source.summaries(), &scene.transfer, weights.as_deref(), &budget, selection)?;
        }
        if selection.n_bytes == 0 && selection.cost > 0.0 {
            note(&"the budget buys no block more than one sample: every block is drawn as its mean");
        }
        Ok(selection)
    }

    /// Bytes of the budget that are not for blocks.
    fn reserved_bytes(&self, blocks: &Blocks) -> u64 {
        match blocks {
            Blocks::Memory(_) => 0,
            #[cfg(feature = "formats")]
            Blocks::Store(_) => self.store_limits().cache_bytes,
        }
    }
}

fn bytes_of(mib: f64) -> u64 {
    (mib * f64::from(1 << 20)) as u64
}
