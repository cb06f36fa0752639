//! Samples of one brick in f32: eight nodes of a ray at a time.

use super::eight::{Eight, F32s, LANES, U32s};

/// The numbers of a cell's eight samples, x varying fastest.
pub(super) type Corners<T> = [T; 8];

/// How a sample is read from the bytes of a brick.
pub(super) trait Stored: Copy + Send + Sync + 'static {
    /// Bytes of a sample.
    const N_BYTES: usize;
    /// The stored number of sample `i`.
    fn number(bytes: &[u8], i: usize) -> f32;
    /// The stored numbers, less `bias`, of the samples of eight cells in a brick of N samples a side, which begin at samples `at`.
    fn corners<const N: usize, V: Eight>(eight: V, brick: &[u8], at: [usize; LANES], bias: f32) -> Corners<F32s<V>>;
}

#[derive(Clone, Copy)]
pub(super) struct Unorm8;
#[derive(Clone, Copy)]
pub(super) struct Unorm16;
#[derive(Clone, Copy)]
pub(super) struct Float32;

/// Where the pairs of samples along x lie that a cell has.
const fn pairs(n: usize) -> [usize; 4] {
    [0, n, n * n, n * n + n]
}

impl Stored for Unorm8 {
    const N_BYTES: usize = 1;
    #[inline(always)]
    fn number(bytes: &[u8], i: usize) -> f32 {
        f32::from(bytes[i])
    }
    #[inline(always)]
    fn corners<const N: usize, V: Eight>(eight: V, brick: &[u8], at: [usize; LANES], _: f32) -> Corners<F32s<V>> {
        // Two pairs of a face at z, and of the one behind.
        let (mut near, mut far) = ([[0u16; 2]; LANES], [[0u16; 2]; LANES]);
        for l in 0..LANES {
            let cell = &brick[at[l]..at[l] + N * N + N + 2];
            near[l] = [u16::from_le_bytes([cell[0], cell[1]]), u16::from_le_bytes([cell[N], cell[N + 1]])];
            let cell = &cell[N * N..];
            far[l] = [u16::from_le_bytes([cell[0], cell[1]]), u16::from_le_bytes([cell[N], cell[N + 1]])];
        }
        let (near, far) = (U32s::new(eight, pulp::cast(near)), U32s::new(eight, pulp::cast(far)));
        [
            near.and(0xff).to_f32s(),
            near.shr(8).and(0xff).to_f32s(),
            near.shr(16).and(0xff).to_f32s(),
            near.shr(24).to_f32s(),
            far.and(0xff).to_f32s(),
            far.shr(8).and(0xff).to_f32s(),
            far.shr(16).and(0xff).to_f32s(),
            far.shr(24).to_f32s(),
        ]
    }
}

impl Stored for Unorm16 {
    const N_BYTES: usize = 2;
    #[inline(always)]
    fn number(bytes: &[u8], i: usize) -> f32 {
        f32::from(u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]))
    }
    /// 16 bits leave f32 only 8 bits for fractions: numbers are counted from the one that stands for the first knot.
    #[inline(always)]
    fn corners<const N: usize, V: Eight>(eight: V, brick: &[u8], at: [usize; LANES], bias: f32) -> Corners<F32s<V>> {
        let mut words = [[0; LANES]; 4];
        for (words, by) in words.iter_mut().zip(pairs(N)) {
            for l in 0..LANES {
                let i = 2 * (at[l] + by);
                let b = &brick[i..i + 4];
                words[l] = u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
            }
        }
        let bias = F32s::all(eight, bias);
        let low = |i: usize| U32s::new(eight, words[i]).and(0xffff).to_f32s() - bias;
        let high = |i: usize| U32s::new(eight, words[i]).shr(16).to_f32s() - bias;
        [low(0), high(0), low(1), high(1), low(2), high(2), low(3), high(3)]
    }
}

impl Stored for Float32 {
    const N_BYTES: usize = 4;
    #[inline(always)]
    fn number(bytes: &[u8], i: usize) -> f32 {
        let b = &bytes[4 * i..4 * i + 4];
        f32::from_le_bytes([b[0], b[1], b[2], b[3]])
    }
    #[inline(always)]
    fn corners<const N: usize, V: Eight>(eight: V, brick: &[u8], at: [usize; LANES], _: f32) -> Corners<F32s<V>> {
        let mut numbers = [[0.0; LANES]; 8];
        for (i, by) in pairs(N).into_iter().enumerate() {
            for l in 0..LANES {
                numbers[2 * i][l] = Self::number(brick, at[l] + by);
                numbers[2 * i + 1][l] = Self::number(brick, at[l] + by + 1);
            }
        }
        let of = |i: usize| F32s::new(eight, numbers[i]);
        [of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7)]
    }
}

/// Evenly spaced nodes in a brick, of which any may be asked for: positions in its own samples, [0, n - 1] once clamped to
/// `last`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nodes {
    pub(super) origin: [f32; 3],
    /// Change from node to node.
    pub(super) change: [f32; 3],
    pub(super) last: [f32; 3],
}

impl Nodes {
    /// Where nodes `at` lie (fractions lie between).
    #[inline(always)]
    pub(super) fn places<const N: usize, V: Eight>(&self, eight: V, at: F32s<V>) -> Places<V> {
        let (mut cells, mut fractions) = ([U32s::all(eight, 0); 3], [at; 3]);
        for axis in 0..3 {
            let s = at.times_plus(F32s::all(eight, self.change[axis]), F32s::all(eight, self.origin[axis]));
            let s = s.at_most(F32s::all(eight, self.last[axis])).at_least(F32s::all(eight, 0.0));
            // Where s is an integer, either cell has its value.
            let (cell, fraction) = s.split();
            (cells[axis], fractions[axis]) = (cell.and(N as u32 - 1), fraction);
        }
        Places { cells, fractions }
    }
}

/// Where eight nodes lie in a brick.
#[derive(Clone, Copy)]
pub(super) struct Places<V> {
    /// The cells that hold them, along each axis.
    pub(super) cells: [U32s<V>; 3],
    /// How far into the cells they lie.
    fractions: [F32s<V>; 3],
}

impl<V: Eight> Places<V> {
    /// The stored numbers (less a bias) there: linear along x, then y, then z.
    #[inline(always)]
    pub(super) fn stored<const N: usize, S: Stored>(&self, eight: V, brick: &[u8], bias: f32) -> F32s<V> {
        let brick = &brick[..N * N * N * S::N_BYTES];
        let ([x, y, z], [fx, fy, fz]) = (self.cells, self.fractions);
        let begin = x + y.shl(N.ilog2()) + z.shl(2 * N.ilog2());
        let mut at = [0; LANES];
        for (at, i) in at.iter_mut().zip(begin.to_array()) {
            *at = i as usize;
        }
        let [a, b, c, d, e, f, g, h] = S::corners::<N, V>(eight, brick, at, bias);
        let near = mix(mix(a, b, fx), mix(c, d, fx), fy);
        let far = mix(mix(e, f, fx), mix(g, h, fx), fy);
        mix(near, far, fz)
    }
}

#[inline(always)]
fn mix<V: Eight>(a: F32s<V>, b: F32s<V>, f: F32s<V>) -> F32s<V> {
    f.times_plus(b - a, a)
}

/// The stored number (less the bias) at a position in a brick's own samples.
#[inline(always)]
pub(super) fn stored_at<const N: usize, S: Stored>(brick: &[u8], s: [f32; 3], bias: f32) -> f32 {
    let (mut begin, mut fractions) = (0, [0.0; 3]);
    for axis in 0..3 {
        let cell = (s[axis] as usize).min(N - 2);
        begin += cell * N.pow(axis as u32);
        fractions[axis] = s[axis] - cell as f32;
    }
    let [fx, fy, fz] = fractions;
    let mut rows = [0.0; 4];
    for (row, by) in rows.iter_mut().zip(pairs(N)) {
        let (a, b) = (S::number(brick, begin + by) - bias, S::number(brick, begin + by + 1) - bias);
        *row = a + (b - a) * fx;
    }
    let [a, b, c, d] = rows;
    let (near, far) = (a + (b - a) * fy, c + (d - c) * fy);
    near + (far - near) * fz
}

/// The lesser number; `high` for NaN. One instruction, where `f32::min` takes care of NaN.
#[inline(always)]
pub(super) fn at_most(x: f32, high: f32) -> f32 {
    if x < high { x } else { high }
}
