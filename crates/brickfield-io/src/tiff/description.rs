//! The description of the first page, as ImageJ and OME-TIFF write it.

/// How pages are numbered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PageOrder {
    pub(super) n_channels: u64,
    pub(super) n_slices: u64,
    pub(super) n_frames: u64,
    /// Pages from one slice to the next of the same channel and frame; at least 1.
    pub(super) pages_per_slice: u64,
}

impl PageOrder {
    pub(super) fn n_pages(&self) -> u64 {
        self.n_channels.saturating_mul(self.n_slices).saturating_mul(self.n_frames)
    }
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ImageDescription {
    pub(super) order: Option<PageOrder>,
    /// World units along x, y, z, as far as the description states them.
    pub(super) spacing: [Option<f64>; 3],
    pub(super) unit: Option<String>,
    /// Whether the resolution tags are samples per world unit.
    pub(super) uses_resolution: bool,
}

impl ImageDescription {
    /// An empty description for text of any other kind.
    pub(super) fn read(text: &str) -> ImageDescription {
        if text.starts_with("ImageJ=") {
            of_imagej(text)
        } else if text.contains("<OME") {
            of_ome(text)
        } else {
            ImageDescription::default()
        }
    }
}

/// Lines of `key=value`. Pages run through channels first, then slices, then frames.
fn of_imagej(text: &str) -> ImageDescription {
    let value = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix('='));
    let count = |key: &str| value(key).and_then(|v| v.trim().parse::<u64>().ok()).filter(|n| *n > 0);
    let (n_channels, n_frames) = (count("channels").unwrap_or(1), count("frames").unwrap_or(1));
    let n_images = count("images").unwrap_or(1);
    let n_slices = count("slices").unwrap_or(n_images / n_channels.saturating_mul(n_frames).max(1)).max(1);
    let spacing = value("spacing").and_then(|v| v.trim().parse::<f64>().ok()).map(f64::abs);
    ImageDescription {
        order: Some(PageOrder { n_channels, n_slices, n_frames, pages_per_slice: n_channels }),
        spacing: [None, None, spacing],
        unit: value("unit").map(|u| u.trim().replace("\\u00B5", "u")).filter(|u| !u.is_empty()),
        uses_resolution: true,
    }
}

/// The attributes of the first Pixels element.
fn of_ome(text: &str) -> ImageDescription {
    let pixels = text.split_once("<Pixels").map_or("", |(_, rest)| rest.split('>').next().unwrap_or(""));
    let value = |name: &str| {
        let (_, rest) = pixels.split_once(&format!(" {name}=\""))?;
        rest.split('"').next()
    };
    let count = |name| value(name).and_then(|v| v.parse::<u64>().ok()).filter(|n| *n > 0).unwrap_or(1);
    let (n_channels, n_slices, n_frames) = (count("SizeC"), count("SizeZ"), count("SizeT"));
    let before_z = value("DimensionOrder").unwrap_or("XYZCT").split('Z').next().unwrap_or("");
    let pages_per_slice = before_z.chars().fold(1u64, |n, axis| match axis {
        'C' => n.saturating_mul(n_channels),
        'T' => n.saturating_mul(n_frames),
        _ => n,
    });
    let size = |name| value(name).and_then(|v| v.parse::<f64>().ok());
    ImageDescription {
        order: Some(PageOrder { n_channels, n_slices, n_frames, pages_per_slice }),
        spacing: [size("PhysicalSizeX"), size("PhysicalSizeY"), size("PhysicalSizeZ")],
        unit: value("PhysicalSizeX").map(|_| value("PhysicalSizeXUnit").unwrap_or("um").to_owned()),
        uses_resolution: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn imagej_hyperstacks_run_through_channels_first() {
        let text = "ImageJ=1.53t\nimages=24\nchannels=2\nslices=3\nframes=4\nunit=\\u00B5m\nspacing=2.5\n";
        let description = ImageDescription::read(text);
        let order = PageOrder { n_channels: 2, n_slices: 3, n_frames: 4, pages_per_slice: 2 };
        assert_eq!(description.order, Some(order));
        assert_eq!((description.spacing[2], description.unit.as_deref()), (Some(2.5), Some("um")));
    }

    #[test]
    fn ome_orders_pages_as_it_says() {
        let pixels =
            r#"<OME><Image><Pixels DimensionOrder="XYCTZ" SizeC="2" SizeT="3" SizeZ="5" PhysicalSizeX="0.25">"#;
        let description = ImageDescription::read(pixels);
        assert_eq!(description.order.map(|o| (o.pages_per_slice, o.n_pages())), Some((6, 30)));
        assert_eq!(description.spacing, [Some(0.25), None, None]);
    }

    #[test]
    fn other_descriptions_say_nothing() {
        assert_eq!(ImageDescription::read("a scan of a letter"), ImageDescription::default());
    }
}
