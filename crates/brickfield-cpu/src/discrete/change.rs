//! By how much a segment's light changes.

use brickfield_frame::FramePlan;
use brickfield_optics::{Segment, alpha, transmittance};

use super::light::{Node, brightness};
use super::segment;
use super::walk::CutSegment;

/// What a node may be; the first is the one that it is in f64.
pub(super) type Nodes = Vec<Option<Node>>;

/// How far a segment's contribution may stray, and the least depth it may have. Whatever the nodes are, their shades may be off by
/// `shade_error`, of the factor and the highlight together.
pub(super) fn spread(plan: &FramePlan, nodes: &[Nodes], part: CutSegment, shade_error: impl Fn() -> f64) -> (f64, f64) {
    let second: &[Option<Node>] = nodes.get(1).map_or(&[None], |v| v);
    let own = segment(plan, [nodes[0][0], second[0]], part.length);
    // Nothing is seen of a shade where there is no depth.
    let of_shade = |depth: f64| if depth > 0.0 { alpha(depth) * shade_error() } else { 0.0 };
    let (mut change, mut least, mut most) = (0.0f64, own.depth, own.depth);
    if nodes[0].len() * second.len() == 1 {
        return (of_shade(most), least);
    }
    for a in &nodes[0] {
        for b in second {
            let other = segment(plan, [*a, *b], part.length);
            change = change.max(difference(plan, &own, &other));
            (least, most) = (least.min(other.depth), most.max(other.depth));
        }
    }
    (change + of_shade(most), least)
}

/// The most by which a channel changes that has one segment instead of another, with any light behind them.
pub(super) fn difference(plan: &FramePlan, a: &Segment, b: &Segment) -> f64 {
    let emission = a.emission.iter().zip(b.emission).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    emission + brightness(plan) * (transmittance(a.depth) - transmittance(b.depth)).abs()
}
