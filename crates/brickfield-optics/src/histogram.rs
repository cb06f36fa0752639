//! The histogram that the automatic transfer function looks at, and its two thresholds.

use brickfield_core::{Rescale, Scalar, ScalarType, ValueRange, Volume, with_voxels};

/// Counts of data values in bins of one width; values outside the range are not counted.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VolumeHistogram {
    range: ValueRange,
    width: f64,
    bins: Vec<Bin>,
}

/// A bin: its voxels, and the least and greatest value among them.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bin {
    count: u64,
    min: f64,
    max: f64,
}

/// The most bins of a histogram.
const MAX_BINS: usize = 512;
/// A value is set apart from the rest by at least this share of the range.
const PADDING_GAP: f64 = 0.08;
/// The values without the padding must fill at least this many bins: two labels are not a padding and a volume.
const LEAST_OCCUPIED: usize = 32;
/// Looks at the volume at most so often for its padding.
const MAX_PASSES: usize = 4;
/// The brightest share of all voxels that may be burnt in (letters, a marker) or stray.
const STRAY_SHARE: f64 = 1e-3;
/// Cuts the stray values off at most so often.
const MAX_CUTS: usize = 3;
/// The values that are left must have this share outside of the fullest heap, so many of its standard deviations from its peak.
const LEAST_OUTSIDE: f64 = 0.01;
const HEAP_DEVIATIONS: f64 = 4.0;

impl VolumeHistogram {
    /// The histogram of a volume without its padding: lone values at either end (-1500 below air at -1000, 1e30 where
    /// nothing was measured). A lone 0 at the low end is a background, not padding.
    pub(crate) fn without_padding(volume: &Volume) -> VolumeHistogram {
        let whole = VolumeHistogram::over(volume, volume.range());
        let mut kept = whole.clone();
        let mut candidate = whole;
        for _ in 1..MAX_PASSES {
            let Some(range) = candidate.range_without_a_lone_end() else { break };
            candidate = VolumeHistogram::over(volume, range);
            if candidate.n_occupied() >= LEAST_OCCUPIED {
                kept = candidate.clone();
            }
        }
        kept
    }

    /// The histogram without the few brightest voxels, as long as these take up more than half of the range and the others are
    /// more than one heap: letters beside a head do not hide it, and beads in a noisy background stay.
    pub(crate) fn without_stray_values(self, volume: &Volume) -> VolumeHistogram {
        let mut kept = self;
        for _ in 0..MAX_CUTS {
            let last = kept.quantile(0, kept.n_bins(), 1.0 - STRAY_SHARE);
            if 2 * (last + 1) > kept.n_bins() || kept.bins[last].count == 0 {
                break;
            }
            let candidate = VolumeHistogram::over(volume, ValueRange { min: kept.range.min, max: kept.bins[last].max });
            if candidate.share_outside_heap() < LEAST_OUTSIDE {
                break;
            }
            kept = candidate;
        }
        kept
    }

    /// The share of voxels that lie outside of the fullest heap, taken for a Gaussian as wide as at half its height.
    fn share_outside_heap(&self) -> f64 {
        let n = self.n_bins();
        let peak = self.mode(0, n);
        let is_high = |b: &usize| 2 * self.count(*b) >= self.count(peak);
        let above = (peak..n).take_while(is_high).count();
        let below = (0..=peak).rev().take_while(is_high).count();
        // Half the width at half the height is sqrt(2 ln 2) standard deviations. A heap that one end of the range cuts has one side.
        let deviation =
            (above.min(below).max(above.max(below) / 2) as f64 - 0.5) / (2.0 * std::f64::consts::LN_2).sqrt();
        let reach = (HEAP_DEVIATIONS * deviation).ceil() as usize;
        let inside = self.total(peak.saturating_sub(reach), (peak + reach + 1).min(n));
        1.0 - inside as f64 / self.total(0, n).max(1) as f64
    }

    fn over(volume: &Volume, range: ValueRange) -> VolumeHistogram {
        let span = range.max - range.min;
        let width = match volume.scalar_type() {
            ScalarType::F32 | ScalarType::F64 => span / MAX_BINS as f64,
            _ => {
                // Whole numbers of stored integers, so that bins hold equally many of them.
                let unit = volume.rescale().slope().abs();
                ((span / unit + 1.0) / MAX_BINS as f64).ceil() * unit
            }
        };
        if !(width.is_finite() && width > 0.0) {
            return VolumeHistogram { range, width: 0.0, bins: vec![Bin { count: 1, min: range.min, max: range.max }] };
        }
        let n = ((span / width) as usize + 1).min(MAX_BINS);
        let mut bins = vec![Bin { count: 0, min: f64::INFINITY, max: f64::NEG_INFINITY }; n];
        with_voxels!(volume.voxels(), v => count(v, volume.rescale(), range, width, &mut bins));
        VolumeHistogram { range, width, bins }
    }

    /// The range of values that are counted.
    #[cfg(test)]
    fn range(&self) -> ValueRange {
        self.range
    }

    /// Whether there is but one bin: a constant volume.
    pub(crate) fn is_constant(&self) -> bool {
        self.n_occupied() < 2
    }

    /// Number of bins.
    pub(crate) fn n_bins(&self) -> usize {
        self.bins.len()
    }

    /// Voxels in a bin.
    pub(crate) fn count(&self, bin: usize) -> u64 {
        self.bins[bin].count
    }

    /// Voxels in the bins `from..to`.
    pub(crate) fn total(&self, from: usize, to: usize) -> u64 {
        self.bins[from..to].iter().map(|b| b.count).sum()
    }

    /// The middle of the values in a bin; the middle of the bin where it is empty.
    pub(crate) fn value(&self, bin: usize) -> f64 {
        let b = self.bins[bin];
        if b.count > 0 { 0.5 * b.min + 0.5 * b.max } else { self.range.min + (bin as f64 + 0.5) * self.width }
    }

    /// The bin of the value below which the share `q` of the voxels in `from..to` lies.
    pub(crate) fn quantile(&self, from: usize, to: usize, q: f64) -> usize {
        let below = self.total(from, to) as f64 * q;
        let mut sum = 0.0;
        for bin in from..to {
            sum += self.bins[bin].count as f64;
            if sum > below {
                return bin;
            }
        }
        to - 1
    }

    /// The fullest of the bins `from..to`, the lowest one of equals.
    pub(crate) fn mode(&self, from: usize, to: usize) -> usize {
        (from..to).rev().max_by_key(|b| self.bins[*b].count).unwrap_or(from)
    }

    fn n_occupied(&self) -> usize {
        self.bins.iter().filter(|b| b.count > 0).count()
    }

    /// The range without the lowest value if that is negative and stands alone, or else without the highest.
    fn range_without_a_lone_end(&self) -> Option<ValueRange> {
        let gap = PADDING_GAP * (self.range.max - self.range.min);
        let mut occupied = self.bins.iter().filter(|b| b.count > 0);
        let (first, second) = (occupied.next()?, occupied.next()?);
        if first.min == first.max && first.max < 0.0 && second.min - first.max >= gap {
            return Some(ValueRange { min: second.min, max: self.range.max });
        }
        let mut occupied = self.bins.iter().rev().filter(|b| b.count > 0);
        let (last, before) = (occupied.next()?, occupied.next()?);
        let lone = last.min == last.max && last.min - before.max >= gap;
        lone.then_some(ValueRange { min: self.range.min, max: before.max })
    }
}

fn count<T: Scalar>(stored: &[T], rescale: Rescale, range: ValueRange, width: f64, bins: &mut [Bin]) {
    let last = bins.len() - 1;
    let per_width = 1.0 / width;
    for v in stored {
        let x = rescale.value(v.to_f64());
        if range.contains(x) {
            let bin = &mut bins[(((x - range.min) * per_width) as usize).min(last)];
            bin.count += 1;
            bin.min = bin.min.min(x);
            bin.max = bin.max.max(x);
        }
    }
}

/// Cuts the bins `from..to` into at most three classes of least variance within (Otsu 1979, eq. 13-18, exhaustively);
/// the first bin of every class but the first. Empty classes are left out.
pub(crate) fn otsu_cuts(h: &VolumeHistogram, from: usize, to: usize, n_classes: Classes) -> Vec<usize> {
    let sums = Sums::new(h, from, to);
    let mut best = (0.0, vec![]);
    for a in from + 1..to {
        let two = sums.between(from, a) + sums.between(a, to);
        if two > best.0 {
            best = (two, vec![a]);
        }
        if n_classes == Classes::Three {
            for b in a + 1..to {
                let three = sums.between(from, a) + sums.between(a, b) + sums.between(b, to);
                if three > best.0 * (1.0 + 1e-12) {
                    best = (three, vec![a, b]);
                }
            }
        }
    }
    best.1
}

/// How many classes to look for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Classes {
    Two,
    Three,
}

/// Running sums of counts and counts times values.
struct Sums {
    from: usize,
    count: Vec<f64>,
    moment: Vec<f64>,
}

impl Sums {
    fn new(h: &VolumeHistogram, from: usize, to: usize) -> Sums {
        let n = h.total(from, to).max(1) as f64;
        // In bins, not values: their squares stay finite.
        let at = |b: usize| (h.value(b) - h.range.min) / h.width;
        let mean = (from..to).map(|b| h.count(b) as f64 / n * at(b)).sum::<f64>();
        let (mut count, mut moment) = (vec![0.0], vec![0.0]);
        for b in from..to {
            let c = h.count(b) as f64;
            count.push(count[b - from] + c);
            moment.push(moment[b - from] + c * (at(b) - mean));
        }
        Sums { from, count, moment }
    }

    /// A class's share of the variance between classes.
    fn between(&self, a: usize, b: usize) -> f64 {
        let n = self.count[b - self.from] - self.count[a - self.from];
        let m = self.moment[b - self.from] - self.moment[a - self.from];
        if n > 0.0 { m * m / n } else { 0.0 }
    }
}

/// The foot of the slope that falls from the bin `peak` to the last bin before `to`: the bin farthest below the line
/// between the two (Zack, Rogers and Latt 1977, the triangle method).
pub(crate) fn triangle_foot(h: &VolumeHistogram, peak: usize, to: usize) -> usize {
    let (high, low) = (h.count(peak) as f64, h.count(to - 1) as f64);
    let slope = (low - high) / ((to - 1 - peak) as f64).max(1.0);
    let below = |b: usize| high + slope * (b - peak) as f64 - h.count(b) as f64;
    (peak..to).rev().max_by(|a, b| below(*a).total_cmp(&below(*b))).unwrap_or(peak)
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::Grid;
    use brickfield_core::glam::{DVec3, UVec3};

    fn volume<T: Scalar>(values: Vec<T>) -> Volume {
        let grid = Grid::axis_aligned(UVec3::new(values.len() as u32, 1, 1), DVec3::ONE).unwrap();
        Volume::new(grid, T::wrap(values)).unwrap()
    }

    #[test]
    fn padding_at_both_ends_is_left_out() {
        let mut values: Vec<f32> = (0..1000).map(|i| i as f32 / 10.0).collect();
        values.extend([-9999.0; 40]);
        values.extend([1e30; 40]);
        let h = VolumeHistogram::without_padding(&volume(values));
        assert_eq!(h.range(), ValueRange { min: 0.0, max: f64::from(99.9f32) });
        assert_eq!(h.total(0, h.n_bins()), 1000);
    }

    #[test]
    fn labels_and_masks_are_not_padding() {
        let masked = volume((0..200u8).map(|i| if i < 60 { 0 } else { i }).collect());
        assert_eq!(VolumeHistogram::without_padding(&masked).range().min, 0.0);
        let h = VolumeHistogram::without_padding(&volume(vec![0u8, 0, 0, 255, 255]));
        assert_eq!(h.range(), ValueRange { min: 0.0, max: 255.0 });
    }

    #[test]
    fn a_few_bright_values_are_left_out_if_the_others_are_more_than_one_heap() {
        let cut = |values: Vec<i16>| {
            let volume = volume(values);
            VolumeHistogram::without_padding(&volume).without_stray_values(&volume).range().max
        };
        let head = |i: i16| if i % 3 == 0 { 500 + i % 70 } else { i % 7 };
        let letters = (0..10).map(|i| 9000 + 37 * i);
        assert_eq!(cut((0..20_000).map(head).chain(letters.clone()).collect()), 569.0);
        // A tenth of all voxels are no letters.
        let bones = (0..2000).map(|i| 9000 + i % 97);
        assert_eq!(cut((0..20_000).map(head).chain(bones).collect()), 9096.0);
        // Noise around one value has nothing else to show than the few bright ones.
        let noise = |i: i16| (0..12).map(|k| (i32::from(i) * 7919 + k * 104_729) % (101 + k) / 12).sum::<i32>() as i16;
        assert_eq!(cut((0..20_000).map(noise).chain(letters).collect()), 9333.0);
    }

    #[test]
    fn otsu_parts_three_heaps() {
        let heaps = [10u8, 11, 12, 100, 101, 102, 200, 201, 202];
        let h = VolumeHistogram::without_padding(&volume(heaps.to_vec()));
        let cuts = otsu_cuts(&h, 0, h.n_bins(), Classes::Three);
        let classes: Vec<u64> = [0, cuts[0], cuts[1], h.n_bins()].windows(2).map(|w| h.total(w[0], w[1])).collect();
        assert_eq!(classes, [3, 3, 3]);
        assert_eq!(otsu_cuts(&h, 0, h.n_bins(), Classes::Two).len(), 1);
    }

    #[test]
    fn the_foot_of_a_spike_is_beside_it() {
        let mut values = vec![0u8; 10_000];
        values.extend(1..=255u8);
        let h = VolumeHistogram::without_padding(&volume(values));
        assert!((1..=3).contains(&triangle_foot(&h, 0, h.n_bins())));
    }
}
