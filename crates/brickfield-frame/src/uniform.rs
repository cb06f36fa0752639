//! The plan's numbers as shaders read them.
//!
//! The layouts are held against naga's member offsets by a test of `brickfield-shaders`.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Knot, Place, TransferFunction};
use bytemuck::{Pod, Zeroable};

use crate::{AtlasShape, CellsPlan, FramePlan, Handedness, KnotTable, Pass, Sampling, ValueScale};

/// The frame's uniform block: vectors of three, each followed by an unrelated number. Positions are in
/// sample space relative to `RayFrame::center`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FrameUniforms {
    /// Anchor of the picture's centre.
    pub anchor: [f32; 3],
    /// Distance of that anchor past the start.
    pub anchor_past_start: f32,
    /// Change of the anchor a pixel to the right.
    pub anchor_right: [f32; 3],
    /// Side of a pixel in the plane at distance 1 (0: parallel rays).
    pub pixel_side: f32,
    /// Change of the anchor a pixel down.
    pub anchor_down: [f32; 3],
    /// Distance from the eye to the plane of the anchors.
    pub anchor_depth: f32,
    /// Direction of the picture's centre, voxels per world unit.
    pub direction: [f32; 3],
    /// Least parameter (0 or minus the start).
    pub least_parameter: f32,
    /// Change of the direction a pixel to the right.
    pub direction_right: [f32; 3],
    /// Nominal step in world units.
    pub step_world: f32,
    /// Change of the direction a pixel down.
    pub direction_down: [f32; 3],
    /// The optical depth beyond which rays end.
    pub end_depth: f32,
    /// Lower corner of the domain.
    pub domain_min: [f32; 3],
    /// Scale from a sample as it is read to a number of [`ValueScale`](crate::ValueScale).
    pub sample_scale: f32,
    /// Upper corner of the domain.
    pub domain_max: [f32; 3],
    /// Offset of the same.
    pub sample_offset: f32,
    /// Lower corner of the visible box.
    pub visible_min: [f32; 3],
    /// Samples of level 0 along an index cell's side.
    pub cell_samples: f32,
    /// Upper corner of the visible box.
    pub visible_max: [f32; 3],
    /// First segment of the pass.
    pub first_segment: f32,
    /// The first sample.
    pub first_sample: [f32; 3],
    /// End of the pass's segments.
    pub end_segment: f32,
    /// The last sample.
    pub last_sample: [f32; 3],
    /// The stored integer from which samples are counted ([`FramePlan::reads_integers`]).
    pub counted_from: f32,
    /// Where the first index cell begins.
    pub index_origin: [f32; 3],
    /// Steps of level 0 between two samples of a field that is one array of samples.
    pub dense_stride: f32,
    /// Cells of the index.
    pub index_dims: [u32; 3],
    /// Number of knots.
    pub n_knots: u32,
    /// Bricks of the atlas along x, y, z.
    pub atlas_bricks: [u32; 3],
    /// Samples along a brick's side.
    pub brick_samples: u32,
    /// The first object-aligned planes that rays towards greater coordinates meet.
    pub planes_low: [f32; 3],
    /// Scale from a spread as it is read to one in units of the value scale; 0 without spreads.
    pub spread_scale: f32,
    /// The first that rays towards smaller coordinates meet.
    pub planes_high: [f32; 3],
    /// Bins of the [`KnotTable`] per number of the value scale.
    pub bins_per_value: f32,
    /// Distance between planes a voxel apart, in world units.
    pub voxel_world: [f32; 3],
    /// Nothing.
    pub padding: f32,
    /// Width and height of the picture.
    pub size: [u32; 2],
    /// First row of the pass.
    pub first_row: u32,
    /// Pixels along a beam's tile (1 without beams).
    pub beam_pixels: u32,
    /// Pixels along a facet's side.
    pub facet_pixels: u32,
    /// Squares of facets in a row of the picture.
    pub facet_columns: u32,
    /// Whether rays go on with what they have seen before: 1, else 0.
    pub goes_on: u32,
    /// Rows of the picture from the first one in the list of what rays have seen to the first of the pass.
    pub seen_row: u32,
}

/// A transfer function of so many knots is few numbers: shaders compare with each of them, and look nothing up.
pub const FEW_KNOTS: usize = 8;

/// A transfer function's knot.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct KnotUniform {
    /// Straight linear RGB, and extinction per world unit.
    pub optics: [f32; 4],
    /// Data value as a number of [`ValueScale`](crate::ValueScale).
    pub value: f32,
    /// Reciprocal of the distance to the next knot (0 at the last and before a jump's second knot).
    pub per_value: f32,
    /// Knots where searches in bins 2 i and 2 i + 1 of a [`KnotTable`] begin; i is this knot's number.
    pub begins: [f32; 2],
}

/// A [`Place`] as shaders read it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PlaceUniform {
    /// First texel.
    pub texel: [u32; 3],
    /// Level.
    pub level: u32,
    /// The first sample's position, in sample space.
    pub first: [f32; 3],
    /// Nothing.
    pub padding: f32,
    /// The last sample along the axes of space, in the slot's own samples.
    pub last: [u32; 3],
    /// The axes of space that the texture's axes run along, two bits each, from the lowest.
    pub axes: u32,
}

impl FrameUniforms {
    /// The uniform block of a plan whose bricks lie in an atlas of `atlas`, for a frame in one pass.
    pub fn of(plan: &FramePlan, atlas: AtlasShape) -> FrameUniforms {
        let (rays, field) = (&plan.rays, &plan.field);
        let lattice = field.index().lattice();
        let samples = SampleScale::of(plan);
        let whole = Pass::whole_rays(0..rays.size.y);
        let relative = |p: DVec3| float3(p - rays.center);
        FrameUniforms {
            anchor: float3(rays.anchor[0]),
            anchor_past_start: rays.anchor_past_start as f32,
            anchor_right: float3(rays.anchor[1]),
            pixel_side: rays.pixel as f32,
            anchor_down: float3(rays.anchor[2]),
            anchor_depth: rays.anchor_depth as f32,
            direction: float3(rays.direction[0]),
            least_parameter: (0.0 - rays.start) as f32,
            direction_right: float3(rays.direction[1]),
            step_world: plan.sampling.step_world() as f32,
            direction_down: float3(rays.direction[2]),
            end_depth: end_depth(&plan.sampling),
            domain_min: relative(plan.domain.min),
            sample_scale: samples.scale as f32,
            domain_max: relative(plan.domain.max),
            sample_offset: samples.offset as f32,
            visible_min: relative(plan.visible.min),
            cell_samples: lattice.cell_samples as f32,
            visible_max: relative(plan.visible.max),
            first_segment: 0.0,
            first_sample: float3(-rays.center),
            end_segment: 0.0,
            last_sample: relative(field.last_sample()),
            counted_from: samples.counted_from as f32,
            index_origin: relative(DVec3::splat(lattice.origin)),
            beam_pixels: plan.beams.as_ref().map_or(1, |b| b.tile_side()),
            index_dims: field.index().dims().to_array(),
            n_knots: plan.transfer.knots().len() as u32,
            atlas_bricks: atlas.bricks.to_array(),
            brick_samples: atlas.side.n_samples(),
            size: rays.size.to_array(),
            first_row: 0,
            facet_pixels: rays.facet_pixels(),
            planes_low: float3(rays.planes.low),
            facet_columns: rays.facet_squares().x,
            planes_high: float3(rays.planes.high),
            voxel_world: float3(rays.planes.voxel_world),
            dense_stride: field.dense_level().map_or(1.0, |level| level.stride() as f32),
            spread_scale: plan.spreads().map_or(0.0, |slots| (slots.decode().scale / plan.value_scale().unit()) as f32),
            bins_per_value: KnotTable::bins_per_value_of(&plan.transfer, plan.value_scale()),
            padding: 0.0,
            goes_on: 0,
            seen_row: 0,
        }
        .in_pass(&whole)
    }

    /// The uniform block of a picture of cells, as far as their shader reads it. Lengths are in [`CellsPlan::unit`]s: a position is one over
    /// the unit from the cells' centre. The numbers of the index are those of cells; that of a voxel is the unit, and behind it 1, or -1 if the
    /// cells are left-handed.
    pub fn of_cells(plan: &CellsPlan) -> FrameUniforms {
        let (rays, cells, unit) = (plan.rays(), plan.cells(), plan.unit());
        let (step, values) = (plan.sampling().step_world(), plan.value_scale());
        let is_parallel = rays.are_parallel();
        let start = plan.start();
        // Values are counted from a number of f32 near the origin: the difference keeps their digits.
        let counted_from = values.origin() as f32;
        let handedness = match cells.handedness() {
            Handedness::Right => 1.0,
            Handedness::Left => -1.0,
        };
        FrameUniforms {
            anchor: float3(rays.anchor[0] / unit),
            anchor_past_start: ((rays.anchor_depth - start) / unit) as f32,
            anchor_right: float3(rays.anchor[1] / unit),
            pixel_side: if is_parallel { 0.0 } else { rays.pixel[0].length() as f32 },
            anchor_down: float3(rays.anchor[2] / unit),
            anchor_depth: if is_parallel { 0.0 } else { (rays.anchor_depth / unit) as f32 },
            direction: float3(rays.direction[0]),
            least_parameter: (-start / unit) as f32,
            direction_right: float3(rays.direction[1]),
            step_world: (step / unit) as f32,
            direction_down: float3(rays.direction[2]),
            end_depth: end_depth(plan.sampling()),
            sample_scale: values.unit().recip() as f32,
            sample_offset: ((f64::from(counted_from) - values.origin()) / values.unit()) as f32,
            counted_from,
            index_dims: cells.n_cells().to_array(),
            n_knots: plan.transfer().knots().len() as u32,
            bins_per_value: KnotTable::bins_per_value_of(plan.transfer(), values),
            voxel_world: [unit as f32, handedness, 0.0],
            size: rays.size.to_array(),
            ..FrameUniforms::zeroed()
        }
        .in_pass(&Pass::whole_rays(0..rays.size.y))
    }

    /// The uniform block for one pass.
    #[must_use]
    pub fn in_pass(mut self, pass: &Pass) -> FrameUniforms {
        self.first_segment = pass.segments.start;
        self.end_segment = pass.segments.end;
        self.first_row = pass.rows.start;
        self.goes_on = u32::from(pass.goes_on);
        self.seen_row = pass.rows.start - pass.first_seen_row;
        self
    }
}

impl KnotUniform {
    /// The knots of a plan's transfer function.
    pub fn of(plan: &FramePlan) -> Vec<KnotUniform> {
        KnotUniform::of_transfer(&plan.transfer, plan.value_scale())
    }

    /// The knots of the transfer function of a plan of cells.
    pub fn of_cells(plan: &CellsPlan) -> Vec<KnotUniform> {
        KnotUniform::of_transfer(plan.transfer(), plan.value_scale())
    }

    /// The first of some knots; behind the last, knots that no value reaches.
    pub fn few(knots: &[KnotUniform]) -> [KnotUniform; FEW_KNOTS] {
        let beyond = KnotUniform { value: f32::MAX, ..KnotUniform::zeroed() };
        std::array::from_fn(|i| knots.get(i).copied().unwrap_or(beyond))
    }

    fn of_transfer(transfer: &TransferFunction, values: ValueScale) -> Vec<KnotUniform> {
        let knots = transfer.knots();
        let reciprocal = |i: usize| match knots.get(i + 1) {
            Some(next) if next.value > knots[i].value => values.unit() / (next.value - knots[i].value),
            _ => 0.0,
        };
        let table = KnotTable::of(transfer, values);
        let begins = table.begins().chunks_exact(2).map(|bins| [bins[0] as f32, bins[1] as f32]);
        let knots = knots.iter().enumerate().map(|(i, k)| knot(k, values.number(k.value), reciprocal(i)));
        knots.zip(begins).map(|(knot, begins)| KnotUniform { begins, ..knot }).collect()
    }
}

impl PlaceUniform {
    /// A place.
    pub fn of(place: &Place) -> PlaceUniform {
        let [x, y, z] = place.axes.of_texture().map(|axis| axis as u32);
        PlaceUniform {
            texel: place.texel.to_array(),
            level: u32::from(place.level.0),
            first: float3(place.first),
            padding: 0.0,
            last: (place.n_in_space() - UVec3::ONE).to_array(),
            axes: x | y << 2 | z << 4,
        }
    }
}

/// The optical depth beyond which less than the transmittance floor shines through.
fn end_depth(sampling: &Sampling) -> f32 {
    (-sampling.transmittance_floor().ln()).min(f64::from(f32::MAX)) as f32
}

/// From samples as shaders read them to numbers of the value scale: (read - counted_from) * scale + offset.
struct SampleScale {
    counted_from: f64,
    scale: f64,
    offset: f64,
}

impl SampleScale {
    fn of(plan: &FramePlan) -> SampleScale {
        let (slots, values) = (plan.field.slots(), plan.value_scale());
        let decode = slots.decode();
        let (scale, offset) = (decode.scale / values.unit(), values.number(decode.offset));
        if !plan.reads_integers() {
            return SampleScale { counted_from: 0.0, scale, offset };
        }
        let counted_from = slots.nearest_stored(values.origin());
        let scale = scale / slots.format().unit();
        SampleScale { counted_from, scale, offset: offset + counted_from * scale }
    }
}

fn knot(k: &Knot, value: f64, per_value: f64) -> KnotUniform {
    let [r, g, b] = k.color.map(|c| c as f32);
    let optics = [r, g, b, k.extinction as f32];
    KnotUniform { optics, value: value as f32, per_value: per_value as f32, begins: [0.0; 2] }
}

fn float3(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}
