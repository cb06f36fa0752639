//! Samples that are packed into less than whole bytes each.

/// Bytes of a row of samples that are packed without gaps: a row begins with a new byte.
pub(crate) fn packed_row_bytes(n_samples: usize, n_bits: usize) -> usize {
    (n_samples * n_bits).div_ceil(8)
}

/// Samples of 1 to 16 bits, the highest bit first, as numbers of one or two bytes (the lower first).
pub(crate) fn widen_bits(packed: &[u8], n_samples: usize, n_bits: usize, out: &mut Vec<u8>) {
    for row in packed.chunks_exact(packed_row_bytes(n_samples, n_bits)) {
        let (mut held, mut n_held, mut bytes) = (0u32, 0, row.iter());
        for _ in 0..n_samples {
            while n_held < n_bits {
                held = held << 8 | u32::from(*bytes.next().unwrap_or(&0));
                n_held += 8;
            }
            n_held -= n_bits;
            let value = held >> n_held & ((1 << n_bits) - 1);
            let width = if n_bits > 8 { 2 } else { 1 };
            out.extend_from_slice(&value.to_le_bytes()[..width]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_bits_become_numbers() {
        let widened = |packed: &[u8], n_samples, n_bits| {
            let mut out = vec![];
            widen_bits(packed, n_samples, n_bits, &mut out);
            out
        };
        assert_eq!(widened(&[0b1010_0000, 0b0110_0000], 3, 1), [1, 0, 1, 0, 1, 1]);
        assert_eq!(widened(&[0x12, 0x30], 3, 4), [1, 2, 3]);
        assert_eq!(widened(&[0x12, 0x34, 0x56], 2, 12), [0x23, 0x1, 0x56, 0x4]);
    }
}
