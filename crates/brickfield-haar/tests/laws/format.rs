//! The format: a reader of packed bricks, written from the README's tables alone, and bricks of version 1.

use brickfield_haar::{BrickHeader, EncodeOptions, Kernel, Sample, Storage, Storages, decode, encode};
use proptest::prelude::*;

use crate::bricks::{bricks, hold};
use crate::for_all_types;

fn packed_bricks_are_as_specified<T: Sample>() {
    let kernel = prop::sample::select(vec![Kernel::Haar, Kernel::HaarPredicted, Kernel::LeGall53]);
    hold(200, (bricks::<T>(), kernel, 0..5u8), |((extent, samples), kernel, n_levels)| {
        let options = EncodeOptions {
            kernels: vec![kernel],
            storages: Storages::Packed,
            n_levels: Some(n_levels),
            ..EncodeOptions::default()
        };
        let brick = encode(extent, &samples, &options).expect("options within bounds");
        if brick[3] >> 4 == 2 {
            let read: Vec<i64> = Reader::of(&brick).samples();
            prop_assert!(read.iter().zip(&samples).all(|(&read, s)| read == s.to_i64()));
        }
        Ok(())
    });
}
for_all_types!(packed_bricks_are_as_specified);

/// Bytes that are read one after the other.
struct Reader<'a> {
    rest: &'a [u8],
    n_bits_of_arithmetic: u32,
    kernel: u8,
}

impl<'a> Reader<'a> {
    fn of(brick: &'a [u8]) -> Reader<'a> {
        assert_eq!(&brick[..3], b"BH\x01");
        let n_bits_of_arithmetic = [16, 32, 64][usize::from(brick[3] & 15) % 3];
        Reader { rest: &brick[3..], n_bits_of_arithmetic, kernel: 0 }
    }

    fn byte(&mut self) -> u8 {
        let (&first, rest) = self.rest.split_first().expect("a byte");
        self.rest = rest;
        first
    }

    fn number(&mut self) -> u64 {
        let byte = self.byte();
        u64::from(byte & 127) + if byte > 127 { self.number() << 7 } else { 0 }
    }

    fn samples(mut self) -> Vec<i64> {
        let (_type, transform) = (self.byte(), self.byte());
        self.kernel = transform & 15;
        let n_levels = usize::from(transform >> 4);
        let extent = [0; 3].map(|_| self.number() as usize);
        let (_step, _max_error) = (self.number(), self.number());
        let lengths: Vec<usize> = (0..=n_levels).map(|_| self.number() as usize).collect();
        self.rest = &self.rest[4..];
        let of_level = |level: usize| extent.map(|n| n.div_ceil(1 << level));
        let n_low = of_level(n_levels).iter().product();
        let mut low = self.section(lengths[0], n_low);
        for (i, &length) in lengths.iter().enumerate().skip(1) {
            let n = of_level(n_levels - i);
            let details = self.section(length, n.iter().product::<usize>() - low.len());
            low = self.finer(n, &low, &details);
        }
        low
    }

    /// The coefficients of a section.
    fn section(&mut self, length: usize, n: usize) -> Vec<i64> {
        let (section, rest) = self.rest.split_at(length);
        self.rest = &rest[4..];
        let (widths, mut groups) = section.split_at(n.div_ceil(64));
        let mut values = Vec::new();
        for &width in widths {
            let (width, n_here) = (usize::from(width), (n - values.len()).min(64));
            let bit = |i: usize| u64::from(groups[i / 8] >> (i % 8) & 1);
            for i in 0..n_here {
                let number = (0..width).map(|b| bit(i * width + b) << b).sum::<u64>() as i64;
                values.push(if number % 2 == 0 { number / 2 } else { -(number + 1) / 2 });
            }
            groups = &groups[(n_here * width).div_ceil(8)..];
        }
        assert!(groups.is_empty());
        values
    }

    /// A level from the next one and the details between them.
    fn finer(&self, n: [usize; 3], low: &[i64], details: &[i64]) -> Vec<i64> {
        let half = n.map(|n| n.div_ceil(2));
        let place = |[x, y, z]: [usize; 3]| x + n[0] * (y + n[1] * z);
        let mut array = vec![0; n.iter().product()];
        let mut coefficients = low.iter().chain(details);
        for band in 0..8 {
            let range = |a: usize| if band >> a & 1 == 1 { half[a]..n[a] } else { 0..half[a] };
            for z in range(2) {
                for y in range(1) {
                    for x in range(0) {
                        array[place([x, y, z])] = *coefficients.next().expect("a coefficient for each place");
                    }
                }
            }
        }
        for axis in [2, 1, 0] {
            let mut others = n;
            others[axis] = 1;
            for line in 0..others.iter().product() {
                let first = [line % others[0], line / others[0] % others[1], line / others[0] / others[1]];
                let at = |i: usize| {
                    let mut position = first;
                    position[axis] = i;
                    place(position)
                };
                let samples = self.line((0..n[axis]).map(|i| array[at(i)]).collect());
                (0..n[axis]).for_each(|i| array[at(i)] = samples[i]);
            }
        }
        array
    }

    /// The samples of a line of low values and details.
    fn line(&self, line: Vec<i64>) -> Vec<i64> {
        let (l, d) = line.split_at(line.len().div_ceil(2));
        if d.is_empty() {
            return line;
        }
        let wrap = |value: i64| value << (64 - self.n_bits_of_arithmetic) >> (64 - self.n_bits_of_arithmetic);
        let mut samples = vec![0; line.len()];
        match self.kernel {
            2 => {
                let detail = |i: isize| if i < 0 { d[0] } else { d[(i as usize).min(d.len() - 1)] };
                for (i, &low) in l.iter().enumerate() {
                    let sum = wrap(wrap(detail(i as isize - 1) + detail(i as isize)) + 2);
                    samples[2 * i] = wrap(low - sum.div_euclid(4));
                }
                for (i, &detail) in d.iter().enumerate() {
                    let right = if 2 * i + 2 < line.len() { samples[2 * i + 2] } else { samples[2 * i] };
                    samples[2 * i + 1] = wrap(detail + wrap(samples[2 * i] + right).div_euclid(2));
                }
            }
            kernel => {
                for (i, &detail) in d.iter().enumerate() {
                    let left = i.checked_sub(1).map(|i| l[i]);
                    let prediction = match (left, l.get(i + 1)) {
                        _ if kernel == 0 => 0,
                        (Some(left), Some(right)) => wrap(wrap(left - right) + 2).div_euclid(4),
                        (Some(left), None) => wrap(wrap(left - l[i]) + 1).div_euclid(2),
                        (None, Some(right)) => wrap(wrap(l[i] - right) + 1).div_euclid(2),
                        (None, None) => 0,
                    };
                    let difference = wrap(detail + prediction);
                    samples[2 * i + 1] = wrap(l[i] - difference.div_euclid(2));
                    samples[2 * i] = wrap(samples[2 * i + 1] + difference);
                }
                if l.len() > d.len() {
                    samples[line.len() - 1] = l[l.len() - 1];
                }
            }
        }
        samples
    }
}

/// A brick of 20 x 12 x 10 samples, coded with each kernel by the first version of this crate.
const OF_VERSION_1: [&[u8]; 4] = [
    include_bytes!("../version_1/haar.brick"),
    include_bytes!("../version_1/haar-predicted.brick"),
    include_bytes!("../version_1/53.brick"),
    include_bytes!("../version_1/median.brick"),
];

/// Noise on a slope, zeros in one half, and a few large values.
fn samples_of_version_1() -> Vec<u16> {
    let sample = |i: u32| {
        let (x, y, z) = (i % 20, i / 20 % 12, i / 240);
        let noise = i.wrapping_mul(2_654_435_761) >> 28;
        let far = if i.is_multiple_of(397) { 60_000 } else { 0 };
        if z < 5 { (100 + 3 * x + 7 * y + noise.min(5) + far) as u16 } else { far as u16 }
    };
    (0..20 * 12 * 10).map(sample).collect()
}

/// Bricks of old files are read: the files must not be changed.
#[test]
fn bricks_of_version_1_are_read() {
    for (kernel, brick) in Kernel::ALL.into_iter().zip(OF_VERSION_1) {
        let header = BrickHeader::read(brick).unwrap();
        assert_eq!((header.kernel(), header.storage()), (kernel, Storage::Coded));
        assert!(decode::<u16>(brick).unwrap().samples == samples_of_version_1(), "{kernel}");
    }
}
