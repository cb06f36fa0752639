//! Plans built by hand: a volume cut into bricks, each of a level that the test chooses.
#![allow(dead_code, unreachable_pub)]

use std::sync::Arc;

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{
    Aabb, BrickId, BrickLayout, BrickSide, Camera, Grid, Knot, Level, Projection, ScalarType, TransferFunction, Volume,
};
use brickfield_frame::{
    Chunk, DarkRegions, DarkRuns, Decode, Division, Drawing, Field, FramePlan, IndexEntry, IndexGrid, IndexLattice,
    Join, Lengths, MacrocellRanges, Mode, Occupancy, Placement, Places, PlanParts, RayFrame, Reach, SampleFormat,
    Sampling, Sequence, Slots, Steps,
};
use brickfield_optics::QuadratureRule;

/// What a plan is made from.
pub struct Setup<'a> {
    pub volume: &'a Volume,
    pub side: BrickSide,
    pub transfer: TransferFunction,
    pub camera: Camera,
    pub size: UVec2,
    pub clip: Aabb,
    pub step_world: f64,
    pub rule: QuadratureRule,
    pub mode: Mode,
    pub placement: Placement,
    pub division: Division,
    pub lengths: Lengths,
    /// Level of the coarsest block wanted around an index cell.
    pub level: &'a dyn Fn(UVec3) -> u8,
    /// Whether transparent bricks are left out.
    pub skip: Skip,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Skip {
    Nothing,
    Transparent,
}

/// The box of the whole volume in sample space.
pub fn whole(volume: &Volume) -> Aabb {
    Aabb { min: DVec3::splat(-0.5), max: volume.grid().dims().as_dvec3() - 0.5 }
}

pub fn framing(volume: &Volume, from: DVec3) -> Camera {
    Camera::framing(&volume.grid().world_box(), from, DVec3::new(0.1, 0.2, 1.0)).unwrap()
}

pub fn orthographic(volume: &Volume, from: DVec3) -> Camera {
    let b = volume.grid().world_box();
    let projection = Projection::Orthographic { height: b.diagonal() };
    Camera::look_at(b.center() + from.normalize() * b.diagonal(), b.center(), DVec3::new(0.1, 0.2, 1.0), projection)
        .unwrap()
}

pub fn knot(value: f64, extinction: f64, color: [f64; 3]) -> Knot {
    Knot { value, extinction, color }
}

impl<'a> Setup<'a> {
    pub fn new(volume: &'a Volume, transfer: TransferFunction) -> Setup<'a> {
        Setup {
            volume,
            side: BrickSide::S16,
            transfer,
            camera: framing(volume, DVec3::new(1.0, 0.7, 0.4)),
            size: UVec2::new(24, 20),
            clip: whole(volume),
            step_world: 0.5,
            rule: QuadratureRule::MidpointExponential,
            mode: Mode::Exact,
            placement: Placement::Shells,
            division: Division::Ray,
            lengths: Lengths::True,
            level: &|_| 0,
            skip: Skip::Nothing,
        }
    }

    pub fn plan(&self) -> FramePlan {
        FramePlan::new(self.parts()).unwrap()
    }

    pub fn parts(&self) -> PlanParts {
        let sampling = Sampling::new(self.step_world, self.rule, self.mode).unwrap();
        let sampling = sampling.divided(self.division).weighted(self.lengths).unwrap();
        let steps = Steps::of(&sampling, self.placement, Level(3)).unwrap();
        let volume_box = whole(self.volume);
        let field = cut(self);
        let dark = match self.skip {
            Skip::Nothing => DarkRegions::default(),
            Skip::Transparent => DarkRegions::new(&field, occupancy(&field, &self.transfer)).unwrap(),
        };
        PlanParts {
            field,
            rays: RayFrame::new(&self.camera, self.volume.grid(), self.size, &volume_box, &steps),
            domain: volume_box.intersection(&self.clip),
            sampling,
            transfer: self.transfer.clone(),
            lighting: None,
            dark,
            drawing: Drawing::Rays,
            sequence: Sequence::Whole,
        }
    }
}

/// The bricks of a setup; without the transparent ones, if they are skipped.
fn cut(setup: &Setup) -> Field {
    let layout = BrickLayout::new(setup.volume.grid().dims(), setup.side);
    let (format, decode) = SampleFormat::encoding(setup.volume.scalar_type(), setup.volume.range());
    let (mut entries, mut bricks) = (Vec::new(), Vec::new());
    for id in chosen(&layout, setup.level) {
        let (cell, reach) = (id.coords << u32::from(id.level.0), Reach::of_brick(id.level));
        let (stored, transparent) = brick(setup, &layout, id, format, decode);
        if transparent && setup.skip == Skip::Transparent {
            entries.push((cell, IndexEntry::Empty { reach }));
            continue;
        }
        entries.push((cell, IndexEntry::Resident { slot: bricks.len() as u32, reach }));
        bricks.push(Some(Arc::new(Chunk::new(stored))));
    }
    let lattice = IndexLattice { cell_samples: setup.side.n_cells(), origin: 0.0 };
    let index = IndexGrid::new(layout.n_bricks(Level(0)), lattice, entries);
    let slots = Slots::new(format, decode, Places::Even(setup.side), bricks).unwrap();
    Field::new(layout.dims(), Arc::new(index), Arc::new(slots), Join::Shared).unwrap()
}

/// Which macrocells of a field's bricks are dark.
fn occupancy(field: &Field, transfer: &TransferFunction) -> Option<Arc<Occupancy>> {
    let slots = field.slots();
    let side = slots.brick_side()?;
    let dark = DarkRuns::of_transfer(transfer, slots.format(), slots.decode());
    let distances =
        |chunk: &Arc<Chunk>| Arc::new(MacrocellRanges::of(side, slots.format(), chunk.bytes()).distances(&dark));
    Occupancy::new(side, slots.all_samples().iter().map(|chunk| chunk.as_ref().map(distances)).collect())
}

/// The bricks of a cut: for each index cell the coarsest brick that all its cells allow.
fn chosen(layout: &BrickLayout, level: &dyn Fn(UVec3) -> u8) -> Vec<BrickId> {
    let mut bricks = Vec::new();
    descend(layout, layout.root(), level, &mut bricks);
    bricks
}

fn descend(layout: &BrickLayout, id: BrickId, level: &dyn Fn(UVec3) -> u8, bricks: &mut Vec<BrickId>) {
    if level(id.coords << u32::from(id.level.0)) >= id.level.0 {
        bricks.push(id);
        return;
    }
    for child in layout.children(id) {
        descend(layout, child, level, bricks);
    }
}

fn brick(setup: &Setup, layout: &BrickLayout, id: BrickId, format: SampleFormat, decode: Decode) -> (Vec<u8>, bool) {
    let n = layout.side().n_samples();
    let dims = layout.dims();
    let origin = id.coords * (n - 1);
    let (mut bytes, mut min, mut max) = (Vec::new(), f64::MAX, f64::MIN);
    for i in 0..n * n * n {
        let local = UVec3::new(i % n, i / n % n, i / (n * n));
        let p = ((origin + local) << u32::from(id.level.0)).min(dims - 1);
        let at = p.x as usize + dims.x as usize * (p.y as usize + dims.y as usize * p.z as usize);
        let value = setup.volume.value(at);
        (min, max) = (min.min(value), max.max(value));
        let stored = (value - decode.offset) / decode.scale * format.unit();
        match format {
            SampleFormat::Unorm8 => bytes.push(stored.round() as u8),
            SampleFormat::Unorm16 => bytes.extend((stored.round() as u16).to_le_bytes()),
            SampleFormat::Float32 => bytes.extend((stored as f32).to_le_bytes()),
            SampleFormat::Unorm8x4 => unreachable!("values are single numbers"),
        }
    }
    (bytes, setup.transfer.is_transparent(brickfield_core::ValueRange { min, max }))
}

/// A volume whose sample (i, j, k) has the value `f(i, j, k)`, in one of the scalar types.
pub fn volume(dims: [u32; 3], spacing: DVec3, scalar: ScalarType, f: impl Fn(DVec3) -> f64) -> Volume {
    on_grid(Grid::axis_aligned(UVec3::from(dims), spacing).unwrap(), scalar, f)
}

pub fn on_grid(grid: Grid, scalar: ScalarType, f: impl Fn(DVec3) -> f64) -> Volume {
    let d = grid.dims();
    let at = |i: usize| {
        let i = i as u32;
        f(UVec3::new(i % d.x, i / d.x % d.y, i / (d.x * d.y)).as_dvec3())
    };
    let values = (0..grid.n_voxels()).map(at);
    let made = match scalar {
        ScalarType::U8 => Volume::new(grid, values.map(|v| v.round() as u8).collect::<Vec<_>>()),
        ScalarType::I16 => Volume::new(grid, values.map(|v| v.round() as i16).collect::<Vec<_>>()),
        ScalarType::U16 => Volume::new(grid, values.map(|v| v.round() as u16).collect::<Vec<_>>()),
        ScalarType::F64 => Volume::new(grid, values.collect::<Vec<f64>>()),
        _ => Volume::new(grid, values.map(|v| v as f32).collect::<Vec<_>>()),
    };
    made.unwrap()
}

/// Greatest difference of two pixels over their channels.
pub fn difference(a: [f64; 4], b: [f64; 4]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}
