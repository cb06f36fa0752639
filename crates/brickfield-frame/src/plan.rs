//! The frame plan: one frame as plain data.

use std::sync::Arc;

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{Aabb, TransferFunction};

use crate::{
    Beams, BrickSet, Feature, FeatureSet, IndexGrid, Occupancy, ProxyGeometry, RayFrame, SampleFormat, Sampling,
    ValueScale,
};

/// Everything that a backend needs for one frame, and nothing that this frame does not need.
#[derive(Clone, Debug)]
pub struct FramePlan {
    /// Samples of the volume along x, y, z.
    pub dims: UVec3,
    /// The rays, in sample space.
    pub rays: RayFrame,
    /// The part of sample space that is integrated (the volume's box cut by the clip box); may be empty.
    pub domain: Aabb,
    /// A box in sample space around everything visible; empty if nothing is.
    pub visible: Aabb,
    /// Step, rule and mode.
    pub sampling: Sampling,
    /// Extinction per world unit and colour over data values.
    pub transfer: TransferFunction,
    /// From a position to its brick.
    pub index: IndexGrid,
    /// The samples of the bricks in the index.
    pub bricks: Arc<BrickSet>,
    /// Which macrocells of those bricks are dark; `None` where nothing inside a brick is leapt over.
    pub occupancy: Option<Arc<Occupancy>>,
    /// Where the rays of each tile may see something; `None` where each finds its own way.
    pub beams: Option<Arc<Beams>>,
    /// The polygons on which the samples are rasterised; `None` where rays are cast. Backends without a rasteriser cast rays to
    /// the same samples.
    pub proxy: Option<Arc<ProxyGeometry>>,
    /// What the frame needs of a shader.
    pub features: FeatureSet,
}

impl FramePlan {
    /// The last sample of the volume, in sample space: positions are clamped to [0, last].
    pub fn last_sample(&self) -> DVec3 {
        (self.dims - 1).as_dvec3()
    }

    /// The part of the domain that belongs to the block of an index cell, relative to the frame's centre.
    pub fn block_box(&self, cell: UVec3) -> Aabb {
        let n_cells = f64::from(self.bricks.side().n_cells());
        let level = self.index.at(cell).level();
        let low = cell >> u32::from(level.0) << u32::from(level.0);
        let high = low + level.stride();
        let owned = Aabb {
            min: DVec3::select(low.cmpeq(UVec3::ZERO), DVec3::NEG_INFINITY, low.as_dvec3() * n_cells),
            max: DVec3::select(high.cmpge(self.index.dims()), DVec3::INFINITY, high.as_dvec3() * n_cells),
        };
        let b = owned.intersection(&self.domain);
        Aabb { min: b.min - self.rays.center, max: b.max - self.rays.center }
    }

    /// How f32 arithmetic counts data values.
    pub fn value_scale(&self) -> ValueScale {
        ValueScale::of(&self.transfer, self.bricks.decode())
    }

    /// Whether shaders turn what they read of a texture back into the integers that were stored: 16-bit samples where
    /// no hardware filters them. Of a fraction in [0, 1], f32 has too few digits left for what lies between two of them.
    pub fn reads_integers(&self) -> bool {
        self.bricks.format() == SampleFormat::Unorm16 && !self.features.contains(Feature::HardwareFilter)
    }

    /// Width and height of the picture, in pixels.
    pub fn size(&self) -> UVec2 {
        self.rays.size
    }
}
