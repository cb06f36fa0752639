//! Undoing what writers do to samples before they compress them.

use crate::ByteOrder;

/// How the samples of a row were prepared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Predictor {
    None,
    /// Each sample is the difference from the one to its left (TIFF 6.0, section 14).
    Horizontal,
    /// The bytes of floats are sorted by their weight and then differenced (Adobe 2005, technical note 3).
    Float,
}

/// The samples of a row.
#[derive(Clone, Copy, Debug)]
pub(super) struct RowShape {
    /// Samples of a row, those of all colours counted.
    pub(super) n_samples: usize,
    /// Samples from one pixel to the next.
    pub(super) per_pixel: usize,
    pub(super) sample_bytes: usize,
}

/// Undoes the predictor in all rows; the byte order of samples afterwards.
pub(super) fn undo(predictor: Predictor, bytes: &mut [u8], row: RowShape, order: ByteOrder) -> ByteOrder {
    let row_bytes = (row.n_samples * row.sample_bytes).max(1);
    match predictor {
        Predictor::None => order,
        Predictor::Horizontal => {
            bytes.chunks_exact_mut(row_bytes).for_each(|r| sum_row(r, row, order));
            order
        }
        Predictor::Float => {
            let mut sorted = vec![0; row_bytes];
            bytes.chunks_exact_mut(row_bytes).for_each(|r| unsort_row(r, &mut sorted, row));
            ByteOrder::Big
        }
    }
}

fn sum_row(bytes: &mut [u8], row: RowShape, order: ByteOrder) {
    macro_rules! sum {
        ($t:ty) => {{
            let (samples, _) = bytes.as_chunks_mut::<{ size_of::<$t>() }>();
            for i in row.per_pixel..samples.len() {
                let (left, here) = (samples[i - row.per_pixel], samples[i]);
                samples[i] = match order {
                    ByteOrder::Little => {
                        <$t>::from_le_bytes(left).wrapping_add(<$t>::from_le_bytes(here)).to_le_bytes()
                    }
                    ByteOrder::Big => <$t>::from_be_bytes(left).wrapping_add(<$t>::from_be_bytes(here)).to_be_bytes(),
                };
            }
        }};
    }
    match row.sample_bytes {
        1 => sum!(u8),
        2 => sum!(u16),
        4 => sum!(u32),
        _ => sum!(u64),
    }
}

/// Sums the bytes, then brings those of each float together, the heaviest first.
fn unsort_row(bytes: &mut [u8], sorted: &mut [u8], row: RowShape) {
    for i in row.per_pixel..bytes.len() {
        bytes[i] = bytes[i].wrapping_add(bytes[i - row.per_pixel]);
    }
    sorted.copy_from_slice(bytes);
    for (i, float) in bytes.chunks_exact_mut(row.sample_bytes).enumerate() {
        for (weight, byte) in float.iter_mut().enumerate() {
            *byte = sorted[weight * row.n_samples + i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_summed_in_either_byte_order() {
        let row = RowShape { n_samples: 3, per_pixel: 1, sample_bytes: 2 };
        let mut little = [255, 0, 1, 0, 0, 1];
        assert_eq!(undo(Predictor::Horizontal, &mut little, row, ByteOrder::Little), ByteOrder::Little);
        assert_eq!(little, [255, 0, 0, 1, 0, 2]);
        let mut big = [0, 255, 0, 1, 1, 0];
        undo(Predictor::Horizontal, &mut big, row, ByteOrder::Big);
        assert_eq!(big, [0, 255, 1, 0, 2, 0]);
    }

    #[test]
    fn bytes_of_floats_come_together() {
        let floats = [1.0f32, -2.5];
        let big: Vec<[u8; 4]> = floats.iter().map(|f| f.to_be_bytes()).collect();
        let mut bytes: Vec<u8> = (0..4).flat_map(|weight| big.iter().map(move |f| f[weight])).collect();
        for i in (1..8).rev() {
            bytes[i] = bytes[i].wrapping_sub(bytes[i - 1]);
        }
        let row = RowShape { n_samples: 2, per_pixel: 1, sample_bytes: 4 };
        assert_eq!(undo(Predictor::Float, &mut bytes, row, ByteOrder::Little), ByteOrder::Big);
        assert_eq!(bytes, big.concat());
    }
}
