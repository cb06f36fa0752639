//! Faults to order, and the end of a server.

use std::net::TcpStream;
use std::time::{Duration, Instant};

use brickfield_serve::{Faults, ServeOptions};

use crate::ask::{LONG, answer_to, get, get_range, object, served};

fn faulty(faults: Faults) -> ServeOptions {
    ServeOptions { faults, ..ServeOptions::default() }
}

#[test]
fn each_third_body_is_cut_where_it_is_ordered() {
    let (_folder, server) = served(faulty(Faults { cut_every: 3, cut_at: 0.25, ..Faults::default() }));
    let answers: Vec<_> = (0..6).map(|_| get(&server, "/c/0")).collect();
    let lengths: Vec<_> = answers.iter().map(|answer| answer.body.len()).collect();
    assert_eq!(lengths, [1000, 1000, 250, 1000, 1000, 250]);
    assert_eq!(answers[2].header("content-length"), "1000");
    assert_eq!(answers[2].body, &object()[..250]);
}

#[test]
fn each_second_range_is_ignored() {
    let (_folder, server) = served(faulty(Faults { ignore_range_every: 2, ..Faults::default() }));
    let statuses: Vec<_> = (0..4).map(|_| get_range(&server, "bytes=3-4")).map(|a| (a.status, a.body.len())).collect();
    assert_eq!(statuses, [(206, 2), (200, 1000), (206, 2), (200, 1000)]);
}

#[test]
fn each_second_range_is_stated_wrong() {
    let (_folder, server) = served(faulty(Faults { wrong_range_every: 2, ..Faults::default() }));
    let stated: Vec<_> = (0..4).map(|_| get_range(&server, "bytes=3-4").header("content-range").to_owned()).collect();
    assert_eq!(stated, ["bytes 3-4/1000", "bytes 4-5/1000", "bytes 3-4/1000", "bytes 4-5/1000"]);
}

#[test]
fn each_second_request_is_unavailable() {
    let (_folder, server) = served(faulty(Faults { unavailable_every: 2, ..Faults::default() }));
    let statuses: Vec<_> = (0..4).map(|_| get(&server, "/c/0").status).collect();
    assert_eq!(statuses, [200, 503, 200, 503]);
}

#[test]
fn after_its_requests_the_server_is_gone() {
    let (_folder, server) = served(faulty(Faults { die_after: Some(2), ..Faults::default() }));
    let address = server.address();
    assert_eq!([get(&server, "/c/0").status, get(&server, "/c/0").status], [200, 200]);
    assert!(answer_to(address, b"GET /c/0 HTTP/1.1\r\nhost: here\r\n\r\n").is_none());
    server.wait();
    assert!(TcpStream::connect(address).is_err());
}

#[test]
fn a_server_ends_at_once_whatever_it_does() {
    let (_folder, server) = served(ServeOptions::default());
    let address = server.address();
    let _idle = TcpStream::connect(address).unwrap();
    let begin = Instant::now();
    server.shutdown();
    assert!(begin.elapsed() < LONG);
    std::thread::sleep(Duration::from_millis(10));
    assert!(TcpStream::connect(address).is_err());
}
