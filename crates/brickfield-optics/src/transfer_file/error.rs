//! The errors of a transfer-function file.

use std::io;
use std::path::PathBuf;

use brickfield_core::TransferError;

/// Why a transfer function could not be read from a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum ReadTransferError {
    #[error("cannot read the transfer function {}: {source}", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("the transfer function {} has more than {limit} bytes", path.display())]
    TooLarge { path: PathBuf, limit: u64 },
    #[error("{}: {source}", path.display())]
    Parse { path: PathBuf, source: ParseTransferError },
}

/// Why a text is no transfer function. Lines and columns count from 1, knots from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum ParseTransferError {
    #[error("line {line}, column {column}: {message}")]
    Syntax { line: usize, column: usize, message: String },
    #[error("line {line}: knot {knot} {problem}")]
    Knot { line: usize, knot: usize, problem: KnotProblem },
    #[error("line {line}: reference_length is {value}; it must be finite and above 0 (world units)")]
    ReferenceLength { line: usize, value: f64 },
    #[error("line {line}: {source}")]
    Transfer { line: usize, source: TransferError },
}

/// The error of one knot of a file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum KnotProblem {
    #[error("has neither `extinction` nor `opacity`")]
    NoStrength,
    #[error("has both `extinction` and `opacity`; only one can hold")]
    TwoStrengths,
    #[error("has an `opacity`, but the file states no `reference_length` that it is the opacity of")]
    NoReferenceLength,
    #[error("has opacity {value}; it must be 0 to 1")]
    Opacity { value: f64 },
    #[error("has neither `color` (linear RGB) nor `srgb` (\"#rrggbb\")")]
    NoColor,
    #[error("has both `color` and `srgb`; only one can hold")]
    TwoColors,
    #[error("has srgb {text:?}; it must be like \"#d8a070\"")]
    Srgb { text: String },
}

/// Line and column, from 1, of a byte offset.
pub(super) fn place(text: &str, offset: usize) -> (usize, usize) {
    let before = &text.as_bytes()[..offset.min(text.len())];
    let line_start = before.iter().rposition(|b| *b == b'\n').map_or(0, |i| i + 1);
    let line = 1 + before.iter().filter(|b| **b == b'\n').count();
    (line, 1 + String::from_utf8_lossy(&before[line_start..]).chars().count())
}
