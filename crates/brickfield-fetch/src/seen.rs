//! What the answer to one request was, beside what `object_store` makes of it.

use std::sync::atomic::{AtomicU16, AtomicU64, Ordering};

use object_store::HeaderMap;

/// Status and length of an answer; 0 until there is one.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    status: AtomicU16,
    n_bytes: AtomicU64,
}

/// How far away a store is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reach {
    Folder,
    Network,
}

/// The "status" of a file system.
const OF_FOLDER: u16 = 1;

/// What another attempt would find.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// No answer, or one of a server in trouble.
    Trouble,
    /// The whole object, of so many bytes.
    Whole { n_bytes: u64 },
    /// An answer with a part, which may have been a wrong one.
    Part,
    /// That there is no such object.
    Absent,
    /// The same again.
    Final,
    /// The same again, by a file system: no status tells why.
    Folder,
}

impl Seen {
    pub(crate) fn of(reach: Reach) -> Seen {
        let seen = Seen::default();
        if reach == Reach::Folder {
            seen.status.store(OF_FOLDER, Ordering::Relaxed);
        }
        seen
    }

    pub(crate) fn note(&self, status: u16, headers: &HeaderMap) {
        let length = headers.get("content-length").and_then(|v| v.to_str().ok()?.parse().ok());
        self.n_bytes.store(length.unwrap_or(u64::MAX), Ordering::Relaxed);
        self.status.store(status, Ordering::Relaxed);
    }

    pub(crate) fn answer(&self) -> Answer {
        match self.status.load(Ordering::Relaxed) {
            // 408: the server did not get the request in time; 429: too many at once.
            0 | 408 | 429 | 500.. => Answer::Trouble,
            200 => Answer::Whole { n_bytes: self.n_bytes.load(Ordering::Relaxed) },
            206 => Answer::Part,
            404 => Answer::Absent,
            OF_FOLDER => Answer::Folder,
            _ => Answer::Final,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_attempt_is_for_trouble_alone() {
        let answer = |status: u16| {
            let seen = Seen::default();
            seen.note(status, &HeaderMap::new());
            seen.answer()
        };
        assert!([408, 429, 500, 503, 599].iter().all(|&s| answer(s) == Answer::Trouble));
        assert!([301, 400, 403, 405, 410, 416, 431].iter().all(|&s| answer(s) == Answer::Final));
        assert_eq!((answer(206), Seen::default().answer()), (Answer::Part, Answer::Trouble));
        assert_eq!((Seen::of(Reach::Folder).answer(), answer(404)), (Answer::Folder, Answer::Absent));
        assert_eq!(answer(200), Answer::Whole { n_bytes: u64::MAX });
    }
}
