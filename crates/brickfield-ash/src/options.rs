//! Which adapter to use, and how.

use std::fmt;
use std::path::PathBuf;

use brickfield_frame::AdapterKind;

use crate::ConnectError;
use crate::vulkan::{Instance, physical_devices};

/// How to connect.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Which adapter.
    pub adapter: AdapterChoice,
    /// Whether Vulkan's validation layer watches.
    pub validation: Validation,
    /// Most bytes that are copied to or from the device at once, a brick or a row of pixels at least; 8 MiB unless stated: what is on
    /// its way stays in the caches of the host. So much memory of the host, up to the next power of two and 64 KiB at least, each direction takes at most: a large set
    /// of bricks does not need its memory twice.
    pub copy_bytes: usize,
    /// A file that keeps compiled pipelines from one process to the next: it is read if it is this device's and driver's and whole, and written
    /// when the backend goes. Its folder must exist. None unless stated.
    pub pipelines: Option<PathBuf>,
}

impl Default for Options {
    fn default() -> Options {
        Options { adapter: AdapterChoice::Default, validation: Validation::Off, copy_bytes: 8 << 20, pipelines: None }
    }
}

/// Which adapter to use.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// The first of the best [`AdapterKind`].
    #[default]
    Default,
    /// The adapter of this [`AdapterSummary::index`].
    Index(usize),
    /// The first adapter whose name contains this, in any case.
    Name(String),
}

/// Whether Vulkan's validation layer watches every call, synchronisation included. Slow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Validation {
    /// No.
    #[default]
    Off,
    /// Yes; its messages are kept in a [`ValidationLog`](crate::ValidationLog).
    On,
}

/// An adapter, as its driver describes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterSummary {
    /// Its place in [`adapters`].
    pub index: usize,
    /// Its name.
    pub name: String,
    /// The driver's name and version.
    pub driver: String,
    /// The adapter's kind.
    pub kind: AdapterKind,
}

impl fmt::Display for AdapterSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} ({})", self.index, self.name, self.driver)
    }
}

/// The Vulkan adapters of this machine.
///
/// # Errors
/// If there is no Vulkan loader, or the loader fails. A machine without a driver has an empty list.
pub fn adapters() -> Result<Vec<AdapterSummary>, ConnectError> {
    let instance = match Instance::new(Validation::Off) {
        Err(ConnectError::NoDevice) => return Ok(Vec::new()),
        instance => instance?,
    };
    Ok(physical_devices(&instance)?.into_iter().map(|d| d.summary).collect())
}

/// The place in the list of the adapter that `choice` means.
pub(crate) fn choose(choice: &AdapterChoice, there: &[AdapterSummary]) -> Result<usize, ConnectError> {
    if there.is_empty() {
        return Err(ConnectError::NoDevice);
    }
    let (found, wanted) = match choice {
        AdapterChoice::Default => (there.iter().min_by_key(|a| a.kind), String::new()),
        AdapterChoice::Index(index) => (there.get(*index), format!("{index}")),
        AdapterChoice::Name(part) => {
            let part_lower = part.to_lowercase();
            (there.iter().find(|a| a.name.to_lowercase().contains(&part_lower)), format!("`{part}`"))
        }
    };
    let listed = || there.iter().map(AdapterSummary::to_string).collect::<Vec<_>>().join(", ");
    found.map(|a| a.index).ok_or_else(|| ConnectError::UnknownAdapter { wanted, there: listed() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list() -> Vec<AdapterSummary> {
        [("Soft", AdapterKind::Software), ("Inner", AdapterKind::Integrated), ("Big Card", AdapterKind::Discrete)]
            .into_iter()
            .enumerate()
            .map(|(index, (name, kind))| AdapterSummary { index, name: name.into(), driver: "d 1".into(), kind })
            .collect()
    }

    #[test]
    fn the_best_adapter_is_the_default_and_others_are_chosen_by_place_or_name() {
        assert_eq!(choose(&AdapterChoice::Default, &list()), Ok(2));
        assert_eq!(choose(&AdapterChoice::Default, &list()[..2]), Ok(1));
        assert_eq!(choose(&AdapterChoice::Index(0), &list()), Ok(0));
        assert_eq!(choose(&AdapterChoice::Name("card".into()), &list()), Ok(2));
    }

    #[test]
    fn software_is_the_last_resort() {
        let of = |kinds: [AdapterKind; 2]| {
            let summary = |(index, kind)| AdapterSummary { index, name: "a".into(), driver: "d 1".into(), kind };
            choose(&AdapterChoice::Default, &kinds.into_iter().enumerate().map(summary).collect::<Vec<_>>())
        };
        assert_eq!(of([AdapterKind::Software, AdapterKind::Other]), Ok(1));
        assert_eq!(of([AdapterKind::Other, AdapterKind::Software]), Ok(0));
        assert_eq!(of([AdapterKind::Other, AdapterKind::Virtual]), Ok(1));
    }

    #[test]
    fn an_unknown_adapter_is_answered_with_those_that_are_there() {
        let error = choose(&AdapterChoice::Name("nix".into()), &list()).unwrap_err().to_string();
        assert!(error.contains("`nix`") && error.contains("1: Inner (d 1), 2: Big Card"), "{error}");
        assert!(choose(&AdapterChoice::Index(3), &list()).is_err());
        assert_eq!(choose(&AdapterChoice::Default, &[]), Err(ConnectError::NoDevice));
    }
}
