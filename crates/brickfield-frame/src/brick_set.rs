//! The samples of the bricks that a frame needs.

use brickfield_core::{BrickSide, ScalarType, ValueRange, glam::UVec3};

/// How a sample is stored for a backend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SampleFormat {
    /// 8 bits, read as stored / 255.
    Unorm8,
    /// 16 bits, read as stored / 65535.
    Unorm16,
    /// 32-bit float, read as it is.
    Float32,
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

    /// Bytes of one sample.
    pub const fn n_bytes(self) -> usize {
        match self {
            SampleFormat::Unorm8 => 1,
            SampleFormat::Unorm16 => 2,
            SampleFormat::Float32 => 4,
        }
    }

    /// What the largest stored integer reads as 1; 1 for floats.
    pub const fn unit(self) -> f64 {
        match self {
            SampleFormat::Unorm8 => 255.0,
            SampleFormat::Unorm16 => 65535.0,
            SampleFormat::Float32 => 1.0,
        }
    }
}

/// From what a texture read returns to the data value: value = read * scale + offset.
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
}

/// The samples of the bricks that a frame needs, in slots: brick after brick, n^3 samples each, x fastest, little endian.
///
/// Sets are compared by identity ([`Held`](crate::Held)) to tell whether a backend holds them already.
#[derive(Clone, Debug, PartialEq)]
pub struct BrickSet {
    side: BrickSide,
    format: SampleFormat,
    decode: Decode,
    bytes: Vec<u8>,
}

/// Bytes that are not whole bricks.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{n_bytes} bytes are not whole bricks of {brick_bytes} bytes")]
#[allow(missing_docs)]
pub struct BrickSetError {
    pub n_bytes: usize,
    pub brick_bytes: usize,
}

impl BrickSet {
    /// A set from the bytes of its bricks.
    ///
    /// # Errors
    /// If the bytes are not whole bricks.
    pub fn new(
        side: BrickSide,
        format: SampleFormat,
        decode: Decode,
        bytes: Vec<u8>,
    ) -> Result<BrickSet, BrickSetError> {
        let brick_bytes = side.n_samples_total() * format.n_bytes();
        if !bytes.len().is_multiple_of(brick_bytes) {
            return Err(BrickSetError { n_bytes: bytes.len(), brick_bytes });
        }
        Ok(BrickSet { side, format, decode, bytes })
    }

    /// How the native samples of `scalar` with values in `range` are stored: format and decoding.
    ///
    /// 8 and 16 bits keep their integers (signed ones shifted by half their range). 32-bit integers and f64 become f32
    /// relative to the middle of the range and in units of half of it, so that what f32 can tell apart is spent on the range.
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

    /// Samples along a brick's side.
    pub fn side(&self) -> BrickSide {
        self.side
    }

    /// How a sample is stored.
    pub fn format(&self) -> SampleFormat {
        self.format
    }

    /// From a texture read to the data value.
    pub fn decode(&self) -> Decode {
        self.decode
    }

    /// The stored integer nearest to a data value; counted from it, f32 keeps the most digits of samples near the value.
    /// 0 for floats.
    pub fn nearest_stored(&self, value: f64) -> f64 {
        let unit = self.format.unit();
        match self.format {
            SampleFormat::Unorm8 | SampleFormat::Unorm16 => {
                ((value - self.decode.offset) / self.decode.scale * unit).round().clamp(0.0, unit)
            }
            SampleFormat::Float32 => 0.0,
        }
    }

    /// All bytes, brick after brick.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// All bytes, to change one (a mutant in conformance runs does).
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.bytes
    }

    /// Bytes of one brick.
    pub fn brick_bytes(&self) -> usize {
        self.side.n_samples_total() * self.format.n_bytes()
    }

    /// Number of bricks.
    pub fn n_bricks(&self) -> u32 {
        (self.bytes.len() / self.brick_bytes()) as u32
    }

    /// What a texture read returns for sample `i` of the whole set; exact.
    #[inline]
    pub fn read(&self, i: usize) -> f64 {
        match self.format {
            SampleFormat::Unorm8 => f64::from(self.bytes[i]) / 255.0,
            SampleFormat::Unorm16 => {
                f64::from(u16::from_le_bytes([self.bytes[2 * i], self.bytes[2 * i + 1]])) / 65535.0
            }
            SampleFormat::Float32 => {
                let b = &self.bytes[4 * i..4 * i + 4];
                f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            }
        }
    }

    /// The smallest atlas, in bricks, that holds the set in a 3-D texture of at most `max_texels` a side.
    ///
    /// `None` if no such atlas can. A set without bricks gets an atlas of one.
    pub fn atlas(&self, max_texels: u32) -> Option<AtlasShape> {
        AtlasShape::fit(self.n_bricks(), self.side, max_texels)
    }
}

/// How slots lie in a 3-D texture: slot s at (s mod x, s / x mod y, s / (x y)), in bricks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AtlasShape {
    /// Bricks along x, y, z.
    pub bricks: UVec3,
    /// Samples along a brick's side.
    pub side: BrickSide,
}

impl AtlasShape {
    fn fit(n_bricks: u32, side: BrickSide, max_texels: u32) -> Option<AtlasShape> {
        let n = n_bricks.max(1);
        let most = max_texels / side.n_samples();
        let x = (f64::from(n).cbrt().ceil() as u32).min(most);
        if x == 0 {
            return None;
        }
        let y = (f64::from(n.div_ceil(x)).sqrt().ceil() as u32).min(most);
        let z = n.div_ceil(x * y);
        (z <= most).then_some(AtlasShape { bricks: UVec3::new(x, y, z), side })
    }

    /// The texture's size in texels.
    pub fn texels(&self) -> UVec3 {
        self.bricks * self.side.n_samples()
    }

    /// Where a slot's first texel lies.
    pub fn origin(&self, slot: u32) -> UVec3 {
        let UVec3 { x, y, .. } = self.bricks;
        UVec3::new(slot % x, slot / x % y, slot / (x * y)) * self.side.n_samples()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_atlas_holds_every_slot_once() {
        for n in [0, 1, 2, 9, 100, 1000, 4096] {
            let atlas = AtlasShape::fit(n, BrickSide::S32, 2048).unwrap();
            assert!(atlas.bricks.element_product() >= n && atlas.texels().max_element() <= 2048);
            let last = atlas.origin(n.saturating_sub(1));
            assert!((last + 32).cmple(atlas.texels()).all());
        }
        assert_eq!(AtlasShape::fit(65 * 64 * 64, BrickSide::S32, 2048), None);
        assert_eq!(AtlasShape::fit(1, BrickSide::S64, 32), None);
    }

    #[test]
    fn encodings_keep_integers_and_centre_wide_types() {
        let range = ValueRange { min: 1e9, max: 1e9 + 4.0 };
        let (format, decode) = BrickSet::encoding(ScalarType::I32, range);
        assert_eq!((format, decode.value(-1.0), decode.value(1.0)), (SampleFormat::Float32, 1e9, 1e9 + 4.0));
        let (_, decode) = BrickSet::encoding(ScalarType::I16, range);
        assert_eq!(decode.value(0.0), -32768.0);
        assert_eq!(decode.value(1.0), 32767.0);
    }

    #[test]
    fn the_nearest_stored_integer_stays_in_the_format() {
        let (format, decode) = BrickSet::encoding(ScalarType::I16, ValueRange { min: 0.0, max: 0.0 });
        let set = BrickSet::new(BrickSide::S16, format, decode, vec![]).unwrap();
        let expected = [(0.0, 32768.0), (-1.4, 32767.0), (1e9, 65535.0), (-1e9, 0.0)];
        assert!(expected.into_iter().all(|(value, stored)| set.nearest_stored(value) == stored));
    }
}
