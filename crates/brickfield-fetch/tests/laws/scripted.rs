//! A server that says what a test tells it to.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// Answers each connection by `answer` of the request's head, and closes it.
pub(crate) struct Scripted {
    pub(crate) url: String,
    n_requests: Arc<AtomicUsize>,
    most_at_once: Arc<AtomicUsize>,
}

impl Scripted {
    pub(crate) fn start(answer: impl Fn(usize, &str) -> Vec<u8> + Send + Sync + 'static) -> Scripted {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        let (answer, n_requests, most_at_once) =
            (Arc::new(answer), Arc::<AtomicUsize>::default(), Arc::<AtomicUsize>::default());
        let scripted = Scripted { url, n_requests: n_requests.clone(), most_at_once: most_at_once.clone() };
        let at_once = Arc::<AtomicUsize>::default();
        // It ends with the process.
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let (answer, n_requests) = (answer.clone(), n_requests.clone());
                let (most_at_once, at_once) = (most_at_once.clone(), at_once.clone());
                std::thread::spawn(move || {
                    most_at_once.fetch_max(at_once.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                    if let Some(head) = read_head(&stream) {
                        let n = n_requests.fetch_add(1, Ordering::SeqCst) + 1;
                        let bytes = answer(n, &head);
                        at_once.fetch_sub(1, Ordering::SeqCst);
                        let _ = (&stream).write_all(&bytes);
                        let _ = stream.shutdown(Shutdown::Write);
                    } else {
                        at_once.fetch_sub(1, Ordering::SeqCst);
                    }
                });
            }
        });
        scripted
    }

    pub(crate) fn n_requests(&self) -> usize {
        self.n_requests.load(Ordering::SeqCst)
    }

    pub(crate) fn most_at_once(&self) -> usize {
        self.most_at_once.load(Ordering::SeqCst)
    }
}

fn read_head(mut stream: &TcpStream) -> Option<String> {
    stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
    let mut head = vec![];
    while !head.ends_with(b"\r\n\r\n") {
        let mut byte = [0];
        if stream.read(&mut byte).ok()? == 0 {
            return None;
        }
        head.push(byte[0]);
    }
    String::from_utf8(head).ok()
}

/// An answer of a status line, further lines, and a body.
pub(crate) fn answer(status: &str, lines: &str, body: &[u8]) -> Vec<u8> {
    [format!("HTTP/1.1 {status}\r\nconnection: close\r\n{lines}\r\n").as_bytes(), body].concat()
}
