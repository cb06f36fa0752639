//! Values that wait until they are a batch.

use super::batch::Batch;
use super::brick::{LANES, Stored};
use super::f32_plan::F32Plan;
use super::segment::{Ray32, Segment32};

/// A ray, and behind it values at nodes of visible segments that wait until they are a batch: front to back, from brick to brick.
///
/// A ray has few segments in a brick: batches of its own would be half empty.
pub(super) struct Waiting<'a> {
    /// What has been seen before those that wait.
    pub(super) ray: &'a mut Ray32,
    near: [f32; 2 * LANES],
    /// Of a rule with two nodes.
    far: [f32; 2 * LANES],
    /// How many wait.
    n: usize,
    /// The length that a segment's light is computed for.
    length: f32,
}

impl<'a> Waiting<'a> {
    /// Nothing waits.
    #[inline(always)]
    pub(super) fn new(ray: &'a mut Ray32, length: f32) -> Waiting<'a> {
        Waiting { ray, near: [0.0; 2 * LANES], far: [0.0; 2 * LANES], n: 0, length }
    }

    /// The first `n` of some segments wait behind the others, of which there is less than a batch.
    #[inline(always)]
    pub(super) fn add<const L: usize>(&mut self, near: &[f32; L], far: Option<&[f32; L]>, n: usize) {
        let to = self.n..self.n + L;
        if let Some(far) = far {
            self.far[to.clone()].copy_from_slice(far);
        }
        self.near[to].copy_from_slice(near);
        self.n += n;
    }

    /// Puts a batch behind what has been seen so far, if that many wait.
    #[inline(always)]
    pub(super) fn push_batch<const N: usize, S: Stored>(&mut self, plan32: &F32Plan<N, S>) {
        if self.n < LANES {
            return;
        }
        self.push_first::<N, S, LANES>(plan32, LANES);
        self.n -= LANES;
        self.near.copy_within(LANES.., 0);
        self.far.copy_within(LANES.., 0);
    }

    /// Puts a segment behind those that wait, and all of them behind what has been seen so far.
    #[inline(always)]
    pub(super) fn push<const N: usize, S: Stored>(&mut self, plan32: &F32Plan<N, S>, segment: Segment32) {
        self.push_all(plan32);
        self.ray.push(segment);
    }

    /// Puts all that wait, less than a batch, behind what has been seen so far.
    pub(super) fn push_all<const N: usize, S: Stored>(&mut self, plan32: &F32Plan<N, S>) {
        let n = std::mem::take(&mut self.n);
        if n == 0 {
            return;
        }
        for values in [&mut self.near, &mut self.far] {
            let last = values[n - 1];
            values[n..LANES].fill(last);
        }
        match n <= LANES / 2 {
            true => self.push_first::<N, S, { LANES / 2 }>(plan32, n),
            false => self.push_first::<N, S, LANES>(plan32, n),
        }
    }

    #[inline(always)]
    fn push_first<const N: usize, S: Stored, const L: usize>(&mut self, plan32: &F32Plan<N, S>, n: usize) {
        let (near, far): (&[f32; L], &[f32; L]) = (first_of(&self.near), first_of(&self.far));
        let rule = plan32.plan.sampling().rule();
        let far = (rule.nodes().len() > 1).then_some(far);
        let batch = Batch { rule, transfer: &plan32.transfer, near, far, n, length: self.length };
        batch.push(plan32.simd, self.ray);
    }
}

fn first_of<const L: usize>(values: &[f32]) -> &[f32; L] {
    values.first_chunk().expect("a batch is longer")
}
