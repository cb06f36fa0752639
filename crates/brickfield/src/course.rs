//! The rays of a scene through a grid, whatever is stored on it.

use brickfield_core::glam::DVec3;
use brickfield_core::{Aabb, Grid, Level};
use brickfield_frame::{Division, Placement, RayFrame, Sampling, Steps};
use brickfield_optics::QuadratureRule;

use crate::Scene;
use crate::prepare::{MAX_FACETS, MAX_SEGMENTS, PrepareError};

/// The rays of a scene through a grid, and their segments.
pub(crate) struct Course {
    /// The part of sample space that is integrated.
    pub(crate) domain: Aabb,
    pub(crate) sampling: Sampling,
    pub(crate) rays: RayFrame,
}

impl Course {
    /// `coarsest` is the coarsest level that is drawn.
    pub(crate) fn new(grid: &Grid, scene: &Scene, coarsest: Level) -> Result<Course, PrepareError> {
        let domain = clipped_domain(grid, scene.clip)?;
        let step_world = scene.quality.step(scene.step_voxels) * grid.spacing().min_element();
        if !(step_world.is_finite() && step_world > 0.0) {
            return Err(PrepareError::Step { step_voxels: scene.step_voxels });
        }
        let sampling = Sampling::new(step_world, scene.rule, scene.mode)?;
        let sampling = sampling.divided(scene.division).weighted(scene.lengths)?;
        check_segments(grid.world_box().diagonal() / step_world)?;
        let steps = Steps::of(&sampling, scene.placement, coarsest)?;
        let volume = to_sample_space(grid.index_box());
        let rays = RayFrame::new(&scene.camera, grid, scene.size, &volume, &steps);
        check_segments(rays.n_segments)?;
        check_facets(&rays)?;
        Ok(Course { domain, sampling, rays })
    }
}

pub(crate) fn to_sample_space(index: Aabb) -> Aabb {
    Aabb { min: index.min - 0.5, max: index.max - 0.5 }
}

fn clipped_domain(grid: &Grid, clip: Option<Aabb>) -> Result<Aabb, PrepareError> {
    let whole = to_sample_space(grid.index_box());
    let Some(clip) = clip else { return Ok(whole) };
    // NaN fails too.
    if clip.is_empty() || !(clip.min.is_finite() && clip.max.is_finite()) {
        return Err(PrepareError::Clip { clip });
    }
    let domain = whole.intersection(&to_sample_space(clip));
    Ok(if domain.is_empty() { Aabb { min: domain.min, max: domain.min } } else { domain })
}

/// How many blocks of `n_cells` voxels a segment can span along an axis, if its light depends on both its ends; else 0.
pub(crate) fn segment_reach(grid: &Grid, scene: &Scene, n_cells: u32) -> u32 {
    if scene.rule != QuadratureRule::PreIntegrated || scene.division == Division::Brick {
        return 0;
    }
    voxels_in_step(grid, scene).div_ceil(n_cells)
}

/// How many voxels a segment can span along an axis, rounded up.
pub(crate) fn voxels_in_step(grid: &Grid, scene: &Scene) -> u32 {
    // A sheared direction matrix can make a world step longer in voxels than the spacing says: take the map's own norm.
    let turn = grid.world_to_index().matrix3;
    let voxels_per_unit =
        [turn.x_axis, turn.y_axis, turn.z_axis].into_iter().map(DVec3::length_squared).sum::<f64>().sqrt();
    let voxels = scene.quality.step(scene.step_voxels) * grid.spacing().min_element() * voxels_per_unit;
    voxels.ceil().min(f64::from(u32::MAX)) as u32
}

fn check_segments(n_segments: f64) -> Result<(), PrepareError> {
    if n_segments < f64::from(MAX_SEGMENTS) {
        return Ok(());
    }
    Err(PrepareError::TooManySegments { n_segments, limit: MAX_SEGMENTS })
}

fn check_facets(rays: &RayFrame) -> Result<(), PrepareError> {
    match (rays.placement, rays.n_facets()) {
        (Placement::TessellatedShells { facet_pixels }, n_facets) if n_facets > MAX_FACETS => {
            Err(PrepareError::TooManyFacets { n_facets, facet_pixels, limit: MAX_FACETS })
        }
        _ => Ok(()),
    }
}
