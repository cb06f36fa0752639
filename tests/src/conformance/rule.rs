//! The tolerance rules. They are rules, not magic: no case states a tolerance of its own.
//!
//! **Exact mode**, against the discrete f64 answer, all four channels: |difference| <= 1e-4 up to 2,048 samples a ray and
//! 2.5e-4 above, for no sum is longer than 8,192 segments and the sums of passes are few; 99.9 % of the pixels within 1e-5.
//! Both are wider by the reference's `ambiguity` of the pixel; the narrow one also by the effect of one rounding of each term of a
//! position may change (`position_rounding`), which is more than 1e-5 where the transfer function is steep and opaque.
//! With light both are wider by that: gradients amplify roundings, the more, the less a surface needs of one. Where colours in the light
//! are above 1, what is hidden or shown by rounding is brighter by as much.
//!
//! **Fast mode** adds, per pixel, the effect of hardware filtering (`filter_rounding`) and, where a ray may end early, the
//! transmittance floor: that is the most that any channel can lose behind the point where it ends.
//! **Polygons** are blended: of each segment that a ray sees, three roundings remain, of 1 - alpha, of its product with what lies
//! behind and of the sum, each of at most the target's unit roundoff: 2^-24, or 2^-11 for 16-bit floats, in which a device may blend.
//! What is blended is at most 1, and what comes before only dims it: so both bounds are wider by three of them a segment.
//!
//! **Meshes** and **cells**: the same bounds, wider by the ambiguity of the pixel: where corners and depths are rounded, another triangle
//! may be drawn; where a ray grazes a face or an edge, it may pass another cell.
//!
//! A tolerance so wide that the picture could be anything is no test: see [`Tolerance::is_empty_promise`].

use brickfield::cpu::{Discrete, filter_rounding, position_rounding};
use brickfield::frame::{Capabilities, Division, FramePlan, Mode, Target};
use brickfield_core::glam::UVec2;
use brickfield_core::{Image, TransferFunction};
use brickfield_optics::Shade;

use super::case::Mutant;
use crate::metrics::{Errors, MetricError, errors, quantile};

/// The share of pixels that must be within the narrow bound.
const BULK: f64 = 0.999;
/// The narrow bound of exact mode.
const BULK_BOUND: f64 = 1e-5;
/// The wide bound of meshes and cells.
const MESH_BOUND: f64 = 1e-4;
/// The widest bound that is a test: three quarters of a fast picture's pixels have a bound that is no wider.
const EMPTY_PROMISE: f64 = 0.2;
/// Longer rays have no rule: a plan has at most so many segments.
const MOST_SAMPLES: u64 = 2 * brickfield::MAX_SEGMENTS as u64;

/// The bound of each pixel's difference, in every channel; rows from the top.
#[derive(Clone, Debug)]
pub struct Tolerance {
    /// No pixel may differ by more.
    most: Vec<f64>,
    /// [`BULK`] of the pixels may not differ by more.
    bulk: Vec<f64>,
}

/// The rule for a plan, as far as it does not depend on a device.
#[derive(Clone, Debug)]
pub struct PlanTolerance {
    /// The wide bound of exact mode.
    wide: f64,
    /// In exact mode.
    tolerance: Tolerance,
}

/// How far a picture is from its reference, and the verdict of the rule.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The errors, where the picture could be compared at all.
    pub errors: Option<Errors>,
    /// The pixel that exceeds its bound by the greatest factor (or comes nearest to it), and its bound.
    pub closest: Option<(UVec2, f64)>,
    /// The greatest difference in units of its pixel's bound.
    pub used: f64,
    /// Why the picture fails.
    pub complaint: Option<Complaint>,
}

/// Why a picture fails.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum Complaint {
    #[error("pixel ({}, {}) differs by {difference:.3e}; the rule allows {bound:.3e}", pixel.x, pixel.y)]
    Worst { pixel: UVec2, difference: f64, bound: f64 },
    #[error("{n_beyond} of {n_pixels} pixels differ by more than the narrow bound; {n_allowed} may")]
    Bulk { n_beyond: usize, n_pixels: usize, n_allowed: usize },
    #[error("pixel ({}, {}): {what}", pixel.x, pixel.y)]
    Bounded { pixel: UVec2, what: &'static str },
    #[error(transparent)]
    NotComparable(#[from] MetricError),
    #[error("rays of {n_samples} samples: the rules end at {MOST_SAMPLES}")]
    NoRule { n_samples: u64 },
    #[error("a quarter of the pixels may differ by more than {bound:.2}: the tolerance promises nothing")]
    EmptyPromise { bound: f64 },
    #[error("{n_bare} of {n_pixels} pixels show no surface, though it fills the picture: it has cracks")]
    Cracks { n_bare: usize, n_pixels: usize },
    #[error("the picture shows {found}, but the case says {stated}")]
    Blank { found: &'static str, stated: &'static str },
    #[error("the reference differs from the volume's own sum by {difference:.3e} at pixel ({}, {}): the plan is wrong", pixel.x, pixel.y)]
    Oracle { pixel: UVec2, difference: f64 },
}

impl PlanTolerance {
    /// The rule for a plan, given its discrete answer.
    ///
    /// Cost: several times that of the discrete answer.
    ///
    /// # Errors
    /// Rays that are too long for any rule.
    pub fn of(plan: &FramePlan, reference: &Discrete) -> Result<PlanTolerance, Complaint> {
        let wide = most_difference(plan)?;
        let (blended, rounding) = (blending(plan, reference), position_rounding(plan));
        let of_pixel = |bound: f64| reference.ambiguity.iter().zip(&blended).map(move |(a, b)| bound + a + b);
        let bulk = of_pixel(BULK_BOUND).zip(&rounding).map(|(b, r)| b + r).collect();
        let amplified = |rounding: f64| if plan.lighting().is_some() { rounding } else { 0.0 };
        let most = of_pixel(wide).zip(&rounding).map(|(m, r)| m + amplified(*r)).collect();
        Ok(PlanTolerance { wide, tolerance: Tolerance { most, bulk } })
    }

    /// The rule on devices that filter with weights of so many bits; for the plan and the answer that it was made of.
    pub fn on(&self, plan: &FramePlan, reference: &Discrete, sub_texel_bits: u32) -> Tolerance {
        let Mode::Fast { transmittance_floor } = plan.sampling().mode() else { return self.tolerance.clone() };
        let filter = filter_rounding(plan, sub_texel_bits);
        let ends = |i: usize| {
            let transmittance = 1.0 - reference.image.pixels()[i][3];
            let lost = transmittance_floor * brightness(plan);
            if transmittance <= transmittance_floor + filter[i] + self.wide { lost } else { 0.0 }
        };
        let fast = |exact: &[f64]| exact.iter().enumerate().map(|(i, e)| e + filter[i] + ends(i)).collect();
        Tolerance { most: fast(&self.tolerance.most), bulk: fast(&self.tolerance.bulk) }
    }
}

impl Tolerance {
    /// The rule for a plan on a device, given the plan's discrete answer.
    ///
    /// # Errors
    /// As [`PlanTolerance::of`].
    pub fn of(plan: &FramePlan, reference: &Discrete, device: &Capabilities) -> Result<Tolerance, Complaint> {
        Ok(PlanTolerance::of(plan, reference)?.on(plan, reference, device.sub_texel_bits))
    }

    /// The rule for a mesh or cells, given how far each pixel may be off.
    pub(super) fn of_ambiguity(ambiguity: &[f64]) -> Tolerance {
        let of = |bound: f64| ambiguity.iter().map(move |a| bound + a).collect();
        Tolerance { most: of(MESH_BOUND), bulk: of(BULK_BOUND) }
    }

    /// The bound that a quarter of the pixels exceeds, if it is so wide that hardly anything could fail.
    pub fn is_empty_promise(&self) -> Option<f64> {
        let bound = quantile(self.most.clone(), 0.75);
        (bound > EMPTY_PROMISE).then_some(bound)
    }

    /// The complaint about such a bound; a mutant is not to be caught by it.
    pub(super) fn empty_promise(&self, mutant: Option<&Mutant>) -> Option<Complaint> {
        let bound = mutant.is_none().then(|| self.is_empty_promise())??;
        Some(Complaint::EmptyPromise { bound })
    }

    /// Holds a picture against its reference.
    pub fn judge(&self, image: &Image<f32>, reference: &Image<f64>) -> Verdict {
        let errors = match errors(image, reference) {
            Ok(errors) => errors,
            Err(e) => return Verdict { errors: None, closest: None, used: f64::INFINITY, complaint: Some(e.into()) },
        };
        let by_pixel = differences(image, reference);
        let share = |i: &usize| by_pixel[*i] / self.most[*i];
        let i = (0..by_pixel.len()).max_by(|a, b| share(a).total_cmp(&share(b))).unwrap_or(0);
        let closest = (pixel(image.size(), i), self.most[i]);
        let complaint = self.beyond(i, &by_pixel, closest.0).or_else(|| self.bulk_beyond(&by_pixel));
        Verdict { errors: Some(errors), closest: Some(closest), used: share(&i), complaint }
    }

    fn beyond(&self, i: usize, by_pixel: &[f64], pixel: UVec2) -> Option<Complaint> {
        let (difference, bound) = (by_pixel[i], self.most[i]);
        (difference > bound).then_some(Complaint::Worst { pixel, difference, bound })
    }

    fn bulk_beyond(&self, by_pixel: &[f64]) -> Option<Complaint> {
        let n_pixels = by_pixel.len();
        let n_beyond = by_pixel.iter().zip(&self.bulk).filter(|(d, b)| d > b).count();
        let n_allowed = (n_pixels as f64 * (1.0 - BULK) + 1e-9).floor() as usize;
        (n_beyond > n_allowed).then_some(Complaint::Bulk { n_beyond, n_pixels, n_allowed })
    }
}

/// The law of every picture, whatever its reference: 0 <= alpha <= 1, and colours within alpha times the transfer
/// function's greatest (in the brightest shade), to the rounding of f32 and of the format in which pixels are blended.
pub(crate) fn bounded(image: &Image<f32>, plan: &FramePlan, reference: &Discrete) -> Option<Complaint> {
    let rounding = match plan.proxy().map(|proxy| proxy.target()) {
        None | Some(Target::Float32) => 0.0,
        Some(Target::Float16) => blending(plan, reference).into_iter().fold(0.0, f64::max),
    };
    within_hull(image, plan.transfer(), brightest(plan), rounding)
}

fn within_hull(image: &Image<f32>, transfer: &TransferFunction, light: Shade, rounding: f64) -> Option<Complaint> {
    let greatest_of = |c: usize| transfer.knots().iter().map(|k| k.color[c]).fold(0.0, f64::max);
    let greatest = |c: usize| greatest_of(c) * light.factor + light.highlight;
    let hull = [greatest(0), greatest(1), greatest(2)];
    let wrong = |p: &[f32; 4]| {
        let [r, g, b, a] = p.map(f64::from);
        let within = |(c, h): (f64, f64)| (-1e-6..=a * h * (1.0 + 1e-5) + 1e-5 + rounding).contains(&c);
        match () {
            () if p.iter().any(|v| !v.is_finite()) => Some("a channel is not finite"),
            () if !(-1e-6..=1.0 + 1e-6 + rounding).contains(&a) => Some("alpha is not within 0 and 1"),
            () if ![r, g, b].into_iter().zip(hull).all(within) => Some("a colour is outside the transfer function's"),
            () => None,
        }
    };
    let (i, what) = image.pixels().iter().enumerate().find_map(|(i, p)| wrong(p).map(|w| (i, w)))?;
    Some(Complaint::Bounded { pixel: pixel(image.size(), i), what })
}

/// The greatest factor and highlight of colours.
fn brightest(plan: &FramePlan) -> Shade {
    plan.lighting().map_or(Shade::NONE, |lighting| lighting.light.brightest())
}

/// The greatest channel of a colour, at least 1.
fn brightness(plan: &FramePlan) -> f64 {
    let Shade { factor, highlight } = brightest(plan);
    factor + highlight
}

/// Greatest difference of any channel, pixel by pixel.
pub(crate) fn differences(image: &Image<f32>, reference: &Image<f64>) -> Vec<f64> {
    let greatest = |(a, b): (&[f32; 4], &[f64; 4])| (0..4).map(|c| (f64::from(a[c]) - b[c]).abs()).fold(0.0, f64::max);
    image.pixels().iter().zip(reference.pixels()).map(greatest).collect()
}

pub(crate) fn pixel(size: UVec2, i: usize) -> UVec2 {
    UVec2::new(i as u32 % size.x.max(1), i as u32 / size.x.max(1))
}

/// The widest difference of exact mode for a plan's longest rays.
fn most_difference(plan: &FramePlan) -> Result<f64, Complaint> {
    match longest_ray(plan) {
        0..=2048 => Ok(1e-4),
        2049..=MOST_SAMPLES => Ok(2.5e-4),
        n_samples => Err(Complaint::NoRule { n_samples }),
    }
}

/// How much the blending of polygons may change each pixel; 0 where rays are cast.
fn blending(plan: &FramePlan, reference: &Discrete) -> Vec<f64> {
    let rounding = match plan.proxy().map(|proxy| proxy.target()) {
        None => 0.0,
        Some(Target::Float32) => 3.0 * (-24f64).exp2(),
        Some(Target::Float16) => 3.0 * (-11f64).exp2(),
    };
    reference.visible_segments.iter().map(|n| rounding * brightness(plan) * f64::from(*n)).collect()
}

/// Most samples on any ray: the domain's diagonal in steps, along the direction that is slowest through it.
fn longest_ray(plan: &FramePlan) -> u64 {
    let size = plan.size();
    let ray = |i: u32| plan.rays().ray(i % size.x, i / size.x);
    let samples = |i: u32| {
        let ray = ray(i);
        let far = brickfield_core::Ray {
            origin: plan.rays().center + ray.anchor - ray.direction * (ray.t_anchor - ray.t_eye),
            direction: ray.direction,
        };
        let n_cuts = f64::from(plan.field().index().dims().element_sum());
        let more = if plan.sampling().division() == Division::Brick { n_cuts } else { 0.0 };
        far.clip(plan.domain()).map_or(0.0, |s| (s.end - s.start) / (plan.sampling().step_world() * ray.stretch) + more)
    };
    let most = (0..size.x * size.y).map(samples).fold(0.0, f64::max);
    most.ceil() as u64 * plan.sampling().rule().nodes().len() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: UVec2 = UVec2::new(50, 40);

    fn tolerance(ambiguous: Option<usize>) -> Tolerance {
        let of = |bound: f64| (0..2000).map(|i| bound + if Some(i) == ambiguous { 0.1 } else { 0.0 }).collect();
        Tolerance { most: of(1e-4), bulk: of(BULK_BOUND) }
    }

    fn image(by: f64, n_pixels: usize) -> (Image<f32>, Image<f64>) {
        let reference = Image::new(SIZE, vec![[0.1, 0.2, 0.3, 0.5]; 2000]).unwrap();
        let mut image = reference.map(|v| v as f32);
        image.pixels_mut()[..n_pixels].iter_mut().for_each(|p| p[3] += by as f32);
        (image, reference)
    }

    fn complaint(tolerance: &Tolerance, by: f64, n_pixels: usize) -> Option<Complaint> {
        let (image, reference) = image(by, n_pixels);
        tolerance.judge(&image, &reference).complaint
    }

    #[test]
    fn one_pixel_beyond_the_wide_bound_fails_and_two_in_2000_beyond_the_narrow_one_pass() {
        assert_eq!(complaint(&tolerance(None), 0.0, 0), None);
        assert!(matches!(complaint(&tolerance(None), 2e-4, 1), Some(Complaint::Worst { .. })));
        assert_eq!(complaint(&tolerance(None), 5e-5, 2), None);
        assert!(matches!(
            complaint(&tolerance(None), 5e-5, 3),
            Some(Complaint::Bulk { n_beyond: 3, n_allowed: 2, .. })
        ));
    }

    #[test]
    fn ambiguity_widens_its_own_pixel_only() {
        assert_eq!(complaint(&tolerance(Some(0)), 0.05, 1), None);
        assert!(complaint(&tolerance(Some(0)), 0.05, 2).is_some());
        assert!(complaint(&tolerance(Some(7)), 0.05, 1).is_some());
    }

    #[test]
    fn what_is_not_a_picture_fails() {
        assert!(matches!(complaint(&tolerance(None), f64::NAN, 1), Some(Complaint::NotComparable(_))));
        let transfer = TransferFunction::constant(1.0, [0.9, 0.3, 0.1]).unwrap();
        let pixel =
            |p: [f32; 4]| within_hull(&Image::new(UVec2::ONE, vec![p]).unwrap(), &transfer, Shade::NONE, 0.0).is_none();
        assert!(pixel([0.0; 4]) && pixel([0.45, 0.15, 0.05, 0.5]));
        assert!(!pixel([0.5, 0.0, 0.0, 0.5]) && !pixel([0.0, 0.0, 0.0, 1.1]) && !pixel([-0.1, 0.0, 0.0, 0.5]));
    }

    #[test]
    fn a_tolerance_that_allows_anything_promises_nothing() {
        let wide =
            |n: usize| Tolerance { most: (0..100).map(|i| if i < n { 0.5 } else { 1e-4 }).collect(), bulk: vec![] };
        assert!(wide(20).is_empty_promise().is_none());
        assert!(wide(30).is_empty_promise().is_some());
    }
}
