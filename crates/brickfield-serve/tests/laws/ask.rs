//! Requests as they go over the wire: no client library that would tidy them.

use std::collections::HashMap;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use brickfield_serve::{ServeOptions, Server};
use tempfile::TempDir;

/// Long enough for any machine, and shorter than the bounds that hyper has of its own; a test that waits for it has failed.
pub(crate) const LONG: Duration = Duration::from_secs(20);

/// 1,000 bytes that are all but alike.
pub(crate) fn object() -> Vec<u8> {
    (0..1000u32).map(|i| (i * 31 % 251) as u8).collect()
}

/// A folder with an object `c/0`, served.
pub(crate) fn served(options: ServeOptions) -> (TempDir, Server) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("c")).unwrap();
    std::fs::write(folder.path().join("c/0"), object()).unwrap();
    let server = Server::start(folder.path(), options).unwrap();
    (folder, server)
}

/// An answer; of a body that was cut short, what came.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    headers: HashMap<String, String>,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    pub(crate) fn header(&self, name: &str) -> &str {
        self.headers.get(name).map_or("", String::as_str)
    }

    fn parse(bytes: &[u8]) -> Option<Answer> {
        let end = bytes.windows(4).position(|w| w == b"\r\n\r\n")?;
        let head = std::str::from_utf8(&bytes[..end]).ok()?;
        let (first, rest) = head.split_once("\r\n").unwrap_or((head, ""));
        let header = |line: &str| line.split_once(": ").map(|(name, value)| (name.to_lowercase(), value.to_owned()));
        Some(Answer {
            status: first.split(' ').nth(1)?.parse().ok()?,
            headers: rest.split("\r\n").filter_map(header).collect(),
            body: bytes[end + 4..].to_vec(),
        })
    }
}

/// A method, a path and further lines of a head, as they are.
pub(crate) fn ask(address: SocketAddr, method: &str, path: &str, lines: &str) -> Answer {
    let head = format!("{method} {path} HTTP/1.1\r\nhost: here\r\nconnection: close\r\n{lines}\r\n");
    answer_to(address, head.as_bytes()).unwrap_or_else(|| panic!("no answer to {method} {path} {lines:.80}"))
}

pub(crate) fn get(server: &Server, path: &str) -> Answer {
    ask(server.address(), "GET", path, "")
}

pub(crate) fn get_range(server: &Server, range: &str) -> Answer {
    ask(server.address(), "GET", "/c/0", &format!("range: {range}\r\n"))
}

/// What comes until the server closes the connection; `None`: no head of an answer.
pub(crate) fn answer_to(address: SocketAddr, request: &[u8]) -> Option<Answer> {
    let mut stream = TcpStream::connect(address).ok()?;
    stream.set_read_timeout(Some(LONG)).unwrap();
    // The server may have had enough before it has read all.
    let _ = stream.write_all(request);
    Answer::parse(&read_all(&mut stream))
}

/// All bytes up to the end of the connection, or to its break.
pub(crate) fn read_all(stream: &mut TcpStream) -> Vec<u8> {
    let (mut all, mut part) = (vec![], vec![0; 1 << 16]);
    while let Ok(n @ 1..) = stream.read(&mut part) {
        all.extend_from_slice(&part[..n]);
    }
    all
}
