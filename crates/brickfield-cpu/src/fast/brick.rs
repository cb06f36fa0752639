//! Samples of one brick in f32: several nodes of a ray at a time, so that the compiler can use vector registers.
//!
//! Indices are held below a bound that the compiler knows, so that no bounds check is left.

/// Nodes that are interpolated together.
pub(super) const LANES: usize = 16;

/// One number for each node of a batch.
pub(super) type Lanes = [f32; LANES];

/// How a sample is read from the bytes of a brick.
pub(super) trait Stored: Copy + Send + Sync + 'static {
    /// Bytes of a sample.
    const N_BYTES: usize;
    /// Two samples that are neighbours along x, as they are stored.
    type Pair: Copy + Default;
    /// Samples `i` and `i + 1` of a brick.
    fn pair(bytes: &[u8], i: usize) -> Self::Pair;
    /// The stored number of sample `i`.
    fn number(bytes: &[u8], i: usize) -> f32;
    /// The stored numbers of a pair, less `bias`.
    fn split(pair: Self::Pair, bias: f32) -> (f32, f32);
}

#[derive(Clone, Copy)]
pub(super) struct Unorm8;
#[derive(Clone, Copy)]
pub(super) struct Unorm16;
#[derive(Clone, Copy)]
pub(super) struct Float32;

impl Stored for Unorm8 {
    const N_BYTES: usize = 1;
    type Pair = u32;
    #[inline(always)]
    fn pair(bytes: &[u8], i: usize) -> u32 {
        let b = &bytes[i..i + 2];
        u32::from(u16::from_le_bytes([b[0], b[1]]))
    }
    #[inline(always)]
    fn number(bytes: &[u8], i: usize) -> f32 {
        f32::from(bytes[i])
    }
    #[inline(always)]
    fn split(pair: u32, _: f32) -> (f32, f32) {
        ((pair & 0xff) as i32 as f32, (pair >> 8) as i32 as f32)
    }
}

impl Stored for Unorm16 {
    const N_BYTES: usize = 2;
    type Pair = u32;
    #[inline(always)]
    fn pair(bytes: &[u8], i: usize) -> u32 {
        let b = &bytes[2 * i..2 * i + 4];
        u32::from_le_bytes([b[0], b[1], b[2], b[3]])
    }
    #[inline(always)]
    fn number(bytes: &[u8], i: usize) -> f32 {
        f32::from(u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]))
    }
    /// 16 bits leave f32 only 8 bits for fractions: numbers are counted from the one that stands for the first knot.
    #[inline(always)]
    fn split(pair: u32, bias: f32) -> (f32, f32) {
        ((pair & 0xffff) as i32 as f32 - bias, (pair >> 16) as i32 as f32 - bias)
    }
}

impl Stored for Float32 {
    const N_BYTES: usize = 4;
    type Pair = u64;
    #[inline(always)]
    fn pair(bytes: &[u8], i: usize) -> u64 {
        let b = &bytes[4 * i..4 * i + 8];
        u64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]])
    }
    #[inline(always)]
    fn number(bytes: &[u8], i: usize) -> f32 {
        let b = &bytes[4 * i..4 * i + 4];
        f32::from_le_bytes([b[0], b[1], b[2], b[3]])
    }
    #[inline(always)]
    fn split(pair: u64, _: f32) -> (f32, f32) {
        (f32::from_bits(pair as u32), f32::from_bits((pair >> 32) as u32))
    }
}

/// Adding this to a number between -2^22 and 2^22 rounds it to an integer, which the sum's low bits then hold.
const ROUND: f32 = 12_582_912.0;

/// Evenly spaced nodes in a brick, of which any may be asked for: positions in its own samples, [0, n - 1] once clamped to
/// `last`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nodes {
    pub(super) origin: [f32; 3],
    /// Change from node to node.
    pub(super) change: [f32; 3],
    pub(super) last: [f32; 3],
    /// Taken off stored numbers (only 16-bit ones).
    pub(super) bias: f32,
}

impl Nodes {
    /// The cells along an axis that hold nodes `at`, and how far into them they lie.
    #[inline(always)]
    pub(super) fn cells<const N: usize, const L: usize>(&self, axis: usize, at: &[f32; L]) -> ([u32; L], [f32; L]) {
        let (origin, change, last) = (self.origin[axis], self.change[axis], self.last[axis]);
        let (mut cells, mut fractions) = ([0; L], [0.0; L]);
        for l in 0..L {
            let s = at_least(at_most(origin + change * at[l], last), 0.0);
            // Where s is an integer, either cell has its value.
            let (cell, low) = floor_bits(s);
            cells[l] = cell & (N as u32 - 1);
            fractions[l] = s - low;
        }
        (cells, fractions)
    }

    /// The stored numbers (less the bias) at nodes `at` (fractions lie between): linear along x, then y, then z.
    #[inline(always)]
    pub(super) fn stored<const N: usize, S: Stored, const L: usize>(&self, brick: &[u8], at: &[f32; L]) -> [f32; L] {
        let brick = &brick[..N * N * N * S::N_BYTES];
        let (mut base, mut fraction) = ([0u32; L], [[0f32; L]; 3]);
        for (axis, fraction) in fraction.iter_mut().enumerate() {
            let stride = N.pow(axis as u32) as u32;
            let (cells, fractions) = self.cells::<N, L>(axis, at);
            for l in 0..L {
                base[l] += cells[l] * stride;
            }
            *fraction = fractions;
        }
        let mut pairs = [[S::Pair::default(); L]; 4];
        for l in 0..L {
            // Holds anyway; so the compiler knows it too.
            let i = (base[l] as usize).min(N * N * N - N * N - N - 2);
            for (pair, corner) in pairs.iter_mut().zip([0, N, N * N, N * N + N]) {
                pair[l] = S::pair(brick, i + corner);
            }
        }
        let [fx, fy, fz] = &fraction;
        let mut out = [0f32; L];
        for l in 0..L {
            let row = |p: &[S::Pair; L]| {
                let (a, b) = S::split(p[l], self.bias);
                mix(a, b, fx[l])
            };
            let near = mix(row(&pairs[0]), row(&pairs[1]), fy[l]);
            let far = mix(row(&pairs[2]), row(&pairs[3]), fy[l]);
            out[l] = mix(near, far, fz[l]);
        }
        out
    }
}

#[inline(always)]
fn mix(a: f32, b: f32, f: f32) -> f32 {
    a + (b - a) * f
}

/// The integer below s, or s itself or the one before where s is an integer: in the low bits of a word, and as a float.
#[inline(always)]
fn floor_bits(s: f32) -> (u32, f32) {
    let rounded = (s - 0.5) + ROUND;
    (rounded.to_bits(), rounded - ROUND)
}

/// `f32::max` without its care for NaN: one instruction.
#[inline(always)]
fn at_least(x: f32, low: f32) -> f32 {
    if x > low { x } else { low }
}

#[inline(always)]
pub(super) fn at_most(x: f32, high: f32) -> f32 {
    if x < high { x } else { high }
}
