//! The samples that a frame needs, slot by slot.

use std::sync::Arc;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BrickSide, Level, Place, Rescale, ScalarType, ValueRange};

use super::{BlockPlaces, BlockSamples};
use crate::content::Pages;
use crate::{Chunk, Chunked, ContentId, PlaceUniform};

/// How a sample is stored for a backend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SampleFormat {
    /// 8 bits, read as stored / 255.
    Unorm8,
    /// 16 bits, read as stored / 65535.
    Unorm16,
    /// 32-bit float, read as it is.
    Float32,
    /// Four numbers of 8 bits, read as stored / 255 each: companions only ([`Slots::companions`]). Where one number is asked for, it is
    /// the first.
    Unorm8x4,
}

impl SampleFormat {
    /// The least format that holds every value of a scalar type that f32 arithmetic can tell apart.
    pub fn of(scalar: ScalarType) -> SampleFormat {
        match scalar {
            ScalarType::U8 | ScalarType::I8 => SampleFormat::Unorm8,
            ScalarType::U16 | ScalarType::I16 => SampleFormat::Unorm16,
            ScalarType::U32 | ScalarType::I32 | ScalarType::F32 | ScalarType::F64 => SampleFormat::Float32,
        }
    }

    /// How the samples of `scalar` with stored numbers in `range` are held: format and decoding.
    ///
    /// 8 and 16 bits keep their integers (signed ones shifted by half their range). 32-bit integers and f64 become f32
    /// relative to the middle of the range and in units of half of it, so that the digits of f32 are spent on the range.
    pub fn encoding(scalar: ScalarType, range: ValueRange) -> (SampleFormat, Decode) {
        let format = SampleFormat::of(scalar);
        let decode = match scalar {
            ScalarType::U8 | ScalarType::U16 => Decode { scale: format.unit(), offset: 0.0 },
            ScalarType::I8 => Decode { scale: format.unit(), offset: -128.0 },
            ScalarType::I16 => Decode { scale: format.unit(), offset: -32768.0 },
            ScalarType::U32 | ScalarType::I32 | ScalarType::F32 | ScalarType::F64 => {
                let half = 0.5 * range.max - 0.5 * range.min;
                Decode { scale: if half > 0.0 { half } else { 1.0 }, offset: 0.5 * range.max + 0.5 * range.min }
            }
        };
        (format, decode)
    }

    /// Bytes of one sample.
    pub const fn n_bytes(self) -> usize {
        match self {
            SampleFormat::Unorm8 => 1,
            SampleFormat::Unorm16 => 2,
            SampleFormat::Float32 | SampleFormat::Unorm8x4 => 4,
        }
    }

    /// The stored integer that reads as 1; 1 for floats.
    #[inline]
    pub const fn unit(self) -> f64 {
        match self {
            SampleFormat::Unorm8 | SampleFormat::Unorm8x4 => 255.0,
            SampleFormat::Unorm16 => 65535.0,
            SampleFormat::Float32 => 1.0,
        }
    }

    /// The stored number that a texture reads as `read`.
    #[inline]
    pub fn stored(self, read: f32) -> f64 {
        match self {
            SampleFormat::Unorm8 | SampleFormat::Unorm8x4 | SampleFormat::Unorm16 => {
                (f64::from(read) * self.unit()).round()
            }
            SampleFormat::Float32 => f64::from(read),
        }
    }

    /// The number that a texture read returns for sample `i` of some bytes; exact.
    #[inline]
    pub fn read(self, bytes: &[u8], i: usize) -> f64 {
        match self {
            SampleFormat::Unorm8 => f64::from(bytes[i]) / 255.0,
            SampleFormat::Unorm8x4 => f64::from(bytes[4 * i]) / 255.0,
            SampleFormat::Unorm16 => f64::from(u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]])) / 65535.0,
            SampleFormat::Float32 => {
                let b = &bytes[4 * i..4 * i + 4];
                f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            }
        }
    }
}

/// From the number that a texture read returns to the data value: value = read * scale + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Decode {
    pub scale: f64,
    pub offset: f64,
}

impl Decode {
    /// The data value of a texture read.
    #[inline]
    pub fn value(self, read: f64) -> f64 {
        read * self.scale + self.offset
    }

    /// The decoding of samples whose stored numbers stand for other values.
    pub fn rescaled(self, rescale: Rescale) -> Decode {
        Decode { scale: self.scale * rescale.slope(), offset: rescale.value(self.offset) }
    }
}

/// Where the samples of all slots lie.
#[derive(Clone, Debug, PartialEq)]
pub enum Places {
    /// All slots are bricks of so many samples a side, which begin at the corner of their block and have its reach for a level:
    /// arithmetic finds them, no table is read.
    Even(BrickSide),
    /// A place for each slot, in a texture of so many texels.
    #[allow(missing_docs)]
    Table { texels: UVec3, places: Vec<Place> },
    /// All slots are flat blocks, each at a level of its own; a slot's number is its block's.
    Blocks(BlockPlaces),
}

/// The samples that a frame needs, in slots: little endian, x of the texture fastest. A slot may hold no samples.
#[derive(Clone, Debug)]
pub struct Slots {
    format: SampleFormat,
    decode: Decode,
    places: Places,
    samples: Vec<Option<Arc<Chunk>>>,
    has_packed: bool,
    table: Option<Pages>,
    /// Of companions: the texel of each block that is one sample.
    ones: Option<Vec<u32>>,
    id: ContentId,
}

/// Slots are equal if their samples are.
impl PartialEq for Slots {
    fn eq(&self, other: &Slots) -> bool {
        let of = |s: &Slots| (s.format, s.decode, s.samples.clone(), s.places.clone(), s.ones.clone());
        self.id == other.id || of(self) == of(other)
    }
}

/// Samples that do not fill slots.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum SlotsError {
    #[error("{n_bytes} bytes are not whole bricks of {brick_bytes} bytes")]
    Bricks { n_bytes: usize, brick_bytes: usize },
    #[error("slot {slot} has {n_bytes} bytes; its place has {expected}")]
    Bytes { slot: usize, n_bytes: usize, expected: usize },
    #[error("slot {slot} has packed samples of {packed}; its place has {extent}")]
    Packed { slot: usize, packed: UVec3, extent: UVec3 },
    #[error("{n_places} places for {n_slots} slots")]
    Places { n_places: usize, n_slots: usize },
    #[error("slot {slot} lies at {} to {} in a texture of {texels} texels", place.texel, place.texel + place.n)]
    Outside { slot: usize, place: Place, texels: UVec3 },
    #[error("slot {slot} has its last sample at {} instead of {even}: only flat blocks may", place.last)]
    Uneven { slot: usize, place: Place, even: DVec3 },
    #[error("slot {slot} at level {} has samples in its row: {is_in_row}; it has {n_samples}", level.0)]
    OneSample { slot: usize, level: Level, is_in_row: bool, n_samples: usize },
    #[error("a texture of {texels} texels for flat blocks; a row tells {most} apart")]
    Rows { texels: UVec3, most: UVec3 },
    #[error("values of four numbers each: only companions of values have as many")]
    FourNumbers,
    #[error("companions of bricks: only samples of flat blocks have companions")]
    CompanionsOfBricks,
}

impl Slots {
    /// Slots of given samples, at given places.
    ///
    /// # Errors
    /// Samples of four numbers; samples that do not fill their place; a place that is missing, empty, or outside of its texture.
    pub fn new(
        format: SampleFormat,
        decode: Decode,
        places: Places,
        samples: Vec<Option<Arc<Chunk>>>,
    ) -> Result<Slots, SlotsError> {
        if format == SampleFormat::Unorm8x4 {
            return Err(SlotsError::FourNumbers);
        }
        match &places {
            Places::Even(side) => {
                let expected = side.n_samples_total() * format.n_bytes();
                check_bytes(&samples, |_| expected)?;
                check_packed(&samples, |_| UVec3::splat(side.n_samples()))?;
            }
            Places::Table { texels, places } => {
                check_number(places.len(), samples.len())?;
                for (slot, place) in places.iter().enumerate() {
                    check_inside(slot, place, *texels)?;
                    check_even(slot, place)?;
                }
                check_bytes(&samples, |slot| places[slot].n_samples() * format.n_bytes())?;
                check_packed(&samples, |slot| places[slot].n)?;
            }
            Places::Blocks(places) => {
                check_number(places.rows().len(), samples.len())?;
                places.check()?;
                check_bytes(&samples, |slot| places.n_texels(slot) * format.n_bytes())?;
                check_packed(&samples, |slot| places.place(places.layout().block(slot)).n)?;
            }
        }
        let table = match &places {
            Places::Even(_) => None,
            Places::Table { places, .. } => {
                let rows: Vec<PlaceUniform> = places.iter().map(PlaceUniform::of).collect();
                Some(Pages::new(bytemuck::cast_slice(&rows)))
            }
            Places::Blocks(places) => Some(Pages::new(bytemuck::cast_slice(&places.packed()))),
        };
        let has_packed = has_packed(&samples);
        Ok(Slots { format, decode, places, samples, has_packed, table, ones: None, id: ContentId::new() })
    }

    /// The companions of these samples of flat blocks: each at its sample's texel, in a texture of their own.
    ///
    /// `ones` has a word for each block: of a block that is one sample its companion's bytes from the lowest bits on, of others 0.
    ///
    /// # Errors
    /// Slots that are no flat blocks; companions that do not fill the places of the samples.
    pub fn companions(
        &self,
        format: SampleFormat,
        decode: Decode,
        samples: Vec<Option<Arc<Chunk>>>,
        ones: Vec<u32>,
    ) -> Result<Slots, SlotsError> {
        let Places::Blocks(places) = &self.places else { return Err(SlotsError::CompanionsOfBricks) };
        check_number(places.rows().len(), samples.len())?;
        check_number(places.rows().len(), ones.len())?;
        check_bytes(&samples, |slot| places.n_texels(slot) * format.n_bytes())?;
        check_packed(&samples, |slot| places.place(places.layout().block(slot)).n)?;
        let (places, table) = (self.places.clone(), Some(Pages::new(bytemuck::cast_slice(&ones))));
        let has_packed = has_packed(&samples);
        Ok(Slots { format, decode, places, samples, has_packed, table, ones: Some(ones), id: ContentId::new() })
    }

    /// Whether these are companions of other slots' samples.
    pub fn are_companions_of(&self, values: &Slots) -> bool {
        self.ones.is_some() && values.ones.is_none() && self.places == values.places
    }

    /// Bricks of one size, whose bytes follow one another.
    ///
    /// # Errors
    /// If the bytes are not whole bricks.
    pub fn even(side: BrickSide, format: SampleFormat, decode: Decode, bytes: &[u8]) -> Result<Slots, SlotsError> {
        let brick_bytes = side.n_samples_total() * format.n_bytes();
        if !bytes.len().is_multiple_of(brick_bytes) {
            return Err(SlotsError::Bricks { n_bytes: bytes.len(), brick_bytes });
        }
        let samples = bytes.chunks_exact(brick_bytes).map(|brick| Some(Arc::new(Chunk::new(brick)))).collect();
        Slots::new(format, decode, Places::Even(side), samples)
    }

    /// How a sample is stored.
    #[inline]
    pub fn format(&self) -> SampleFormat {
        self.format
    }

    /// From a texture read to the data value.
    #[inline]
    pub fn decode(&self) -> Decode {
        self.decode
    }

    /// Where the samples lie.
    #[inline]
    pub fn places(&self) -> &Places {
        &self.places
    }

    /// The side of evenly placed bricks.
    pub fn brick_side(&self) -> Option<BrickSide> {
        match self.places {
            Places::Even(side) => Some(side),
            Places::Table { .. } | Places::Blocks(_) => None,
        }
    }

    /// The table of places as shaders read it ([`PlaceUniform`]); `None` where there is none.
    pub fn place_table(&self) -> Option<&dyn Chunked> {
        match self.places {
            _ if self.ones.is_some() => None,
            Places::Even(_) | Places::Blocks(_) => None,
            Places::Table { .. } => self.table.as_ref().map(|table| table as &dyn Chunked),
        }
    }

    /// The rows of flat blocks as shaders read them; `None` of other slots.
    pub fn block_table(&self) -> Option<&dyn Chunked> {
        match self.places {
            _ if self.ones.is_some() => None,
            Places::Even(_) | Places::Table { .. } => None,
            Places::Blocks(_) => self.table.as_ref().map(|table| table as &dyn Chunked),
        }
    }

    /// Of companions of flat blocks' samples: a word for each block as shaders read it, with the companion of one that is one sample.
    pub fn one_table(&self) -> Option<&dyn Chunked> {
        self.ones.as_ref().and(self.table.as_ref()).map(|table| table as &dyn Chunked)
    }

    /// The slots, whose table keeps the identity of the pages that are equal to pages of slots before them: a device is
    /// brought the others.
    #[must_use]
    pub fn following(mut self, before: &Slots) -> Slots {
        if let (Some(own), Some(before)) = (&mut self.table, &before.table) {
            own.follow(before);
        }
        self
    }

    /// Whether a slot has samples: in the texture, or one in its row.
    pub fn has_samples(&self, slot: u32) -> bool {
        self.samples(slot).is_some() || self.one_sample(slot).is_some()
    }

    /// The stored number of a flat block that is one sample, which is in its row; of companions, their word.
    #[inline]
    pub fn one_sample(&self, slot: u32) -> Option<f64> {
        let Places::Blocks(places) = &self.places else { return None };
        match (places.rows().get(slot as usize)?.samples, &self.ones) {
            (BlockSamples::One(_), Some(words)) => Some(f64::from(words[slot as usize])),
            (BlockSamples::One(read), None) => Some(self.format.stored(read)),
            (BlockSamples::Texture(_), _) => None,
        }
    }

    /// Number of slots, those without samples included.
    pub fn n_slots(&self) -> u32 {
        self.samples.len() as u32
    }

    /// Number of slots that hold samples.
    pub fn n_filled(&self) -> usize {
        self.samples.iter().flatten().count()
    }

    /// Bytes of all samples.
    pub fn n_bytes(&self) -> usize {
        self.samples.iter().flatten().map(|chunk| chunk.bytes().len()).sum()
    }

    /// The samples of a slot; `None` if there are none.
    #[inline]
    pub fn samples(&self, slot: u32) -> Option<&Arc<Chunk>> {
        self.samples.get(slot as usize)?.as_ref()
    }

    /// Whether some slots are packed for devices.
    pub fn has_packed(&self) -> bool {
        self.has_packed
    }

    /// The samples of all slots.
    pub fn all_samples(&self) -> &[Option<Arc<Chunk>>] {
        &self.samples
    }

    /// The stored integer nearest to a data value; counted from it, f32 keeps the most digits of samples near the value.
    /// 0 for floats.
    pub fn nearest_stored(&self, value: f64) -> f64 {
        let unit = self.format.unit();
        match self.format {
            SampleFormat::Unorm8 | SampleFormat::Unorm16 => {
                ((value - self.decode.offset) / self.decode.scale * unit).round().clamp(0.0, unit)
            }
            SampleFormat::Float32 | SampleFormat::Unorm8x4 => 0.0,
        }
    }
}

fn check_number(n_places: usize, n_slots: usize) -> Result<(), SlotsError> {
    if n_places == n_slots { Ok(()) } else { Err(SlotsError::Places { n_places, n_slots }) }
}

/// Whether a place has texels, all of them in the texture.
pub(super) fn check_inside(slot: usize, place: &Place, texels: UVec3) -> Result<(), SlotsError> {
    let is_outside = place.n.min_element() == 0 || (place.texel + place.n).cmpgt(texels).any();
    if is_outside { Err(SlotsError::Outside { slot, place: *place, texels }) } else { Ok(()) }
}

fn check_even(slot: usize, place: &Place) -> Result<(), SlotsError> {
    if place.is_even() {
        return Ok(());
    }
    let even = Place::even(place.texel, place.n_in_space(), place.level, place.first).last;
    Err(SlotsError::Uneven { slot, place: *place, even })
}

fn check_bytes(samples: &[Option<Arc<Chunk>>], expected: impl Fn(usize) -> usize) -> Result<(), SlotsError> {
    let filled = samples.iter().enumerate().filter_map(|(slot, chunk)| Some((slot, chunk.as_ref()?)));
    for (slot, chunk) in filled {
        let (n_bytes, expected) = (chunk.bytes().len(), expected(slot));
        if n_bytes != expected {
            return Err(SlotsError::Bytes { slot, n_bytes, expected });
        }
    }
    Ok(())
}

fn has_packed(samples: &[Option<Arc<Chunk>>]) -> bool {
    samples.iter().flatten().any(|chunk| chunk.packed().is_some())
}

fn check_packed(samples: &[Option<Arc<Chunk>>], extent: impl Fn(usize) -> UVec3) -> Result<(), SlotsError> {
    let packed = |(slot, chunk): (usize, &Option<Arc<Chunk>>)| Some((slot, chunk.as_ref()?.packed()?.extent()));
    match samples.iter().enumerate().filter_map(packed).find(|(slot, packed)| *packed != extent(*slot)) {
        Some((slot, packed)) => Err(SlotsError::Packed { slot, packed, extent: extent(slot) }),
        None => Ok(()),
    }
}

impl Chunked for Slots {
    fn id(&self) -> ContentId {
        self.id
    }

    /// Of a brick; of slots of several sizes the largest one's.
    fn chunk_bytes(&self) -> usize {
        let n_samples = match &self.places {
            Places::Even(side) => side.n_samples_total(),
            Places::Table { places, .. } => places.iter().map(Place::n_samples).max().unwrap_or(0),
            Places::Blocks(places) => (places.layout().side().n_voxels() as usize).pow(3),
        };
        n_samples * self.format.n_bytes()
    }

    fn n_chunks(&self) -> usize {
        self.samples.len()
    }

    fn chunk(&self, i: usize) -> Option<(ContentId, &[u8])> {
        self.samples[i].as_ref().map(|chunk| (chunk.id(), chunk.bytes()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BlockRow;
    use brickfield_core::{BlockLayout, BlockSide};

    #[test]
    fn a_rescale_follows_the_decoding() {
        let rescale = Rescale::new(-0.5, 10.0).unwrap();
        let (_, decode) = SampleFormat::encoding(ScalarType::I16, ValueRange { min: 0.0, max: 1.0 });
        for read in [0.0, 0.25, 1.0] {
            assert_eq!(decode.rescaled(rescale).value(read), rescale.value(decode.value(read)));
        }
    }

    #[test]
    fn encodings_keep_integers_and_centre_wide_types() {
        let range = ValueRange { min: 1e9, max: 1e9 + 4.0 };
        let (format, decode) = SampleFormat::encoding(ScalarType::I32, range);
        assert_eq!((format, decode.value(-1.0), decode.value(1.0)), (SampleFormat::Float32, 1e9, 1e9 + 4.0));
        let (_, decode) = SampleFormat::encoding(ScalarType::I16, range);
        assert_eq!(decode.value(0.0), -32768.0);
        assert_eq!(decode.value(1.0), 32767.0);
    }

    #[test]
    fn the_nearest_stored_integer_stays_in_the_format() {
        let (format, decode) = SampleFormat::encoding(ScalarType::I16, ValueRange { min: 0.0, max: 0.0 });
        let slots = Slots::even(BrickSide::S16, format, decode, &[]).unwrap();
        let expected = [(0.0, 32768.0), (-1.4, 32767.0), (1e9, 65535.0), (-1e9, 0.0)];
        assert!(expected.into_iter().all(|(value, stored)| slots.nearest_stored(value) == stored));
    }

    #[test]
    fn samples_that_do_not_fill_their_places_are_named() {
        let decode = Decode { scale: 1.0, offset: 0.0 };
        let even = Slots::even(BrickSide::S16, SampleFormat::Unorm8, decode, &[0; 4097]).unwrap_err().to_string();
        assert!(even.contains("4097 bytes are not whole bricks of 4096"), "{even}");
        let place = |texel| Place::even(texel, UVec3::new(2, 3, 1), Level(0), DVec3::ZERO);
        let table = |texel, n_bytes| {
            let places = Places::Table { texels: UVec3::splat(4), places: vec![place(texel)] };
            let samples = vec![Some(Arc::new(Chunk::new(vec![0; n_bytes])))];
            Slots::new(SampleFormat::Unorm8, decode, places, samples).map(|slots| slots.n_bytes())
        };
        assert_eq!(table(UVec3::new(2, 1, 3), 6), Ok(6));
        assert_eq!(table(UVec3::ZERO, 5), Err(SlotsError::Bytes { slot: 0, n_bytes: 5, expected: 6 }));
        assert!(table(UVec3::new(2, 2, 0), 6).unwrap_err().to_string().contains("in a texture of [4, 4, 4] texels"));
    }

    #[test]
    fn companions_lie_at_their_samples_and_fill_them() {
        let layout = BlockLayout::new(UVec3::new(16, 8, 8), BlockSide::V8);
        let row = |level, samples| BlockRow { level: Level(level), samples };
        let rows = vec![row(1, BlockSamples::Texture(UVec3::ZERO)), row(3, BlockSamples::One(0.5))];
        let places = Places::Blocks(BlockPlaces::new(layout, UVec3::splat(8), rows));
        let decode = Decode { scale: 1.0, offset: 0.0 };
        let chunk = |n| Some(Arc::new(Chunk::new(vec![7; n])));
        let values = Slots::new(SampleFormat::Unorm16, decode, places, vec![chunk(128), None]).unwrap();
        let of = |n, ones: &[u32]| values.companions(SampleFormat::Unorm8, decode, vec![chunk(n), None], ones.to_vec());
        let spreads = of(64, &[0, 200]).unwrap();
        assert!(spreads.are_companions_of(&values) && !values.are_companions_of(&values));
        assert_eq!(
            (values.one_sample(1), spreads.one_sample(1), spreads.one_sample(0)),
            (Some(32768.0), Some(200.0), None)
        );
        assert!(spreads.block_table().is_none() && values.one_table().is_none());
        assert_eq!(spreads.one_table().unwrap().chunk(0).unwrap().1, bytemuck::bytes_of(&[0u32, 200]));
        assert_eq!(of(128, &[0, 200]), Err(SlotsError::Bytes { slot: 0, n_bytes: 128, expected: 64 }));
        assert_eq!(of(64, &[0]), Err(SlotsError::Places { n_places: 2, n_slots: 1 }));
        let bricks = Slots::even(BrickSide::S16, SampleFormat::Unorm8, decode, &[]).unwrap();
        let refused = bricks.companions(SampleFormat::Unorm8, decode, Vec::new(), Vec::new());
        assert!(refused.unwrap_err().to_string().starts_with("companions of bricks"));
    }
}
