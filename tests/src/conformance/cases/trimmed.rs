//! Trimmed bricks: stored and drawn as far as something may be seen (Tong, Wang, Tsang and Tang 1999).

use brickfield::frame::{Division, Mode, Placement, Target};
use brickfield::trim::MergeOptions;
use brickfield::{Technique, Trimming};
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BrickSide, Grid, ScalarType, TransferFunction, Volume};
use brickfield_optics::{LightSource, LightTerms, QuadratureRule};

use super::fields::{COOL, WARM, ball, checkers, grid, hills, knot, skew_grid, soft, sparse};
use super::setup::{Setup, catches, picture};
use crate::conformance::case::Case;
use crate::conformance::plan_mutants::PlanMutant::*;
use crate::conformance::shader_mutants as shader;
use crate::volumes::spread;

fn merged() -> Trimming {
    Trimming::Merged(MergeOptions::of_bricks(BrickSide::S16))
}

/// Nothing below the middle of the values.
fn upper_half(scalar: ScalarType) -> TransferFunction {
    spread(&[knot(0.45, 0.0, WARM), knot(0.6, 0.5, COOL), knot(1.0, 0.1, WARM)], scalar).expect("knots ascend")
}

/// Two small balls, far from the faces of bricks.
fn two_balls(scalar: ScalarType) -> Volume {
    sparse(&Grid::axis_aligned(UVec3::new(71, 66, 53), DVec3::ONE).expect("a grid"), scalar)
}

pub(super) fn cases() -> Vec<Case> {
    let (u8, u16, f32) = (ScalarType::U8, ScalarType::U16, ScalarType::F32);
    let polygons = |placement| {
        move |s: &mut brickfield::Scene| {
            (s.division, s.placement) = (Division::Brick, placement);
            s.technique = Technique::Polygons(Target::Float32);
        }
    };
    vec![
        picture("trimmed/packed", catches![KeptTooSmall, shader::KEPT_TOO_SMALL, shader::PLACED_AXES], move || {
            Setup::new(hills(&grid(), u16), upper_half(u16)).trimmed(Trimming::Packed)
        }),
        picture(
            "trimmed/alone-gauss2",
            catches![KeptTooSmall, shader::DARK_PAST_THE_BOX, shader::PLACED_FIRST, shader::GAUSS_NODE],
            move || Setup::new(two_balls(u8), upper_half(u8)).trimmed(Trimming::Alone).rule(QuadratureRule::Gauss2),
        ),
        picture("trimmed/merged", catches![shader::KEPT_TOO_SMALL, shader::PLACED_AXES, IndexSwapped], move || {
            Setup::new(ball(&grid(), u8), soft(u8)).trimmed(merged())
        }),
        picture("trimmed/merged-pre-integrated", catches![shader::PIECE_MEAN, KeptTooSmall], move || {
            Setup::new(hills(&skew_grid(), f32), upper_half(f32)).trimmed(merged()).rule(QuadratureRule::PreIntegrated)
        }),
        picture("trimmed/steps-beyond-bricks", catches![shader::PIECE_MEAN, AnchorHalfVoxel], move || {
            let setup = Setup::new(checkers(UVec3::new(71, 66, 53)), upper_half(u8)).trimmed(Trimming::Packed);
            setup.rule(QuadratureRule::PreIntegrated).step(19.3)
        }),
        picture("trimmed/envelope-fast", catches![shader::KEPT_TOO_SMALL, shader::HALF_TEXEL], move || {
            Setup::new(two_balls(u16), upper_half(u16)).trimmed(Trimming::Envelope).with(|s| s.mode = Mode::FAST)
        }),
        picture("trimmed/visible-bricks", catches![shader::PLACED_AXES, DecodeOffset], move || {
            Setup::new(two_balls(u8), soft(u8)).trimmed(Trimming::Visible)
        }),
        picture("trimmed/polygons", catches![PolygonsReversed, ExitsMissing, shader::PLACED_FIRST], move || {
            let setup = Setup::new(hills(&grid(), u8), upper_half(u8)).trimmed(merged());
            setup.with(polygons(Placement::ViewportPlanes))
        }),
        picture("trimmed/polygons-near", catches![PolygonsReversed, shader::PLACED_AXES], move || {
            let setup = Setup::new(hills(&grid(), u16), upper_half(u16)).trimmed(Trimming::Packed);
            let setup = setup.rule(QuadratureRule::PreIntegrated).with(polygons(Placement::ObjectPlanes));
            setup.eye(DVec3::new(-4.0, -9.0, 20.0), DVec3::new(30.0, 30.0, 25.0)).step(2.7)
        }),
        picture("trimmed/facets", catches![PolygonsMissing, shader::PLACED_FIRST], move || {
            let setup = Setup::new(two_balls(u16), upper_half(u16)).trimmed(Trimming::Alone);
            setup.with(polygons(Placement::TessellatedShells { facet_pixels: 16 }))
        }),
        picture("trimmed/brick-by-brick", catches![shader::KEPT_TOO_SMALL, shader::DARK_PAST_THE_BOX], move || {
            let setup = Setup::new(two_balls(u16), upper_half(u16)).trimmed(Trimming::Packed);
            setup.with(|s| (s.division, s.placement) = (Division::Brick, Placement::ViewportPlanes))
        }),
        picture("trimmed/lit", catches![shader::KEPT_TOO_SMALL, DiffuseDimmed, FlatBelowScaled], move || {
            let terms = LightTerms { ambient: 0.2, diffuse: 0.8, specular: 0.3, ..LightTerms::default() };
            Setup::new(hills(&grid(), u16), upper_half(u16)).trimmed(Trimming::Packed).lit(LightSource::Head, terms)
        }),
        picture("trimmed/lit-pre-integrated", catches![LightTurned, KeptTooSmall], move || {
            let terms = LightTerms { ambient: 0.1, diffuse: 0.9, ..LightTerms::default() };
            let setup = Setup::new(ball(&skew_grid(), f32), soft(f32)).trimmed(merged());
            let setup = setup.rule(QuadratureRule::PreIntegrated);
            setup.lit(LightSource::Direction(DVec3::new(0.3, -0.8, 0.5)), terms)
        }),
        picture("trimmed/clip", catches![ClipIgnored, shader::KEPT_TOO_SMALL], move || {
            let setup = Setup::new(hills(&grid(), u8), upper_half(u8)).trimmed(Trimming::Packed);
            setup.clip([9.0, 5.5, 3.25], [40.0, 33.0, 61.0])
        }),
    ]
}
