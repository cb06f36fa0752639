//! Probabilities of tokens: a fixed family of distributions, from which a brick names one for each context.
//!
//! A distribution of the family is Student's, of 1, 3, 7 or 15 degrees of freedom, at one of 32 scales, with the probability of 0
//! raised or lowered in one of seven ways. Only additions, multiplications, divisions and roundings of f64 are used, so that all
//! machines have the same tables.

use std::sync::OnceLock;

use crate::token::{ESCAPE, N_TOKENS, first_magnitude, n_magnitudes};

/// Frequencies of a table add up to 2^10.
pub(crate) const LOG_TOTAL: u32 = 10;
/// What frequencies of a table add up to.
pub(crate) const TOTAL: u32 = 1 << LOG_TOTAL;
/// Tokens and the escape.
pub(crate) const N_SYMBOLS: usize = N_TOKENS + 1;

const N_SCALES: usize = 32;
const N_SHAPES: usize = 4;
/// The share of probability that moves to 0 from all others, or, if negative, from 0 to all others.
const MOVES: [f64; 7] = [0.0, -0.25, 0.25, 0.5, 0.7, 0.85, 0.95];
/// Distributions of magnitudes: number = scale + 32 (shape + 4 move).
pub(crate) const N_MAGNITUDE_TABLES: usize = N_SCALES * N_SHAPES * MOVES.len();
/// Distributions of a flag.
const N_FLAG_TABLES: usize = 54;
/// All distributions; the flags' come last.
pub(crate) const N_TABLES: usize = N_MAGNITUDE_TABLES + N_FLAG_TABLES;

/// How often each token comes among [`TOTAL`]; 0 means that it is escaped.
pub(crate) type Frequencies = [u16; N_SYMBOLS];

/// The frequencies of table `number`.
pub(crate) fn frequencies(number: usize) -> Frequencies {
    match number.checked_sub(N_MAGNITUDE_TABLES) {
        Some(flag) => flag_frequencies(flag),
        None => rounded(&distribution(number)),
    }
}

/// Of a flag, the frequency of 1 is 1, 2, 3, 4, 5, 6, 7, 8, 10, 12, ...: each a quarter more than the one before, rounded down, but
/// one more at least; the last 27 tables have the flags exchanged.
fn flag_frequencies(flag: usize) -> Frequencies {
    let rare = (0..flag % (N_FLAG_TABLES / 2)).fold(1u32, |f, _| f + (f / 4).max(1));
    let ones = if flag < N_FLAG_TABLES / 2 { rare } else { TOTAL - rare };
    let mut frequencies = [0; N_SYMBOLS];
    (frequencies[0], frequencies[1]) = ((TOTAL - ones) as u16, ones as u16);
    frequencies
}

/// The probability of each token.
fn distribution(number: usize) -> [f64; N_TOKENS] {
    let (scale, shape, moved) = (number % N_SCALES, number / N_SCALES % N_SHAPES, number / (N_SCALES * N_SHAPES));
    let octave = (1u64 << (scale / 2)) as f64;
    let scale = 0.1 * octave * if scale % 2 == 1 { std::f64::consts::SQRT_2 } else { 1.0 };
    let mut p: [f64; N_TOKENS] = std::array::from_fn(|token| mass(token as u8, scale, shape as u32));
    let sum: f64 = p.iter().sum();
    p.iter_mut().for_each(|p| *p /= sum);
    let share = MOVES[moved];
    let zero = if share < 0.0 { p[0] * (1.0 + share) } else { p[0] * (1.0 - share) + share };
    let others = (1.0 - zero) / (1.0 - p[0]);
    p.iter_mut().for_each(|p| *p *= others);
    p[0] = zero;
    p
}

/// The integral of a Student density, not normalised, over a token's magnitudes of both signs, by 16 midpoints.
fn mass(token: u8, scale: f64, shape: u32) -> f64 {
    let (first, n) = (f64::from(first_magnitude(token)), f64::from(n_magnitudes(token)));
    let degrees = f64::from((2u32 << shape) - 1);
    let density = |x: f64| {
        let t = x / scale;
        let base = 1.0 / (1.0 + t * t / degrees);
        (0..shape).fold(base, |power, _| power * power)
    };
    let sum = (0..16).map(|i| density(first - 0.5 + n * (f64::from(i) + 0.5) / 16.0)).sum::<f64>();
    sum * n / 16.0 * if token == 0 { 1.0 } else { 2.0 }
}

/// Probabilities as frequencies: at least 1 for token 0 and for each token of 1/2048 and more, 0 for all others, which are escaped;
/// what rounding leaves is given to, or taken from, the most frequent one.
fn rounded(p: &[f64; N_TOKENS]) -> Frequencies {
    let total = f64::from(TOTAL);
    let rare = 0.5 / total;
    let frequency = |p: f64| (p * total).round().max(1.0) as u16;
    let mut frequencies = [0; N_SYMBOLS];
    let mut escaped = 0.0;
    for (token, (f, &p)) in frequencies.iter_mut().zip(p).enumerate() {
        match token > 0 && p < rare {
            true => escaped += p,
            false => *f = frequency(p),
        }
    }
    frequencies[usize::from(ESCAPE)] = frequency(escaped);
    let sum: i32 = frequencies.iter().map(|&f| i32::from(f)).sum();
    let greatest = (0..N_TOKENS).max_by_key(|&t| (frequencies[t], std::cmp::Reverse(t))).expect("tokens");
    frequencies[greatest] = (i32::from(frequencies[greatest]) + TOTAL as i32 - sum) as u16;
    frequencies
}

/// What each symbol of a table costs, in bits, without those that follow it.
pub(crate) type Costs = [f32; N_SYMBOLS];

/// The costs of all tables. An escape costs 6 bits more, and the magnitude.
pub(crate) fn costs() -> &'static [Costs] {
    static COSTS: OnceLock<Vec<Costs>> = OnceLock::new();
    COSTS.get_or_init(|| (0..N_TABLES).map(|number| costs_of(&frequencies(number))).collect())
}

fn costs_of(frequencies: &Frequencies) -> Costs {
    let bits = |f: u16| LOG_TOTAL as f32 - f32::from(f).log2();
    let escape = bits(frequencies[usize::from(ESCAPE)].max(1)) + 6.0;
    std::array::from_fn(|symbol| match frequencies[symbol] {
        0 => escape,
        _ if symbol == usize::from(ESCAPE) => escape,
        f => bits(f),
    })
}

/// The number of the magnitude table with which a histogram costs least, nearly: shapes and moves are tried near the best scale of
/// one of them only. Also the bits.
pub(crate) fn best_magnitude_table(counts: &[u32; N_SYMBOLS]) -> (usize, f32) {
    let near = least(counts, (0..N_SCALES).map(|scale| scale + 2 * N_SCALES)).0 % N_SCALES;
    let scales = near.saturating_sub(6)..(near + 7).min(N_SCALES);
    least(counts, (0..N_SHAPES * MOVES.len()).flat_map(|kind| scales.clone().map(move |s| s + N_SCALES * kind)))
}

/// The same of the tables of a flag.
pub(crate) fn best_flag_table(counts: &[u32; N_SYMBOLS]) -> (usize, f32) {
    least(counts, N_MAGNITUDE_TABLES..N_TABLES)
}

fn least(counts: &[u32; N_SYMBOLS], tables: impl Iterator<Item = usize>) -> (usize, f32) {
    let n = counts.iter().rposition(|&n| n > 0).map_or(0, |last| last + 1);
    let counts = counts.map(|n| n as f32);
    let cost = |costs: &Costs| costs[..n].iter().zip(&counts[..n]).map(|(cost, n)| cost * n).sum::<f32>();
    let all = costs();
    tables.map(|t| (t, cost(&all[t]))).min_by(|a, b| a.1.total_cmp(&b.1)).expect("a range of tables")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_add_up() {
        for number in 0..N_TABLES {
            let frequencies = frequencies(number);
            let sum: u32 = frequencies.iter().map(|&f| u32::from(f)).sum();
            assert_eq!(sum, TOTAL, "table {number}");
            let is_flag = number >= N_MAGNITUDE_TABLES;
            assert!(frequencies[0] > 0 && (is_flag || frequencies[usize::from(ESCAPE)] > 0), "table {number}");
        }
    }

    /// The tables are a part of the format: another bit in them, and old bricks cannot be read.
    #[test]
    fn frequencies_are_those_of_version_1() {
        let all: Vec<u8> = (0..N_TABLES).flat_map(frequencies).flat_map(u16::to_le_bytes).collect();
        assert_eq!(crc32c::crc32c(&all), 1_464_090_189);
    }

    #[test]
    fn a_histogram_finds_its_own_table() {
        for number in [3, 40, 300, 640] {
            let counts = frequencies(number).map(|f| u32::from(f) * 1000);
            let (found, bits) = best_magnitude_table(&counts);
            let own = costs()[number].iter().zip(&counts).map(|(c, &n)| c * n as f32).sum::<f32>();
            assert!(bits <= own * 1.000_001, "table {number} costs {own} bits, found {found} with {bits}");
        }
    }
}
