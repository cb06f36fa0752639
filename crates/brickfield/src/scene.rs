//! What to render, as plain data.

use brickfield_core::glam::UVec2;
use brickfield_core::{Aabb, Camera, TransferFunction};
use brickfield_frame::Mode;
use brickfield_lod::Criterion;
use brickfield_optics::QuadratureRule;

/// What to render: everything but the volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Where the picture is taken from.
    pub camera: Camera,
    /// Width and height of the picture, in pixels.
    pub size: UVec2,
    /// Extinction per world unit and colour over data values.
    pub transfer: TransferFunction,
    /// Distance between samples, in units of the volume's least spacing.
    pub step_voxels: f64,
    /// How a segment is integrated.
    pub rule: QuadratureRule,
    /// Exact or fast.
    pub mode: Mode,
    /// Which resolution each part is drawn from: the coarsest that satisfies all; none asks for the coarsest of all.
    pub detail: Vec<Criterion>,
    /// The part of the volume that is shown, in index space; `None` is all of it.
    pub clip: Option<Aabb>,
    /// Whether transparent bricks are left out.
    pub skipping: Skipping,
}

/// Whether bricks that contribute nothing are left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Skipping {
    /// They are neither uploaded nor sampled.
    #[default]
    On,
    /// Every brick of the cut is uploaded and sampled: to measure what skipping saves.
    Off,
}

impl Scene {
    /// A scene with the defaults: midpoint rule, exact mode, half a voxel a step, full resolution, no clipping, skipping.
    pub fn new(camera: Camera, size: UVec2, transfer: TransferFunction) -> Scene {
        Scene {
            camera,
            size,
            transfer,
            step_voxels: 0.5,
            rule: QuadratureRule::MidpointExponential,
            mode: Mode::Exact,
            detail: vec![Criterion::FullResolution],
            clip: None,
            skipping: Skipping::On,
        }
    }
}
