//! The numbers of a mesh's picture as shaders read them.

use brickfield_core::glam::DVec3;
use brickfield_core::rounded_up;
use brickfield_optics::LightSource;
use bytemuck::{Pod, Zeroable};

use super::MeshPlan;

/// The uniform block of a mesh's picture. Positions are relative to the mesh's centre, and lengths in units of
/// [`Mesh::unit`](super::Mesh::unit); the layout is held against
/// naga's by a test of `brickfield-shaders`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct MeshUniforms {
    /// From a position to x in the clip space of WebGPU.
    pub clip_x: [f32; 4],
    /// To y.
    pub clip_y: [f32; 4],
    /// To z: 1 at the nearest, 0 at infinity or at the farthest.
    pub clip_z: [f32; 4],
    /// To w.
    pub clip_w: [f32; 4],
    /// Anchor of the picture's centre; and the depth of the anchors' plane.
    pub anchor: [f32; 4],
    /// Change of the anchor a pixel to the right; half the picture's width.
    pub anchor_right: [f32; 4],
    /// Change of the anchor a pixel down; half the picture's height.
    pub anchor_down: [f32; 4],
    /// Direction of the picture's centre; half the width of mesh lines, in pixels.
    pub direction: [f32; 4],
    /// Change of the direction a pixel to the right; the part of the colour that shows from everywhere.
    pub direction_right: [f32; 4],
    /// Change of the direction a pixel down; the part that shows where the mesh faces the light.
    pub direction_down: [f32; 4],
    /// The colour of mesh lines; the brightness of highlights.
    pub line: [f32; 4],
    /// Towards the light (w: 0), or its place (w: 1); a headlight has w = -1.
    pub source: [f32; 4],
    /// Knots of the colour map.
    pub n_knots: u32,
    /// The exponent of highlights.
    pub shininess: u32,
    /// The unit of lengths, in world units.
    pub unit: f32,
    /// Nothing.
    pub padding: u32,
}

fn row(v: DVec3, w: f64) -> [f32; 4] {
    [v.x as f32, v.y as f32, v.z as f32, w as f32]
}

impl MeshUniforms {
    /// The numbers of a plan.
    pub fn of(plan: &MeshPlan) -> MeshUniforms {
        let (rays, unit) = (&plan.rays, plan.mesh.unit());
        let half = 0.5 * rays.size.as_dvec2();
        let [clip_x, clip_y, clip_z, clip_w] = clip(plan);
        let anchor = rays.anchor.map(|a| a / unit);
        let (light, line) = (plan.light.as_ref(), plan.lines.as_ref());
        let terms = light.map(|light| light.terms()).unwrap_or_default();
        MeshUniforms {
            clip_x,
            clip_y,
            clip_z,
            clip_w,
            anchor: row(anchor[0], rays.anchor_depth / unit),
            anchor_right: row(anchor[1], half.x),
            anchor_down: row(anchor[2], half.y),
            direction: row(rays.direction[0], line.map_or(0.0, |line| 0.5 * line.width)),
            direction_right: row(rays.direction[1], terms.ambient),
            direction_down: row(rays.direction[2], terms.diffuse),
            line: row(line.map_or(DVec3::ZERO, |line| DVec3::from_array(line.color)), terms.specular),
            source: match light.map(|light| light.source()) {
                None | Some(LightSource::Head) => row(DVec3::ZERO, -1.0),
                Some(LightSource::Direction(direction)) => row(direction, 0.0),
                Some(LightSource::Place(place)) => {
                    row(((place - plan.mesh.center()) / unit).clamp_length_max(FAR_LIGHT), 1.0)
                }
            },
            n_knots: plan.colors.knots().len() as u32,
            shininess: terms.shininess,
            unit: unit as f32,
            padding: 0,
        }
    }
}

/// From positions to clip space. A perspective picture has its depth reversed, near / depth, so that f32 keeps its digits far away;
/// of parallel rays depth falls evenly from 1 to 0 through the part of the mesh that lies before the eye's plane.
fn clip(plan: &MeshPlan) -> [[f32; 4]; 4] {
    let rays = &plan.rays;
    let half = 0.5 * rays.size.as_dvec2();
    let eye = rays.eye();
    let unit = plan.mesh.unit();
    // Of parallel rays clip space is the picture itself; else all of it may be divided by the unit.
    let (position, constant) = if rays.are_parallel() { (unit, 1.0) } else { (1.0, 1.0 / unit) };
    let across = |axis: DVec3, scale: f64| {
        let axis = axis / axis.length_squared() * scale;
        row(axis * position, -axis.dot(eye) * constant)
    };
    let (x, y) = (across(rays.pixel[0], 1.0 / half.x), across(rays.pixel[1], -1.0 / half.y));
    let [forward, ..] = rays.direction;
    if !rays.are_parallel() {
        return [x, y, row(DVec3::ZERO, plan.near / unit), row(forward, -forward.dot(eye) / unit)];
    }
    let reach = plan.mesh.radius().max(f64::MIN_POSITIVE) * 1.01;
    let nearest = (-reach).max(plan.near - rays.anchor_depth);
    // A mesh behind the eye's plane is farther than the nearest, at a finite depth.
    let thickness = (reach - nearest).max(1e-3 * reach);
    let farthest = if reach > nearest { reach } else { nearest + thickness };
    [x, y, row(-forward * (unit / thickness), farthest / thickness), row(DVec3::ZERO, 1.0)]
}

/// A place of light farther away, in units of the mesh, is taken for one in the same direction: its square stays within f32.
const FAR_LIGHT: f64 = 1e12;

/// A knot of the colour map as shaders read it: red, green, blue, and its value. That is rounded up, so that the same values of f32 are
/// at or above it.
pub(crate) fn color_knots(plan: &MeshPlan) -> Vec<[f32; 4]> {
    let knot =
        |k: &brickfield_core::Knot| [k.color[0] as f32, k.color[1] as f32, k.color[2] as f32, rounded_up(k.value)];
    plan.colors.knots().iter().map(knot).collect()
}
