//! Opacity and optical depth, stable at both ends of the range.

/// The optical depth that stands for alpha = 1: beyond it e^-depth is below the least normal f32.
pub const OPAQUE_DEPTH: f64 = 88.0;

/// Opacity of an optical depth: alpha = 1 - e^-depth, to rounding for every depth >= 0.
///
/// alpha(1e-12) = 1e-12, alpha(infinity) = 1.
#[inline]
pub fn alpha(depth: f64) -> f64 {
    -(-depth).exp_m1()
}

/// Transmittance of an optical depth: e^-depth.
#[inline]
pub fn transmittance(depth: f64) -> f64 {
    (-depth).exp()
}

/// Optical depth of an opacity, the inverse of [`alpha`]: -ln(1 - alpha), to rounding for alpha in [0, 1].
///
/// Capped at [`OPAQUE_DEPTH`], the depth of alpha = 1; alpha outside [0, 1] is clamped.
#[inline]
pub fn depth(alpha: f64) -> f64 {
    if alpha <= 0.0 {
        return 0.0;
    }
    (-(-alpha.min(1.0)).ln_1p()).min(OPAQUE_DEPTH)
}

/// The opacity of a length `ratio` times as long: 1 - (1 - alpha)^ratio.
///
/// LaMar, Hamann and Joy 1999, eq. 14, is the case ratio = 2. Digits are kept at both ends (alpha = 1e-12 and
/// 1 - 1e-7): the power is taken in optical depth.
#[inline]
pub fn rescale_alpha(alpha_in: f64, ratio: f64) -> f64 {
    if alpha_in >= 1.0 {
        return 1.0;
    }
    alpha(depth(alpha_in) * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_keeps_its_digits_at_both_ends() {
        for x in [1e-300f64, 1e-12, 1e-8, 1e-4] {
            // 1 - e^-x = x - x^2/2 + x^3/6 - ...
            let series = x - x * x / 2.0 + x * x * x / 6.0 - x.powi(4) / 24.0;
            assert!((alpha(x) - series).abs() <= 4e-15 * x, "{x}");
        }
        assert_eq!((alpha(0.0), alpha(1e12), alpha(f64::INFINITY)), (0.0, 1.0, 1.0));
    }

    #[test]
    fn depth_inverts_alpha() {
        for x in [0.0, 1e-300, 1e-12, 1e-6, 0.1, 1.0, 10.0, 30.0] {
            let relative = (depth(alpha(x)) - x).abs() / x.max(1e-300);
            // Near alpha = 1 the opacity itself holds x only to eps * e^x.
            assert!(relative <= 4.0 * f64::EPSILON * x.exp().max(1.0), "{x}: {relative:e}");
        }
        assert_eq!((depth(1.0), depth(2.0), depth(-1.0)), (OPAQUE_DEPTH, OPAQUE_DEPTH, 0.0));
    }

    #[test]
    fn rescaling_matches_lamars_equation_14() {
        for a in [1e-12, 1e-6, 0.1, 0.5, 0.9, 1.0 - 1e-7, 1.0] {
            let expected = a * (2.0 - a); // 1 - (1 - a)^2 without cancellation
            assert!((rescale_alpha(a, 2.0) - expected).abs() <= 1e-15 * expected.max(1e-12), "{a}");
        }
    }
}
