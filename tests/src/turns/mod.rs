//! Times that can be compared: contestants take turns, so that other load on the machine hits all of them alike.
//!
//! - [`take_turns`]: a warm-up round, then a fixed number of rounds; the order alternates (A B C, C B A, A B C ...).
//! - [`Contestant`]: a scene that a backend renders, from the scene to the picture in memory.
//! - [`Ratio`]: how many times as long one contestant takes as another: median over rounds, with its confidence interval.
//! - [`Claim`]: a statement about a number, the number, its bound, and whether it is kept.
//! - [`Server`]: the contestants of another build, in a process of its own.
//!
//! The number of rounds is fixed before the first one. A rule that looks at the times after each round and stops once they
//! are clear has a higher error rate than it states: it tests again and again.

mod claim;
mod contestant;
mod lines;
mod ratio;
mod server;

pub use claim::{Bound, Claim, Claims};
pub use contestant::{Contestant, FrameError, TimedFrame, tree_frame};
pub(crate) use lines::LineProcess;
pub use lines::ServerError;
pub use ratio::{CONFIDENCE, Ratio, Spread, Standing};
pub use server::{Offer, Server, serve};

/// A contestant's turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turn {
    /// Whose turn it is, counted from 0.
    pub contestant: usize,
    /// The round, from 0.
    pub round: u32,
    /// Whether the turn before was the same contestant's: the backend still has its bricks.
    pub again: bool,
}

impl Turn {
    /// Whether the turn is in the first round, which is not timed.
    pub fn warms_up(&self) -> bool {
        self.round == 0
    }
}

/// The contestants in the order of a round: forwards in even rounds, backwards in odd ones.
pub fn order(round: u32, n_contestants: usize) -> impl Iterator<Item = usize> {
    (0..n_contestants).map(move |i| if round.is_multiple_of(2) { i } else { n_contestants - 1 - i })
}

/// Gives each of `n_contestants` a turn in a warm-up round and in each of `n_rounds` timed rounds. `turn` returns milliseconds.
/// Returns each contestant's times, round by round, without the warm-up.
///
/// # Errors
/// The first error of a turn.
pub fn take_turns<E>(
    n_contestants: usize,
    n_rounds: u32,
    mut turn: impl FnMut(Turn) -> Result<f64, E>,
) -> Result<Vec<Vec<f64>>, E> {
    let mut times = vec![Vec::with_capacity(n_rounds as usize); n_contestants];
    let mut before = None;
    for round in 0..=n_rounds {
        for contestant in order(round, n_contestants) {
            let ms = turn(Turn { contestant, round, again: before == Some(contestant) })?;
            before = Some(contestant);
            if round > 0 {
                times[contestant].push(ms);
            }
        }
    }
    Ok(times)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_alternates_and_the_warm_up_is_not_counted() {
        let mut turns = Vec::new();
        let times = take_turns(3, 2, |turn| {
            turns.push((turn.contestant, turn.again));
            Ok::<f64, ()>(turns.len() as f64)
        });
        let order = [(0, false), (1, false), (2, false), (2, true), (1, false), (0, false), (0, true), (1, false)];
        assert_eq!(turns[..8], order);
        assert_eq!(times.unwrap(), [[6.0, 7.0], [5.0, 8.0], [4.0, 9.0]]);
        assert_eq!(take_turns(2, 5, |_| Err("no frame")), Err("no frame"));
    }
}
