//! Pictures beside and below each other.

use brickfield_core::Image;
use brickfield_core::glam::UVec2;
use palette::{LinSrgb, Srgb};

use crate::report::heat_of_share;

/// A pixel in the colour of a share of the scale of differences, linear.
pub(crate) fn heat_pixel(share: f64) -> [f32; 4] {
    let [r, g, b] = heat_of_share(share).map(|c| f32::from(c) / 255.0);
    let linear: LinSrgb<f32> = Srgb::new(r, g, b).into_linear();
    [linear.red, linear.green, linear.blue, 1.0]
}

/// Pictures of one height, side by side, a few pixels apart.
pub(crate) fn beside(images: &[Image<f32>]) -> Image<f32> {
    joined(
        images,
        |at, size| UVec2::new(at.x + size.x + GAP, 0),
        |at, size| UVec2::new(at.x + size.x, size.y.max(at.y)),
    )
}

/// Pictures of one width, from top to bottom.
pub(crate) fn stacked(images: &[Image<f32>]) -> Image<f32> {
    joined(
        images,
        |at, size| UVec2::new(0, at.y + size.y + GAP),
        |at, size| UVec2::new(size.x.max(at.x), at.y + size.y),
    )
}

/// Pixels between panels.
const GAP: u32 = 4;

fn joined(
    images: &[Image<f32>],
    next: impl Fn(UVec2, UVec2) -> UVec2,
    end: impl Fn(UVec2, UVec2) -> UVec2,
) -> Image<f32> {
    let mut corner = UVec2::ZERO;
    let corners: Vec<UVec2> = images
        .iter()
        .map(|image| {
            let own = corner;
            corner = next(own, image.size());
            own
        })
        .collect();
    let size = images.iter().zip(&corners).fold(UVec2::ZERO, |size, (image, at)| size.max(end(*at, image.size())));
    let mut out = Image::transparent(size);
    for (image, at) in images.iter().zip(corners) {
        for (y, row) in image.pixels().chunks_exact(image.size().x.max(1) as usize).enumerate() {
            let start = at.x as usize + size.x as usize * (at.y as usize + y);
            out.pixels_mut()[start..start + row.len()].copy_from_slice(row);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_lie_beside_and_below_each_other() {
        let image = |value: f32| Image::new(UVec2::new(3, 2), vec![[value; 4]; 6]).unwrap();
        let row = beside(&[image(0.25), image(0.5)]);
        assert_eq!(row.size(), UVec2::new(6 + GAP, 2));
        assert_eq!((row.pixels()[2][0], row.pixels()[3][0], row.pixels()[3 + GAP as usize][0]), (0.25, 0.0, 0.5));
        let all = stacked(&[row.clone(), row]);
        assert_eq!(all.size(), UVec2::new(6 + GAP, 4 + GAP));
        assert_eq!(all.pixels().last(), Some(&[0.5; 4]));
    }
}
