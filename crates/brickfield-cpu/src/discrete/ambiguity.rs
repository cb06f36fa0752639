//! By how much a pixel could change because f32 puts a node on the other side of a jump.
//!
//! **Distance.** How far a position is off along an axis says [`RayFrame::rounding`](brickfield_frame::RayFrame::rounding).
//!
//! Where segments end with their brick, a ray that runs along a face within that distance may be in either block (`straying`).
//!
//! **Value.** The interpolated value moves by at most that distance times the range of its cell, and by eight more
//! roundings of the numbers that decoding adds up.
//!
//! **Bound.** A segment that may have depth d' and emission e' instead of d and e changes a channel by at most
//! T (|e' - e| + |e^-d' - e^-d|), T being the transmittance before it: the light from behind has colours of at most 1 (in the light of a
//! lamp: of its `brightness`). Segments
//! change one after the other; T is taken with the least depths that the segments before may have. The sum is a bound.

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{Aabb, Level, Span};
use brickfield_frame::{Division, FramePlan, IndexEntry, Lengths, PlanRay};
use brickfield_optics::{Segment, ValueSpread, alpha, transmittance};

use super::change::{Nodes, difference, spread};
use super::field::{FieldReader, Patch, Values};
use super::light::{Node, brightness, shade_jump};
use super::straying::straying;
use super::walk::{CutSegment, clip, middle, parts, segments, whole};
use super::{part_nodes, relative, segment};
use crate::blocks::Blocks;

/// How far the cosines of a ray's angles to planes may be off: a few roundings of numbers below 1.
pub(super) const TIE: f64 = 1e-6;
/// Roundings of a number that decoding adds up, times the unit roundoff of f32.
const ROUNDING: f64 = 8.0 / (1u32 << 24) as f64;

/// The causes of ambiguity in a plan: kinds of blocks, jumps.
pub(super) struct Ambiguity {
    several_kinds: bool,
    /// The values at which the transfer function jumps, ascending.
    jumps: Vec<f64>,
    /// The greatest extinction of the transfer function.
    max_extinction: f64,
    /// The coarsest level of resident blocks.
    coarsest: Level,
    /// The greatest channel of a colour.
    brightness: f64,
    /// Gradients jump where the values do that they are made of.
    shades_stray: bool,
}

impl Ambiguity {
    pub(super) fn new(field: &impl FieldReader) -> Ambiguity {
        let knots = field.plan().transfer().knots();
        let optics = |i: usize| (knots[i].extinction, knots[i].color);
        let jump = |i: &usize| knots[*i].value == knots[i + 1].value && optics(*i) != optics(i + 1);
        Ambiguity {
            several_kinds: has_several_kinds(field),
            jumps: (0..knots.len() - 1).filter(jump).map(|i| knots[i].value).collect(),
            max_extinction: knots.iter().map(|k| k.extinction).fold(0.0, f64::max),
            coarsest: coarsest(field.plan()),
            brightness: brightness(field.plan()),
            shades_stray: field.plan().lighting().is_some() && field.jumps_between_levels(),
        }
    }

    /// The most by which a channel of the ray's pixel may change.
    pub(super) fn of_ray(&self, field: &impl FieldReader, at: UVec2, ray: &PlanRay) -> f64 {
        let plan = field.plan();
        let domain = relative(plan.domain(), plan.rays().center);
        let far = domain.extent().length() / ray.direction.length() + ray.t_anchor.abs();
        let delta = plan.rays().rounding(at.x, at.y, ray, far);
        match clip(ray, &domain, ray.t_eye) {
            Some(_) if clip(ray, &grown(&domain, -delta), ray.t_eye).is_none() => self.grazing(ray, &domain, delta),
            None => self.grazing(ray, &domain, delta),
            Some(span) => {
                let delta = plan.rays().rounding(at.x, at.y, ray, span.start.abs().max(span.end.abs()));
                self.inside(field, ray, span, delta)
            }
        }
    }

    /// The opacity that a ray near the domain's surface may have at most.
    fn grazing(&self, ray: &PlanRay, domain: &Aabb, delta: DVec3) -> f64 {
        let span = clip(ray, &grown(domain, delta), ray.t_eye);
        let most = |span: Span| self.brightness * alpha(self.max_extinction * (span.end - span.start));
        span.map_or(0.0, most)
    }

    fn inside(&self, field: &impl FieldReader, ray: &PlanRay, span: Span, delta: DVec3) -> f64 {
        let sampling = &field.plan().sampling();
        let appearing = match sampling.lengths() {
            Lengths::True => 0.0,
            Lengths::Nominal => self.appearing(field, ray, span, delta),
        };
        let nodes_stray = self.several_kinds && sampling.division() == Division::Ray;
        let changing = match nodes_stray || !self.jumps.is_empty() || self.shades_stray {
            true => self.changing(field, ray, span, delta),
            false => 0.0,
        };
        let straying = match sampling.division() {
            Division::Ray => 0.0,
            Division::Brick => straying(field, ray, span, delta, (self.max_extinction, self.coarsest)),
        };
        appearing + changing + straying
    }

    /// The change by nodes that fall on the other side of a jump.
    fn changing(&self, field: &impl FieldReader, ray: &PlanRay, span: Span, delta: DVec3) -> f64 {
        let plan = field.plan();
        let (mut bound, mut least_depth) = (0.0, 0.0);
        let rule = plan.sampling().rule();
        for part in parts(plan, ray, span) {
            let at = |x: f64| plan.rays().center + ray.at(part.at(x));
            let jumps = |x: &f64| self.shade_jump(field, ray, (part, at(*x)), delta);
            let shade_error = rule.nodes().iter().map(jumps).fold(0.0, f64::max);
            let nodes: Vec<Nodes> = match rule.nodes().iter().any(|x| self.may_be_close(field, part, at(*x), delta)) {
                true => rule.nodes().iter().map(|x| self.nodes(field, ray, (part, at(*x)), delta)).collect(),
                false if shade_error == 0.0 => {
                    least_depth += segment(plan, part_nodes(field, ray, part), part.length).depth;
                    continue;
                }
                false => part_nodes(field, ray, part).map(|node| vec![node]).to_vec(),
            };
            let (change, least) = spread(plan, &nodes, part, || shade_error);
            bound += transmittance(least_depth) * change;
            least_depth += least;
        }
        bound
    }

    /// The change by segments of nominal length whose middle is within rounding of an end of the divided span: they may count
    /// or not.
    fn appearing(&self, field: &impl FieldReader, ray: &PlanRay, span: Span, delta: DVec3) -> f64 {
        let plan = field.plan();
        let of = |span: Span, b: Aabb, level: Level, cell| {
            let nominal = plan.sampling().step_world() * f64::from(level.stride());
            let step = nominal * ray.stretch;
            let beside = Span { start: span.start - 0.5 * step, end: span.end + 0.5 * step };
            let doubtful = segments(beside, step).filter(|s| is_at_surface(ray.at(middle(s)), &b, delta));
            let segment = |s| {
                let part = whole(s, nominal, cell);
                let seen = segment(plan, part_nodes(field, ray, part), part.length);
                difference(plan, &seen, &Segment::default())
            };
            doubtful.map(segment).sum::<f64>()
        };
        match plan.sampling().division() {
            Division::Ray => of(span, relative(plan.domain(), plan.rays().center), Level(0), None),
            Division::Brick => Blocks::new(plan, ray, span)
                .map(|c| of(c.span, plan.block_box(c.cell), plan.field().level_at(c.cell), Some(c.cell)))
                .sum(),
        }
    }

    /// Whether a node at `q` could be close to a jump; quick, and never wrongly no.
    fn may_be_close(&self, field: &impl FieldReader, part: CutSegment, q: DVec3, delta: DVec3) -> bool {
        let q = field.clamped(q);
        let at_face = || part.cell.is_none() && field.cell_at(q - delta) != field.cell_at(q + delta);
        !self.jumps.is_empty() || at_face()
    }

    /// How much a node's shade may change where its gradient jumps.
    fn shade_jump(&self, field: &impl FieldReader, ray: &PlanRay, (part, p): (CutSegment, DVec3), delta: DVec3) -> f64 {
        if !self.shades_stray {
            return 0.0;
        }
        let patch = field.patch_of(part.cell.unwrap_or_else(|| field.cell_at(p)));
        if patch.is_empty() { 0.0 } else { shade_jump(field, &patch, p, ray, delta) }
    }

    /// What a node of `part` at `p` may be.
    fn nodes(&self, field: &impl FieldReader, ray: &PlanRay, (part, p): (CutSegment, DVec3), delta: DVec3) -> Nodes {
        let q = field.clamped(p);
        let own = part.cell.unwrap_or_else(|| field.cell_at(q));
        let mut nodes = Vec::new();
        let mut add = |cell| {
            let patch = field.patch_of(cell);
            let node = Node::at(field, &patch, p, ray);
            nodes.push(node);
            if let Some(node) = node {
                let beyond = self.beyond_jumps(field, &patch, q, (delta, node.values));
                nodes.extend(beyond.into_iter().map(|values| Some(Node { values, ..node })));
            }
        };
        add(own);
        if self.several_kinds && part.cell.is_none() {
            let kind = |c: UVec3| Kind::of(field, c);
            let (low, high) = (field.cell_at(q - delta), field.cell_at(q + delta));
            cells(low, high).filter(|c| kind(*c) != kind(own)).for_each(add);
        }
        nodes
    }

    /// Both sides of the jumps that a value at `q` is close to; of many values with a jump among them, what rounding makes of them.
    fn beyond_jumps(
        &self,
        field: &impl FieldReader,
        patch: &Patch,
        q: DVec3,
        (delta, values): (DVec3, Values),
    ) -> Vec<Values> {
        if self.jumps.is_empty() {
            return Vec::new();
        }
        let Some(around) = field.around(patch, q) else { return Vec::new() };
        let (gain, (min, max)) = (field.gain(), around.range);
        let offset = field.slots().decode().offset;
        let magnitude = gain * min.abs().max(max.abs()) + offset.abs() + self.jumps[0].abs();
        let of_spread = field.spreads().map_or(0.0, |spreads| spreads.gain() * spreads.moved(patch, q, delta));
        let reach = gain * field.moved(patch, q, delta) + of_spread + ROUNDING * magnitude;
        let beyond = |jump: &f64| match values {
            Values::One(value) if (value - jump).abs() <= reach => [jump.next_down(), *jump].map(Values::One).to_vec(),
            Values::One(_) => Vec::new(),
            Values::Many(values) => beyond_jump(*jump, &values, reach),
        };
        self.jumps.iter().flat_map(beyond).collect()
    }
}

/// What rounding by at most `reach` may make of values around a jump; nothing if it lies beyond them.
fn beyond_jump(jump: f64, values: &ValueSpread, reach: f64) -> Vec<Values> {
    let [below, above] = values.reach();
    let (mean, deviation) = (values.mean, values.deviation);
    if jump < mean - below - 2.0 * reach || jump > mean + above + 2.0 * reach {
        return Vec::new();
    }
    let of = |mean: f64, deviation: f64| Values::Many(ValueSpread { mean, deviation: deviation.max(0.0), ..*values });
    let moved = [mean - reach, mean + reach].into_iter();
    let mut candidates: Vec<Values> =
        moved.flat_map(|mean| [of(mean, deviation - reach), of(mean, deviation + reach)]).collect();
    // Most of them may be as near to the mean as the jump is.
    if (mean - jump).abs() <= reach && below.min(above) <= 2.0 * reach {
        candidates.extend([jump.next_down(), jump].map(Values::One));
    }
    candidates
}

/// Whether a point is within `delta` of a box's surface.
fn is_at_surface(p: DVec3, b: &Aabb, delta: DVec3) -> bool {
    let is_in = |b: &Aabb| p.cmpge(b.min).all() && p.cmple(b.max).all();
    is_in(&grown(b, delta)) && !is_in(&grown(b, -delta))
}

fn grown(b: &Aabb, delta: DVec3) -> Aabb {
    Aabb { min: b.min - delta, max: b.max + delta }
}

/// The kind of a block. Where it changes the field may jump: an empty block does not say of which level its samples were.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Resident(Level),
    /// Of a field that is continuous between levels.
    Blended,
    Empty,
}

impl Kind {
    fn of(field: &impl FieldReader, cell: UVec3) -> Kind {
        let plan = field.plan();
        match plan.field().index().at(cell) {
            IndexEntry::Resident { .. } if field.jumps_between_levels() => Kind::Resident(plan.field().level_at(cell)),
            IndexEntry::Resident { .. } => Kind::Blended,
            IndexEntry::Empty { .. } => Kind::Empty,
        }
    }
}

fn coarsest(plan: &FramePlan) -> Level {
    let all = cells(UVec3::ZERO, plan.field().index().dims() - 1);
    all.map(|cell| plan.field().level_at(cell)).max().unwrap_or(Level(0))
}

fn has_several_kinds(field: &impl FieldReader) -> bool {
    let mut kinds = cells(UVec3::ZERO, field.plan().field().index().dims() - 1).map(|cell| Kind::of(field, cell));
    let first = kinds.next();
    kinds.any(|k| Some(k) != first)
}

/// The index cells of a box, both corners included.
pub(super) fn cells(low: UVec3, high: UVec3) -> impl Iterator<Item = UVec3> {
    let rows = move |z| (low.y..=high.y).map(move |y| (y, z));
    (low.z..=high.z).flat_map(rows).flat_map(move |(y, z)| (low.x..=high.x).map(move |x| UVec3::new(x, y, z)))
}
