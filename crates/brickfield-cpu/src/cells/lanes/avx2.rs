//! Lanes of AVX2 with FMA.

use std::arch::x86_64::{__m128, __m256};

use brickfield_core::glam::Vec4;
use pulp::cast;
use pulp::x86::V3;

use super::{Areas, EDGES, FACE_CORNERS, Lanes, N_EDGES, Rows, UNSURE};

/// The lower, and the upper, corners of eight edges each.
const ENDS: [[[i32; 8]; 2]; 3] = {
    let mut ends = [[[0; 8]; 2]; 3];
    let mut i = 0;
    while i < 24 {
        ends[i / 8][0][i % 8] = EDGES[i][0] as i32;
        ends[i / 8][1][i % 8] = EDGES[i][1] as i32;
        i += 1;
    }
    ends
};

/// The corner across an axis from each one.
const ACROSS: [[i32; 8]; 3] = {
    let mut across = [[0; 8]; 3];
    let mut i = 0;
    while i < 24 {
        across[i / 8][i % 8] = ((i % 8) ^ (1 << (i / 8))) as i32;
        i += 1;
    }
    across
};

/// For each axis, the place of a corner on its face.
const ON_FACE: [[i32; 8]; 3] = {
    let mut on_face = [[0; 8]; 3];
    let mut i = 0;
    while i < 12 {
        let lower = FACE_CORNERS[i / 4][i % 4];
        on_face[i / 4][lower] = (i % 4) as i32;
        on_face[i / 4][lower | (1 << (i / 4))] = (i % 4) as i32;
        i += 1;
    }
    on_face
};

/// For each face, the corners opposite to it: all bits set.
const OPPOSITE: [[i32; 8]; 6] = {
    let mut opposite = [[0; 8]; 6];
    let mut i = 0;
    while i < 48 {
        let (face, corner) = (i / 8, i % 8);
        opposite[face][corner] = if (corner >> (face / 2)) & 1 != face % 2 { -1 } else { 0 };
        i += 1;
    }
    opposite
};

impl Lanes for V3 {
    type Four = __m128;
    type Eight = __m256;

    #[inline(always)]
    fn see(self, rows: &Rows, [a, b, c, d]: [Vec4; 4]) -> [__m128; 3] {
        let sse = self.sse;
        let (a, b, c, d) = (a.into(), b.into(), c.into(), d.into());
        let (low, high) = (sse._mm_unpacklo_ps(a, b), sse._mm_unpacklo_ps(c, d));
        let (x, y) = (sse._mm_movelh_ps(low, high), sse._mm_movehl_ps(high, low));
        let z = sse._mm_movelh_ps(sse._mm_unpackhi_ps(a, b), sse._mm_unpackhi_ps(c, d));
        // Closures would not be inlined into code for these instructions.
        [row(self, &rows[0], x, y, z), row(self, &rows[1], x, y, z), row(self, &rows[2], x, y, z)]
    }

    #[inline(always)]
    fn join(self, low: __m128, high: __m128) -> __m256 {
        self.avx._mm256_set_m128(high, low)
    }

    #[inline(always)]
    fn follow(self, last: __m256, new: __m128, face: usize) -> __m256 {
        let kept = permute(self, last, &ACROSS[face >> 1]);
        let spread = permute(self, self.avx._mm256_castps128_ps256(new), &ON_FACE[face >> 1]);
        self.avx._mm256_blendv_ps(kept, spread, cast(OPPOSITE[face]))
    }

    #[inline(always)]
    fn areas(self, u: __m256, v: __m256) -> Areas {
        let (avx, fma) = (self.avx, self.fma);
        let mut areas = Areas { areas: [0.0; 24], signs: 0, is_unsure: false };
        let mut unsure = avx._mm256_setzero_ps();
        let magnitude: __m256 = cast([0x7fff_ffffu32; 8]);
        for (group, [low, high]) in ENDS.iter().enumerate() {
            let less = avx._mm256_mul_ps(permute(self, u, high), permute(self, v, low));
            let area = fma._mm256_fmsub_ps(permute(self, u, low), permute(self, v, high), less);
            let own: [f32; 8] = cast(area);
            areas.areas[8 * group..8 * group + 8].copy_from_slice(&own);
            let above = avx._mm256_cmp_ps::<GREATER>(area, avx._mm256_setzero_ps());
            areas.signs |= (avx._mm256_movemask_ps(above) as u32) << (8 * group);
            let least = avx._mm256_mul_ps(avx._mm256_and_ps(less, magnitude), avx._mm256_set1_ps(UNSURE));
            let near = avx._mm256_cmp_ps::<LESS_OR_EQUAL>(avx._mm256_and_ps(area, magnitude), least);
            unsure = avx._mm256_or_ps(unsure, near);
        }
        areas.signs &= (1 << N_EDGES) - 1;
        areas.is_unsure = avx._mm256_movemask_ps(unsure) != 0;
        areas
    }

    #[inline(always)]
    fn array(self, numbers: __m256) -> [f32; 8] {
        cast(numbers)
    }
}

/// A row's number of four positions.
#[inline(always)]
fn row(simd: V3, row: &[f32; 4], x: __m128, y: __m128, z: __m128) -> __m128 {
    let (sse, fma) = (simd.sse, simd.fma);
    let sum = fma._mm_fmadd_ps(x, sse._mm_set1_ps(row[0]), sse._mm_set1_ps(row[3]));
    let sum = fma._mm_fmadd_ps(y, sse._mm_set1_ps(row[1]), sum);
    fma._mm_fmadd_ps(z, sse._mm_set1_ps(row[2]), sum)
}

#[inline(always)]
fn permute(simd: V3, numbers: __m256, order: &[i32; 8]) -> __m256 {
    simd.avx2._mm256_permutevar8x32_ps(numbers, cast(*order))
}

const GREATER: i32 = std::arch::x86_64::_CMP_GT_OQ;
const LESS_OR_EQUAL: i32 = std::arch::x86_64::_CMP_LE_OQ;
