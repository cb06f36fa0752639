//! Knots as files have them, and their meaning.

use brickfield_core::{Knot, LinearRgb, TransferError, TransferFunction};
use serde::Deserialize;

use super::error::{KnotProblem, ParseTransferError};
use crate::depth;
use crate::srgb::linear_of_text;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileKnot {
    value: f64,
    extinction: Option<f64>,
    opacity: Option<f64>,
    color: Option<LinearRgb>,
    srgb: Option<String>,
}

/// A knot and the line on which it begins.
pub(super) struct PlacedKnot {
    pub(super) line: usize,
    pub(super) knot: FileKnot,
}

/// The transfer function of a file's knots; the reference length comes with its line.
pub(super) fn transfer_of(
    reference_length: Option<(usize, f64)>,
    placed: Vec<PlacedKnot>,
) -> Result<TransferFunction, ParseTransferError> {
    if let Some((line, value)) = reference_length.filter(|(_, l)| !(l.is_finite() && *l > 0.0)) {
        return Err(ParseTransferError::ReferenceLength { line, value });
    }
    let length = reference_length.map(|(_, length)| length);
    let knots = placed.iter().enumerate().map(|(knot, p)| {
        meaning(&p.knot, length).map_err(|problem| ParseTransferError::Knot { line: p.line, knot, problem })
    });
    TransferFunction::new(knots.collect::<Result<_, _>>()?).map_err(|source| {
        let line = knot_of(&source).and_then(|knot| placed.get(knot)).map_or(1, |p| p.line);
        ParseTransferError::Transfer { line, source }
    })
}

fn meaning(knot: &FileKnot, reference_length: Option<f64>) -> Result<Knot, KnotProblem> {
    let extinction = match (knot.extinction, knot.opacity) {
        (Some(extinction), None) => extinction,
        (None, Some(opacity)) => of_opacity(opacity, reference_length)?,
        (None, None) => return Err(KnotProblem::NoStrength),
        (Some(_), Some(_)) => return Err(KnotProblem::TwoStrengths),
    };
    let color = match (knot.color, &knot.srgb) {
        (Some(color), None) => color,
        (None, Some(text)) => linear_of_text(text).ok_or_else(|| KnotProblem::Srgb { text: text.clone() })?,
        (None, None) => return Err(KnotProblem::NoColor),
        (Some(_), Some(_)) => return Err(KnotProblem::TwoColors),
    };
    Ok(Knot { value: knot.value, extinction, color })
}

fn of_opacity(opacity: f64, reference_length: Option<f64>) -> Result<f64, KnotProblem> {
    let length = reference_length.ok_or(KnotProblem::NoReferenceLength)?;
    if !(0.0..=1.0).contains(&opacity) {
        return Err(KnotProblem::Opacity { value: opacity });
    }
    Ok(depth(opacity) / length)
}

/// Which knot an error is about.
fn knot_of(error: &TransferError) -> Option<usize> {
    match error {
        TransferError::NotFinite { knot, .. }
        | TransferError::Extinction { knot, .. }
        | TransferError::Color { knot, .. }
        | TransferError::Order { knot, .. }
        | TransferError::ThirdKnot { knot, .. } => Some(*knot),
        _ => None,
    }
}
