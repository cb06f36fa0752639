//! The facets of tessellated shells: the picture's squares, each cut along its falling diagonal.

use brickfield_core::glam::{DVec2, DVec3, UVec2};

use crate::{Placement, RayFrame};

impl RayFrame {
    /// Squares along the picture's width and height; a single one where shells are not tessellated.
    pub(crate) fn facet_squares(&self) -> UVec2 {
        let side = self.facet_pixels();
        UVec2::new(self.size.x.div_ceil(side), self.size.y.div_ceil(side)).max(UVec2::ONE)
    }

    /// Pixels along a facet's side; beyond every picture where shells are not tessellated.
    pub(crate) fn facet_pixels(&self) -> u32 {
        match self.placement {
            Placement::TessellatedShells { facet_pixels } => facet_pixels,
            _ => u32::MAX,
        }
    }

    /// Number of facets: two for each square.
    pub fn n_facets(&self) -> u32 {
        2 * self.facet_squares().element_product()
    }

    /// The facet that a pixel's ray meets: twice its square's number, plus one to the right of the diagonal.
    #[inline]
    pub fn facet_of(&self, x: u32, y: u32) -> u32 {
        let side = self.facet_pixels();
        2 * (x / side + y / side * self.facet_squares().x) + u32::from(x % side > y % side)
    }

    /// The plane n . p = 1 of a facet of the unit sphere; p and n along the picture's right and down, and the view direction.
    pub fn facet_normal(&self, facet: u32) -> DVec3 {
        let [a, b, c] = self.facet_corners(facet).map(|corner| self.on_sphere(corner));
        let normal = (b - a).cross(c - a);
        normal / normal.dot(a)
    }

    /// The planes of all facets as shaders read them: n.x, n.y, n.z - 1, 0.
    pub fn facet_planes(&self) -> Vec<[f32; 4]> {
        let plane = |facet| {
            let n = self.facet_normal(facet);
            [n.x as f32, n.y as f32, (n.z - 1.0) as f32, 0.0]
        };
        (0..self.n_facets()).map(plane).collect()
    }

    /// A facet's corners, in pixels from the picture's upper left corner.
    pub(crate) fn facet_corners(&self, facet: u32) -> [DVec2; 3] {
        let (square, n) = (facet / 2, self.facet_squares().x);
        let corner = |dx, dy| UVec2::new(square % n + dx, square / n + dy).as_dvec2() * f64::from(self.facet_pixels());
        [corner(0, 0), if facet.is_multiple_of(2) { corner(0, 1) } else { corner(1, 0) }, corner(1, 1)]
    }

    /// The direction of a picture position; for parallel rays where it meets the plane at distance 1.
    fn on_sphere(&self, pixel: DVec2) -> DVec3 {
        let across = pixel - 0.5 * self.size.as_dvec2();
        match self.pixel {
            0.0 => across.extend(1.0),
            side => (across * side).extend(1.0).normalize(),
        }
    }
}
