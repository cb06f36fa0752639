//! Figure 7: a rotated linear gradient of 256 x 256 samples in 8 x 8 blocks of random resolution.

use std::sync::Arc;

use brickfield::bricks::{BlockOptions, BlockSource, BlockVolume, build_blocks};
use brickfield::frame::{Backend, FramePlan, Join, ShaderFunction};
use brickfield::lod::BlockLevels;
use brickfield::{BlockResidency, Scene, prepare_blocks};
use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BlockSide, Camera, Grid, Image, Level, LinearRgb, ScalarType, TransferFunction, Volume};
use brickfield_optics::ColorMetric;
use palette::Srgb;
use serde::Serialize;

use super::LjungArgs;
use super::schemes::{joins, name, style};
use super::warped::Warped;
use crate::compare::rivals::Rivals;
use crate::metrics::quantile;
use crate::paper::panels::{beside, heat_pixel, stacked};
use crate::paper::{Missed, PaperError, print};
use crate::volumes::fill;

/// Samples along a side.
const SIDE: u32 = 256;
/// The paper has blocks of up to 32 x 32 samples.
const BLOCK: BlockSide = BlockSide::V32;
/// Dark grey and white, as sRGB.
const GREYS: [f64; 2] = [0.2, 1.0];
/// How far the gradient is rotated, in degrees.
const ROTATION: f64 = 10.0;
/// Rounding of f32 positions and samples, in parts of the gradient's range.
const ROUNDING: f64 = 2e-6;
/// The difference at the bright end of pictures.
const BRIGHT: f64 = 8.0;

/// The colour differences of a scheme on a backend, over all pixels and seeds.
#[derive(Clone, Debug, Serialize)]
struct GradientRow {
    backend: &'static str,
    scheme: &'static str,
    mean: f64,
    percentile_95: f64,
    max: f64,
    /// The same without pixels that have no block beyond them to interpolate with.
    mean_off_border: f64,
    max_off_border: f64,
    /// The greatest error of a value among the samples of a block, in parts of the gradient's range.
    max_value_error_inside: f64,
}

pub(super) fn run(args: &LjungArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    print(&format!(
        "{SIDE} x {SIDE} samples, rotated by {ROTATION} degrees, 8 x 8 blocks of 1 x 1 to 32 x 32 samples, {} seeds; Delta E (CIELUV) of greys.\n\
         off border: pixels between samples of blocks; inside: the greatest error of a value among a block's own samples, of the range.\n\n\
         backend  scheme             Delta E: mean   95 %    max  off border: mean    max   inside",
        args.seeds
    ))?;
    let blocks = gradient()?;
    let mut rows = Vec::new();
    for (i, backend) in rivals.present.iter_mut().enumerate() {
        let mut pictures = Vec::new();
        for join in joins() {
            let names = (backend.describe().backend, name(join));
            let values = |levels: &[Level]| values(backend.as_mut(), &plan(&blocks, levels, join)?);
            let (row, picture) = of_scheme(args, &blocks, names, values)?;
            print(&line(&row))?;
            rows.push(row);
            pictures.push(picture);
        }
        if i == 0 {
            let rows: Vec<Image<f32>> =
                [0, 1].map(|k| beside(&pictures.iter().map(|p| p[k].clone()).collect::<Vec<_>>())).into();
            let what = format!(
                "nearest, minimum distance, boundary split, maximum distance; below, Delta E from 0 to {BRIGHT}"
            );
            args.common.write_picture("figure7", &stacked(&rows), &what)?;
        }
    }
    let missed = missed(&rows);
    let (row, picture) = of_scheme(args, &blocks, ("f64", "warped"), |levels| {
        let warped = Warped::new(&blocks, levels)?;
        Ok((0..SIDE * SIDE).map(|i| warped.value(position(i))).collect())
    })?;
    print(&line(&row))?;
    args.common.write_picture("figure7-warped", &stacked(&picture), "warped coordinates; below, Delta E as before")?;
    print(&jumps(&blocks)?)?;
    rows.push(row);
    args.common.write_rows("gradient.json", &rows)?;
    Ok(missed)
}

/// How far warped values jump at the faces of blocks, and at the planes of their outer samples.
fn jumps(blocks: &BlockVolume) -> Result<String, PaperError> {
    /// Samples.
    const STEP: f64 = 1e-7;
    let layout = blocks.layout();
    let levels = BlockLevels::random(*layout, 0);
    let levels = levels.levels();
    let warped = Warped::new(blocks, levels)?;
    let (mut at_faces, mut anywhere) = (0.0f64, 0.0f64);
    for (block, level) in layout.blocks().zip(levels) {
        let (first, last) = layout.sample_ends(block, *level);
        let face = layout.first_voxel(block).as_dvec3() - 0.5;
        for (axis, along) in [(0, 1), (1, 0)] {
            for plane in [first[axis], last[axis], face[axis]] {
                for i in 0..SIDE {
                    let mut q = position(0);
                    (q[axis], q[along]) = (plane, face[along] + 32.0 * (f64::from(i) + 0.5) / f64::from(SIDE));
                    let beside = [-STEP, STEP].map(|step| {
                        let mut beside = q;
                        beside[axis] += step;
                        warped.value(beside.clamp(DVec3::ZERO, DVec3::new(255.0, 255.0, 0.0)))
                    });
                    let jump = (beside[1] - beside[0]).abs();
                    anywhere = anywhere.max(jump);
                    if warped.is_off_edges(q, axis) {
                        at_faces = at_faces.max(jump);
                    }
                }
            }
        }
    }
    Ok(format!(
        "warped: it jumps by {at_faces:.1e} of the range at faces, by {anywhere:.1e} at edges, within {:.0e} samples",
        2.0 * STEP
    ))
}

fn line(row: &GradientRow) -> String {
    format!(
        "{:<8} {:<18} {:>13.3} {:>6.2} {:>6.2} {:>17.3} {:>6.2}  {:.1e}",
        row.backend,
        row.scheme,
        row.mean,
        row.percentile_95,
        row.max,
        row.mean_off_border,
        row.max_off_border,
        row.max_value_error_inside
    )
}

/// The gradient at a position in sample space, 0 to 1.
fn value(q: DVec3) -> f64 {
    let (sin, cos) = ROTATION.to_radians().sin_cos();
    let last = f64::from(SIDE - 1);
    (q.x * cos + q.y * sin) / (last * (cos + sin))
}

fn gradient() -> Result<BlockVolume, PaperError> {
    let grid = Grid::axis_aligned(UVec3::new(SIDE, SIDE, 1), DVec3::ONE).expect("a grid");
    let volume: Volume = fill(&grid, ScalarType::F32, |p| value(p - 0.5));
    Ok(build_blocks(Arc::new(volume), &BlockOptions { side: BLOCK, ..BlockOptions::default() })?)
}

/// A value as a grey, linear.
fn grey(value: f64) -> LinearRgb {
    let encoded = GREYS[0] + (GREYS[1] - GREYS[0]) * value;
    [Srgb::new(encoded, encoded, encoded).into_linear::<f64>().red; 3]
}

/// The differences of a scheme, by the values that it has at all positions for blocks of given levels.
fn of_scheme(
    args: &LjungArgs,
    blocks: &BlockVolume,
    (backend, scheme): (&'static str, &'static str),
    mut values_of: impl FnMut(&[Level]) -> Result<Vec<f64>, PaperError>,
) -> Result<(GradientRow, [Image<f32>; 2]), PaperError> {
    let (mut all, mut off_border, mut inside) = (Vec::new(), Vec::new(), 0.0f64);
    let mut pictures = None;
    for seed in 0..args.seeds {
        let levels = BlockLevels::random(*blocks.layout(), u64::from(seed));
        let values = values_of(levels.levels())?;
        let mut differences = Vec::with_capacity(values.len());
        for (i, found) in values.iter().enumerate() {
            let q = position(i as u32);
            let difference = ColorMetric::CieLuv1976.of_colors(grey(*found), grey(value(q)));
            differences.push(difference);
            match place(blocks, levels.levels(), q) {
                Within::Samples => inside = inside.max((found - value(q)).abs()),
                Within::Blocks => {}
                Within::Border => continue,
            }
            off_border.push(difference);
        }
        pictures
            .get_or_insert_with(|| [picture(&values, grey_pixel), picture(&differences, |d| heat_pixel(d / BRIGHT))]);
        all.extend(differences);
    }
    let mean = |d: &[f64]| d.iter().sum::<f64>() / d.len() as f64;
    let max = |d: &[f64]| d.iter().copied().fold(0.0, f64::max);
    let row = GradientRow {
        backend,
        scheme,
        mean: mean(&all),
        max: max(&all),
        mean_off_border: mean(&off_border),
        max_off_border: max(&off_border),
        percentile_95: quantile(all, 0.95),
        max_value_error_inside: inside,
    };
    Ok((row, pictures.expect("at least one seed")))
}

fn position(i: u32) -> DVec3 {
    DVec3::new(f64::from(i % SIDE), f64::from(i / SIDE), 0.0)
}

/// Where a position lies.
enum Within {
    /// Among the samples of its block.
    Samples,
    /// Between the samples of blocks.
    Blocks,
    /// Between samples and the border, beyond which there are none.
    Border,
}

fn place(blocks: &BlockVolume, levels: &[Level], q: DVec3) -> Within {
    let layout = blocks.layout();
    let block = (q.as_uvec3() / BLOCK.n_voxels()).min(layout.n_blocks() - 1);
    let (first, last) = layout.sample_ends(block, levels[layout.ordinal(block)]);
    let (below, above) = (q.cmplt(first), q.cmpgt(last));
    let at_start = block.cmpeq(UVec3::ZERO);
    let at_end = (block + 1).cmpeq(layout.n_blocks());
    match ((below & at_start) | (above & at_end)).any() {
        true => Within::Border,
        false if (below | above).any() => Within::Blocks,
        false => Within::Samples,
    }
}

pub(super) fn plan(blocks: &BlockVolume, levels: &[Level], join: Join) -> Result<FramePlan, PaperError> {
    let camera = Camera::framing(&blocks.grid().world_box(), DVec3::new(0.3, 0.2, -1.0), DVec3::Y)?;
    // Nothing is transparent.
    let fog = TransferFunction::new(vec![
        brickfield_core::Knot { value: blocks.range().min, extinction: 0.1, color: [1.0; 3] },
        brickfield_core::Knot {
            value: blocks.range().max.max(blocks.range().min + 1.0),
            extinction: 0.2,
            color: [1.0; 3],
        },
    ])
    .expect("knots ascend");
    let scene = Scene::new(camera, UVec2::splat(8), fog);
    Ok(prepare_blocks(blocks, &scene, levels, style(join), &mut BlockResidency::default())?)
}

/// The values at all samples' positions.
fn values(backend: &mut dyn Backend, plan: &FramePlan) -> Result<Vec<f64>, PaperError> {
    let positions = (0..SIDE * SIDE).map(|i| position(i).extend(0.0).as_vec4().to_array()).collect::<Vec<_>>();
    let found = evaluate(backend, plan, ShaderFunction::Sample, &positions)?;
    Ok(found.into_iter().map(|v| f64::from(v[0])).collect())
}

/// One function of a backend on a list of inputs.
pub(super) fn evaluate(
    backend: &mut dyn Backend,
    plan: &FramePlan,
    function: ShaderFunction,
    inputs: &[[f32; 4]],
) -> Result<Vec<[f32; 4]>, PaperError> {
    let name = backend.describe().backend;
    let evaluates = backend.as_evaluate().ok_or(PaperError::NoFunctions { backend: name })?;
    evaluates.evaluate(plan, function, inputs).map_err(|source| PaperError::Render { backend: name, source })
}

fn picture(numbers: &[f64], pixel: impl Fn(f64) -> [f32; 4]) -> Image<f32> {
    Image::new(UVec2::splat(SIDE), numbers.iter().copied().map(pixel).collect()).expect("a pixel for each number")
}

fn grey_pixel(value: f64) -> [f32; 4] {
    let [r, g, b] = grey(value).map(|c| c as f32);
    [r, g, b, 1.0]
}

/// Maximum distance is best, the nearest block is worst; among the samples of a block errors are of rounding.
fn missed(rows: &[GradientRow]) -> Vec<Missed> {
    let mut missed = Vec::new();
    for of_backend in rows.chunk_by(|a, b| a.backend == b.backend) {
        let least = of_backend.iter().min_by(|a, b| a.mean.total_cmp(&b.mean)).map(|row| row.scheme);
        let most = of_backend.iter().max_by(|a, b| a.mean.total_cmp(&b.mean)).map(|row| row.scheme);
        if (least, most) != (Some("maximum-distance"), Some("nearest")) {
            missed.push(format!("figure 7 on {}: best {least:?}, worst {most:?}", of_backend[0].backend));
        }
    }
    let rough = rows.iter().filter(|row| row.max_value_error_inside > ROUNDING);
    missed.extend(rough.map(|row| {
        format!(
            "figure 7, {}, {}: an error of {:e} inside a block",
            row.backend, row.scheme, row.max_value_error_inside
        )
    }));
    missed.into_iter().map(Missed::of_pictures).collect()
}
