//! Clients that ask too much, or too slowly, and the slow link.

use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use brickfield_serve::{Limits, ServeOptions, Throttle};

use crate::ask::{LONG, answer_to, ask, get, object, read_all, served};

fn limited(limits: Limits) -> ServeOptions {
    ServeOptions { limits, ..ServeOptions::default() }
}

#[test]
fn a_head_that_is_too_large_is_refused() {
    let limits = Limits { max_head_bytes: 4096, max_head_lines: 16, ..Limits::default() };
    let (_folder, server) = served(limited(limits));
    let long = |n: usize| "x".repeat(n);
    assert_eq!(ask(server.address(), "GET", "/c/0", &format!("x-long: {}\r\n", long(2000))).status, 200);
    assert_eq!(ask(server.address(), "GET", "/c/0", &format!("x-long: {}\r\n", long(5000))).status, 431);
    let lines = |n: usize| (0..n).map(|i| format!("x-{i}: 1\r\n")).collect::<String>();
    assert_eq!(ask(server.address(), "GET", "/c/0", &lines(12)).status, 200);
    assert_eq!(ask(server.address(), "GET", "/c/0", &lines(40)).status, 431);
    let path = format!("/{}", long(5000));
    assert!([414, 431].contains(&ask(server.address(), "GET", &path, "").status));
    // Much more than any buffer holds.
    let flood = format!("GET /c/0 HTTP/1.1\r\nx: {}", long(4 << 20));
    assert!(answer_to(server.address(), flood.as_bytes()).is_none_or(|answer| answer.status == 431));
    assert_eq!(get(&server, "/c/0").body, object());
}

#[test]
fn no_request_is_answered_by_400() {
    let (_folder, server) = served(ServeOptions::default());
    for nonsense in ["\r\n\r\n\r\nHELLO\r\n\r\n", "GET /c/0 HTTP/9.9\r\n\r\n", "\u{1}\u{2}\u{3}\r\n\r\n", "GET\r\n\r\n"]
    {
        let answer = answer_to(server.address(), nonsense.as_bytes());
        assert!(answer.is_none_or(|answer| answer.status == 400), "{nonsense:?}");
    }
    assert_eq!(get(&server, "/c/0").body, object());
}

#[test]
fn a_head_that_does_not_end_is_answered_by_408_and_silence_by_none() {
    let limits = Limits { head_timeout: Duration::from_millis(100), ..Limits::default() };
    let (_folder, server) = served(limited(limits));
    let answer = answer_to(server.address(), b"GET /c/0 HTTP/1.1\r\nhost: he");
    assert_eq!(answer.unwrap().status, 408);
    let mut silent = TcpStream::connect(server.address()).unwrap();
    silent.set_read_timeout(Some(LONG)).unwrap();
    assert_eq!(silent.read(&mut [0]).unwrap(), 0, "closed");
    // One byte now and then does not hold it open either.
    let mut dripping = TcpStream::connect(server.address()).unwrap();
    dripping.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
    let begin = Instant::now();
    let mut is_closed = false;
    while !is_closed && begin.elapsed() < LONG {
        let wrote = dripping.write_all(b"x");
        is_closed = wrote.is_err()
            || !matches!(dripping.read(&mut [0]), Err(e) if [ErrorKind::WouldBlock, ErrorKind::TimedOut].contains(&e.kind()));
    }
    assert!(is_closed);
}

#[test]
fn a_client_that_takes_nothing_is_left() {
    let limits = Limits { write_timeout: Duration::from_millis(200), ..Limits::default() };
    let (folder, server) = served(limited(limits));
    // More than the buffers between the two hold.
    let n_bytes = 64 << 20;
    File::create(folder.path().join("large")).unwrap().set_len(n_bytes).unwrap();
    let mut stream = TcpStream::connect(server.address()).unwrap();
    stream.write_all(b"GET /large HTTP/1.1\r\nhost: here\r\n\r\n").unwrap();
    let begin = Instant::now();
    let mut before = u64::MAX;
    while before != server.counts().n_sent_bytes && begin.elapsed() < LONG {
        before = server.counts().n_sent_bytes;
        std::thread::sleep(Duration::from_millis(600));
    }
    stream.set_read_timeout(Some(LONG)).unwrap();
    assert!((read_all(&mut stream).len() as u64) < n_bytes);
    assert_eq!(get(&server, "/c/0").body, object());
}

#[test]
fn connections_beyond_the_bound_wait() {
    let (_folder, server) = served(limited(Limits { max_connections: 2, ..Limits::default() }));
    let held: Vec<_> = (0..2).map(|_| TcpStream::connect(server.address()).unwrap()).collect();
    let mut third = TcpStream::connect(server.address()).unwrap();
    third.write_all(b"GET /c/0 HTTP/1.1\r\nhost: here\r\nconnection: close\r\n\r\n").unwrap();
    third.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
    assert!(third.read(&mut [0]).is_err(), "nothing yet");
    drop(held);
    third.set_read_timeout(Some(LONG)).unwrap();
    assert!(read_all(&mut third).ends_with(&object()));
}

#[test]
fn the_link_is_one_for_all_and_each_request_waits() {
    // 1,000 bytes are 0.2 s on a link of 40 kbit/s, two times 0.4 s, and their heads come on top.
    let latency = Duration::from_millis(100);
    let throttle = Some(Throttle { bits_per_second: 40e3, latency });
    let (_folder, server) = served(ServeOptions { throttle, ..ServeOptions::default() });
    let begin = Instant::now();
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| assert_eq!(get(&server, "/c/0").body, object()));
        }
    });
    let on_link = Duration::from_secs_f64(server.counts().n_sent_bytes as f64 * 8.0 / 40e3);
    assert!(on_link >= Duration::from_millis(400));
    // Timers and the credit of the link may be some milliseconds early.
    assert!(begin.elapsed() + Duration::from_millis(20) >= latency + on_link, "{:?}", begin.elapsed());
}
