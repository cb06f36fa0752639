//! Solid shapes by signed distance, in world units: negative inside.
//!
//! Only +, -, *, / and square roots: the same bits on every machine.

use brickfield_core::glam::{DVec2, DVec3};

/// A solid shape.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum Shape {
    /// An axis-aligned ellipsoid; its distance is exact on the surface and for spheres, elsewhere first order.
    Ellipsoid { center: DVec3, radii: DVec3 },
    /// A box with axes `x`, `y` and x cross y (unit vectors).
    Block { center: DVec3, half: DVec3, x: DVec3, y: DVec3 },
    /// A ring of `radius` around `axis` (a unit vector), `thickness` its tube's radius.
    Torus { center: DVec3, axis: DVec3, radius: f64, thickness: f64 },
    /// A cylinder with round ends.
    Capsule { from: DVec3, to: DVec3, radius: f64 },
}

impl Shape {
    /// Signed distance to the surface: negative inside.
    pub fn distance(&self, p: DVec3) -> f64 {
        match *self {
            Shape::Ellipsoid { center, radii } => {
                let q = p - center;
                let (k0, k1) = ((q / radii).length(), (q / (radii * radii)).length());
                if k1 == 0.0 { -radii.min_element() } else { k0 * (k0 - 1.0) / k1 }
            }
            Shape::Block { center, half, x, y } => {
                let q = p - center;
                let d = DVec3::new(q.dot(x), q.dot(y), q.dot(x.cross(y))).abs() - half;
                d.max(DVec3::ZERO).length() + d.max_element().min(0.0)
            }
            Shape::Torus { center, axis, radius, thickness } => {
                let q = p - center;
                let along = q.dot(axis);
                let across = (q - axis * along).length();
                DVec2::new(across - radius, along).length() - thickness
            }
            Shape::Capsule { from, to, radius } => {
                let (q, axis) = (p - from, to - from);
                let t = (q.dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
                (q - axis * t).length() - radius
            }
        }
    }

    /// A sphere.
    pub fn sphere(center: DVec3, radius: f64) -> Shape {
        Shape::Ellipsoid { center, radii: DVec3::splat(radius) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_negative_inside_zero_on_the_surface_and_right_outside() {
        let center = DVec3::new(1.0, 2.0, 3.0);
        let cases = [
            (Shape::sphere(center, 2.0), DVec3::X * 2.0),
            (Shape::Ellipsoid { center, radii: DVec3::new(1.0, 2.0, 3.0) }, DVec3::Y * 2.0),
            (Shape::Block { center, half: DVec3::new(1.0, 2.0, 3.0), x: DVec3::Y, y: DVec3::Z }, DVec3::Y),
            (Shape::Capsule { from: center, to: center + DVec3::X, radius: 0.5 }, DVec3::Z * 0.5),
        ];
        for (shape, surface) in cases {
            assert!(shape.distance(center) < 0.0, "{shape:?}");
            assert!(shape.distance(center + surface).abs() < 1e-12, "{shape:?}");
            let outside = center + surface.normalize() * (surface.length() + 0.1);
            assert!((shape.distance(outside) - 0.1).abs() < 0.01, "{shape:?}");
        }
        let ring = Shape::Torus { center, axis: DVec3::Z, radius: 5.0, thickness: 1.0 };
        assert_eq!(ring.distance(center + DVec3::X * 5.0), -1.0);
        assert_eq!(ring.distance(center), 4.0);
    }
}
