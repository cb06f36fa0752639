//! Light in f32: the gradient of the field, by central differences or stored, and the shade of a node.

use brickfield_core::GRADIENT_ZERO;
use brickfield_core::glam::{DVec3, Mat3, UVec3, Vec3};
use brickfield_frame::{Field, Join, Lighting, Places, PlanRay};
use brickfield_interp::Neighbourhood;
use brickfield_optics::{LightTerms, LitSides};

use super::Renderer;
use super::classify::Optics32;

/// A plan's light, ready for f32.
pub(super) struct Lamp<'a> {
    lighting: &'a Lighting,
    /// From numbers of the value scale per voxel to the world's gradient in units of the light's `flat_below`.
    steepness: Mat3,
    /// Numbers of the value scale per voxel along each axis that the greatest stored gradient stands for.
    greatest_slope: Vec3,
}

/// Of a colour the factor, and the highlight that is added.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shade32 {
    pub(super) factor: f32,
    pub(super) highlight: f32,
}

/// Steeper gradients are as steep as this: squares stay finite.
const STEEPEST: f32 = 1e18;

impl<'a> Lamp<'a> {
    /// The light of a renderer's plan.
    pub(super) fn of(renderer: &'a impl Renderer) -> Option<Lamp<'a>> {
        let lighting = renderer.plan().lighting()?;
        let (plan, unit) = (renderer.plan(), renderer.plan().value_scale().unit());
        let per_number = unit / lighting.light.flat_below();
        Some(Lamp {
            lighting,
            steepness: (lighting.gradient_to_world() * per_number).as_mat3(),
            greatest_slope: (lighting.spacing() * (plan.greatest_gradient() / unit)).as_vec3(),
        })
    }

    /// The shade at position `p` of the block around an index cell, on a ray.
    pub(super) fn shade(&self, renderer: &impl Renderer, cell: UVec3, p: DVec3, ray: &PlanRay) -> Shade32 {
        let steepest = Vec3::splat(STEEPEST);
        let slope = match renderer.plan().gradients() {
            Some(_) => stored(renderer.codes(cell, p), self.greatest_slope),
            None => central(renderer, cell, p),
        };
        let gradient = (self.steepness * slope).clamp(-steepest, steepest);
        let square = gradient.length_squared();
        let normal = gradient * -square.max(1e-30).sqrt().recip();
        let to_eye = -(self.lighting.sample_to_world.matrix3 * ray.direction);
        let to_light = self.lighting.to_light(p, to_eye);
        let cosine = |direction: DVec3| self.facing(normal.dot(direction.as_vec3()));
        let halfway = cosine((to_light + to_eye).normalize_or_zero());
        let LightTerms { ambient, diffuse, specular, shininess } = self.lighting.light.terms();
        let strength = (square / (1.0 + square)).sqrt();
        let faced = ambient as f32 + diffuse as f32 * cosine(to_light);
        Shade32 {
            factor: (1.0 - strength) + strength * faced,
            highlight: strength * specular as f32 * halfway.powi(shininess as i32),
        }
    }

    /// The greatest channel that a colour has in this light.
    pub(super) fn brightest(&self) -> f32 {
        let most = self.lighting.light.brightest();
        (most.factor + most.highlight) as f32
    }

    /// How much of a cosine counts.
    fn facing(&self, cosine: f32) -> f32 {
        match self.lighting.light.sides() {
            LitSides::Lower => cosine.max(0.0),
            LitSides::Both => cosine.abs(),
        }
    }
}

impl Shade32 {
    /// The optics in this shade.
    pub(super) fn on(self, optics: Optics32) -> Optics32 {
        Optics32 { color: optics.color.map(|c| c * self.factor + self.highlight), ..optics }
    }

    /// Halfway between two shades.
    pub(super) fn mean(self, other: Shade32) -> Shade32 {
        Shade32 { factor: 0.5 * (self.factor + other.factor), highlight: 0.5 * (self.highlight + other.highlight) }
    }
}

/// Numbers of the value scale per voxel of a stored gradient (`brickfield_core::Companion::Gradient`).
fn stored([x, y, z, length]: [f32; 4], greatest_slope: Vec3) -> Vec3 {
    let zero = f32::from(GRADIENT_ZERO);
    let direction = (Vec3::new(x, y, z) * 255.0 - zero) / zero;
    direction * (length * length) * greatest_slope
}

/// Numbers of the value scale per voxel at position `p` of the block around an index cell, by central differences.
fn central(renderer: &impl Renderer, cell: UVec3, p: DVec3) -> Vec3 {
    let field = renderer.plan().field();
    let clamped = |q: DVec3| q.clamp(DVec3::ZERO, field.last_sample());
    let q = clamped(p);
    let h = spacing(field, cell, q);
    Vec3::from(DVec3::AXES.map(|axis| {
        let (before, low) = beside(renderer, cell, clamped(q - axis * h));
        let (behind, high) = beside(renderer, cell, clamped(q + axis * h));
        let distance = (behind - before).element_sum() as f32;
        if distance > 0.0 { (high - low) / distance } else { 0.0 }
    }))
}

/// The value at a clamped position: of the block that owns it, or of the own block as near as it is, if that one is empty.
fn beside(renderer: &impl Renderer, own: UVec3, q: DVec3) -> (DVec3, f32) {
    let field = renderer.plan().field();
    if let Some(value) = renderer.value_beside(field.cell_at(q), q) {
        return (q, value);
    }
    let b = field.block_box(own);
    let at = q.clamp(b.min, b.max);
    (at, renderer.value_in(own, at).unwrap_or_default())
}

/// How many samples of level 0 neighbouring samples are apart; between flat blocks, the mean by their weights.
fn spacing(field: &Field, cell: UVec3, q: DVec3) -> f64 {
    let (Join::Blend(scheme), Places::Blocks(places)) = (field.join(), field.slots().places()) else {
        return f64::from(field.level_at(cell).stride());
    };
    let around = Neighbourhood::around(places.layout(), q.to_array());
    let weights = around.weights(places.layout(), scheme, |block| places.row(block).level);
    let stride = |b| around.block(b).map_or(0.0, |block| f64::from(places.row(block).level.stride()));
    weights.into_iter().enumerate().map(|(b, weight)| weight * stride(b)).sum()
}
