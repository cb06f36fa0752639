//! Eight numbers at a time, in a vector register where the processor has one.
//!
//! Written out: the compiler cuts loops over arrays into halves and quarters, and carries their numbers through memory.

use std::ops::{Add, Div, Mul, Sub};

use pulp::{Arch, NullaryFnOnce, Scalar256b, Simd, cast, f32x8, m32x8, u32x8};

/// Numbers in a register.
pub(super) const LANES: usize = 8;

/// Added to a number between -2^22 and 2^22 it rounds it to an integer, which the sum's low bits then hold.
pub(super) const ROUND: f32 = 12_582_912.0;

/// Instructions for eight numbers.
pub(super) trait Eight: Simd<f32s = f32x8, u32s = u32x8, m32s = m32x8> {
    /// The numbers of a table at some places, of which the lowest three bits count.
    fn look_up(self, table: f32x8, at: u32x8) -> f32x8;

    /// a b + c, rounded once where the processor can.
    fn times_plus(self, a: f32x8, b: f32x8, c: f32x8) -> f32x8;

    /// Integers below 2^31 as numbers.
    fn of_integers(self, integers: u32x8) -> f32x8;

    /// The sum of each vector.
    fn sums(self, vectors: [f32x8; 4]) -> [f32; 4];

    /// One bit for each lane.
    fn bits(self, mask: m32x8) -> u8;
}

#[cfg(target_arch = "x86_64")]
impl Eight for pulp::x86::V3 {
    #[inline(always)]
    fn look_up(self, table: f32x8, at: u32x8) -> f32x8 {
        cast(self.avx2._mm256_permutevar8x32_ps(cast(table), cast(at)))
    }

    #[inline(always)]
    fn times_plus(self, a: f32x8, b: f32x8, c: f32x8) -> f32x8 {
        self.mul_add_f32x8(a, b, c)
    }

    #[inline(always)]
    fn of_integers(self, integers: u32x8) -> f32x8 {
        cast(self.avx._mm256_cvtepi32_ps(cast(integers)))
    }

    #[inline(always)]
    fn sums(self, vectors: [f32x8; 4]) -> [f32; 4] {
        let ([a, b, c, d], avx) = (vectors, self.avx);
        let (ab, cd) = (avx._mm256_hadd_ps(cast(a), cast(b)), avx._mm256_hadd_ps(cast(c), cast(d)));
        let halves = avx._mm256_hadd_ps(ab, cd);
        let (low, high) = (avx._mm256_castps256_ps128(halves), avx._mm256_extractf128_ps::<1>(halves));
        cast(self.sse._mm_add_ps(low, high))
    }

    #[inline(always)]
    fn bits(self, mask: m32x8) -> u8 {
        self.avx._mm256_movemask_ps(cast(self.transmute_u32s_m32s(mask))) as u8
    }
}

impl Eight for Scalar256b {
    #[inline(always)]
    fn look_up(self, table: f32x8, at: u32x8) -> f32x8 {
        let (table, at): ([f32; LANES], [u32; LANES]) = (cast(table), cast(at));
        cast(at.map(|at| table[at as usize % LANES]))
    }

    /// (Where it has no instruction, rounding once takes a call for each number.)
    #[inline(always)]
    fn times_plus(self, a: f32x8, b: f32x8, c: f32x8) -> f32x8 {
        let (a, b, c): ([f32; LANES], [f32; LANES], [f32; LANES]) = (cast(a), cast(b), cast(c));
        let mut sums = c;
        for l in 0..LANES {
            sums[l] = match cfg!(target_arch = "aarch64") {
                true => a[l].mul_add(b[l], c[l]),
                false => a[l] * b[l] + c[l],
            };
        }
        cast(sums)
    }

    #[inline(always)]
    fn of_integers(self, integers: u32x8) -> f32x8 {
        let integers: [u32; LANES] = cast(integers);
        cast(integers.map(|i| i as i32 as f32))
    }

    #[inline(always)]
    fn sums(self, vectors: [f32x8; 4]) -> [f32; 4] {
        vectors.map(|vector| {
            let [a, b, c, d, e, f, g, h]: [f32; LANES] = cast(vector);
            ((a + b) + (c + d)) + ((e + f) + (g + h))
        })
    }

    #[inline(always)]
    fn bits(self, mask: m32x8) -> u8 {
        let lanes: [u32; LANES] = cast(self.transmute_u32s_m32s(mask));
        lanes.into_iter().rev().fold(0, |bits, lane| bits << 1 | (lane & 1) as u8)
    }
}

/// Work that is compiled once for each instruction set.
pub(super) trait Vectorized {
    fn run(self, eight: impl Eight);
}

/// Work with the best instructions that the processor has.
pub(super) fn vectorized(work: impl Vectorized) {
    match Arch::new() {
        #[cfg(target_arch = "x86_64")]
        Arch::V3(eight) => eight.vectorize(With { work, eight }),
        arch => arch.dispatch(With { work, eight: Scalar256b }),
    }
}

/// Work, and the instructions that it is done with.
pub(super) struct With<W, V> {
    pub(super) work: W,
    pub(super) eight: V,
}

impl<W: Vectorized, V: Eight> NullaryFnOnce for With<W, V> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.work.run(self.eight);
    }
}

/// Eight numbers, and the instructions that they are computed with.
#[derive(Clone, Copy)]
pub(super) struct F32s<V> {
    eight: V,
    x: f32x8,
}

impl<V: Eight> F32s<V> {
    #[inline(always)]
    pub(super) fn new(eight: V, x: [f32; LANES]) -> F32s<V> {
        F32s { eight, x: cast(x) }
    }

    /// Eight times the same number.
    #[inline(always)]
    pub(super) fn all(eight: V, x: f32) -> F32s<V> {
        F32s { eight, x: eight.splat_f32s(x) }
    }

    /// 0, 1, 2, ...
    #[inline(always)]
    pub(super) fn count(eight: V) -> F32s<V> {
        F32s::new(eight, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])
    }

    #[inline(always)]
    pub(super) fn to_array(self) -> [f32; LANES] {
        cast(self.x)
    }

    #[inline(always)]
    fn with(self, x: f32x8) -> F32s<V> {
        F32s { x, ..self }
    }

    /// self a + b, rounded once where the processor can.
    #[inline(always)]
    pub(super) fn times_plus(self, a: F32s<V>, b: F32s<V>) -> F32s<V> {
        self.with(self.eight.times_plus(self.x, a.x, b.x))
    }

    /// The greater numbers; those of `low` for NaN.
    #[inline(always)]
    pub(super) fn at_least(self, low: F32s<V>) -> F32s<V> {
        self.with(self.eight.max_f32s(self.x, low.x))
    }

    /// The lesser numbers; those of `high` for NaN.
    #[inline(always)]
    pub(super) fn at_most(self, high: F32s<V>) -> F32s<V> {
        self.with(self.eight.min_f32s(self.x, high.x))
    }

    /// The greatest of all.
    #[inline(always)]
    pub(super) fn greatest(self) -> f32 {
        self.eight.reduce_max_f32s(self.x)
    }

    #[inline(always)]
    pub(super) fn is_less(self, other: F32s<V>) -> Mask {
        Mask(self.eight.less_than_f32s(self.x, other.x))
    }

    #[inline(always)]
    pub(super) fn is_equal(self, other: F32s<V>) -> Mask {
        Mask(self.eight.equal_f32s(self.x, other.x))
    }

    /// Those under a mask, else 0.
    #[inline(always)]
    pub(super) fn or_zero(self, mask: Mask) -> F32s<V> {
        self.or(mask, F32s::all(self.eight, 0.0))
    }

    /// Those under a mask, else those of `other`.
    #[inline(always)]
    pub(super) fn or(self, mask: Mask, other: F32s<V>) -> F32s<V> {
        self.with(self.eight.select_f32s(mask.0, self.x, other.x))
    }

    /// Each number `n` lanes further on, and 0 in the first lanes.
    #[inline(always)]
    pub(super) fn moved(self, n: u32) -> F32s<V> {
        let (eight, lanes) = (self.eight, cast([0u32, 1, 2, 3, 4, 5, 6, 7]));
        let n = eight.splat_u32s(n);
        let moved = self.with(eight.look_up(self.x, eight.sub_u32s(lanes, n)));
        F32s::all(eight, 0.0).or(Mask(eight.less_than_u32s(lanes, n)), moved)
    }

    /// Numbers between 0 and 2^22: the integers below them (themselves or the ones before where they are integers), and what is left of them.
    #[inline(always)]
    pub(super) fn split(self) -> (U32s<V>, F32s<V>) {
        let all = |x| F32s::all(self.eight, x);
        let rounded = (self - all(0.5)) + all(ROUND);
        let low = rounded - all(ROUND);
        (rounded.bits(), self - low)
    }

    #[inline(always)]
    pub(super) fn bits(self) -> U32s<V> {
        U32s { eight: self.eight, x: cast(self.x) }
    }

    /// The sum of each.
    #[inline(always)]
    pub(super) fn sums([a, b, c, d]: [F32s<V>; 4]) -> [f32; 4] {
        a.eight.sums([a.x, b.x, c.x, d.x])
    }
}

macro_rules! operator {
    ($numbers:ident, $operator:ident, $of:ident, $by:ident) => {
        impl<V: Eight> $operator for $numbers<V> {
            type Output = $numbers<V>;
            #[inline(always)]
            fn $of(self, other: $numbers<V>) -> $numbers<V> {
                $numbers { x: self.eight.$by(self.x, other.x), ..self }
            }
        }
    };
}
operator!(F32s, Add, add, add_f32s);
operator!(F32s, Sub, sub, sub_f32s);
operator!(F32s, Mul, mul, mul_f32s);
operator!(F32s, Div, div, div_f32s);
operator!(U32s, Add, add, add_u32s);
operator!(U32s, Sub, sub, sub_u32s);

/// Which of eight numbers.
#[derive(Clone, Copy)]
pub(super) struct Mask(m32x8);

impl Mask {
    #[inline(always)]
    pub(super) fn all(eight: impl Eight) -> Mask {
        Mask(eight.transmute_m32s_u32s(eight.splat_u32s(u32::MAX)))
    }

    #[inline(always)]
    pub(super) fn has_all(self, eight: impl Eight) -> bool {
        eight.bits(self.0) == u8::MAX
    }
}

/// Eight integers.
#[derive(Clone, Copy)]
pub(super) struct U32s<V> {
    eight: V,
    x: u32x8,
}

impl<V: Eight> U32s<V> {
    #[inline(always)]
    pub(super) fn new(eight: V, x: [u32; LANES]) -> U32s<V> {
        U32s { eight, x: cast(x) }
    }

    #[inline(always)]
    pub(super) fn all(eight: V, x: u32) -> U32s<V> {
        U32s { eight, x: eight.splat_u32s(x) }
    }

    #[inline(always)]
    pub(super) fn to_array(self) -> [u32; LANES] {
        cast(self.x)
    }

    /// The bits that `bits` has, too.
    #[inline(always)]
    pub(super) fn and(self, bits: u32) -> U32s<V> {
        U32s { x: self.eight.and_u32s(self.x, self.eight.splat_u32s(bits)), ..self }
    }

    #[inline(always)]
    pub(super) fn shl(self, n: u32) -> U32s<V> {
        U32s { x: self.eight.wrapping_dyn_shl_u32s(self.x, self.eight.splat_u32s(n)), ..self }
    }

    #[inline(always)]
    pub(super) fn shr(self, n: u32) -> U32s<V> {
        U32s { x: self.eight.wrapping_dyn_shr_u32s(self.x, self.eight.splat_u32s(n)), ..self }
    }

    /// One less for those under a mask.
    #[inline(always)]
    pub(super) fn less_one(self, mask: Mask) -> U32s<V> {
        // All bits of a word are -1.
        self + U32s { x: self.eight.transmute_u32s_m32s(mask.0), ..self }
    }

    #[inline(always)]
    pub(super) fn is_equal(self, other: U32s<V>) -> Mask {
        Mask(self.eight.equal_u32s(self.x, other.x))
    }

    #[inline(always)]
    pub(super) fn is_less(self, other: U32s<V>) -> Mask {
        Mask(self.eight.less_than_u32s(self.x, other.x))
    }

    /// Each one nearer to another, unless it is there.
    #[inline(always)]
    pub(super) fn one_towards(self, to: U32s<V>) -> U32s<V> {
        let one = |mask: Mask| self - self.less_one(mask);
        self + one(self.is_less(to)) - one(to.is_less(self))
    }

    /// Integers below 2^31 as numbers.
    #[inline(always)]
    pub(super) fn to_f32s(self) -> F32s<V> {
        F32s { eight: self.eight, x: self.eight.of_integers(self.x) }
    }

    #[inline(always)]
    pub(super) fn as_f32s(self) -> F32s<V> {
        F32s { eight: self.eight, x: cast(self.x) }
    }

    /// The numbers of a table at these places, of which the lowest three bits count.
    #[inline(always)]
    pub(super) fn of(self, table: &[f32; LANES]) -> F32s<V> {
        F32s { eight: self.eight, x: self.eight.look_up(cast(*table), self.x) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NUMBERS: [f32; LANES] = [0.0, 0.25, 1.0, 1.5, 2.75, 7.0, 20.0, 4_194_303.5];

    /// What all operations give that are not plain arithmetic.
    fn all(eight: impl Eight) -> Vec<f32> {
        let (numbers, twos) = (F32s::new(eight, NUMBERS), F32s::all(eight, 2.0));
        let mut out = Vec::new();
        for n in [1, 2, 4] {
            out.extend(numbers.moved(n).to_array());
        }
        let (cells, fractions) = numbers.split();
        out.extend(cells.and(0xff).to_f32s().to_array());
        out.extend(fractions.to_array());
        out.extend(F32s::sums([numbers, twos, numbers * twos, numbers - twos]));
        let smaller = numbers.is_less(twos);
        out.push(eight.bits(smaller.0).into());
        out.extend(numbers.or(smaller, twos).to_array());
        let (places, towards) = (U32s::new(eight, [7, 6, 5, 4, 3, 2, 1, 0]), U32s::all(eight, 4));
        out.extend(places.of(&NUMBERS).to_array());
        out.extend(places.less_one(smaller).to_f32s().to_array());
        out.extend(places.one_towards(towards).to_f32s().to_array());
        out
    }

    #[test]
    fn lanes_do_as_written() {
        let eight = Scalar256b;
        let numbers = F32s::new(eight, NUMBERS);
        assert_eq!(numbers.moved(2).to_array(), [0.0, 0.0, 0.0, 0.25, 1.0, 1.5, 2.75, 7.0]);
        assert_eq!(
            U32s::new(eight, [3, 0, 0, 1, 2, 7, 6, 13]).of(&NUMBERS).to_array(),
            [1.5, 0.0, 0.0, 0.25, 1.0, 4_194_303.5, 20.0, 7.0]
        );
        let (cells, fractions) = numbers.split();
        for ((cell, fraction), x) in cells.and(0x3f_ffff).to_array().into_iter().zip(fractions.to_array()).zip(NUMBERS)
        {
            assert!((0.0..=1.0).contains(&fraction) && cell as f32 + fraction == x, "{cell} + {fraction}, not {x}");
        }
        let towards = U32s::new(eight, [7, 6, 5, 4, 3, 2, 1, 0]).one_towards(U32s::all(eight, 4));
        assert_eq!(towards.to_array(), [6, 5, 4, 4, 4, 3, 2, 1]);
        assert_eq!(eight.bits(numbers.is_less(F32s::all(eight, 2.0)).0), 0b1111);
        assert_eq!(F32s::sums([numbers, numbers, F32s::count(eight), F32s::all(eight, 1.0)])[2..], [28.0, 8.0]);
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn all_instructions_give_the_same() {
        if let Arch::V3(eight) = Arch::new() {
            assert_eq!(all(eight), all(Scalar256b));
        }
    }
}
