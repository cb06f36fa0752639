//! JPEG-LS (ITU-T T.87, 1998): the samples of a scan. Names in brackets are the recommendation's.
//!
//! ```text
//!   c b d     The sample x is predicted from its neighbours a, b, c; the gradients d-b, b-c, c-a choose one of 365
//!   a x       contexts, whose statistics correct the prediction and choose the code's length. Where all gradients
//!             vanish, the length of a run is coded instead.
//! ```

/// The parameters of a scan, and what follows from them (A.2.1).
pub(super) struct Coding {
    /// Greatest sample (MAXVAL).
    max: i32,
    /// Greatest error of a sample (NEAR); 0 is lossless.
    near: i32,
    thresholds: [i32; 3],
    reset: i32,
    /// Errors are coded modulo this (RANGE).
    range: i32,
    /// Bits of an error that is coded as it is (qbpp).
    n_error_bits: u32,
    /// Most bits of a code (LIMIT).
    limit: u32,
}

impl Coding {
    pub(super) fn new(max: i32, near: i32, thresholds: [i32; 3], reset: i32) -> Coding {
        let range = (max + 2 * near) / (2 * near + 1) + 1;
        let n_bits = ceil_log2(max + 1).max(2);
        let limit = 2 * (n_bits + n_bits.max(8));
        Coding { max, near, thresholds, reset, range, n_error_bits: ceil_log2(range), limit }
    }

    fn quantized(&self, gradient: i32) -> i32 {
        let [t1, t2, t3] = self.thresholds;
        let size = gradient.abs();
        let level = match size {
            _ if size <= self.near => 0,
            _ if size < t1 => 1,
            _ if size < t2 => 2,
            _ if size < t3 => 3,
            _ => 4,
        };
        level * gradient.signum()
    }

    /// The sample of a prediction and its error (A.4.5, A.5.3).
    fn sample(&self, predicted: i32, error: i32) -> i32 {
        let step = 2 * self.near + 1;
        let mut sample = predicted + error * step;
        if sample < -self.near {
            sample += self.range * step;
        } else if sample > self.max + self.near {
            sample -= self.range * step;
        }
        sample.clamp(0, self.max)
    }
}

fn ceil_log2(n: i32) -> u32 {
    (n as u32).next_power_of_two().trailing_zeros()
}

/// The order of the components' samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interleave {
    Line,
    Sample,
}

/// The planes of a scan, and the bytes that it takes; nothing if it is cut off or corrupt.
pub(super) fn decode_scan(
    bytes: &[u8],
    coding: &Coding,
    interleave: Interleave,
    n_components: usize,
    [columns, rows]: [usize; 2],
) -> Option<(Vec<Vec<u16>>, usize)> {
    let mut state = State::new(bytes, coding);
    let mut planes = vec![Vec::with_capacity(columns * rows); n_components];
    let mut components = vec![Lines::new(columns); n_components];
    for _ in 0..rows {
        components.iter_mut().for_each(Lines::next);
        match interleave {
            Interleave::Line => {
                for lines in &mut components {
                    let run_index = lines.run_index;
                    lines.run_index = state.line(std::slice::from_mut(lines), columns, run_index)?;
                }
            }
            Interleave::Sample => {
                let run_index = components[0].run_index;
                components[0].run_index = state.line(&mut components, columns, run_index)?;
            }
        }
        for (plane, lines) in planes.iter_mut().zip(&components) {
            plane.extend(lines.current[1..=columns].iter().map(|v| *v as u16));
        }
    }
    Some((planes, state.bits.at))
}

/// The current line and the previous line, each with an extra sample at both ends.
#[derive(Clone)]
struct Lines {
    previous: Vec<i32>,
    current: Vec<i32>,
    /// Where the code of runs stands (RUNindex).
    run_index: usize,
}

impl Lines {
    fn new(columns: usize) -> Lines {
        Lines { previous: vec![0; columns + 2], current: vec![0; columns + 2], run_index: 0 }
    }

    /// The edges' neighbours (A.2.1): above the first line lie zeros; left of a line lies the first sample of the one before.
    fn next(&mut self) {
        std::mem::swap(&mut self.previous, &mut self.current);
        let last = self.previous.len() - 1;
        self.previous[last] = self.previous[last - 1];
        self.current[0] = self.previous[1];
    }

    /// The neighbours a, b, c and d of the sample at `x`, which counts from 1.
    fn neighbours(&self, x: usize) -> [i32; 4] {
        [self.current[x - 1], self.previous[x], self.previous[x - 1], self.previous[x + 1]]
    }
}

/// The statistics of a context (A, B, C, N).
#[derive(Clone, Copy)]
struct Context {
    sum_of_sizes: i64,
    bias: i32,
    correction: i32,
    n: i32,
}

/// The statistics of the samples that end runs (A, Nn, N).
#[derive(Clone, Copy)]
struct RunContext {
    sum_of_sizes: i64,
    n_negative: i32,
    n: i32,
}

struct State<'a> {
    bits: Bits<'a>,
    coding: &'a Coding,
    contexts: Vec<Context>,
    /// After a run, where a and b differ, and where they are alike.
    run_contexts: [RunContext; 2],
}

const N_CONTEXTS: usize = 365;
/// Bits of a run's length (J).
const RUN_BITS: [u32; 32] =
    [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 9, 10, 11, 12, 13, 14, 15];

impl<'a> State<'a> {
    fn new(bytes: &'a [u8], coding: &'a Coding) -> State<'a> {
        let first = i64::from((coding.range + 32) / 64).max(2);
        State {
            bits: Bits::new(bytes),
            coding,
            contexts: vec![Context { sum_of_sizes: first, bias: 0, correction: 0, n: 1 }; N_CONTEXTS],
            run_contexts: [RunContext { sum_of_sizes: first, n_negative: 0, n: 1 }; 2],
        }
    }

    /// Decodes a line of one component, or of all at once; the run index after it.
    fn line(&mut self, components: &mut [Lines], columns: usize, mut run_index: usize) -> Option<usize> {
        let mut x = 1;
        while x <= columns {
            let is_flat = components.iter().all(|lines| self.context_number(&lines.neighbours(x)) == 0);
            if is_flat {
                x = self.run(components, x, columns, &mut run_index)?;
                continue;
            }
            for lines in components.iter_mut() {
                lines.current[x] = self.regular(&lines.neighbours(x))?;
            }
            x += 1;
        }
        Some(run_index)
    }

    /// 81 q1 + 9 q2 + q3: its sign is that of the first gradient that is not 0 (A.3.4).
    fn context_number(&self, [a, b, c, d]: &[i32; 4]) -> i32 {
        let q = |gradient| self.coding.quantized(gradient);
        81 * q(d - b) + 9 * q(b - c) + q(c - a)
    }

    /// A sample that is no part of a run (A.4 to A.6).
    fn regular(&mut self, neighbours: &[i32; 4]) -> Option<i32> {
        let number = self.context_number(neighbours);
        let sign = if number < 0 { -1 } else { 1 };
        let coding = self.coding;
        let context = &mut self.contexts[number.unsigned_abs() as usize];
        let predicted = (median_predicted(neighbours) + sign * context.correction).clamp(0, coding.max);
        let k = code_length(context.sum_of_sizes, context.n)?;
        let mapped = self.bits.code(k, coding.limit, coding.n_error_bits).filter(|m| *m <= 2 * coding.range)?;
        let is_inverted = coding.near == 0 && k == 0 && 2 * context.bias <= -context.n;
        let error = unmapped(mapped, is_inverted);
        context.update(error, coding);
        Some(coding.sample(predicted, sign * error))
    }

    /// A run and the sample that ends it (A.7); the next `x`.
    fn run(&mut self, components: &mut [Lines], start: usize, columns: usize, run_index: &mut usize) -> Option<usize> {
        let mut x = start;
        while self.bits.bit()? == 1 {
            let n = 1 << RUN_BITS[*run_index];
            let n_left = columns + 1 - x;
            fill_run(components, x, n.min(n_left));
            x += n.min(n_left);
            if n <= n_left {
                *run_index = (*run_index + 1).min(31);
            }
            if x > columns {
                return Some(x);
            }
        }
        let n = self.bits.take(RUN_BITS[*run_index])? as usize;
        if x + n > columns {
            return None;
        }
        fill_run(components, x, n);
        x += n;
        let are_several = components.len() > 1;
        for lines in components.iter_mut() {
            let [a, b, ..] = lines.neighbours(x);
            lines.current[x] = self.after_run(a, b, RUN_BITS[*run_index], are_several)?;
        }
        *run_index = run_index.saturating_sub(1);
        Some(x + 1)
    }

    /// The sample after a run (A.7.2). Where samples are interleaved, a and b count as different.
    fn after_run(&mut self, a: i32, b: i32, n_run_bits: u32, are_several: bool) -> Option<i32> {
        let coding = self.coding;
        let are_alike = !are_several && (a - b).abs() <= coding.near;
        let alike = i32::from(are_alike);
        let context = &mut self.run_contexts[alike as usize];
        let k = code_length(context.sum_of_sizes + i64::from(alike * (context.n >> 1)), context.n)?;
        let limit = coding.limit - n_run_bits - 1;
        let mapped = self.bits.code(k, limit, coding.n_error_bits).filter(|m| *m <= 2 * coding.range)?;
        let error = context.error(mapped + alike, k);
        context.update(error, mapped, alike, coding.reset);
        Some(match are_alike {
            true => coding.sample(a, error),
            false => coding.sample(b, if a > b { -error } else { error }),
        })
    }
}

fn fill_run(components: &mut [Lines], x: usize, n: usize) {
    for lines in components {
        let value = lines.current[x - 1];
        lines.current[x..x + n].fill(value);
    }
}

/// The prediction that favours edges (A.4.1).
fn median_predicted(&[a, b, c, _]: &[i32; 4]) -> i32 {
    if c >= a.max(b) {
        a.min(b)
    } else if c <= a.min(b) {
        a.max(b)
    } else {
        a + b - c
    }
}

/// Low bits of a code (A.5.1).
fn code_length(sum_of_sizes: i64, n: i32) -> Option<u32> {
    (0..=24).find(|k| i64::from(n) << k >= sum_of_sizes)
}

/// The error of its code: 0, -1, 1, -2, ... or inverted -1, 0, -2, 1, ... (A.5.2).
fn unmapped(mapped: i32, is_inverted: bool) -> i32 {
    match (mapped % 2 == 0, is_inverted) {
        (true, false) => mapped / 2,
        (false, false) => -(mapped / 2) - 1,
        (true, true) => -(mapped / 2) - 1,
        (false, true) => mapped / 2,
    }
}

impl Context {
    /// A.6.1 and A.6.2.
    fn update(&mut self, error: i32, coding: &Coding) {
        self.bias += error * (2 * coding.near + 1);
        self.sum_of_sizes += i64::from(error.abs());
        if self.n == coding.reset {
            self.sum_of_sizes >>= 1;
            self.bias >>= 1;
            self.n >>= 1;
        }
        self.n += 1;
        if self.bias <= -self.n {
            self.bias = (self.bias + self.n).max(1 - self.n);
            self.correction = (self.correction - 1).max(-128);
        } else if self.bias > 0 {
            self.bias = (self.bias - self.n).min(0);
            self.correction = (self.correction + 1).min(127);
        }
    }
}

impl RunContext {
    /// The error of `2 |error| - map` (A.7.2.2, read backwards).
    fn error(&self, doubled: i32, k: u32) -> i32 {
        let is_odd = doubled % 2 == 1;
        let size = (doubled + i32::from(is_odd)) / 2;
        let negatives_are_odd = k != 0 || 2 * self.n_negative >= self.n;
        if negatives_are_odd == is_odd { -size } else { size }
    }

    fn update(&mut self, error: i32, mapped: i32, alike: i32, reset: i32) {
        self.n_negative += i32::from(error < 0);
        self.sum_of_sizes += i64::from((mapped + 1 - alike) >> 1);
        if self.n == reset {
            self.sum_of_sizes >>= 1;
            self.n >>= 1;
            self.n_negative >>= 1;
        }
        self.n += 1;
    }
}

/// The bits of a scan, up to the next marker. A byte after 255 has seven (A.1).
struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
    after_ff: bool,
    /// The next bits, the first one at the top.
    cache: u64,
    n_cached: u32,
}

impl<'a> Bits<'a> {
    fn new(bytes: &'a [u8]) -> Bits<'a> {
        Bits { bytes, at: 0, after_ff: false, cache: 0, n_cached: 0 }
    }

    fn refill(&mut self) {
        while self.n_cached <= 56
            && let Some(&byte) = self.bytes.get(self.at)
        {
            let begins_marker = byte == 0xff && self.bytes.get(self.at + 1).is_none_or(|next| *next >= 0x80);
            if begins_marker || (self.after_ff && byte >= 0x80) {
                return;
            }
            let n = if self.after_ff { 7 } else { 8 };
            self.cache |= u64::from(byte) << (64 - n - self.n_cached);
            self.n_cached += n;
            self.after_ff = byte == 0xff;
            self.at += 1;
        }
    }

    fn take(&mut self, n: u32) -> Option<u32> {
        if n == 0 {
            return Some(0);
        }
        if self.n_cached < n {
            self.refill();
        }
        let rest = self.n_cached.checked_sub(n)?;
        let value = (self.cache >> (64 - n)) as u32;
        self.cache <<= n;
        self.n_cached = rest;
        Some(value)
    }

    fn bit(&mut self) -> Option<u32> {
        self.take(1)
    }

    /// A number: zeros and a one, then `k` bits; after `limit - n_bits - 1` zeros, the number less 1 in `n_bits` (A.5.3).
    fn code(&mut self, k: u32, limit: u32, n_bits: u32) -> Option<i32> {
        let most = limit.checked_sub(n_bits + 1)?;
        let mut n_zeros = 0;
        loop {
            if self.n_cached < 32 {
                self.refill();
            }
            let n = self.cache.leading_zeros().min(self.n_cached);
            n_zeros += n;
            if n < self.n_cached {
                self.take(n)?;
                break;
            }
            if n == 0 || n_zeros > most {
                return None;
            }
            (self.cache, self.n_cached) = (0, 0);
        }
        self.take(1)?;
        match n_zeros {
            _ if n_zeros < most => Some(((n_zeros << k) | self.take(k)?) as i32),
            _ if n_zeros == most => Some(self.take(n_bits)? as i32 + 1),
            _ => None,
        }
    }
}
