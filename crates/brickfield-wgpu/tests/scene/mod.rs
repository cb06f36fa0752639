//! Plans made by hand: a field, its bricks, and a view of them.

// A module of test programs: nothing outside can reach it.
#![allow(unreachable_pub)]

use std::sync::Arc;

use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{
    Aabb, BrickLayout, BrickSide, Camera, Grid, Knot, Level, Projection, TransferFunction, ValueRange,
};
use brickfield_frame::{
    BrickSet, Decode, Feature, FeatureSet, FramePlan, IndexEntry, IndexGrid, Mode, QuadratureRule, RayFrame,
    SampleFormat, Sampling, Steps,
};

const SIDE: BrickSide = BrickSide::S16;

/// A field over sample positions, and how it is looked at.
#[derive(Clone)]
pub struct Scene {
    pub dims: UVec3,
    pub field: fn(DVec3) -> f64,
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

impl Scene {
    pub fn new(dims: UVec3, field: fn(DVec3) -> f64, transfer: TransferFunction) -> Scene {
        Scene {
            dims,
            field,
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
        let layout = BrickLayout::new(self.dims, SIDE);
        let grid = Grid::axis_aligned(self.dims, DVec3::ONE).unwrap();
        let domain = Aabb { min: DVec3::splat(-0.5), max: self.dims.as_dvec3() - 0.5 };
        let mut index = IndexGrid::transparent(layout.n_bricks(Level(0)));
        let (mut bytes, mut slot) = (Vec::new(), 0);
        let mut visible: Option<Aabb> = None;
        for id in layout.bricks(Level(0)) {
            let level = (self.level)(id.coords);
            let block = id.ancestor(level);
            if block.coords << u32::from(level.0) != id.coords {
                continue;
            }
            let samples = self.samples(block.coords.as_dvec3() * f64::from(15 * level.stride()), level);
            if self.skip && self.transfer.is_transparent(range(&samples)) {
                index.fill(id.coords, IndexEntry::Transparent { level });
                continue;
            }
            index.fill(id.coords, IndexEntry::Resident { slot, level });
            slot += 1;
            bytes.extend(samples.iter().flat_map(|v| self.stored(*v)));
            let b = layout.index_box(block);
            let b = Aabb { min: b.min - 0.5, max: b.max - 0.5 };
            visible = Some(visible.map_or(b, |v| v.union(&b)));
        }
        let decode = Decode { scale: 1.0, offset: 0.0 };
        FramePlan {
            dims: self.dims,
            rays: RayFrame::new(&self.camera, &grid, self.size, &domain, &Steps::shells(self.step)),
            domain,
            visible: visible.unwrap_or(Aabb { min: domain.min, max: domain.min }),
            sampling: Sampling::new(self.step, self.rule, self.mode).unwrap(),
            transfer: self.transfer.clone(),
            occupancy: None,
            beams: None,
            proxy: None,
            features: self.features(&index),
            index,
            bricks: Arc::new(BrickSet::new(SIDE, self.format, decode, bytes).unwrap()),
        }
    }

    fn samples(&self, corner: DVec3, level: Level) -> Vec<f64> {
        let last = (self.dims - 1).as_dvec3();
        let at = |i: u32| DVec3::new(f64::from(i % 16), f64::from(i / 16 % 16), f64::from(i / 256));
        (0..4096).map(|i| (self.field)((corner + at(i) * f64::from(level.stride())).min(last))).collect()
    }

    fn stored(&self, value: f64) -> Vec<u8> {
        match self.format {
            SampleFormat::Unorm8 => vec![(value * 255.0).round() as u8],
            SampleFormat::Unorm16 => ((value * 65535.0).round() as u16).to_le_bytes().to_vec(),
            SampleFormat::Float32 => (value as f32).to_le_bytes().to_vec(),
        }
    }

    fn features(&self, index: &IndexGrid) -> FeatureSet {
        let entries = || index.words().iter().map(|w| IndexEntry::unpack(*w));
        let fast = matches!(self.mode, Mode::Fast { .. });
        [
            (Feature::HardwareFilter, fast),
            (Feature::EarlyTermination, fast),
            (Feature::SkipTransparent, entries().any(|e| matches!(e, IndexEntry::Transparent { .. }))),
            (Feature::MultiLevel, entries().any(|e| e.level() != Level(0))),
            (Feature::TransferLookup, self.transfer.knots().len() > 1),
        ]
        .into_iter()
        .filter_map(|(feature, needed)| needed.then_some(feature))
        .collect()
    }
}

fn range(samples: &[f64]) -> ValueRange {
    let (min, max) = samples.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
    ValueRange { min, max }
}
