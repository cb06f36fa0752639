//! The plan of curvilinear cells: a volume between nodes with positions and values, seen by a camera.

mod boundary;
mod data;

use std::sync::Arc;

use brickfield_core::glam::UVec2;
use brickfield_core::{Camera, Image, TransferFunction, ValueRange};

use crate::{Decode, Division, Frame, Lengths, RenderError, Sampling, ValueScale, ViewRays};

pub use boundary::{CellFace, FaceBox};
pub use data::{CellNode, Cells, CellsError, Handedness};

/// Everything that a backend needs for a picture of curvilinear cells: emission and absorption along the rays through them.
///
/// ARCHITECTURE.md ("Cells") has the rules: which cells a ray passes, its segments, the value at a node.
#[derive(Clone, Debug)]
pub struct CellsPlan {
    cells: Arc<Cells>,
    rays: ViewRays,
    sampling: Sampling,
    transfer: TransferFunction,
    behind: Option<Arc<Image<f32>>>,
}

/// The way cells are seen.
#[derive(Clone, Debug)]
pub struct CellsView {
    /// The camera.
    pub camera: Camera,
    /// Width and height of the picture, in pixels.
    pub size: UVec2,
    /// Step, rule and mode. Whole rays are divided, and lengths are true ones.
    pub sampling: Sampling,
    /// Extinction per world unit, and colour, of values.
    pub transfer: TransferFunction,
    /// An opaque surface behind or amid the cells: for each pixel its linear red, green and blue, and its distance from the eye along
    /// the pixel's ray, 0 where there is none ([`MeshFrame::pixels`](crate::MeshFrame::pixels) of the same camera). Rays end there.
    pub behind: Option<Arc<Image<f32>>>,
}

/// Why there is no plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum CellsPlanError {
    #[error("a picture of {} x {} pixels; it needs at least one", size.x, size.y)]
    Size { size: UVec2 },
    #[error("segments that end with bricks; cells have none, and whole rays are divided")]
    Division,
    #[error("nominal lengths; the segments of cells have true ones")]
    Lengths,
    #[error(
        "steps of {step_world} over {length} world units of cells, {distance} away: rays may have {} segments, counted in 48 bits",
        CellsPlan::MAX_SEGMENTS
    )]
    Steps { step_world: f64, length: f64, distance: f64 },
    #[error("a surface of {} x {} pixels behind a picture of {} x {}", behind.x, behind.y, size.x, size.y)]
    BehindSize { behind: UVec2, size: UVec2 },
    #[error("pixel ({}, {}) of the surface behind is {value:?}; it must be finite, and its distance 0 or more", pixel.x, pixel.y)]
    BehindPixel { pixel: UVec2, value: [f32; 4] },
}

impl CellsPlan {
    /// The most segments of a ray.
    pub const MAX_SEGMENTS: f64 = (1 << 24) as f64;

    /// The plan of a picture of cells.
    ///
    /// # Errors
    /// No pixels; segments that end with bricks, or nominal lengths; too many segments; a surface of another size, or with numbers that are
    /// not finite.
    pub fn new(cells: Arc<Cells>, view: CellsView) -> Result<CellsPlan, CellsPlanError> {
        let CellsView { camera, size, sampling, transfer, behind } = view;
        if size.min_element() == 0 {
            return Err(CellsPlanError::Size { size });
        }
        if sampling.division() != Division::Ray {
            return Err(CellsPlanError::Division);
        }
        if sampling.lengths() != Lengths::True {
            return Err(CellsPlanError::Lengths);
        }
        behind.as_deref().map_or(Ok(()), |behind| check_behind(behind, size))?;
        let (length, step_world) = (2.0 * cells.radius(), sampling.step_world());
        let distance = (camera.eye() - cells.center()).length();
        if length > step_world * CellsPlan::MAX_SEGMENTS || distance + length > step_world * 2f64.powi(48) {
            return Err(CellsPlanError::Steps { step_world, length, distance });
        }
        let rays = ViewRays::new(&camera, size, cells.center(), cells.radius());
        Ok(CellsPlan { cells, rays, sampling, transfer, behind })
    }

    /// The cells.
    pub fn cells(&self) -> &Arc<Cells> {
        &self.cells
    }

    /// The rays, relative to the cells' centre.
    pub fn rays(&self) -> &ViewRays {
        &self.rays
    }

    /// Step, rule and mode.
    pub fn sampling(&self) -> &Sampling {
        &self.sampling
    }

    /// Extinction and colour of values.
    pub fn transfer(&self) -> &TransferFunction {
        &self.transfer
    }

    /// The surface at which rays end.
    pub fn behind(&self) -> Option<&Arc<Image<f32>>> {
        self.behind.as_ref()
    }

    /// The colour of the surface that a pixel's ray ends at, and its distance from the eye.
    #[inline]
    pub fn end(&self, x: u32, y: u32) -> Option<([f32; 3], f32)> {
        let [r, g, b, t] = self.behind.as_deref()?.at(x, y);
        (t > 0.0).then_some(([r, g, b], t))
    }

    /// How f32 arithmetic counts data values.
    pub fn value_scale(&self) -> ValueScale {
        let ValueRange { min, max } = self.cells.range();
        ValueScale::of(&self.transfer, Decode { scale: max - min, offset: min })
    }

    /// A power of two near the cells' radius, in world units: with lengths in this unit, products of them stay within f32.
    pub fn unit(&self) -> f64 {
        2f64.powi(self.cells.radius().log2().ceil() as i32)
    }

    /// A whole number of steps before the nearest cell, as a distance from the eye: shaders count distances from there.
    pub(crate) fn start(&self) -> f64 {
        let (step, nearest) = (self.sampling.step_world(), (self.rays.eye().length() - self.cells.radius()).max(0.0));
        (nearest / step).floor() * step
    }

    /// Where rays end, as shaders read it: the surface's colour, and its distance from [`start`](Self::start) in [`unit`](Self::unit)s, 0 where
    /// there is none.
    pub(crate) fn ends(&self) -> Option<Vec<[f32; 4]>> {
        let (start, unit) = (self.start(), self.unit());
        // A surface before all cells ends rays before them.
        let past = |t: f32| (((f64::from(t) - start) / unit) as f32).max(f32::MIN_POSITIVE);
        let end = |[r, g, b, t]: &[f32; 4]| if *t > 0.0 { [*r, *g, *b, past(*t)] } else { [0.0; 4] };
        Some(self.behind.as_deref()?.pixels().iter().map(end).collect())
    }

    /// The choices that are compiled into its shader.
    pub fn shading(&self) -> CellsShading {
        CellsShading { has_voids: !self.cells.voids().is_empty(), has_ends: self.behind.is_some() }
    }

    /// Width and height of the picture, in pixels.
    pub fn size(&self) -> UVec2 {
        self.rays.size
    }
}

/// What a shader of cells has to do; the rest is left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct CellsShading {
    /// Some cells are left out.
    pub has_voids: bool,
    /// Rays end at a surface.
    pub has_ends: bool,
}

impl CellsShading {
    /// All that shaders tell apart.
    pub fn all() -> impl Iterator<Item = CellsShading> {
        [false, true]
            .into_iter()
            .flat_map(|has_voids| [false, true].map(|has_ends| CellsShading { has_voids, has_ends }))
    }
}

fn check_behind(behind: &Image<f32>, size: UVec2) -> Result<(), CellsPlanError> {
    if behind.size() != size {
        return Err(CellsPlanError::BehindSize { behind: behind.size(), size });
    }
    let is_bad = |p: &[f32; 4]| !p.iter().all(|x| x.is_finite()) || p[3] < 0.0;
    behind.pixels().iter().position(is_bad).map_or(Ok(()), |i| {
        let pixel = UVec2::new(i as u32 % size.x, i as u32 / size.x);
        Err(CellsPlanError::BehindPixel { pixel, value: behind.pixels()[i] })
    })
}

/// Draws cells.
pub trait CellsBackend {
    /// Draws a picture of cells. Cells that were drawn last stay on the device.
    ///
    /// # Errors
    /// As [`Backend::render`](crate::Backend::render).
    fn render_cells(&mut self, plan: &CellsPlan) -> Result<Frame, RenderError>;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mode, QuadratureRule};
    use brickfield_core::glam::{DVec3, UVec3};

    #[test]
    fn bad_views_are_named() {
        let positions: Vec<DVec3> = (0..8).map(|i| UVec3::new(i & 1, i >> 1 & 1, i >> 2).as_dvec3()).collect();
        let cells = Arc::new(Cells::new(UVec3::ONE, &positions, &[1.0; 8], None).unwrap());
        let extent = brickfield_core::Aabb { min: DVec3::ZERO, max: DVec3::ONE };
        let view = CellsView {
            camera: Camera::framing(&extent, DVec3::X, DVec3::Z).unwrap(),
            size: UVec2::new(2, 1),
            sampling: Sampling::new(0.1, QuadratureRule::MidpointExponential, Mode::Exact).unwrap(),
            transfer: TransferFunction::constant(1.0, [1.0; 3]).unwrap(),
            behind: None,
        };
        let error = |view: CellsView| CellsPlan::new(cells.clone(), view).unwrap_err().to_string();
        assert!(error(CellsView { size: UVec2::ZERO, ..view.clone() }).contains("0 x 0"));
        let sampling = view.sampling.divided(Division::Brick);
        assert!(error(CellsView { sampling, ..view.clone() }).contains("bricks"));
        let sampling = view.sampling.weighted(Lengths::Nominal).unwrap();
        assert!(error(CellsView { sampling, ..view.clone() }).contains("nominal"));
        let sampling = Sampling::new(1e-8, QuadratureRule::MidpointExponential, Mode::Exact).unwrap();
        assert!(error(CellsView { sampling, ..view.clone() }).starts_with("steps of 0.00000001 over 1.7"));
        let behind = |size, pixels| Some(Arc::new(Image::new(size, pixels).unwrap()));
        let small = behind(UVec2::ONE, vec![[0.0; 4]]);
        assert!(error(CellsView { behind: small, ..view.clone() }).contains("1 x 1 pixels behind"));
        let before = behind(view.size, vec![[0.0; 4], [0.0, 0.0, 0.0, -1.0]]);
        assert!(error(CellsView { behind: before, ..view.clone() }).starts_with("pixel (1, 0)"));
        let good = behind(view.size, vec![[0.5, 0.0, 0.0, 2.0], [0.0; 4]]);
        let plan = CellsPlan::new(cells.clone(), CellsView { behind: good, ..view }).unwrap();
        assert_eq!((plan.end(0, 0), plan.end(1, 0)), (Some(([0.5, 0.0, 0.0], 2.0)), None));
    }
}
