//! Fields with known pictures, every scalar type, every quadrature rule, transfer functions.

use brickfield_core::glam::UVec2;
use brickfield_core::{ScalarType, TransferFunction};
use brickfield_optics::QuadratureRule;

use super::fields::{
    COOL, WARM, ball, constant, grid, hills, knot, marschner_lobb, ramp, shell, skew_grid, soft, soft_knots,
};
use super::setup::{Setup, catches, picture, type_name};
use crate::conformance::case::{Case, Mutant};
use crate::conformance::plan_mutants::PlanMutant::*;
use crate::conformance::shader_mutants as shader;
use crate::volumes::spread;

pub(super) fn cases() -> Vec<Case> {
    [fields(), types(), rules(), transfers(), sizes()].into_iter().flatten().collect()
}

fn fields() -> Vec<Case> {
    let f32_soft = || soft(ScalarType::F32);
    vec![
        picture(
            "field/slab",
            catches![
                ExtinctionScaled,
                DomainAtSamples,
                LastSegmentDropped,
                RedBlueSwapped,
                shader::NO_SELF_ATTENUATION,
                shader::FIRST_NOT_CUT,
                shader::LAST_NOT_CUT,
                shader::FIRST_DROPPED,
                shader::LAST_DROPPED,
                shader::OPACITY_IS_DEPTH
            ],
            || {
                let transfer = TransferFunction::constant(0.03, WARM).expect("a constant");
                Setup::new(constant(&grid(), ScalarType::U8, 0.4), transfer)
            },
        ),
        picture("field/slab-lookup", catches![ExtinctionScaled, shader::STEPS, DomainAtSamples], || {
            let knots = [knot(0.0, 0.02, WARM), knot(0.5, 0.03, COOL), knot(1.0, 0.08, WARM)];
            let transfer = spread(&knots, ScalarType::U16).expect("knots ascend");
            Setup::new(constant(&grid(), ScalarType::U16, 0.4), transfer)
        }),
        picture("field/ramp", catches![AnchorHalfVoxel, KnotMoved, PixelCorner, shader::NO_CLAMP], move || {
            Setup::new(ramp(&grid()), f32_soft())
        }),
        picture(
            "field/marschner-lobb",
            catches![BricksShifted, IndexSwapped, BorderNotShared, shader::NEAREST, shader::LERP_SWAPPED],
            || {
                let knots = [knot(0.3, 0.0, WARM), knot(0.5, 0.4, WARM), knot(0.7, 0.0, COOL), knot(1.0, 0.2, COOL)];
                let transfer = spread(&knots, ScalarType::U16).expect("knots ascend");
                Setup::new(marschner_lobb(40, ScalarType::U16), transfer)
            },
        ),
        picture("field/shell", catches![KnotMoved, BricksTransposed, RowsFlipped, shader::INDEX_STRIDE], || {
            Setup::new(shell(&grid(), ScalarType::U8), soft(ScalarType::U8))
        }),
        picture("field/gaussian-ball", catches![AnchorHalfVoxel, StepScaled, shader::NEAREST], move || {
            Setup::new(ball(&grid(), ScalarType::F32), f32_soft())
        }),
        picture(
            "field/hills",
            catches![
                BricksShifted,
                BricksTransposed,
                IndexSwapped,
                LastSampleCut,
                shader::INDEX_STRIDE,
                shader::ATLAS_ROW,
                shader::OVERSTAYS,
                shader::NO_ATTENUATION
            ],
            || Setup::new(hills(&grid(), ScalarType::U16), soft(ScalarType::U16)),
        ),
        picture(
            "field/anisotropic",
            catches![AnchorHalfVoxel, BricksTransposed, StepScaled, shader::LERP_SWAPPED, LastSampleCut],
            || Setup::new(hills(&skew_grid(), ScalarType::U16), soft(ScalarType::U16)),
        ),
    ]
}

/// Every scalar type: errors of its bytes and its decoding.
fn types() -> Vec<Case> {
    let one = |scalar: ScalarType| {
        let integer: Vec<Mutant> = match scalar {
            ScalarType::I8 | ScalarType::U8 => catches![SignTurned],
            ScalarType::U16 | ScalarType::I16 => catches![SignTurned, BytesSwapped],
            _ => catches![],
        };
        let mutants = [integer, catches![DecodeOffset, DecodeScale, BorderNotShared]].concat();
        picture(format!("type/{}", type_name(scalar)), mutants, move || {
            Setup::new(hills(&grid(), scalar), soft(scalar))
        })
    };
    ScalarType::ALL.map(one).into()
}

/// Every quadrature rule at a coarse step, where rules differ.
fn rules() -> Vec<Case> {
    let one = |rule: QuadratureRule| {
        let own: Vec<Mutant> = match rule {
            QuadratureRule::LeftRiemann => catches![PhaseHalfStep, shader::EULER_DEPTH],
            QuadratureRule::LeftExponential => catches![PhaseHalfStep, shader::FLAT_SHELLS],
            QuadratureRule::MidpointExponential => catches![LeftRule, shader::MIDPOINT_LEFT],
            QuadratureRule::PreIntegrated => catches![shader::PIECE_MEAN],
            QuadratureRule::Gauss2 => catches![shader::GAUSS_UNWEIGHTED, shader::GAUSS_NODE],
        };
        let mutants = [own, catches![StepScaled, KnotMoved, shader::NO_ATTENUATION]].concat();
        picture(format!("rule/{}", rule.name()), mutants, move || {
            Setup::new(hills(&grid(), ScalarType::U16), soft(ScalarType::U16)).step(1.7).rule(rule)
        })
    };
    QuadratureRule::ALL.map(one).into()
}

fn transfers() -> Vec<Case> {
    let of = |knots: Vec<_>| {
        move || Setup::new(hills(&grid(), ScalarType::U16), spread(&knots, ScalarType::U16).expect("knots ascend"))
    };
    let jump = vec![knot(0.45, 0.0, WARM), knot(0.45, 0.1, WARM), knot(0.6, 0.2, COOL), knot(0.6, 0.02, COOL)];
    let peak = vec![knot(0.48, 0.0, WARM), knot(0.5, 1.5, COOL), knot(0.52, 0.0, WARM)];
    let many = (0..64u32).map(|i| {
        let v = f64::from(i) / 63.0;
        knot(v, 0.05 * (1.0 + (20.0 * v).sin()), [v, 1.0 - v, 0.5 + 0.5 * (9.0 * v).cos()])
    });
    let many: Vec<_> = many.collect();
    let opaque = vec![knot(0.5, 0.0, WARM), knot(0.7, 8.0, COOL)];
    vec![
        picture("transfer/jump", catches![DecodeOffset, shader::STEPS], of(jump)),
        picture("transfer/narrow-peak", catches![KnotMoved, StepScaled, shader::NEAREST], of(peak.clone())),
        picture("transfer/64-knots", catches![KnotMoved, RedBlueSwapped, shader::STEPS], of(many)),
        picture("transfer/opaque", catches![BrickTransparent, shader::ALPHA_LINEAR], of(opaque)),
        picture("transfer/peak-preintegrated", catches![KnotMoved, AnchorHalfVoxel, shader::PIECE_MEAN], move || {
            of(peak.clone())().rule(QuadratureRule::PreIntegrated).step(1.3)
        }),
        picture("transfer/one-knot-jump-preintegrated", catches![BricksShifted, shader::NO_ATTENUATION], || {
            let knots = [knot(0.45, 0.01, WARM), knot(0.45, 0.3, COOL)];
            let transfer = spread(&knots, ScalarType::U16).expect("knots ascend");
            Setup::new(hills(&grid(), ScalarType::U16), transfer).rule(QuadratureRule::PreIntegrated)
        }),
    ]
}

fn sizes() -> Vec<Case> {
    let of = |x, y| {
        move || {
            let transfer = spread(&soft_knots(), ScalarType::U16).expect("knots ascend");
            Setup::new(hills(&grid(), ScalarType::U16), transfer).with(|s| s.size = UVec2::new(x, y))
        }
    };
    vec![
        picture("size/odd", catches![PixelCorner, RowsFlipped, NotNormalised, shader::PIXEL_CORNER], of(37, 53)),
        picture("size/wide", catches![PixelCorner, Parallel, shader::NOT_NORMALISED], of(131, 17)),
        picture("size/one-pixel", catches![AnchorHalfVoxel, ExtinctionScaled], of(1, 1)),
        picture("step/tiny", catches![ExtinctionScaled, DomainAtSamples, shader::NO_ATTENUATION], || {
            Setup::new(hills(&grid(), ScalarType::U16), soft(ScalarType::U16))
                .step(0.04)
                .with(|s| s.size = UVec2::splat(40))
        }),
        picture("step/8000-samples", catches![ExtinctionScaled, DomainAtSamples], || {
            Setup::new(hills(&grid(), ScalarType::U16), soft(ScalarType::U16))
                .step(0.0075)
                .with(|s| s.size = UVec2::splat(20))
        }),
        picture("step/beyond-bricks", catches![StepScaled, PhaseHalfStep, shader::MIDPOINT_LEFT], || {
            Setup::new(hills(&grid(), ScalarType::U16), soft(ScalarType::U16)).step(19.0)
        }),
    ]
}
