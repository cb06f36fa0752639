//! The segments of a ray, and their light.

use brickfield_core::glam::UVec2;
use brickfield_frame::ViewRay;
use brickfield_optics::QuadratureRule;

use super::crossing::Crossings;
use super::entry::{Entry, TileFaces};
use super::lanes::Lanes;
use super::line::Line;
use super::map::Map;
use super::scene::Scene;
use super::walk::{Passage, Walk};
use crate::fast::segment::{Ray32, segment};

/// Marches rays, one after the other.
pub(super) struct March<'a, L> {
    lanes: L,
    scene: &'a Scene<'a>,
    crossings: Crossings,
    rule: QuadratureRule,
    step: f64,
    floor: f64,
    faces: TileFaces,
    entries: Vec<Entry>,
    passages: Vec<Passage>,
}

/// Cells after which a ray's segments are looked at: it may end there.
const BATCH: usize = 32;

/// A row of cells on its way to light. Distances are in the scene's unit, from the ray's anchor.
struct Run<'a> {
    line: &'a Line,
    /// Distance of the anchor from the eye.
    anchor: f64,
    /// The segment that begins next, and where.
    k: f64,
    from: f64,
    /// The first passage that a segment may still need.
    head: usize,
}

impl<'a, L: Lanes> March<'a, L> {
    pub(super) fn new(lanes: L, scene: &'a Scene<'a>) -> March<'a, L> {
        let sampling = scene.plan.sampling();
        March {
            lanes,
            scene,
            crossings: Crossings::new(),
            rule: sampling.rule(),
            step: sampling.step_world() / scene.unit,
            floor: sampling.transmittance_floor(),
            faces: TileFaces::default(),
            entries: Vec::new(),
            passages: Vec::with_capacity(2 * BATCH),
        }
    }

    /// The next pixels are those of a tile.
    pub(super) fn enter_tile(&mut self, corner: UVec2, side: u32) {
        self.faces.find(self.scene, corner, side);
    }

    #[inline(always)]
    pub(super) fn pixel(&mut self, at: UVec2) -> [f32; 4] {
        let plan = self.scene.plan;
        let (ray, end) = (plan.rays().ray(at.x, at.y), plan.end(at.x, at.y));
        let mut state = Ray32::default();
        if !self.faces.is_empty() {
            self.ray(at, &ray, end.map_or(f64::INFINITY, |(_, t)| f64::from(t)), &mut state);
        }
        super::over(&state, end.map(|(color, _)| color))
    }

    #[inline(always)]
    fn ray(&mut self, at: UVec2, ray: &ViewRay, t_end: f64, state: &mut Ray32) {
        let (scene, unit) = (self.scene, self.scene.unit);
        let (line, anchor) = (Line::of(ray, unit), ray.t_anchor / unit);
        let mut entered = std::mem::take(&mut self.entries);
        self.faces.entries(self.lanes, scene, &line, at, &mut entered);
        // Where the eye is, and then where the last cell was left.
        let mut from = -anchor;
        let end = t_end / unit - anchor;
        while let Some(entry) = entered.pop() {
            if from >= end || state.has_ended(self.floor) {
                break;
            }
            from = self.run(&line, anchor, &entry, [from, end], state);
        }
        self.entries = entered;
    }

    /// A row of cells, from an entry on; where it is left.
    #[inline(always)]
    fn run(&mut self, line: &Line, anchor: f64, entry: &Entry, [start, end]: [f64; 2], state: &mut Ray32) -> f64 {
        let from = start.max(f64::from(entry.crossing.w));
        let mut run = Run { line, anchor, k: ((from + anchor) / self.step).floor(), from, head: 0 };
        let mut walk = Walk::new(self.lanes, self.scene, self.crossings, line, entry);
        let mut reached = from as f32;
        self.passages.clear();
        while let Some(mut passage) = walk.step() {
            // In a cell that is folded the exit may come before the entry.
            passage.w[1] = passage.w[1].max(reached);
            let is_passed = passage.w[1] > reached;
            reached = passage.w[1];
            if !is_passed {
                continue;
            }
            self.passages.push(passage);
            if self.passages.len() >= BATCH + run.head {
                self.segments(&mut run, f64::from(reached).min(end), state);
                if f64::from(reached) >= end || state.has_ended(self.floor) {
                    break;
                }
            }
        }
        let to = f64::from(reached).min(end);
        if !self.passages.is_empty() && !state.has_ended(self.floor) {
            self.segments(&mut run, to, state);
            // The last one is cut.
            if run.from < to {
                self.segment(&mut run, to, state);
            }
        }
        f64::from(reached)
    }

    /// All segments that end before `to`.
    #[inline(always)]
    fn segments(&mut self, run: &mut Run, to: f64, state: &mut Ray32) {
        loop {
            let next = (run.k + 1.0) * self.step - run.anchor;
            if next > to || state.has_ended(self.floor) {
                break;
            }
            if next > run.from {
                self.segment(run, next, state);
            }
            run.k += 1.0;
        }
        if run.head > BATCH {
            self.passages.drain(..run.head);
            run.head = 0;
        }
    }

    /// The segment from where the last one ended to `to`.
    #[inline(always)]
    fn segment(&self, run: &mut Run, to: f64, state: &mut Ray32) {
        let length = to - run.from;
        let mut values = [None; 2];
        for (value, x) in values.iter_mut().zip(self.rule.nodes()) {
            *value = self.value(run, (run.from + x * length) as f32);
        }
        run.from = to;
        let length_world = (length * self.scene.unit) as f32;
        if values[0].is_some() || values[1].is_some() {
            state.push(segment(self.rule, &self.scene.transfer, values, length_world));
        }
    }

    /// The value at a distance; `None` where the transfer function is 0 over all values of the cell.
    #[inline(always)]
    fn value(&self, run: &mut Run, w: f32) -> Option<f32> {
        while run.head + 1 < self.passages.len() && self.passages[run.head].w[1] <= w {
            run.head += 1;
        }
        let passage = &self.passages[run.head];
        if self.rule != QuadratureRule::PreIntegrated && self.scene.is_dark(passage.cell) {
            return None;
        }
        let [w_in, w_out] = passage.w;
        let part = if w_out > w_in { ((w - w_in) / (w_out - w_in)).clamp(0.0, 1.0) } else { 0.5 };
        let [local_in, local_out] = passage.local;
        let guess = local_in + (local_out - local_in) * part;
        Some(Map::of(self.scene, passage.node).value(run.line.at(w), guess))
    }
}
