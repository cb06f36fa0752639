//! What is visible inside bricks: each is cut into 4 x 4 x 4 parts, and the dark ones are passed over.
//!
//! A part is dark if the transfer function is 0 over the range of its samples, so that passing over it changes no sample.

use std::sync::Arc;

use brickfield_core::{TransferFunction, ValueRange};
use brickfield_frame::{BrickSet, FramePlan};
use rayon::prelude::*;

use super::brick::Nodes;

/// Parts along a brick's side.
const N_PARTS: usize = 4;

/// The visible parts of a brick, one bit each, x fastest.
pub(super) type Parts = u64;

/// The ranges of a brick set's parts, and what of them is visible; kept from frame to frame.
#[derive(Clone, Debug)]
pub(super) struct Detail {
    bricks: Arc<BrickSet>,
    ranges: Vec<[ValueRange; N_PARTS * N_PARTS * N_PARTS]>,
    transfer: TransferFunction,
    visible: Vec<Parts>,
}

impl Detail {
    /// The detail of a plan; what `last` knows already is not found anew.
    pub(super) fn of(plan: &FramePlan, last: Option<Detail>) -> Detail {
        match last {
            Some(last) if Arc::ptr_eq(&last.bricks, &plan.bricks) && last.transfer == plan.transfer => last,
            Some(last) if Arc::ptr_eq(&last.bricks, &plan.bricks) => Detail::classified(plan, last.ranges),
            _ => Detail::classified(plan, ranges(&plan.bricks)),
        }
    }

    fn classified(plan: &FramePlan, ranges: Vec<[ValueRange; 64]>) -> Detail {
        let parts = |ranges: &[ValueRange; 64]| {
            let bit = |(i, range): (usize, &ValueRange)| Parts::from(!plan.transfer.is_transparent(*range)) << i;
            ranges.iter().enumerate().map(bit).fold(0, |parts, bit| parts | bit)
        };
        let visible = ranges.par_iter().map(parts).collect();
        Detail { bricks: plan.bricks.clone(), ranges, transfer: plan.transfer.clone(), visible }
    }

    /// The visible parts of each brick.
    pub(super) fn visible(&self) -> &[Parts] {
        &self.visible
    }
}

/// The data values' ranges over all parts of all bricks.
fn ranges(bricks: &BrickSet) -> Vec<[ValueRange; 64]> {
    let of_brick = |slot: u32| std::array::from_fn(|part| range(bricks, slot, part));
    (0..bricks.n_bricks()).into_par_iter().map(of_brick).collect()
}

fn range(bricks: &BrickSet, slot: u32, part: usize) -> ValueRange {
    let n = bricks.side().n_samples() as usize;
    let side = n / N_PARTS;
    // A part's cells end at the next part's first sample.
    let samples = |i: usize| i % N_PARTS * side..=(i % N_PARTS * side + side).min(n - 1);
    let first = slot as usize * n.pow(3);
    let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
    for z in samples(part / (N_PARTS * N_PARTS)) {
        for y in samples(part / N_PARTS) {
            for x in samples(part) {
                let read = bricks.read(first + x + n * (y + n * z));
                (min, max) = (min.min(read), max.max(read));
            }
        }
    }
    // A decoding's scale may be negative.
    let (a, b) = (bricks.decode().value(min), bricks.decode().value(max));
    ValueRange { min: a.min(b), max: a.max(b) }
}

/// The runs of segments with something visible among segments `0..n`, near nodes at `nodes`, far ones `far` behind.
pub(super) struct Runs<'a> {
    nodes: &'a Nodes,
    far: f32,
    parts: Parts,
    /// Samples along a part's side.
    side: f32,
    /// Reciprocal of the change from node to node; 0 where there is none.
    inverse: [f32; 3],
    at: i64,
    n: i64,
}

impl<'a> Runs<'a> {
    #[inline(always)]
    pub(super) fn new<const N: usize>(nodes: &'a Nodes, far: f32, parts: Parts, n: i64) -> Runs<'a> {
        let inverse = nodes.change.map(|c| if c == 0.0 { 0.0 } else { 1.0 / c });
        Runs { nodes, far, parts, side: (N / N_PARTS) as f32, inverse, at: 0, n }
    }

    /// Whether segment `j` is dark, and the first segment behind it that may not be like it.
    #[inline(always)]
    fn stretch(&self, j: i64) -> (bool, i64) {
        let (mut part, mut exit) = (0, f32::INFINITY);
        for axis in (0..3).rev() {
            let s = (self.nodes.origin[axis] + self.nodes.change[axis] * j as f32).clamp(0.0, self.nodes.last[axis]);
            let along = ((s / self.side) as i32).min(N_PARTS as i32 - 1);
            part = part * N_PARTS + along as usize;
            let inverse = self.inverse[axis];
            let face = if inverse > 0.0 { along + 1 } else { along };
            if inverse != 0.0 && 0 < face && face < N_PARTS as i32 {
                exit = exit.min((face as f32 * self.side - self.nodes.origin[axis]) * inverse);
            }
        }
        let is_dark = self.parts >> part & 1 == 0;
        if !is_dark {
            return (false, ceil(exit).clamp(j + 1, self.n.max(j + 1)));
        }
        let next = ceil(exit - self.far).min(self.n);
        if next > j { (true, next) } else { (self.far == 0.0, j + 1) }
    }
}

#[inline(always)]
fn ceil(x: f32) -> i64 {
    let down = x as i64;
    down.saturating_add(i64::from(down as f32 != x && x > 0.0))
}

impl Iterator for Runs<'_> {
    type Item = (i64, i64);

    #[inline(always)]
    fn next(&mut self) -> Option<(i64, i64)> {
        let mut from = None;
        while self.at < self.n {
            let (is_dark, next) = self.stretch(self.at);
            match (is_dark, from) {
                (true, Some(from)) => return Some((from, self.at)),
                (false, None) => from = Some(self.at),
                _ => {}
            }
            self.at = next.min(self.n);
        }
        from.map(|from| (from, self.n))
    }
}
