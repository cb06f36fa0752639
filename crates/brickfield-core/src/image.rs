//! Linear, premultiplied RGBA images.

use glam::UVec2;

/// A linear, premultiplied RGBA image; row 0 is the top, x varies fastest.
///
/// Backends return `Image<f32>`, references `Image<f64>`.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T = f32> {
    size: UVec2,
    pixels: Vec<[T; 4]>,
}

/// Pixels that do not fill an image of the stated size.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{n_pixels} pixels do not fill an image of {} x {}", size.x, size.y)]
#[allow(missing_docs)]
pub struct ImageSizeError {
    pub size: UVec2,
    pub n_pixels: usize,
}

impl<T: Copy + Default> Image<T> {
    /// An image from its pixels, rows from the top.
    ///
    /// # Errors
    /// If there are not exactly width x height pixels.
    pub fn new(size: UVec2, pixels: Vec<[T; 4]>) -> Result<Self, ImageSizeError> {
        if size.x as usize * size.y as usize != pixels.len() {
            return Err(ImageSizeError { size, n_pixels: pixels.len() });
        }
        Ok(Image { size, pixels })
    }

    /// A fully transparent image.
    pub fn transparent(size: UVec2) -> Self {
        Image { size, pixels: vec![[T::default(); 4]; size.x as usize * size.y as usize] }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// All pixels, rows from the top.
    pub fn pixels(&self) -> &[[T; 4]] {
        &self.pixels
    }

    /// All pixels, rows from the top.
    pub fn pixels_mut(&mut self) -> &mut [[T; 4]] {
        &mut self.pixels
    }

    /// The pixel in column `x` and row `y`.
    ///
    /// # Panics
    /// If (x, y) lies outside.
    pub fn at(&self, x: u32, y: u32) -> [T; 4] {
        assert!(x < self.size.x, "column {x} of an image {} wide", self.size.x);
        self.pixels[y as usize * self.size.x as usize + x as usize]
    }

    /// The image with every channel mapped.
    pub fn map<U: Copy + Default>(&self, f: impl Fn(T) -> U) -> Image<U> {
        Image { size: self.size, pixels: self.pixels.iter().map(|p| p.map(&f)).collect() }
    }
}
