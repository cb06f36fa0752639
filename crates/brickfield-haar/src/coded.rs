//! Boxes of coefficients as bits, by tokens whose probabilities depend on their contexts.
//!
//! A section is a string of bits: the first states of nine lanes, 10 bits each, then rows in ascending order. A row begins with its
//! flag, in lane 8: 1 if all is 0. Otherwise coefficient x follows in lane x modulo 8: the bits of its state, then those of its token.
//! After the last row all states are 0. A section without coefficients has no bits.

use brickfield_core::Level;
use brickfield_core::glam::UVec3;

use crate::bits::{BitReader, BitWriter, low_bits};
use crate::context::{N_CLASSES, N_CONTEXTS, Neighbours};
use crate::encode::LowBand;
use crate::extent::BandBox;
use crate::frequencies::{
    LOG_TOTAL, N_MAGNITUDE_TABLES, N_SYMBOLS, N_TABLES, TOTAL, best_flag_table, best_magnitude_table,
};
use crate::median::{differences, undo_differences};
use crate::sample::Coefficient;
use crate::tans::{DecodeTable, EncodeTable, Entry, decode_table, encode_table};
use crate::token::{ESCAPE, N_TOKENS, first_magnitude, n_bits, token_of};
use crate::transform::Bands;

/// Lanes of coefficients; one more is for flags.
const N_LANES: usize = 8;
const FLAG_LANE: u8 = N_LANES as u8;
/// The bits of a table's number.
const N_NUMBER_BITS: u32 = 10;
/// The bytes of a model.
pub(crate) const N_MODEL_BYTES: usize = (N_CONTEXTS * N_NUMBER_BITS as usize).div_ceil(8);

/// The number of a table for each context.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Model([u16; N_CONTEXTS]);

impl Model {
    /// The model of its bytes, or `None` if they name a table that no context of the kind has.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Option<Model> {
        let mut reader = BitReader::new(bytes);
        let numbers = std::array::from_fn(|_| reader.take(N_NUMBER_BITS) as u16);
        let is_right = |(context, &number): (usize, &u16)| match context < N_CLASSES {
            true => usize::from(number) < N_MAGNITUDE_TABLES,
            false => (N_MAGNITUDE_TABLES..N_TABLES).contains(&usize::from(number)),
        };
        (reader.is_at_end() && numbers.iter().enumerate().all(is_right)).then_some(Model(numbers))
    }

    pub(crate) fn to_bytes(self) -> Vec<u8> {
        let mut writer = BitWriter::default();
        self.0.iter().for_each(|&number| writer.push(u64::from(number), N_NUMBER_BITS));
        writer.into_bytes()
    }

    fn encode_tables(&self) -> [&'static EncodeTable; N_CONTEXTS] {
        self.0.map(|number| encode_table(usize::from(number)))
    }

    fn decode_tables(&self) -> [&'static DecodeTable; N_CONTEXTS] {
        self.0.map(|number| decode_table(usize::from(number)))
    }
}

/// A flag or a coefficient, as it will be coded.
#[derive(Clone, Copy, Debug)]
struct Symbol<C> {
    value: C,
    token: u8,
    context: u8,
    lane: u8,
}

/// The symbols of all sections of a brick, coarsest first, and the model that suits them.
#[derive(Debug)]
pub(crate) struct Symbols<C> {
    sections: Vec<Vec<Symbol<C>>>,
    model: Model,
    n_bits: f32,
}

impl<C: Coefficient> Symbols<C> {
    /// The low band as differences of the median kernel, then the details of each level.
    pub(crate) fn of(bands: &Bands<C>, low_band: LowBand) -> Symbols<C> {
        let mut counts = Counts { of_tokens: [[0; N_SYMBOLS]; N_CONTEXTS], n_bits: 0 };
        let n = bands.extent(Level(bands.n_levels()));
        let mut sections = vec![match low_band {
            LowBand::Stored => {
                let low = differences(n, bands.low());
                section(&low, n, std::iter::once(BandBox::whole(n)), &mut counts)
            }
            LowBand::Elsewhere => Vec::new(),
        }];
        for level in (0..bands.n_levels()).rev() {
            let n = bands.extent(Level(level));
            sections.push(section(bands.details(Level(level)), n, BandBox::details(n), &mut counts));
        }
        let (model, n_bits) = counts.best_model();
        Symbols { sections, model, n_bits }
    }

    /// About how many bytes [`Symbols::encode`] will make.
    pub(crate) fn estimated_bytes(&self) -> usize {
        let n_state_bits = self.sections.len() * (N_LANES + 1) * LOG_TOTAL as usize;
        N_MODEL_BYTES + (self.n_bits as usize + n_state_bits).div_ceil(8)
    }

    /// The model, and the bytes of each section.
    pub(crate) fn encode(&self) -> (Model, Vec<Vec<u8>>) {
        let tables = self.model.encode_tables();
        (self.model, self.sections.iter().map(|symbols| encode_section(symbols, &tables)).collect())
    }
}

/// How often each token comes in each context, and the bits that follow the tokens.
struct Counts {
    of_tokens: [[u32; N_SYMBOLS]; N_CONTEXTS],
    n_bits: usize,
}

impl Counts {
    fn best_model(&self) -> (Model, f32) {
        let mut n_bits = self.n_bits as f32;
        let numbers = std::array::from_fn(|context| {
            let counts = &self.of_tokens[context];
            let (number, n) = if context < N_CLASSES { best_magnitude_table(counts) } else { best_flag_table(counts) };
            n_bits += n;
            number as u16
        });
        (Model(numbers), n_bits)
    }
}

/// The symbols of some boxes of an array of extent `all`.
fn section<C: Coefficient>(
    array: &[C],
    all: UVec3,
    boxes: impl Iterator<Item = BandBox>,
    counts: &mut Counts,
) -> Vec<Symbol<C>> {
    let mut symbols = Vec::with_capacity(array.len());
    let mut classes = vec![0; all.x as usize];
    for band in boxes {
        let [nx, ny, nz] = band.n.to_array().map(|n| n as usize);
        let mut neighbours = Neighbours::new(nx, ny);
        for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
            let row = &array[band.row(all, y, z)..][..nx];
            let is_zero = row.iter().all(|&c| c == C::default());
            let flag_context = neighbours.flag_context();
            counts.of_tokens[flag_context][usize::from(is_zero)] += 1;
            let token = u8::from(is_zero);
            symbols.push(Symbol { value: C::default(), token, context: flag_context as u8, lane: FLAG_LANE });
            if is_zero {
                neighbours.pass_zero();
                continue;
            }
            neighbours.classes(&mut classes[..nx]);
            for (x, (&value, &context)) in row.iter().zip(&classes).enumerate() {
                let token = token_of(value.magnitude());
                counts.of_tokens[usize::from(context)][usize::from(token)] += 1;
                counts.n_bits += n_following_bits(token, value.magnitude());
                symbols.push(Symbol { value, token, context, lane: (x % N_LANES) as u8 });
            }
            neighbours.pass_row(row.iter().map(|c| c.short_magnitude()));
        }
    }
    symbols
}

#[inline(always)]
fn n_following_bits(token: u8, magnitude: u64) -> usize {
    match token {
        ESCAPE => 1 + magnitude.ilog2() as usize,
        _ => n_bits(token) as usize,
    }
}

/// The bits of a symbol, up to 28 of them, and whether an escaped coefficient follows.
#[derive(Clone, Copy, Debug)]
struct Step {
    bits: u32,
    n_bits: u8,
    is_escape: bool,
}

fn encode_section<C: Coefficient>(symbols: &[Symbol<C>], tables: &[&EncodeTable; N_CONTEXTS]) -> Vec<u8> {
    if symbols.is_empty() {
        return Vec::new();
    }
    let mut states = [0u16; N_LANES + 1];
    let mut steps = Vec::with_capacity(symbols.len());
    for symbol in symbols.iter().rev() {
        let state = &mut states[usize::from(symbol.lane)];
        let (before, step) = step_back(symbol, tables[usize::from(symbol.context)], *state);
        *state = before;
        steps.push(step);
    }
    let mut writer = BitWriter::default();
    states.iter().for_each(|&state| writer.push(u64::from(state), LOG_TOTAL));
    for (symbol, step) in symbols.iter().zip(steps.into_iter().rev()) {
        writer.push(u64::from(step.bits), u32::from(step.n_bits));
        if step.is_escape {
            write_escaped(&mut writer, symbol.value);
        }
    }
    writer.into_bytes()
}

#[inline(always)]
fn step_back<C: Coefficient>(symbol: &Symbol<C>, table: &EncodeTable, state: u16) -> (u16, Step) {
    let token = table.symbol(symbol.token);
    let (before, bits, n) = table.step_back(token, state);
    if token == ESCAPE {
        return (before, Step { bits, n_bits: n as u8, is_escape: true });
    }
    if symbol.lane == FLAG_LANE || token == 0 {
        return (before, Step { bits, n_bits: n as u8, is_escape: false });
    }
    let place = symbol.value.magnitude() as u32 - first_magnitude(token);
    let token_bits = place << 1 | u32::from(symbol.value < C::default());
    (before, Step { bits: bits | token_bits << n, n_bits: (n + n_bits(token)) as u8, is_escape: false })
}

/// The number of the magnitude's bits in 6 bits, the sign, and the bits below the highest one, in two parts. The magnitude is from 1 to
/// 2^63 - 1.
#[cold]
#[inline(never)]
fn write_escaped<C: Coefficient>(writer: &mut BitWriter, value: C) {
    let magnitude = value.magnitude();
    let n_below = magnitude.ilog2();
    let below = low_bits(magnitude, n_below);
    writer.push(u64::from(n_below + 1), 6);
    writer.push(u64::from(value < C::default()), 1);
    writer.push(low_bits(below, 32), n_below.min(32));
    writer.push(below >> 32, n_below.saturating_sub(32));
}

/// Undoes [`write_escaped`]; 0 bits make 0.
#[cold]
#[inline(never)]
fn read_escaped(reader: &mut BitReader<'_>) -> i64 {
    let n = reader.take(6) as u32;
    let is_negative = reader.take(1) == 1;
    let n_below = n.saturating_sub(1);
    let lower = reader.take(n_below.min(32));
    let upper = reader.take(n_below.saturating_sub(32));
    let highest = if n == 0 { 0 } else { 1 << n_below };
    let magnitude = highest | (upper << 32 | lower) as i64;
    if is_negative { -magnitude } else { magnitude }
}

/// A section of which no coefficients can be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BrokenSection;

/// Decodes the section with the low band.
pub(crate) fn decode_low<C: Coefficient>(
    bands: &mut Bands<C>,
    bytes: &[u8],
    model: &Model,
) -> Result<(), BrokenSection> {
    let n = bands.extent(Level(bands.n_levels()));
    decode_section(bands.low_mut(), n, std::iter::once(BandBox::whole(n)), bytes, model)?;
    undo_differences(n, bands.low_mut());
    Ok(())
}

/// Decodes the section with the details of a level.
pub(crate) fn decode_details<C: Coefficient>(
    bands: &mut Bands<C>,
    level: Level,
    bytes: &[u8],
    model: &Model,
) -> Result<(), BrokenSection> {
    let n = bands.extent(level);
    decode_section(bands.details_mut(level), n, BandBox::details(n), bytes, model)
}

fn decode_section<C: Coefficient>(
    array: &mut [C],
    all: UVec3,
    boxes: impl Iterator<Item = BandBox>,
    bytes: &[u8],
    model: &Model,
) -> Result<(), BrokenSection> {
    let mut boxes = boxes.peekable();
    if boxes.peek().is_none() {
        return if bytes.is_empty() { Ok(()) } else { Err(BrokenSection) };
    }
    let tables = model.decode_tables();
    let mut decoder = Decoder::new(bytes, &tables);
    let mut classes = vec![0; all.x as usize];
    for band in boxes {
        let [nx, ny, nz] = band.n.to_array().map(|n| n as usize);
        let mut neighbours = Neighbours::new(nx, ny);
        for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
            let row = &mut array[band.row(all, y, z)..][..nx];
            if decoder.flag(neighbours.flag_context()) {
                row.fill(C::default());
                neighbours.pass_zero();
                continue;
            }
            let classes = &mut classes[..nx];
            neighbours.classes(classes);
            decoder.row(classes, row)?;
            neighbours.pass_row(row.iter().map(|c| c.short_magnitude()));
        }
    }
    if decoder.is_finished() { Ok(()) } else { Err(BrokenSection) }
}

/// The states of all lanes, and the bits to come.
struct Decoder<'a> {
    reader: BitReader<'a>,
    tables: &'a [&'static DecodeTable; N_CONTEXTS],
    of_class: [&'static DecodeTable; N_CLASSES],
    states: [u16; N_LANES],
    flag_state: u16,
}

/// The first magnitude of each token, as far as a token can be stored.
static FIRST_MAGNITUDES: [i32; 64] = {
    let mut first = [0; 64];
    let mut token = 0;
    while token < N_TOKENS {
        first[token] = first_magnitude(token as u8) as i32;
        token += 1;
    }
    first
};

impl<'a> Decoder<'a> {
    fn new(bytes: &'a [u8], tables: &'a [&'static DecodeTable; N_CONTEXTS]) -> Decoder<'a> {
        let mut reader = BitReader::new(bytes);
        let states = std::array::from_fn(|_| reader.take(LOG_TOTAL) as u16);
        let flag_state = reader.take(LOG_TOTAL) as u16;
        let of_class = std::array::from_fn(|class| tables[class]);
        Decoder { reader, tables, of_class, states, flag_state }
    }

    #[inline(always)]
    fn flag(&mut self, context: usize) -> bool {
        let entry = self.tables[context][usize::from(self.flag_state)];
        self.flag_state = entry.next_state(self.reader.window());
        self.reader.skip(entry.n_state_bits());
        entry.token() == 1
    }

    /// Decodes a row, whose classes are below [`N_CLASSES`].
    #[inline(always)]
    fn row<C: Coefficient>(&mut self, classes: &[u8], row: &mut [C]) -> Result<(), BrokenSection> {
        let (mut reader, mut states) = (self.reader, self.states);
        let mut groups = row.chunks_exact_mut(N_LANES);
        let mut groups_of_classes = classes.chunks_exact(N_LANES);
        for (group, classes) in groups.by_ref().zip(groups_of_classes.by_ref()) {
            let group: &mut [C; N_LANES] = group.try_into().expect("a whole group");
            let entries: [Entry; N_LANES] = std::array::from_fn(|lane| self.entry(classes[lane], states[lane]));
            match entries.iter().any(|entry| entry.is_escape()) {
                true => each_escaped(group, &entries, &mut states, &mut reader),
                false => each(group, &entries, &mut states, &mut reader),
            }
            if reader.is_beyond_end() {
                return Err(BrokenSection);
            }
        }
        let rest = groups.into_remainder().iter_mut().zip(groups_of_classes.remainder());
        for ((value, &class), state) in rest.zip(&mut states) {
            *value = one(self.entry(class, *state), state, &mut reader);
        }
        (self.reader, self.states) = (reader, states);
        if reader.is_beyond_end() { Err(BrokenSection) } else { Ok(()) }
    }

    #[inline(always)]
    fn entry(&self, class: u8, state: u16) -> Entry {
        self.of_class[usize::from(class) % N_CLASSES][usize::from(state) % TOTAL as usize]
    }

    /// Whether nothing is left, and all states are those that encoding began with.
    fn is_finished(&self) -> bool {
        self.reader.is_at_end() && self.flag_state == 0 && self.states == [0; N_LANES]
    }
}

/// Decodes a group, none of which is an escape: two have at most 54 bits, which one window holds.
#[inline(always)]
fn each<C: Coefficient>(
    group: &mut [C; N_LANES],
    entries: &[Entry; N_LANES],
    states: &mut [u16; N_LANES],
    reader: &mut BitReader<'_>,
) {
    for pair in 0..N_LANES / 2 {
        let (a, b) = (2 * pair, 2 * pair + 1);
        let window = reader.window();
        states[a] = entries[a].next_state(window);
        group[a] = plain(entries[a], window);
        let window = window >> entries[a].n_all_bits();
        states[b] = entries[b].next_state(window);
        group[b] = plain(entries[b], window);
        reader.skip(entries[a].n_all_bits() + entries[b].n_all_bits());
    }
}

/// Decodes a group with an escape.
#[cold]
#[inline(never)]
fn each_escaped<C: Coefficient>(
    group: &mut [C; N_LANES],
    entries: &[Entry; N_LANES],
    states: &mut [u16; N_LANES],
    reader: &mut BitReader<'_>,
) {
    for ((value, &entry), state) in group.iter_mut().zip(entries).zip(states) {
        *value = one(entry, state, reader);
    }
}

/// Decodes one coefficient.
#[inline(always)]
fn one<C: Coefficient>(entry: Entry, state: &mut u16, reader: &mut BitReader<'_>) -> C {
    let window = reader.window();
    *state = entry.next_state(window);
    reader.skip(entry.n_all_bits());
    if entry.is_escape() { C::wrap_from(read_escaped(reader)) } else { plain(entry, window) }
}

/// The coefficient of an entry that is no escape.
#[inline(always)]
fn plain<C: Coefficient>(entry: Entry, window: u64) -> C {
    let bits = entry.token_bits(window);
    let magnitude = FIRST_MAGNITUDES[usize::from(entry.token())] + (bits >> 1) as i32;
    let negative = -((bits & 1) as i32);
    C::wrap_from(i64::from((magnitude ^ negative) - negative))
}
