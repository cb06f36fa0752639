//! Flat blocks of any resolution next to each other, and the values between them (Ljung, Lundstroem and Ynnerman 2006).

use brickfield::frame::{Division, FramePlan, Join, Mode, Placement, Places, ShaderFunction, Slices, Target};
use brickfield::interp::Neighbourhood;
use brickfield::{BlockStyle, Classification, Technique, TransparentBlocks};
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BlockSide, Grid, Interblock, Level, ScalarType};
use brickfield_optics::QuadratureRule;

use super::fields::{COOL, WARM, grid, hills, knot, skew_grid, soft, sparse};
use super::functions::function;
use super::setup::{FlatLevels, Setup, catches, picture};
use crate::conformance::case::{Case, FunctionPoint};
use crate::conformance::plan_mutants::PlanMutant::*;
use crate::conformance::shader_mutants as shader;
use crate::volumes::spread;

/// The scheme, with the inside of transparent blocks drawn as any other: the plan without skipping is the same field.
pub(super) fn blended(scheme: Interblock) -> BlockStyle {
    BlockStyle { join: Join::Blend(scheme), transparent: TransparentBlocks::Blended, ..NEAREST }
}

/// Blocks of random resolutions, the last ones short.
pub(super) fn random(scalar: ScalarType, side: BlockSide, style: BlockStyle) -> Setup {
    Setup::new(hills(&grid(), scalar), soft(scalar)).blocks(side, FlatLevels::Random, style)
}

pub(super) const NEAREST: BlockStyle = BlockStyle {
    join: Join::Shared,
    transparent: TransparentBlocks::Empty,
    slices: Slices::Together,
    classification: Classification::OfMean,
};

pub(super) fn cases() -> Vec<Case> {
    [pictures(), equal(), weights()].into_iter().flatten().collect()
}

fn pictures() -> Vec<Case> {
    use Interblock::{BoundarySplit, MaximumDistance, MinimumDistance};
    let (u8, u16, f32) = (ScalarType::U8, ScalarType::U16, ScalarType::F32);
    vec![
        picture(
            "blocks/nearest",
            catches![AnchorHalfVoxel, shader::BLOCK_SAMPLES_AT_CORNER, shader::ONE_SAMPLE_FORGOTTEN],
            move || random(u16, BlockSide::V8, NEAREST),
        ),
        picture(
            "blocks/maximum-distance",
            catches![
                shader::NO_MISSING_BLOCKS,
                shader::NO_UPPER_CLAMP,
                shader::BLOCK_SAMPLES_AT_CORNER,
                shader::NO_STRETCH,
                shader::LITERAL_WEIGHTS,
                shader::NOT_NORMALISED_WEIGHTS,
                shader::BLOCKS_SWAPPED,
                shader::ONE_SAMPLE_FORGOTTEN,
                shader::MAXIMUM_TO_THE_FACE,
                DecodeOffset,
            ],
            move || random(u8, BlockSide::V8, blended(MaximumDistance)),
        ),
        picture("blocks/minimum-distance-u16", catches![shader::MINIMUM_IS_MAXIMUM, shader::LERP_SWAPPED], move || {
            random(u16, BlockSide::V16, blended(MinimumDistance))
        }),
        picture("blocks/boundary-split-f32", catches![shader::SPLIT_SWAPPED], move || {
            let volume = hills(&skew_grid(), f32);
            Setup::new(volume, soft(f32)).blocks(BlockSide::V32, FlatLevels::Random, blended(BoundarySplit))
        }),
        picture("blocks/gauss2", catches![shader::LITERAL_WEIGHTS, shader::GAUSS_NODE], move || {
            random(u16, BlockSide::V8, blended(MaximumDistance)).rule(QuadratureRule::Gauss2)
        }),
        picture("blocks/pre-integrated", catches![shader::BLOCKS_SWAPPED, shader::PIECE_MEAN], move || {
            random(u8, BlockSide::V8, blended(MinimumDistance)).rule(QuadratureRule::PreIntegrated)
        }),
        picture("blocks/block-by-block", catches![shader::NO_STRETCH, shader::STEPS_OF_LEVEL_0], move || {
            random(u16, BlockSide::V8, blended(MaximumDistance)).with(|s| {
                (s.division, s.placement) = (Division::Brick, Placement::ViewportPlanes);
            })
        }),
        picture("blocks/polygons", catches![shader::MAXIMUM_TO_THE_FACE, PolygonsReversed], move || {
            random(u8, BlockSide::V16, blended(MaximumDistance)).with(|s| {
                (s.division, s.placement) = (Division::Brick, Placement::ObjectPlanes);
                s.technique = Technique::Polygons(Target::Float32);
            })
        }),
        picture("blocks/interiors-first", catches![BetweenMissing, PolygonsReversed], move || {
            let style = BlockStyle { slices: Slices::InteriorsFirst, ..blended(BoundarySplit) };
            random(u16, BlockSide::V8, style).rule(QuadratureRule::Gauss2).with(|s| {
                (s.division, s.placement) = (Division::Brick, Placement::ViewportPlanes);
                s.technique = Technique::Polygons(Target::Float32);
            })
        }),
        picture("blocks/all-of-level-2", catches![shader::NEAREST, DecodeOffset], move || {
            Setup::new(hills(&grid(), u16), soft(u16)).blocks(
                BlockSide::V8,
                FlatLevels::All(Level(2)),
                blended(MaximumDistance),
            )
        }),
        picture("blocks/fast", catches![shader::HALF_TEXEL, shader::MAXIMUM_TO_THE_FACE], move || {
            random(u16, BlockSide::V8, blended(MaximumDistance)).with(|s| s.mode = Mode::FAST)
        }),
        picture("blocks/skipping", catches![shader::BLOCKS_SWAPPED, shader::ONE_SAMPLE_FORGOTTEN], move || {
            let knots = [knot(0.3, 0.0, WARM), knot(0.9, 0.5, COOL)];
            let transfer = spread(&knots, u8).expect("knots ascend");
            let grid = Grid::axis_aligned(UVec3::new(71, 66, 53), DVec3::ONE).expect("a grid");
            Setup::new(sparse(&grid, u8), transfer).blocks(BlockSide::V8, FlatLevels::Random, blended(MaximumDistance))
        }),
    ]
}

/// Equal resolutions are plain trilinear interpolation: the volume's own samples must agree.
fn equal() -> Vec<Case> {
    let case = |scheme: Interblock, side, scalar| {
        let name = format!("blocks/equal-{}", scheme.name());
        picture(name, catches![shader::NEAREST, shader::LERP_SWAPPED, DecodeOffset], move || {
            Setup::new(hills(&grid(), scalar), soft(scalar)).blocks(side, FlatLevels::All(Level(0)), blended(scheme))
        })
    };
    // Short blocks at the ends; then two blocks along each axis.
    let coarse = |name: &str, dims: UVec3| {
        picture(format!("blocks/all-of-level-2-{name}"), catches![shader::NEAREST], move || {
            let grid = Grid::axis_aligned(dims, DVec3::ONE).expect("a grid");
            let style = blended(Interblock::BoundarySplit);
            Setup::new(hills(&grid, ScalarType::U8), soft(ScalarType::U8)).blocks(
                BlockSide::V8,
                FlatLevels::All(Level(2)),
                style,
            )
        })
    };
    vec![
        coarse("short", UVec3::new(21, 27, 17)),
        coarse("two-blocks", UVec3::splat(11)),
        case(Interblock::MinimumDistance, BlockSide::V8, ScalarType::U8),
        case(Interblock::BoundarySplit, BlockSide::V16, ScalarType::F32),
        case(Interblock::MaximumDistance, BlockSide::V8, ScalarType::U16),
    ]
}

/// The weights of the eight blocks around positions (figures 4 and 5), against those of `brickfield-interp` in f64.
fn weights() -> Vec<Case> {
    let case = |scheme: Interblock, function_of: ShaderFunction, mutants| {
        let name = format!("function/{}-{}", function_of.name().replace('_', "-"), scheme.name());
        let plan = move || {
            let setup = random(ScalarType::U8, BlockSide::V8, blended(scheme));
            let test = setup.build();
            test.prepare(&test.scene).expect("a case's scene is one")
        };
        function(name, mutants, plan, function_of, move |plan| weight_points(plan, scheme, function_of))
    };
    use ShaderFunction::{WeightsHigh, WeightsLow};
    vec![
        case(Interblock::MinimumDistance, WeightsLow, catches![shader::MINIMUM_IS_MAXIMUM]),
        case(Interblock::BoundarySplit, WeightsHigh, catches![shader::SPLIT_SWAPPED, shader::LITERAL_WEIGHTS]),
        case(Interblock::MaximumDistance, WeightsLow, catches![shader::MAXIMUM_TO_THE_FACE, shader::LITERAL_WEIGHTS]),
        case(
            Interblock::MaximumDistance,
            WeightsHigh,
            catches![shader::NOT_NORMALISED_WEIGHTS, shader::NO_UPPER_CLAMP],
        ),
    ]
}

fn weight_points(plan: &FramePlan, scheme: Interblock, function: ShaderFunction) -> Vec<FunctionPoint> {
    let Places::Blocks(places) = plan.field().slots().places() else { panic!("a plan of flat blocks") };
    let (layout, last) = (places.layout(), plan.field().last_sample());
    let half = 0.5 * f64::from(layout.side().n_voxels());
    // Where the neighbourhood changes, either one is right.
    let is_clear = |q: &DVec3| (*q + 0.5).to_array().into_iter().all(|x| (x % half).min(half - x % half) > 1e-3);
    let positions = (0..3000u32).map(|i| {
        let part = |k: u32| f64::from(i.wrapping_mul(k) % 3001) / 3000.0;
        (last * DVec3::new(part(7), part(1013), part(577))).as_vec3()
    });
    let point = |q: brickfield_core::glam::Vec3| {
        let around = Neighbourhood::around(layout, q.as_dvec3().to_array());
        let [a, b, c, d, e, f, g, h] = around.weights(layout, scheme, |block| places.row(block).level);
        let expected = match function {
            ShaderFunction::WeightsLow => [a, b, c, d],
            _ => [e, f, g, h],
        };
        FunctionPoint { input: [q.x, q.y, q.z, 0.0], expected, tolerance: [2e-5; 4] }
    };
    positions.filter(|q| is_clear(&q.as_dvec3())).map(point).collect()
}
