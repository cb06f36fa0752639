//! A colour bar with its scale, over a picture.

use std::convert::Infallible;

use brickfield_core::glam::UVec2;
use brickfield_core::{Image, LinearRgb, TransferFunction, ValueRange};
use embedded_graphics::mono_font::MonoTextStyle;
use embedded_graphics::mono_font::ascii::FONT_6X10;
use embedded_graphics::pixelcolor::BinaryColor;
use embedded_graphics::prelude::{Drawable, OriginDimensions, Point, Size};
use embedded_graphics::text::{Baseline, Text};
use embedded_graphics::{Pixel, draw_target::DrawTarget};

/// Pixels of a letter.
const LETTER: UVec2 = UVec2::new(6, 10);
const BAR_WIDTH: u32 = 14;
const MARGIN: u32 = 6;
/// The colour of letters and ticks, and of the panel behind them.
const INK: LinearRgb = [1.0; 3];
const PANEL: LinearRgb = [0.02; 3];
const PANEL_OPACITY: f32 = 0.75;
/// Ticks, at most, and the least distance between two of them in pixels.
const MOST_TICKS: u32 = 8;
const TICK_PIXELS: u32 = 24;

/// The picture with a bar of the colours of a range of values at its right side, and their values beside it (Wynn et al. 1999, figure 9): the
/// greatest at the top. `title` stands above: the name of the values, and their unit.
///
/// A picture too small for a bar of two ticks is returned as it is.
pub fn show_color_bar(image: &Image<f32>, colors: &TransferFunction, range: ValueRange, title: &str) -> Image<f32> {
    let size = image.size();
    let height = size.y * 3 / 5;
    let ticks = ticks(range, (height / TICK_PIXELS).min(MOST_TICKS));
    let n_letters =
        ticks.iter().map(|tick| tick.label.chars().count()).chain([title.chars().count()]).max().unwrap_or(0) as u32;
    let panel = UVec2::new(
        (BAR_WIDTH + 4 + LETTER.x * n_letters.min(24)).max(LETTER.x * title.chars().count() as u32) + 2 * MARGIN,
        height + LETTER.y + 3 * MARGIN,
    );
    if ticks.len() < 2 || panel.cmpgt(size).any() {
        return image.clone();
    }
    let mut ink = Canvas { image: image.clone() };
    let corner = UVec2::new(size.x - panel.x, (size.y - panel.y) / 2);
    ink.shade(corner, panel);
    ink.text(corner + UVec2::splat(MARGIN), title);
    let bar = corner + UVec2::new(MARGIN, LETTER.y + 2 * MARGIN);
    let row = |value: f64| ((range.max - value) / (range.max - range.min) * f64::from(height - 1)).round() as u32;
    for y in 0..height {
        let value = range.max - (range.max - range.min) * (f64::from(y) / f64::from(height - 1));
        (0..BAR_WIDTH).for_each(|x| ink.set(bar + UVec2::new(x, y), colors.at(value).color));
    }
    for tick in &ticks {
        let y = bar.y + row(tick.value);
        (BAR_WIDTH..BAR_WIDTH + 3).for_each(|x| ink.set(UVec2::new(bar.x + x, y), INK));
        ink.text(UVec2::new(bar.x + BAR_WIDTH + 5, y.saturating_sub(LETTER.y / 2)), &tick.label);
    }
    ink.image
}

struct Tick {
    value: f64,
    label: String,
}

/// Values of a range that are multiples of 1, 2 or 5 times a power of ten: as many as possible, and not more than `most`.
fn ticks(range: ValueRange, most: u32) -> Vec<Tick> {
    let width = range.max - range.min;
    if !(width > 0.0 && width.is_finite()) || most < 2 {
        return Vec::new();
    }
    let least = width / f64::from(most - 1);
    let power = 10f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .find(|step| *step >= least * 0.999)
        .unwrap_or(10.0 * power);
    let n_decimals = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
    let (first, last) = ((range.min / step).ceil() as i64, (range.max / step).floor() as i64);
    let label = |value: f64| match step {
        1e-4..1e7 => format!("{value:.n_decimals$}"),
        _ => format!("{value:.2e}"),
    };
    // -0 is 0.
    (first..=last).map(|i| i as f64 * step + 0.0).map(|value| Tick { value, label: label(value) }).collect()
}

/// A picture that letters are written on.
struct Canvas {
    image: Image<f32>,
}

impl Canvas {
    fn set(&mut self, at: UVec2, [r, g, b]: LinearRgb) {
        let width = self.image.size().x;
        if at.cmplt(self.image.size()).all() {
            self.image.pixels_mut()[(at.x + width * at.y) as usize] = [r as f32, g as f32, b as f32, 1.0];
        }
    }

    /// Darkens a rectangle.
    fn shade(&mut self, corner: UVec2, size: UVec2) {
        let width = self.image.size().x;
        let panel = PANEL.map(|c| c as f32);
        for y in corner.y..corner.y + size.y {
            let row = &mut self.image.pixels_mut()[(width * y) as usize..][corner.x as usize..][..size.x as usize];
            for pixel in row {
                let over = [panel[0], panel[1], panel[2], 1.0].map(|c| c * PANEL_OPACITY);
                *pixel = std::array::from_fn(|c| over[c] + pixel[c] * (1.0 - PANEL_OPACITY));
            }
        }
    }

    fn text(&mut self, at: UVec2, text: &str) {
        let style = MonoTextStyle::new(&FONT_6X10, BinaryColor::On);
        let position = Point::new(at.x as i32, at.y as i32);
        let Ok(_) = Text::with_baseline(text, position, style, Baseline::Top).draw(self);
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.image.size().x, self.image.size().y)
    }
}

impl DrawTarget for Canvas {
    type Color = BinaryColor;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<BinaryColor>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(at, color) in pixels {
            if let (BinaryColor::On, Ok(x), Ok(y)) = (color, u32::try_from(at.x), u32::try_from(at.y)) {
                self.set(UVec2::new(x, y), INK);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(min: f64, max: f64, most: u32) -> Vec<String> {
        ticks(ValueRange { min, max }, most).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn ticks_are_round_and_within_the_range() {
        assert_eq!(labels(-3.0, 1200.0, 8), ["0", "200", "400", "600", "800", "1000", "1200"]);
        assert_eq!(labels(-0.25, 0.25, 6), ["-0.2", "-0.1", "0.0", "0.1", "0.2"]);
        assert_eq!(labels(4.9e9, 5.1e9, 3), ["4.90e9", "5.00e9", "5.10e9"]);
        assert!(
            labels(2.0, 2.0, 8).is_empty() && labels(f64::NAN, 1.0, 8).is_empty() && labels(0.0, 1.0, 1).is_empty()
        );
    }

    #[test]
    fn the_bar_runs_from_the_greatest_value_to_the_least() {
        let knot = |value, color| brickfield_core::Knot { value, extinction: 0.0, color };
        let colors = TransferFunction::new(vec![knot(0.0, [0.0, 0.0, 1.0]), knot(10.0, [1.0, 0.0, 0.0])]).unwrap();
        let blank = Image::transparent(UVec2::new(160, 120));
        let shown = show_color_bar(&blank, &colors, ValueRange { min: 0.0, max: 10.0 }, "height in m");
        let is_pure = |p: &[f32; 4]| p[1] == 0.0 && p[3] == 1.0;
        let of = |x: usize| (0..120).map(|y| shown.pixels()[160 * y + x]).filter(is_pure).collect::<Vec<[f32; 4]>>();
        let column = (0..160).map(of).max_by_key(Vec::len).expect("160 columns");
        assert_eq!((column.len(), column[0], column[71]), (72, [1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]));
        assert!(shown.pixels().iter().filter(|p| **p == [1.0; 4]).count() > 100, "letters are written");
        let small = Image::transparent(UVec2::new(20, 20));
        assert_eq!(show_color_bar(&small, &colors, ValueRange { min: 0.0, max: 10.0 }, "m"), small);
    }
}
