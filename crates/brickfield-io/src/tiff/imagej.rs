//! The description that ImageJ writes: lines of `key=value`.

/// What the description says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ImageJ {
    pub(super) n_channels: u64,
    pub(super) n_slices: u64,
    pub(super) n_frames: u64,
    /// World units from slice to slice.
    pub(super) spacing_z: Option<f64>,
    /// Units of x, y and z.
    pub(super) units: [Option<String>; 3],
}

impl ImageJ {
    pub(super) fn of_text(text: &str) -> ImageJ {
        let value = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix('='));
        let count = |key: &str| value(key).and_then(|v| v.trim().parse::<u64>().ok()).filter(|n| *n > 0);
        let (n_channels, n_frames) = (count("channels").unwrap_or(1), count("frames").unwrap_or(1));
        let n_images = count("images").unwrap_or(1);
        let n_slices = count("slices").unwrap_or(n_images / n_channels.saturating_mul(n_frames).max(1)).max(1);
        let spacing = value("spacing").and_then(|v| v.trim().parse::<f64>().ok()).map(f64::abs);
        let unit = |key: &str| value(key).map(unescaped).filter(|unit| !unit.is_empty());
        let x = unit("unit");
        let (y, z) = (unit("yunit").or(x.clone()), unit("zunit").or(x.clone()));
        ImageJ {
            n_channels,
            n_slices,
            n_frames,
            spacing_z: spacing.filter(|v| v.is_finite() && *v > 0.0),
            units: [x, y, z],
        }
    }

    pub(super) fn n_pages(&self) -> u64 {
        self.n_channels.saturating_mul(self.n_slices).saturating_mul(self.n_frames)
    }

    /// The page of a slice: pages run through channels first, then slices, then frames.
    pub(super) fn page(&self, channel: u64, slice: u64, frame: u64) -> u64 {
        channel + self.n_channels * (slice + self.n_slices * frame)
    }
}

/// ImageJ writes the micro sign as an escape.
fn unescaped(unit: &str) -> String {
    unit.trim().replace("\\u00B5", "u")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hyperstacks_run_through_channels_first() {
        let text = "ImageJ=1.53t\nimages=24\nchannels=2\nslices=3\nframes=4\nunit=\\u00B5m\nspacing=2.5\n";
        let found = ImageJ::of_text(text);
        assert_eq!((found.n_channels, found.n_slices, found.n_frames), (2, 3, 4));
        assert_eq!((found.page(1, 2, 0), found.page(0, 0, 3)), (5, 18));
        assert_eq!((found.spacing_z, found.units[2].as_deref()), (Some(2.5), Some("um")));
    }

    #[test]
    fn images_without_slices_are_slices() {
        assert_eq!(ImageJ::of_text("ImageJ=1.53t\nimages=6\nchannels=2\n").n_slices, 3);
        assert_eq!(ImageJ::of_text("ImageJ=1.53t\n").n_pages(), 1);
    }
}
