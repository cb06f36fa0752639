//! How a device unpacks slots: which of them at once, and in which order.

use brickfield_core::glam::UVec3;
use brickfield_frame::{DecodingUniforms, PackedSamples, PackedUniform, SampleFormat, Slots, TextureShape};

/// Slots that a device unpacks at once: the contents of its buffers, its tasks, and where the texels lie afterwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoding {
    /// The slots as shaders read them.
    pub bricks: Vec<PackedUniform>,
    /// Their words.
    pub words: Vec<u32>,
    /// Coefficients of all slots, of four bytes each.
    pub n_coefficients: u32,
    /// Words of texels.
    pub n_texel_words: u32,
    /// The texels of each slot.
    pub texels: Vec<DecodedTexels>,
    format: SampleFormat,
}

/// Where the texels of a slot lie after they were unpacked, and where they belong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DecodedTexels {
    /// The first byte in the buffer.
    pub offset: u64,
    /// Bytes from one row to the next; a slice begins behind the last row of the one before.
    pub row_bytes: u32,
    /// The first texel in the texture.
    pub origin: UVec3,
    /// Texels along x, y, z.
    pub size: UVec3,
}

/// A dispatch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DecodingTask {
    /// The task.
    pub uniforms: DecodingUniforms,
    /// Invocations along x, y, z.
    pub n: [u32; 3],
}

/// Most coefficients of slots that are unpacked at once, 64 MiB: as many as a slot may have.
const MOST_COEFFICIENTS: u32 = 1 << 24;
/// Most slots at once: a dispatch has at most 65,535 workgroups along an axis.
const MOST_SLOTS: usize = 1 << 14;
/// Rows of texels are multiples of so many bytes apart, which WebGPU asks for. Slots lie side by side in them.
const ROW_BYTES: u32 = 256;

/// What a device unpacks for those of some slots that are packed, in a texture of a shape.
pub fn decodings(shape: TextureShape, slots: &Slots, some: &[u32]) -> Vec<Decoding> {
    let mut all: Vec<Decoding> = Vec::new();
    let mut shelf = Shelf::default();
    for slot in some {
        let Some(packed) = slots.samples(*slot).and_then(|chunk| chunk.packed()) else { continue };
        if !all.last().is_some_and(|last| last.has_room_for(packed)) {
            all.push(Decoding::empty(slots.format()));
            shelf = Shelf::default();
        }
        let (origin, size) = shape.texels_of(slots, *slot);
        if let Some(last) = all.last_mut() {
            last.push(packed, (origin, size), &mut shelf);
        }
    }
    all
}

impl Decoding {
    fn empty(format: SampleFormat) -> Decoding {
        let (bricks, words, texels) = (Vec::new(), Vec::new(), Vec::new());
        Decoding { bricks, words, n_coefficients: 0, n_texel_words: 0, texels, format }
    }

    fn has_room_for(&self, packed: &PackedSamples) -> bool {
        let n_more = packed.extent().element_product();
        self.bricks.len() < MOST_SLOTS && self.n_coefficients + n_more <= MOST_COEFFICIENTS
    }

    fn push(&mut self, packed: &PackedSamples, (origin, size): (UVec3, UVec3), shelf: &mut Shelf) {
        let own_bytes = (size.x * self.format.n_bytes() as u32).next_multiple_of(4);
        let offset = shelf.take(own_bytes, size.y * size.z);
        self.n_texel_words = shelf.end() / 4;
        let texels = DecodedTexels { offset: offset.into(), row_bytes: shelf.row_bytes, origin, size };
        self.texels.push(texels);
        let first_word = self.words.len() as u32;
        self.bricks.push(packed.uniform(first_word, self.n_coefficients, offset / 4, shelf.row_bytes / 4));
        self.words.extend_from_slice(packed.words());
        self.n_coefficients += size.element_product();
    }

    /// Bytes that are brought for it.
    pub fn n_bytes(&self) -> u64 {
        (size_of_val(&self.bricks[..]) + size_of_val(&self.words[..])) as u64
    }

    /// The dispatches, one after the other: each sees all that those before have written.
    pub fn tasks(&self) -> Vec<DecodingTask> {
        let sample_bits = 8 * self.format.n_bytes() as u32;
        let task = |task, level, axis| DecodingUniforms { task, level, axis, sample_bits };
        let n_bricks = self.bricks.len() as u32;
        let most = self.texels.iter().fold(UVec3::ONE, |most, texels| most.max(texels.size));
        let n_levels = self.bricks.iter().map(|brick| brick.n_levels).max().unwrap_or(0);
        let levels = (0..n_levels).rev().flat_map(|level| {
            let n = ((most - 1) >> level) + 1;
            [(2, n.x, n.y), (1, n.x, n.z), (0, n.y, n.z)].map(|(axis, nx, ny)| (task(1, level, axis), nx, ny))
        });
        let n_words = (most.x * sample_bits).div_ceil(32);
        let all = [(task(0, 0, 0), most.x, most.y)].into_iter().chain(levels).chain([(task(2, 0, 0), n_words, most.y)]);
        all.map(|(uniforms, nx, ny)| DecodingTask { uniforms, n: [nx, ny, n_bricks] }).collect()
    }
}

/// Rows of texels in which slots with equally many rows lie side by side.
#[derive(Debug, Default)]
struct Shelf {
    first: u32,
    row_bytes: u32,
    n_rows: u32,
    used_bytes: u32,
}

impl Shelf {
    /// Room for so many rows of so many bytes: the first byte.
    fn take(&mut self, own_bytes: u32, n_rows: u32) -> u32 {
        if self.used_bytes + own_bytes > self.row_bytes || self.n_rows != n_rows {
            let row_bytes = own_bytes.next_multiple_of(ROW_BYTES);
            *self = Shelf { first: self.end(), row_bytes, n_rows, used_bytes: 0 };
        }
        self.used_bytes += own_bytes;
        self.first + self.used_bytes - own_bytes
    }

    fn end(&self) -> u32 {
        self.first + self.row_bytes * self.n_rows
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use brickfield_core::BrickSide;
    use brickfield_frame::{AtlasShape, Chunk, Decode, Places, Upload};

    use super::*;

    fn bricks(n: usize) -> Slots {
        let upload = Upload::Packed { max_error: 0 };
        let chunk = |i: usize| {
            let samples = (0..4096).map(|j| (j / 256 + i) as u8).collect();
            let chunk = Chunk::of_samples(UVec3::splat(16), SampleFormat::Unorm8, samples, upload);
            (i != 1).then(|| Arc::new(chunk))
        };
        let decode = Decode { scale: 1.0, offset: 0.0 };
        Slots::new(SampleFormat::Unorm8, decode, Places::Even(BrickSide::S16), (0..n).map(chunk).collect()).unwrap()
    }

    #[test]
    fn slots_lie_side_by_side_and_apart() {
        let slots = bricks(19);
        let shape = TextureShape::Atlas(AtlasShape::fit(19, BrickSide::S16, 256).unwrap());
        let all: Vec<u32> = (0..19).collect();
        let [one] = &decodings(shape, &slots, &all)[..] else { panic!("19 small bricks at once") };
        assert_eq!((one.bricks.len(), one.n_coefficients), (18, 18 * 4096));
        // 16 bricks of 16 bytes a row fill 256 bytes; two lie in further rows.
        assert_eq!(one.n_texel_words, 2 * 256 * 64);
        let offsets: Vec<u64> = one.texels.iter().map(|texels| texels.offset).collect();
        assert_eq!((offsets[0], offsets[1], offsets[15], offsets[16]), (0, 16, 240, 256 * 256));
        let (origin, size) = shape.texels_of(&slots, 2);
        assert_eq!((one.texels[1].origin, one.texels[1].size), (origin, size));
        let n_bytes: usize = all.iter().filter_map(|slot| Some(slots.samples(*slot)?.packed()?.n_bytes())).sum();
        assert_eq!(one.n_bytes(), n_bytes as u64);
        assert!(decodings(shape, &slots, &[1]).is_empty());
    }

    #[test]
    fn levels_are_undone_from_the_coarsest_along_z_y_and_x() {
        let slots = bricks(1);
        let shape = TextureShape::Atlas(AtlasShape::least(BrickSide::S16));
        let tasks = decodings(shape, &slots, &[0])[0].tasks();
        let of = |task: &DecodingTask| (task.uniforms.task, task.uniforms.level, task.uniforms.axis);
        let expected = [(0, 0, 0), (1, 1, 2), (1, 1, 1), (1, 1, 0), (1, 0, 2), (1, 0, 1), (1, 0, 0), (2, 0, 0)];
        assert_eq!(tasks.iter().map(of).collect::<Vec<_>>(), expected);
        assert_eq!((tasks[1].n, tasks[7].n), ([8, 8, 1], [4, 16, 1]));
    }
}
