//! The discrete f64 answer: the very sum that a plan asks for, node by node.
//!
//! Written from the rules of ARCHITECTURE.md ("What a plan means"), not from a shader. It visits every segment of a ray's
//! span in the domain: nothing is jumped over and no ray ends early, so that renderers that do can be judged by it.

mod ambiguity;
mod change;
mod field;
mod light;
mod rounding;
mod straying;
mod walk;

use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Aabb, Image, Optics};
use brickfield_frame::{FramePlan, PlanRay};
use brickfield_optics::{QuadratureRule, RayState, Segment, expected_optics};
use rayon::prelude::*;

use ambiguity::Ambiguity;
use field::{FieldReader, Values, Work, with_field};
use light::Node;
pub use rounding::{filter_rounding, position_rounding};
use walk::{CutSegment, clip, parts};

/// The sum of a plan, and how far f32 may stray from it where the field jumps.
#[derive(Clone, Debug, PartialEq)]
pub struct Discrete {
    /// Linear, premultiplied RGBA.
    pub image: Image<f64>,
    /// For each pixel, rows from the top: the most by which any of its channels changes when nodes within f32 rounding of
    /// a face between blocks of different level, or of a jump of the transfer function, fall on the other side; when one of the values does
    /// that a node's gradient is made of; when a ray
    /// along a face of a block runs on its other side; when it takes the other of two stacks of planes, or one more or less middle of
    /// nominal length; 0 for pixels without any of these.
    ///
    /// A ray that runs within rounding of the domain's surface may also be missed or hit: then it is the opacity of the
    /// most that such a ray could gather.
    pub ambiguity: Vec<f64>,
    /// Nodes of all segments in the domain: the number of evaluations without skipping.
    pub n_samples: u64,
    /// The nodes whose extinction is above 0.
    pub n_visible_samples: u64,
    /// For each pixel, rows from the top: the segments whose depth is above 0.
    pub visible_segments: Vec<u32>,
}

/// The sum that `plan` asks for, in f64.
///
/// Same step, rule and cut as the plan's; its mode does not matter: no ray ends early, no block is jumped over. A node in an
/// empty block has extinction 0; with [`QuadratureRule::PreIntegrated`] a segment with such a node contributes
/// nothing (empty blocks have neighbours without extinction there).
///
/// Accuracy: that of f64, about 1e-15 times the number of segments of a ray. Cost: about 0.16 us a sample and core,
/// 0.4 us where several levels, jumps or bricks' own segments make pixels ambiguous.
pub fn discrete(plan: &FramePlan) -> Discrete {
    with_field(plan, Rendering)
}

struct Rendering;

impl Work for Rendering {
    type Output = Discrete;
    fn run(self, field: &impl FieldReader) -> Discrete {
        render(field)
    }
}

/// One pixel's answer.
#[derive(Default)]
struct Pixel {
    rgba: [f64; 4],
    ambiguity: f64,
    n_samples: u64,
    n_visible_samples: u64,
    n_visible_segments: u32,
}

fn render(field: &impl FieldReader) -> Discrete {
    let ambiguity = Ambiguity::new(field);
    let size = field.plan().size();
    let row = |y: u32| (0..size.x).map(|x| pixel(field, &ambiguity, UVec2::new(x, y))).collect::<Vec<_>>();
    let rows: Vec<Vec<Pixel>> = (0..size.y).into_par_iter().map(row).collect();
    let mut image = Image::transparent(size);
    for (to, from) in image.pixels_mut().iter_mut().zip(rows.iter().flatten()) {
        *to = from.rgba;
    }
    let pixels = || rows.iter().flatten();
    Discrete {
        image,
        ambiguity: pixels().map(|p| p.ambiguity).collect(),
        n_samples: pixels().map(|p| p.n_samples).sum(),
        n_visible_samples: pixels().map(|p| p.n_visible_samples).sum(),
        visible_segments: pixels().map(|p| p.n_visible_segments).collect(),
    }
}

fn pixel(field: &impl FieldReader, ambiguity: &Ambiguity, at: UVec2) -> Pixel {
    let ray = field.plan().rays().ray(at.x, at.y);
    let own = along(field, &ray);
    let across = field.plan().rays().ray_across_tie(at.x, at.y, ambiguity::TIE).map(|other| along(field, &other));
    let tie = across.map_or(0.0, |other| greatest_difference(&own.rgba, &other.rgba));
    Pixel { ambiguity: ambiguity.of_ray(field, at, &ray) + tie, ..own }
}

/// The sum along a ray.
fn along(field: &impl FieldReader, ray: &PlanRay) -> Pixel {
    let (plan, mut pixel) = (field.plan(), Pixel::default());
    let Some(span) = clip(ray, &relative(plan.domain(), plan.rays().center), ray.t_eye) else { return pixel };
    let mut state = RayState::default();
    for part in parts(plan, ray, span) {
        let nodes = part_nodes(field, ray, part);
        pixel.n_samples += plan.sampling().rule().nodes().len() as u64;
        let segment = segment(plan, nodes, part.length);
        if segment.depth > 0.0 {
            pixel.n_visible_samples += n_visible(field, &nodes);
            pixel.n_visible_segments += 1;
            state.push(segment);
        }
    }
    pixel.rgba = state.rgba();
    pixel
}

fn greatest_difference(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

/// The nodes of a segment, `None` in empty blocks (and for the second node of a rule that has one). A segment without depth is as
/// without light.
fn part_nodes(field: &impl FieldReader, ray: &PlanRay, part: CutSegment) -> [Option<Node>; 2] {
    let (plan, rule) = (field.plan(), field.plan().sampling().rule());
    let position = |x: f64| plan.rays().center + ray.at(part.at(x));
    let nodes = at_nodes(rule, |x| {
        let q = field.clamped(position(x));
        let cell = part.cell.unwrap_or_else(|| field.cell_at(q));
        field.values(&field.patch_of(cell), q).map(Node::unlit)
    });
    if plan.lighting().is_none() || segment(plan, nodes, part.length).depth == 0.0 {
        return nodes;
    }
    at_nodes(rule, |x| {
        let p = position(x);
        let patch = field.patch_of(part.cell.unwrap_or_else(|| field.cell_at(p)));
        Node::at(field, &patch, p, ray)
    })
}

fn at_nodes(rule: QuadratureRule, at: impl Fn(f64) -> Option<Node>) -> [Option<Node>; 2] {
    let nodes = rule.nodes();
    [at(nodes[0]), nodes.get(1).and_then(|x| at(*x))]
}

/// The optics of a node, in its light (ARCHITECTURE.md, rules 5 and 9).
fn optics(plan: &FramePlan, node: Node) -> Optics {
    node.shade.on(match node.values {
        Values::One(value) => plan.transfer().at(value),
        Values::Many(values) => expected_optics(plan.transfer(), &values),
    })
}

/// A segment of some nodes; `None`: extinction 0.
fn segment(plan: &FramePlan, nodes: [Option<Node>; 2], length_world: f64) -> Segment {
    let rule = plan.sampling().rule();
    let of = |rule: QuadratureRule, nodes: &[Optics], length: f64| rule.segment_of(nodes, length).unwrap_or_default();
    match (nodes, rule) {
        ([None, None], _) => Segment::default(),
        ([Some(a), Some(b)], QuadratureRule::PreIntegrated) => {
            rule.lit_segment(plan.transfer(), &[a.lit(), b.lit()], length_world)
        }
        (_, QuadratureRule::PreIntegrated) => Segment::default(),
        ([Some(a), Some(b)], _) => of(rule, &[optics(plan, a), optics(plan, b)], length_world),
        // The other node has extinction 0: half the depth, all of the node's colour.
        ([Some(node), None] | [None, Some(node)], QuadratureRule::Gauss2) => {
            of(QuadratureRule::MidpointExponential, &[optics(plan, node)], 0.5 * length_world)
        }
        ([Some(node), None] | [None, Some(node)], _) => of(rule, &[optics(plan, node)], length_world),
    }
}

/// How many nodes of a visible segment have an extinction above 0.
fn n_visible(field: &impl FieldReader, nodes: &[Option<Node>; 2]) -> u64 {
    if field.plan().sampling().rule().nodes().len() == 1 {
        return 1;
    }
    nodes.iter().flatten().filter(|node| optics(field.plan(), **node).extinction > 0.0).count() as u64
}

fn relative(b: &Aabb, center: DVec3) -> Aabb {
    Aabb { min: b.min - center, max: b.max - center }
}
