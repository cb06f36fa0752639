//! Numbers of nodes, held against the limits before anything is allocated for them.

use brickfield_core::glam::UVec3;

use crate::limits::check_bytes;
use crate::{Limits, ReadError};

/// # Errors
/// An axis outside of 1..=u32::MAX.
pub(crate) fn checked_nodes(n_nodes: [u64; 3]) -> Result<UVec3, ReadError> {
    let mut checked = [0; 3];
    for ((out, n), axis) in checked.iter_mut().zip(n_nodes).zip(['i', 'j', 'k']) {
        let in_range = u32::try_from(n).ok().filter(|n| *n >= 1);
        *out = in_range.ok_or_else(|| ReadError::field(format!("nodes along {axis}"), n, "1 to 4294967295"))?;
    }
    Ok(checked.into())
}

/// Holds grids of `node_bytes` a node, and what is unpacked beside them, against the limits.
///
/// # Errors
/// More bytes than the limit.
pub(crate) fn check_nodes(
    grids: &[UVec3],
    node_bytes: u128,
    more_bytes: u128,
    limits: &Limits,
) -> Result<(), ReadError> {
    let n_nodes = grids.iter().fold(0u128, |n, grid| n.saturating_add(n_nodes(*grid)));
    let what = || match grids {
        [n] => format!("a grid of {} x {} x {} nodes", n.x, n.y, n.z),
        _ => format!("{} grids of {n_nodes} nodes in all", grids.len()),
    };
    check_bytes(n_nodes.saturating_mul(node_bytes).saturating_add(more_bytes), limits, what)
}

pub(super) fn n_nodes(grid: UVec3) -> u128 {
    grid.to_array().into_iter().map(u128::from).product()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_greatest_grids_do_not_overflow() {
        let most = UVec3::splat(u32::MAX);
        let said = check_nodes(&[most; 8], 25, 0, &Limits::default()).unwrap_err().to_string();
        assert!(said.starts_with("8 grids of ") && said.ends_with("the limit is 17179869184 bytes"), "{said}");
        assert!(checked_nodes([1, 0, 1]).unwrap_err().to_string().contains("nodes along j is \"0\""));
    }
}
