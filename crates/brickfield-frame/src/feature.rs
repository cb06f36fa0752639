//! The features that a scene needs of a renderer, as a set.

/// A feature that a scene may need; features that are not in the set are left out of the shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Feature {
    /// The filter of the texture unit instead of two gathers of four texels (fast mode).
    HardwareFilter,
    /// Rays end when hardly anything shines through any more (fast mode).
    EarlyTermination,
    /// Some blocks of the index are empty: rays jump over them.
    SkipEmpty,
    /// Parts of slots are known to be dark, macrocells or all that lies beside a box: rays leap over them.
    SkipDark,
    /// Some slots are lent to a batch: their values are read, and their segments left out.
    Lent,
    /// Tiles of the picture have beams: rays leave out the segments that their beam passes over.
    SkipBesideBeams,
    /// Some slots are coarser than level 0.
    MultiLevel,
    /// Flat blocks at the volume's upper ends have a smaller extent.
    ShortBlocks,
    /// The transfer function has several knots, or light asks for values: they need a lookup.
    TransferLookup,
    /// Light falls on surfaces.
    Light,
    /// The light is elsewhere than the eye.
    LightBesideEye,
    /// Normals are of gradients that lie beside the samples.
    StoredGradients,
    /// Samples have spreads, and nodes the optics that are expected of the values around them.
    Prefiltered,
}

impl Feature {
    /// All features.
    pub const ALL: [Feature; 13] = [
        Feature::HardwareFilter,
        Feature::EarlyTermination,
        Feature::SkipEmpty,
        Feature::SkipDark,
        Feature::Lent,
        Feature::SkipBesideBeams,
        Feature::MultiLevel,
        Feature::ShortBlocks,
        Feature::TransferLookup,
        Feature::Light,
        Feature::LightBesideEye,
        Feature::StoredGradients,
        Feature::Prefiltered,
    ];

    /// The feature's name in shader conditions (`@if(name)`) and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Feature::HardwareFilter => "hardware_filter",
            Feature::EarlyTermination => "early_termination",
            Feature::SkipEmpty => "skip_empty",
            Feature::SkipDark => "skip_dark",
            Feature::Lent => "lent",
            Feature::SkipBesideBeams => "skip_beside_beams",
            Feature::MultiLevel => "multi_level",
            Feature::ShortBlocks => "short_blocks",
            Feature::TransferLookup => "transfer_lookup",
            Feature::Light => "light",
            Feature::LightBesideEye => "light_beside_eye",
            Feature::StoredGradients => "stored_gradients",
            Feature::Prefiltered => "prefiltered",
        }
    }
}

/// A set of [`Feature`]s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FeatureSet(u32);

impl FeatureSet {
    /// Every feature: the general shader.
    pub fn all() -> FeatureSet {
        Feature::ALL.into_iter().collect()
    }

    /// Whether the set holds `feature`.
    pub const fn contains(self, feature: Feature) -> bool {
        self.0 >> feature as u32 & 1 == 1
    }

    /// The set with `feature`.
    #[must_use]
    pub const fn with(self, feature: Feature) -> FeatureSet {
        FeatureSet(self.0 | 1 << feature as u32)
    }

    /// The set without `feature`.
    #[must_use]
    pub const fn without(self, feature: Feature) -> FeatureSet {
        FeatureSet(self.0 & !(1 << feature as u32))
    }

    /// The features in the set.
    pub fn iter(self) -> impl Iterator<Item = Feature> {
        Feature::ALL.into_iter().filter(move |f| self.contains(*f))
    }
}

impl FromIterator<Feature> for FeatureSet {
    fn from_iter<I: IntoIterator<Item = Feature>>(features: I) -> FeatureSet {
        features.into_iter().fold(FeatureSet::default(), FeatureSet::with)
    }
}
