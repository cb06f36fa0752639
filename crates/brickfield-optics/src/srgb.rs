//! sRGB (IEC 61966-2-1) hex colours to linear RGB and back.

use brickfield_core::LinearRgb;
use palette::{LinSrgb, Srgb};

/// Linear RGB of 0xRRGGBB in sRGB.
pub(crate) fn linear_of_hex(hex: u32) -> LinearRgb {
    let bytes = [hex >> 16, hex >> 8, hex].map(|c| f64::from(c & 0xff) / 255.0);
    let linear: LinSrgb<f64> = Srgb::new(bytes[0], bytes[1], bytes[2]).into_linear();
    [linear.red, linear.green, linear.blue].map(|c| c.clamp(0.0, 1.0))
}

/// Linear RGB of `#RRGGBB`.
#[cfg(any(feature = "files", test))]
pub(crate) fn linear_of_text(text: &str) -> Option<LinearRgb> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
    u32::from_str_radix(digits, 16).ok().map(linear_of_hex)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hex_is_decoded() {
        assert_eq!(linear_of_text("#ff0000"), Some([1.0, 0.0, 0.0]));
        // (0x80 / 255 + 0.055) / 1.055 to the power 2.4
        assert!((linear_of_hex(0x00_8000)[1] - 0.215_860_500_113_899_26).abs() < 1e-12);
        for bad in ["ff0000", "#ff00", "#+f0000", "#gg0000", ""] {
            assert_eq!(linear_of_text(bad), None, "{bad}");
        }
    }
}
