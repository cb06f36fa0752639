//! The plan of a mesh: triangles with values, seen by a camera (Wynn, Barnes, Hamann and Miller 1999, section 3).

mod data;
mod uniform;

use std::sync::Arc;

use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Camera, Image, LinearRgb, TransferFunction};
use brickfield_optics::{Light, LightSource};

use crate::{RenderError, Timing, ViewRays};

pub use data::{Mesh, MeshError, MeshTriangle, MeshVertex};
pub use uniform::MeshUniforms;
pub(crate) use uniform::color_knots;

/// Everything that a backend needs for a picture of a mesh: a second kind of plan, besides [`FramePlan`](crate::FramePlan).
///
/// Of each pixel the nearest triangle at its centre is drawn, both sides alike; the pixel is opaque, or the background shows. A value is
/// interpolated between the corners along the triangle's plane, in space and not in the picture.
#[derive(Clone, Debug)]
pub struct MeshPlan {
    pub(crate) mesh: Arc<Mesh>,
    pub(crate) rays: ViewRays,
    pub(crate) colors: TransferFunction,
    pub(crate) coloring: Coloring,
    pub(crate) light: Option<Light>,
    pub(crate) lines: Option<MeshLines>,
    pub(crate) near: f64,
}

/// How a colour comes about between the corners of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Coloring {
    /// The value is interpolated, and then mapped: every colour is one of the colour map's.
    #[default]
    Values,
    /// The corners' values are mapped, and their colours interpolated (Gouraud shading, as in the paper).
    Gouraud,
}

/// Lines along those edges of triangles that are marked ([`MeshTriangle::edges`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshLines {
    /// In pixels, wherever the line is. Each of two triangles beside an edge has half of it.
    pub width: f64,
    /// Its colour.
    pub color: LinearRgb,
}

/// The way a mesh is seen.
#[derive(Clone, Debug)]
pub struct MeshView {
    /// The camera.
    pub camera: Camera,
    /// Width and height of the picture, in pixels.
    pub size: UVec2,
    /// Colours of values; its extinctions mean nothing here.
    pub colors: TransferFunction,
    /// How colours come about between corners.
    pub coloring: Coloring,
    /// The light on the mesh, from both of its sides; `None`: colours as they are. Only its source and
    /// terms count.
    pub light: Option<Light>,
    /// Lines along marked edges.
    pub lines: Option<MeshLines>,
}

/// Why there is no plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum MeshPlanError {
    #[error("mesh lines of {width} pixels; they must be more than 0 and at most {}", MeshLines::MAX_WIDTH)]
    LineWidth { width: f64 },
    #[error("mesh lines of the colour {color:?}; its parts must be finite, and 0 or more")]
    LineColor { color: LinearRgb },
    #[error("a picture of {} x {} pixels; it needs at least one", size.x, size.y)]
    Size { size: UVec2 },
    #[error("a mesh that reaches {reach} from the eye; at most {most} is possible")]
    Far { reach: f64, most: f64 },
}

impl MeshLines {
    /// The widest lines, in pixels.
    pub const MAX_WIDTH: f64 = 64.0;
}

/// Nothing is drawn nearer to the eye's plane than this share of the scene.
const NEAR: f64 = 1e-6;
/// The greatest distance from the eye, in world units and in units of the mesh: those of f32, and room for products.
const MOST_REACH: f64 = 1e30;

impl MeshPlan {
    /// The plan of a mesh's picture.
    ///
    /// # Errors
    /// No pixels; lines too narrow or too wide, or of no colour; an eye too far away.
    pub fn new(mesh: Arc<Mesh>, view: MeshView) -> Result<MeshPlan, MeshPlanError> {
        let MeshView { camera, size, colors, coloring, light, lines } = view;
        if size.min_element() == 0 {
            return Err(MeshPlanError::Size { size });
        }
        if let Some(MeshLines { width, .. }) = lines
            && !(width > 0.0 && width <= MeshLines::MAX_WIDTH)
        {
            return Err(MeshPlanError::LineWidth { width });
        }
        if let Some(MeshLines { color, .. }) = lines
            && !color.iter().all(|c| c.is_finite() && *c >= 0.0)
        {
            return Err(MeshPlanError::LineColor { color });
        }
        let rays = ViewRays::new(&camera, size, mesh.center(), mesh.radius());
        let (reach, most) = (reach(&rays, &mesh), MOST_REACH * mesh.unit().min(1.0));
        if reach.is_nan() || reach > most {
            return Err(MeshPlanError::Far { reach, most });
        }
        // Sides, and the gradient of a surface, are of volumes.
        let light = light.map(|l| Light::new(l.source(), l.terms(), 1.0).expect("terms that are a light's"));
        let near = NEAR * (mesh.radius() + rays.anchor[0].length());
        Ok(MeshPlan { mesh, rays, colors, coloring, light, lines, near })
    }

    /// The triangles.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// The rays, relative to the mesh's centre.
    pub fn rays(&self) -> &ViewRays {
        &self.rays
    }

    /// Colours of values.
    pub fn colors(&self) -> &TransferFunction {
        &self.colors
    }

    /// How colours come about between corners.
    pub fn coloring(&self) -> Coloring {
        self.coloring
    }

    /// The light, on both sides.
    pub fn light(&self) -> Option<&Light> {
        self.light.as_ref()
    }

    /// Lines along marked edges.
    pub fn lines(&self) -> Option<&MeshLines> {
        self.lines.as_ref()
    }

    /// The depth from which on something is drawn.
    pub fn near(&self) -> f64 {
        self.near
    }

    /// No vertex is farther from the eye.
    pub fn reach(&self) -> f64 {
        reach(&self.rays, &self.mesh)
    }

    /// The same plan with other rays (a mutant in conformance runs has some).
    #[must_use]
    pub fn with_rays(self, rays: ViewRays) -> MeshPlan {
        MeshPlan { rays, ..self }
    }

    /// Width and height of the picture, in pixels.
    pub fn size(&self) -> UVec2 {
        self.rays.size
    }

    /// The choices that are compiled into its shader.
    pub fn shading(&self) -> MeshShading {
        MeshShading {
            coloring: self.coloring,
            lit: self.light.is_some(),
            has_normals: self.light.is_some() && self.mesh.has_normals(),
            has_lines: self.lines.is_some(),
        }
    }

    /// Whether there is nothing to draw.
    pub fn shows_nothing(&self) -> bool {
        self.mesh.triangles().is_empty()
    }

    /// Towards the light from a point relative to the mesh's centre, of length 1; `to_eye` is the direction to the eye.
    pub fn to_light(&self, light: &Light, point: DVec3, to_eye: DVec3) -> DVec3 {
        match light.source() {
            LightSource::Head => to_eye,
            LightSource::Direction(direction) => direction,
            LightSource::Place(place) => (place - self.mesh.center() - point).normalize_or_zero(),
        }
    }
}

/// No vertex is farther from the eye.
fn reach(rays: &ViewRays, mesh: &Mesh) -> f64 {
    rays.eye().length() + mesh.radius()
}

/// What a mesh's shader has to do; the rest is left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub struct MeshShading {
    pub coloring: Coloring,
    pub lit: bool,
    /// Normals of vertices are interpolated; else they are those of triangles.
    pub has_normals: bool,
    pub has_lines: bool,
}

impl MeshShading {
    /// All that shaders tell apart.
    pub fn all() -> impl Iterator<Item = MeshShading> {
        let lights = [(false, false), (true, false), (true, true)];
        [Coloring::Values, Coloring::Gouraud].into_iter().flat_map(move |coloring| {
            lights.into_iter().flat_map(move |(lit, has_normals)| {
                [false, true].map(|has_lines| MeshShading { coloring, lit, has_normals, has_lines })
            })
        })
    }
}

/// The picture of a mesh.
#[derive(Clone, Debug)]
pub struct MeshFrame {
    /// Linear red, green and blue, and how far away the mesh is: the distance from the eye along the pixel's ray, 0 where there is
    /// none.
    pub pixels: Image<f32>,
    /// How long it took.
    pub timing: Timing,
    /// Bytes that were brought to the device for it.
    pub uploaded_bytes: u64,
}

impl MeshFrame {
    /// The picture of nothing.
    pub fn of_nothing(size: UVec2) -> MeshFrame {
        MeshFrame { pixels: Image::transparent(size), timing: Timing::default(), uploaded_bytes: 0 }
    }

    /// Linear, premultiplied RGBA: opaque where the mesh is.
    pub fn image(&self) -> Image<f32> {
        let mut image = self.pixels.clone();
        for pixel in image.pixels_mut() {
            pixel[3] = if pixel[3] > 0.0 { 1.0 } else { 0.0 };
        }
        image
    }
}

/// Draws meshes.
pub trait MeshBackend {
    /// Draws a mesh. A mesh that was drawn last stays on the device.
    ///
    /// # Errors
    /// As [`Backend::render`](crate::Backend::render).
    fn render_mesh(&mut self, plan: &MeshPlan) -> Result<MeshFrame, RenderError>;
}
