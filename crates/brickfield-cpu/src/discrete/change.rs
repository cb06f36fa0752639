//! By how much a segment's light changes.

use brickfield_frame::FramePlan;
use brickfield_optics::{Segment, transmittance};

use super::field::Node;
use super::segment;
use super::walk::CutSegment;

/// What a node may be; first what it is in f64.
pub(super) type Candidates = Vec<Option<Node>>;

/// How far a segment's contribution may stray, and the least depth it may have.
pub(super) fn spread(plan: &FramePlan, nodes: &[Candidates], part: CutSegment) -> (f64, f64) {
    let second: &[Option<Node>] = nodes.get(1).map_or(&[None], |v| v);
    let own = segment(plan, [nodes[0][0], second[0]], part.length);
    let (mut change, mut least) = (0.0f64, own.depth);
    if nodes[0].len() * second.len() == 1 {
        return (change, least);
    }
    for a in &nodes[0] {
        for b in second {
            let other = segment(plan, [*a, *b], part.length);
            change = change.max(difference(&own, &other));
            least = least.min(other.depth);
        }
    }
    (change, least)
}

/// The most by which a channel changes that has one segment instead of another, with any light behind them.
pub(super) fn difference(a: &Segment, b: &Segment) -> f64 {
    let emission = a.emission.iter().zip(b.emission).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    emission + (transmittance(a.depth) - transmittance(b.depth)).abs()
}
