//! How a server answers.

use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::time::Duration;

/// How a server answers.
#[derive(Debug, Clone, PartialEq)]
pub struct ServeOptions {
    /// Where it listens; port 0 takes a free one.
    pub address: SocketAddr,
    /// The link over which it sends; `None`: as fast as it can.
    pub throttle: Option<Throttle>,
    /// Bounds that no client exceeds.
    pub limits: Limits,
    /// What it does wrong, for tests of clients.
    pub faults: Faults,
}

impl Default for ServeOptions {
    fn default() -> ServeOptions {
        ServeOptions {
            address: (Ipv4Addr::LOCALHOST, 0).into(),
            throttle: None,
            limits: Limits::default(),
            faults: Faults::default(),
        }
    }
}

/// A slow link, shared by all connections.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Throttle {
    /// Bits of answers per second, heads included; above 0. Infinite: latency alone.
    pub bits_per_second: f64,
    /// Wait of each request before its answer begins, beside the time on the link.
    pub latency: Duration,
}

/// Bounds that no client exceeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Connections at once, 1 or more; further ones wait.
    pub max_connections: usize,
    /// Bytes of a request's head, 1 or more; a larger one is answered by status 431 (a longer path by 414).
    pub max_head_bytes: usize,
    /// Lines of a request's head, 1 or more; of one with more, too, the answer is 431.
    pub max_head_lines: usize,
    /// Longest time for a request's head to come, above 0. Status 408 if a part has come; a connection without one is closed.
    pub head_timeout: Duration,
    /// Longest time in which a client takes not a byte of an answer, above 0; then the connection is closed.
    pub write_timeout: Duration,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits {
            max_connections: 256,
            max_head_bytes: 16 << 10,
            max_head_lines: 64,
            head_timeout: Duration::from_secs(15),
            write_timeout: Duration::from_secs(30),
        }
    }
}

/// What a server does wrong: the same for the same order of requests. Counts are from 1; 0 is never.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Faults {
    /// Of bodies that are sent, each n-th ends early, and the connection with it.
    pub cut_every: u64,
    /// The share of a cut body that is sent, at most; 0 to below 1.
    pub cut_at: f64,
    /// Of requests for a range, each n-th is answered as if it asked for the whole.
    pub ignore_range_every: u64,
    /// Each n-th request is answered by status 503.
    pub unavailable_every: u64,
    /// Of answers with a range, each n-th states the range one byte further on.
    pub wrong_range_every: u64,
    /// After so many requests the server is gone, in the middle of whatever it sends; `None`: it stays.
    pub die_after: Option<u64>,
}

impl Default for Faults {
    fn default() -> Faults {
        Faults {
            cut_every: 0,
            cut_at: 0.5,
            ignore_range_every: 0,
            unavailable_every: 0,
            wrong_range_every: 0,
            die_after: None,
        }
    }
}

/// Why a server could not be started.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServeError {
    /// There is no such folder.
    #[error("cannot serve {}: {source}", folder.display())]
    NoFolder {
        /// The folder.
        folder: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The address cannot be listened at.
    #[error("cannot listen at {address}: {source}")]
    Address {
        /// The address.
        address: SocketAddr,
        /// Why not.
        source: io::Error,
    },
    /// An option is outside of its bound.
    #[error("{name} is {value}; it must be {bound}")]
    BadOption {
        /// The option's name.
        name: &'static str,
        /// Its value.
        value: String,
        /// What it may be.
        bound: &'static str,
    },
    /// The server's thread could not be started.
    #[error("cannot start the server's thread: {0}")]
    Thread(#[source] io::Error),
}

impl ServeOptions {
    pub(crate) fn check(&self) -> Result<(), ServeError> {
        let Limits { max_connections, max_head_bytes, max_head_lines, head_timeout, write_timeout } = self.limits;
        let bad = |name, value: String, bound| Err(ServeError::BadOption { name, value, bound });
        let most = tokio::sync::Semaphore::MAX_PERMITS;
        let counts = [
            ("max_connections", max_connections),
            ("max_head_bytes", max_head_bytes),
            ("max_head_lines", max_head_lines),
        ];
        if let Some((name, n)) = counts.into_iter().find(|&(_, n)| n == 0 || n > most) {
            return bad(name, n.to_string(), "1 or more");
        }
        let times = [("head_timeout", head_timeout), ("write_timeout", write_timeout)];
        if let Some((name, time)) = times.into_iter().find(|(_, time)| time.is_zero()) {
            return bad(name, format!("{time:?}"), "above 0");
        }
        let speed = self.throttle.map_or(1.0, |throttle| throttle.bits_per_second);
        if speed.is_nan() || speed <= 0.0 {
            return bad("bits_per_second", speed.to_string(), "above 0");
        }
        if !(0.0..1.0).contains(&self.faults.cut_at) {
            return bad("cut_at", self.faults.cut_at.to_string(), "0 to below 1");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_work_is_refused_by_name() {
        let told = |options: ServeOptions| options.check().unwrap_err().to_string();
        let limits = |limits| ServeOptions { limits, ..ServeOptions::default() };
        let none = Limits { max_connections: 0, ..Limits::default() };
        assert_eq!(told(limits(none)), "max_connections is 0; it must be 1 or more");
        let never = Limits { head_timeout: Duration::ZERO, ..Limits::default() };
        assert_eq!(told(limits(never)), "head_timeout is 0ns; it must be above 0");
        let throttle = Some(Throttle { bits_per_second: 0.0, latency: Duration::ZERO });
        let slow = ServeOptions { throttle, ..ServeOptions::default() };
        assert_eq!(told(slow), "bits_per_second is 0; it must be above 0");
        let whole = ServeOptions { faults: Faults { cut_at: 1.0, ..Faults::default() }, ..ServeOptions::default() };
        assert_eq!(told(whole), "cut_at is 1; it must be 0 to below 1");
    }
}
