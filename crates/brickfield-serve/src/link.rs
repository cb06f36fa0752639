//! A slow link, and clients that are slower still.

use std::io;
use std::pin::Pin;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Instant, Sleep, sleep, sleep_until};

/// Most bytes that take their turn on a link at once: 2 ms of 30 Mbit/s.
const PIECE_BYTES: usize = 8 << 10;

/// Time of a link that may be used later, so that late timers do not slow it down.
const CREDIT: Duration = Duration::from_millis(4);

/// A link of some bits per second, over which one piece goes after another.
#[derive(Debug)]
pub(crate) struct Link {
    seconds_per_byte: f64,
    free_at: Mutex<Instant>,
}

impl Link {
    pub(crate) fn new(bits_per_second: f64) -> Link {
        Link { seconds_per_byte: 8.0 / bits_per_second, free_at: Mutex::new(Instant::now()) }
    }

    /// When the next `n_bytes` have gone over the link.
    fn reserve(&self, n_bytes: usize) -> Instant {
        let taken = Duration::from_secs_f64((n_bytes as f64 * self.seconds_per_byte).min(MAX_SECONDS));
        let now = Instant::now();
        let mut free_at = self.free_at.lock().unwrap_or_else(PoisonError::into_inner);
        *free_at = (*free_at).max(now.checked_sub(CREDIT).unwrap_or(now)) + taken;
        *free_at
    }
}

/// A time for each piece that clocks can count.
const MAX_SECONDS: f64 = 1e6;

/// A connection that sends over a link, and ends when its client takes nothing for too long.
#[derive(Debug)]
pub(crate) struct Connection {
    stream: TcpStream,
    link: Option<Arc<Link>>,
    /// Bytes that have had their turn on the link, or have it when the time has come.
    granted: usize,
    turn: Option<Pin<Box<Sleep>>>,
    write_timeout: Duration,
    stalled: Option<Pin<Box<Sleep>>>,
    n_sent: Arc<AtomicU64>,
}

impl Connection {
    pub(crate) fn new(
        stream: TcpStream,
        link: Option<Arc<Link>>,
        write_timeout: Duration,
        n_sent: Arc<AtomicU64>,
    ) -> Connection {
        Connection { stream, link, granted: 0, turn: None, write_timeout, stalled: None, n_sent }
    }

    /// Waits until the link has had a piece of at most `n_bytes`; how much may be written.
    fn poll_granted(&mut self, cx: &mut Context<'_>, n_bytes: usize) -> Poll<usize> {
        let Some(link) = &self.link else { return Poll::Ready(n_bytes) };
        if self.granted == 0 {
            self.granted = n_bytes.min(PIECE_BYTES);
            self.turn = Some(Box::pin(sleep_until(link.reserve(self.granted))));
        }
        if let Some(turn) = &mut self.turn {
            ready!(turn.as_mut().poll(cx));
            self.turn = None;
        }
        Poll::Ready(self.granted.min(n_bytes))
    }
}

impl AsyncRead for Connection {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(cx, buf)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &[u8]) -> Poll<io::Result<usize>> {
        if buf.is_empty() {
            return Poll::Ready(Ok(0));
        }
        let n = ready!(self.poll_granted(cx, buf.len()));
        match Pin::new(&mut self.stream).poll_write(cx, &buf[..n]) {
            Poll::Ready(result) => {
                self.stalled = None;
                let n = *result.as_ref().unwrap_or(&0);
                self.granted = self.granted.saturating_sub(n);
                self.n_sent.fetch_add(n as u64, Ordering::Relaxed);
                Poll::Ready(result)
            }
            Poll::Pending => {
                let timeout = self.write_timeout;
                let stalled = self.stalled.get_or_insert_with(|| Box::pin(sleep(timeout)));
                ready!(stalled.as_mut().poll(cx));
                Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
            }
        }
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_follow_each_other_on_the_link() {
        let link = Link::new(8e3);
        let before = Instant::now();
        let times: Vec<_> = [500, 250, 250].map(|n| link.reserve(n)).into();
        assert!(times[0] >= before + Duration::from_millis(500) - CREDIT);
        assert_eq!([times[1] - times[0], times[2] - times[1]], [Duration::from_millis(250); 2]);
    }
}
