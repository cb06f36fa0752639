//! The answer to a request, right or wrong.

use std::convert::Infallible;
use std::io;
use std::pin::Pin;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use bytes::Bytes;
use http_body_util::BodyExt;
use http_body_util::combinators::UnsyncBoxBody;
use hyper::body::{Body as _, Frame, Incoming, SizeHint};
use hyper::header::{
    ACCEPT_RANGES, CONTENT_LENGTH, CONTENT_RANGE, ETAG, HeaderMap, HeaderValue, IF_MATCH, IF_MODIFIED_SINCE,
    IF_NONE_MATCH, IF_UNMODIFIED_SINCE, LAST_MODIFIED, RANGE,
};
use hyper::{Method, Request, Response, StatusCode};
use tokio::time::{Sleep, sleep};
use tower_http::cors::{Any, Cors};
use tower_http::services::ServeDir;
use tower_http::services::fs::DefaultServeDirFallback;
use tower_service::Service;

use crate::Faults;
use crate::folder::Inside;

pub(crate) type Body = UnsyncBoxBody<Bytes, io::Error>;
type Files = Cors<ServeDir<DefaultServeDirFallback, Inside>>;

/// Answers requests by files of a folder.
#[derive(Debug)]
pub(crate) struct Answers {
    files: Files,
    latency: Duration,
    faults: Faults,
    n_requests: AtomicU64,
    n_ranges: AtomicU64,
    n_partial: AtomicU64,
    n_bodies: AtomicU64,
}

impl Answers {
    pub(crate) fn new(inside: Inside, latency: Duration, faults: Faults) -> Answers {
        let files = ServeDir::with_backend(inside.root(), inside.clone())
            .append_index_html_on_directories(false)
            .redirect_to_trailing_slash(false);
        let asked = [RANGE, IF_MATCH, IF_NONE_MATCH, IF_MODIFIED_SINCE, IF_UNMODIFIED_SINCE];
        let files = Cors::new(files)
            .allow_origin(Any)
            .allow_methods([Method::GET, Method::HEAD])
            .allow_headers(asked)
            .expose_headers([ACCEPT_RANGES, CONTENT_LENGTH, CONTENT_RANGE, ETAG, LAST_MODIFIED]);
        let zero = AtomicU64::default;
        Answers { files, latency, faults, n_requests: zero(), n_ranges: zero(), n_partial: zero(), n_bodies: zero() }
    }

    /// Requests that have come.
    pub(crate) fn n_requests(&self) -> u64 {
        self.n_requests.load(Ordering::Relaxed)
    }

    /// The answer to a request; `None`: the server is to be gone.
    pub(crate) async fn answer(&self, mut request: Request<Incoming>) -> Option<Response<Body>> {
        let n_requests = self.n_requests.fetch_add(1, Ordering::Relaxed) + 1;
        if self.faults.die_after.is_some_and(|n| n_requests > n) {
            return None;
        }
        if !self.latency.is_zero() {
            sleep(self.latency).await;
        }
        if is_nth(n_requests, self.faults.unavailable_every) {
            return Some(unavailable());
        }
        let has_range = request.headers().contains_key(RANGE);
        if has_range && self.is_turn(&self.n_ranges, self.faults.ignore_range_every) {
            request.headers_mut().remove(RANGE);
        }
        let is_get = request.method() == Method::GET;
        let mut response = called(self.files.clone(), request).await;
        if response.status() == StatusCode::PARTIAL_CONTENT
            && self.is_turn(&self.n_partial, self.faults.wrong_range_every)
        {
            shift_range(response.headers_mut());
        }
        let n_bytes = response.body().size_hint().exact().or_else(|| content_length(response.headers())).unwrap_or(0);
        if is_get && n_bytes > 0 && self.is_turn(&self.n_bodies, self.faults.cut_every) {
            let left = (n_bytes as f64 * self.faults.cut_at) as u64;
            return Some(response.map(|body| Cut { body, left, pause: None }.boxed_unsync()));
        }
        Some(response)
    }

    /// Counts; whether it is the turn of the one in `every`.
    fn is_turn(&self, count: &AtomicU64, every: u64) -> bool {
        is_nth(count.fetch_add(1, Ordering::Relaxed) + 1, every)
    }
}

fn is_nth(n: u64, every: u64) -> bool {
    every > 0 && n.is_multiple_of(every)
}

async fn called(mut files: Files, request: Request<Incoming>) -> Response<Body> {
    match files.call(request).await {
        Ok(response) => response.map(|body| body.boxed_unsync()),
        Err(never) => match never as Infallible {},
    }
}

fn unavailable() -> Response<Body> {
    let mut response = Response::new(Body::default());
    *response.status_mut() = StatusCode::SERVICE_UNAVAILABLE;
    response
}

fn content_length(headers: &HeaderMap) -> Option<u64> {
    headers.get(CONTENT_LENGTH)?.to_str().ok()?.parse().ok()
}

/// States a range one byte further on than the one that is sent.
fn shift_range(headers: &mut HeaderMap) {
    let shifted = headers.get(CONTENT_RANGE).and_then(|value| {
        let (range, n_bytes) = value.to_str().ok()?.strip_prefix("bytes ")?.split_once('/')?;
        let (first, last) = range.split_once('-')?;
        let (first, last) = (first.parse::<u64>().ok()? + 1, last.parse::<u64>().ok()? + 1);
        HeaderValue::from_str(&format!("bytes {first}-{last}/{n_bytes}")).ok()
    });
    if let Some(shifted) = shifted {
        headers.insert(CONTENT_RANGE, shifted);
    }
}

/// A body that ends with an error after some bytes.
struct Cut {
    body: Body,
    left: u64,
    pause: Option<Pin<Box<Sleep>>>,
}

/// Time for what is buffered to be sent: hyper drops it with the connection.
const PAUSE: Duration = Duration::from_millis(20);

impl hyper::body::Body for Cut {
    type Data = Bytes;
    type Error = io::Error;

    fn poll_frame(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<io::Result<Frame<Bytes>>>> {
        if self.left == 0 {
            ready!(self.pause.get_or_insert_with(|| Box::pin(sleep(PAUSE))).as_mut().poll(cx));
            return Poll::Ready(Some(Err(io::Error::other("cut, as the options ask for"))));
        }
        let frame = ready!(Pin::new(&mut self.body).poll_frame(cx));
        Poll::Ready(frame.map(|frame| {
            frame.map(|frame| {
                frame.map_data(|bytes| {
                    let kept = bytes.slice(..bytes.len().min(self.left as usize));
                    self.left -= kept.len() as u64;
                    kept
                })
            })
        }))
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
