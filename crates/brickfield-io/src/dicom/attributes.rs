//! The values of a data set's elements, as text and as numbers.

use super::elements::{DataSet, Value};
use super::tags::Tag;
use crate::ReadError;

impl DataSet {
    fn value(&self, tag: Tag) -> Option<&Value> {
        self.elements.iter().find(|(found, _)| *found == tag).map(|(_, value)| value)
    }

    /// The items of a sequence; none if it is missing.
    pub(super) fn items(&self, tag: Tag) -> &[DataSet] {
        match self.value(tag) {
            Some(Value::Items(items)) => items,
            _ => &[],
        }
    }

    pub(super) fn has(&self, tag: Tag) -> bool {
        self.value(tag).is_some()
    }

    /// The bytes of a value, unless it is missing or empty.
    pub(super) fn bytes(&self, tag: Tag) -> Option<&[u8]> {
        match self.value(tag) {
            Some(Value::Plain { bytes, .. }) if !bytes.is_empty() => Some(bytes),
            _ => None,
        }
    }

    /// A text without its padding, unless it is missing or empty.
    pub(super) fn text(&self, tag: Tag) -> Option<String> {
        let text = String::from_utf8_lossy(self.bytes(tag)?);
        let text = text.trim_matches(['\0', ' ']);
        (!text.is_empty()).then(|| text.to_owned())
    }

    /// All numbers of an element; those that are written wrongly are NaN.
    pub(super) fn all_numbers(&self, tag: Tag) -> Vec<f64> {
        match self.value(tag) {
            Some(Value::Plain { vr, bytes }) if !bytes.is_empty() => numbers(*vr, bytes),
            _ => Vec::new(),
        }
    }

    /// The first number, if it is finite.
    pub(super) fn number(&self, tag: Tag) -> Option<f64> {
        self.all_numbers(tag).first().copied().filter(|n| n.is_finite())
    }

    /// So many finite numbers.
    pub(super) fn numbers<const N: usize>(&self, tag: Tag) -> Option<[f64; N]> {
        let numbers: [f64; N] = self.all_numbers(tag).try_into().ok()?;
        numbers.iter().all(|n| n.is_finite()).then_some(numbers)
    }

    /// A number from 1 to 65535.
    pub(super) fn required(&self, tag: Tag, field: &'static str) -> Result<f64, ReadError> {
        let number = self.number(tag).ok_or(ReadError::Missing { field })?;
        match (1.0..=65535.0).contains(&number) {
            true => Ok(number),
            false => Err(ReadError::field(field, number, "1 to 65535")),
        }
    }
}

fn numbers(vr: [u8; 2], bytes: &[u8]) -> Vec<f64> {
    macro_rules! words {
        ($t:ty) => {{
            let (words, _) = bytes.as_chunks::<{ size_of::<$t>() }>();
            words.iter().map(|b| <$t>::from_le_bytes(*b) as f64).collect()
        }};
    }
    match &vr {
        b"US" | b"OW" | b"AT" => words!(u16),
        b"SS" => words!(i16),
        b"UL" | b"OL" => words!(u32),
        b"SL" => words!(i32),
        b"FL" | b"OF" => words!(f32),
        b"FD" | b"OD" => words!(f64),
        b"UV" | b"OV" => words!(u64),
        b"SV" => words!(i64),
        _ => String::from_utf8_lossy(bytes).split('\\').map(number_of_text).collect(),
    }
}

fn number_of_text(text: &str) -> f64 {
    text.trim_matches(|c: char| c.is_whitespace() || c == '\0').parse().unwrap_or(f64::NAN)
}
