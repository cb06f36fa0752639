//! expected | actual | difference, side by side, to find the cause of a failure.

use std::io;
use std::path::Path;

use brickfield::srgb8;
use brickfield_core::{Image, LinearRgb};

const BLACK: LinearRgb = [0.0; 3];

/// Writes expected | actual | difference as one PNG: the first two over black in sRGB, the difference scaled so that its
/// greatest value is white (alpha's difference is shown as grey).
///
/// # Errors
/// Pictures of different size, folders that cannot be made, a file that cannot be written.
pub fn write_difference(path: &Path, actual: &Image<f32>, expected: &Image<f64>) -> io::Result<()> {
    let size = expected.size();
    if actual.size() != size || size.min_element() == 0 {
        return Err(io::Error::other("there is no picture of the reference's size"));
    }
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let greatest = difference_scale(actual, expected);
    let mut out = image::RgbImage::new(3 * size.x, size.y);
    for y in 0..size.y {
        for x in 0..size.x {
            let (e, a) = (expected.at(x, y), actual.at(x, y).map(f64::from));
            let d: [f64; 4] = std::array::from_fn(|c| (a[c] - e[c]).abs() / greatest);
            out.put_pixel(x, y, image::Rgb(srgb8(e.map(|v| v as f32), BLACK)));
            out.put_pixel(x + size.x, y, image::Rgb(srgb8(actual.at(x, y), BLACK)));
            out.put_pixel(
                x + 2 * size.x,
                y,
                image::Rgb([0, 1, 2].map(|c| (255.0 * d[c].max(0.5 * d[3]).min(1.0)) as u8)),
            );
        }
    }
    out.save(path).map_err(io::Error::other)
}

fn difference_scale(actual: &Image<f32>, expected: &Image<f64>) -> f64 {
    let each = actual.pixels().iter().zip(expected.pixels());
    let greatest = each.flat_map(|(a, e)| (0..4).map(move |c| (f64::from(a[c]) - e[c]).abs())).fold(0.0, f64::max);
    if greatest > 0.0 && greatest.is_finite() { greatest } else { 1.0 }
}
