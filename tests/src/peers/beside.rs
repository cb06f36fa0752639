//! How far a picture lies beside its answer. The errors of a volume half a voxel off, or of pixels sampled at their corners, are no
//! larger than the errors of a steep transfer function, but small steps do not lower them.

use brickfield::core::Image;
use brickfield::core::glam::{DMat2, DVec2};
use serde::Serialize;

/// A shift that explains a part of a picture's error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Beside {
    /// To the right and downwards.
    pub pixels: [f64; 2],
    /// Of the sum of squared differences: 1 if the picture is the answer, shifted by a little.
    pub share: f64,
}

impl Beside {
    /// The length of the shift in pixels.
    pub fn length(&self) -> f64 {
        DVec2::from(self.pixels).length()
    }
}

/// With the answer's gradient g, a picture that is shifted differs by about -g * shift: the shift by least squares over the inner
/// pixels and three colour channels. One of several pixels is underestimated. 0 where the answer has no edges.
pub(super) fn beside(image: &Image<f32>, answer: &Image<f64>) -> Beside {
    let (mut squares, mut products, mut all) = (DMat2::ZERO, DVec2::ZERO, 0.0);
    let size = answer.size();
    for y in 1..size.y.saturating_sub(1) {
        for x in 1..size.x.saturating_sub(1) {
            let (right, left) = (answer.at(x + 1, y), answer.at(x - 1, y));
            let (below, above) = (answer.at(x, y + 1), answer.at(x, y - 1));
            let (found, expected) = (image.at(x, y), answer.at(x, y));
            for c in 0..3 {
                let gradient = 0.5 * DVec2::new(right[c] - left[c], below[c] - above[c]);
                squares += DMat2::from_cols(gradient * gradient.x, gradient * gradient.y);
                let difference = f64::from(found[c]) - expected[c];
                products -= gradient * difference;
                all += difference * difference;
            }
        }
    }
    let trace = squares.x_axis.x + squares.y_axis.y;
    if squares.determinant() <= 1e-9 * trace * trace || all == 0.0 {
        return Beside::default();
    }
    let shift = squares.inverse() * products;
    Beside { pixels: shift.to_array(), share: shift.dot(products) / all }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield::core::glam::UVec2;

    /// A bump whose centre lies at `at`.
    fn picture(at: DVec2) -> Image<f64> {
        let size = UVec2::new(40, 30);
        let value = |x: u32, y: u32| {
            let from = DVec2::new(f64::from(x), f64::from(y)) - at;
            let bump = (-from.length_squared() / 50.0).exp();
            [bump, 0.5 * bump, 0.0, 1.0]
        };
        let pixels = (0..size.y).flat_map(|y| (0..size.x).map(move |x| value(x, y))).collect();
        Image::new(size, pixels).unwrap()
    }

    #[test]
    fn peers_pictures_are_found_where_they_lie() {
        let answer = picture(DVec2::new(19.0, 14.0));
        let found = |at: DVec2| beside(&picture(at).map(|v| v as f32), &answer);
        let shifted = found(DVec2::new(19.5, 13.75));
        assert!(
            DVec2::from(shifted.pixels).distance(DVec2::new(0.5, -0.25)) < 0.02 && shifted.share > 0.95,
            "{shifted:?}"
        );
        // The answer itself; one that is too bright, or shows nothing; and an answer without edges.
        assert!(found(DVec2::new(19.0, 14.0)).length() < 1e-6);
        for gain in [1.2, 0.0] {
            let found = beside(&answer.map(|v| gain * v as f32), &answer);
            assert!(found.length() < 1e-2 && found.share < 1e-3, "{found:?}");
        }
        assert_eq!(beside(&answer.map(|v| v as f32), &answer.map(|_| 0.5)), Beside::default());
    }
}
