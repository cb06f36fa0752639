//! How far a picture is from the answer.
//!
//! All four channels count, alpha included, and every pixel. A picture that is not finite has no error: it is refused,
//! since a maximum over NaN would quietly leave it out.

use brickfield_core::glam::UVec2;
use brickfield_core::{Image, LinearRgb};
use brickfield_optics::{ColorDifferences, ColorMetric};

/// How far a picture is from a reference, over all pixels and four channels (linear, premultiplied).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Root of the mean squared difference over pixels and channels.
    pub rmse: f64,
    /// Greatest absolute difference, and where.
    pub worst: Worst,
    /// 99.9 % of the pixels differ by at most this much in every channel.
    pub p999: f64,
}

/// The greatest difference, and where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// Column and row.
    pub pixel: UVec2,
    /// 0 to 3: red, green, blue, alpha.
    pub channel: usize,
    /// Absolute difference.
    pub difference: f64,
}

/// Why two pictures cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum MetricError {
    #[error("a picture of {} x {} pixels cannot be held against one of {} x {}", image.x, image.y, reference.x, reference.y)]
    Size { image: UVec2, reference: UVec2 },
    #[error("pictures of {} x {} pixels: there is nothing to compare", size.x, size.y)]
    Empty { size: UVec2 },
    #[error("the {which} is {value} in channel {channel} of pixel ({}, {})", pixel.x, pixel.y)]
    NotFinite { which: &'static str, pixel: UVec2, channel: usize, value: f64 },
}

/// How far `image` is from `reference`.
///
/// # Errors
/// Sizes that differ, no pixel at all, a channel of either picture that is not finite.
pub fn errors(image: &Image<f32>, reference: &Image<f64>) -> Result<Errors, MetricError> {
    let worst = worst_channels(image, reference)?;
    let squares: f64 = pairs(image, reference).flat_map(differences).map(|d| d * d).sum();
    let greatest = worst.iter().copied().enumerate().fold((0, (0, -1.0)), |a, b| if b.1.1 > a.1.1 { b } else { a });
    let (i, (channel, difference)) = greatest;
    let by_pixel: Vec<f64> = worst.iter().map(|w| w.1).collect();
    Ok(Errors {
        rmse: (squares / (4 * worst.len()) as f64).sqrt(),
        worst: Worst { pixel: pixel(image.size(), i), channel, difference },
        p999: quantile(by_pixel, 0.999),
    })
}

/// How far `image` is from `reference` in the three colour channels; both are [`opaque`].
///
/// # Errors
/// As [`errors`].
pub fn color_errors(image: &Image<f32>, reference: &Image<f64>) -> Result<Errors, MetricError> {
    let e = errors(image, reference)?;
    // The fourth channel is equal.
    Ok(Errors { rmse: e.rmse * (4.0f64 / 3.0).sqrt(), ..e })
}

/// A picture over black.
pub fn opaque<T: Copy + Default + From<f32>>(image: &Image<T>) -> Image<T> {
    let mut over_black = image.clone();
    over_black.pixels_mut().iter_mut().for_each(|pixel| pixel[3] = 1.0f32.into());
    over_black
}

/// The share of pixels, 0 to 1, that differ by at most `bound` in every channel.
///
/// # Errors
/// As [`errors`].
pub fn share_within(image: &Image<f32>, reference: &Image<f64>, bound: f64) -> Result<f64, MetricError> {
    let worst = worst_channels(image, reference)?;
    Ok(worst.iter().filter(|w| w.1 <= bound).count() as f64 / worst.len() as f64)
}

/// The colour difference (CIE 1976 L*u*v*) of two pictures over an opaque background, linear RGB.
///
/// # Errors
/// As [`errors`].
pub fn delta_e(
    image: &Image<f32>,
    reference: &Image<f64>,
    background: LinearRgb,
) -> Result<ColorDifferences, MetricError> {
    worst_channels(image, reference)?;
    let image = image.map(f64::from);
    let summary = ColorMetric::CieLuv1976.of_pictures(image.pixels(), reference.pixels(), background);
    Ok(summary.expect("pictures of one size have as many pixels"))
}

/// The least of `values` that a share `q` (0 to 1) of them does not exceed; no interpolation.
///
/// # Panics
/// If there are no values.
pub fn quantile(mut values: Vec<f64>, q: f64) -> f64 {
    let rank = ((values.len() as f64 * q).ceil() as usize).clamp(1, values.len()) - 1;
    *values.select_nth_unstable_by(rank, f64::total_cmp).1
}

/// The middle of `values`; the mean of the two in the middle if their number is even.
///
/// # Panics
/// If there are no values.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let n = values.len();
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}

/// Channel and size of each pixel's greatest difference.
fn worst_channels(image: &Image<f32>, reference: &Image<f64>) -> Result<Vec<(usize, f64)>, MetricError> {
    let size = image.size();
    if size != reference.size() {
        return Err(MetricError::Size { image: size, reference: reference.size() });
    }
    if image.pixels().is_empty() {
        return Err(MetricError::Empty { size });
    }
    check_finite("picture", size, image.pixels().iter().map(|p| p.map(f64::from)))?;
    check_finite("reference", size, reference.pixels().iter().copied())?;
    Ok(pairs(image, reference).map(|pair| greatest(differences(pair))).collect())
}

fn check_finite(which: &'static str, size: UVec2, pixels: impl Iterator<Item = [f64; 4]>) -> Result<(), MetricError> {
    for (i, p) in pixels.enumerate() {
        if let Some(channel) = p.iter().position(|v| !v.is_finite()) {
            return Err(MetricError::NotFinite { which, pixel: pixel(size, i), channel, value: p[channel] });
        }
    }
    Ok(())
}

fn pairs<'a>(image: &'a Image<f32>, reference: &'a Image<f64>) -> impl Iterator<Item = ([f64; 4], [f64; 4])> + 'a {
    image.pixels().iter().map(|p| p.map(f64::from)).zip(reference.pixels().iter().copied())
}

fn differences((a, b): ([f64; 4], [f64; 4])) -> [f64; 4] {
    std::array::from_fn(|c| (a[c] - b[c]).abs())
}

fn greatest(d: [f64; 4]) -> (usize, f64) {
    (1..4).fold((0, d[0]), |g, c| if d[c] > g.1 { (c, d[c]) } else { g })
}

fn pixel(size: UVec2, i: usize) -> UVec2 {
    UVec2::new(i as u32 % size.x, i as u32 / size.x)
}

/// The greatest difference of a channel between two pictures of one size; NaN if there is one.
pub fn greatest_difference(a: &Image<f32>, b: &Image<f32>) -> f64 {
    let channels = a.pixels().iter().flatten().zip(b.pixels().iter().flatten());
    let differences = channels.map(|(a, b)| f64::from((a - b).abs()));
    differences.fold(0.0, |most: f64, d| if d > most || d.is_nan() { d } else { most })
}

/// The share of pixels of which a channel differs by more than a bound, in two pictures of one size.
pub fn share_beyond(a: &Image<f32>, b: &Image<f32>, bound: f64) -> f64 {
    let differs = |(a, b): (&[f32; 4], &[f32; 4])| (0..4).any(|c| f64::from((a[c] - b[c]).abs()) > bound);
    a.pixels().iter().zip(b.pixels()).filter(|pair| differs(*pair)).count() as f64 / a.pixels().len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: UVec2 = UVec2::new(50, 40);
    const GREY: LinearRgb = [0.2; 3];

    fn reference() -> Image<f64> {
        let pixel = |i: usize| {
            let a = i as f64 / 2000.0;
            [0.9 * a, 0.5 * a, 0.1 * a, a]
        };
        Image::new(SIZE, (0..2000).map(pixel).collect()).unwrap()
    }

    /// The reference, with `by` added to one channel of one pixel.
    fn changed(at: UVec2, channel: usize, by: f64) -> Image<f32> {
        let mut r = reference();
        r.pixels_mut()[(at.y * SIZE.x + at.x) as usize][channel] += by;
        r.map(|v| v as f32)
    }

    #[test]
    fn errors_of_colors_are_means_over_three_channels() {
        for channel in 0..3 {
            let image = changed(UVec2::new(7, 31), channel, 0.25);
            let e = color_errors(&opaque(&image), &opaque(&reference())).unwrap();
            assert!((e.rmse - 0.25 / 6000.0f64.sqrt()).abs() < 1e-7, "{channel}: {}", e.rmse);
        }
        let image = changed(UVec2::new(7, 31), 3, 0.25);
        assert!(color_errors(&opaque(&image), &opaque(&reference())).unwrap().rmse < 1e-7);
    }

    #[test]
    fn every_channel_counts_alpha_included() {
        for channel in 0..4 {
            let e = errors(&changed(UVec2::new(7, 31), channel, 0.25), &reference()).unwrap();
            assert!((e.worst.difference - 0.25).abs() < 1e-7);
            assert_eq!((e.worst.pixel, e.worst.channel), (UVec2::new(7, 31), channel));
            assert!((e.rmse - 0.25 / 8000f64.sqrt()).abs() < 1e-7);
        }
    }

    #[test]
    fn over_black_three_channels_count_and_alpha_does_not() {
        let at = UVec2::new(7, 31);
        let of = |image| color_errors(&opaque(&image), &opaque(&reference())).unwrap();
        assert!(of(changed(at, 3, 0.25)).worst.difference < 1e-7);
        for channel in 0..3 {
            let e = of(changed(at, channel, 0.25));
            assert!((e.rmse - 0.25 / 6000f64.sqrt()).abs() < 1e-7 && (e.worst.difference - 0.25).abs() < 1e-7);
        }
    }

    #[test]
    fn equal_pictures_have_no_error_and_others_have() {
        let exact = reference().map(|v| f64::from(v as f32));
        let image = exact.map(|v| v as f32);
        let e = errors(&image, &exact).unwrap();
        assert_eq!((e.rmse, e.worst.difference, e.p999), (0.0, 0.0, 0.0));
        assert_eq!(share_within(&image, &exact, 0.0).unwrap(), 1.0);
        let none = ColorDifferences { mean: 0.0, percentile_95: 0.0, max: 0.0 };
        assert_eq!(delta_e(&image, &exact, GREY).unwrap(), none);
        let off = image.map(|v| v + 0.01);
        assert!((errors(&off, &exact).unwrap().rmse - 0.01).abs() < 1e-6);
        assert!(delta_e(&off, &exact, GREY).unwrap().mean > 0.1);
    }

    #[test]
    fn the_share_of_pixels_within_a_bound_counts_pixels() {
        let image = changed(UVec2::new(0, 0), 3, 0.5);
        assert_eq!(share_within(&image, &reference(), 1e-6).unwrap(), 1999.0 / 2000.0);
        // One pixel in 2000 is beyond the 99.9th percentile, three are not.
        assert!(errors(&image, &reference()).unwrap().p999 < 1e-6);
        let mut image = image;
        for i in [5, 9] {
            image.pixels_mut()[i][0] += 0.5;
        }
        assert!(errors(&image, &reference()).unwrap().p999 > 0.4);
    }

    #[test]
    fn a_transparent_picture_over_the_background_is_the_background() {
        let opaque = Image::new(UVec2::ONE, vec![[0.2, 0.2, 0.2, 1.0]]).unwrap();
        let clear = Image::<f64>::transparent(UVec2::ONE);
        assert!(delta_e(&opaque, &clear, GREY).unwrap().max < 1e-4);
        assert!(delta_e(&opaque, &clear, [1.0; 3]).unwrap().max > 30.0);
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let small = Image::<f32>::transparent(UVec2::new(40, 50));
        let text = errors(&small, &reference()).unwrap_err().to_string();
        assert_eq!(text, "a picture of 40 x 50 pixels cannot be held against one of 50 x 40");
        let empty = (Image::transparent(UVec2::ZERO), Image::transparent(UVec2::ZERO));
        assert!(matches!(errors(&empty.0, &empty.1), Err(MetricError::Empty { .. })));
        for bad in [f64::NAN, f64::INFINITY] {
            let image = changed(UVec2::new(3, 4), 3, bad);
            for result in [errors(&image, &reference()).err(), delta_e(&image, &reference(), GREY).err()] {
                let Some(MetricError::NotFinite { which: "picture", pixel, channel: 3, .. }) = result else {
                    panic!("{result:?}")
                };
                assert_eq!(pixel, UVec2::new(3, 4));
            }
        }
        let bad_reference = reference().map(|_| f64::NAN);
        assert!(share_within(&changed(UVec2::ZERO, 0, 0.0), &bad_reference, 1.0).is_err());
    }

    #[test]
    fn medians_and_quantiles() {
        assert_eq!((median(vec![3.0, 1.0, 2.0]), median(vec![4.0, 1.0, 2.0, 3.0])), (2.0, 2.5));
        let values: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(
            (quantile(values.clone(), 0.95), quantile(values.clone(), 1.0), quantile(values, 0.0)),
            (95.0, 100.0, 1.0)
        );
    }

    #[test]
    fn the_greatest_difference_does_not_pass_over_nan() {
        let image = |values: [f32; 2]| Image::new(UVec2::new(2, 1), values.map(|v| [v; 4]).to_vec()).unwrap();
        assert_eq!(greatest_difference(&image([1.0, 2.0]), &image([1.5, 2.0])), 0.5);
        assert!(greatest_difference(&image([f32::NAN, 2.0]), &image([1.5, 9.0])).is_nan());
    }
}
