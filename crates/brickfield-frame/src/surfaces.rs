//! The surfaces that cut rays into segments.

use brickfield_core::glam::DVec3;
use brickfield_core::{Aabb, Grid, Level};

use crate::rays::voxels_per_unit;
use crate::{Division, PlanRay, Sampling};

/// The surfaces between which segments lie: the proxy geometries of LaMar, Hamann and Joy 1999, section 4.2.
///
/// Along each ray they are evenly spaced; how far apart, in steps, is [`PlanRay::stretch`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Placement {
    /// Spheres around the eye, a step apart on every ray. For parallel rays: planes.
    #[default]
    Shells,
    /// The same spheres as triangles: the picture's squares of so many pixels a side, cut along their falling diagonals, with
    /// their corners on the sphere.
    #[allow(missing_docs)]
    TessellatedShells { facet_pixels: u32 },
    /// Planes parallel to the picture, a step apart: a ray at angle a to the view direction has 1 / cos a steps between two.
    ViewportPlanes,
    /// Planes of constant x, y or z of the grid, a step apart in the world, the first a sixth of a voxel before the volume where
    /// rays enter it. Each ray takes the stack that it meets at the steepest angle.
    ObjectPlanes,
}

/// How many voxels before the volume the first plane of a stack lies. From there no plane of whole or half voxels, and no middle
/// between two, at any level, lies on a brick's face, where rounding would decide which brick has it.
const BEFORE: f64 = 1.0 / 6.0;
/// Factors of the cosines to x, y and z before they are compared: a tie goes to x, then y.
pub(crate) const PREFERENCE: DVec3 = DVec3::new(1.0, 1.0 - 1.0 / 4096.0, 1.0 - 2.0 / 4096.0);

/// The parameters of the surfaces of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steps {
    /// Distance between surfaces, in world units.
    pub(crate) step_world: f64,
    pub(crate) placement: Placement,
    /// Distance between the surfaces of the coarsest level, whose own surface 0 is.
    pub(crate) coarsest_world: f64,
}

/// Three stacks of planes, a step apart in the world: of constant x, y, z in sample space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlaneStacks {
    /// Distance between two planes a voxel apart, in world units: the factor of a direction in voxels per world unit
    /// to give the cosines of its angles to the planes' normals.
    pub voxel_world: DVec3,
    /// The first planes that rays towards greater x, y, z meet; relative to the frame's centre.
    pub low: DVec3,
    /// The first planes that rays towards smaller x, y, z meet; relative to the frame's centre.
    pub high: DVec3,
}

/// Surfaces that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum PlacementError {
    #[error("facets of {facet_pixels} pixels; a side must be 1 to {most}")]
    FacetPixels { facet_pixels: u32, most: u32 },
}

impl Placement {
    /// Most pixels along a facet's side.
    pub const MOST_FACET_PIXELS: u32 = 1 << 15;

    /// The name in shader conditions (`@if(name)`), options and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Placement::Shells => "shells",
            Placement::TessellatedShells { .. } => "tessellated-shells",
            Placement::ViewportPlanes => "viewport-planes",
            Placement::ObjectPlanes => "object-planes",
        }
    }
}

impl Steps {
    /// Spherical shells.
    pub fn shells(step_world: f64) -> Steps {
        Steps { step_world, placement: Placement::Shells, coarsest_world: step_world }
    }

    /// The surfaces of a placement for a sampling of bricks up to level `coarsest`.
    ///
    /// # Errors
    /// Facets without pixels, or of more than [`Placement::MOST_FACET_PIXELS`].
    pub fn of(sampling: &Sampling, placement: Placement, coarsest: Level) -> Result<Steps, PlacementError> {
        let most = Placement::MOST_FACET_PIXELS;
        let step_world = sampling.step_world();
        let coarsest = match sampling.division() {
            Division::Ray => Level(0),
            Division::Brick => coarsest,
        };
        match placement {
            Placement::TessellatedShells { facet_pixels } if !(1..=most).contains(&facet_pixels) => {
                Err(PlacementError::FacetPixels { facet_pixels, most })
            }
            _ => Ok(Steps { step_world, placement, coarsest_world: step_world * f64::from(coarsest.stride()) }),
        }
    }
}

impl PlaneStacks {
    pub(crate) fn new(grid: &Grid, domain: &Aabb) -> PlaneStacks {
        let half = 0.5 * domain.extent() + BEFORE;
        PlaneStacks { voxel_world: voxels_per_unit(grid).recip(), low: -half, high: half }
    }

    pub(crate) fn most_segments(&self, step_world: f64) -> f64 {
        ((self.high - self.low) * self.voxel_world / step_world).max_element().ceil().max(1.0)
    }

    /// The axis whose planes a ray of this direction (voxels per world unit) takes: the steepest. Where two are within
    /// 1/4096, the first: pictures of boxes seen along a diagonal shall not depend on rounding.
    #[inline]
    pub fn axis(&self, direction: DVec3) -> usize {
        let steep = (direction * self.voxel_world).abs() * PREFERENCE;
        match steep.x >= steep.y && steep.x >= steep.z {
            true => 0,
            false if steep.y >= steep.z => 1,
            false => 2,
        }
    }

    /// The other axis that a ray of this direction would take if cosines were off by `rounding`.
    pub(crate) fn other_axis(&self, direction: DVec3, rounding: f64) -> Option<usize> {
        let steep = (direction * self.voxel_world).abs() * PREFERENCE;
        let own = self.axis(direction);
        (0..3).find(|axis| *axis != own && steep[*axis] >= steep[own] - rounding)
    }

    /// The ray with the planes of an axis as its surfaces.
    pub(crate) fn through(&self, shells: PlanRay, axis: usize) -> PlanRay {
        let d = shells.direction[axis];
        let first = if d > 0.0 { self.low[axis] } else { self.high[axis] };
        let t_anchor = (shells.anchor[axis] - first) / d;
        let t_eye = t_anchor - (shells.t_anchor - shells.t_eye);
        PlanRay { t_anchor, t_eye, stretch: 1.0 / (d * self.voxel_world[axis]).abs(), ..shells }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mode, QuadratureRule};

    #[test]
    fn facets_without_pixels_are_named() {
        let sampling = Sampling::new(1.0, QuadratureRule::MidpointExponential, Mode::Exact).unwrap();
        let of = |facet_pixels| Steps::of(&sampling, Placement::TessellatedShells { facet_pixels }, Level(0));
        assert!(of(0).unwrap_err().to_string().contains("facets of 0 pixels; a side must be 1 to 32768"));
        assert!(of(32769).is_err() && of(32768).is_ok());
    }
}
