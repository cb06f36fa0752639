//! The continuous f64 answer: the emission-absorption integral itself.
//!
//! I = integral of tau(t) c(t) e^(-D(t)) dt, D(t) = integral of tau from the eye to t (Max 1995, absorption plus emission), tau the transfer
//! function's extinction of the trilinear field. A ray is cut where the integrand is not smooth: at the faces of the
//! interpolation cells (integer planes of sample space, the first and last of which begin the clamped half voxels), and
//! where the value crosses a knot of the transfer function. Between cuts the value is a cubic of t, so tau and c are too:
//! the depth is integrated exactly, the emission by Gauss-Kronrod quadrature with error control. It knows nothing of
//! bricks, steps or rules.

mod cells;
mod cubic;
mod piece;

use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Aabb, Camera, Image, Ray, TransferFunction, Volume};
use brickfield_frame::{RayFrame, Steps};
use brickfield_optics::{alpha, transmittance};
use rayon::prelude::*;

use cells::{Cells, Line};
use piece::Pieces;

/// How far the continuous answer is driven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContinuousOptions {
    /// Quadrature error that a ray may have, absolute in each channel.
    pub tolerance: f64,
    /// A ray ends when its transmittance falls below this; the light that it loses is part of its error.
    pub transmittance_floor: f64,
}

impl Default for ContinuousOptions {
    /// 1e-10 a ray; rays end at 1e-13.
    fn default() -> Self {
        ContinuousOptions { tolerance: 1e-10, transmittance_floor: 1e-13 }
    }
}

/// The integral along one ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RayIntegral {
    /// Linear, premultiplied RGBA.
    pub rgba: [f64; 4],
    /// Optical depth up to where the ray ended.
    pub depth: f64,
    /// The error of the quadrature and of the ray's early end, in any channel: an estimate, usually far too large.
    pub error: f64,
    /// Smooth pieces that were integrated.
    pub n_pieces: u64,
}

/// The integral for every pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Continuous {
    /// Linear, premultiplied RGBA.
    pub image: Image<f64>,
    /// The greatest error estimate of a pixel.
    pub error: f64,
    /// Smooth pieces that were integrated, over all rays.
    pub n_pieces: u64,
}

/// The emission-absorption integral of a volume's picture, over all threads of the current rayon pool.
///
/// `clip` is a box in sample space; its intersection with the volume's box, [-1/2, N - 1/2), is integrated, from the eye
/// (or the eye's plane) on. Pixels are sampled at their centres.
///
/// Accuracy: `options.tolerance`, and rounding of about 1e-16 for each piece of a ray; positions are held in sample space,
/// so that neither the volume's origin nor its spacing costs digits. Cells whose extinction is 0 are skipped, which is exact.
pub fn continuous(
    volume: &Volume,
    transfer: &TransferFunction,
    camera: &Camera,
    size: UVec2,
    clip: &Aabb,
    options: &ContinuousOptions,
) -> Continuous {
    let domain = volume_box(volume).intersection(clip);
    if domain.is_empty() {
        return Continuous { image: Image::transparent(size), error: 0.0, n_pieces: 0 };
    }
    let cells = Cells::with_blocks(volume, transfer);
    // The frame's step is of no matter here: only its rays are used.
    let step = volume.grid().world_box().diagonal();
    let frame = RayFrame::new(camera, volume.grid(), size, &domain, &Steps::shells(step));
    let row = |y: u32| {
        let mut pieces = Pieces::new(transfer, options);
        let line = |x| {
            let ray = frame.ray(x, y);
            let least = ray.t_eye - ray.t_anchor;
            Line { anchor: frame.center + ray.anchor, direction: ray.direction, least }
        };
        (0..size.x).map(|x| integrate(&cells, &mut pieces, &line(x), &domain)).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<RayIntegral>> = (0..size.y).into_par_iter().map(row).collect();
    let mut image = Image::transparent(size);
    for (pixel, ray) in image.pixels_mut().iter_mut().zip(rows.iter().flatten()) {
        *pixel = ray.rgba;
    }
    let rays = || rows.iter().flatten();
    Continuous { image, error: rays().map(|r| r.error).fold(0.0, f64::max), n_pieces: rays().map(|r| r.n_pieces).sum() }
}

/// The emission-absorption integral along one ray, t >= 0.
///
/// The ray lies in **sample space**; its direction is in voxels per world unit, so that t is in world units and extinction
/// is per world unit. `clip` as for [`continuous`]. Accuracy as there.
pub fn continuous_ray(
    volume: &Volume,
    transfer: &TransferFunction,
    ray: &Ray,
    clip: &Aabb,
    options: &ContinuousOptions,
) -> RayIntegral {
    let domain = volume_box(volume).intersection(clip);
    let square = ray.direction.length_squared();
    if domain.is_empty() || square.is_nan() || square <= 0.0 {
        return RayIntegral::default();
    }
    // Parameters count from the point nearest to the domain's centre: an origin far away costs no digits.
    let nearest = (domain.center() - ray.origin).dot(ray.direction) / square;
    let line = Line { anchor: ray.at(nearest), direction: ray.direction, least: -nearest };
    integrate(&Cells::new(volume), &mut Pieces::new(transfer, options), &line, &domain)
}

fn integrate(cells: &Cells, pieces: &mut Pieces, line: &Line, domain: &Aabb) -> RayIntegral {
    let mut ray = RayIntegral::default();
    let Some(span) = line.clip(domain) else { return ray };
    let mut emission = [0.0; 3];
    for cell in cells.along(line, span) {
        pieces.integrate(&cell.values, cell.length, ray.depth, |piece| {
            let t = transmittance(ray.depth);
            for (sum, e) in emission.iter_mut().zip(piece.emission) {
                *sum += t * e;
            }
            ray.depth += piece.depth;
            ray.error += t * piece.error;
            ray.n_pieces += 1;
        });
        if transmittance(ray.depth) < pieces.transmittance_floor() {
            ray.error += transmittance(ray.depth);
            break;
        }
    }
    let [r, g, b] = emission;
    ray.rgba = [r, g, b, alpha(ray.depth)];
    ray
}

/// The box of all voxels in sample space.
fn volume_box(volume: &Volume) -> Aabb {
    Aabb { min: DVec3::splat(-0.5), max: volume.grid().dims().as_dvec3() - 0.5 }
}
