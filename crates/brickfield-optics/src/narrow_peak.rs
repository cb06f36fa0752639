//! Peaks of a transfer function that samples step over.

use std::convert::Infallible;

use brickfield_core::glam::UVec3;
use brickfield_core::{Knot, TransferFunction, ValueRange, Volume};

/// A peak of extinction that is narrower than the change of value from one sample to the next.
///
/// A rule that samples the extinction meets such a peak on some rays and misses it on others: a surface shows rings. A rule that
/// integrates over the values between two samples (pre-integration) does not.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct NarrowPeak {
    /// Where the extinction is at least half the peak's.
    pub values: ValueRange,
    /// The change of value over a step across the peak: the median over the volume.
    pub change: f64,
}

/// The narrowest peak, measured in steps, if samples step over it: half of the steps across it (along the volume's axes) change
/// the value by more than the peak's width at half its height.
///
/// `step_voxels` is the distance between samples in voxels. Looks at no more than about four million voxels.
pub fn narrow_peak(volume: &Volume, transfer: &TransferFunction, step_voxels: f64) -> Option<NarrowPeak> {
    let changes = |middle| Ok::<_, Infallible>(volume_changes(volume, middle));
    match narrow_peak_of(transfer, step_voxels, changes) {
        Ok(narrow) => narrow,
        Err(never) => match never {},
    }
}

/// The same of voxels that are kept elsewhere: `changes` hands out how much neighbours differ that have a value between them.
///
/// # Errors
/// The first error of `changes`.
pub fn narrow_peak_of<E>(
    transfer: &TransferFunction,
    step_voxels: f64,
    mut changes: impl FnMut(f64) -> Result<Vec<f64>, E>,
) -> Result<Option<NarrowPeak>, E> {
    let mut narrowest: Option<(f64, NarrowPeak)> = None;
    for values in peaks(transfer.knots()) {
        let Some(change) = median(changes(0.5 * values.min + 0.5 * values.max)?).map(|change| step_voxels * change)
        else {
            continue;
        };
        let n_steps = (values.max - values.min) / change;
        if n_steps < narrowest.map_or(1.0, |(fewest, _)| fewest) {
            narrowest = Some((n_steps, NarrowPeak { values, change }));
        }
    }
    Ok(narrowest.map(|(_, peak)| peak))
}

/// How much neighbours along each axis differ that have `value` between them; of a box of `dims` values, x fastest.
pub fn changes_across(values: &[f64], dims: UVec3, value: f64) -> Vec<f64> {
    changes_in(dims, 0..dims.z as usize, |i| values[i], value)
}

/// The value ranges in which a peak has at least half its height. An extinction that does not fall again to half is no peak.
fn peaks(knots: &[Knot]) -> Vec<ValueRange> {
    let is_top = |i: &usize| {
        let e = knots[*i].extinction;
        e > 0.0
            && *i > 0
            && knots[i - 1].extinction < e
            && knots[i + 1..].iter().find(|k| k.extinction != e).is_some_and(|k| k.extinction < e)
    };
    let range = |i: usize| {
        let half = 0.5 * knots[i].extinction;
        let before = (0..i).rev().find(|j| knots[*j].extinction <= half)?;
        let after = (i + 1..knots.len()).find(|j| knots[*j].extinction <= half)?;
        // A higher top on the way is another peak.
        let is_highest = knots[before..=after].iter().all(|k| k.extinction <= knots[i].extinction);
        let min = at_extinction(&knots[before], &knots[before + 1], half);
        let max = at_extinction(&knots[after], &knots[after - 1], half);
        is_highest.then_some(ValueRange { min, max })
    };
    (0..knots.len()).filter(is_top).filter_map(range).collect()
}

/// The value between two knots at which the extinction, which rises from the first to the second, is `wanted`.
fn at_extinction(low: &Knot, high: &Knot, wanted: f64) -> f64 {
    let share = (wanted - low.extinction) / (high.extinction - low.extinction);
    (1.0 - share) * low.value + share * high.value
}

/// Looks at every so many slices of larger volumes.
const MAX_VOXELS: usize = 1 << 22;

/// [`changes_across`] a value of a volume.
fn volume_changes(volume: &Volume, value: f64) -> Vec<f64> {
    let dims = volume.grid().dims();
    let slices = (0..dims.z as usize).step_by(volume.grid().n_voxels().div_ceil(MAX_VOXELS));
    changes_in(dims, slices, |i| volume.value(i), value)
}

/// The changes from the voxels of some slices to their upper neighbours.
fn changes_in(
    dims: UVec3,
    slices: impl Iterator<Item = usize>,
    value_at: impl Fn(usize) -> f64,
    value: f64,
) -> Vec<f64> {
    let dims = dims.to_array().map(|n| n as usize);
    let strides = [1, dims[0], dims[0] * dims[1]];
    let mut changes = Vec::new();
    for z in slices {
        for i in z * strides[2]..(z + 1) * strides[2] {
            let at = [i % dims[0], i / dims[0] % dims[1], z];
            let here = value_at(i);
            for axis in (0..3).filter(|axis| at[*axis] + 1 < dims[*axis]) {
                let there = value_at(i + strides[axis]);
                if here.min(there) <= value && value <= here.max(there) && here != there {
                    changes.push((here - there).abs());
                }
            }
        }
    }
    changes
}

fn median(mut numbers: Vec<f64>) -> Option<f64> {
    let half = numbers.len() / 2;
    (!numbers.is_empty()).then(|| *numbers.select_nth_unstable_by(half, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::Grid;
    use brickfield_core::glam::DVec3;

    fn transfer(knots: &[(f64, f64)]) -> TransferFunction {
        let knot = |(value, extinction): &(f64, f64)| Knot { value: *value, extinction: *extinction, color: [1.0; 3] };
        TransferFunction::new(knots.iter().map(knot).collect()).unwrap()
    }

    /// Values rise by 10 a voxel.
    fn slope() -> Volume {
        let grid = Grid::axis_aligned(UVec3::new(20, 2, 2), DVec3::ONE).unwrap();
        Volume::new(grid, (0..80).map(|i| (i % 20 * 10) as u8).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn a_peak_is_as_wide_as_at_half_its_height() {
        let of = |knots: &[(f64, f64)]| peaks(transfer(knots).knots());
        assert_eq!(of(&[(90.0, 0.0), (100.0, 2.0), (110.0, 0.0)]), [ValueRange { min: 95.0, max: 105.0 }]);
        // A box between two jumps, and two peaks.
        let jumps = [(50.0, 0.0), (50.0, 1.0), (52.0, 1.0), (52.0, 0.0)];
        assert_eq!(of(&jumps), [ValueRange { min: 50.0, max: 52.0 }]);
        assert_eq!(of(&[(0.0, 0.0), (1.0, 1.0), (2.0, 0.0), (8.0, 4.0), (16.0, 0.0)]).len(), 2);
        // What does not fall again to half is none, nor is a constant.
        assert_eq!(of(&[(0.0, 0.0), (10.0, 1.0), (20.0, 0.6)]), []);
        assert_eq!(of(&[(0.0, 1.0), (10.0, 0.0)]), []);
        assert_eq!(of(&[(0.0, 1.0)]), []);
    }

    #[test]
    fn a_step_that_is_wider_than_the_peak_is_told() {
        let peak = |width: f64| transfer(&[(95.0 - width, 0.0), (95.0, 1.0), (95.0 + width, 0.0)]);
        // Half a voxel changes the value by 5.
        assert_eq!(narrow_peak(&slope(), &peak(6.0), 0.5), None);
        let narrow = narrow_peak(&slope(), &peak(4.0), 0.5).unwrap();
        assert_eq!((narrow.change, narrow.values), (5.0, ValueRange { min: 93.0, max: 97.0 }));
        assert_eq!(narrow_peak(&slope(), &peak(4.0), 0.25), None);
        // Where no value is, nothing is stepped over.
        assert_eq!(narrow_peak(&slope(), &transfer(&[(200.0, 0.0), (200.1, 1.0), (200.2, 0.0)]), 0.5), None);
    }
}
