//! The codec's options, and the configuration by which the metadata of an array state them.

use brickfield_haar::{EncodeOptions, FORMAT_VERSION, Kernel, Loss, LowBand, MAX_LEVELS, Storages};
use serde_json::{Map, Value, json};

use crate::codec::CODEC_NAME;

/// How chunks are encoded. Decoding needs `max_error` only: a chunk states the rest itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HaarOptions {
    /// The kernels that are tried on each chunk; the one with the fewest bytes is used. At least one, none of them twice.
    pub kernels: Vec<Kernel>,
    /// Levels above level 0 that a chunk stores apart, at most 15, or `None` for as many as leave at most 4 samples along each axis.
    pub n_levels: Option<u8>,
    /// By how much a decoded sample may differ from the encoded one; at most 2^31 - 1. 0: not at all.
    pub max_error: u32,
    /// The storages that may be used.
    pub storages: Storages,
}

impl Default for HaarOptions {
    /// Lossless, by the best of the kernels that make one pyramid, in the smallest storage: the defaults of [`EncodeOptions`].
    fn default() -> HaarOptions {
        let EncodeOptions { kernels, storages, n_levels, .. } = EncodeOptions::default();
        HaarOptions { kernels, n_levels, max_error: 0, storages }
    }
}

/// Why options, or the configuration in an array's metadata, are refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum ConfigurationError {
    #[error("the configuration of {CODEC_NAME} has the key {key:?}; its keys are {}", KEYS.join(", "))]
    UnknownKey { key: String },
    #[error("the configuration of {CODEC_NAME} has {key} = {value}, but {key} is {expected}")]
    Value { key: &'static str, value: String, expected: String },
}

/// The keys of the configuration, in the order in which they are written.
const KEYS: [&str; 5] = ["version", "kernels", "levels", "max_error", "storage"];

impl HaarOptions {
    /// Reads a configuration; a key that is left out has its default.
    pub(crate) fn from_configuration(configuration: &Map<String, Value>) -> Result<HaarOptions, ConfigurationError> {
        if let Some(key) = configuration.keys().find(|key| !KEYS.contains(&key.as_str())) {
            return Err(ConfigurationError::UnknownKey { key: key.clone() });
        }
        let mut options = HaarOptions::default();
        if let Some(value) = configuration.get("version") {
            integer("version", value, FORMAT_VERSION.into()..=FORMAT_VERSION.into())?;
        }
        if let Some(value) = configuration.get("kernels") {
            options.kernels = kernels(value)?;
        }
        if let Some(value) = configuration.get("levels") {
            options.n_levels = levels(value)?;
        }
        if let Some(value) = configuration.get("max_error") {
            options.max_error = integer("max_error", value, 0..=MAX_MAX_ERROR)? as u32;
        }
        if let Some(value) = configuration.get("storage") {
            options.storages = storages(value)?;
        }
        Ok(options)
    }

    /// The configuration, with every key.
    pub(crate) fn to_configuration(&self) -> Map<String, Value> {
        let kernels: Vec<&str> = self.kernels.iter().map(|kernel| kernel.name()).collect();
        let storage = STORAGES.iter().find(|(_, storages)| *storages == self.storages).map(|(name, _)| *name);
        let values =
            [json!(FORMAT_VERSION), json!(kernels), json!(self.n_levels), json!(self.max_error), json!(storage)];
        KEYS.into_iter().map(str::to_owned).zip(values).collect()
    }

    /// Holds options to their bounds, which are those of the configuration.
    pub(crate) fn checked(self) -> Result<HaarOptions, ConfigurationError> {
        HaarOptions::from_configuration(&self.to_configuration())
    }

    /// The options of the encoder.
    pub(crate) fn encode_options(&self) -> EncodeOptions {
        EncodeOptions {
            kernels: self.kernels.clone(),
            storages: self.storages,
            n_levels: self.n_levels,
            loss: if self.max_error == 0 { Loss::None } else { Loss::MaxError(self.max_error) },
            low_band: LowBand::Stored,
        }
    }
}

/// The greatest `max_error`, 2^31 - 1.
const MAX_MAX_ERROR: u64 = i32::MAX as u64;

const STORAGES: [(&str, Storages); 2] = [("smallest", Storages::Smallest), ("packed", Storages::Packed)];

fn refused(key: &'static str, value: &Value, expected: String) -> ConfigurationError {
    ConfigurationError::Value { key, value: value.to_string(), expected }
}

fn integer(key: &'static str, value: &Value, range: std::ops::RangeInclusive<u64>) -> Result<u64, ConfigurationError> {
    let (least, most) = (range.start(), range.end());
    let expected = if least == most { format!("{most}") } else { format!("an integer from {least} to {most}") };
    value.as_u64().filter(|n| range.contains(n)).ok_or_else(|| refused(key, value, expected))
}

fn levels(value: &Value) -> Result<Option<u8>, ConfigurationError> {
    let expected = || refused("levels", value, format!("null or an integer from 0 to {MAX_LEVELS}"));
    match value {
        Value::Null => Ok(None),
        _ => integer("levels", value, 0..=MAX_LEVELS.into()).map(|n| Some(n as u8)).map_err(|_| expected()),
    }
}

fn kernels(value: &Value) -> Result<Vec<Kernel>, ConfigurationError> {
    let expected = || {
        let names: Vec<String> = Kernel::ALL.iter().map(|kernel| format!("{:?}", kernel.name())).collect();
        refused("kernels", value, format!("an array of one or more of {}, none of them twice", names.join(", ")))
    };
    let kernel = |name: &Value| Kernel::ALL.into_iter().find(|kernel| name.as_str() == Some(kernel.name()));
    let names = value.as_array().ok_or_else(expected)?;
    let kernels: Vec<Kernel> = names.iter().map(kernel).collect::<Option<_>>().ok_or_else(expected)?;
    let has_twice = kernels.iter().enumerate().any(|(i, kernel)| kernels[..i].contains(kernel));
    if kernels.is_empty() || has_twice { Err(expected()) } else { Ok(kernels) }
}

fn storages(value: &Value) -> Result<Storages, ConfigurationError> {
    let named = STORAGES.iter().find(|(name, _)| value.as_str() == Some(name));
    let names = STORAGES.map(|(name, _)| format!("{name:?}"));
    named.map(|(_, storages)| *storages).ok_or_else(|| refused("storage", value, names.join(" or ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(configuration: Value) -> Result<HaarOptions, String> {
        HaarOptions::from_configuration(configuration.as_object().unwrap()).map_err(|error| error.to_string())
    }

    #[test]
    fn an_empty_configuration_is_the_default() {
        assert_eq!(read(json!({})).unwrap(), HaarOptions::default());
    }

    #[test]
    fn a_written_configuration_is_read_as_it_was() {
        let options = HaarOptions {
            kernels: vec![Kernel::LeGall53, Kernel::Haar],
            n_levels: Some(15),
            max_error: i32::MAX as u32,
            storages: Storages::Packed,
        };
        let written = options.to_configuration();
        assert_eq!(written.keys().map(String::as_str).collect::<Vec<_>>(), KEYS);
        assert_eq!(HaarOptions::from_configuration(&written).unwrap(), options);
        let default = HaarOptions::default();
        assert_eq!(HaarOptions::from_configuration(&default.to_configuration()).unwrap(), default);
    }

    #[test]
    fn a_wrong_value_is_named_with_its_key_and_bound() {
        let head = "the configuration of brickfield.haar has ";
        let kernels = r#"an array of one or more of "haar", "haar-predicted", "5/3", "median", none of them twice"#;
        for (key, value, expected) in [
            ("version", json!(0), "1"),
            ("version", json!(2), "1"),
            ("version", json!("1"), "1"),
            ("kernels", json!("haar"), kernels),
            ("kernels", json!([]), kernels),
            ("kernels", json!(["haar", "db4"]), kernels),
            ("kernels", json!(["haar", 5]), kernels),
            ("kernels", json!(["median", "haar", "median"]), kernels),
            ("levels", json!(16), "null or an integer from 0 to 15"),
            ("levels", json!(-1), "null or an integer from 0 to 15"),
            ("levels", json!(1.5), "null or an integer from 0 to 15"),
            ("max_error", json!(2147483648u32), "an integer from 0 to 2147483647"),
            ("max_error", json!(-3), "an integer from 0 to 2147483647"),
            ("max_error", json!(null), "an integer from 0 to 2147483647"),
            ("storage", json!("raw"), r#""smallest" or "packed""#),
            ("storage", json!(1), r#""smallest" or "packed""#),
        ] {
            let message = format!("{head}{key} = {value}, but {key} is {expected}");
            assert_eq!(read(json!({ key: value })).unwrap_err(), message);
        }
    }

    #[test]
    fn an_unknown_key_is_named_with_the_known_ones() {
        let message = r#"the configuration of brickfield.haar has the key "level"; its keys are version, kernels, levels, max_error, storage"#;
        assert_eq!(read(json!({ "levels": 2, "level": 2 })).unwrap_err(), message);
    }

    #[test]
    fn options_are_held_to_the_same_bounds() {
        let error = |options| crate::HaarCodec::new(options).unwrap_err().to_string();
        let levels = error(HaarOptions { n_levels: Some(16), ..HaarOptions::default() });
        assert!(levels.contains("levels = 16"), "{levels}");
        let kernels = error(HaarOptions { kernels: Vec::new(), ..HaarOptions::default() });
        assert!(kernels.contains("kernels = []"), "{kernels}");
        let max_error = error(HaarOptions { max_error: 1 << 31, ..HaarOptions::default() });
        assert!(max_error.contains("max_error = 2147483648"), "{max_error}");
    }

    /// `schema.json` is what a registry or another reader goes by.
    #[test]
    fn the_schema_has_the_same_keys_defaults_and_bounds() {
        let schema: Value = serde_json::from_str(include_str!("../schema.json")).unwrap();
        assert_eq!(schema["properties"]["name"]["const"], CODEC_NAME);
        let configuration = &schema["properties"]["configuration"];
        let properties = configuration["properties"].as_object().unwrap();
        let defaults: Map<String, Value> =
            properties.iter().map(|(key, property)| (key.clone(), property["default"].clone())).collect();
        assert_eq!(defaults, HaarOptions::default().to_configuration());
        assert_eq!(configuration["additionalProperties"], false);
        assert_eq!(properties["version"]["const"], FORMAT_VERSION);
        assert_eq!(properties["levels"]["maximum"], MAX_LEVELS);
        assert_eq!(properties["max_error"]["maximum"], MAX_MAX_ERROR);
        assert_eq!(properties["kernels"]["items"]["enum"], json!(Kernel::ALL.map(Kernel::name)));
        assert_eq!(properties["storage"]["enum"], json!(STORAGES.map(|(name, _)| name)));
    }
}
