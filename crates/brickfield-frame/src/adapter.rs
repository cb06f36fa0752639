//! The kinds of adapters, and the order in which they are preferred.

use std::fmt;

/// The kind of an adapter.
///
/// The order is the order of preference, the same for every backend: without another wish a backend opens the first adapter of
/// the least kind. An adapter of an unknown kind comes before a software adapter, which is never the faster.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum AdapterKind {
    /// A graphics card.
    Discrete,
    /// A GPU that shares the processor's memory.
    Integrated,
    /// A GPU lent by a host.
    Virtual,
    /// None of the others.
    Other,
    /// A driver that renders on the processor.
    Software,
}

impl AdapterKind {
    /// All kinds, in the order of preference.
    pub const ALL: [AdapterKind; 5] = [
        AdapterKind::Discrete,
        AdapterKind::Integrated,
        AdapterKind::Virtual,
        AdapterKind::Other,
        AdapterKind::Software,
    ];

    /// The kind's name in lists and reports.
    pub const fn name(self) -> &'static str {
        match self {
            AdapterKind::Discrete => "discrete",
            AdapterKind::Integrated => "integrated",
            AdapterKind::Virtual => "virtual",
            AdapterKind::Other => "other",
            AdapterKind::Software => "software",
        }
    }
}

impl fmt::Display for AdapterKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_are_listed_in_their_order_under_names_of_their_own() {
        assert!(AdapterKind::ALL.is_sorted());
        let names = AdapterKind::ALL.map(AdapterKind::name);
        assert!((0..names.len()).all(|i| !names[..i].contains(&names[i])));
    }
}
