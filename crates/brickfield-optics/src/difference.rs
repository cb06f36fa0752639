//! Colour difference of pictures as a person sees them over a background.
//!
//! Pixels are linear premultiplied RGBA. Each is put over a stated background, read as sRGB primaries with white D65, and
//! not clamped: a picture brighter than white stays different from white.

use brickfield_core::LinearRgb;
use palette::color_difference::Ciede2000;
use palette::white_point::D65;
use palette::{FromColor, Lab, LinSrgb, Luv};

/// A measure of the difference of two colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ColorMetric {
    /// CIELUV, Delta E*uv: the distance in L*, u*, v* (CIE 1976). About 1 is just noticeable.
    CieLuv1976,
    /// CIEDE2000, Delta E*00: better for small differences of saturated colours (CIE 142-2001).
    Ciede2000,
}

/// Colour differences over all pixels of two pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorDifferences {
    /// The mean; 0 for pictures without pixels.
    pub mean: f64,
    /// The 95th percentile: the least difference that is not below the differences of 95 % of the pixels (nearest rank).
    pub percentile_95: f64,
    /// The greatest difference.
    pub max: f64,
}

/// Pictures that cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("pictures of {left} and {right} pixels cannot be compared")]
#[allow(missing_docs)]
pub struct PixelCountError {
    pub left: usize,
    pub right: usize,
}

impl ColorMetric {
    /// The difference of two opaque colours, linear RGB.
    pub fn of_colors(self, left: LinearRgb, right: LinearRgb) -> f64 {
        match self {
            ColorMetric::CieLuv1976 => luv_distance(left, right),
            ColorMetric::Ciede2000 => lab(left).difference(lab(right)),
        }
    }

    /// The difference of two pixels, linear premultiplied RGBA, over a background.
    ///
    /// NaN if a pixel holds one.
    pub fn of_pixels(self, left: [f64; 4], right: [f64; 4], background: LinearRgb) -> f64 {
        self.of_colors(over(left, background), over(right, background))
    }

    /// Mean, 95th percentile and maximum of the differences of two pictures, pixel by pixel.
    ///
    /// A NaN in a picture makes mean and maximum NaN. O(n) time and 8 bytes a pixel.
    ///
    /// # Errors
    /// The pictures differ in their number of pixels.
    pub fn of_pictures<T: Copy + Into<f64>>(
        self,
        left: &[[T; 4]],
        right: &[[T; 4]],
        background: LinearRgb,
    ) -> Result<ColorDifferences, PixelCountError> {
        if left.len() != right.len() {
            return Err(PixelCountError { left: left.len(), right: right.len() });
        }
        let pairs = left.iter().zip(right);
        Ok(summary(pairs.map(|(a, b)| self.of_pixels(a.map(Into::into), b.map(Into::into), background)).collect()))
    }
}

/// A premultiplied pixel over an opaque background.
fn over([r, g, b, a]: [f64; 4], background: LinearRgb) -> LinearRgb {
    let rest = 1.0 - a;
    [r + rest * background[0], g + rest * background[1], b + rest * background[2]]
}

fn summary(mut differences: Vec<f64>) -> ColorDifferences {
    let n = differences.len();
    if n == 0 {
        return ColorDifferences { mean: 0.0, percentile_95: 0.0, max: 0.0 };
    }
    let mean = differences.iter().sum::<f64>() / n as f64;
    let max = differences.iter().copied().max_by(f64::total_cmp).unwrap_or(0.0);
    let rank = (n * 95).div_ceil(100) - 1;
    let (_, percentile_95, _) = differences.select_nth_unstable_by(rank, f64::total_cmp);
    ColorDifferences { mean, percentile_95: *percentile_95, max }
}

/// L*, u*, v* (CIE 1976) of an opaque colour, linear RGB: the distance of two is [`ColorMetric::CieLuv1976`].
pub fn cie_luv(color: LinearRgb) -> [f64; 3] {
    let Luv { l, u, v, .. } = luv(color);
    [l, u, v]
}

fn luv_distance(left: LinearRgb, right: LinearRgb) -> f64 {
    let (a, b) = (luv(left), luv(right));
    (a.l - b.l).hypot(a.u - b.u).hypot(a.v - b.v)
}

fn luv([r, g, b]: LinearRgb) -> Luv<D65, f64> {
    Luv::from_color(LinSrgb::new(r, g, b))
}

fn lab([r, g, b]: LinearRgb) -> Lab<D65, f64> {
    Lab::from_color(LinSrgb::new(r, g, b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const METRICS: [ColorMetric; 2] = [ColorMetric::CieLuv1976, ColorMetric::Ciede2000];
    const BLACK: LinearRgb = [0.0; 3];
    const WHITE: LinearRgb = [1.0; 3];

    /// CIE 1976 L*u*v* of linear sRGB from the equations, with the matrix of IEC 61966-2-1 to four digits.
    fn luv_by_hand([r, g, b]: LinearRgb) -> [f64; 3] {
        let x = 0.4124 * r + 0.3576 * g + 0.1805 * b;
        let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        let z = 0.0193 * r + 0.1192 * g + 0.9505 * b;
        let prime = |x: f64, y: f64, z: f64| [4.0 * x / (x + 15.0 * y + 3.0 * z), 9.0 * y / (x + 15.0 * y + 3.0 * z)];
        let white = prime(0.950_47, 1.0, 1.088_83);
        let cube = (6.0f64 / 29.0).powi(3);
        let l = if y > cube { 116.0 * y.cbrt() - 16.0 } else { y * (29.0f64 / 3.0).powi(3) };
        let [u, v] = prime(x, y, z);
        [l, 13.0 * l * (u - white[0]), 13.0 * l * (v - white[1])]
    }

    #[test]
    fn black_and_white_are_100_apart() {
        for metric in METRICS {
            assert!((metric.of_colors(BLACK, WHITE) - 100.0).abs() < 0.01, "{metric:?}");
            assert_eq!(metric.of_colors(BLACK, BLACK), 0.0);
        }
    }

    #[test]
    fn pixels_are_seen_over_the_background() {
        let (clear, half) = ([0.0; 4], [0.5, 0.5, 0.5, 0.5]);
        for metric in METRICS {
            assert_eq!(metric.of_pixels(clear, half, WHITE), 0.0, "white over white");
            let expected = metric.of_colors(BLACK, [0.5; 3]);
            assert_eq!(metric.of_pixels(clear, half, BLACK), expected);
        }
    }

    #[test]
    fn pictures_are_summed_up() {
        let left = vec![[0.0f32; 4]; 100];
        let mut right = left.clone();
        right[..6].fill([1.0; 4]);
        let d = ColorMetric::CieLuv1976.of_pictures(&left, &right, BLACK).unwrap();
        assert!((d.mean - 6.0).abs() < 1e-3 && (d.percentile_95 - 100.0).abs() < 1e-2 && d.max >= d.percentile_95);
        right[5] = [0.0; 4];
        assert_eq!(ColorMetric::CieLuv1976.of_pictures(&left, &right, BLACK).unwrap().percentile_95, 0.0);
        assert!(ColorMetric::CieLuv1976.of_pictures(&left, &right[1..], BLACK).is_err());
        right[0][0] = f32::NAN;
        assert!(ColorMetric::CieLuv1976.of_pictures(&left, &right, BLACK).unwrap().mean.is_nan());
    }

    proptest! {
        #[test]
        fn luv_is_the_equations(a in prop::array::uniform3(0.001..1.0f64), b in prop::array::uniform3(0.001..1.0f64)) {
            let (x, y) = (luv_by_hand(a), luv_by_hand(b));
            let expected = (x[0] - y[0]).hypot(x[1] - y[1]).hypot(x[2] - y[2]);
            let found = ColorMetric::CieLuv1976.of_colors(a, b);
            let [p, q] = [cie_luv(a), cie_luv(b)];
            prop_assert!(((p[0] - q[0]).hypot(p[1] - q[1]).hypot(p[2] - q[2]) - found).abs() < 1e-9);
            prop_assert!((found - expected).abs() < 0.1 + 1e-3 * expected, "{found} {expected}");
        }

        #[test]
        fn a_difference_is_symmetric_and_0_for_equals(a in prop::array::uniform3(0.0..1.0f64), b in prop::array::uniform3(0.0..1.0f64)) {
            for metric in METRICS {
                prop_assert_eq!(metric.of_colors(a, a), 0.0);
                let (there, back) = (metric.of_colors(a, b), metric.of_colors(b, a));
                prop_assert!(there >= 0.0 && (there - back).abs() <= 1e-9 * there);
            }
        }
    }
}
