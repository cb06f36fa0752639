//! Jumps on faces, edges and corners of blocks, and equal resolutions against trilinear interpolation.

use std::sync::Arc;

use brickfield::bricks::{BlockOptions, BlockSource, BlockVolume, build_blocks};
use brickfield::frame::{Backend, FramePlan, Join, ShaderFunction};
use brickfield::interp::interpolate;
use brickfield::lod::BlockLevels;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BlockSide, Grid, Level, ScalarType, Volume};
use serde::Serialize;

use super::LjungArgs;
use super::gradient::{evaluate, plan};
use super::schemes::{joins, name};
use crate::compare::rivals::Rivals;
use crate::conformance::{Samples, VolumeSamples};
use crate::paper::{Missed, PaperError, print};
use crate::volumes::fill_unit;

/// Not a whole number of blocks.
const DIMS: UVec3 = UVec3::new(45, 38, 27);
const BLOCK: BlockSide = BlockSide::V8;
/// Points of a seed on faces, on edges, on corners.
const POINTS: u32 = 600;
/// How far to both sides of a face values are compared, in voxels: a few roundings of a position.
const BESIDE: f64 = 1.0 / (1 << 17) as f64;
/// The greatest change of a value between two points so near, of the range: the slope, and rounding.
const ROUNDING: f64 = 1e-4;
/// The greatest difference to f64 of a change, and of a value, of the range.
const TO_F64: f64 = 5e-6;

#[derive(Clone, Debug, Serialize)]
struct ContinuityRow {
    backend: &'static str,
    scheme: &'static str,
    /// The greatest change across faces, edges and corners, of the range.
    across: [f64; 3],
    /// The greatest difference of a value to the one in f64.
    to_f64: f64,
    /// With equal resolutions, the greatest difference to trilinear interpolation of the volume.
    equal_to_trilinear: f64,
}

pub(super) fn run(args: &LjungArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    let n_seeds = args.seeds.div_ceil(10);
    print(&format!(
        "{} x {} x {} random samples, blocks of {BLOCK}, {n_seeds} seeds of resolutions, {POINTS} points each on faces, edges and corners; the greatest change\n\
         of the value within {BESIDE:.1e} voxels to all sides, of the range. equal: all blocks at full resolution, against the volume's trilinear value in f64.\n\n\
         backend  scheme                faces    edges  corners   to f64    equal",
        DIMS.x, DIMS.y, DIMS.z
    ))?;
    let (volume, blocks) = noise()?;
    let mut rows = Vec::new();
    for backend in &mut rivals.present {
        for join in joins() {
            let row = of_scheme(backend.as_mut(), (&volume, &blocks), join, n_seeds)?;
            let [faces, edges, corners] = row.across;
            print(&format!(
                "{:<8} {:<18} {faces:>8.1e} {edges:>8.1e} {corners:>8.1e} {:>8.1e} {:>8.1e}",
                row.backend, row.scheme, row.to_f64, row.equal_to_trilinear
            ))?;
            rows.push(row);
        }
    }
    args.common.write_rows("continuity.json", &rows)?;
    Ok(missed(&rows))
}

fn noise() -> Result<(Arc<Volume>, BlockVolume), PaperError> {
    let grid = Grid::axis_aligned(DIMS, DVec3::ONE).expect("a grid");
    let hash = |p: DVec3| {
        let key = p.floor().as_u64vec3().dot(brickfield_core::glam::U64Vec3::new(73_856_093, 19_349_663, 83_492_791));
        let mixed = (key ^ key >> 7).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (mixed >> 40) as f64 / f64::from(1u32 << 24)
    };
    let volume = Arc::new(fill_unit(&grid, ScalarType::F32, hash));
    let blocks = build_blocks(Arc::clone(&volume), &BlockOptions { side: BLOCK, ..BlockOptions::default() })?;
    Ok((volume, blocks))
}

fn of_scheme(
    backend: &mut dyn Backend,
    (volume, blocks): (&Volume, &BlockVolume),
    join: Join,
    n_seeds: u32,
) -> Result<ContinuityRow, PaperError> {
    let (mut across, mut to_f64) = ([0.0f64; 3], 0.0f64);
    for seed in 0..n_seeds {
        let levels = BlockLevels::random(*blocks.layout(), u64::from(seed));
        let plan = plan(blocks, levels.levels(), join)?;
        for (n_axes, most) in across.iter_mut().enumerate() {
            let points = (0..POINTS).map(|i| on_faces(seed * POINTS + i, n_axes as u32 + 1));
            let beside: Vec<[f32; 4]> = points.flat_map(corners).collect();
            let found = evaluate(backend, &plan, ShaderFunction::Sample, &beside)?;
            for values in found.chunks_exact(8) {
                let values = values.iter().map(|v| f64::from(v[0]));
                let (low, high) = values.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
                *most = most.max(high - low);
            }
            to_f64 = beside.iter().zip(&found).fold(to_f64, |most, (at, v)| {
                most.max((f64::from(v[0]) - in_f64(&plan, blocks, levels.levels(), join, at)).abs())
            });
        }
    }
    let equal_to_trilinear = equal(backend, volume, blocks, join)?;
    let backend = backend.describe().backend;
    Ok(ContinuityRow { backend, scheme: name(join), across, to_f64, equal_to_trilinear })
}

/// A number of [0, 1) for a point and a purpose.
fn random(i: u32, purpose: u32) -> f64 {
    let key = (u64::from(i) << 8 | u64::from(purpose)).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (key ^ key >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed >> 11) as f64 / (1u64 << 53) as f64
}

/// A random point on faces across so many axes.
fn on_faces(i: u32, n_axes: u32) -> DVec3 {
    let side = f64::from(BLOCK.n_voxels());
    let mut q = DVec3::new(random(i, 0), random(i, 1), random(i, 2)) * DIMS.as_dvec3() - 0.5;
    let first = (random(i, 3) * 3.0) as u32;
    for axis in (0..n_axes).map(|k| ((first + k) % 3) as usize) {
        let n_faces = (f64::from(DIMS[axis] - 1) / side).floor();
        q[axis] = (1.0 + (random(i, 4 + axis as u32) * n_faces).floor()) * side - 0.5;
    }
    q
}

/// Points a little to all sides.
fn corners(q: DVec3) -> [[f32; 4]; 8] {
    std::array::from_fn(|c| {
        let side = |axis: usize| if c >> axis & 1 == 1 { BESIDE } else { -BESIDE };
        (q + DVec3::new(side(0), side(1), side(2))).as_vec3().extend(0.0).to_array()
    })
}

/// The value in f64, from the samples that backends have.
fn in_f64(plan: &FramePlan, blocks: &BlockVolume, levels: &[Level], join: Join, at: &[f32; 4]) -> f64 {
    let q = DVec3::new(at[0].into(), at[1].into(), at[2].into()).clamp(DVec3::ZERO, plan.field().last_sample());
    let layout = blocks.layout();
    let fetch = |block: UVec3| {
        let values = brickfield::bricks::fetch_values(blocks, block, levels[layout.ordinal(block)]);
        let values = values.expect("blocks in memory");
        let place = plan.field().place_at(block).expect("a resident block");
        let n = place.n;
        let s = place.local(q).clamp(DVec3::ZERO, (n - 1).as_dvec3());
        let low = s.floor().as_uvec3().min(n.saturating_sub(UVec3::splat(2)));
        let f = s - low.as_dvec3();
        let corner = |c: u32| {
            let up = UVec3::new(c & 1, c >> 1 & 1, c >> 2);
            let i = (low + up).min(n - 1);
            let weight: f64 = (0..3).map(|axis| if up[axis] == 1 { f[axis] } else { 1.0 - f[axis] }).product();
            weight * values[(i.x + n.x * (i.y + n.y * i.z)) as usize]
        };
        (0..8).map(corner).sum::<f64>()
    };
    match join {
        Join::Blend(scheme) => interpolate(layout, scheme, q.to_array(), |b| levels[layout.ordinal(b)], fetch),
        _ => fetch(plan.field().cell_at(q)),
    }
}

/// The greatest difference between blocks at full resolution and the volume's trilinear value.
fn equal(backend: &mut dyn Backend, volume: &Volume, blocks: &BlockVolume, join: Join) -> Result<f64, PaperError> {
    let levels = BlockLevels::uniform(*blocks.layout(), Level(0));
    let plan = plan(blocks, levels.levels(), join)?;
    let last = (DIMS - 1).as_dvec3();
    let points: Vec<[f32; 4]> = (0..20 * POINTS)
        .map(|i| (DVec3::new(random(i, 0), random(i, 1), random(i, 2)) * last).as_vec3().extend(0.0).to_array())
        .collect();
    let found = evaluate(backend, &plan, ShaderFunction::Sample, &points)?;
    let samples = VolumeSamples(volume);
    let difference = |(at, v): (&[f32; 4], &[f32; 4])| {
        let q = DVec3::new(at[0].into(), at[1].into(), at[2].into());
        (f64::from(v[0]) - samples.around(q).map_or(0.0, |corners| corners.value())).abs()
    };
    Ok(points.iter().zip(&found).map(difference).fold(0.0, f64::max))
}

/// All schemes but the nearest block are continuous.
fn missed(rows: &[ContinuityRow]) -> Vec<Missed> {
    let of = |row: &ContinuityRow| {
        let jump = row.across.into_iter().fold(0.0, f64::max);
        let is_blended = row.scheme != "nearest";
        [
            (is_blended && jump > ROUNDING, format!("jumps by {jump:e}")),
            (is_blended && row.to_f64 > TO_F64, format!("is {:e} off f64", row.to_f64)),
            (is_blended && row.equal_to_trilinear > TO_F64, format!("is {:e} off trilinear", row.equal_to_trilinear)),
            (!is_blended && jump < 0.1, format!("does not jump ({jump:e}): this check sees nothing")),
        ]
        .into_iter()
        .filter(|(is_missed, _)| *is_missed)
        .map(|(_, what)| format!("{} on {} {what}", row.scheme, row.backend))
        .collect::<Vec<_>>()
    };
    rows.iter().flat_map(of).map(Missed::of_pictures).collect()
}
