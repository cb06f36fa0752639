//! Samples to multiples of a step, with a bounded difference.

use crate::encode::Loss;
use crate::sample::{Coefficient, Sample};

/// A value q stands for the samples from step q - (step - 1) / 2 to step q + (step - 1) / 2; the step is odd.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Quantiser {
    step: u32,
}

impl Quantiser {
    /// The quantiser with the greatest step that keeps to a loss, whose error is at most 2^31 - 1.
    pub(crate) fn of(loss: Loss) -> Quantiser {
        match loss {
            Loss::MaxError(most) => Quantiser { step: 2 * most + 1 },
            Loss::None | Loss::Threshold(_) => Quantiser { step: 1 },
        }
    }

    pub(crate) fn with_step(step: u32) -> Quantiser {
        Quantiser { step }
    }

    pub(crate) fn step(self) -> u32 {
        self.step
    }

    /// The value in the middle of all samples, if it may stand for all of them.
    pub(crate) fn one_value<T: Sample>(self, samples: &[T]) -> Option<T> {
        let least = samples.iter().map(|s| s.to_i64()).min()?;
        let greatest = samples.iter().map(|s| s.to_i64()).max()?;
        (greatest - least < i64::from(self.step)).then(|| T::saturate(least + (greatest - least) / 2))
    }

    pub(crate) fn quantise<T: Sample>(self, samples: &[T]) -> Vec<T::Coefficient> {
        let (step, half) = (i64::from(self.step), i64::from(self.step / 2));
        match self.step {
            1 => samples.iter().map(|s| s.widen()).collect(),
            _ => samples.iter().map(|s| T::Coefficient::wrap_from((s.to_i64() + half).div_euclid(step))).collect(),
        }
    }

    /// The sample that a value stands for, or the nearest one that the type has.
    pub(crate) fn restore_nearest<T: Sample>(self, value: T::Coefficient) -> T {
        T::saturate(value.to_i64().saturating_mul(i64::from(self.step)))
    }
}

/// The greatest difference between two lists of samples.
pub(crate) fn max_difference<T: Sample>(samples: &[T], others: impl Iterator<Item = T>) -> u32 {
    let difference = |(a, b): (&T, T)| a.to_i64().abs_diff(b.to_i64()) as u32;
    samples.iter().zip(others).map(difference).max().unwrap_or(0)
}
