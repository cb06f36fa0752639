//! Cases are prepared ahead: references are worked out on idle cores while a driver compiles shaders on one.

use std::sync::mpsc::sync_channel;
use std::thread;

use super::case::Case;
use super::check::{Obstacle, Prepared};

/// At most so many cases are ready and wait: they hold volumes.
const N_WAITING: usize = 1;

/// Prepares each case once, in order, on a thread of its own, and hands it to `run`.
pub fn for_each_prepared<'a>(cases: &'a [Case], mut run: impl FnMut(&'a Case, Result<Prepared, Obstacle>)) {
    thread::scope(|scope| {
        let (sender, ready) = sync_channel(N_WAITING);
        // The receiver goes away only if `run` panics.
        scope.spawn(move || cases.iter().try_for_each(|case| sender.send((case, Prepared::of(case)))));
        ready.into_iter().for_each(|(case, prepared)| run(case, prepared));
    });
}
