//! Figures 8 and 14 as pictures.

use super::{LamarArgs, LamarError};
use crate::compare::rivals::Rivals;

pub(super) fn run(_: &LamarArgs, _: &mut Rivals) -> Result<Vec<String>, LamarError> {
    Ok(Vec::new())
}
