//! A server with faults: the same bytes or an error, never others.

use std::time::{Duration, Instant};

use brickfield_core::Objects;
use brickfield_fetch::{Arrived, Client, FetchError, FetchOptions, NotArrived, Request};
use brickfield_serve::{Faults, ServeOptions, Server};

use crate::folder::{key, object, store};

const N_OBJECTS: usize = 10;

/// Long enough for any machine; a test that waits for it has failed.
const LONG: Duration = Duration::from_secs(60);

pub(crate) fn quick() -> FetchOptions {
    FetchOptions {
        first_backoff: Duration::from_millis(2),
        timeout: Duration::from_secs(20),
        ..FetchOptions::default()
    }
}

/// Some parts of the objects, then all of them.
fn requests() -> Vec<Request> {
    let parts = |i: usize| {
        let n_bytes = object(i).len() as u64;
        [0..n_bytes / 3, n_bytes - n_bytes / 4..n_bytes].map(|range| Request::part(key(i), range))
    };
    let wholes = (0..N_OBJECTS).map(|i| Request::whole(key(i)));
    (0..N_OBJECTS).step_by(2).flat_map(parts).chain(wholes).chain([Request::whole("gone")]).collect()
}

/// Fetches by several calls, as a viewer does, until one fails.
fn deliver(client: &Client, arrived: &Arrived) -> Result<(), FetchError> {
    requests().chunks(4).try_for_each(|some| client.deliver(some, arrived).map(drop))
}

/// No byte that has arrived is another one; objects that have arrived whole.
fn check(arrived: &Arrived) -> usize {
    let is_whole = |i: &usize| {
        let (key, object) = (key(*i), object(*i));
        let missing = arrived.missing(&key, 0..object.len() as u64);
        let mut at = 0;
        for gap in missing.iter().cloned().chain([object.len() as u64..object.len() as u64]) {
            if at < gap.start {
                let read = arrived.read(&key, &[at..gap.start]).unwrap().unwrap();
                assert!(read[0] == object[at as usize..gap.start as usize], "{key}: bytes {at}..{}", gap.start);
            }
            at = gap.end;
        }
        missing.is_empty()
    };
    (0..N_OBJECTS).filter(is_whole).count()
}

#[test]
fn with_every_fault_that_passes_the_bytes_are_the_same() {
    let folder = store(N_OBJECTS);
    let none = Faults::default();
    for faults in [
        none,
        Faults { cut_every: 2, ..none },
        Faults { cut_every: 3, cut_at: 0.0, ..none },
        Faults { cut_every: 2, cut_at: 0.99, ..none },
        Faults { ignore_range_every: 1, ..none },
        Faults { ignore_range_every: 2, cut_every: 3, ..none },
        Faults { unavailable_every: 3, ..none },
        Faults { wrong_range_every: 2, ..none },
        Faults { unavailable_every: 5, wrong_range_every: 3, cut_every: 4, cut_at: 0.3, ignore_range_every: 7, ..none },
    ] {
        let server = Server::start(folder.path(), ServeOptions { faults, ..ServeOptions::default() }).unwrap();
        let client = Client::open(server.url(), FetchOptions { max_retries: 12, ..quick() }).unwrap();
        let arrived = Arrived::default();
        deliver(&client, &arrived).unwrap_or_else(|e| panic!("{faults:?}: {e}"));
        assert_eq!((check(&arrived), arrived.n_bytes("gone").unwrap()), (N_OBJECTS, None), "{faults:?}");
        let counts = client.counts();
        assert_eq!(server.counts().n_requests, counts.n_requests, "{faults:?}");
        let is_tried_again = faults != none && faults != Faults { ignore_range_every: 1, ..none };
        assert_eq!(counts.n_retries > 0, is_tried_again, "{faults:?}");
    }
}

#[test]
fn with_every_fault_that_stays_there_is_an_error_that_names_it() {
    let folder = store(N_OBJECTS);
    let none = Faults::default();
    let few = FetchOptions { max_retries: 2, max_unasked_bytes: 100_000, ..quick() };
    for (faults, told) in [
        (
            Faults { cut_every: 1, cut_at: 0.0, ..none },
            "bytes 7..90000 of 0/c/4/brick did not arrive in 3 attempts; the last: the body was cut short after 0 of 89993 bytes",
        ),
        (
            Faults { unavailable_every: 1, ..none },
            "bytes 7..90000 of 0/c/4/brick did not arrive in 3 attempts; the last: ",
        ),
        (
            Faults { wrong_range_every: 1, ..none },
            "bytes 7..90000 of 0/c/4/brick did not arrive in 3 attempts; the last: ",
        ),
        (
            Faults { ignore_range_every: 1, ..none },
            "the server ignores ranges: asked for bytes 7..90000 of 0/c/4/brick, it sends all 300004; the most that is fetched whole is 100000",
        ),
    ] {
        let server = Server::start(folder.path(), ServeOptions { faults, ..ServeOptions::default() }).unwrap();
        let client = Client::open(server.url(), few.clone()).unwrap();
        let arrived = Arrived::default();
        let error = client.deliver(&[Request::part(key(4), 7..90_000)], &arrived).unwrap_err().to_string();
        assert!(error.starts_with(told), "{faults:?}: {error}");
        let last = if faults.unavailable_every == 1 {
            "503"
        } else if faults.wrong_range_every == 1 {
            "8..90001"
        } else {
            ""
        };
        assert!(error.contains(last), "{error}");
        let error = arrived.read(&key(4), &[7..90_000]).unwrap_err();
        assert!(NotArrived::within(&error).is_some(), "{error}");
        check(&arrived);
    }
}

#[test]
fn a_cut_body_goes_on_where_it_stopped() {
    let folder = store(N_OBJECTS);
    let faults = Faults { cut_every: 2, ..Faults::default() };
    let server = Server::start(folder.path(), ServeOptions { faults, ..ServeOptions::default() }).unwrap();
    let client = Client::open(server.url(), quick()).unwrap();
    client.fetch(&[Request::whole(key(0))]).unwrap();
    let counts = client.fetch(&[Request::whole(key(4))]).unwrap();
    assert_eq!((counts.n_requests, counts.n_retries, counts.n_wire_bytes), (2, 1, object(4).len() as u64));
}

#[test]
fn a_dead_server_is_an_error_and_what_had_come_stays() {
    let folder = store(N_OBJECTS);
    for n_requests in [0, 1, 5, 9] {
        let faults = Faults { die_after: Some(n_requests), ..Faults::default() };
        let server = Server::start(folder.path(), ServeOptions { faults, ..ServeOptions::default() }).unwrap();
        let client = Client::open(server.url(), FetchOptions { max_concurrent: 2, max_retries: 3, ..quick() }).unwrap();
        let arrived = Arrived::default();
        let begin = Instant::now();
        let error = deliver(&client, &arrived).unwrap_err();
        assert!(matches!(&error, FetchError::Failed { n_attempts: 4, .. }), "{error}");
        assert!(begin.elapsed() < LONG);
        assert!(check(&arrived) < N_OBJECTS);
    }
}

#[test]
fn a_server_that_comes_back_is_gone_on_with() {
    let folder = store(N_OBJECTS);
    let faults = Faults { die_after: Some(4), ..Faults::default() };
    let server = Server::start(folder.path(), ServeOptions { faults, ..ServeOptions::default() }).unwrap();
    let address = server.address();
    let backoff = Duration::from_millis(20);
    let options = FetchOptions { max_retries: 60, first_backoff: backoff, max_backoff: backoff, ..quick() };
    let client = Client::open(server.url(), options).unwrap();
    let arrived = Arrived::default();
    std::thread::scope(|scope| {
        let again = scope.spawn(|| {
            server.wait();
            Server::start(folder.path(), ServeOptions { address, ..ServeOptions::default() }).unwrap()
        });
        deliver(&client, &arrived).unwrap();
        again.join().unwrap().shutdown();
    });
    assert_eq!(check(&arrived), N_OBJECTS);
    assert!(client.counts().n_retries > 0);
}
