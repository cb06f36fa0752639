//! The flat blocks that frames share, kept from frame to frame.

use std::sync::Arc;

use brickfield_bricks::{BlockSource, FetchError, SourceId};
use brickfield_core::glam::UVec3;
use brickfield_core::{BlockLayout, BlockSide, Level};
use brickfield_frame::{
    BlockPlaces, BlockRow, BlockSamples, Chunk, Decode, Field, IndexEntry, IndexGrid, IndexLattice, Join, Packing,
    Places, Reach, SampleFormat, Slots,
};
use rayon::prelude::*;

use crate::Copied;
use crate::encode::encode;

/// The flat blocks of the last frame, packed into one texture.
///
/// A frame that needs another level of a block fetches that block alone, and the others stay where they are. One residency serves
/// one source at a time: handed another, it begins anew.
#[derive(Debug, Default)]
pub struct BlockResidency {
    held: Option<Held>,
    copied: Copied,
}

/// The blocks of a source, at some levels.
#[derive(Debug)]
struct Held {
    source: SourceId,
    arrangement: Arrangement,
    rows: Vec<BlockRow>,
    chunks: Vec<Option<Arc<Chunk>>>,
    /// The last field, and the blocks that are drawn in it.
    field: Option<(Vec<bool>, Field)>,
}

/// How blocks lie in the texture.
#[derive(Debug)]
enum Arrangement {
    /// As in the volume: all of one level.
    Dense { level: Level, texels: UVec3 },
    /// Without gaps.
    Packed(Packing),
}

/// Texels along the sides of a texture, at most: every Vulkan device takes so many along x and y, and as many layers as rows tell
/// apart.
const MAX_TEXELS: u32 = 2048;
/// Blocks are packed anew if their texture has this many times the cubes that they need, and a few more.
const TOO_LARGE: u64 = 2;
const FEW_CUBES: u64 = 8;

impl BlockResidency {
    /// The blocks whose samples the last frame fetched.
    pub fn copied(&self) -> Copied {
        self.copied
    }

    /// Texels of the texture that hold no sample.
    pub fn n_free_texels(&self) -> u64 {
        self.held.as_ref().map_or(0, |held| match &held.arrangement {
            Arrangement::Dense { .. } => 0,
            Arrangement::Packed(packing) => packing.n_free(),
        })
    }

    /// Fetches the blocks that have another level than before.
    pub(crate) fn hold(&mut self, source: &dyn BlockSource, levels: &[Level]) -> Result<(), FetchError> {
        self.copied = Copied::default();
        let dense = dense_texels(source.layout(), levels);
        let is_kept = |held: &Held| held.source == source.id() && held.dense_level() == dense.map(|(level, _)| level);
        let before = self.held.as_ref().filter(|held| is_kept(held));
        let is_new = |i: &usize| before.is_none_or(|held| held.rows[*i].level != levels[*i]);
        let mut new: Vec<usize> = (0..levels.len()).filter(is_new).collect();
        new.sort_by_cached_key(|i| (levels[*i], along_cubes(source.layout().block(*i))));
        let coding = Coding::of(source);
        let fetched: Vec<Vec<u8>> =
            new.par_iter().map(|i| coding.fetch(source, *i, levels[*i])).collect::<Result<_, _>>()?;
        self.copied = Copied { n_bricks: new.len(), n_bytes: fetched.iter().map(Vec::len).sum() };
        let mut held = match self.held.take() {
            Some(held) if is_kept(&held) => held,
            _ => Held::empty(source, levels, dense),
        };
        held.put(source.layout(), coding.format, &new, levels, fetched);
        if !new.is_empty() && held.is_too_large(source.layout()) {
            held.pack_anew(source.layout());
        }
        self.held = Some(held);
        Ok(())
    }

    /// The field of the held blocks, of which some are drawn: with the index and the slots of the last one, where they are the same.
    pub(crate) fn field(&mut self, source: &dyn BlockSource, drawn: Vec<bool>, join: Join) -> Field {
        let is_as_before = self.copied.n_bricks == 0;
        let held = self.held.as_mut().expect("blocks are held before they are a field");
        let before = held.field.take();
        let slots = match &before {
            Some((_, field)) if is_as_before => Arc::clone(field.slots()),
            Some((_, field)) => Arc::new(held.slots(source).following(field.slots())),
            None => Arc::new(held.slots(source)),
        };
        let index = match &before {
            Some((last, field)) if *last == drawn => Arc::clone(field.index()),
            Some((_, field)) => Arc::new(index(source.layout(), &drawn).following(field.index())),
            None => Arc::new(index(source.layout(), &drawn)),
        };
        let field = Field::new(source.layout().dims(), index, slots, join).expect("an index of the blocks' numbers");
        held.field = Some((drawn, field.clone()));
        field
    }
}

/// An index in which each block that is drawn has its own number for a slot.
fn index(layout: &BlockLayout, drawn: &[bool]) -> IndexGrid {
    let entry = |(i, block): (usize, UVec3)| (block, IndexEntry::Resident { slot: i as u32, reach: Reach(0) });
    let entries = layout.blocks().enumerate().filter(|(i, _)| drawn[*i]).map(entry);
    let lattice = IndexLattice { cell_samples: layout.side().n_voxels(), origin: -0.5 };
    IndexGrid::new(layout.n_blocks(), lattice, entries)
}

impl Held {
    fn empty(source: &dyn BlockSource, levels: &[Level], dense: Option<(Level, UVec3)>) -> Held {
        let (layout, side) = (source.layout(), source.layout().side());
        let cubes = levels.iter().enumerate().map(|(i, level)| cube_level(layout, i, *level));
        let arrangement = match dense {
            Some((level, texels)) => Arrangement::Dense { level, texels },
            None => Arrangement::Packed(Packing::new(side, n_cubes(side, cubes), MAX_TEXELS)),
        };
        let row = BlockRow { level: side.one_sample(), samples: BlockSamples::One(0.0) };
        let (rows, chunks) = (vec![row; levels.len()], vec![None; levels.len()]);
        Held { source: source.id(), arrangement, rows, chunks, field: None }
    }

    fn dense_level(&self) -> Option<Level> {
        match self.arrangement {
            Arrangement::Dense { level, .. } => Some(level),
            Arrangement::Packed(_) => None,
        }
    }

    /// The texture's size.
    fn texels(&self) -> UVec3 {
        match &self.arrangement {
            Arrangement::Dense { texels, .. } => *texels,
            Arrangement::Packed(packing) => packing.texels(),
        }
    }

    fn slots(&self, source: &dyn BlockSource) -> Slots {
        let coding = Coding::of(source);
        let places = BlockPlaces::new(*source.layout(), self.texels(), self.rows.clone());
        let decode = coding.stored.rescaled(source.rescale());
        let slots = Slots::new(coding.format, decode, Places::Blocks(places), self.chunks.clone());
        slots.expect("blocks fill their places")
    }

    /// Puts blocks at new levels to places of their own.
    fn put(
        &mut self,
        layout: &BlockLayout,
        format: SampleFormat,
        new: &[usize],
        levels: &[Level],
        fetched: Vec<Vec<u8>>,
    ) {
        for i in new {
            if let (BlockSamples::Texture(texel), Arrangement::Packed(packing)) =
                (self.rows[*i].samples, &mut self.arrangement)
            {
                packing.give_back(cube_level(layout, *i, self.rows[*i].level), texel);
            }
        }
        // The largest first: then none of them is cut for a smaller one while others wait.
        let mut order: Vec<(usize, Vec<u8>)> = new.iter().copied().zip(fetched).collect();
        order.sort_by_key(|(i, _)| cube_level(layout, *i, levels[*i]));
        for (i, bytes) in order {
            let is_one = bytes.len() == format.n_bytes() && self.dense_level().is_none();
            let samples = match is_one {
                true => BlockSamples::One(format.read(&bytes, 0) as f32),
                false => BlockSamples::Texture(self.arrangement.take(layout, i, levels[i])),
            };
            self.chunks[i] = (!is_one).then(|| Arc::new(Chunk::new(bytes)));
            self.rows[i] = BlockRow { level: levels[i], samples };
        }
    }

    /// Cubes of a block's side that the blocks fill.
    fn n_cubes(&self, layout: &BlockLayout) -> u64 {
        let in_texture = (0..self.rows.len()).filter(|i| self.chunks[*i].is_some());
        n_cubes(layout.side(), in_texture.map(|i| cube_level(layout, i, self.rows[i].level)))
    }

    fn is_too_large(&self, layout: &BlockLayout) -> bool {
        let side = u64::from(layout.side().n_voxels());
        let n_held = self.texels().as_u64vec3().element_product() / side.pow(3);
        self.dense_level().is_none() && n_held > TOO_LARGE * self.n_cubes(layout) + FEW_CUBES
    }

    /// Moves all blocks together. Each is another content, for its place is another.
    fn pack_anew(&mut self, layout: &BlockLayout) {
        self.arrangement = Arrangement::Packed(Packing::new(layout.side(), self.n_cubes(layout), MAX_TEXELS));
        let mut order: Vec<usize> = (0..self.rows.len()).filter(|i| self.chunks[*i].is_some()).collect();
        order.sort_by_key(|i| cube_level(layout, *i, self.rows[*i].level));
        for i in order {
            self.rows[i].samples = BlockSamples::Texture(self.arrangement.take(layout, i, self.rows[i].level));
            self.chunks[i] = self.chunks[i].as_ref().map(|chunk| Arc::new(Chunk::new(chunk.bytes())));
        }
    }
}

impl Arrangement {
    /// The first texel of a block.
    fn take(&mut self, layout: &BlockLayout, ordinal: usize, level: Level) -> UVec3 {
        match self {
            Arrangement::Dense { .. } => layout.block(ordinal) * (layout.side().n_voxels() >> level.0),
            Arrangement::Packed(packing) => packing.take(cube_level(layout, ordinal, level)),
        }
    }
}

/// The level of all blocks and their texels as in the volume, if all have one of several samples and the texture is none too large.
fn dense_texels(layout: &BlockLayout, levels: &[Level]) -> Option<(Level, UVec3)> {
    let level = *levels.first()?;
    let end = layout.n_blocks() - 1;
    let texels = end * (layout.side().n_voxels() >> level.0) + layout.n_samples(end, level);
    let fits = level < layout.side().one_sample() && texels.max_element() <= MAX_TEXELS;
    (fits && levels.iter().all(|other| *other == level)).then_some((level, texels))
}

/// Cubes of a block's side that cubes of some levels fill.
fn n_cubes(side: BlockSide, levels: impl Iterator<Item = Level>) -> u64 {
    let n_texels: u64 = levels.map(|level| u64::from(side.n_voxels() >> level.0).pow(3)).sum();
    n_texels.div_ceil(u64::from(side.n_voxels()).pow(3))
}

/// The level of the least cube of texels that has room for a block: a short one may fit a smaller one.
fn cube_level(layout: &BlockLayout, ordinal: usize, level: Level) -> Level {
    let n = layout.n_samples(layout.block(ordinal), level).max_element().next_power_of_two();
    Level((layout.side().n_voxels() / n).trailing_zeros() as u8)
}

/// The place of a block on a curve that fills cube by cube: neighbours on it mostly come from one chunk of a source (Morton 1966).
fn along_cubes(block: UVec3) -> u128 {
    let bits = |axis: u32, n: u32| (0..32).map(move |bit| u128::from(n >> bit & 1) << (3 * bit + axis));
    (0..3).flat_map(|axis| bits(axis, block[axis as usize])).sum()
}

/// How the samples of a source are held for a backend.
struct Coding {
    format: SampleFormat,
    stored: Decode,
}

impl Coding {
    fn of(source: &dyn BlockSource) -> Coding {
        let range = source.rescale().stored_range(source.range());
        let (format, stored) = SampleFormat::encoding(source.scalar_type(), range);
        Coding { format, stored }
    }

    fn fetch(&self, source: &dyn BlockSource, ordinal: usize, level: Level) -> Result<Vec<u8>, FetchError> {
        let mut bytes = Vec::new();
        source.fetch(source.layout().block(ordinal), level, &mut bytes)?;
        Ok(encode(bytes, source.scalar_type(), self.format, self.stored))
    }
}
