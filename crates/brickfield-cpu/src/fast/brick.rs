//! Samples of one brick in f32.
//!
//! Brick sides are powers of two, so that an index masked with n^3 - 1 is in range by construction: no bounds check is left.

use brickfield_frame::SampleFormat;

/// How a sample is read from the bytes of a brick.
pub(super) trait Stored: Copy + Send + Sync + 'static {
    /// Bytes of a sample.
    const N_BYTES: usize;
    /// The format.
    const FORMAT: SampleFormat;
    /// Taken off stored numbers before they are interpolated: 16 bits leave f32 only 8 bits for fractions, so numbers are
    /// counted from the one that stands for the transfer function's first knot.
    const IS_WIDE: bool = false;
    /// The stored number of sample `i`.
    fn read(bytes: &[u8], i: usize) -> f32;
}

#[derive(Clone, Copy)]
pub(super) struct Unorm8;
#[derive(Clone, Copy)]
pub(super) struct Unorm16;
#[derive(Clone, Copy)]
pub(super) struct Float32;

impl Stored for Unorm8 {
    const N_BYTES: usize = 1;
    const FORMAT: SampleFormat = SampleFormat::Unorm8;
    #[inline(always)]
    fn read(bytes: &[u8], i: usize) -> f32 {
        f32::from(bytes[i])
    }
}

impl Stored for Unorm16 {
    const N_BYTES: usize = 2;
    const FORMAT: SampleFormat = SampleFormat::Unorm16;
    #[inline(always)]
    fn read(bytes: &[u8], i: usize) -> f32 {
        f32::from(u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]))
    }
}

impl Stored for Float32 {
    const N_BYTES: usize = 4;
    const FORMAT: SampleFormat = SampleFormat::Float32;
    #[inline(always)]
    fn read(bytes: &[u8], i: usize) -> f32 {
        f32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]])
    }
}

/// The stored number at `s` in [0, n - 1] of a brick of n^3 samples: linear along x, then y, then z.
#[inline(always)]
pub(super) fn trilinear<const N: usize, S: Stored>(brick: &[u8], s: [f32; 3]) -> f32 {
    // Truncation is floor: s is not negative.
    let i = s.map(|x| (x as i32 as u32 as usize).min(N - 2));
    let f = [s[0] - i[0] as f32, s[1] - i[1] as f32, s[2] - i[2] as f32];
    let base = i[0] + N * (i[1] + N * i[2]);
    let v = |c: usize| S::read(brick, (base + c) & (N * N * N - 1));
    let mix = |a: f32, b: f32, f: f32| a + (b - a) * f;
    let row = |c: usize| mix(v(c), v(c + 1), f[0]);
    let slice = |c: usize| mix(row(c), row(c + N), f[1]);
    mix(slice(0), slice(N * N), f[2])
}
