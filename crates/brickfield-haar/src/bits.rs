//! Strings of bits: the first bit is the least significant one of the first byte.

/// A string of bits to be written.
#[derive(Debug, Default)]
pub(crate) struct BitWriter {
    bytes: Vec<u8>,
    /// Bits that do not fill a byte yet.
    pending: u64,
    n_pending: u32,
}

impl BitWriter {
    /// Appends the lower `n` bits of `value`, at most 32; its other bits must be 0.
    #[inline]
    pub(crate) fn push(&mut self, value: u64, n: u32) {
        debug_assert!(n <= 32 && value >> n == 0);
        self.pending |= value << self.n_pending;
        self.n_pending += n;
        if self.n_pending >= 32 {
            self.bytes.extend((self.pending as u32).to_le_bytes());
            self.pending >>= 32;
            self.n_pending -= 32;
        }
    }

    /// The bytes; the last one is filled up with zero bits.
    pub(crate) fn into_bytes(mut self) -> Vec<u8> {
        let n_bytes = self.n_pending.div_ceil(8) as usize;
        self.bytes.extend(&self.pending.to_le_bytes()[..n_bytes]);
        self.bytes
    }
}

/// A string of bits that is read. Behind its end are zero bits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BitReader<'a> {
    bytes: &'a [u8],
    position: usize,
}

impl<'a> BitReader<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> BitReader<'a> {
        BitReader { bytes, position: 0 }
    }

    /// The next bits, of which at least 57 are meant; the reader stays where it is.
    #[inline(always)]
    pub(crate) fn window(&self) -> u64 {
        let first = self.position >> 3;
        let word = match self.bytes.get(first..first + 8) {
            Some(bytes) => u64::from_le_bytes(bytes.try_into().expect("8 bytes")),
            None => self.last_word(first),
        };
        word >> (self.position & 7)
    }

    #[cold]
    fn last_word(&self, first: usize) -> u64 {
        let rest = self.bytes.get(first..).unwrap_or_default();
        rest.iter().rev().fold(0, |word, &byte| word << 8 | u64::from(byte))
    }

    /// Passes `n` bits.
    #[inline(always)]
    pub(crate) fn skip(&mut self, n: u32) {
        self.position += n as usize;
    }

    /// Reads `n` bits, at most 56.
    #[inline(always)]
    pub(crate) fn take(&mut self, n: u32) -> u64 {
        let value = low_bits(self.window(), n);
        self.skip(n);
        value
    }

    /// Whether bits behind the end have been read.
    #[inline(always)]
    pub(crate) fn is_beyond_end(&self) -> bool {
        self.position > self.bytes.len() * 8
    }

    /// Whether all bytes have been read, and less than 8 bits of the last one are left, all of them 0.
    pub(crate) fn is_at_end(&self) -> bool {
        let n_bits = self.bytes.len() * 8;
        (self.position..self.position + 8).contains(&n_bits) && self.window() == 0
    }
}

/// The lower `n` bits of a word, for n < 64.
#[inline(always)]
pub(crate) fn low_bits(word: u64, n: u32) -> u64 {
    word & ((1 << n) - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn bits_are_read_as_written(values: Vec<(u64, u8)>) {
            let values: Vec<(u64, u32)> = values.iter().map(|&(v, n)| (low_bits(v, u32::from(n % 33)), u32::from(n % 33))).collect();
            let mut writer = BitWriter::default();
            values.iter().for_each(|&(value, n)| writer.push(value, n));
            let bytes = writer.into_bytes();
            let mut reader = BitReader::new(&bytes);
            for &(value, n) in &values {
                prop_assert_eq!(reader.take(n), value);
            }
            prop_assert!(reader.is_at_end() && !reader.is_beyond_end());
            reader.skip(8);
            prop_assert!(!reader.is_at_end() && reader.is_beyond_end() && reader.window() == 0);
        }
    }
}
