//! One range of one object: attempts, and what holds their answers to it.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use futures_util::StreamExt;
use object_store::path::Path;
use object_store::{Attribute, Error, Extensions, GetOptions, GetRange, GetResult, ObjectStore};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

use crate::seen::{Answer, Reach, Seen};
use crate::version::Version;
use crate::{FetchError, FetchOptions};

/// What a client asks with.
pub(crate) struct Asker<'a> {
    pub(crate) store: &'a dyn ObjectStore,
    pub(crate) reach: Reach,
    pub(crate) options: &'a FetchOptions,
    /// As many permits as requests may be under way.
    pub(crate) permits: &'a Semaphore,
    pub(crate) counts: &'a Counts,
}

/// What requests cost.
#[derive(Debug, Default)]
pub(crate) struct Counts {
    pub(crate) n_requests: AtomicU64,
    pub(crate) n_retries: AtomicU64,
    pub(crate) n_wire_bytes: AtomicU64,
}

/// What is asked for of an object.
pub(crate) struct Asked {
    pub(crate) key: Arc<str>,
    pub(crate) path: Path,
    /// Not empty; `None`: the whole.
    pub(crate) range: Option<Range<u64>>,
    /// What is known of the object.
    pub(crate) version: Option<Version>,
}

/// Bytes of an object, from `offset` on.
pub(crate) struct Brought {
    pub(crate) version: Version,
    pub(crate) offset: u64,
    pub(crate) bytes: Vec<u8>,
}

/// Why an attempt did not end well.
enum Fault {
    /// There is no such object.
    Absent,
    /// Another attempt may do.
    Again(String),
    /// No other attempt will.
    Final(FetchError),
}

impl From<FetchError> for Fault {
    fn from(e: FetchError) -> Fault {
        Fault::Final(e)
    }
}

/// The state of a transfer between attempts.
struct Transfer<'a> {
    asked: &'a Asked,
    version: Option<Version>,
    /// Bytes of the range from its start on.
    bytes: Vec<u8>,
}

impl Asker<'_> {
    /// Brings what is asked for; `None`: there is no such object.
    pub(crate) async fn bring(&self, asked: &Asked) -> Result<Option<Brought>, FetchError> {
        let mut transfer = Transfer { asked, version: asked.version.clone(), bytes: vec![] };
        let mut n_attempts = 0;
        loop {
            let fault = match self.attempt(&mut transfer).await {
                Ok(version) => {
                    let offset = asked.range.as_ref().map_or(0, |range| range.start);
                    return Ok(Some(Brought { version, offset, bytes: transfer.bytes }));
                }
                Err(fault) => fault,
            };
            match self.after(fault, asked, &mut n_attempts).await? {
                Next::Again => {}
                Next::Absent => return Ok(None),
            }
        }
    }

    /// What is known of an object after asking for that alone; `None`: there is no such object.
    pub(crate) async fn version(&self, asked: &Asked) -> Result<Option<Version>, FetchError> {
        let mut n_attempts = 0;
        loop {
            let fault = match self.head(asked).await {
                Ok(version) => return Ok(Some(version)),
                Err(fault) => fault,
            };
            match self.after(fault, asked, &mut n_attempts).await? {
                Next::Again => {}
                Next::Absent => return Ok(None),
            }
        }
    }

    /// Waits before the next attempt, if there is to be one.
    async fn after(&self, fault: Fault, asked: &Asked, n_attempts: &mut u32) -> Result<Next, FetchError> {
        *n_attempts += 1;
        let n_attempts = *n_attempts;
        match fault {
            Fault::Absent => Ok(Next::Absent),
            Fault::Final(e) => Err(e),
            Fault::Again(fault) if n_attempts > self.options.max_retries => {
                Err(FetchError::Failed { key: asked.key.to_string(), range: asked.range.clone(), n_attempts, fault })
            }
            Fault::Again(_) => {
                self.counts.n_retries.fetch_add(1, Ordering::Relaxed);
                sleep(self.options.backoff(n_attempts)).await;
                Ok(Next::Again)
            }
        }
    }

    async fn head(&self, asked: &Asked) -> Result<Version, Fault> {
        let _permit = self.permits.acquire().await;
        let (options, seen) = self.get_options(None);
        let result = self.get(asked, GetOptions { head: true, ..options }, &seen).await?;
        Ok(Version::of(&result.meta))
    }

    /// Asks for what is missing, and takes what comes of it.
    async fn attempt(&self, transfer: &mut Transfer<'_>) -> Result<Version, Fault> {
        let asked = transfer.asked;
        let _permit = self.permits.acquire().await;
        if !transfer.version.as_ref().is_some_and(Version::tells_changes) {
            // Nothing would tell that the rest is of another object.
            transfer.bytes.clear();
        }
        let rest = transfer.rest()?;
        let (options, seen) = self.get_options(rest.clone());
        match self.get(asked, options, &seen).await {
            Ok(result) => self.take(transfer, rest, result).await,
            Err(Fault::Again(_)) if rest.is_some() && matches!(seen.answer(), Answer::Whole { .. }) => {
                self.take_of_whole(transfer, &seen).await
            }
            // The range may lie behind the end; the size tells.
            Err(Fault::Final(e)) if rest.is_some() && !matches!(e, FetchError::Changed { .. }) => {
                let (options, seen) = self.get_options(None);
                let head = self.get(asked, GetOptions { head: true, ..options }, &seen).await;
                head.map_or(Ok(()), |result| transfer.hold_to(Version::of(&result.meta)))?;
                Err(Fault::Final(e))
            }
            Err(fault) => Err(fault),
        }
    }

    fn get_options(&self, range: Option<Range<u64>>) -> (GetOptions, Arc<Seen>) {
        let seen = Arc::new(Seen::of(self.reach));
        let mut extensions = Extensions::new();
        extensions.insert(seen.clone());
        (GetOptions { range: range.map(GetRange::Bounded), extensions, ..GetOptions::default() }, seen)
    }

    /// One request, up to the head of its answer.
    async fn get(&self, asked: &Asked, options: GetOptions, seen: &Seen) -> Result<GetResult, Fault> {
        self.counts.n_requests.fetch_add(1, Ordering::Relaxed);
        let Ok(result) = timeout(self.options.timeout, self.store.get_opts(&asked.path, options)).await else {
            return Err(Fault::Again(format!("no answer in {:?}", self.options.timeout)));
        };
        result.map_err(|e| fault(e, seen, asked))
    }

    /// Takes a body that is to be the bytes of `rest`; `None`: all.
    async fn take(
        &self,
        transfer: &mut Transfer<'_>,
        rest: Option<Range<u64>>,
        result: GetResult,
    ) -> Result<Version, Fault> {
        let version = Version::of(&result.meta);
        transfer.hold_to(version.clone())?;
        let rest = rest.unwrap_or(0..version.n_bytes);
        if result.range != rest {
            let got = &result.range;
            let told = format!("asked for bytes {}..{}, got {}..{}", rest.start, rest.end, got.start, got.end);
            return Err(Fault::Again(told));
        }
        self.take_body(transfer, result, rest.end - rest.start).await?;
        Ok(version)
    }

    /// Asks for the whole of an object, of which the server gives no part, and takes the asked part of it.
    async fn take_of_whole(&self, transfer: &mut Transfer<'_>, seen: &Seen) -> Result<Version, Fault> {
        let asked = transfer.asked;
        let (Answer::Whole { n_bytes }, Some(range)) = (seen.answer(), &asked.range) else {
            transfer.bytes.clear();
            return Err(Fault::Again("the server sent the whole in place of the rest".to_owned()));
        };
        let most = self.options.max_unasked_bytes;
        if n_bytes > most {
            let (key, range) = (asked.key.to_string(), range.clone());
            return Err(Fault::Final(FetchError::RangeIgnored { key, range, n_bytes, most }));
        }
        let (options, seen) = self.get_options(None);
        let result = self.get(asked, options, &seen).await?;
        let mut whole = Transfer { asked, version: transfer.version.clone(), bytes: vec![] };
        if result.meta.size > most {
            return Err(Fault::Again(format!("an object of {n_bytes} bytes now has {}", result.meta.size)));
        }
        let version = self.take(&mut whole, None, result).await?;
        transfer.version = whole.version;
        transfer.bytes = whole.bytes[range.start as usize..range.end as usize].to_vec();
        Ok(version)
    }

    /// Appends the body of an answer, which must have `n_bytes`.
    async fn take_body(&self, transfer: &mut Transfer<'_>, result: GetResult, n_bytes: u64) -> Result<(), Fault> {
        if let Some(encoding) = result.attributes.get(&Attribute::ContentEncoding)
            && !encoding.eq_ignore_ascii_case("identity")
        {
            return Err(transfer.refused(format!("the body is coded by {}", encoding.as_ref())));
        }
        let cut = |n: u64, why: &str| Fault::Again(format!("the body was cut short after {n} of {n_bytes} bytes{why}"));
        let mut n = 0;
        let mut body = result.into_stream();
        loop {
            let Ok(part) = timeout(self.options.timeout, body.next()).await else {
                return Err(cut(n, &format!(": nothing came for {:?}", self.options.timeout)));
            };
            let part = match part {
                Some(Ok(part)) => part,
                Some(Err(e)) => return Err(cut(n, &format!(": {}", one_line(&e)))),
                None if n < n_bytes => return Err(cut(n, "")),
                None => return Ok(()),
            };
            self.counts.n_wire_bytes.fetch_add(part.len() as u64, Ordering::Relaxed);
            n += part.len() as u64;
            if n > n_bytes {
                // Nothing of this answer can be trusted.
                transfer.bytes.clear();
                return Err(Fault::Again(format!("a body of more than the {n_bytes} bytes that its head states")));
            }
            transfer.bytes.extend_from_slice(&part);
        }
    }
}

/// What comes after a fault that is no error.
enum Next {
    Again,
    Absent,
}

impl Transfer<'_> {
    /// The range to ask for next; `None`: the whole.
    fn rest(&self) -> Result<Option<Range<u64>>, FetchError> {
        let range = match (&self.asked.range, &self.version) {
            (Some(range), version) => {
                version.as_ref().map_or(Ok(()), |version| self.within(range, version))?;
                range.clone()
            }
            (None, Some(version)) => 0..version.n_bytes,
            (None, None) => return Ok(None),
        };
        let n_bytes = self.bytes.len() as u64;
        if self.asked.range.is_none() && n_bytes == 0 {
            return Ok(None);
        }
        Ok(Some(range.start + n_bytes..range.end))
    }

    /// Holds an answer to what is known of the object, and the asked range to the object's end.
    fn hold_to(&mut self, version: Version) -> Result<(), FetchError> {
        let key = || self.asked.key.to_string();
        if let Some(was) = &self.version
            && !was.is_same(&version)
        {
            return Err(FetchError::Changed { key: key(), was: was.to_string(), now: version.to_string() });
        }
        if let Some(range) = &self.asked.range {
            self.within(range, &version)?;
        }
        self.version = Some(version);
        Ok(())
    }

    fn within(&self, range: &Range<u64>, version: &Version) -> Result<(), FetchError> {
        let (range, n_bytes) = (range.clone(), version.n_bytes);
        match range.end > n_bytes {
            true => Err(FetchError::Short { key: self.asked.key.to_string(), range, n_bytes }),
            false => Ok(()),
        }
    }

    fn refused(&self, fault: String) -> Fault {
        refused(self.asked, fault)
    }
}

fn refused(asked: &Asked, fault: String) -> Fault {
    Fault::Final(FetchError::Refused { key: asked.key.to_string(), range: asked.range.clone(), fault })
}

fn fault(error: Error, seen: &Seen, asked: &Asked) -> Fault {
    let told = one_line(&error);
    match (&error, seen.answer()) {
        // `object_store` takes status 405 for it, too.
        (_, Answer::Absent) | (Error::NotFound { .. }, Answer::Folder) => Fault::Absent,
        (Error::PermissionDenied { .. } | Error::Unauthenticated { .. }, _) => refused(asked, told),
        (_, Answer::Final | Answer::Folder) => refused(asked, told),
        _ => Fault::Again(told),
    }
}

/// An error in one line of some hundred characters: servers send pages with theirs.
fn one_line(error: &Error) -> String {
    let words = error.to_string();
    let line: String = words.split_whitespace().collect::<Vec<_>>().join(" ");
    match line.char_indices().nth(300) {
        Some((end, _)) => format!("{} ...", &line[..end]),
        None => line,
    }
}
