//! Files that hold several volumes: what can be chosen, and what was.

use std::collections::BTreeMap;
use std::fmt;

use crate::ReadError;

/// What a file can hold several of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum ChoiceKind {
    /// DICOM series of a folder.
    Series,
    /// Images of an OME-TIFF or OME-Zarr.
    Image,
    /// Arrays of a VTK file, a Zarr group or a layered segmentation.
    Array,
    /// Resolutions of one image, 0 the finest.
    Level,
    /// Channels of an image, components of a voxel, colours.
    Channel,
    /// Points in time.
    Time,
}

impl ChoiceKind {
    /// All kinds.
    pub const ALL: [ChoiceKind; 6] = [
        ChoiceKind::Series,
        ChoiceKind::Image,
        ChoiceKind::Array,
        ChoiceKind::Level,
        ChoiceKind::Channel,
        ChoiceKind::Time,
    ];

    /// The kind's name: "series", "channel".
    pub const fn name(self) -> &'static str {
        match self {
            ChoiceKind::Series => "series",
            ChoiceKind::Image => "image",
            ChoiceKind::Array => "array",
            ChoiceKind::Level => "level",
            ChoiceKind::Channel => "channel",
            ChoiceKind::Time => "time",
        }
    }

    /// The name of several: "series", "channels".
    pub(crate) const fn plural(self) -> &'static str {
        match self {
            ChoiceKind::Series => "series",
            ChoiceKind::Image => "images",
            ChoiceKind::Array => "arrays",
            ChoiceKind::Level => "levels",
            ChoiceKind::Channel => "channels",
            ChoiceKind::Time => "times",
        }
    }
}

impl fmt::Display for ChoiceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Several entries of which one was read.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Choice {
    /// What there are several of.
    pub kind: ChoiceKind,
    /// How many there are.
    pub n_entries: u64,
    /// Their names in order; empty where they have none but their numbers.
    pub names: Vec<String>,
    /// The number of the entry that was read, from 0.
    pub read: u64,
}

impl Choice {
    /// Number and name of an entry, on one line.
    pub fn label(&self, entry: u64) -> String {
        match usize::try_from(entry).ok().and_then(|i| self.names.get(i)) {
            Some(name) => format!("{entry} ({})", crate::error::one_line(name)),
            None => entry.to_string(),
        }
    }
}

/// The entries that a caller wants, by number (from 0) or by name. A kind that is not mentioned is left to the file:
/// its first entry is read, and of colours the luminance.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WantedEntries(BTreeMap<ChoiceKind, String>);

impl WantedEntries {
    /// Nothing is wanted in particular.
    pub fn new() -> WantedEntries {
        WantedEntries::default()
    }

    /// Wants an entry, by its number or by its name; an earlier wish of this kind is replaced.
    pub fn want(&mut self, kind: ChoiceKind, entry: impl Into<String>) {
        self.0.insert(kind, entry.into());
    }

    /// The entry that is wanted of a kind.
    pub fn of(&self, kind: ChoiceKind) -> Option<&str> {
        self.0.get(&kind).map(String::as_str)
    }
}

/// The choices that a reader offers while it reads, each held against the [`WantedEntries`].
#[derive(Debug)]
pub(crate) struct Choices {
    wanted: WantedEntries,
    made: Vec<Choice>,
}

/// The names of entries, or that they have none.
pub(crate) enum Entries {
    Named(Vec<String>),
    Numbered(u64),
}

impl Entries {
    pub(crate) fn n_entries(&self) -> u64 {
        match self {
            Entries::Named(names) => names.len() as u64,
            Entries::Numbered(n) => *n,
        }
    }
}

/// The entry that is read, and whether the caller wanted it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Chosen {
    pub(crate) entry: u64,
    pub(crate) is_default: bool,
}

impl Choices {
    pub(crate) fn new(wanted: WantedEntries) -> Choices {
        Choices { wanted, made: Vec::new() }
    }

    /// Takes the wanted entry, or else `default`. A single entry is taken without being listed as a choice.
    ///
    /// # Errors
    /// If there is no entry of the wanted number or name.
    pub(crate) fn choose(&mut self, kind: ChoiceKind, entries: Entries, default: u64) -> Result<Chosen, ReadError> {
        let n_entries = entries.n_entries();
        let names = match entries {
            Entries::Named(names) => names,
            Entries::Numbered(_) => Vec::new(),
        };
        let wanted = self.wanted.0.remove(&kind);
        let entry = match &wanted {
            Some(wanted) => {
                find(wanted, n_entries, &names).ok_or_else(|| no_such_entry(kind, wanted, n_entries, &names))?
            }
            None => default,
        };
        if n_entries > 1 {
            self.made.push(Choice { kind, n_entries, names, read: entry });
        }
        Ok(Chosen { entry, is_default: wanted.is_none() })
    }

    /// The choices that were offered.
    ///
    /// # Errors
    /// If a kind was wanted that the file does not offer: entry 0 excepted, for one of anything there is always.
    pub(crate) fn finish(self) -> Result<Vec<Choice>, ReadError> {
        match self.wanted.0.into_iter().find(|(_, entry)| entry.trim() != "0") {
            Some((kind, entry)) => Err(no_such_entry(kind, &entry, 1, &[])),
            None => Ok(self.made),
        }
    }

    /// The choice of a kind, once it was made.
    pub(crate) fn made(&self, kind: ChoiceKind) -> Option<&Choice> {
        self.made.iter().find(|choice| choice.kind == kind)
    }
}

/// A name goes before a number: channels may be called "405" and "488".
fn find(wanted: &str, n_entries: u64, names: &[String]) -> Option<u64> {
    let by_name = names.iter().position(|name| name == wanted);
    let by_name = by_name.or_else(|| names.iter().position(|name| name.eq_ignore_ascii_case(wanted)));
    by_name.map(|i| i as u64).or_else(|| wanted.trim().parse().ok().filter(|i| *i < n_entries))
}

fn no_such_entry(kind: ChoiceKind, wanted: &str, n_entries: u64, names: &[String]) -> ReadError {
    let mut expected = match n_entries {
        0 | 1 => format!("0, for the file has one {kind} only"),
        n => format!("0 to {}", n - 1),
    };
    if n_entries > 1 && !names.is_empty() {
        let shown: Vec<_> = names.iter().take(MAX_SHOWN_NAMES).map(|name| format!("{name:?}")).collect();
        let more = if names.len() > MAX_SHOWN_NAMES { ", ..." } else { "" };
        expected = format!("{expected}, or one of {}{more}", shown.join(", "));
    }
    ReadError::field(kind.name(), wanted, expected)
}

const MAX_SHOWN_NAMES: usize = 6;

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(wanted: Option<&str>, names: &[&str]) -> Result<Chosen, ReadError> {
        let mut wanted_entries = WantedEntries::new();
        if let Some(wanted) = wanted {
            wanted_entries.want(ChoiceKind::Channel, wanted);
        }
        let names = names.iter().map(|name| (*name).to_owned()).collect();
        Choices::new(wanted_entries).choose(ChoiceKind::Channel, Entries::Named(names), 0)
    }

    #[test]
    fn entries_are_found_by_name_then_by_number() {
        let entry = |wanted, names| chosen(Some(wanted), names).unwrap().entry;
        assert_eq!(entry("1", &["2", "1", "0"]), 1);
        assert_eq!(entry("2", &["DAPI", "GFP", "RFP"]), 2);
        assert_eq!(entry("gfp", &["DAPI", "GFP", "RFP"]), 1);
        assert_eq!(chosen(None, &["DAPI", "GFP"]).unwrap(), Chosen { entry: 0, is_default: true });
    }

    #[test]
    fn an_entry_that_is_not_there_is_told_with_those_that_are() {
        let fault = chosen(Some("7"), &["DAPI", "GFP"]).unwrap_err().to_string();
        assert_eq!(fault, r#"channel is "7"; expected 0 to 1, or one of "DAPI", "GFP""#);
        let fault = chosen(Some("GFP"), &["DAPI"]).unwrap_err().to_string();
        assert_eq!(fault, r#"channel is "GFP"; expected 0, for the file has one channel only"#);
    }

    #[test]
    fn a_wish_that_no_reader_asked_for_is_an_error() {
        let unasked = |entry: &str| {
            let mut wanted_entries = WantedEntries::new();
            wanted_entries.want(ChoiceKind::Time, entry);
            Choices::new(wanted_entries).finish()
        };
        assert_eq!(unasked("0").unwrap(), vec![]);
        assert!(unasked("3").unwrap_err().to_string().contains("one time only"));
    }
}
