//! Segments between the surfaces of every placement; of rays and of bricks; of true and of nominal length.

use brickfield::bricks::Downsampling;
use brickfield::frame::{Division, Lengths, Placement};
use brickfield::lod::Criterion;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Grid, Level, ScalarType, TransferFunction, Volume, WorldPos};
use brickfield_optics::QuadratureRule;

use super::fields::{WARM, checkers, grid, hills, skew_grid, soft, sparse};
use super::setup::{Setup, catches, picture};
use crate::conformance::case::{Case, Mutant};
use crate::conformance::plan_mutants::PlanMutant::*;
use crate::conformance::shader_mutants as shader;

const FACETS: Placement = Placement::TessellatedShells { facet_pixels: 12 };
/// All placements, and a mutant of each that turns its surfaces into others.
const PLACEMENTS: [(Placement, Option<shader::ShaderMutant>); 4] = [
    (Placement::Shells, Some(shader::FLAT_SHELLS)),
    (FACETS, Some(shader::FACET_BESIDE)),
    (Placement::ViewportPlanes, Some(shader::PLANES_NOT_STRETCHED)),
    (Placement::ObjectPlanes, Some(shader::STACK_FLAT)),
];

pub(super) fn cases() -> Vec<Case> {
    [of_rays(), of_bricks(), of_several_levels(), nominal(), extremes()].into_iter().flatten().collect()
}

fn large() -> Volume {
    hills(&Grid::axis_aligned(UVec3::new(71, 66, 53), DVec3::ONE).expect("a grid"), ScalarType::U16)
}

fn mutants(own: Option<shader::ShaderMutant>, others: Vec<Mutant>) -> Vec<Mutant> {
    own.into_iter().map(Mutant::from).chain(others).collect()
}

/// Long steps, of which the surfaces' places show.
fn placed(volume: Volume, transfer: TransferFunction, placement: Placement) -> Setup {
    Setup::new(volume, transfer).step(2.5).with(|s| s.placement = placement)
}

fn of_rays() -> Vec<Case> {
    let case = |(placement, own): (Placement, Option<shader::ShaderMutant>)| {
        let name = format!("placement/{}", placement.name());
        picture(name, mutants(own, catches![shader::FIRST_NOT_CUT, shader::LAST_DROPPED]), move || {
            placed(hills(&grid(), ScalarType::U8), soft(ScalarType::U8), placement)
        })
    };
    let skewed = |(placement, _): (Placement, _)| {
        let name = format!("placement/{}-skew", placement.name());
        picture(name, catches![shader::LAST_NOT_CUT, AnchorHalfVoxel], move || {
            placed(hills(&skew_grid(), ScalarType::U16), soft(ScalarType::U16), placement).rule(QuadratureRule::Gauss2)
        })
    };
    PLACEMENTS.into_iter().map(case).chain(PLACEMENTS.into_iter().map(skewed)).collect()
}

fn of_bricks() -> Vec<Case> {
    let case = |(placement, own): (Placement, Option<shader::ShaderMutant>)| {
        let name = format!("bricks/{}", placement.name());
        picture(name, mutants(own, catches![shader::BRICK_NOT_LEFT, shader::FIRST_NOT_CUT]), move || {
            placed(hills(&grid(), ScalarType::U8), soft(ScalarType::U8), placement)
                .with(|s| s.division = Division::Brick)
        })
    };
    let rule = |rule: QuadratureRule| {
        let name = format!("bricks/skip-{}", rule.name());
        picture(name, catches![shader::BRICK_NOT_LEFT, ExtinctionScaled], move || {
            placed(checkers(UVec3::new(71, 66, 53)), soft(ScalarType::U8), Placement::Shells)
                .step(0.9)
                .rule(rule)
                .with(|s| s.division = Division::Brick)
        })
    };
    let skip =
        picture("bricks/skip-macrocells", catches![shader::LEAPS_TOO_FAR_IN_BRICK, shader::MACROCELL_ROW], || {
            Setup::new(sparse(&grid(), ScalarType::U8), soft(ScalarType::U8))
                .step(0.4)
                .with(|s| s.division = Division::Brick)
        });
    let own = PLACEMENTS.into_iter().map(case);
    own.chain(QuadratureRule::ALL.map(rule)).chain([skip]).collect()
}

fn of_several_levels() -> Vec<Case> {
    let near = DVec3::new(-6.0, -14.0, 30.0);
    let case = |placement: Placement, rule: QuadratureRule| {
        let name = format!("bricks/several-levels-{}-{}", placement.name(), rule.name());
        picture(name, catches![shader::STEPS_OF_LEVEL_0, shader::LEVEL_SCALE, shader::BRICK_NOT_LEFT], move || {
            placed(large(), soft(ScalarType::U16), placement)
                .detail(Criterion::Distance { factor: 1.0 }, Downsampling::Average)
                .eye(near, DVec3::new(35.0, 33.0, 26.0))
                .step(0.8)
                .rule(rule)
                .with(|s| s.division = Division::Brick)
        })
    };
    let placements = PLACEMENTS.map(|(placement, _)| case(placement, QuadratureRule::MidpointExponential));
    let other_rules = QuadratureRule::ALL.into_iter().filter(|rule| *rule != QuadratureRule::MidpointExponential);
    let rules = other_rules.map(|rule| case(Placement::Shells, rule));
    let inside = picture("bricks/several-levels-inside", catches![shader::STEPS_OF_LEVEL_0, BehindTheEye], move || {
        placed(large(), soft(ScalarType::U16), Placement::ObjectPlanes)
            .detail(Criterion::Distance { factor: 0.7 }, Downsampling::Subsample)
            .eye(DVec3::new(21.3, 40.2, 17.9), DVec3::new(60.0, 20.0, 30.0))
            .with(|s| s.division = Division::Brick)
    });
    placements.into_iter().chain(rules).chain([inside]).collect()
}

/// The paper's own form, nominal lengths: its pictures lack the same light.
fn nominal() -> Vec<Case> {
    let mut cases = Vec::new();
    for (placement, _) in PLACEMENTS {
        for division in [Division::Ray, Division::Brick] {
            let what = match division {
                Division::Ray => "rays",
                Division::Brick => "bricks",
            };
            let own = match division {
                Division::Ray if placement != Placement::Shells => catches![shader::NOMINAL_STRETCHED],
                _ => catches![],
            };
            let name = format!("nominal/{what}-{}", placement.name());
            let case = picture(name, [own, catches![ExtinctionScaled, AnchorHalfVoxel]].concat(), move || {
                placed(hills(&grid(), ScalarType::U8), soft(ScalarType::U8), placement)
                    .with(|s| (s.division, s.lengths) = (division, Lengths::Nominal))
            });
            cases.push(case);
        }
    }
    cases
}

fn extremes() -> Vec<Case> {
    let fog = || TransferFunction::constant(0.04, WARM).expect("a transfer function");
    let long = |(placement, division): (Placement, Division)| {
        let what = if division == Division::Ray { "rays" } else { "rays-in-bricks" };
        let name = format!("placement/long-{what}-{}", placement.name());
        picture(name, catches![shader::PASS_FORGETS, ExtinctionScaled], move || {
            placed(hills(&grid(), ScalarType::U8), soft(ScalarType::U8), placement).step(0.0006).with(|s| {
                s.size = UVec3::new(4, 3, 0).truncate();
                s.division = division;
            })
        })
    };
    // Where passes begin is counted in steps of level 0.
    let coarse = |(placement, _): (Placement, _)| {
        let name = format!("placement/long-rays-in-coarse-bricks-{}", placement.name());
        picture(name, catches![shader::PASS_FORGETS, ExtinctionScaled], move || {
            placed(hills(&grid(), ScalarType::U8), soft(ScalarType::U8), placement)
                .step(0.0006)
                .detail(Criterion::Uniform(Level(1)), Downsampling::Average)
                .with(|s| (s.size, s.division) = (UVec3::new(4, 3, 0).truncate(), Division::Brick))
        })
    };
    let far = |(placement, _): (Placement, _)| {
        let name = format!("placement/far-eye-{}", placement.name());
        picture(name, catches![ExtinctionScaled, AnchorHalfVoxel], move || {
            let center = grid().world_box().center();
            placed(hills(&grid(), ScalarType::U8), soft(ScalarType::U8), placement).lens(
                center + DVec3::new(3e4, 2e4, 1e4),
                center,
                0.0012,
            )
        })
    };
    let constant = |(placement, _): (Placement, _)| {
        let name = format!("bricks/constant-{}", placement.name());
        picture(name, catches![ExtinctionScaled, LastSegmentDropped], move || {
            placed(large(), fog(), placement)
                .detail(Criterion::Distance { factor: 1.0 }, Downsampling::Average)
                .eye(DVec3::new(-6.0, -14.0, 30.0), DVec3::new(35.0, 33.0, 26.0))
                .with(|s| s.division = Division::Brick)
        })
    };
    // Finer above y = 30.5 than below.
    let mixed = |placement| {
        let finer = Criterion::DistanceFrom { point: WorldPos(DVec3::new(50.0, 45.0, 45.0)), factor: 1.0 };
        placed(large(), soft(ScalarType::U16), placement)
            .detail(finer, Downsampling::Subsample)
            .with(|s| s.division = Division::Brick)
    };
    let in_a_face = |(placement, _): (Placement, _)| {
        let name = format!("bricks/rays-in-a-face-{}", placement.name());
        picture(name, catches![ExtinctionScaled], move || {
            // Below it by less than f32 can tell.
            let y = 30.5 - 1e-9;
            mixed(placement).lens(DVec3::new(-3.0, y, 26.0), DVec3::new(35.0, y, 26.0), 1.1).odd()
        })
    };
    let wide = |(placement, _): (Placement, _)| {
        let name = format!("placement/very-wide-{}", placement.name());
        picture(name, catches![ExtinctionScaled, AnchorHalfVoxel], move || {
            let eye = DVec3::new(21.3, 20.2, 17.9);
            placed(hills(&grid(), ScalarType::U8), soft(ScalarType::U8), placement).lens(
                eye,
                eye + DVec3::new(5.0, -2.0, 1.0),
                179.9f64.to_radians(),
            )
        })
    };
    let one_step = |(placement, _): (Placement, _)| {
        let name = format!("placement/one-step-{}", placement.name());
        picture(name, catches![ExtinctionScaled], move || {
            placed(hills(&grid(), ScalarType::U8), soft(ScalarType::U8), placement).step(3e7)
        })
    };
    // Along a slab from inside, looking down at a slant: the terms of a ray's direction cancel.
    let slab = |(placement, _): (Placement, _)| {
        let name = format!("bricks/slab-{}", placement.name());
        picture(name, catches![ExtinctionScaled, AnchorHalfVoxel], move || {
            let grid = Grid::axis_aligned(UVec3::new(250, 240, 18), DVec3::ONE).expect("a grid");
            let eye = DVec3::new(120.0, 20.0, 12.3);
            placed(hills(&grid, ScalarType::U16), soft(ScalarType::U16), placement)
                .detail(Criterion::Distance { factor: 1.0 }, Downsampling::Average)
                .lens(eye, eye + DVec3::new(0.2, 1.0, -0.6), 1.6)
                .with(|s| s.division = Division::Brick)
        })
    };
    let all = || PLACEMENTS.into_iter();
    let both = [Division::Ray, Division::Brick].into_iter();
    let long = both.flat_map(|division| PLACEMENTS.map(|(placement, _)| (placement, division))).map(long);
    long.chain(all().map(coarse))
        .chain(all().map(far))
        .chain(all().map(constant))
        .chain(all().map(in_a_face))
        .chain(all().map(wide))
        .chain(all().map(one_step))
        .chain(all().map(slab))
        .collect()
}
