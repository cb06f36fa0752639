//! Coefficients as tokens, which are coded by their probability, and bits, which are stored as they are.
//!
//! ```text
//!  magnitude   0 1 2 3 4 5 6 7   8-11  12-15  16-23  24-31  32-47  ...  2^17 + 2^16 .. 2^18 - 1   any
//!  token       0 1 2 3 4 5 6 7     8      9     10     11     12                37                 38, the escape
//!  bits        0 1 1 1 1 1 1 1     3      3      4      4      5                17                 see `Escape`
//! ```
//!
//! The bits are the sign (1 is negative), and above it the magnitude's distance from the token's first one.

/// The tokens of magnitudes.
pub(crate) const N_TOKENS: usize = 38;
/// The token of a coefficient that its table has no other for.
pub(crate) const ESCAPE: u8 = N_TOKENS as u8;

/// The token of a magnitude; [`ESCAPE`] from 2^18 on.
#[inline(always)]
pub(crate) fn token_of(magnitude: u64) -> u8 {
    if magnitude < 8 {
        return magnitude as u8;
    }
    let exponent = magnitude.ilog2();
    let upper_half = (magnitude >> (exponent - 1) & 1) as u32;
    (8 + 2 * (exponent - 3) + upper_half).min(N_TOKENS as u32) as u8
}

/// The least magnitude of a token.
#[inline(always)]
pub(crate) const fn first_magnitude(token: u8) -> u32 {
    match token {
        0..=7 => token as u32,
        _ => (2 + (token as u32 & 1)) << (2 + (token as u32 - 8) / 2),
    }
}

/// How many magnitudes a token stands for.
#[inline(always)]
pub(crate) const fn n_magnitudes(token: u8) -> u32 {
    match token {
        0..=7 => 1,
        _ => 1 << (2 + (token as u32 - 8) / 2),
    }
}

/// How many bits follow a token: its sign, but for token 0, and the place of the magnitude among the token's.
#[inline(always)]
pub(crate) const fn n_bits(token: u8) -> u32 {
    match token {
        0 => 0,
        _ => 1 + n_magnitudes(token).ilog2(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_tile_the_magnitudes() {
        let mut next = 0;
        for token in 0..N_TOKENS as u8 {
            let (first, n) = (first_magnitude(token), n_magnitudes(token));
            assert_eq!(first, next);
            for magnitude in [first, first + n / 2, first + n - 1] {
                assert_eq!(token_of(u64::from(magnitude)), token);
            }
            next = first + n;
        }
        assert_eq!(next, 1 << 18);
        assert!([1 << 18, u64::from(u32::MAX), u64::MAX].into_iter().all(|m| token_of(m) == ESCAPE));
        assert_eq!((n_bits(0), n_bits(7), n_bits(8), n_bits(37)), (0, 1, 3, 17));
    }
}
