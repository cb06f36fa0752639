//! Answers that are wrong, each in its way.

use std::time::Duration;

use brickfield_fetch::{Arrived, Client, FetchOptions, Request};

use crate::faults::quick;
use crate::scripted::{Scripted, answer};

/// Attempts of a client that is answered so, and its error.
fn refused(lines: &str, body: &[u8]) -> (usize, String) {
    let told = answer("206 Partial Content", lines, body);
    let server = Scripted::start(move |_, _| told.clone());
    let client = Client::open(&server.url, FetchOptions { max_retries: 1, ..quick() }).unwrap();
    let arrived = Arrived::default();
    let error = client.deliver(&[Request::part("c/0", 2..6)], &arrived).unwrap_err().to_string();
    assert_eq!(arrived.n_arrived_bytes(), 0, "{lines}");
    (server.n_requests(), error)
}

#[test]
fn a_right_answer_is_taken() {
    let server = Scripted::start(|_, head| {
        assert!(head.to_lowercase().contains("range: bytes=2-5\r\n"), "{head}");
        answer("206 Partial Content", "content-range: bytes 2-5/10\r\ncontent-length: 4\r\n", b"2345")
    });
    let client = Client::open(&server.url, quick()).unwrap();
    let arrived = Arrived::default();
    client.deliver(&[Request::part("c/0", 2..6)], &arrived).unwrap();
    assert_eq!((arrived.n_arrived_bytes(), server.n_requests()), (4, 1));
}

#[test]
fn an_answer_that_is_not_what_was_asked_for_is_tried_again_and_told() {
    for (lines, body) in [
        // Another range, a shorter one, a longer one.
        ("content-range: bytes 3-6/10\r\ncontent-length: 4\r\n", b"3456".as_slice()),
        ("content-range: bytes 2-4/10\r\ncontent-length: 3\r\n", b"234"),
        ("content-range: bytes 2-6/10\r\ncontent-length: 5\r\n", b"23456"),
        // No range, or none that can be read.
        ("content-length: 4\r\n", b"2345"),
        ("content-range: bytes 2-5/*\r\ncontent-length: 4\r\n", b"2345"),
        ("content-range: bytes -5/10\r\ncontent-length: 4\r\n", b"2345"),
        ("content-range: bytes 5-2/10\r\ncontent-length: 4\r\n", b"2345"),
        // A body that is shorter or longer than the range; without a length.
        ("content-range: bytes 2-5/10\r\ncontent-length: 3\r\n", b"234"),
        ("content-range: bytes 2-5/10\r\ncontent-length: 5\r\n", b"23456"),
        ("content-range: bytes 2-5/10\r\ncontent-length: 4\r\n", b"23"),
        ("content-range: bytes 2-5/10\r\n", b"2345"),
        ("content-range: bytes 2-5/10\r\ntransfer-encoding: chunked\r\n", b"2\r\n23\r\n"),
    ] {
        let (n_requests, error) = refused(lines, body);
        let told = "bytes 2..6 of c/0 did not arrive in 2 attempts; the last: ";
        assert!(error.starts_with(told) && error.len() > told.len(), "{lines}: {error}");
        assert_eq!(n_requests, 2, "{lines}");
    }
}

#[test]
fn a_body_that_is_coded_is_refused() {
    let lines = "content-range: bytes 2-5/10\r\ncontent-length: 4\r\ncontent-encoding: gzip\r\n";
    let (n_requests, error) = refused(lines, b"\x1f\x8b..");
    assert_eq!((n_requests, error.as_str()), (1, "bytes 2..6 of c/0 were refused: the body is coded by gzip"));
}

#[test]
fn an_object_that_grows_between_two_attempts_is_not_put_together() {
    let server = Scripted::start(|n, head| match n {
        1 => {
            answer("206 Partial Content", "content-range: bytes 2-5/10\r\netag: \"a\"\r\ncontent-length: 4\r\n", b"23")
        }
        _ => {
            assert!(head.to_lowercase().contains("range: bytes=4-5\r\n"), "{head}");
            answer("206 Partial Content", "content-range: bytes 4-5/10\r\netag: \"b\"\r\ncontent-length: 2\r\n", b"zz")
        }
    });
    let client = Client::open(&server.url, quick()).unwrap();
    let error = client.fetch(&[Request::part("c/0", 2..6)]).unwrap_err().to_string();
    let told = "c/0 changed while it was fetched: 10 bytes, entity tag \"a\", now 10 bytes, entity tag \"b\"";
    assert_eq!(error, told);
}

#[test]
fn without_a_tag_a_cut_body_begins_anew() {
    let server = Scripted::start(|n, head| {
        assert!(head.to_lowercase().contains("range: bytes=2-5\r\n"), "{head}");
        let body: &[u8] = if n == 1 { b"xx" } else { b"2345" };
        answer("206 Partial Content", "content-range: bytes 2-5/10\r\ncontent-length: 4\r\n", body)
    });
    let client = Client::open(&server.url, quick()).unwrap();
    let counts = client.fetch(&[Request::part("c/0", 2..6)]).unwrap();
    assert_eq!((counts.n_requests, counts.n_wire_bytes), (2, 6));
    assert_eq!(brickfield_core::Objects::read(&client, "c/0", &[2..6]).unwrap().unwrap(), [b"2345"]);
}

#[test]
fn statuses_that_stay_are_not_tried_again() {
    let refused = ["400 Bad Request", "403 Forbidden", "405 Method Not Allowed", "410 Gone", "301 Moved Permanently"];
    for status in refused {
        let server = Scripted::start(move |_, _| answer(status, "location: /there\r\ncontent-length: 0\r\n", b""));
        let client = Client::open(&server.url, quick()).unwrap();
        let error = client.fetch(&[Request::whole("c/0")]).unwrap_err().to_string();
        assert!(error.starts_with("the bytes of c/0 were refused: "), "{status}: {error}");
        assert_eq!(server.n_requests(), 1, "{status}");
    }
    let server = Scripted::start(|n, _| match n {
        1 => answer("429 Too Many Requests", "content-length: 0\r\n", b""),
        2 => answer("500 Internal Server Error", "content-length: 100000\r\n", &[b'x'; 100_000]),
        _ => answer("200 OK", "content-length: 3\r\n", b"abc"),
    });
    let client = Client::open(&server.url, quick()).unwrap();
    assert_eq!(client.fetch(&[Request::whole("c/0")]).unwrap().n_retries, 2);
}

#[test]
fn silence_ends_with_the_timeout_and_the_retries() {
    let server = Scripted::start(|n, _| match n {
        // A head, or no answer at all: the thread holds the connection.
        1 => answer("200 OK", "content-length: 3\r\n", b""),
        _ => {
            std::thread::sleep(Duration::from_secs(20));
            vec![]
        }
    });
    let options = FetchOptions { max_retries: 1, timeout: Duration::from_millis(200), ..quick() };
    let client = Client::open(&server.url, options).unwrap();
    let error = client.fetch(&[Request::whole("c/0")]).unwrap_err().to_string();
    assert_eq!(error, "the bytes of c/0 did not arrive in 2 attempts; the last: no answer in 200ms");
}

#[test]
fn no_more_requests_are_under_way_than_allowed() {
    let server = Scripted::start(|_, _| {
        std::thread::sleep(Duration::from_millis(20));
        answer("200 OK", "content-length: 3\r\n", b"abc")
    });
    let client = Client::open(&server.url, FetchOptions { max_concurrent: 3, ..quick() }).unwrap();
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let client = &client;
            scope.spawn(move || {
                let requests: Vec<_> = (0..6).map(|i| Request::whole(format!("c/{thread}/{i}"))).collect();
                client.fetch(&requests).unwrap();
            });
        }
    });
    assert_eq!((server.n_requests(), client.counts().n_requests), (24, 24));
    assert!((2..=3).contains(&server.most_at_once()), "{}", server.most_at_once());
}
