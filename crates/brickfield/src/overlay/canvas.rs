//! Antialiased lines over a picture of floats.

use brickfield_core::glam::DVec2;
use brickfield_core::{Image, LinearRgb};
use tiny_skia::{LineCap, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};

/// How lines look.
pub(super) struct Ink {
    pub(super) color: LinearRgb,
    /// How much of what lies behind a line it hides where it covers a pixel.
    pub(super) opacity: f64,
    /// In pixels of a picture up to [`HEIGHT`] pixels high; more in proportion in higher ones.
    pub(super) width: f64,
}

/// Up to which height of the picture lines are no wider.
const HEIGHT: f64 = 512.0;

/// A picture, and by how much lines cover its pixels.
pub(super) struct LinePicture {
    image: Image<f32>,
    /// White; its alpha is the coverage. `None` for a picture without pixels.
    coverage: Option<Pixmap>,
}

impl LinePicture {
    pub(super) fn new(image: &Image<f32>) -> LinePicture {
        LinePicture { image: image.clone(), coverage: Pixmap::new(image.size().x, image.size().y) }
    }

    /// Lines over the picture: where several cross, only once.
    pub(super) fn stroke(&mut self, lines: &[[DVec2; 2]], ink: &Ink) {
        let (Some(coverage), Some(path)) = (&mut self.coverage, path(lines)) else { return };
        let mut white = Paint::default();
        white.set_color_rgba8(255, 255, 255, 255);
        let width = ink.width * (f64::from(self.image.size().y) / HEIGHT).max(1.0);
        // Lines that meet at a corner leave no notch there.
        let stroke = Stroke { width: width as f32, line_cap: LineCap::Round, ..Stroke::default() };
        coverage.fill(tiny_skia::Color::TRANSPARENT);
        coverage.stroke_path(&path, &white, &stroke, Transform::identity(), None);
        for (pixel, covered) in self.image.pixels_mut().iter_mut().zip(coverage.pixels()) {
            if covered.alpha() > 0 {
                over(pixel, ink, f64::from(covered.alpha()) / 255.0);
            }
        }
    }

    pub(super) fn into_image(self) -> Image<f32> {
        self.image
    }
}

fn path(lines: &[[DVec2; 2]]) -> Option<Path> {
    let mut path = PathBuilder::new();
    for [from, to] in lines {
        path.move_to(from.x as f32, from.y as f32);
        path.line_to(to.x as f32, to.y as f32);
    }
    path.finish()
}

/// The ink over a pixel, both linear and premultiplied.
fn over(pixel: &mut [f32; 4], ink: &Ink, coverage: f64) {
    let alpha = coverage * ink.opacity;
    let [r, g, b] = ink.color;
    for (channel, of_ink) in pixel.iter_mut().zip([r, g, b, 1.0]) {
        *channel = (alpha * of_ink + (1.0 - alpha) * f64::from(*channel)) as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::UVec2;

    const BLACK: Ink = Ink { color: [0.0; 3], opacity: 1.0, width: 1.0 };

    fn drawn(lines: &[[DVec2; 2]], ink: &Ink) -> Image<f32> {
        let mut canvas = LinePicture::new(&Image::new(UVec2::new(9, 7), vec![[0.5, 0.25, 0.0, 0.5]; 63]).unwrap());
        canvas.stroke(lines, ink);
        canvas.into_image()
    }

    #[test]
    fn a_line_through_the_centres_of_a_row_covers_that_row() {
        let image = drawn(&[[DVec2::new(0.0, 3.5), DVec2::new(9.0, 3.5)]], &BLACK);
        for (x, y) in (0..7).flat_map(|y| (1..8).map(move |x| (x, y))) {
            assert_eq!(image.at(x, y), if y == 3 { [0.0, 0.0, 0.0, 1.0] } else { [0.5, 0.25, 0.0, 0.5] }, "{x} {y}");
        }
    }

    #[test]
    fn what_covers_half_of_a_pixel_hides_half_in_linear_light() {
        let ink = Ink { color: [1.0, 0.5, 0.0], opacity: 0.5, width: 1.0 };
        let image = drawn(&[[DVec2::new(4.5, 0.0), DVec2::new(4.5, 7.0)]], &ink);
        assert_eq!(image.at(4, 3), [0.75, 0.375, 0.0, 0.75]);
    }

    #[test]
    fn crossing_lines_of_any_direction_are_no_gap_and_no_denser() {
        for width in [1.0, 3.0] {
            let ink = Ink { opacity: 0.5, width, ..BLACK };
            let (left, right) = (DVec2::new(0.0, 3.5), DVec2::new(9.0, 3.5));
            let (top, bottom) = (DVec2::new(4.5, 0.0), DVec2::new(4.5, 7.0));
            for lines in [[[left, right], [top, bottom]], [[right, left], [top, bottom]]] {
                assert_eq!(drawn(&lines, &ink).at(4, 3), [0.25, 0.125, 0.0, 0.75], "{width}");
            }
        }
    }
}
