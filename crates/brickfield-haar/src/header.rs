//! The header of a brick.

use brickfield_core::glam::UVec3;
use brickfield_core::{Level, ScalarType};

use crate::coded::{Model, N_MODEL_BYTES};
use crate::decode::DecodeError;
use crate::encode::LowBand;
use crate::extent::{MAX_LEVELS, n_samples};
use crate::kernel::Kernel;
use crate::packed::{unzigzag, zigzag};

const MAGIC: [u8; 2] = *b"BH";
/// The version of the format that this crate writes and reads.
pub const FORMAT_VERSION: u8 = 1;
/// Sample types in the order of their numbers.
const TYPES: [ScalarType; 6] =
    [ScalarType::U8, ScalarType::U16, ScalarType::U32, ScalarType::I8, ScalarType::I16, ScalarType::I32];
/// The bytes of a checksum.
pub(crate) const N_CHECKSUM_BYTES: usize = 4;

/// How the coefficients of a brick are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Storage {
    /// All samples have one value, which is a part of the header.
    OneValue,
    /// Samples as they are, little-endian.
    Raw,
    /// Groups of 64 coefficients of one width, so that any of them is found by its place.
    Packed,
    /// Coded by probabilities that depend on neighbours.
    Coded,
}

impl Storage {
    const ALL: [Storage; 4] = [Storage::OneValue, Storage::Raw, Storage::Packed, Storage::Coded];
}

/// What a brick says about itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BrickHeader {
    pub(crate) scalar: ScalarType,
    pub(crate) extent: UVec3,
    pub(crate) kernel: Kernel,
    pub(crate) n_levels: u8,
    pub(crate) storage: Storage,
    pub(crate) step: u32,
    pub(crate) max_error: u32,
    pub(crate) body: Body,
    /// The bytes of each section without its checksum, coarsest first.
    pub(crate) n_section_bytes: Vec<usize>,
    pub(crate) n_bytes: usize,
}

/// What follows the header's fixed fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Body {
    Value(i64),
    Raw,
    Packed,
    Coded(Model),
}

impl BrickHeader {
    /// Reads the header at the begin of a brick, of which no more bytes are needed.
    ///
    /// # Errors
    /// If the bytes end within the header, or it is damaged, or of another format or version.
    pub fn read(brick: &[u8]) -> Result<BrickHeader, DecodeError> {
        let mut fields = Fields { brick, n_read: 0 };
        if fields.take(2)? != MAGIC {
            return Err(DecodeError::NotABrick);
        }
        let version = fields.byte()?;
        if version != FORMAT_VERSION {
            return Err(DecodeError::Version { version });
        }
        let mut header = fields.fixed()?;
        header.read_body(&mut fields)?;
        let content = &brick[..fields.n_read];
        if !matches_checksum(content, fields.take(N_CHECKSUM_BYTES)?) {
            return Err(DecodeError::Checksum { part: "the header" });
        }
        header.n_bytes = fields.n_read;
        Ok(header)
    }

    fn read_body(&mut self, fields: &mut Fields<'_>) -> Result<(), DecodeError> {
        let n = n_samples(self.extent)?;
        match self.storage {
            Storage::OneValue => {
                self.body = Body::Value(unzigzag(fields.number("the value", u64::from(u32::MAX) * 2 + 1)?));
            }
            Storage::Raw => self.n_section_bytes = vec![n * self.scalar.n_bytes()],
            Storage::Packed | Storage::Coded => {
                // Longer sections would have been stored raw.
                let mut most = (n * self.scalar.n_bytes()) as u64;
                for _ in 0..=self.n_levels {
                    let n_bytes = fields.number("the bytes of a section", most)?;
                    most -= n_bytes;
                    self.n_section_bytes.push(n_bytes as usize);
                }
                self.body = Body::Packed;
            }
        }
        if self.low_band() == LowBand::Elsewhere && self.n_levels != 1 {
            return Err(DecodeError::Field { field: "the number of levels below a low band elsewhere" });
        }
        if self.storage == Storage::Coded {
            let model = Model::from_bytes(fields.take(N_MODEL_BYTES)?);
            self.body = Body::Coded(model.ok_or(DecodeError::Field { field: "a table of the model" })?);
        }
        Ok(())
    }

    /// The header's bytes.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let number_of = |scalar| TYPES.iter().position(|&t| t == scalar).expect("an integer type of 32 bits at most");
        let position = |storage| Storage::ALL.iter().position(|&s| s == storage).expect("one of all") as u8;
        let kernel = Kernel::ALL.iter().position(|&k| k == self.kernel).expect("one of all") as u8;
        let mut bytes = MAGIC.to_vec();
        bytes.push(FORMAT_VERSION);
        bytes.push(number_of(self.scalar) as u8 | position(self.storage) << 4);
        bytes.push(kernel | self.n_levels << 4);
        self.extent.to_array().iter().for_each(|&n| push_number(&mut bytes, u64::from(n)));
        push_number(&mut bytes, u64::from(self.step));
        push_number(&mut bytes, u64::from(self.max_error));
        match self.body {
            Body::Value(value) => push_number(&mut bytes, zigzag(value)),
            Body::Raw => {}
            Body::Packed | Body::Coded(_) => {
                self.n_section_bytes.iter().for_each(|&n| push_number(&mut bytes, n as u64));
            }
        }
        if let Body::Coded(model) = self.body {
            bytes.extend(model.to_bytes());
        }
        bytes.extend(crc32c::crc32c(&bytes).to_le_bytes());
        bytes
    }

    /// The type of the samples.
    pub fn scalar(&self) -> ScalarType {
        self.scalar
    }

    /// Samples along x, y, z.
    pub fn extent(&self) -> UVec3 {
        self.extent
    }

    /// The kernel. It has no meaning for [`Storage::OneValue`] and [`Storage::Raw`].
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// The levels above level 0 that are stored apart.
    pub fn n_levels(&self) -> u8 {
        self.n_levels
    }

    /// How coefficients are stored.
    pub fn storage(&self) -> Storage {
        self.storage
    }

    /// By how much a decoded sample of level 0 differs from the encoded one at most: 0 if none does. Measured by the encoder.
    pub fn max_error(&self) -> u32 {
        self.max_error
    }

    /// The odd number by which decoded values are multiplied; 1 if samples were not rounded to multiples of it.
    pub fn step(&self) -> u32 {
        self.step
    }

    /// The value of all samples of a brick of [`Storage::OneValue`].
    pub fn one_value(&self) -> Option<i64> {
        match self.body {
            Body::Value(value) => Some(value),
            Body::Raw | Body::Packed | Body::Coded(_) => None,
        }
    }

    /// The bytes of the header.
    pub fn n_header_bytes(&self) -> usize {
        self.n_bytes
    }

    /// Whether coarser levels are stored apart, as bands; otherwise they are averages of all samples.
    pub(crate) fn has_bands(&self) -> bool {
        matches!(self.storage, Storage::Packed | Storage::Coded) && self.kernel.has_bands()
    }

    /// The coarsest level that can be decoded: [`BrickHeader::n_levels`]; of a brick without bands, [`MAX_LEVELS`].
    pub fn coarsest_level(&self) -> u8 {
        if self.has_bands() { self.n_levels } else { MAX_LEVELS }
    }

    /// The bytes from the begin of the brick that [`decode_level`](crate::decode_level) needs for a level: all of them for level 0, and of
    /// a brick without bands.
    pub fn n_bytes_of_level(&self, level: Level) -> usize {
        let sections = &self.n_section_bytes[..self.n_sections_of_level(level)];
        self.n_bytes + sections.iter().map(|n| n + N_CHECKSUM_BYTES).sum::<usize>()
    }

    /// Where the low band is; [`LowBand::Stored`] if there is none.
    pub fn low_band(&self) -> LowBand {
        let is_empty = self.has_bands() && self.n_levels > 0 && self.n_section_bytes[0] == 0;
        if is_empty { LowBand::Elsewhere } else { LowBand::Stored }
    }

    /// The sections that a level needs.
    pub(crate) fn n_sections_of_level(&self, level: Level) -> usize {
        self.n_section_bytes.len() - usize::from(level.0.min(self.n_levels))
    }
}

/// A header that is read.
struct Fields<'a> {
    brick: &'a [u8],
    n_read: usize,
}

impl<'a> Fields<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], DecodeError> {
        let taken = self.brick.get(self.n_read..self.n_read + n);
        self.n_read += n;
        taken.ok_or(DecodeError::Truncated { needed: self.n_read, given: self.brick.len() })
    }

    fn byte(&mut self) -> Result<u8, DecodeError> {
        Ok(self.take(1)?[0])
    }

    /// A number in LEB128: seven bits a byte, lowest first; the highest bit is set if more follow.
    fn number(&mut self, field: &'static str, most: u64) -> Result<u64, DecodeError> {
        let mut number = 0;
        for shift in (0..63).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 127) << shift;
            if byte < 128 {
                return if number <= most { Ok(number) } else { Err(DecodeError::Field { field }) };
            }
        }
        Err(DecodeError::Field { field })
    }

    /// The fields of every brick.
    fn fixed(&mut self) -> Result<BrickHeader, DecodeError> {
        let (kinds, transform) = (self.byte()?, self.byte()?);
        let scalar = TYPES.get(usize::from(kinds & 15)).ok_or(DecodeError::Field { field: "the sample type" })?;
        let storage = Storage::ALL.get(usize::from(kinds >> 4)).ok_or(DecodeError::Field { field: "the storage" })?;
        let kernel = Kernel::ALL.get(usize::from(transform & 15)).ok_or(DecodeError::Field { field: "the kernel" })?;
        let n_levels = transform >> 4;
        let has_no_bands = !kernel.has_bands() || matches!(storage, Storage::OneValue | Storage::Raw);
        if n_levels > if has_no_bands { 0 } else { MAX_LEVELS } {
            return Err(DecodeError::Field { field: "the number of levels" });
        }
        let mut number = |field| Ok::<u32, DecodeError>(self.number(field, u64::from(u32::MAX))? as u32);
        let extent = UVec3::new(number("the extent")?, number("the extent")?, number("the extent")?);
        let (step, max_error) = (number("the step")?, number("the greatest error")?);
        if step % 2 == 0 {
            return Err(DecodeError::Field { field: "the step" });
        }
        Ok(BrickHeader {
            scalar: *scalar,
            extent,
            kernel: *kernel,
            n_levels,
            storage: *storage,
            step,
            max_error,
            body: Body::Raw,
            n_section_bytes: Vec::new(),
            n_bytes: 0,
        })
    }
}

/// Whether a checksum is that of its bytes. A fuzzer would never find it, and is let through.
pub(crate) fn matches_checksum(bytes: &[u8], checksum: &[u8]) -> bool {
    cfg!(fuzzing) || checksum == crc32c::crc32c(bytes).to_le_bytes()
}

/// Appends a number in LEB128.
fn push_number(bytes: &mut Vec<u8>, mut number: u64) {
    while number > 127 {
        bytes.push(number as u8 | 128);
        number >>= 7;
    }
    bytes.push(number as u8);
}
