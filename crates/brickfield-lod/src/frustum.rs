//! The part of the world that a picture's rays can reach, and which bricks lie outside it.

use brickfield_core::glam::{DAffine3, DVec3, UVec2};
use brickfield_core::{Aabb, Camera, Grid};

use crate::{Answer, Filter, Tile};

const N_PLANES: usize = 5;

/// Relative rounding of the plane test; a brick nearer to a plane than that counts as inside.
const TOLERANCE: f64 = 1e-12;

/// The five planes, in **index space**, that bound the rays of a picture: left, right, bottom, top and the eye's own.
///
/// Bricks are boxes in index space whatever the grid's direction and spacing, so that one test serves sheared,
/// anisotropic and mirrored grids.
///
/// As a filter it ignores bricks outside and renders all others. It is conservative: a brick that a ray reaches is never
/// outside; one near an edge of the frustum may lie outside and be rendered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    planes: [HalfSpace; N_PLANES],
}

/// The set of a frustum's planes of which a brick has not been found to lie wholly inside. All, by default.
///
/// The children of a brick need to be tested against no others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Planes(u8);

impl Planes {
    const ALL: Planes = Planes((1 << N_PLANES) - 1);
    const NONE: Planes = Planes(0);
}

impl Default for Planes {
    fn default() -> Planes {
        Planes::ALL
    }
}

/// The half space normal . p + offset >= 0.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HalfSpace {
    normal: DVec3,
    offset: f64,
    tolerance: f64,
}

impl Frustum {
    /// The frustum of all rays that start on a picture of `size` pixels, its border included.
    pub fn new(grid: &Grid, camera: &Camera, size: UVec2) -> Frustum {
        let rays = camera.pixel_rays(size);
        let half = rays.corner().abs();
        let (right, up, forward) = (camera.right(), camera.up(), camera.forward());
        let to_index = |toward: DVec3, depth: f64, margin: f64| {
            HalfSpace::in_index_space(grid, camera.eye(), toward + forward * depth, margin)
        };
        // Perspective: the planes tilt with the depth and pass the eye. Orthographic: they stand off it.
        let side = |toward: DVec3, half: f64| match rays.depth() {
            0.0 => to_index(toward, 0.0, half),
            depth => to_index(toward, half / depth, 0.0),
        };
        let eye = to_index(DVec3::ZERO, 1.0, 0.0);
        Frustum { planes: [side(right, half.x), side(-right, half.x), side(up, half.y), side(-up, half.y), eye] }
    }

    /// Whether a ray may reach an index-space box.
    pub(crate) fn reaches(&self, b: &Aabb) -> bool {
        self.crossed(b, Planes::ALL).is_some()
    }

    /// Which of `planes` the index-space box crosses; `None` if it lies wholly outside one of them.
    fn crossed(&self, b: &Aabb, planes: Planes) -> Option<Planes> {
        let (center, half) = (b.center(), b.extent() * 0.5);
        let mut crossed = Planes::NONE;
        for (i, plane) in self.planes.iter().enumerate().filter(|(i, _)| planes.0 >> i & 1 == 1) {
            let distance = plane.normal.dot(center) + plane.offset;
            let reach = plane.normal.abs().dot(half);
            if distance + reach < -plane.tolerance {
                return None;
            }
            let is_inside = distance - reach >= plane.tolerance;
            if !is_inside {
                crossed.0 |= 1 << i;
            }
        }
        Some(crossed)
    }
}

impl Filter for Frustum {
    type Known = Planes;

    #[inline]
    fn answer_knowing(&self, tile: &Tile<'_>, known: Planes) -> (Answer, Planes) {
        if known == Planes::NONE {
            return (Answer::Render, known);
        }
        match self.crossed(&tile.index_box(), known) {
            Some(crossed) => (Answer::Render, crossed),
            None => (Answer::Ignore, known),
        }
    }
}

impl HalfSpace {
    /// The world's half space normal . (p - eye) + margin >= 0, in index space.
    fn in_index_space(grid: &Grid, eye: DVec3, normal: DVec3, margin: f64) -> HalfSpace {
        let DAffine3 { matrix3, translation } = grid.index_to_world();
        let (normal, margin) = (normal / normal.length(), margin / normal.length());
        let index_normal = matrix3.transpose() * normal;
        let reach = index_normal.abs().dot(grid.dims().as_dvec3());
        let scale = translation.abs().max_element() + eye.abs().max_element() + margin + reach;
        HalfSpace { normal: index_normal, offset: normal.dot(translation - eye) + margin, tolerance: TOLERANCE * scale }
    }
}
