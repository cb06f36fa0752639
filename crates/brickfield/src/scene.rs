//! A scene to render, as plain data.

use brickfield_core::glam::UVec2;
use brickfield_core::{Aabb, Camera, TransferFunction};
use brickfield_frame::{Division, Lengths, Mode, Placement, Target, Upload};
use brickfield_lod::{Criterion, Culling, View};
use brickfield_optics::{Light, QuadratureRule};

/// A scene to render: everything but the volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Where the picture is taken from.
    pub camera: Camera,
    /// Width and height of the picture, in pixels.
    pub size: UVec2,
    /// Extinction per world unit and colour over data values.
    pub transfer: TransferFunction,
    /// The light on surfaces; `None` where the medium only emits.
    pub light: Option<Light>,
    /// Distance between samples, in units of the volume's least spacing.
    pub step_voxels: f64,
    /// How a segment is integrated.
    pub rule: QuadratureRule,
    /// Exact or fast.
    pub mode: Mode,
    /// Between which surfaces segments lie.
    pub placement: Placement,
    /// The span that is divided into segments: a ray's way through the domain, or through each brick by its level's steps.
    pub division: Division,
    /// For which length the light through a sample is computed.
    pub lengths: Lengths,
    /// Which resolution each part is drawn from: the coarsest that satisfies all; none asks for the coarsest of all.
    pub detail: Vec<Criterion>,
    /// The part of the volume that is shown, in index space; `None` is all of it.
    pub clip: Option<Aabb>,
    /// Whether transparent bricks are left out.
    pub skipping: Skipping,
    /// How backends that can do both make the picture.
    pub technique: Technique,
    /// Draft while the camera moves, final when it rests.
    pub quality: Quality,
    /// How samples are brought to a device: as they are, or packed.
    pub upload: Upload,
}

/// How much of a frame's time is spent on its looks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// The scene as it is stated.
    #[default]
    Final,
    /// Steps of [`Quality::DRAFT_STEPS`] times the length, and of flat blocks the nearest one alone. The same samples stay
    /// resident: nothing is brought to a device when quality changes.
    Draft,
}

impl Quality {
    /// Steps of a final frame in one of a draft.
    pub const DRAFT_STEPS: f64 = 2.0;

    /// The distance between samples, for one that the scene states.
    pub(crate) fn step(self, step_voxels: f64) -> f64 {
        match self {
            Quality::Final => step_voxels,
            Quality::Draft => Quality::DRAFT_STEPS * step_voxels,
        }
    }
}

/// How the samples of a frame are made into a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Technique {
    /// Rays are cast, front to back.
    #[default]
    RayCasting,
    /// Polygons between which the same segments lie are rasterised and blended, back to front (LaMar, Hamann and Joy 1999,
    /// section 4.2). They are clipped to bricks: for [`Division::Brick`], and surfaces with facets. The cpu backend casts rays
    /// to the same samples.
    Polygons(Target),
}

/// Whether bricks that contribute nothing are left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Skipping {
    /// They are neither uploaded nor sampled.
    #[default]
    On,
    /// Every brick of the cut is uploaded and sampled: to measure the gain of skipping.
    Off,
}

impl Scene {
    /// A scene with the defaults: no light, midpoint rule, exact mode, shells of whole rays, half a voxel a step, full resolution, no clipping, skipping, plain samples.
    pub fn new(camera: Camera, size: UVec2, transfer: TransferFunction) -> Scene {
        Scene {
            camera,
            size,
            transfer,
            light: None,
            step_voxels: 0.5,
            rule: QuadratureRule::MidpointExponential,
            mode: Mode::Exact,
            placement: Placement::Shells,
            division: Division::Ray,
            lengths: Lengths::True,
            detail: vec![Criterion::FullResolution],
            clip: None,
            skipping: Skipping::On,
            technique: Technique::RayCasting,
            quality: Quality::Final,
            upload: Upload::Plain,
        }
    }
    /// The view for which bricks are selected. Without skipping, bricks outside the view are kept, too.
    pub fn view(&self) -> View {
        let culling = match self.skipping {
            Skipping::On => Culling::Frustum,
            Skipping::Off => Culling::Off,
        };
        View { camera: self.camera, size: self.size, culling }
    }
}
