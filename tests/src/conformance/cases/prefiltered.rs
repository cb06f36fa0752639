//! Flat blocks of any resolution, classified by the spreads of their samples.

use brickfield::frame::{Division, FramePlan, Mode, Placement, ShaderFunction, Target};
use brickfield::{BlockStyle, Classification, Technique};
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BlockSide, Grid, Interblock, Level, Optics, ScalarType, ValueRange};
use brickfield_optics::{LightSource, QuadratureRule, ValueSpread, expected_optics};

use super::blocks::{NEAREST, blended, random};
use super::fields::{COOL, WARM, grid, hills, knot, skew_grid, soft, sparse};
use super::functions::{function, steepness};
use super::light::{ASIDE, SHINY};
use super::setup::{FlatLevels, Setup, catches, picture};
use crate::conformance::case::{Case, FunctionPoint};
use crate::conformance::plan_mutants::PlanMutant::*;
use crate::conformance::shader_mutants as shader;
use crate::volumes::spread;

const fn prefiltered(style: BlockStyle) -> BlockStyle {
    BlockStyle { classification: Classification::Prefiltered, ..style }
}

pub(super) fn cases() -> Vec<Case> {
    [pictures(), vec![expected()]].into_iter().flatten().collect()
}

fn pictures() -> Vec<Case> {
    use Interblock::{BoundarySplit, MaximumDistance, MinimumDistance};
    let (u8, u16, f32) = (ScalarType::U8, ScalarType::U16, ScalarType::F32);
    let maximum = || prefiltered(blended(MaximumDistance));
    vec![
        picture(
            "prefiltered/nearest",
            catches![
                shader::SPREADS_IGNORED,
                shader::ONE_SPREADS_FORGOTTEN,
                shader::NEAREST_SPREAD,
                shader::NO_STRETCH
            ],
            move || random(u16, BlockSide::V8, prefiltered(NEAREST)),
        ),
        picture(
            "prefiltered/maximum-distance",
            catches![
                shader::SPREADS_IGNORED,
                shader::ONE_SPREADS_FORGOTTEN,
                shader::RANGE_OF_FIRST_BLOCK,
                shader::ONE_DEVIATION,
                shader::VARIANCE_LOST,
                shader::NO_RANGE,
                shader::HALVES_ALIKE,
                shader::COLORS_UNWEIGHTED,
                shader::BLOCKS_SWAPPED,
                DecodeOffset,
            ],
            move || random(u8, BlockSide::V8, maximum()),
        ),
        picture(
            "prefiltered/boundary-split-gauss2",
            catches![shader::SPREADS_IGNORED, shader::GAUSS_NODE, shader::SPLIT_SWAPPED],
            move || {
                let volume = hills(&skew_grid(), f32);
                let setup = Setup::new(volume, soft(f32)).rule(QuadratureRule::Gauss2);
                setup.blocks(BlockSide::V16, FlatLevels::Random, prefiltered(blended(BoundarySplit)))
            },
        ),
        picture("prefiltered/all-of-level-2", catches![shader::NEAREST_SPREAD, shader::ONE_DEVIATION], move || {
            let setup = Setup::new(hills(&grid(), u16), soft(u16));
            setup.blocks(BlockSide::V8, FlatLevels::All(Level(2)), maximum())
        }),
        picture(
            "prefiltered/all-of-one-sample",
            catches![shader::ONE_SPREADS_FORGOTTEN, shader::HALVES_ALIKE],
            move || {
                let setup = Setup::new(hills(&grid(), u8), soft(u8)).rule(QuadratureRule::LeftRiemann);
                setup.blocks(BlockSide::V8, FlatLevels::All(Level(3)), prefiltered(blended(MinimumDistance)))
            },
        ),
        picture("prefiltered/jump", catches![shader::SPREADS_IGNORED, shader::HALVES_ALIKE, KnotMoved], move || {
            let knots = [knot(0.2, 0.0, WARM), knot(0.45, 0.02, WARM), knot(0.45, 0.15, COOL), knot(1.0, 0.05, COOL)];
            let transfer = spread(&knots, u16).expect("knots ascend");
            Setup::new(hills(&grid(), u16), transfer).blocks(BlockSide::V8, FlatLevels::Random, maximum())
        }),
        picture("prefiltered/block-by-block", catches![shader::SPREADS_IGNORED, shader::STEPS_OF_LEVEL_0], move || {
            random(u16, BlockSide::V8, maximum()).with(|s| {
                (s.division, s.placement) = (Division::Brick, Placement::ViewportPlanes);
            })
        }),
        picture("prefiltered/polygons", catches![shader::SPREADS_IGNORED, PolygonsReversed], move || {
            random(u8, BlockSide::V16, prefiltered(NEAREST)).with(|s| {
                (s.division, s.placement) = (Division::Brick, Placement::ObjectPlanes);
                s.technique = Technique::Polygons(Target::Float32);
            })
        }),
        picture("prefiltered/fast", catches![shader::SPREADS_IGNORED, shader::SPREAD_HALF_TEXEL], move || {
            random(u16, BlockSide::V8, maximum()).with(|s| s.mode = Mode::FAST)
        }),
        picture("prefiltered/skipping", catches![shader::NO_RANGE, shader::SPREADS_IGNORED], move || {
            let knots = [knot(0.3, 0.0, WARM), knot(0.9, 0.5, COOL)];
            let transfer = spread(&knots, u8).expect("knots ascend");
            let grid = Grid::axis_aligned(UVec3::new(71, 66, 53), DVec3::ONE).expect("a grid");
            Setup::new(sparse(&grid, u8), transfer).blocks(BlockSide::V8, FlatLevels::Random, maximum())
        }),
        // The shade of the mean's gradient, on the colour that is expected.
        picture(
            "prefiltered/light-maximum-distance-gauss2",
            catches![
                shader::SPREADS_IGNORED,
                shader::GRADIENT_OF_THE_LEAST,
                shader::SPACING_OF_OWN_BLOCK,
                shader::NOT_HALFWAY,
                DiffuseDimmed,
            ],
            move || random(u16, BlockSide::V8, maximum()).lit(ASIDE, SHINY).rule(QuadratureRule::Gauss2),
        ),
        // Two companions of one sample.
        picture(
            "prefiltered/light-stored-nearest",
            catches![
                shader::ONE_SPREADS_FORGOTTEN,
                shader::ONE_GRADIENT_FORGOTTEN,
                shader::STORED_LENGTH_NOT_SQUARED,
                FlatBelowScaled,
            ],
            move || random(u8, BlockSide::V8, prefiltered(NEAREST)).lit(LightSource::Head, SHINY).stored_normals(),
        ),
    ]
}

/// The optics of values around a mean, against those of `brickfield-optics` in f64.
fn expected() -> Case {
    let plan = move || {
        let test = random(ScalarType::F32, BlockSide::V8, prefiltered(NEAREST)).build();
        test.prepare(&test.scene).expect("a case's scene is one")
    };
    let mutants = catches![
        shader::ONE_DEVIATION,
        shader::VARIANCE_LOST,
        shader::NO_RANGE,
        shader::HALVES_ALIKE,
        shader::COLORS_UNWEIGHTED,
        shader::STEPS,
    ];
    function("function/expected-optics", mutants, plan, ShaderFunction::Classify, expected_points)
}

fn expected_points(plan: &FramePlan) -> Vec<FunctionPoint> {
    let transfer = plan.transfer();
    let (most, slope) = steepness(transfer);
    let knots = transfer.knots();
    let (low, high) = (knots[0].value, knots[knots.len() - 1].value);
    let point = |i: u32| {
        let part = |k: u32| f64::from(i.wrapping_mul(k) % 4001) / 4000.0;
        let min = (low + (high - low) * (1.4 * part(7) - 0.4)) as f32;
        let max = min + ((high - low) * part(1013)) as f32;
        let mean = min + (max - min) * part(577) as f32;
        let [min, max, mean] = [min, max, mean].map(f64::from);
        // None deviate more than values at both ends.
        let deviation = f64::from((part(2311) * ((mean - min) * (max - mean)).max(0.0).sqrt()) as f32);
        let values = ValueSpread { mean, deviation, range: ValueRange { min, max } };
        let Optics { extinction, color } = expected_optics(transfer, &values);
        let [r, g, b] = color;
        // A few roundings of values as large as the range; a colour is a quotient of sums.
        let off = 1e-6 * most + 4e-6 * (high - low) * slope;
        let of_color = if extinction > 0.0 { (2.0 * off / extinction).min(1.0) } else { 1.0 };
        FunctionPoint {
            input: [mean as f32, deviation as f32, min as f32, max as f32],
            expected: [r, g, b, extinction],
            tolerance: [of_color, of_color, of_color, off],
        }
    };
    (0..4000).map(point).collect()
}
