//! The beam of one tile.

use std::ops::Range;

use brickfield_core::glam::{DVec3, UVec3, Vec3A};

use super::overview::{Overview, Region};
use crate::{FramePlan, PlanRay, RayFrame};

/// Positions this near to a face, in samples, may belong to either side.
const MARGIN: f64 = 1.0 / 64.0;
/// Dark stretches of fewer segments are left to the rays.
const SHORTEST: i64 = 16;

/// The rays through a tile of pixels: at any parameter they lie in a box whose sides are spanned by the tile's corners.
pub(super) struct Beam {
    /// The corners' rays, moved out to either side so far that all rays of the tile lie between.
    low: [MovingPosition; 4],
    high: [MovingPosition; 4],
    /// Lines are at `at` here, in world units past the frame's start.
    t_center: f64,
}

/// A position in sample space that moves.
#[derive(Clone, Copy, Debug)]
struct MovingPosition {
    at: Vec3A,
    /// Samples per world unit.
    change: Vec3A,
    inverse: Vec3A,
}

impl Beam {
    /// The beam of the pixels in `columns` and `rows`, neither of them empty, of a volume of `dims` samples.
    pub(super) fn new(rays: &RayFrame, dims: UVec3, columns: &Range<u32>, rows: &Range<u32>) -> Beam {
        let [left, right, top, bottom] = [columns.start, columns.end - 1, rows.start, rows.end - 1];
        let corners = [(left, top), (right, top), (left, bottom), (right, bottom)].map(|(x, y)| rays.ray(x, y));
        let t_center = corners[0].t_anchor;
        let swell = swell(rays, f64::from(right - left).hypot(f64::from(bottom - top)));
        let margin = swell * (t_center + rays.start).max(0.0) + MARGIN + dims.as_dvec3().max_element() * 1e-6;
        let line = |ray: &PlanRay, side: f64| {
            let at = rays.center + ray.at(t_center) + margin * side;
            let change = (ray.direction + swell * side).as_vec3a();
            MovingPosition { at: at.as_vec3a(), change, inverse: change.recip() }
        };
        let lines = |side| [0, 1, 2, 3].map(|i: usize| line(&corners[i], side));
        Beam { low: lines(-1.0), high: lines(1.0), t_center }
    }

    /// The parameters at which the beam may touch a box.
    fn span(&self, region: Region) -> (f32, f32) {
        let (mut start, mut end) = (f32::NEG_INFINITY, f32::INFINITY);
        for axis in 0..3 {
            for (lines, face, sign) in [(&self.low, region.high[axis], 1.0), (&self.high, region.low[axis], -1.0)] {
                let (mut from, mut to) = (f32::INFINITY, f32::NEG_INFINITY);
                for line in lines {
                    // Where sign (line - face) <= 0.
                    let (gap, change) = ((line.at[axis] - face) * sign, line.change[axis] * sign);
                    let at = -gap / change;
                    let (a, b) = if change == 0.0 {
                        if gap <= 0.0 { (f32::NEG_INFINITY, f32::INFINITY) } else { continue }
                    } else if change > 0.0 {
                        (f32::NEG_INFINITY, at)
                    } else {
                        (at, f32::INFINITY)
                    };
                    (from, to) = (from.min(a), to.max(b));
                }
                (start, end) = (start.max(from), end.min(to));
            }
        }
        (start, end)
    }

    /// Until when the beam stays in a region; `None` if not all of it is there at `u`.
    #[inline(always)]
    fn leaves(&self, region: Region, u: f32) -> Option<f32> {
        let mut exit = f32::INFINITY;
        for (low, high) in self.low.iter().zip(&self.high) {
            let (inside_low, inside_high) = (low.position(u) - region.low, region.high - high.position(u));
            if inside_low.min_element() < 0.0 || inside_high.min_element() < 0.0 {
                return None;
            }
            let never = Vec3A::INFINITY;
            let down = Vec3A::select(low.change.cmplt(Vec3A::ZERO), -inside_low * low.inverse, never);
            let up = Vec3A::select(high.change.cmpgt(Vec3A::ZERO), inside_high * high.inverse, never);
            exit = exit.min(down.min(up).min_element());
        }
        Some(u + exit)
    }

    fn center(&self, u: f32) -> Vec3A {
        self.low.iter().chain(&self.high).map(|line| line.position(u)).sum::<Vec3A>() / 8.0
    }

    /// The segments in which a ray of the tile may see something, front to back.
    pub(super) fn runs(&self, overview: &Overview, plan: &FramePlan) -> Vec<Range<i64>> {
        let mut runs: Vec<Range<i64>> = Vec::new();
        let step = plan.sampling().step_world();
        let segment = |u: f32| (f64::from(u) + self.t_center) / step;
        let visible = Region { low: plan.visible.min.as_vec3a(), high: plan.visible.max.as_vec3a() };
        let (start, end) = self.span(visible);
        // A beam that widens faster than it moves never leaves a box.
        let end = end.min((plan.rays().n_segments * step - self.t_center) as f32);
        let pace = overview.pace(self.low[0].change.abs().max_element()).max(step as f32);
        let mut u = start.max((-plan.rays().start - self.t_center) as f32);
        while u < end {
            let exit = overview.dark_around(self.center(u)).and_then(|region| self.leaves(region, u));
            // A leap must be worth it, and not be lost in rounding.
            if let Some(exit) = exit.filter(|exit| *exit > u + 0.25 * pace) {
                u = exit;
                continue;
            }
            let next = (u + pace).max(u.next_up());
            let run = segment(u).floor() as i64..segment(next.min(end)).ceil() as i64;
            match runs.last_mut() {
                Some(last) if run.start < last.end + SHORTEST => last.end = run.end,
                _ => runs.push(run),
            }
            u = next;
        }
        runs
    }
}

impl MovingPosition {
    #[inline(always)]
    fn position(&self, u: f32) -> Vec3A {
        self.at + self.change * u
    }
}

/// By how much, per world unit from the eye, rays of a tile may lie outside the box around its corners' rays.
///
/// The ends of rays of length 1 are n = v / |v| with v affine in the pixel and |v| >= 1: second derivatives of n are at most
/// 3 |v'|^2, so that n is within 3/8 of the square of the tile's diagonal of the bilinear interpolation between the corners.
fn swell(rays: &RayFrame, diagonal: f64) -> DVec3 {
    if rays.pixel == 0.0 {
        return DVec3::ZERO;
    }
    let axes = [rays.direction[0], rays.direction[1] / rays.pixel, rays.direction[2] / rays.pixel];
    let reach = axes.into_iter().map(|v| v * v).sum::<DVec3>().map(f64::sqrt);
    reach * (0.375 * (diagonal * rays.pixel).powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::UVec2;
    use brickfield_core::{Aabb, Camera, Grid, Projection};

    /// By how many samples rays of the tiles of a picture leave their beams, at most, and the lines of the tiles' corners.
    fn outside(camera: &Camera, size: UVec2) -> (f32, f32) {
        let grid = Grid::axis_aligned(UVec3::new(60, 50, 40), DVec3::new(1.0, 0.7, 2.0)).unwrap();
        let domain = Aabb { min: DVec3::splat(-0.5), max: grid.dims().as_dvec3() - 0.5 };
        let rays = RayFrame::new(camera, &grid, size, &domain, &crate::Steps::shells(0.5));
        let (mut of_beam, mut of_corners) = (f32::MIN, f32::MIN);
        for tile in (0..size.x / 8).flat_map(|x| (0..size.y / 8).map(move |y| UVec2::new(x, y) * 8)) {
            let (columns, rows) = (tile.x..tile.x + 8, tile.y..tile.y + 8);
            let beam = Beam::new(&rays, grid.dims(), &columns, &rows);
            let corners =
                [tile, tile + UVec2::new(7, 0), tile + UVec2::new(0, 7), tile + 7].map(|p| rays.ray(p.x, p.y));
            for (x, y) in columns.clone().flat_map(|x| rows.clone().map(move |y| (x, y))) {
                for t in [0.0, 3.0, 20.0, 60.0] {
                    let p = (rays.center + rays.ray(x, y).at(t)).as_vec3a();
                    let at = |line: &MovingPosition| line.position((t - beam.t_center) as f32);
                    let low = beam.low.iter().map(at).reduce(Vec3A::min).unwrap();
                    let high = beam.high.iter().map(at).reduce(Vec3A::max).unwrap();
                    of_beam = of_beam.max((low - p).max(p - high).max_element());
                    let ends = corners.map(|ray| (rays.center + ray.at(t)).as_vec3a());
                    let (low, high) = (ends.into_iter().reduce(Vec3A::min), ends.into_iter().reduce(Vec3A::max));
                    of_corners = of_corners.max((low.unwrap() - p).max(p - high.unwrap()).max_element());
                }
            }
        }
        (of_beam, of_corners)
    }

    #[test]
    fn rays_stay_in_their_beam_however_wide_it_is() {
        let eye = DVec3::new(15.0, 20.0, 30.0);
        for degrees in [5.0f64, 60.0, 120.0, 170.0] {
            for target in [DVec3::new(40.0, 20.0, 30.0), DVec3::new(30.0, 10.0, 5.0)] {
                let projection = Projection::Perspective { fov_y: degrees.to_radians() };
                let camera = Camera::look_at(eye, target, DVec3::Z, projection).unwrap();
                let (of_beam, of_corners) = outside(&camera, UVec2::new(32, 24));
                assert!(of_beam < 0.0, "{degrees}: {of_beam}");
                assert!(of_corners > 0.1 || degrees < 100.0, "{degrees}: {of_corners}");
            }
        }
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Z, Projection::Orthographic { height: 80.0 }).unwrap();
        assert!(outside(&camera, UVec2::new(32, 24)).0 < 0.0);
    }
}
