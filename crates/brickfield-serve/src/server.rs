//! The server.

use std::convert::Infallible;
use std::future::poll_fn;
use std::io;
use std::net::{SocketAddr, TcpListener as StdListener};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::io::AsyncWriteExt;
use tokio::net::{TcpListener, TcpStream};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::{Semaphore, watch};
use tokio::time::{sleep, timeout};

use crate::answer::Answers;
use crate::folder::Inside;
use crate::link::{Connection, Link};
use crate::{Limits, ServeError, ServeOptions};

/// A server of the files of a folder, in a thread of its own. It ends when it is dropped.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// What a server has done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ServedCounts {
    /// Requests whose heads have come.
    pub n_requests: u64,
    /// Bytes that were sent, heads included.
    pub n_sent_bytes: u64,
}

#[derive(Debug)]
struct Shared {
    answers: Answers,
    limits: Limits,
    link: Option<Arc<Link>>,
    n_sent: Arc<AtomicU64>,
    is_over: watch::Sender<bool>,
}

impl Server {
    /// Serves the files of a folder; the server answers when this returns.
    ///
    /// # Errors
    /// If an option is out of bounds, there is no such folder, or the address is taken.
    pub fn start(folder: impl AsRef<Path>, options: ServeOptions) -> Result<Server, ServeError> {
        options.check()?;
        let folder = folder.as_ref();
        let no_folder = |source| ServeError::NoFolder { folder: folder.to_owned(), source };
        let inside = Inside::new(folder).map_err(no_folder)?;
        let address = options.address;
        let (listener, address) = listen(address).map_err(|source| ServeError::Address { address, source })?;
        let latency = options.throttle.map_or(Duration::ZERO, |throttle| throttle.latency);
        let shared = Arc::new(Shared {
            answers: Answers::new(inside, latency, options.faults),
            limits: options.limits,
            link: options.throttle.map(|throttle| Arc::new(Link::new(throttle.bits_per_second))),
            n_sent: Arc::default(),
            is_over: watch::Sender::new(false),
        });
        let thread = run(listener, shared.clone()).map_err(ServeError::Thread)?;
        Ok(Server { address, shared, thread: Some(thread) })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The URL of the folder.
    pub fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// What it has done so far.
    pub fn counts(&self) -> ServedCounts {
        ServedCounts {
            n_requests: self.shared.answers.n_requests(),
            n_sent_bytes: self.shared.n_sent.load(Ordering::Relaxed),
        }
    }

    /// Ends it, in the middle of whatever it sends.
    pub fn shutdown(mut self) {
        self.end();
    }

    /// Waits until it has ended by itself, as [`Faults::die_after`](crate::Faults::die_after) can have it.
    pub fn wait(mut self) {
        self.join();
    }

    fn end(&mut self) {
        self.shared.is_over.send_replace(true);
        self.join();
    }

    fn join(&mut self) {
        if let Some(thread) = self.thread.take()
            && let Err(panic) = thread.join()
            && !std::thread::panicking()
        {
            std::panic::resume_unwind(panic);
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.end();
    }
}

fn listen(address: SocketAddr) -> io::Result<(StdListener, SocketAddr)> {
    let listener = StdListener::bind(address)?;
    listener.set_nonblocking(true)?;
    let address = listener.local_addr()?;
    Ok((listener, address))
}

fn run(listener: StdListener, shared: Arc<Shared>) -> io::Result<JoinHandle<()>> {
    let runtime = Builder::new_current_thread().enable_all().build()?;
    let listener = {
        let _inside = runtime.enter();
        TcpListener::from_std(listener)?
    };
    std::thread::Builder::new().name("brickfield-serve".to_owned()).spawn(move || serve(runtime, listener, &shared))
}

fn serve(runtime: Runtime, listener: TcpListener, shared: &Arc<Shared>) {
    runtime.block_on(async {
        let mut is_over = shared.is_over.subscribe();
        tokio::select! {
            _ = is_over.wait_for(|&over| over) => {}
            () = accept(listener, shared) => {}
        }
    });
    // A file that is being read does not hold up the end.
    runtime.shutdown_timeout(Duration::from_millis(200));
}

async fn accept(listener: TcpListener, shared: &Arc<Shared>) {
    let places = Arc::new(Semaphore::new(shared.limits.max_connections));
    loop {
        let Ok(place) = places.clone().acquire_owned().await else { return };
        match listener.accept().await {
            Ok((stream, _)) => {
                let shared = shared.clone();
                tokio::spawn(async move {
                    converse(stream, &shared).await;
                    drop(place);
                });
            }
            // Too many open files, or a connection that is gone before it is taken.
            Err(_) => sleep(Duration::from_millis(20)).await,
        }
    }
}

/// Answers the requests of a connection. Whatever ends it is the client's affair.
async fn converse(stream: TcpStream, shared: &Arc<Shared>) {
    let limits = shared.limits;
    // Answers do not wait for further ones.
    let _ = stream.set_nodelay(true);
    let io = Connection::new(stream, shared.link.clone(), limits.write_timeout, shared.n_sent.clone());
    let service = service_fn(|request| {
        let shared = shared.clone();
        Box::pin(async move {
            match shared.answers.answer(request).await {
                Some(response) => Ok::<_, Infallible>(response),
                None => {
                    shared.is_over.send_replace(true);
                    std::future::pending().await
                }
            }
        })
    });
    let mut connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(limits.head_timeout)
        .max_header_size(limits.max_head_bytes)
        .max_headers(limits.max_head_lines)
        .max_buf_size(BUFFER_BYTES.max(limits.max_head_bytes))
        .serve_connection(TokioIo::new(io), service);
    let result = poll_fn(|cx| connection.poll_without_shutdown(cx)).await;
    let parts = connection.into_parts();
    let mut io = parts.io.into_inner();
    if result.is_err_and(|e| e.is_timeout()) && !parts.read_buf.is_empty() {
        let _ = timeout(limits.write_timeout, io.write_all(TOO_SLOW)).await;
    }
    let _ = timeout(limits.write_timeout, io.shutdown()).await;
}

/// Bytes of a connection that are read ahead, and of an answer that wait to be sent.
const BUFFER_BYTES: usize = 64 << 10;

const TOO_SLOW: &[u8] = b"HTTP/1.1 408 Request Timeout\r\nconnection: close\r\ncontent-length: 0\r\n\r\n";
