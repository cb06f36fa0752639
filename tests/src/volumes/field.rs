//! Analytic fields, with closed-form line integrals where there are any.

use std::f64::consts::PI;

use brickfield_core::Ray;
use brickfield_core::glam::DVec3;

/// A scalar field over the world. Lengths are in world units.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum FieldFormula {
    /// One value everywhere.
    Constant { value: f64 },
    /// `at_origin + gradient . p`: trilinear interpolation reproduces it.
    Ramp { at_origin: f64, gradient: DVec3 },
    /// `peak` at the centre, peak e^(-r^2 / 2 sigma^2) around it.
    GaussianBall { center: DVec3, sigma: f64, peak: f64 },
    /// 1 between two radii, 0 elsewhere, with linear edges of width `edge`.
    Shell { center: DVec3, inner: f64, outer: f64, edge: f64 },
    /// 1 where |normal . p - offset| <= thickness / 2, else 0 (`normal` a unit vector), with linear edges of width `edge`.
    Slab { normal: DVec3, offset: f64, thickness: f64, edge: f64 },
    /// Marschner and Lobb 1994, eq. 5-6, with their alpha = 1/4 and f_M = 6; the signal's cube [-1, 1]^3 is `half_side` to
    /// each side of `center`. Values in [0, 1].
    MarschnerLobb { center: DVec3, half_side: f64 },
}

impl FieldFormula {
    /// The value at a world position.
    pub fn at(&self, p: DVec3) -> f64 {
        match *self {
            FieldFormula::Constant { value } => value,
            FieldFormula::Ramp { at_origin, gradient } => at_origin + gradient.dot(p),
            FieldFormula::GaussianBall { center, sigma, peak } => {
                peak * (-(p - center).length_squared() / (2.0 * sigma * sigma)).exp()
            }
            FieldFormula::Shell { center, inner, outer, edge } => {
                let r = (p - center).length();
                coverage(r - outer, edge) * coverage(inner - r, edge)
            }
            FieldFormula::Slab { normal, offset, thickness, edge } => {
                coverage((normal.dot(p) - offset).abs() - 0.5 * thickness, edge)
            }
            FieldFormula::MarschnerLobb { center, half_side } => marschner_lobb((p - center) / half_side),
        }
    }

    /// The integral of the field along the whole line of a ray (direction of unit length), both ways.
    ///
    /// `None` where the integral is infinite or has no closed form here.
    pub fn line_integral(&self, ray: &Ray) -> Option<f64> {
        match *self {
            FieldFormula::GaussianBall { center, sigma, peak } => {
                let b2 = (center - ray.origin).reject_from_normalized(ray.direction).length_squared();
                Some(peak * sigma * (2.0 * PI).sqrt() * (-b2 / (2.0 * sigma * sigma)).exp())
            }
            FieldFormula::Shell { center, inner, outer, edge: 0.0 } => {
                let b = (center - ray.origin).reject_from_normalized(ray.direction).length();
                Some(chord(outer, b) - chord(inner, b))
            }
            FieldFormula::Slab { normal, thickness, .. } => {
                let slope = normal.dot(ray.direction).abs();
                (slope > 0.0).then(|| thickness / slope)
            }
            FieldFormula::Constant { .. }
            | FieldFormula::Ramp { .. }
            | FieldFormula::Shell { .. }
            | FieldFormula::MarschnerLobb { .. } => None,
        }
    }
}

/// 1 inside, 0 outside, linear over `edge` world units around distance 0; at edge 0 a step.
pub(super) fn coverage(distance: f64, edge: f64) -> f64 {
    if edge == 0.0 {
        return if distance <= 0.0 { 1.0 } else { 0.0 };
    }
    (0.5 - distance / edge).clamp(0.0, 1.0)
}

fn chord(radius: f64, impact: f64) -> f64 {
    2.0 * (radius * radius - impact * impact).max(0.0).sqrt()
}

fn marschner_lobb(p: DVec3) -> f64 {
    const ALPHA: f64 = 0.25;
    const F_M: f64 = 6.0;
    let rho = (2.0 * PI * F_M * (0.5 * PI * p.truncate().length()).cos()).cos();
    (1.0 - (0.5 * PI * p.z).sin() + ALPHA * (1.0 + rho)) / (2.0 * (1.0 + ALPHA))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The midpoint rule along a ray, t from -100 to 100.
    fn by_steps(field: &FieldFormula, ray: &Ray) -> f64 {
        let h = 1e-3;
        (0..200_000).map(|k| field.at(ray.at(-100.0 + (f64::from(k) + 0.5) * h)) * h).sum()
    }

    #[test]
    fn closed_forms_equal_sums() {
        let center = DVec3::new(1.0, 2.0, 3.0);
        let fields = [
            FieldFormula::GaussianBall { center, sigma: 4.0, peak: 0.7 },
            FieldFormula::Shell { center, inner: 5.0, outer: 9.0, edge: 0.0 },
            FieldFormula::Slab { normal: DVec3::X, offset: 2.0, thickness: 6.0, edge: 1.0 },
        ];
        for field in fields {
            for origin in [DVec3::ZERO, DVec3::new(3.0, -1.0, 2.5), DVec3::new(0.0, 6.0, 0.0)] {
                let ray = Ray { origin, direction: DVec3::new(2.0, 1.0, -0.5).normalize() };
                let (exact, sum) = (field.line_integral(&ray).unwrap(), by_steps(&field, &ray));
                assert!((exact - sum).abs() < 2e-3, "{field:?}: {exact} {sum}");
                assert!(exact > 0.1);
            }
        }
    }

    #[test]
    fn marschner_lobb_stays_in_its_range_and_oscillates_24_times() {
        let field = FieldFormula::MarschnerLobb { center: DVec3::ZERO, half_side: 1.0 };
        let row: Vec<f64> = (0..=4000).map(|i| field.at(DVec3::new(f64::from(i) / 2000.0 - 1.0, 0.0, 0.0))).collect();
        assert!(row.iter().all(|v| (0.0..=1.0).contains(v)));
        let peaks = row.windows(3).filter(|w| w[1] > w[0] && w[1] >= w[2]).count();
        // cos(pi r / 2) runs from 0 over 1 to 0: twelve periods of rho, with its peaks at whole values of 6 cos.
        assert_eq!(peaks, 11, "{peaks}");
    }

    #[test]
    fn edges_are_linear_and_centred() {
        let at = |d| coverage(d, 2.0);
        assert_eq!([at(-1.0), at(-0.5), at(0.0), at(0.5), at(1.0)], [1.0, 0.75, 0.5, 0.25, 0.0]);
        assert_eq!([coverage(0.0, 0.0), coverage(1e-9, 0.0)], [1.0, 0.0]);
    }
}
