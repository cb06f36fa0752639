//! Functions of depth and opacity in f32.

use super::eight::{Eight, F32s, ROUND, U32s};

/// Opacity of an optical depth, 1 - e^-depth: the Taylor polynomial below 1/4, exp above.
///
/// Relative error below 5e-7, largest where exp takes over.
#[inline(always)]
pub(super) fn alpha(depth: f32) -> f32 {
    if depth < THIN { alpha_thin(depth) } else { 1.0 - exp_minus(depth) }
}

/// [`alpha`] of eight depths, of which the greatest is known.
#[inline(always)]
pub(super) fn opacities<V: Eight>(eight: V, depths: F32s<V>, thickest: f32) -> F32s<V> {
    let thin = alpha_thin_of(eight, depths);
    if thickest < THIN {
        return thin;
    }
    thin.or(depths.is_less(F32s::all(eight, THIN)), F32s::all(eight, 1.0) - exp_minus_of(eight, depths))
}

/// Depths below this have their opacity from a polynomial.
pub(super) const THIN: f32 = 0.25;

/// Taylor's polynomial of degree 7; the first term left out is depth^8 / 40320.
#[inline(always)]
pub(super) fn alpha_thin(d: f32) -> f32 {
    let [a, b, c, e, f, g] = TAYLOR;
    d + d * d * (a + d * (b + d * (c + d * (e + d * (f + d * g)))))
}

/// Of 1 - e^-d, from d^2 on.
const TAYLOR: [f32; 6] = [-1.0 / 2.0, 1.0 / 6.0, -1.0 / 24.0, 1.0 / 120.0, -1.0 / 720.0, 1.0 / 5040.0];

/// [`alpha_thin`] of eight depths.
#[inline(always)]
fn alpha_thin_of<V: Eight>(eight: V, d: F32s<V>) -> F32s<V> {
    let mut sum = F32s::all(eight, TAYLOR[5]);
    for c in TAYLOR[..5].iter().rev() {
        sum = sum.times_plus(d, F32s::all(eight, *c));
    }
    sum.times_plus(d * d, d)
}

/// e^-x for x >= 0: 2^n by the exponent's bits, the rest by Taylor's polynomial of degree 7 on [-ln 2 / 2, ln 2 / 2].
///
/// Relative error below 2e-7 up to x = 87, where it stays.
#[inline(always)]
pub(super) fn exp_minus(x: f32) -> f32 {
    let x = if x < LEAST { x } else { LEAST };
    let y = x * -std::f32::consts::LOG2_E;
    let rounded = y + ROUND;
    let n = rounded - ROUND;
    let r = (-x - n * LN_2[0]) - n * LN_2[1];
    let p = 1.0
        + r * (1.0
            + r * (0.5
                + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r * (1.0 / 5040.0)))))));
    p * f32::from_bits((rounded.to_bits() << 23).wrapping_add(ONE))
}

/// e to the minus this is about the least normal number.
const LEAST: f32 = 87.0;
/// ln 2 in two parts: the first has few bits, so that a few bits times it are exact (Cody and Waite 1980).
const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
/// The bits of 1.0: its exponent.
const ONE: u32 = 127 << 23;

/// [`exp_minus`] of eight numbers.
#[inline(always)]
pub(super) fn exp_minus_of<V: Eight>(eight: V, x: F32s<V>) -> F32s<V> {
    let x = F32s::all(eight, 0.0) - x.at_most(F32s::all(eight, LEAST));
    let rounded = x.times_plus(F32s::all(eight, std::f32::consts::LOG2_E), F32s::all(eight, ROUND));
    let n = rounded - F32s::all(eight, ROUND);
    let r = n.times_plus(F32s::all(eight, -LN_2[0]), x);
    let r = n.times_plus(F32s::all(eight, -LN_2[1]), r);
    let mut p = F32s::all(eight, 1.0 / 5040.0);
    for c in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        p = p.times_plus(r, F32s::all(eight, c));
    }
    p * (rounded.bits().shl(23) + U32s::all(eight, ONE)).as_f32s()
}

/// Optical depth of an opacity: -ln(1 - alpha), capped at 88, which is what alpha = 1 gives.
#[inline(always)]
pub(super) fn depth(alpha: f32) -> f32 {
    if alpha <= 0.0 { 0.0 } else { (-(-alpha.min(1.0)).ln_1p()).min(88.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_is_right_at_every_depth() {
        for i in -120..=120 {
            let d = 10f32.powf(i as f32 / 10.0);
            let expected = brickfield_optics::alpha(f64::from(d));
            assert!((f64::from(alpha(d)) - expected).abs() <= 5e-7 * expected, "{d}");
        }
        assert_eq!((alpha(0.0), alpha(f32::INFINITY)), (0.0, 1.0));
    }

    #[test]
    fn exp_is_right_down_to_the_least_normal_number() {
        for i in 0..8700 {
            let x = i as f32 / 100.0;
            let expected = (-f64::from(x)).exp();
            assert!((f64::from(exp_minus(x)) - expected).abs() <= 2e-7 * expected, "{x}");
        }
        assert!(exp_minus(f32::INFINITY) < 1e-37);
    }

    #[test]
    fn eight_are_as_one() {
        let eight = pulp::Scalar256b;
        for first in (0..900).step_by(8) {
            let depths: [f32; 8] = std::array::from_fn(|l| (first + l as i32) as f32 / 10.0);
            let got = opacities(eight, F32s::new(eight, depths), depths[7]).to_array();
            for (got, depth) in got.into_iter().zip(depths) {
                assert!((got - alpha(depth)).abs() <= 5e-7 * alpha(depth), "{depth}");
            }
        }
    }

    #[test]
    fn depth_inverts_alpha() {
        for d in [1e-12f32, 1e-6, 0.1, 1.0, 5.0] {
            assert!((depth(alpha(d)) - d).abs() <= 1e-6 * d * d.exp(), "{d}");
        }
        assert_eq!((depth(1.0), depth(-1.0)), (88.0, 0.0));
    }
}
