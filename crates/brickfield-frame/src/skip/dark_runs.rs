//! Where a transfer function is 0, in stored numbers.

use brickfield_core::{TransferFunction, ValueRange};

use crate::{Decode, SampleFormat};

/// The runs of stored numbers over which a transfer function is 0, ascending: a macrocell is dark if its range lies in one of them.
///
/// ```text
/// extinction     /\        __
///           ____/  \______/  \     stored numbers 0 to 4, 7 to 13: [[0, 4], [7, 13]]
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DarkRuns(Vec<[f64; 2]>);

/// Stored numbers by their rank: all that a format can hold, ascending.
#[derive(Clone, Copy)]
struct Ranks {
    format: SampleFormat,
    decode: Decode,
}

impl DarkRuns {
    /// The runs of samples that are stored in a format, and what they stand for.
    ///
    /// Some microseconds for each dark part of the transfer function.
    pub fn of_transfer(transfer: &TransferFunction, format: SampleFormat, decode: Decode) -> DarkRuns {
        let ranks = Ranks { format, decode };
        let is_dark = |first: u32, last: u32| transfer.is_transparent(ranks.values(first, last));
        let mut runs: Vec<[u32; 2]> = Vec::new();
        // A dark part has a knot of 0 in it, or at its end.
        for knot in transfer.knots().iter().filter(|knot| knot.extinction == 0.0) {
            let rank = first_rank(0, ranks.last(), |rank| ranks.is_at_or_past(rank, knot.value));
            for rank in [rank.saturating_sub(1), rank.min(ranks.last())] {
                // Knots ascend, so that a number before this one's is in one of the last two runs, if in any.
                let is_known = runs.iter().rev().take(2).any(|[first, last]| (*first..=*last).contains(&rank));
                if !is_known && is_dark(rank, rank) {
                    let first = first_rank(0, rank, |first| is_dark(first, rank));
                    let last = first_rank(rank, ranks.last(), |last| !is_dark(rank, last)) - 1;
                    runs.push([first, last]);
                }
            }
        }
        runs.sort_unstable();
        DarkRuns(runs.into_iter().map(|run| run.map(|rank| ranks.stored(rank))).collect())
    }

    /// The runs as numbers of the type that samples are stored in: the first and the last of each.
    pub(crate) fn of<T>(&self, stored: impl Fn(f64) -> T) -> Vec<[T; 2]> {
        self.0.iter().map(|run| run.map(&stored)).collect()
    }
}

impl Ranks {
    const FINITE: std::ops::RangeInclusive<u32> = Ranks::order(f32::MIN)..=Ranks::order(f32::MAX);

    /// A number that ascends with a float.
    const fn order(float: f32) -> u32 {
        let bits = float.to_bits();
        if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
    }

    /// The greatest rank.
    fn last(self) -> u32 {
        match self.format {
            SampleFormat::Unorm8 | SampleFormat::Unorm8x4 => u32::from(u8::MAX),
            SampleFormat::Unorm16 => u32::from(u16::MAX),
            SampleFormat::Float32 => Ranks::FINITE.end() - Ranks::FINITE.start(),
        }
    }

    fn stored(self, rank: u32) -> f64 {
        match self.format {
            SampleFormat::Unorm8 | SampleFormat::Unorm8x4 | SampleFormat::Unorm16 => f64::from(rank),
            SampleFormat::Float32 => {
                let order = rank + Ranks::FINITE.start();
                f64::from(f32::from_bits(if order >> 31 == 1 { order & !(1 << 31) } else { !order }))
            }
        }
    }

    fn value(self, rank: u32) -> f64 {
        self.decode.value(self.stored(rank) / self.format.unit())
    }

    /// The values of some ranks. A decoding's scale may be negative.
    fn values(self, first: u32, last: u32) -> ValueRange {
        let (a, b) = (self.value(first), self.value(last));
        ValueRange { min: a.min(b), max: a.max(b) }
    }

    /// Whether a rank's value is `value`, or past it in the order of ranks.
    fn is_at_or_past(self, rank: u32, value: f64) -> bool {
        if self.decode.scale < 0.0 { self.value(rank) <= value } else { self.value(rank) >= value }
    }
}

/// The first rank from `low` to `high` for which `is_so` holds, as for all after it; the one behind `high` if there is none.
fn first_rank(low: u32, high: u32, is_so: impl Fn(u32) -> bool) -> u32 {
    let (mut low, mut end) = (low, high + 1);
    while low < end {
        let middle = low + (end - low) / 2;
        if is_so(middle) { end = middle } else { low = middle + 1 }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::Knot;

    fn transfer(knots: &[(f64, f64)]) -> TransferFunction {
        let knot = |(value, extinction): &(f64, f64)| Knot { value: *value, extinction: *extinction, color: [1.0; 3] };
        TransferFunction::new(knots.iter().map(knot).collect()).unwrap()
    }

    /// Dark at both ends, over a step that begins and ends with a jump, at a point, and beside a spike between two stored numbers.
    const KNOTS: [(f64, f64); 11] = [
        (20.0, 0.0),
        (30.0, 1.0),
        (40.0, 1.0),
        (40.0, 0.0),
        (50.0, 0.0),
        (50.0, 2.0),
        (60.0, 0.0),
        (70.0, 1.0),
        (80.0, 0.0),
        (80.5, 1.0),
        (81.0, 0.0),
    ];

    #[test]
    fn a_range_is_dark_if_it_lies_in_a_run() {
        let transfer = transfer(&KNOTS);
        for scale in [255.0, -255.0, 100.0] {
            let decode = Decode { scale, offset: if scale < 0.0 { 255.0 } else { 0.0 } };
            let runs = DarkRuns::of_transfer(&transfer, SampleFormat::Unorm8, decode).of(|stored| stored as u32);
            let value = |stored: u32| decode.value(f64::from(stored) / 255.0);
            for first in 0..=255 {
                for last in first..=255 {
                    let (a, b) = (value(first), value(last));
                    let is_dark = transfer.is_transparent(ValueRange { min: a.min(b), max: a.max(b) });
                    let is_in_run = runs.iter().any(|run| run[0] <= first && last <= run[1]);
                    assert_eq!(is_dark, is_in_run, "{first} to {last}, scale {scale}");
                }
            }
        }
    }

    #[test]
    fn runs_of_floats_end_at_the_last_dark_one() {
        let decode = Decode { scale: 0.5, offset: -3.0 };
        let runs = |knots: &[(f64, f64)]| {
            DarkRuns::of_transfer(&transfer(knots), SampleFormat::Float32, decode).of(|stored| stored as f32)
        };
        assert_eq!(runs(&[(-2.5, 0.0), (-2.0, 1.0)]), [[f32::MIN, 1.0]]);
        assert_eq!(runs(&[(-3.5, 1.0), (-3.5, 0.0), (1.0, 0.0), (2.0, 1.0)]), [[(-1.0f32).next_up(), 8.0]]);
        assert_eq!(runs(&[(0.0, 1.0)]), <[[f32; 2]; 0]>::default());
        assert_eq!(runs(&[(0.0, 0.0)]), [[f32::MIN, f32::MAX]]);
    }
}
