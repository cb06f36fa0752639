//! Values that wait until they are a batch.

use super::batch::Batch;
use super::brick::Stored;
use super::eight::{Eight, F32s, LANES};
use super::f32_plan::F32Plan;
use super::segment::{Ray32, Segment32};

/// Segments that are put behind a ray's sums together.
const BATCH: usize = 2 * LANES;

/// A ray, and behind it values at nodes of visible segments that wait until they are a batch: front to back, from brick to brick.
///
/// A ray has few segments in a brick: batches of its own would be half empty.
pub(super) struct Waiting<'a, V> {
    pub(super) eight: V,
    /// What has been seen before those that wait.
    pub(super) ray: &'a mut Ray32,
    near: [f32; BATCH + LANES],
    /// Of a rule with two nodes.
    far: [f32; BATCH + LANES],
    /// How many wait.
    n: usize,
    /// The length that a segment's light is computed for.
    length: f32,
}

impl<'a, V: Eight> Waiting<'a, V> {
    /// Nothing waits.
    #[inline(always)]
    pub(super) fn new(eight: V, ray: &'a mut Ray32, length: f32) -> Waiting<'a, V> {
        Waiting { eight, ray, near: [0.0; BATCH + LANES], far: [0.0; BATCH + LANES], n: 0, length }
    }

    /// The first `n` of eight segments wait behind the others, of which there is less than a batch; a batch is put behind what has been seen so far.
    #[inline(always)]
    pub(super) fn add<const N: usize, S: Stored>(
        &mut self,
        plan32: &F32Plan<N, S>,
        near: F32s<V>,
        far: Option<F32s<V>>,
        n: usize,
    ) {
        let to = self.n..self.n + LANES;
        if let Some(far) = far {
            self.far[to.clone()].copy_from_slice(&far.to_array());
        }
        self.near[to].copy_from_slice(&near.to_array());
        self.n += n;
        if self.n >= BATCH {
            self.push_first(plan32, BATCH);
            self.n -= BATCH;
            self.near.copy_within(BATCH.., 0);
            self.far.copy_within(BATCH.., 0);
        }
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
        self.push_first(plan32, n);
    }

    #[inline(always)]
    fn push_first<const N: usize, S: Stored>(&mut self, plan32: &F32Plan<N, S>, n: usize) {
        let rule = plan32.plan.sampling().rule();
        let eights = n.div_ceil(LANES);
        let (near, far) = (&self.near.as_chunks().0[..eights], &self.far.as_chunks().0[..eights]);
        let far = (rule.nodes().len() > 1).then_some(far);
        let batch = Batch { rule, transfer: &plan32.transfer, near, far, n, length: self.length };
        batch.push(self.eight, self.ray);
    }
}
