//! Fast mode: hardware filtering and rays that end early, within the bound of the device's filter.

use brickfield::Technique;
use brickfield::bricks::Downsampling;
use brickfield::frame::{Division, Lengths, Mode, Placement, Target};
use brickfield::lod::Criterion;
use brickfield_core::ScalarType;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_optics::QuadratureRule;

use super::fields::{COOL, WARM, checkers, grid, hills, knot, shell, soft};
use super::setup::{Setup, catches, picture};
use crate::conformance::case::Case;
use crate::conformance::plan_mutants::PlanMutant::*;
use crate::conformance::shader_mutants as shader;
use crate::volumes::spread;

pub(super) fn cases() -> Vec<Case> {
    let fast = |setup: Setup| setup.with(|s| s.mode = Mode::FAST);
    let opaque = [knot(0.3, 0.0, WARM), knot(0.7, 0.6, COOL)];
    let hills_of = move |scalar| Setup::new(hills(&grid(), scalar), soft(scalar));
    let broad = catches![IndexSwapped, RedBlueSwapped, shader::HALF_TEXEL];
    vec![
        picture("fast/u8", broad.clone(), move || fast(hills_of(ScalarType::U8))),
        picture("fast/u16", broad.clone(), move || fast(hills_of(ScalarType::U16))),
        picture("fast/f32", broad, move || fast(hills_of(ScalarType::F32))),
        picture("fast/shell-u8", catches![RowsFlipped, ExtinctionScaled, shader::HALF_TEXEL], move || {
            fast(Setup::new(shell(&grid(), ScalarType::U8), soft(ScalarType::U8)))
        }),
        picture("fast/opaque", catches![EndsEarly, RowsFlipped, shader::ENDS_EARLY], move || {
            fast(Setup::new(hills(&grid(), ScalarType::F32), spread(&opaque, ScalarType::F32).expect("knots ascend")))
        }),
        picture("fast/no-floor", catches![EndsEarly, RowsFlipped], move || {
            let setup =
                Setup::new(hills(&grid(), ScalarType::F32), spread(&opaque, ScalarType::F32).expect("knots ascend"));
            setup.with(|s| s.mode = Mode::Fast { transmittance_floor: 0.0 })
        }),
        picture("fast/several-levels", catches![WrongLevel, RowsFlipped, shader::LEVEL_SCALE], move || {
            let near = DVec3::new(-4.0, -9.0, 20.0);
            fast(hills_of(ScalarType::U16).detail(Criterion::Distance { factor: 1.0 }, Downsampling::Average))
                .eye(near, DVec3::new(20.0, 18.0, 16.0))
        }),
        picture("fast/skip", catches![VisibleTooSmall, shader::JUMPS_TOO_FAR], move || {
            fast(Setup::new(checkers(UVec3::new(71, 66, 53)), soft(ScalarType::U8)))
        }),
        picture("fast/gauss2", catches![IndexSwapped, RowsFlipped, shader::HALF_TEXEL], move || {
            fast(hills_of(ScalarType::U16).rule(QuadratureRule::Gauss2))
        }),
        picture("fast/bricks", catches![IndexSwapped, RowsFlipped, shader::HALF_TEXEL], move || {
            fast(hills_of(ScalarType::U16)).with(|s| s.division = Division::Brick)
        }),
        picture("fast/nominal-planes", catches![IndexSwapped, RowsFlipped, shader::HALF_TEXEL], move || {
            fast(hills_of(ScalarType::U8))
                .with(|s| (s.placement, s.lengths) = (Placement::ViewportPlanes, Lengths::Nominal))
        }),
        picture("fast/polygons", catches![PolygonsReversed, RowsFlipped, shader::HALF_TEXEL], move || {
            fast(hills_of(ScalarType::U8)).with(|s| {
                (s.placement, s.division) = (Placement::ObjectPlanes, Division::Brick);
                s.technique = Technique::Polygons(Target::Float32);
            })
        }),
        picture("fast/preintegrated", catches![IndexSwapped, RowsFlipped, shader::HALF_TEXEL], move || {
            fast(hills_of(ScalarType::U16).rule(QuadratureRule::PreIntegrated))
        }),
    ]
}
