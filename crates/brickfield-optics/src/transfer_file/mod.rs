//! Transfer functions in JSON and TOML files.
//!
//! A file is a list of knots. A knot has a `value`; its strength is an `extinction` per world unit, or, where the file
//! states a `reference_length` in world units, the `opacity` (0 to 1) of that length; its colour is `color`, straight
//! linear RGB, or `srgb`, a text like `"#d8a070"`. Nothing else may be in the file.

mod error;
mod knot;
mod write;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use brickfield_core::TransferFunction;
use serde::Deserialize;
use serde_json::value::RawValue;
use toml::Spanned;

pub use error::{KnotProblem, ParseTransferError, ReadTransferError};
pub use write::{WriteTransferError, write_transfer};

use error::place;
use knot::{FileKnot, PlacedKnot, transfer_of};

/// Most bytes of a file: a thousand for each of the most knots.
const MAX_FILE_BYTES: u64 = 1 << 26;

/// The formats of transfer-function files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum TransferFormat {
    Json,
    Toml,
}

impl TransferFormat {
    /// The format that a file's extension names: `.json` or `.toml` in any case.
    pub fn of_path(path: &Path) -> Option<TransferFormat> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "json" => Some(TransferFormat::Json),
            "toml" => Some(TransferFormat::Toml),
            _ => None,
        }
    }

    /// The format that a text looks like: JSON if its first character is a brace.
    pub fn of_text(text: &str) -> TransferFormat {
        if text.trim_start_matches('\u{feff}').trim_start().starts_with('{') {
            TransferFormat::Json
        } else {
            TransferFormat::Toml
        }
    }
}

/// Reads a transfer function from a file: by its extension, or by its content where that says nothing.
///
/// # Errors
/// The file cannot be read or has more than 64 MiB, or as [`parse_transfer`].
pub fn read_transfer(path: &Path) -> Result<TransferFunction, ReadTransferError> {
    let text = read_text(path)?;
    let format = TransferFormat::of_path(path).unwrap_or_else(|| TransferFormat::of_text(&text));
    parse_transfer(&text, format).map_err(|source| ReadTransferError::Parse { path: path.to_path_buf(), source })
}

fn read_text(path: &Path) -> Result<String, ReadTransferError> {
    let read = |source| ReadTransferError::Read { path: path.to_path_buf(), source };
    let mut text = String::new();
    let n_bytes = File::open(path).and_then(|f| f.take(MAX_FILE_BYTES + 1).read_to_string(&mut text)).map_err(read)?;
    if n_bytes as u64 > MAX_FILE_BYTES {
        return Err(ReadTransferError::TooLarge { path: path.to_path_buf(), limit: MAX_FILE_BYTES });
    }
    Ok(text)
}

/// A transfer function from text.
///
/// # Errors
/// Bad syntax, a knot with too few or too many numbers or a number out of range, knots out of order; each with its line.
pub fn parse_transfer(text: &str, format: TransferFormat) -> Result<TransferFunction, ParseTransferError> {
    let text = text.trim_start_matches('\u{feff}');
    match format {
        TransferFormat::Json => parse_json(text),
        TransferFormat::Toml => parse_toml(text),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TomlFile {
    reference_length: Option<Spanned<f64>>,
    #[serde(default)]
    knots: Vec<Spanned<FileKnot>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonFile<'a> {
    #[serde(borrow)]
    reference_length: Option<&'a RawValue>,
    #[serde(borrow)]
    knots: Vec<&'a RawValue>,
}

fn parse_toml(text: &str) -> Result<TransferFunction, ParseTransferError> {
    let file: TomlFile = toml::from_str(text).map_err(|e| {
        let (line, column) = place(text, e.span().map_or(0, |s| s.start));
        ParseTransferError::Syntax { line, column, message: e.message().to_owned() }
    })?;
    let line = |offset: usize| place(text, offset).0;
    let length = file.reference_length.map(|l| (line(l.span().start), l.into_inner()));
    let knots =
        file.knots.into_iter().map(|k| PlacedKnot { line: line(k.span().start), knot: k.into_inner() }).collect();
    transfer_of(length, knots)
}

fn parse_json(text: &str) -> Result<TransferFunction, ParseTransferError> {
    let file: JsonFile<'_> = json_at(text, text)?;
    let line = |part: &str| place(text, offset(text, part)).0;
    let length = match file.reference_length {
        Some(raw) => Some((line(raw.get()), json_at(text, raw.get())?)),
        None => None,
    };
    let placed = |raw: &&RawValue| Ok(PlacedKnot { line: line(raw.get()), knot: json_at(text, raw.get())? });
    transfer_of(length, file.knots.iter().map(placed).collect::<Result<_, ParseTransferError>>()?)
}

/// Parses a part of a JSON text; errors have their place in the whole.
fn json_at<'a, T: Deserialize<'a>>(text: &str, part: &'a str) -> Result<T, ParseTransferError> {
    serde_json::from_str(part).map_err(|e| {
        let (start_line, start_column) = place(text, offset(text, part));
        let column = if e.line() == 1 { start_column + e.column().max(1) - 1 } else { e.column() };
        let message = e.to_string();
        let what = message.split(" at line ").next().unwrap_or(&message).to_owned();
        ParseTransferError::Syntax { line: start_line + e.line().max(1) - 1, column, message: what }
    })
}

/// Where `part` begins in `text`, of which it is a slice.
fn offset(text: &str, part: &str) -> usize {
    part.as_ptr().addr().saturating_sub(text.as_ptr().addr())
}

#[cfg(test)]
mod tests;
