//! The ways in which values between blocks come about.

use brickfield::frame::Join;
use brickfield::{BlockStyle, TransparentBlocks};
use brickfield_core::Interblock;

/// The nearest block, then the paper's schemes.
pub(super) fn joins() -> impl Iterator<Item = Join> {
    [Join::Shared].into_iter().chain(Interblock::ALL.map(Join::Blend))
}

pub(super) const fn name(join: Join) -> &'static str {
    match join {
        Join::Blend(scheme) => scheme.name(),
        _ => "nearest",
    }
}

/// Transparent blocks are empty, as in the paper.
pub(super) fn style(join: Join) -> BlockStyle {
    BlockStyle { join, transparent: TransparentBlocks::Empty, ..BlockStyle::default() }
}
