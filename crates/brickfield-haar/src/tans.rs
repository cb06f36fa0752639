//! Asymmetric numeral systems by tables (Duda 2013, tANS): symbols to bits by their frequencies.
//!
//! The state is a number below 2^10. To decode a symbol: look up the state; the entry has the symbol, and how many bits to read, which
//! are added to the entry's base to make the next state. Encoding goes backwards, from the last symbol to the first.

use std::sync::OnceLock;

use crate::frequencies::{Frequencies, LOG_TOTAL, N_SYMBOLS, N_TABLES, TOTAL, frequencies};
use crate::token::{ESCAPE, n_bits};

/// What a state means. From the lowest bit on: how many bits of the state follow (4), how many of state and token together (6), the
/// base of the next state (10), the token (6), whether it is the escape (1).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Entry(u32);

impl Entry {
    fn new(token: u8, n_state_bits: u32, base: u32) -> Entry {
        let is_escape = token == ESCAPE;
        let n_token_bits = if is_escape { 0 } else { n_bits(token) };
        let fields = n_state_bits | (n_state_bits + n_token_bits) << 4 | base << 10 | u32::from(token) << 20;
        Entry(fields | u32::from(is_escape) << 26)
    }

    #[inline(always)]
    pub(crate) fn n_state_bits(self) -> u32 {
        self.0 & 15
    }

    /// The bits of the state, and those of the token.
    #[inline(always)]
    pub(crate) fn n_all_bits(self) -> u32 {
        self.0 >> 4 & 63
    }

    #[inline(always)]
    pub(crate) fn token(self) -> u8 {
        (self.0 >> 20 & 63) as u8
    }

    #[inline(always)]
    pub(crate) fn is_escape(self) -> bool {
        self.0 >> 26 == 1
    }

    /// The next state, from the bits that are read.
    #[inline(always)]
    pub(crate) fn next_state(self, window: u64) -> u16 {
        let bits = window as u32 & MASKS[self.n_state_bits() as usize];
        ((self.0 >> 10 & (TOTAL - 1)) + bits) as u16
    }

    /// The bits that follow the token.
    #[inline(always)]
    pub(crate) fn token_bits(self, window: u64) -> u32 {
        (window as u32 & MASKS[self.n_all_bits() as usize]) >> self.n_state_bits()
    }
}

/// The lower n bits of a word, for as many as an entry can state.
static MASKS: [u32; 64] = {
    let mut masks = [u32::MAX; 64];
    let mut n = 0;
    while n < 32 {
        masks[n] = (1 << n) - 1;
        n += 1;
    }
    masks
};

/// The entries of all states.
pub(crate) type DecodeTable = [Entry; TOTAL as usize];

/// From symbols to states.
#[derive(Debug)]
pub(crate) struct EncodeTable {
    codes: [SymbolCode; N_SYMBOLS],
    /// The states of all symbols, each symbol's in ascending order.
    states: [u16; TOTAL as usize],
}

/// How a symbol is coded. Of a state behind it, plus [`TOTAL`], all but the lower n bits number the symbol's states.
#[derive(Clone, Copy, Debug)]
struct SymbolCode {
    /// 0 means that the symbol is escaped.
    frequency: u16,
    /// n in 16.16, less the least state with n bits: see [`EncodeTable::step_back`].
    n_bits: u32,
    /// Where the symbol's states begin, less its frequency.
    first: i32,
}

/// The decoding table of a number below [`N_TABLES`].
pub(crate) fn decode_table(number: usize) -> &'static DecodeTable {
    static TABLES: [OnceLock<Box<DecodeTable>>; N_TABLES] = [const { OnceLock::new() }; N_TABLES];
    TABLES[number].get_or_init(|| Box::new(new_decode_table(&frequencies(number))))
}

/// The encoding table of a number below [`N_TABLES`].
pub(crate) fn encode_table(number: usize) -> &'static EncodeTable {
    static TABLES: [OnceLock<EncodeTable>; N_TABLES] = [const { OnceLock::new() }; N_TABLES];
    TABLES[number].get_or_init(|| new_encode_table(&frequencies(number)))
}

/// The symbol of each state: symbols in ascending order, each as often as its frequency, are laid on the states at steps of
/// 5/8 of their number plus 3, modulo it.
fn spread(frequencies: &Frequencies) -> [u8; TOTAL as usize] {
    const STEP: usize = (TOTAL as usize / 8) * 5 + 3;
    let mut symbols = [0; TOTAL as usize];
    let mut state = 0;
    for (symbol, &frequency) in frequencies.iter().enumerate() {
        for _ in 0..frequency {
            symbols[state] = symbol as u8;
            state = (state + STEP) % TOTAL as usize;
        }
    }
    symbols
}

fn new_decode_table(frequencies: &Frequencies) -> DecodeTable {
    let mut next = frequencies.map(u32::from);
    spread(frequencies).map(|symbol| {
        let x = next[usize::from(symbol)];
        next[usize::from(symbol)] += 1;
        let n_state_bits = LOG_TOTAL - x.ilog2();
        Entry::new(symbol, n_state_bits, (x << n_state_bits) - TOTAL)
    })
}

fn new_encode_table(frequencies: &Frequencies) -> EncodeTable {
    let mut first = [0; N_SYMBOLS];
    for symbol in 1..N_SYMBOLS {
        first[symbol] = first[symbol - 1] + frequencies[symbol - 1];
    }
    let codes = std::array::from_fn(|symbol| SymbolCode::new(frequencies[symbol], first[symbol]));
    let mut next = first;
    let mut states = [0; TOTAL as usize];
    for (state, symbol) in spread(frequencies).into_iter().enumerate() {
        states[usize::from(next[usize::from(symbol)])] = state as u16;
        next[usize::from(symbol)] += 1;
    }
    EncodeTable { codes, states }
}

impl SymbolCode {
    fn new(frequency: u16, first: u16) -> SymbolCode {
        // With n bits a state is shifted to frequency .. 2 frequency, with n - 1 bits if it would be less.
        let n = LOG_TOTAL - u32::from(frequency.max(1)).ilog2();
        let least = u32::from(frequency) << n;
        SymbolCode { frequency, n_bits: (n << 16) - least, first: i32::from(first) - i32::from(frequency) }
    }
}

impl EncodeTable {
    /// The symbol that stands for a token: itself or the escape.
    #[inline(always)]
    pub(crate) fn symbol(&self, token: u8) -> u8 {
        if self.codes[usize::from(token)].frequency == 0 { ESCAPE } else { token }
    }

    /// The state before a symbol, from the state behind it; and the bits that lead from one to the other, with their number.
    #[inline(always)]
    pub(crate) fn step_back(&self, symbol: u8, state: u16) -> (u16, u32, u32) {
        let code = &self.codes[usize::from(symbol)];
        let x = u32::from(state) + TOTAL;
        let n = (x + code.n_bits) >> 16;
        let place = (x >> n) as i32 + code.first;
        (self.states[place as usize], x & ((1 << n) - 1), n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every state behind every symbol is reached again by decoding from the state before it.
    #[test]
    fn a_step_forward_undoes_a_step_back() {
        for number in [0, 31, 100, 500, 895, 896, 949] {
            let (encode, decode) = (encode_table(number), decode_table(number));
            for symbol in (0..N_SYMBOLS as u8).filter(|&s| encode.codes[usize::from(s)].frequency > 0) {
                for state in 0..TOTAL as u16 {
                    let (before, bits, n) = encode.step_back(symbol, state);
                    let entry = decode[usize::from(before)];
                    assert_eq!((entry.token(), entry.n_state_bits()), (symbol, n), "table {number}");
                    assert_eq!(entry.next_state(u64::from(bits)), state, "table {number}");
                }
            }
        }
    }
}
