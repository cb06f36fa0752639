//! The flat blocks that frames share, kept from frame to frame.

use std::collections::BTreeMap;
use std::sync::Arc;

use brickfield_bricks::{
    BlockSource, FetchError, SourceId, SurfaceEdit, SurfaceNormals, greatest_gradient, greatest_spread,
};
use brickfield_core::glam::UVec3;
use brickfield_core::{BlockLayout, BlockSide, Companion, Level, TransferFunction, ValueRange};
use brickfield_frame::{
    BlockPlaces, BlockRanges, BlockRow, BlockSamples, Chunk, Decode, Field, IndexEntry, IndexGrid, IndexLattice, Join,
    Packing, Places, Reach, SampleFormat, Slots, Upload,
};
use rayon::prelude::*;

use crate::Copied;
use crate::encode::Coding;

/// The flat blocks of the last frame, packed into one texture.
///
/// A frame that needs another level of a block fetches that block alone, and the others stay where they are. One residency serves
/// one source at a time: handed another, it begins anew.
#[derive(Debug, Default)]
pub struct BlockResidency {
    held: Option<Held>,
    copied: Copied,
    /// The normals of surface voxels, while frames ask for them, and the work that the last frame made.
    surface: Option<(SurfaceNormals, SurfaceEdit)>,
    upload: Upload,
}

/// The blocks of a source, at some levels.
#[derive(Debug)]
struct Held {
    source: SourceId,
    arrangement: Arrangement,
    rows: Vec<BlockRow>,
    chunks: Vec<Option<Arc<Chunk>>>,
    companions: BTreeMap<Companion, HeldCompanions>,
    /// The ranges of the blocks, once a frame had spreads.
    ranges: Option<Arc<BlockRanges>>,
    /// Whether blocks have come or moved since the last field.
    has_changed: bool,
    /// The last field, and the blocks that are drawn in it.
    field: Option<(Vec<bool>, Field)>,
}

/// The companions of all samples, in the places of the samples.
#[derive(Debug)]
struct HeldCompanions {
    chunks: Vec<Option<Arc<Chunk>>>,
    /// Of blocks that are one sample.
    ones: Vec<u32>,
    /// Whether the last field has others, or none.
    has_changed: bool,
}

/// How blocks lie in the texture.
#[derive(Debug)]
enum Arrangement {
    /// As in the volume: all of one level.
    Dense { level: Level, texels: UVec3 },
    /// Without gaps.
    Packed(Packing),
}

/// Texels along x and y of a texture, at most: every Vulkan device takes so many.
pub(crate) const MAX_TEXELS: u32 = 2048;
/// Texels that blocks of one level may take in their order: rows tell so many layers apart.
const MOST_TEXELS: UVec3 = UVec3::new(MAX_TEXELS, MAX_TEXELS, 1024);
/// Blocks are packed anew if their texture has this many times the cubes that they need, and a few more.
const TOO_LARGE: u64 = 2;
const FEW_CUBES: u64 = 8;
/// They are, too, if it has grown to this many times the layers that it is wide and high.
const TOO_TALL: u32 = 4;

impl BlockResidency {
    /// The blocks whose samples the last frame fetched.
    pub fn copied(&self) -> Copied {
        self.copied
    }

    /// The work that the transfer function of the last frame made of the normals of surface voxels; `None` if the frame has none.
    pub fn surface_edit(&self) -> Option<&SurfaceEdit> {
        self.surface.as_ref().map(|(_, edit)| edit)
    }

    /// Texels of the texture that hold no sample.
    pub fn n_free_texels(&self) -> u64 {
        self.held.as_ref().map_or(0, |held| match &held.arrangement {
            Arrangement::Dense { .. } => 0,
            Arrangement::Packed(packing) => packing.n_free(),
        })
    }

    /// Begins anew if samples are to be brought to a device another way.
    pub(crate) fn serve(&mut self, upload: Upload) {
        if self.upload != upload {
            *self = BlockResidency { upload, ..BlockResidency::default() };
        }
    }

    /// Fetches the blocks that have another level than before, with the companions that are asked for; others are let go. The normals of
    /// surface voxels are those of the transfer function.
    pub(crate) fn hold(
        &mut self,
        source: &dyn BlockSource,
        levels: &[Level],
        companions: &[Companion],
        transfer: &TransferFunction,
    ) -> Result<(), FetchError> {
        self.copied = Copied::default();
        let dense = dense_texels(source.layout(), levels);
        let is_kept = |held: &Held| held.source == source.id() && held.dense_level() == dense.map(|(level, _)| level);
        let before = self.held.as_ref().filter(|held| is_kept(held));
        let is_new = |i: &usize| before.is_none_or(|held| held.rows[*i].level != levels[*i]);
        let mut new: Vec<usize> = (0..levels.len()).filter(is_new).collect();
        new.sort_by_cached_key(|i| (levels[*i], along_cubes(source.layout().block(*i))));
        let coding = coding_of(source).brought(self.upload);
        let fetched: Vec<Chunk> =
            new.par_iter().map(|i| fetch(source, &coding, *i, levels[*i])).collect::<Result<_, _>>()?;
        let surface = match companions.contains(&Companion::SurfaceNormal) {
            true => Some(self.surface_after(source, transfer)?),
            false => None,
        };
        let beside = companions.iter().map(|companion| {
            let is_held = before.is_some_and(|held| held.companions.contains_key(companion));
            let blocks = match (is_held, companion, &surface) {
                (false, ..) => all(levels),
                (true, Companion::SurfaceNormal, Some((_, edit))) => merged(&new, &edit.changed),
                (true, ..) => new.clone(),
            };
            FetchedCompanions::fetch(source, *companion, blocks, (levels, surface.as_ref()))
        });
        let beside: Vec<FetchedCompanions> = beside.collect::<Result<_, _>>()?;
        self.copied = copied(&new, &fetched, &beside);
        let mut held = match self.held.take() {
            Some(held) if is_kept(&held) => held,
            _ => Held::empty(source, levels, dense),
        };
        held.put(source.layout(), coding.format, &new, levels, fetched);
        held.companions.retain(|companion, _| companions.contains(companion));
        beside.into_iter().for_each(|fetched| held.put_companions(fetched));
        held.has_changed |= !new.is_empty();
        if !new.is_empty() && held.is_badly_packed(source.layout()) {
            held.pack_anew(source.layout());
        }
        self.held = Some(held);
        self.surface = surface;
        Ok(())
    }

    /// The normals of surface voxels under a transfer function.
    fn surface_after(
        &self,
        source: &dyn BlockSource,
        transfer: &TransferFunction,
    ) -> Result<(SurfaceNormals, SurfaceEdit), FetchError> {
        match &self.surface {
            Some((before, _)) => before.after(source, transfer),
            None => SurfaceNormals::none(source).after(source, transfer),
        }
    }

    /// The field of the held blocks, of which some are drawn: with the index and the slots of the last one, where they are the same.
    pub(crate) fn field(&mut self, source: &dyn BlockSource, drawn: Vec<bool>, join: Join) -> Field {
        let held = self.held.as_mut().expect("blocks are held before they are a field");
        let before = held.field.take();
        let slots = match &before {
            Some((_, field)) if !held.has_changed => Arc::clone(field.slots()),
            Some((_, field)) => Arc::new(held.slots(source).following(field.slots())),
            None => Arc::new(held.slots(source)),
        };
        let index = match &before {
            Some((last, field)) if *last == drawn => Arc::clone(field.index()),
            Some((_, field)) => Arc::new(index(source.layout(), &drawn).following(field.index())),
            None => Arc::new(index(source.layout(), &drawn)),
        };
        let last = before.as_ref().map(|(_, field)| field);
        let field = Field::new(source.layout().dims(), index, slots, join).expect("an index of the blocks' numbers");
        let field = held.companions.iter().fold(field, |field, (companion, own)| {
            let slots = own.slots(source, *companion, &field, last);
            field.with_companions(*companion, slots).expect("companions of the samples")
        });
        let field = match held.companions.contains_key(&Companion::Spread) {
            true => {
                let ranges = Arc::clone(held.ranges.get_or_insert_with(|| Arc::new(ranges(source))));
                field.with_ranges(ranges).expect("a range for each block")
            }
            false => field,
        };
        held.has_changed = false;
        held.companions.values_mut().for_each(|companions| companions.has_changed = false);
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
        let (rows, chunks, companions) = (vec![row; levels.len()], vec![None; levels.len()], BTreeMap::new());
        let ranges = None;
        Held { source: source.id(), arrangement, rows, chunks, companions, ranges, has_changed: true, field: None }
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
        let coding = coding_of(source);
        let places = BlockPlaces::new(*source.layout(), self.texels(), self.rows.clone());
        let slots = Slots::new(coding.format, coding.decode(), Places::Blocks(places), self.chunks.clone());
        slots.expect("blocks fill their places")
    }

    /// Puts blocks at new levels to places of their own.
    fn put(
        &mut self,
        layout: &BlockLayout,
        format: SampleFormat,
        new: &[usize],
        levels: &[Level],
        fetched: Vec<Chunk>,
    ) {
        for i in new {
            if let (BlockSamples::Texture(texel), Arrangement::Packed(packing)) =
                (self.rows[*i].samples, &mut self.arrangement)
            {
                packing.give_back(cube_level(layout, *i, self.rows[*i].level), texel);
            }
        }
        // The largest first: then none of them is cut for a smaller one while others wait.
        let mut order: Vec<(usize, Chunk)> = new.iter().copied().zip(fetched).collect();
        order.sort_by_key(|(i, _)| cube_level(layout, *i, levels[*i]));
        for (i, chunk) in order {
            let is_one = chunk.bytes().len() == format.n_bytes() && self.dense_level().is_none();
            let samples = match is_one {
                true => BlockSamples::One(format.read(chunk.bytes(), 0) as f32),
                false => BlockSamples::Texture(self.arrangement.take(layout, i, levels[i])),
            };
            self.chunks[i] = (!is_one).then(|| Arc::new(chunk));
            self.rows[i] = BlockRow { level: levels[i], samples };
        }
    }

    /// Puts companions to the places of the samples.
    fn put_companions(&mut self, FetchedCompanions { companion, blocks, bytes }: FetchedCompanions) {
        let n_blocks = self.rows.len();
        let none = || HeldCompanions { chunks: vec![None; n_blocks], ones: vec![0; n_blocks], has_changed: true };
        let held = self.companions.entry(companion).or_insert_with(none);
        held.has_changed |= !blocks.is_empty();
        for (i, bytes) in blocks.into_iter().zip(bytes) {
            let is_one = matches!(self.rows[i].samples, BlockSamples::One(_));
            held.ones[i] = if is_one { word(&bytes) } else { 0 };
            held.chunks[i] = (!is_one).then(|| Arc::new(Chunk::new(bytes)));
        }
    }

    /// Cubes of a block's side that the blocks fill.
    fn n_cubes(&self, layout: &BlockLayout) -> u64 {
        let in_texture = (0..self.rows.len()).filter(|i| self.chunks[*i].is_some());
        n_cubes(layout.side(), in_texture.map(|i| cube_level(layout, i, self.rows[i].level)))
    }

    /// Whether the texture is much too large; or too tall, for it grows by layers, and those are as wide as the first frame asked for.
    fn is_badly_packed(&self, layout: &BlockLayout) -> bool {
        let (texels, side) = (self.texels(), u64::from(layout.side().n_voxels()));
        let n_held = texels.as_u64vec3().element_product() / side.pow(3);
        let is_too_large = n_held > TOO_LARGE * self.n_cubes(layout) + FEW_CUBES;
        let is_too_tall = n_held > FEW_CUBES && texels.z > TOO_TALL * texels.x.max(texels.y);
        self.dense_level().is_none() && (is_too_large || is_too_tall)
    }

    /// Moves all blocks together. Each is another content, for its place is another.
    fn pack_anew(&mut self, layout: &BlockLayout) {
        self.arrangement = Arrangement::Packed(Packing::new(layout.side(), self.n_cubes(layout), MAX_TEXELS));
        let mut order: Vec<usize> = (0..self.rows.len()).filter(|i| self.chunks[*i].is_some()).collect();
        order.sort_by_key(|i| cube_level(layout, *i, self.rows[*i].level));
        for i in order {
            self.rows[i].samples = BlockSamples::Texture(self.arrangement.take(layout, i, self.rows[i].level));
            self.chunks[i] = moved(&self.chunks[i]);
            self.companions.values_mut().for_each(|companions| companions.chunks[i] = moved(&companions.chunks[i]));
        }
    }
}

/// The same bytes as another content.
fn moved(chunk: &Option<Arc<Chunk>>) -> Option<Arc<Chunk>> {
    chunk.as_ref().map(|chunk| Arc::new(chunk.renewed()))
}

/// At most four bytes, the first the lowest.
fn word(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte))
}

fn all(levels: &[Level]) -> Vec<usize> {
    (0..levels.len()).collect()
}

/// The blocks of both lists, each once.
fn merged(one: &[usize], other: &[usize]) -> Vec<usize> {
    let mut blocks = [one, other].concat();
    blocks.sort_unstable();
    blocks.dedup();
    blocks
}

fn copied(new: &[usize], fetched: &[Chunk], beside: &[FetchedCompanions]) -> Copied {
    let of_values = fetched.iter().map(|chunk| chunk.bytes().len());
    let of_companions = beside.iter().flat_map(|own| own.bytes.iter().map(Vec::len));
    Copied {
        n_bricks: beside.iter().map(|own| own.blocks.len()).fold(new.len(), usize::max),
        n_bytes: of_values.chain(of_companions).sum(),
    }
}

/// The companions of some blocks' samples.
struct FetchedCompanions {
    companion: Companion,
    blocks: Vec<usize>,
    bytes: Vec<Vec<u8>>,
}

impl FetchedCompanions {
    fn fetch(
        source: &dyn BlockSource,
        companion: Companion,
        blocks: Vec<usize>,
        (levels, surface): (&[Level], Option<&(SurfaceNormals, SurfaceEdit)>),
    ) -> Result<FetchedCompanions, FetchError> {
        let fetch = |i: &usize| {
            let (block, level, mut bytes) = (source.layout().block(*i), levels[*i], Vec::new());
            match (companion, surface) {
                (Companion::SurfaceNormal, Some((normals, _))) => normals.codes(block, level),
                _ => source.fetch_companion(companion, block, level, &mut bytes).map(|()| bytes),
            }
        };
        let bytes = blocks.par_iter().map(fetch).collect::<Result<_, _>>()?;
        Ok(FetchedCompanions { companion, blocks, bytes })
    }
}

impl HeldCompanions {
    /// The companions beside the samples of a field; those of the last field where they are the same.
    fn slots(&self, source: &dyn BlockSource, companion: Companion, field: &Field, last: Option<&Field>) -> Arc<Slots> {
        let last = last.and_then(|field| field.companions(companion));
        if let (Some(last), false) = (last, self.has_changed) {
            return Arc::clone(last);
        }
        let (format, decode) = match companion {
            Companion::Spread => (SampleFormat::Unorm8, Decode { scale: greatest_spread(source), offset: 0.0 }),
            Companion::Gradient => (SampleFormat::Unorm8x4, Decode { scale: greatest_gradient(source), offset: 0.0 }),
            // The light says what a length of 1 stands for.
            Companion::SurfaceNormal => (SampleFormat::Unorm8x4, Decode { scale: 1.0, offset: 0.0 }),
        };
        let slots = field.slots().companions(format, decode, self.chunks.clone(), self.ones.clone());
        let slots = slots.expect("companions fill the places of samples");
        Arc::new(match last {
            Some(last) => slots.following(last),
            None => slots,
        })
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
    let fits = level < layout.side().one_sample() && texels.cmple(MOST_TEXELS).all();
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

fn coding_of(source: &dyn BlockSource) -> Coding {
    Coding::of(source.scalar_type(), source.rescale(), source.range())
}

/// The ranges of all blocks, as texture reads would return them.
fn ranges(source: &dyn BlockSource) -> BlockRanges {
    let Decode { scale, offset } = coding_of(source).stored;
    let read = |stored: f64| ((stored - offset) / scale) as f32;
    let reads = source.summaries().iter().map(|summary| {
        let ValueRange { min, max } = source.rescale().stored_range(summary.range);
        [read(min), read(max)]
    });
    BlockRanges::new(reads.collect())
}

fn fetch(source: &dyn BlockSource, coding: &Coding, ordinal: usize, level: Level) -> Result<Chunk, FetchError> {
    let (mut bytes, block) = (Vec::new(), source.layout().block(ordinal));
    source.fetch(block, level, &mut bytes)?;
    Ok(coding.chunk(source.layout().n_samples(block, level), bytes))
}

#[cfg(test)]
mod tests {
    use brickfield_bricks::{BlockOptions, BlockVolume, NoCompanion, build_blocks};
    use brickfield_core::glam::DVec3;
    use brickfield_core::{Grid, Knot, Rescale, ScalarType, Volume};
    use proptest::prelude::*;

    use super::*;

    fn blocks() -> BlockVolume {
        let grid = Grid::axis_aligned(UVec3::new(20, 17, 9), DVec3::ONE).unwrap();
        let voxels: Vec<u16> =
            (0..grid.n_voxels() as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 16) as u16).collect();
        let volume = Arc::new(Volume::new(grid, voxels).unwrap());
        build_blocks(volume, &BlockOptions { side: BlockSide::V8, ..BlockOptions::default() }).unwrap()
    }

    /// Values up to one are transparent.
    fn transfer(outside: f64) -> TransferFunction {
        let knot = |value, extinction| Knot { value, extinction, color: [1.0; 3] };
        TransferFunction::new(vec![knot(outside, 0.0), knot(65535.0, 1.0)]).unwrap()
    }

    fn field(residency: &mut BlockResidency, source: &dyn BlockSource, levels: &[Level], asked: &[Companion]) -> Field {
        residency.hold(source, levels, asked, &transfer(0.0)).unwrap();
        residency.field(source, vec![true; levels.len()], Join::Shared)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn companions_lie_at_their_samples_from_frame_to_frame(
            frames in prop::collection::vec((prop::collection::vec(0..4u8, 3 * 3 * 2), any::<bool>()), 1..6)
        ) {
            let (source, mut residency) = (blocks(), BlockResidency::default());
            for (levels, is_asked) in frames {
                let levels: Vec<Level> = levels.into_iter().map(Level).collect();
                let asked: &[Companion] = if is_asked { &Companion::ALL } else { &[] };
                let first = field(&mut residency, &source, &levels, asked);
                let again = field(&mut residency, &source, &levels, asked);
                prop_assert_eq!(residency.copied(), Copied::default());
                prop_assert!(Arc::ptr_eq(first.slots(), again.slots()));
                let Some(spreads) = first.companions(Companion::Spread) else {
                    prop_assert!(!is_asked);
                    continue;
                };
                prop_assert!(is_asked && Arc::ptr_eq(spreads, again.companions(Companion::Spread).unwrap()));
                for (i, level) in levels.iter().enumerate() {
                    let mut expected = Vec::new();
                    source.fetch_companion(Companion::Spread, source.layout().block(i), *level, &mut expected).unwrap();
                    let one = || vec![spreads.one_sample(i as u32).unwrap() as u8];
                    let kept = spreads.samples(i as u32).map_or_else(one, |chunk| chunk.bytes().to_vec());
                    prop_assert_eq!(kept, expected);
                }
            }
        }
    }

    #[test]
    fn blocks_of_one_level_that_are_too_high_for_a_texture_are_packed() {
        let grid = Grid::axis_aligned(UVec3::new(8, 8, 1100), DVec3::ONE).unwrap();
        let volume = Arc::new(Volume::new(grid, vec![1u8; 8 * 8 * 1100]).unwrap());
        let source = build_blocks(volume, &BlockOptions { side: BlockSide::V8, ..BlockOptions::default() }).unwrap();
        let levels = vec![Level(0); source.layout().n_blocks_total()];
        let field = field(&mut BlockResidency::default(), &source, &levels, &[]);
        assert_eq!(field.dense_level(), None);
    }

    #[test]
    fn an_edit_brings_the_surface_normals_that_it_changes() {
        // Values rise along x: each edit moves the surface.
        let grid = Grid::axis_aligned(UVec3::new(40, 16, 8), DVec3::ONE).unwrap();
        let voxels: Vec<u16> = (0..grid.n_voxels()).map(|i| 100 * (i % 40) as u16).collect();
        let volume = Arc::new(Volume::new(grid, voxels).unwrap());
        let source = build_blocks(volume, &BlockOptions { side: BlockSide::V8, ..BlockOptions::default() }).unwrap();
        let levels: Vec<Level> = (0..10).map(|i| Level(i % 2)).collect();
        let mut residency = BlockResidency::default();
        let mut after = |outside: f64, asked: &[Companion]| {
            residency.hold(&source, &levels, asked, &transfer(outside)).unwrap();
            let field = residency.field(&source, vec![true; 10], Join::Shared);
            let slots = field.companions(Companion::SurfaceNormal).cloned();
            let ids: Option<Vec<_>> = slots.map(|slots| slots.all_samples().iter().flatten().map(|c| c.id()).collect());
            (ids, residency.copied().n_bricks, residency.surface_edit().cloned())
        };
        let asked = [Companion::SurfaceNormal];
        let (first, _, _) = after(1800.0, &asked);
        // Voxels 18 and 19 along x become transparent: all within the third of five blocks.
        let (second, n_copied, edit) = after(2000.0, &asked);
        let (first, second, edit) = (first.unwrap(), second.unwrap(), edit.unwrap());
        assert_eq!((n_copied, edit.changed.clone()), (2, vec![2, 7]));
        let others: Vec<usize> = (0..10).filter(|i| first[*i] != second[*i]).collect();
        assert_eq!(others, [2, 7]);
        let (again, n_copied, _) = after(2000.0, &asked);
        assert_eq!((again.unwrap(), n_copied), (second, 0));
        let (none, _, edit) = after(2000.0, &[]);
        assert!(none.is_none() && edit.is_none());
    }

    /// The content, first texel and size of every block that has texels.
    fn contents(slots: &Slots, of: &Slots) -> Vec<Option<(brickfield_frame::ContentId, UVec3, UVec3)>> {
        let Places::Blocks(places) = of.places() else { panic!("flat blocks") };
        let content = |(i, block)| {
            let place = places.place(block);
            slots.samples(i as u32).map(|chunk| (chunk.id(), place.texel, place.n))
        };
        places.layout().blocks().enumerate().map(content).collect()
    }

    /// No two blocks have a texel in common; a content that was there before lies where it was, for nobody brings it anew.
    fn check_places(field: &Field, last: Option<&Field>) {
        let now = contents(field.slots(), field.slots());
        for (i, (_, p, n)) in now.iter().enumerate().filter_map(|(i, own)| Some((i, (*own)?))) {
            let apart = |(_, q, m): &(_, UVec3, UVec3)| (p + n).cmple(*q).any() || (*q + *m).cmple(p).any();
            assert!(now[i + 1..].iter().flatten().all(apart), "block {i} at {p} lies on another");
        }
        let Some(last) = last else { return };
        let mut all = vec![(Some(field.slots()), Some(last.slots()))];
        all.extend(Companion::ALL.map(|companion| (field.companions(companion), last.companions(companion))));
        for (now, before) in all.into_iter().filter_map(|(now, before)| Some((now?, before?))) {
            let (now, before) = (contents(now, field.slots()), contents(before, last.slots()));
            for (id, texel, _) in now.iter().flatten() {
                let same = before.iter().flatten().find(|other| other.0 == *id);
                assert!(same.is_none_or(|other| other.1 == *texel), "a content has moved to {texel}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn blocks_lie_apart_and_contents_stay_where_they_are(
            // Mostly one sample: then blocks are packed anew.
            frames in prop::collection::vec((prop::collection::vec(0..4u8, 3 * 3 * 2), any::<bool>()), 2..8)
        ) {
            let (source, mut residency) = (blocks(), BlockResidency::default());
            let mut last: Option<Field> = None;
            for (levels, is_coarse) in frames {
                let level = |(i, level): (usize, u8)| if is_coarse && i % 5 > 0 { Level(3) } else { Level(level / 2) };
                let levels: Vec<Level> = levels.into_iter().enumerate().map(level).collect();
                let next = field(&mut residency, &source, &levels, &[Companion::Spread]);
                check_places(&next, last.as_ref());
                last = Some(next);
            }
        }
    }

    #[test]
    fn blocks_that_are_packed_anew_are_other_contents() {
        let (source, mut residency) = (blocks(), BlockResidency::default());
        let n_blocks = source.layout().n_blocks_total();
        let levels =
            |level, of_eighth| (0..n_blocks).map(|i| Level(if i == 7 { of_eighth } else { level })).collect::<Vec<_>>();
        let fine = field(&mut residency, &source, &levels(0, 1), &Companion::ALL);
        let coarse = field(&mut residency, &source, &levels(3, 1), &Companion::ALL);
        let Places::Blocks(places) = coarse.slots().places() else { panic!("flat blocks") };
        assert_eq!(places.texels(), UVec3::splat(8), "not packed anew");
        check_places(&coarse, Some(&fine));
    }

    #[test]
    fn another_source_of_the_same_layout_has_its_own_samples() {
        let (one, mut residency) = (blocks(), BlockResidency::default());
        let voxels = vec![7u16; one.volume().voxels().len()];
        let volume = Arc::new(Volume::new(*one.volume().grid(), voxels).unwrap());
        let other = build_blocks(volume, &BlockOptions { side: BlockSide::V8, ..BlockOptions::default() }).unwrap();
        let levels: Vec<Level> = (0..18).map(|i| Level(i % 4)).collect();
        field(&mut residency, &one, &levels, &[]);
        let of_other = field(&mut residency, &other, &levels, &[]);
        assert_eq!(of_other, field(&mut BlockResidency::default(), &other, &levels, &[]));
        assert_eq!(residency.copied().n_bricks, 18);
    }

    #[test]
    fn a_texture_that_began_small_has_room_for_many_blocks_later() {
        let grid = Grid::axis_aligned(UVec3::new(64, 64, 32), DVec3::ONE).unwrap();
        let volume = Arc::new(Volume::new(grid, (0..grid.n_voxels()).map(|i| i as u8).collect::<Vec<_>>()).unwrap());
        let source = build_blocks(volume, &BlockOptions { side: BlockSide::V8, ..BlockOptions::default() }).unwrap();
        let levels = |others| (0..256).map(|i| Level(if i == 0 { 1 } else { others })).collect::<Vec<_>>();
        let mut residency = BlockResidency::default();
        for others in [3, 0] {
            let field = field(&mut residency, &source, &levels(others), &[]);
            let Places::Blocks(places) = field.slots().places() else { panic!("flat blocks") };
            assert!(places.texels().cmple(MOST_TEXELS).all(), "{}", places.texels());
        }
    }

    #[test]
    fn the_index_follows_what_is_drawn() {
        let (source, mut residency) = (blocks(), BlockResidency::default());
        let levels = vec![Level(1); 18];
        for n_drawn in [18, 5, 5, 11] {
            residency.hold(&source, &levels, &[], &transfer(0.0)).unwrap();
            let drawn: Vec<bool> = (0..18).map(|i| i < n_drawn).collect();
            let field = residency.field(&source, drawn.clone(), Join::Shared);
            let is_there = |block| matches!(field.index().at(block), IndexEntry::Resident { .. });
            assert_eq!(source.layout().blocks().map(is_there).collect::<Vec<_>>(), drawn);
        }
    }

    /// Values alone, as of a store.
    struct Plain(BlockVolume);

    impl BlockSource for Plain {
        fn id(&self) -> SourceId {
            self.0.id()
        }
        fn layout(&self) -> &BlockLayout {
            self.0.layout()
        }
        fn grid(&self) -> &Grid {
            self.0.grid()
        }
        fn scalar_type(&self) -> ScalarType {
            self.0.scalar_type()
        }
        fn rescale(&self) -> Rescale {
            self.0.rescale()
        }
        fn range(&self) -> ValueRange {
            self.0.range()
        }
        fn summaries(&self) -> &[brickfield_core::BlockSummary] {
            self.0.summaries()
        }
        fn fetch(&self, block: UVec3, level: Level, out: &mut Vec<u8>) -> Result<(), FetchError> {
            self.0.fetch(block, level, out)
        }
    }

    #[test]
    fn a_source_of_values_alone_says_so_and_the_residency_stays_as_it_was() {
        let (source, mut residency) = (Plain(blocks()), BlockResidency::default());
        let levels = vec![Level(1); source.layout().n_blocks_total()];
        let before = field(&mut residency, &source, &levels, &[]);
        let error = residency.hold(&source, &levels, &[Companion::Spread], &transfer(0.0)).unwrap_err();
        let cause = error.cause.downcast_ref::<NoCompanion>().unwrap();
        assert!(cause.to_string().starts_with("the source has values alone, and no spreads"), "{cause}");
        assert_eq!(field(&mut residency, &source, &levels, &[]), before);
    }
}
