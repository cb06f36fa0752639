//! A folder and a web server of it are one store.

use std::io::ErrorKind;
use std::path::Path;

use brickfield_core::Objects;
use brickfield_fetch::{Arrived, Client, FetchError, FetchOptions, NotArrived, Request};
use brickfield_serve::{ServeOptions, Server};
use tempfile::TempDir;

/// Object `i` of a store: of several sizes, no two alike.
pub(crate) fn object(i: usize) -> Vec<u8> {
    let n_bytes = [1, 100, 4096, 70_000, 300_000][i % 5] + i;
    (0..n_bytes).map(|b| (b * 31 + i * 7 + b / 251) as u8).collect()
}

pub(crate) fn key(i: usize) -> String {
    format!("0/c/{i}/brick")
}

/// A folder with objects.
pub(crate) fn store(n_objects: usize) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for i in 0..n_objects {
        let path = folder.path().join(key(i));
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, object(i)).unwrap();
    }
    folder
}

fn in_both(folder: &Path, check: impl Fn(&Client)) {
    let server = Server::start(folder, ServeOptions::default()).unwrap();
    check(&Client::open(folder, FetchOptions::default()).unwrap());
    check(&Client::open(format!("file://{}", folder.display()), FetchOptions::default()).unwrap());
    check(&Client::open(server.url(), FetchOptions::default()).unwrap());
    check(&Client::open(server.url() + "/", FetchOptions::default()).unwrap());
}

#[test]
fn ranges_and_sizes_are_those_of_the_files() {
    let folder = store(5);
    std::fs::write(folder.path().join("empty"), b"").unwrap();
    in_both(folder.path(), |client| {
        let bytes = object(3);
        let read = client.read(&key(3), &[5..9, 60_000..70_003, 0..0, 7..30]).unwrap().unwrap();
        assert_eq!(read, [&bytes[5..9], &bytes[60_000..70_003], &[], &bytes[7..30]]);
        assert_eq!(client.n_bytes(&key(3)).unwrap(), Some(70_003));
        assert_eq!(client.n_bytes(&key(2)).unwrap(), Some(4098));
        assert_eq!(client.read(&key(2), &[]).unwrap(), Some(vec![]));
        assert_eq!(
            (client.n_bytes("empty").unwrap(), client.read("empty", &[0..0]).unwrap()),
            (Some(0), Some(vec![vec![]]))
        );
        let arrived = Arrived::default();
        client.deliver(&[Request::whole("empty"), Request::whole(key(4))], &arrived).unwrap();
        assert_eq!(arrived.n_bytes("empty").unwrap(), Some(0));
        assert_eq!(arrived.read(&key(4), &[0..300_004]).unwrap(), Some(vec![object(4)]));
    });
}

#[test]
fn an_absent_object_is_asked_for_once() {
    let folder = store(1);
    in_both(folder.path(), |client| {
        for gone in ["0/c/7/brick", "0/c", "zarr.json"] {
            let before = client.counts();
            assert_eq!((client.n_bytes(gone).unwrap(), client.read(gone, &[0..4]).unwrap()), (None, None));
            let arrived = Arrived::default();
            let counts = client.deliver(&[Request::part(gone, 0..9), Request::whole(gone)], &arrived).unwrap();
            assert_eq!((counts.n_requests, counts.n_absent), (0, 1));
            assert_eq!((arrived.n_bytes(gone).unwrap(), arrived.read(gone, &[4..9]).unwrap()), (None, None));
            let after = client.counts();
            assert_eq!((after.n_requests - before.n_requests, after.n_retries), (1, 0), "{gone}");
        }
    });
}

#[test]
fn a_range_behind_the_end_is_an_error_that_names_both() {
    let folder = store(2);
    in_both(folder.path(), |client| {
        for (range, asked) in [(90..102, "90..102"), (101..102, "101..102"), (5000..5001, "5000..5001")] {
            let error = client.fetch(&[Request::part(key(1), range.clone())]).unwrap_err();
            assert_eq!(error.to_string(), format!("0/c/1/brick has 101 bytes; bytes {asked} were asked for"));
            let error = client.read(&key(1), &[0..4, range]).unwrap_err();
            assert_eq!((error.kind(), NotArrived::within(&error)), (ErrorKind::UnexpectedEof, None));
        }
        assert_eq!(client.counts().n_retries, 0);
        let reversed = Request { key: key(1), range: Some(std::ops::Range { start: 9, end: 4 }) };
        assert!(matches!(client.fetch(&[reversed]), Err(FetchError::BadRange { .. })));
        assert!(matches!(client.fetch(&[Request::whole("../secret")]), Err(FetchError::BadKey { .. })));
    });
}

#[test]
fn what_the_cache_has_is_not_asked_for_again() {
    let folder = store(5);
    in_both(folder.path(), |client| {
        let first = client.fetch(&[Request::part(key(4), 1000..2000), Request::part(key(4), 90_000..90_100)]).unwrap();
        assert_eq!((first.n_requests, first.n_wire_bytes), (2, 1100));
        let again = client.fetch(&[Request::part(key(4), 1500..1600)]).unwrap();
        assert_eq!((again.n_requests, again.n_cached_bytes), (0, 100));
        let more = client.fetch(&[Request::part(key(4), 900..2100)]).unwrap();
        // The parts before and behind lie within the gap of 4 KiB, and become one.
        assert_eq!((more.n_requests, more.n_wire_bytes, more.n_cached_bytes), (1, 1200, 1000));
        assert_eq!(client.read(&key(4), &[900..2100]).unwrap().unwrap(), [&object(4)[900..2100]]);
    });
    let options = FetchOptions { max_cache_bytes: 1000, ..FetchOptions::default() };
    let client = Client::open(folder.path(), options).unwrap();
    for _ in 0..2 {
        assert_eq!(client.read(&key(4), &[0..900]).unwrap().unwrap(), [&object(4)[..900]]);
        assert_eq!(client.read(&key(3), &[0..70_003]).unwrap().unwrap(), [object(3)]);
    }
    assert_eq!(client.counts().n_requests, 4, "what does not fit is asked for again");
}

#[test]
fn neighbours_become_one_request_and_the_gap_is_an_option() {
    let folder = store(5);
    let ask = |max_gap_bytes| {
        let client = Client::open(folder.path(), FetchOptions { max_gap_bytes, ..FetchOptions::default() }).unwrap();
        let requests = [0..10, 200..210, 50..60].map(|range| Request::part(key(4), range));
        let counts = client.fetch(&requests).unwrap();
        (counts.n_requests, counts.n_wire_bytes)
    };
    assert_eq!([ask(4096), ask(40), ask(39)], [(1, 210), (2, 70), (3, 30)]);
}

#[test]
fn a_changed_object_is_an_error_not_a_mixture() {
    let folder = store(5);
    let server = Server::start(folder.path(), ServeOptions::default()).unwrap();
    for location in [folder.path().display().to_string(), server.url()] {
        std::fs::write(folder.path().join(key(4)), object(4)).unwrap();
        let client = Client::open(location, FetchOptions::default()).unwrap();
        client.fetch(&[Request::part(key(4), 0..100)]).unwrap();
        // A server's entity tag has the time of the change.
        std::thread::sleep(std::time::Duration::from_millis(1100));
        std::fs::write(folder.path().join(key(4)), vec![9; object(4).len()]).unwrap();
        let error = client.fetch(&[Request::part(key(4), 50_000..50_100)]).unwrap_err();
        assert!(matches!(&error, FetchError::Changed { .. }), "{error}");
        assert!(error.to_string().starts_with("0/c/4/brick changed while it was fetched: 300004 bytes, "), "{error}");
    }
}

#[test]
fn threads_and_asynchronous_callers_may_wait() {
    let folder = store(10);
    let server = Server::start(folder.path(), ServeOptions::default()).unwrap();
    let client = Client::open(server.url(), FetchOptions::default()).unwrap();
    std::thread::scope(|scope| {
        for i in 0..10 {
            let client = &client;
            scope.spawn(move || {
                let n_bytes = object(i).len() as u64;
                assert_eq!(client.read(&key(i), &[0..n_bytes]).unwrap().unwrap(), [object(i)]);
            });
        }
    });
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).build().unwrap();
    let n_bytes = runtime.block_on(async move {
        let client = Client::open(server.url(), FetchOptions::default()).unwrap();
        client.n_bytes(&key(3)).unwrap()
    });
    assert_eq!(n_bytes, Some(70_003));
}
