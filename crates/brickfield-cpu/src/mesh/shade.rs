//! The colour of a mesh at a point.

use brickfield_core::glam::{DVec2, DVec3};
use brickfield_core::{LinearRgb, TransferFunction};
use brickfield_frame::{Coloring, MeshPlan};
use brickfield_optics::Light;

use super::answer::value_rounding;
use super::outline::{Corners, edge_lines};

/// Shades the points of a plan's mesh.
pub(super) struct Shader<'a> {
    plan: &'a MeshPlan,
}

/// A colour, and how much the rounding of the value in f32 may change it.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShadedColor {
    pub(super) color: LinearRgb,
    pub(super) rounding: f64,
}

impl<'a> Shader<'a> {
    pub(super) fn new(plan: &'a MeshPlan) -> Shader<'a> {
        Shader { plan }
    }

    /// The colour of the point with these weights of a triangle's corners, seen at a position of the picture.
    pub(super) fn shade(&self, corners: &Corners, position: DVec2, weights: [f64; 3]) -> ShadedColor {
        let values = corners.vertices.map(|v| f64::from(self.plan.mesh().vertices()[v as usize].value));
        let value = mixed(values, weights);
        let colors = self.plan.colors();
        let color = match self.plan.coloring() {
            Coloring::Values => colors.at(value).color,
            Coloring::Gouraud => {
                let of_corners = values.map(|v| colors.at(v).color);
                [0, 1, 2].map(|channel| mixed(of_corners.map(|c| c[channel]), weights))
            }
        };
        let lit = |light| self.lit(light, corners, position, weights, color);
        let (color, factor) = self.plan.light().map_or((color, 1.0), lit);
        let rounding = value_rounding(values);
        let rounding = match self.plan.coloring() {
            Coloring::Values => factor * change_around(colors, value, rounding),
            // Corners' values are known exactly, and a jump among them is not one of their values.
            Coloring::Gouraud => 0.0,
        };
        ShadedColor { color: self.with_lines(corners, position, color), rounding }
    }

    /// The colour in the light that falls on the side of the eye, and what it was multiplied by.
    fn lit(
        &self,
        light: &Light,
        corners: &Corners,
        position: DVec2,
        weights: [f64; 3],
        color: LinearRgb,
    ) -> (LinearRgb, f64) {
        let ray = self.plan.rays().at(position);
        let point = corners.point(weights);
        let normal = self.normal(corners, weights);
        let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
        let to_eye = -ray.direction;
        let to_light = self.plan.to_light(light, point, to_eye);
        // A gradient is far steeper than the least of a surface, and leads away from the eye.
        let shade = light.shade(normal * (-1e12 * light.flat_below()), to_light, to_eye);
        (color.map(|c| c * shade.factor + shade.highlight), shade.factor)
    }

    /// Of length 1, or 0.
    fn normal(&self, corners: &Corners, weights: [f64; 3]) -> DVec3 {
        if self.plan.shading().has_normals {
            let of = |v: u32| DVec3::from(self.plan.mesh().vertices()[v as usize].normal.map(f64::from));
            let sum: DVec3 = corners.vertices.iter().zip(weights).map(|(v, w)| of(*v) * w).sum();
            if sum != DVec3::ZERO {
                return sum.normalize_or_zero();
            }
        }
        let [a, b, c] = corners.positions;
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Mesh lines over a colour: half of it at half their width from an edge, whole half a pixel before, and nothing half a pixel further.
    fn with_lines(&self, corners: &Corners, position: DVec2, color: LinearRgb) -> LinearRgb {
        let Some(lines) = self.plan.lines() else { return color };
        let edges = self.plan.mesh().triangles()[corners.triangle as usize].edges;
        let camera = corners.positions.map(|p| self.plan.rays().camera(p));
        let opposite = edge_lines(self.plan, &camera);
        // Edge i leads from corner i to the next one, opposite to the corner before.
        let away = (0..3).filter(|i| edges >> i & 1 == 1).map(|i| opposite[(i + 2) % 3].pixels_from(position));
        let share = (0.5 * lines.width + 0.5 - away.fold(f64::INFINITY, f64::min)).clamp(0.0, 1.0);
        [0, 1, 2].map(|channel| color[channel] + (lines.color[channel] - color[channel]) * share)
    }
}

fn mixed(of_corners: [f64; 3], weights: [f64; 3]) -> f64 {
    of_corners.iter().zip(weights).map(|(v, w)| v * w).sum()
}

/// The greatest change of a colour channel while the value changes by so much, jumps included.
fn change_around(colors: &TransferFunction, value: f64, by: f64) -> f64 {
    let own = colors.at(value).color;
    let differs = |other: LinearRgb| (0..3).map(|c| (other[c] - own[c]).abs()).fold(0.0, f64::max);
    let ends = [colors.at(value - by).color, colors.at(value + by).color];
    let knots = colors.knots();
    let within = knots.partition_point(|k| k.value < value - by)..knots.partition_point(|k| k.value <= value + by);
    ends.into_iter().chain(knots[within].iter().map(|k| k.color)).map(differs).fold(0.0, f64::max)
}
