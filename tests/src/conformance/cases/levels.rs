//! Brick sides, coarser levels, cuts of several levels, and empty blocks.

use brickfield::bricks::Downsampling;
use brickfield::lod::Criterion;
use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BrickSide, Grid, Level, ScalarType, TransferFunction, Volume};
use brickfield_optics::QuadratureRule;

use super::fields::{COOL, WARM, checkers, grid, hills, jump, knot, ramp, soft, sparse};
use super::setup::{Setup, catches, picture};
use crate::conformance::case::Case;
use crate::conformance::plan_mutants::PlanMutant::*;
use crate::conformance::shader_mutants as shader;
use crate::volumes::{fill_unit, spread};

pub(super) fn cases() -> Vec<Case> {
    [sides(), coarse(), mixed(), skipping()].into_iter().flatten().collect()
}

/// 5 x 5 x 4 bricks of 16, a divisor of nothing.
fn large() -> Volume {
    hills(&Grid::axis_aligned(UVec3::new(71, 66, 53), DVec3::ONE).expect("a grid"), ScalarType::U16)
}

/// All levels end at the last sample: 4 x 4 x 2 bricks of 16.
fn even_ramp() -> Volume {
    ramp(&Grid::axis_aligned(UVec3::new(61, 61, 31), DVec3::ONE).expect("a grid"))
}

fn transfer() -> TransferFunction {
    soft(ScalarType::U16)
}

fn sides() -> Vec<Case> {
    let one = |side: BrickSide| {
        picture(format!("brick/{side}"), catches![BricksShifted, BricksTransposed, shader::OVERSTAYS], move || {
            Setup::new(large(), transfer()).side(side)
        })
    };
    let whole = picture("brick/one-brick", catches![BricksTransposed, BricksShifted, shader::NEAREST], || {
        Setup::new(hills(&grid(), ScalarType::U16), transfer()).side(BrickSide::S64)
    });
    let mut cases: Vec<Case> = BrickSide::ALL.map(one).into();
    // One brick holds the whole volume of 64: nothing to overstay in.
    cases[2].mutants = catches![BricksShifted, BricksTransposed, IndexSwapped];
    cases.push(whole);
    cases
}

fn coarse() -> Vec<Case> {
    let uniform = |level| Criterion::Uniform(Level(level));
    let of = |name, level, downsampling| {
        let mutants = catches![WrongLevel, BricksShifted, shader::LEVEL_SCALE, shader::BLOCK_CORNER];
        picture(name, mutants, move || Setup::new(large(), transfer()).detail(uniform(level), downsampling))
    };
    vec![
        of("level/1-average", 1, Downsampling::Average),
        of("level/1-subsample", 1, Downsampling::Subsample),
        of("level/2-average", 2, Downsampling::Average),
        picture("level/ramp-at-level-1", catches![WrongLevel, AnchorHalfVoxel, shader::LEVEL_SCALE], move || {
            Setup::new(even_ramp(), soft(ScalarType::F32)).detail_reproduced(uniform(1))
        }),
        picture("level/root", catches![WrongLevel, BricksTransposed, shader::LEVEL_SCALE], move || {
            Setup::new(large(), transfer()).detail(uniform(31), Downsampling::Average)
        }),
    ]
}

/// Cuts of several levels: faces where the field jumps.
fn mixed() -> Vec<Case> {
    let near = DVec3::new(-6.0, -14.0, 30.0);
    let distance = |factor| Criterion::Distance { factor };
    let of = |name, factor, rule| {
        let mutants = catches![WrongLevel, BricksShifted, shader::LEVEL_SCALE, shader::BLOCK_CORNER];
        picture(name, mutants, move || {
            Setup::new(large(), transfer())
                .detail(distance(factor), Downsampling::Average)
                .eye(near, DVec3::new(35.0, 33.0, 26.0))
                .rule(rule)
        })
    };
    vec![
        of("cut/several-levels", 1.0, QuadratureRule::MidpointExponential),
        of("cut/several-levels-preintegrated", 1.0, QuadratureRule::PreIntegrated),
        of("cut/several-levels-gauss2", 1.3, QuadratureRule::Gauss2),
        picture("cut/ramp-on-several-levels", catches![WrongLevel, AnchorHalfVoxel, shader::BLOCK_CORNER], move || {
            Setup::new(even_ramp(), soft(ScalarType::F32))
                .detail_reproduced(distance(1.0))
                .eye(DVec3::new(-6.0, -14.0, 20.0), DVec3::new(30.0, 30.0, 15.0))
        }),
        // Coarse voxels across the edge between two dark values see the values between; fine ones see the edge itself.
        picture("cut/dark-on-both-sides", catches![WrongLevel, shader::LEVEL_SCALE], || {
            let grid = Grid::axis_aligned(UVec3::new(71, 66, 53), DVec3::ONE).expect("a grid");
            let edge = |i: usize| if i % 71 <= 30 { 51u8 } else { 230 };
            let volume =
                Volume::new(grid, (0..grid.n_voxels()).map(edge).collect::<Vec<u8>>()).expect("as many voxels");
            let knots = [knot(56.0, 0.0, WARM), knot(74.0, 0.9, WARM), knot(92.0, 0.0, COOL)];
            let beside = brickfield_core::WorldPos(DVec3::new(-20.0, 33.0, 26.0));
            Setup::new(volume, TransferFunction::new(knots.into()).expect("knots ascend"))
                .detail(Criterion::DistanceFrom { point: beside, factor: 1.0 }, Downsampling::Average)
                .rule(QuadratureRule::PreIntegrated)
                .step(0.9)
        }),
        picture("cut/several-levels-sparse", catches![VisibleTooSmall, WrongLevel, shader::LEVEL_SCALE], move || {
            let grid = Grid::axis_aligned(UVec3::new(71, 66, 53), DVec3::ONE).expect("a grid");
            Setup::new(sparse(&grid, ScalarType::U8), soft(ScalarType::U8))
                .detail(distance(1.0), Downsampling::Average)
                .eye(near, DVec3::new(35.0, 33.0, 26.0))
        }),
    ]
}

/// Skipping changes no sample: the reference has every brick.
fn skipping() -> Vec<Case> {
    let scene = || {
        let knots = [knot(0.05, 0.0, WARM), knot(0.5, 0.08, WARM), knot(1.0, 0.2, COOL)];
        let transfer = spread(&knots, ScalarType::U8).expect("knots ascend");
        Setup::new(checkers(UVec3::new(71, 66, 53)), transfer)
    };
    let rule = |rule: QuadratureRule| {
        // Pre-integration keeps a margin of bricks around visible ones: a jump may go too far there unseen.
        let mutants = match rule {
            QuadratureRule::PreIntegrated => catches![VisibleTooSmall, BrickTransparent],
            _ => catches![VisibleTooSmall, shader::JUMPS_TOO_FAR, ExtinctionScaled],
        };
        picture(format!("skip/{}", rule.name()), mutants, move || scene().rule(rule).step(0.9))
    };
    let mut cases: Vec<Case> = QuadratureRule::ALL.map(rule).into();
    cases.push(picture("skip/long-steps-preintegrated", catches![VisibleTooSmall, ExtinctionScaled], move || {
        scene().rule(QuadratureRule::PreIntegrated).step(11.0)
    }));
    // Longer than two bricks: some segments begin in a bright layer and end in the dark far behind it.
    cases.push(picture("skip/longer-steps-preintegrated", catches![ExtinctionScaled], || {
        let grid = Grid::axis_aligned(UVec3::new(71, 66, 53), DVec3::ONE).expect("a grid");
        let layer = fill_unit(&grid, ScalarType::U8, |p| if p.x < 14.0 { 0.9 } else { 0.1 });
        Setup::new(layer, soft(ScalarType::U8))
            .rule(QuadratureRule::PreIntegrated)
            .step(34.0)
            .eye(DVec3::new(-90.0, 33.0, 26.0), DVec3::new(35.0, 33.0, 26.0))
    }));
    // Inside bricks: much of them is dark, at every side of bricks.
    for side in BrickSide::ALL {
        for rule in [QuadratureRule::MidpointExponential, QuadratureRule::PreIntegrated, QuadratureRule::Gauss2] {
            let mutants = match rule {
                QuadratureRule::MidpointExponential => catches![shader::LEAPS_TOO_FAR, shader::MACROCELL_ROW],
                _ => catches![shader::MACROCELL_ROW, ExtinctionScaled],
            };
            let case = picture(format!("skip/macrocells-{side}-{}", rule.name()), mutants, move || {
                Setup::new(sparse(&grid(), ScalarType::U8), soft(ScalarType::U8)).side(side).rule(rule).step(0.4)
            });
            cases.push(case);
        }
    }
    // Both nodes of a long segment may be dark, and values between them visible.
    for rule in [QuadratureRule::PreIntegrated, QuadratureRule::Gauss2] {
        let mutants = catches![shader::FAR_NODE_FORGOTTEN, RowsFlipped];
        let case = picture(format!("skip/dark-on-both-sides-{}", rule.name()), mutants, move || {
            let knots = [knot(0.3, 0.0, WARM), knot(0.5, 0.6, WARM), knot(0.7, 0.0, COOL)];
            let transfer = spread(&knots, ScalarType::U8).expect("knots ascend");
            Setup::new(jump(&grid()), transfer).side(BrickSide::S64).rule(rule).step(2.0)
        });
        cases.push(case);
    }
    cases.push(picture("skip/beams", catches![shader::BEAM_MIRRORED, shader::BEAM_HALVED], || {
        Setup::new(sparse(&grid(), ScalarType::U8), soft(ScalarType::U8)).step(0.4)
    }));
    // So many pixels that tiles have 16 a side.
    cases.push(picture("skip/beams-of-large-pictures", catches![shader::BEAM_MIRRORED], || {
        Setup::new(sparse(&grid(), ScalarType::U8), soft(ScalarType::U8))
            .with(|s| (s.step_voxels, s.size) = (2.0, UVec2::new(530, 510)))
    }));
    cases.push(picture("skip/parallel", catches![VisibleTooSmall, shader::JUMPS_TOO_FAR], move || {
        scene().parallel(DVec3::X, 60.0)
    }));
    cases.push(picture("skip/two-balls", catches![VisibleTooSmall, GhostBricks], || {
        let grid = Grid::axis_aligned(UVec3::new(71, 66, 53), DVec3::ONE).expect("a grid");
        Setup::new(sparse(&grid, ScalarType::U8), soft(ScalarType::U8))
    }));
    cases.push(picture("skip/nothing-visible", catches![GhostBricks], || {
        let knots = [knot(0.95, 0.0, WARM), knot(1.0, 0.3, COOL)];
        Setup::new(large(), spread(&knots, ScalarType::U16).expect("knots ascend")).blank()
    }));
    cases.push(picture("skip/central-brick", catches![BrickTransparent, VisibleTooSmall], || {
        let knots = [knot(0.55, 0.0, WARM), knot(0.8, 0.3, COOL)];
        Setup::new(large(), spread(&knots, ScalarType::U16).expect("knots ascend"))
    }));
    cases
}
