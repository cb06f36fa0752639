//! The plan's numbers as shaders read them.
//!
//! The layouts are held against naga's member offsets by a test of `brickfield-shaders`.

use brickfield_core::Knot;
use brickfield_core::glam::{DVec3, UVec3};
use bytemuck::{Pod, Zeroable};

use crate::{AtlasShape, FramePlan, Pass};

/// The frame's uniform block; every member is 16 bytes. Positions are in sample space relative to `RayFrame::center`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FrameUniforms {
    /// Anchor of the picture's centre; w: distance of that anchor past the start.
    pub anchor: [f32; 4],
    /// Change of the anchor a pixel to the right; w: side of a pixel in the plane at distance 1 (0: parallel rays).
    pub anchor_right: [f32; 4],
    /// Change of the anchor a pixel down; w: distance from the eye to the plane of the anchors.
    pub anchor_down: [f32; 4],
    /// Direction of the picture's centre, voxels per world unit; w: least parameter (0 or minus the start).
    pub direction: [f32; 4],
    /// Change of the direction a pixel to the right; w: nominal step in world units.
    pub direction_right: [f32; 4],
    /// Change of the direction a pixel down; w: transmittance floor.
    pub direction_down: [f32; 4],
    /// Lower corner of the domain; w: scale from a sample as it is read to a number of [`ValueScale`](crate::ValueScale).
    pub domain_min: [f32; 4],
    /// Upper corner of the domain; w: offset of the same.
    pub domain_max: [f32; 4],
    /// Lower corner of what is visible; w: cells along a brick's side.
    pub visible_min: [f32; 4],
    /// Upper corner of what is visible; w: first segment of the pass.
    pub visible_max: [f32; 4],
    /// Sample space's origin, relative to the centre; w: end of the pass's segments.
    pub origin: [f32; 4],
    /// The last sample, relative to the centre; w: the stored integer from which samples are counted
    /// ([`FramePlan::reads_integers`]).
    pub last_sample: [f32; 4],
    /// Cells of the index grid; w: number of knots.
    pub index_dims: [u32; 4],
    /// Bricks of the atlas along x, y, z; w: samples along a brick's side.
    pub atlas_bricks: [u32; 4],
    /// Width and height of the picture; z: first row of the pass; w: pixels along a beam's tile (1 without beams).
    pub size: [u32; 4],
    /// The first object-aligned planes that rays towards greater coordinates meet; w: pixels along a facet's side.
    pub planes_low: [f32; 4],
    /// The first that rays towards smaller coordinates meet; w: squares of facets in a row of the picture.
    pub planes_high: [f32; 4],
    /// Distance between planes a voxel apart, in world units; w: reserved.
    pub voxel_world: [f32; 4],
}

/// A transfer function's knot.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct KnotUniform {
    /// Straight linear RGB; w: extinction per world unit.
    pub optics: [f32; 4],
    /// x: data value as a number of [`ValueScale`](crate::ValueScale); y: reciprocal of the distance to the next knot (0 at the last and before a
    /// jump's second knot); z, w: reserved.
    pub value: [f32; 4],
}

impl FrameUniforms {
    /// The uniform block of a plan whose bricks lie in an atlas of `atlas`, for a frame in one pass.
    pub fn of(plan: &FramePlan, atlas: AtlasShape) -> FrameUniforms {
        let rays = &plan.rays;
        let n_cells = f64::from(plan.bricks.side().n_cells());
        let samples = SampleScale::of(plan);
        let whole = Pass::whole_rays(0..rays.size.y);
        let relative = |p: DVec3| p - rays.center;
        FrameUniforms {
            anchor: float4(rays.anchor[0], rays.anchor_past_start),
            anchor_right: float4(rays.anchor[1], rays.pixel),
            anchor_down: float4(rays.anchor[2], rays.anchor_depth),
            direction: float4(rays.direction[0], 0.0 - rays.start),
            direction_right: float4(rays.direction[1], plan.sampling.step_world()),
            direction_down: float4(rays.direction[2], plan.sampling.transmittance_floor()),
            domain_min: float4(relative(plan.domain.min), samples.scale),
            domain_max: float4(relative(plan.domain.max), samples.offset),
            visible_min: float4(relative(plan.visible.min), n_cells),
            visible_max: float4(relative(plan.visible.max), 0.0),
            origin: float4(-rays.center, 0.0),
            last_sample: float4(relative(plan.last_sample()), samples.counted_from),
            index_dims: uint4(plan.index.dims(), plan.transfer.knots().len() as u32),
            atlas_bricks: uint4(atlas.bricks, plan.bricks.side().n_samples()),
            size: [rays.size.x, rays.size.y, 0, plan.beams.as_ref().map_or(1, |b| b.tile_side())],
            planes_low: float4(rays.planes.low, f64::from(rays.facet_pixels())),
            planes_high: float4(rays.planes.high, f64::from(rays.facet_squares().x)),
            voxel_world: float4(rays.planes.voxel_world, 0.0),
        }
        .in_pass(&whole)
    }

    /// The uniform block for one pass.
    #[must_use]
    pub fn in_pass(mut self, pass: &Pass) -> FrameUniforms {
        self.visible_max[3] = pass.segments.start;
        self.origin[3] = pass.segments.end;
        self.size[2] = pass.rows.start;
        self
    }
}

impl KnotUniform {
    /// The knots of a plan's transfer function.
    pub fn of(plan: &FramePlan) -> Vec<KnotUniform> {
        let (knots, values) = (plan.transfer.knots(), plan.value_scale());
        let reciprocal = |i: usize| match knots.get(i + 1) {
            Some(next) if next.value > knots[i].value => values.unit() / (next.value - knots[i].value),
            _ => 0.0,
        };
        knots.iter().enumerate().map(|(i, k)| knot(k, values.number(k.value), reciprocal(i))).collect()
    }
}

/// From samples as shaders read them to numbers of the value scale: (read - counted_from) * scale + offset.
struct SampleScale {
    counted_from: f64,
    scale: f64,
    offset: f64,
}

impl SampleScale {
    fn of(plan: &FramePlan) -> SampleScale {
        let (decode, values) = (plan.bricks.decode(), plan.value_scale());
        let (scale, offset) = (decode.scale / values.unit(), values.number(decode.offset));
        if !plan.reads_integers() {
            return SampleScale { counted_from: 0.0, scale, offset };
        }
        let counted_from = plan.bricks.nearest_stored(values.origin());
        let scale = scale / plan.bricks.format().unit();
        SampleScale { counted_from, scale, offset: offset + counted_from * scale }
    }
}

fn knot(k: &Knot, value: f64, reciprocal: f64) -> KnotUniform {
    let [r, g, b] = k.color.map(|c| c as f32);
    KnotUniform { optics: [r, g, b, k.extinction as f32], value: [value as f32, reciprocal as f32, 0.0, 0.0] }
}

fn float4(v: DVec3, w: f64) -> [f32; 4] {
    [v.x as f32, v.y as f32, v.z as f32, w as f32]
}

fn uint4(v: UVec3, w: u32) -> [u32; 4] {
    [v.x, v.y, v.z, w]
}
