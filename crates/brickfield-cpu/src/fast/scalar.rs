//! Scalar functions in f32.

/// Opacity of an optical depth, 1 - e^-depth: the Taylor polynomial below 1/4, exp above.
///
/// Relative error below 5e-7, largest where exp takes over.
#[inline(always)]
pub(super) fn alpha(depth: f32) -> f32 {
    if depth < THIN { alpha_thin(depth) } else { 1.0 - exp_minus(depth) }
}

/// Depths below this have their opacity from a polynomial.
pub(super) const THIN: f32 = 0.25;

/// Taylor's polynomial of degree 7; the first term left out is depth^8 / 40320.
#[inline(always)]
pub(super) fn alpha_thin(d: f32) -> f32 {
    const C: [f32; 6] = [-1.0 / 2.0, 1.0 / 6.0, -1.0 / 24.0, 1.0 / 120.0, -1.0 / 720.0, 1.0 / 5040.0];
    d + d * d * (C[0] + d * (C[1] + d * (C[2] + d * (C[3] + d * (C[4] + d * C[5])))))
}

/// e^-x for x >= 0: 2^n by the exponent's bits, the rest by Taylor's polynomial of degree 7 on [-ln 2 / 2, ln 2 / 2].
///
/// Relative error below 2e-7 up to x = 87, where it stays.
#[inline(always)]
pub(super) fn exp_minus(x: f32) -> f32 {
    /// Adding this rounds to an integer, which the low bits then hold.
    const ROUND: f32 = 12_582_912.0;
    let x = if x < 87.0 { x } else { 87.0 };
    let y = x * -std::f32::consts::LOG2_E;
    let rounded = y + ROUND;
    let n = rounded - ROUND;
    // ln 2 in two parts: the first has few bits, so that n times it is exact (Cody and Waite 1980).
    let r = (-x - n * 0.693_359_4) + n * 2.121_944_4e-4;
    let p = 1.0
        + r * (1.0
            + r * (0.5
                + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r * (1.0 / 5040.0)))))));
    p * f32::from_bits((rounded.to_bits() << 23).wrapping_add(127 << 23))
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
    fn depth_inverts_alpha() {
        for d in [1e-12f32, 1e-6, 0.1, 1.0, 5.0] {
            assert!((depth(alpha(d)) - d).abs() <= 1e-6 * d * d.exp(), "{d}");
        }
        assert_eq!((depth(1.0), depth(-1.0)), (88.0, 0.0));
    }
}
