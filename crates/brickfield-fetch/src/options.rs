//! How a client fetches.

use std::time::Duration;

use crate::FetchError;

/// How a client fetches.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FetchOptions {
    /// Requests that may be under way at once, over all threads; 1 or more.
    pub max_concurrent: usize,
    /// Attempts after the first that a request may take.
    pub max_retries: u32,
    /// Wait before the first retry; each further wait is twice as long, up to [`FetchOptions::max_backoff`].
    pub first_backoff: Duration,
    /// Longest wait before a retry.
    pub max_backoff: Duration,
    /// Longest time without a byte: to connect, to the head of an answer, and between two parts of a body; above 0. A body
    /// that keeps coming may take as long as it takes.
    pub timeout: Duration,
    /// Bytes of objects that the client keeps; what was used longest ago goes first. 0: nothing is kept.
    pub max_cache_bytes: u64,
    /// Neighbouring ranges of an object become one request if at most so many bytes lie between them.
    pub max_gap_bytes: u64,
    /// Bytes of an object that are fetched whole from a server that ignores ranges; of larger ones the fetch fails.
    pub max_unasked_bytes: u64,
}

impl Default for FetchOptions {
    fn default() -> FetchOptions {
        FetchOptions {
            max_concurrent: 8,
            max_retries: 5,
            first_backoff: Duration::from_millis(100),
            max_backoff: Duration::from_secs(5),
            timeout: Duration::from_secs(20),
            max_cache_bytes: 256 << 20,
            max_gap_bytes: 4 << 10,
            max_unasked_bytes: 8 << 20,
        }
    }
}

impl FetchOptions {
    pub(crate) fn check(&self) -> Result<(), FetchError> {
        let bad = |name, value: String, bound| Err(FetchError::BadOption { name, value, bound });
        if self.max_concurrent == 0 || self.max_concurrent > MAX_CONCURRENT {
            return bad("max_concurrent", self.max_concurrent.to_string(), "1 to 1024");
        }
        if self.timeout.is_zero() {
            return bad("timeout", format!("{:?}", self.timeout), "above 0");
        }
        Ok(())
    }

    /// The wait before retry `n`, counted from 1.
    pub(crate) fn backoff(&self, n: u32) -> Duration {
        let factor = 2u32.saturating_pow(n.saturating_sub(1));
        self.first_backoff.saturating_mul(factor).min(self.max_backoff)
    }
}

const MAX_CONCURRENT: usize = 1024;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_the_longest() {
        let options = FetchOptions { max_backoff: Duration::from_millis(700), ..FetchOptions::default() };
        let waits: Vec<_> = [1, 2, 3, 4, 99].map(|n| options.backoff(n).as_millis()).into();
        assert_eq!(waits, [100, 200, 400, 700, 700]);
    }

    #[test]
    fn what_cannot_work_is_refused_by_name() {
        let none = FetchOptions { max_concurrent: 0, ..FetchOptions::default() };
        assert_eq!(none.check().unwrap_err().to_string(), "max_concurrent is 0; it must be 1 to 1024");
        let never = FetchOptions { timeout: Duration::ZERO, ..FetchOptions::default() };
        assert_eq!(never.check().unwrap_err().to_string(), "timeout is 0ns; it must be above 0");
    }
}
