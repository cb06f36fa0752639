//! Which state of an object an answer is about.

use std::fmt;

use object_store::ObjectMeta;

/// Size, entity tag and date of an object: answers that differ are about two objects.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Version {
    pub(crate) n_bytes: u64,
    tag: Option<String>,
    /// Milliseconds since 1970; `None`: the server gives no date.
    modified: Option<i64>,
}

impl Version {
    pub(crate) fn of(meta: &ObjectMeta) -> Version {
        let modified = Some(meta.last_modified.timestamp_millis()).filter(|&t| t != 0);
        Version { n_bytes: meta.size, tag: meta.e_tag.clone(), modified }
    }

    #[cfg(test)]
    pub(crate) fn of_size(n_bytes: u64) -> Version {
        Version { n_bytes, tag: None, modified: None }
    }

    /// Whether the parts of two answers may be put together. Dates count where there are no tags: two machines that serve one
    /// object may date it differently.
    pub(crate) fn is_same(&self, other: &Version) -> bool {
        let both_tagged = self.tag.is_some() && other.tag.is_some();
        self.n_bytes == other.n_bytes
            && if both_tagged { self.tag == other.tag } else { self.modified == other.modified }
    }

    /// Whether a change of the object would show.
    pub(crate) fn tells_changes(&self) -> bool {
        self.tag.is_some() || self.modified.is_some()
    }
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} bytes", self.n_bytes)?;
        match (&self.tag, self.modified) {
            (Some(tag), _) => write!(f, ", entity tag {tag}"),
            (None, Some(modified)) => write!(f, ", dated {modified} ms"),
            (None, None) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn version(n_bytes: u64, tag: &str, modified: i64) -> Version {
        let tag = Some(tag.to_owned()).filter(|t| !t.is_empty());
        Version { n_bytes, tag, modified: Some(modified).filter(|&t| t != 0) }
    }

    #[test]
    fn a_tag_decides_and_without_one_the_date() {
        assert!(version(4, "a", 1).is_same(&version(4, "a", 2)));
        assert!(!version(4, "a", 1).is_same(&version(4, "b", 1)));
        assert!(!version(4, "a", 1).is_same(&version(5, "a", 1)));
        assert!(!version(4, "", 1).is_same(&version(4, "", 2)));
        assert!(version(4, "", 0).is_same(&version(4, "", 0)) && !version(4, "", 0).tells_changes());
    }
}
