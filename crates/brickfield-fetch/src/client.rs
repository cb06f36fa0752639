//! The client.

use std::ffi::OsStr;
use std::io;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use brickfield_core::Objects;
use futures_util::{StreamExt, stream};
use tokio::runtime::{Builder, Handle, Runtime};
use tokio::sync::Semaphore;

use crate::arrived::{Arrived, ArrivedError};
use crate::cache::{Cache, Found};
use crate::location::Place;
use crate::request::{Request, Wanted, by_object, merged};
use crate::transfer::{Asked, Asker, Brought, Counts};
use crate::version::Version;
use crate::{FetchError, FetchOptions};

/// A client of the objects of one store.
///
/// Its methods wait; several threads may call them at once, asynchronous ones included. What it knows of an object stays
/// known: objects are static, and one that changes is an error.
pub struct Client {
    place: Place,
    options: FetchOptions,
    cache: Mutex<Cache>,
    permits: Semaphore,
    total: Mutex<FetchedCounts>,
    /// `None` only while the client is dropped.
    runtime: Option<Runtime>,
}

/// What a fetch cost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct FetchedCounts {
    /// Requests that were sent, retries included.
    pub n_requests: u64,
    /// Attempts after the first.
    pub n_retries: u64,
    /// Bytes of bodies that came, in vain ones included; heads are not counted.
    pub n_wire_bytes: u64,
    /// Bytes that the cache had.
    pub n_cached_bytes: u64,
    /// Objects that there are not.
    pub n_absent: u64,
}

impl Client {
    /// Opens a folder, or a URL of scheme `file`, `http`, and with feature `cloud` `https` or `s3`. Nothing is asked for yet.
    ///
    /// An `s3` URL is `s3://BUCKET/PATH`; credentials, region and endpoint come from the environment (`AWS_REGION`,
    /// `AWS_ACCESS_KEY_ID` and so on; `AWS_SKIP_SIGNATURE=true` for public buckets).
    ///
    /// # Errors
    /// If an option is out of bounds, or the location cannot be one.
    pub fn open(location: impl AsRef<OsStr>, options: FetchOptions) -> Result<Client, FetchError> {
        options.check()?;
        let place = Place::open(location.as_ref(), &options)?;
        let runtime =
            Builder::new_multi_thread().worker_threads(1).thread_name("brickfield-fetch").enable_all().build();
        Ok(Client {
            place,
            cache: Mutex::new(Cache::new(options.max_cache_bytes)),
            permits: Semaphore::new(options.max_concurrent),
            total: Mutex::default(),
            runtime: Some(runtime.map_err(FetchError::Threads)?),
            options,
        })
    }

    /// Brings requests into the cache, where it does not have them.
    ///
    /// The objects are begun in the order of their first request; neighbouring ranges of one become one request. An object
    /// that there is not is no error: it is counted, and noted.
    ///
    /// # Errors
    /// The first that occurs; what is still under way is given up, what has come stays in the cache.
    pub fn fetch(&self, requests: &[Request]) -> Result<FetchedCounts, FetchError> {
        self.run(requests, &Nowhere)
    }

    /// Brings requests into `arrived`, from the cache or from the store: [`Client::fetch`] for a reader that sees what has
    /// arrived and nothing else. Absent objects are noted as absent.
    ///
    /// # Errors
    /// As [`Client::fetch`]; what has come is in `arrived`.
    pub fn deliver(&self, requests: &[Request], arrived: &Arrived) -> Result<FetchedCounts, FetchError> {
        self.run(requests, arrived)
    }

    /// What all requests cost since the client was opened.
    pub fn counts(&self) -> FetchedCounts {
        *self.total()
    }

    fn run(&self, requests: &[Request], target: &dyn Target) -> Result<FetchedCounts, FetchError> {
        let wanted = by_object(requests)?;
        let call =
            Call { client: self, counts: Counts::default(), n_cached_bytes: 0.into(), n_absent: 0.into(), target };
        let result = self.wait(call.bring(&wanted));
        let counts = call.counted();
        self.total().add(&counts);
        result.map(|()| counts)
    }

    /// Waits for a future; in a thread of its own where the caller's is one of another asynchronous runtime.
    fn wait<T: Send>(&self, future: impl Future<Output = T> + Send) -> T {
        let runtime = self.runtime.as_ref().expect("a client that is in use is not dropped");
        if Handle::try_current().is_err() {
            return runtime.block_on(future);
        }
        std::thread::scope(|scope| match scope.spawn(|| runtime.block_on(future)).join() {
            Ok(value) => value,
            Err(panic) => std::panic::resume_unwind(panic),
        })
    }

    // What a panic left behind in these is whole.
    fn cache(&self) -> MutexGuard<'_, Cache> {
        self.cache.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn total(&self) -> MutexGuard<'_, FetchedCounts> {
        self.total.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            // Waiting for it is not allowed inside of another one.
            runtime.shutdown_background();
        }
    }
}

impl std::fmt::Debug for Client {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Client")
            .field("store", &self.place.store)
            .field("options", &self.options)
            .finish_non_exhaustive()
    }
}

impl FetchedCounts {
    fn add(&mut self, other: &FetchedCounts) {
        self.n_requests += other.n_requests;
        self.n_retries += other.n_retries;
        self.n_wire_bytes += other.n_wire_bytes;
        self.n_cached_bytes += other.n_cached_bytes;
        self.n_absent += other.n_absent;
    }
}

/// From the cache, else by requests of its own. The error inside of an [`io::Error`] is a [`FetchError`].
impl Objects for Client {
    fn n_bytes(&self, key: &str) -> io::Result<Option<u64>> {
        let arrived = Arrived::default();
        // No bytes of an object are its size.
        self.run(&[Request::part(key, 0..0)], &arrived)?;
        arrived.n_bytes(key)
    }

    fn read(&self, key: &str, ranges: &[Range<u64>]) -> io::Result<Option<Vec<Vec<u8>>>> {
        let arrived = Arrived::default();
        let mut requests: Vec<_> = ranges.iter().map(|range| Request::part(key, range.clone())).collect();
        if requests.is_empty() {
            requests.push(Request::part(key, 0..0));
        }
        self.run(&requests, &arrived)?;
        arrived.read(key, ranges)
    }
}

/// Where bytes go beside the cache.
trait Target: Sync {
    fn present(&self, key: &str, version: &Version, offset: u64, bytes: &[u8]) -> Result<(), ArrivedError>;
    fn absent(&self, key: &str) -> Result<(), ArrivedError>;
}

struct Nowhere;

impl Target for Nowhere {
    fn present(&self, _: &str, _: &Version, _: u64, _: &[u8]) -> Result<(), ArrivedError> {
        Ok(())
    }

    fn absent(&self, _: &str) -> Result<(), ArrivedError> {
        Ok(())
    }
}

impl Target for Arrived {
    fn present(&self, key: &str, version: &Version, offset: u64, bytes: &[u8]) -> Result<(), ArrivedError> {
        self.insert(key, Some(version.n_bytes), offset, bytes)
    }

    fn absent(&self, key: &str) -> Result<(), ArrivedError> {
        self.insert_absent(key)
    }
}

/// One call of a client.
struct Call<'a> {
    client: &'a Client,
    counts: Counts,
    n_cached_bytes: AtomicU64,
    n_absent: AtomicU64,
    target: &'a dyn Target,
}

impl Call<'_> {
    async fn bring(&self, wanted: &[Wanted]) -> Result<(), FetchError> {
        let mut asked = vec![];
        for object in wanted {
            asked.extend(self.plan(object)?);
        }
        let transfers: Vec<_> = asked.iter().map(|asked| self.transfer(asked)).collect();
        let mut under_way = stream::iter(transfers).buffer_unordered(self.client.options.max_concurrent);
        while let Some(result) = under_way.next().await {
            result?;
        }
        Ok(())
    }

    /// What to ask for of an object, after what the cache has of it.
    fn plan(&self, wanted: &Wanted) -> Result<Vec<Asked>, FetchError> {
        let key = &wanted.key;
        let path = self.client.place.path(key)?;
        let mut cache = self.client.cache();
        let version = match cache.found(key) {
            Found::Absent => return self.absent(key).map(|()| vec![]),
            Found::Present(version) => Some(version),
            Found::Unknown => None,
        };
        let ask =
            |range: Option<Range<u64>>| Asked { key: key.clone(), path: path.clone(), range, version: version.clone() };
        let Some(version) = &version else {
            let merged = merged(wanted.ranges.clone(), self.client.options.max_gap_bytes);
            return Ok(if wanted.whole { vec![ask(None)] } else { merged.into_iter().map(|r| ask(Some(r))).collect() });
        };
        self.target.present(key, version, 0, &[])?;
        let whole = wanted.whole.then_some(0..version.n_bytes);
        let ranges = merged(wanted.ranges.iter().cloned().chain(whole).filter(|r| !r.is_empty()).collect(), 0);
        let mut missing = vec![];
        for range in ranges {
            let mut taken = Ok(());
            missing.extend(cache.take(key, &range, |start, bytes| {
                self.n_cached_bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
                if taken.is_ok() {
                    taken = self.target.present(key, version, start, bytes);
                }
            }));
            taken?;
        }
        Ok(merged(missing, self.client.options.max_gap_bytes).into_iter().map(|range| ask(Some(range))).collect())
    }

    async fn transfer(&self, asked: &Asked) -> Result<(), FetchError> {
        let client = self.client;
        let asker = Asker {
            store: &*client.place.store,
            reach: client.place.reach,
            options: &client.options,
            permits: &client.permits,
            counts: &self.counts,
        };
        let brought = match &asked.range {
            Some(range) if range.is_empty() => {
                let of = |version| Brought { version, offset: 0, bytes: vec![] };
                asker.version(asked).await?.map(of)
            }
            _ => asker.bring(asked).await?,
        };
        match brought {
            Some(brought) => self.keep(&asked.key, &brought),
            None => {
                client.cache().insert_absent(&asked.key);
                self.absent(&asked.key)
            }
        }
    }

    fn keep(&self, key: &Arc<str>, brought: &Brought) -> Result<(), FetchError> {
        let Brought { version, offset, bytes } = brought;
        let mut cache = self.client.cache();
        // Ranges of one object may have been asked for at once, when nothing was known of it.
        if let Found::Present(was) = cache.found(key)
            && !was.is_same(version)
        {
            return Err(FetchError::Changed { key: key.to_string(), was: was.to_string(), now: version.to_string() });
        }
        let differs = |at| ArrivedError::Differs { key: key.to_string(), at };
        cache.insert(key, version, *offset, bytes).map_err(|e| differs(e.at))?;
        Ok(self.target.present(key, version, *offset, bytes)?)
    }

    fn absent(&self, key: &str) -> Result<(), FetchError> {
        self.n_absent.fetch_add(1, Ordering::Relaxed);
        Ok(self.target.absent(key)?)
    }

    fn counted(&self) -> FetchedCounts {
        let of = |count: &AtomicU64| count.load(Ordering::Relaxed);
        FetchedCounts {
            n_requests: of(&self.counts.n_requests),
            n_retries: of(&self.counts.n_retries),
            n_wire_bytes: of(&self.counts.n_wire_bytes),
            n_cached_bytes: of(&self.n_cached_bytes),
            n_absent: of(&self.n_absent),
        }
    }
}
