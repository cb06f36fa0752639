//! From stored samples to red, green and blue: planes apart, luma with chroma (PS3.3, C.7.6.3.1.2).

use brickfield_core::{Scalar, Voxels, with_voxels};

use super::image::{Colour, Image, Planes};
use super::source::Codec;
use crate::ReadError;
use crate::numbers::with_room;

/// Red, green and blue of each pixel, side by side, of a frame's stored samples.
pub(super) fn interleaved_rgb(samples: Voxels, image: &Image) -> Result<Voxels, ReadError> {
    // Codecs leave samples side by side; that of JPEG turns luma and chroma to RGB, too.
    let is_plain = image.codec == Codec::None;
    let order = match &image.colour {
        Colour::Palette(palette) => return palette.colours(&samples),
        Colour::Ybr422 if is_plain => Order::Paired,
        _ if is_plain && image.planes == Planes::Separate => Order::Separate,
        _ => Order::SideBySide,
    };
    let is_ybr = image.codec != Codec::Jpeg && matches!(image.colour, Colour::Ybr | Colour::Ybr422);
    match (order, is_ybr) {
        (Order::SideBySide, false) => Ok(samples),
        _ => with_voxels!(samples, v => rearranged(&v, image, order, is_ybr)),
    }
}

/// Where the three samples of a pixel lie.
#[derive(Clone, Copy)]
enum Order {
    SideBySide,
    Separate,
    /// Luma of two pixels, then the chroma that they share.
    Paired,
}

fn rearranged<T: Scalar>(stored: &[T], image: &Image, order: Order, is_ybr: bool) -> Result<Voxels, ReadError> {
    let (n_pixels, columns) = (image.n_pixels() as usize, image.columns as usize);
    let mut rgb = with_room::<T>(3 * n_pixels)?;
    for i in 0..n_pixels {
        let pixel = match order {
            Order::SideBySide => [3 * i, 3 * i + 1, 3 * i + 2],
            Order::Separate => [i, n_pixels + i, 2 * n_pixels + i],
            Order::Paired => {
                let (row, column) = (i / columns, i % columns);
                let pair = row * columns.next_multiple_of(2) * 2 + column / 2 * 4;
                [pair + column % 2, pair + 2, pair + 3]
            }
        };
        let pixel = pixel.map(|at| stored[at]);
        match is_ybr {
            true => rgb.extend(rgb_of_ybr(pixel.map(T::to_f64), image.bits.n_stored).map(T::from_f64)),
            false => rgb.extend(pixel),
        }
    }
    Ok(T::wrap(rgb))
}

/// Red, green and blue of luma and chroma, all of `n_bits` (ITU-R BT.601, full range).
fn rgb_of_ybr([luma, blue, red]: [f64; 3], n_bits: u32) -> [f64; 3] {
    let (max, middle) = ((1u64 << n_bits) as f64 - 1.0, (1u64 << (n_bits - 1)) as f64);
    let (blue, red) = (blue - middle, red - middle);
    let rgb = [luma + 1.402 * red, luma - 0.344_136 * blue - 0.714_136 * red, luma + 1.772 * blue];
    rgb.map(|v| v.round().clamp(0.0, max))
}
