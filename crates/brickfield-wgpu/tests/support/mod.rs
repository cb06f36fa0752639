//! Plans made by hand: a field, its bricks, and a view of them.
#![allow(dead_code, unreachable_pub)]

use std::sync::Arc;

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{
    Aabb, BrickLayout, BrickSide, Camera, Grid, Knot, Level, Projection, TransferFunction, ValueRange,
};
use brickfield_frame::{
    Chunk, DarkRegions, Decode, Drawing, Field, FramePlan, IndexEntry, IndexGrid, IndexLattice, Join, Mode, Places,
    PlanParts, QuadratureRule, RayFrame, Reach, SampleFormat, Sampling, Sequence, Slots, Steps,
};
use brickfield_wgpu::{AdapterChoice, OpenError, WgpuBackend};

const SIDE: BrickSide = BrickSide::S16;

/// What a plan is made from: values over sample positions, and how they are looked at.
#[derive(Clone)]
pub struct Setup {
    pub dims: UVec3,
    pub value: fn(DVec3) -> f64,
    pub format: SampleFormat,
    pub transfer: TransferFunction,
    pub camera: Camera,
    pub size: UVec2,
    pub step: f64,
    pub rule: QuadratureRule,
    pub mode: Mode,
    /// The level of each cell of the index.
    pub level: fn(UVec3) -> Level,
    /// Whether transparent bricks are left out.
    pub skip: bool,
}

/// A backend, if this machine has one.
pub fn backend() -> Option<WgpuBackend> {
    match WgpuBackend::new(&AdapterChoice::Default) {
        Ok(backend) => Some(backend),
        Err(OpenError::NoAdapter) => {
            println!("no device");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

pub fn knot(value: f64, extinction: f64, color: [f64; 3]) -> Knot {
    Knot { value, extinction, color }
}

pub fn transfer(knots: &[Knot]) -> TransferFunction {
    TransferFunction::new(knots.to_vec()).unwrap()
}

/// Looks along x from a whole number of world units before the volume.
pub fn along_x(dims: UVec3) -> Camera {
    let target = dims.as_dvec3() * 0.5;
    let eye = DVec3::new(-20.0, target.y, target.z);
    Camera::look_at(eye, target, DVec3::Z, Projection::Orthographic { height: 0.5 * target.z }).unwrap()
}

pub fn oblique(dims: UVec3) -> Camera {
    let b = Aabb { min: DVec3::ZERO, max: dims.as_dvec3() };
    Camera::framing(&b, DVec3::new(1.0, -2.0, 0.7), DVec3::Z).unwrap()
}

impl Setup {
    pub fn new(dims: UVec3, value: fn(DVec3) -> f64, transfer: TransferFunction) -> Setup {
        Setup {
            dims,
            value,
            format: SampleFormat::Float32,
            transfer,
            camera: oblique(dims),
            size: UVec2::new(60, 44),
            step: 0.5,
            rule: QuadratureRule::MidpointExponential,
            mode: Mode::Exact,
            level: |_| Level(0),
            skip: false,
        }
    }

    pub fn plan(&self) -> FramePlan {
        FramePlan::new(self.parts()).unwrap()
    }

    pub fn parts(&self) -> PlanParts {
        let grid = Grid::axis_aligned(self.dims, DVec3::ONE).unwrap();
        let field = self.field();
        let domain = field.volume_box();
        PlanParts {
            field,
            rays: RayFrame::new(&self.camera, &grid, self.size, &domain, &Steps::shells(self.step)),
            domain,
            sampling: Sampling::new(self.step, self.rule, self.mode).unwrap(),
            transfer: self.transfer.clone(),
            lighting: None,
            dark: DarkRegions::default(),
            drawing: Drawing::Rays,
            sequence: Sequence::Whole,
        }
    }

    fn field(&self) -> Field {
        let layout = BrickLayout::new(self.dims, SIDE);
        let (mut entries, mut bricks) = (Vec::new(), Vec::new());
        for id in layout.bricks(Level(0)) {
            let level = (self.level)(id.coords);
            let (block, reach) = (id.ancestor(level), Reach::of_brick(level));
            if reach.block(id.coords).0 != id.coords {
                continue;
            }
            let samples = self.samples(block.coords.as_dvec3() * f64::from(15 * level.stride()), level);
            if self.skip && self.transfer.is_transparent(range(&samples)) {
                entries.push((id.coords, IndexEntry::Empty { reach }));
                continue;
            }
            entries.push((id.coords, IndexEntry::Resident { slot: bricks.len() as u32, reach }));
            let bytes: Vec<u8> = samples.iter().flat_map(|v| self.stored(*v)).collect();
            bricks.push(Some(Arc::new(Chunk::new(bytes))));
        }
        let lattice = IndexLattice { cell_samples: SIDE.n_cells(), origin: 0.0 };
        let index = IndexGrid::new(layout.n_bricks(Level(0)), lattice, entries);
        let decode = Decode { scale: 1.0, offset: 0.0 };
        let slots = Slots::new(self.format, decode, Places::Even(SIDE), bricks).unwrap();
        Field::new(self.dims, Arc::new(index), Arc::new(slots), Join::Shared).unwrap()
    }

    fn samples(&self, corner: DVec3, level: Level) -> Vec<f64> {
        let last = (self.dims - 1).as_dvec3();
        let at = |i: u32| DVec3::new(f64::from(i % 16), f64::from(i / 16 % 16), f64::from(i / 256));
        (0..4096).map(|i| (self.value)((corner + at(i) * f64::from(level.stride())).min(last))).collect()
    }

    fn stored(&self, value: f64) -> Vec<u8> {
        match self.format {
            SampleFormat::Unorm8 => vec![(value * 255.0).round() as u8],
            SampleFormat::Unorm16 => ((value * 65535.0).round() as u16).to_le_bytes().to_vec(),
            SampleFormat::Float32 => (value as f32).to_le_bytes().to_vec(),
            SampleFormat::Unorm8x4 => unreachable!("values are single numbers"),
        }
    }
}

fn range(samples: &[f64]) -> ValueRange {
    let (min, max) = samples.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
    ValueRange { min, max }
}
