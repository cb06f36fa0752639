//! The shade of a node (ARCHITECTURE.md, rule 9), and how far f32 may put it from where it is.
//!
//! **Gradient.** A difference of two values, each off by some e, over their distance d is off by 2 e / d at most. In units of
//! `flat_below`, a gradient w that is off by r has a soft normal w / sqrt(1 + w^2) that is off by r / sqrt(1 + (w - r)^2) at most.
//!
//! **Shade.** The factor is the soft normal's length and its product with the direction to the light: it changes by at most
//! |1 - ambient| + diffuse times as much. The highlight s (n . h)^m changes by at most sqrt(1 + m) times the normal's change:
//! along the normal by (n . h)^m, across it by m cos^(m-1) sin, which is at most sqrt(m). A rounding of the cosine counts m times.
//!
//! **Directions.** The direction to a near light is off by the position's error over the distance; the half vector by that over
//! |l + v|, which is small where the light is behind.

use brickfield_core::GRADIENT_ZERO;
use brickfield_core::glam::{DMat3, DVec3};
use brickfield_frame::{FramePlan, Lighting, PlanRay};
use brickfield_optics::{LightSource, Normals, SURFACE_STEEPNESS, Shade};

use super::ambiguity::cells;
use super::field::{Code, FieldReader, Patch, Values};

/// What a node is classified by, and the light there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Node {
    pub(super) values: Values,
    pub(super) shade: Shade,
}

impl Node {
    /// Without light.
    pub(super) fn unlit(values: Values) -> Node {
        Node { values, shade: Shade::NONE }
    }

    /// The value and the shade.
    pub(super) fn lit(self) -> (f64, Shade) {
        (self.values.value(), self.shade)
    }

    /// The node at position `p` of a patch; `None` if it is empty.
    pub(super) fn at(field: &impl FieldReader, patch: &Patch, p: DVec3, ray: &PlanRay) -> Option<Node> {
        let values = field.values(patch, field.clamped(p))?;
        let shade = field.plan().lighting().map(|lighting| shade(field, lighting, patch, p, ray));
        Some(Node { values, shade: shade.unwrap_or(Shade::NONE) })
    }
}

/// A value beside a node: where it is taken, and the patch that it is of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beside {
    pub(super) at: DVec3,
    pub(super) patch: Patch,
    pub(super) value: f64,
}

/// Roundings of a cosine of unit vectors in f32.
const COSINE: f64 = 8.0 / (1u32 << 24) as f64;

/// The greatest channel that a colour in the light has, at least 1.
pub(super) fn brightness(plan: &FramePlan) -> f64 {
    plan.lighting().map_or(1.0, |lighting| {
        let most = lighting.light.brightest();
        most.factor + most.highlight
    })
}

/// The shade at position `p` of a patch, which is not empty, on a ray.
pub(super) fn shade(field: &impl FieldReader, lighting: &Lighting, patch: &Patch, p: DVec3, ray: &PlanRay) -> Shade {
    let gradient = lighting.gradient_to_world() * slope(field, patch, p);
    let to_eye = to_eye(lighting, ray);
    lighting.light.shade(gradient, lighting.to_light(p, to_eye), to_eye)
}

/// How much the shade may change, of the factor and the highlight together, because f32 takes values beside a node at a position off by
/// `delta` from another patch, where the field jumps.
pub(super) fn shade_jump(field: &impl FieldReader, patch: &Patch, p: DVec3, ray: &PlanRay, delta: DVec3) -> f64 {
    // A stored gradient is of the node's own blocks.
    let Some(lighting) = field.plan().lighting().filter(|_| field.plan().gradients().is_none()) else { return 0.0 };
    let ends = |b: &Beside| (field.cell_at(b.at - delta), field.cell_at(b.at + delta));
    let is_near_face = |b: &Beside| {
        let (low, high) = ends(b);
        low != high
    };
    if !pairs(field, patch, p).iter().flatten().any(is_near_face) {
        return 0.0;
    }
    let jump = |b: &Beside| {
        let (low, high) = ends(b);
        let others = cells(low, high).filter_map(|cell| field.value(&field.lit_patch_of(cell), b.at));
        others.map(|other| (other - b.value).abs()).fold(0.0, f64::max)
    };
    let error =
        shade_error(field, lighting, (patch, p, ray), delta, ValueError { of_value: jump, of_code: |_: &Code| 0.0 });
    error.factor + error.highlight
}

/// How far the numbers of a gradient may be off: the values beside a node, in data values, or the numbers of a stored gradient.
pub(super) struct ValueError<V, C> {
    pub(super) of_value: V,
    pub(super) of_code: C,
}

/// How far the shade may be off if the numbers of the gradient are off by `error`, and positions by `delta`.
pub(super) fn shade_error(
    field: &impl FieldReader,
    lighting: &Lighting,
    (patch, p, ray): (&Patch, DVec3, &PlanRay),
    delta: DVec3,
    error: ValueError<impl Fn(&Beside) -> f64, impl Fn(&Code) -> f64>,
) -> Shade {
    let map = lighting.gradient_to_world() * lighting.light.flat_below().recip();
    let steepness = (map * slope(field, patch, p)).length();
    let error = match field.plan().gradients() {
        Some(_) => stored_error(field, patch, p, delta, error.of_code),
        None => {
            let of_pair = |pair: [Beside; 2]| over_distance(&pair, pair.iter().map(&error.of_value).sum());
            DVec3::from(pairs(field, patch, p).map(of_pair))
        }
    };
    let off = (magnitudes(map) * error).length() + COSINE * steepness;
    let strength = steepness / steepness.hypot(1.0);
    let normal = (off / (steepness - off).max(0.0).hypot(1.0)).min(2.0);
    let (to_light, halfway) = direction_errors(lighting, p, ray, delta);
    let terms = lighting.light.terms();
    let m = f64::from(terms.shininess);
    let highlight = (1.0 + m).sqrt() * normal + strength * (m.sqrt() * halfway + m * COSINE);
    Shade {
        factor: ((1.0 - terms.ambient).abs() + terms.diffuse) * normal + terms.diffuse * strength * to_light,
        highlight: terms.specular * highlight.min(1.0),
    }
}

/// The two values along each axis whose difference is the slope.
fn pairs(field: &impl FieldReader, patch: &Patch, p: DVec3) -> [[Beside; 2]; 3] {
    let q = field.clamped(p);
    let h = field.spacing(patch, q);
    DVec3::AXES.map(|axis| [-h, h].map(|way| beside(field, patch, field.clamped(q + axis * way))))
}

/// The value at a clamped position beside a patch: of the patch that owns the position, or of the own one as near as it is, if the other is empty.
fn beside(field: &impl FieldReader, own: &Patch, q: DVec3) -> Beside {
    let patch = field.lit_patch_of(field.cell_at(q));
    if let Some(value) = field.value(&patch, q) {
        return Beside { at: q, patch, value };
    }
    let b = field.plan().field().block_box(own.cell);
    let at = q.clamp(b.min, b.max);
    Beside { at, patch: *own, value: field.value(own, at).expect("a node of a patch that is not empty") }
}

/// Data values per voxel along the grid's axes at position `p` of a patch.
fn slope(field: &impl FieldReader, patch: &Patch, p: DVec3) -> DVec3 {
    match field.plan().gradients() {
        Some(_) => stored(field, field.codes(patch, field.clamped(p)).map(|code| code.value)),
        None => DVec3::from(pairs(field, patch, p).map(|pair| over_distance(&pair, pair[1].value - pair[0].value))),
    }
}

/// A stored gradient in data values per voxel (`brickfield_core::Companion::Gradient`), or that of a surface in the same form
/// (`Companion::SurfaceNormal`).
fn stored(field: &impl FieldReader, [x, y, z, length]: [f64; 4]) -> DVec3 {
    let plan = field.plan();
    let (Some(gradients), Some(lighting)) = (plan.gradients(), plan.lighting()) else { return DVec3::ZERO };
    let zero = f64::from(GRADIENT_ZERO);
    let direction = (DVec3::new(x, y, z) * 255.0 - zero) / zero;
    let greatest = match lighting.light.normals() {
        Normals::Surface => SURFACE_STEEPNESS * lighting.light.flat_below(),
        Normals::Central | Normals::Stored => gradients.decode().scale,
    };
    direction * length * length * greatest * lighting.spacing()
}

/// How far a stored gradient may be off, in data values per voxel: by looking beside the position, and by what each of its numbers may be
/// off.
fn stored_error(
    field: &impl FieldReader,
    patch: &Patch,
    p: DVec3,
    delta: DVec3,
    of_codes: impl Fn(&Code) -> f64,
) -> DVec3 {
    let codes = field.codes(patch, field.clamped(p));
    let here = stored(field, codes.map(|code| code.value));
    let off = |there: DVec3| (there - here).abs();
    let beside = |way: DVec3| off(stored(field, field.codes(patch, field.clamped(p + way)).map(|code| code.value)));
    let along = |axis: DVec3| beside(axis * delta).max(beside(-axis * delta));
    let moved: DVec3 = DVec3::AXES.into_iter().map(along).sum();
    let of_code = |i: usize| {
        let mut spoilt = codes.map(|code| code.value);
        spoilt[i] += of_codes(&codes[i]);
        off(stored(field, spoilt))
    };
    moved + (0..4).map(of_code).sum::<DVec3>()
}

/// A difference over the distance of its values; 0 where there is one sample.
fn over_distance(pair: &[Beside; 2], difference: f64) -> f64 {
    let distance = (pair[1].at - pair[0].at).element_sum();
    if distance > 0.0 { difference / distance } else { 0.0 }
}

fn to_eye(lighting: &Lighting, ray: &PlanRay) -> DVec3 {
    -(lighting.sample_to_world.matrix3 * ray.direction).normalize_or_zero()
}

/// How far the directions to the light and halfway to the eye may be off.
fn direction_errors(lighting: &Lighting, p: DVec3, ray: &PlanRay, delta: DVec3) -> (f64, f64) {
    let to_eye = to_eye(lighting, ray);
    let to_light = lighting.to_light(p, to_eye);
    let off = match lighting.light.source() {
        LightSource::Head => return (COSINE, COSINE),
        LightSource::Direction(_) => 0.0,
        LightSource::Place(place) => {
            let world = lighting.sample_to_world;
            let distance = (place - world.transform_point3(p)).length();
            (magnitudes(world.matrix3) * delta).length() / distance
        }
    };
    let to_light_error = (off + COSINE).min(2.0);
    (to_light_error, (2.0 * to_light_error / (to_light + to_eye).length()).min(2.0))
}

fn magnitudes(m: DMat3) -> DMat3 {
    DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}
