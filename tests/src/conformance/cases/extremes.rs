//! Pictures that must stay finite, bounded and equal on all backends at the ends of every range.

use brickfield_core::glam::{DMat3, DVec3, UVec2, UVec3};
use brickfield_core::{Grid, Rescale, ScalarType, TransferFunction, Volume};
use brickfield_optics::QuadratureRule;

use super::fields::{COOL, DIMS, WARM, ball, constant, grid, hills, knot, soft};
use super::setup::{Setup, catches, picture};
use crate::conformance::case::Case;
use crate::conformance::plan_mutants::PlanMutant::*;
use crate::conformance::shader_mutants as shader;
use crate::volumes::spread;

pub(super) fn cases() -> Vec<Case> {
    [depths(), voxels(), shapes(), places(), long_rays()].into_iter().flatten().collect()
}

/// tau h from 1e-12 to 1e12, with all values between on one ray.
fn depths() -> Vec<Case> {
    let thin = |tau: f64| move || Setup::new(constant(&grid(), ScalarType::U8, 0.4), transfer(tau));
    let scaled = |top: f64, rule| {
        move || {
            let knots = [knot(0.2, 0.0, WARM), knot(0.9, top, COOL)];
            let transfer = spread(&knots, ScalarType::F32).expect("knots ascend");
            Setup::new(ball(&grid(), ScalarType::F32), transfer).rule(rule)
        }
    };
    let mut cases = vec![
        // alpha = 1 - e^-x without the series gives 0 for tau h = 1e-8, hence a picture of 0 instead of 2e-4.
        picture("extreme/tau-1e-5", catches![shader::ALPHA_CANCELS], move || {
            // 2,000 steps of tau h = 5e-8: their sum is visible, each of them is below the digits of 1 - e^-x.
            thin(2.5e-6)().step(0.02).with(|s| s.size = UVec2::splat(24))
        }),
        picture("extreme/tau-1e12", catches![KnotMoved, AnchorHalfVoxel, RowsFlipped], move || {
            scaled(1e12, QuadratureRule::MidpointExponential)()
        }),
        picture("extreme/alpha-1", catches![DomainAtSamples, RedBlueSwapped], || {
            let depth = brickfield_optics::depth(1.0);
            Setup::new(constant(&grid(), ScalarType::U8, 0.4), transfer(2.0 * depth))
        }),
    ];
    cases.push(picture("extreme/tau-1e-12-to-1e12", catches![KnotMoved, DecodeOffset, shader::ALPHA_LINEAR], || {
        let knots = [(0.2, 1e-12), (0.35, 1e-6), (0.45, 1e-2), (0.6, 1.0), (0.75, 1e3), (0.9, 1e12)];
        let knots = knots.map(|(value, extinction)| knot(value, extinction, [value, 1.0 - value, 0.5]));
        Setup::new(hills(&grid(), ScalarType::F32), spread(&knots, ScalarType::F32).expect("knots ascend"))
    }));
    cases
}

fn transfer(tau: f64) -> TransferFunction {
    TransferFunction::constant(tau, WARM).expect("a constant")
}

/// NaN, infinities and denormals among the voxels.
fn voxels() -> Vec<Case> {
    let spoiled = || {
        let honest = hills(&grid(), ScalarType::F32);
        let value = |i: usize| match i % 97 {
            3 => f32::NAN,
            31 => f32::INFINITY,
            59 => f32::NEG_INFINITY,
            61 => 1e-40,
            _ => honest.value(i) as f32,
        };
        Volume::new(grid(), (0..honest.voxels().len()).map(value).collect::<Vec<f32>>()).expect("as many voxels")
    };
    let times = |unit: f64| {
        let honest = hills(&grid(), ScalarType::F64);
        let values = (0..honest.voxels().len()).map(|i| unit * (honest.value(i) - 0.5));
        Volume::new(grid(), values.collect::<Vec<f64>>()).expect("as many voxels")
    };
    let tiny = || {
        let honest = hills(&grid(), ScalarType::F32);
        let values = (0..honest.voxels().len()).map(|i| (1e-42 * honest.value(i)) as f32);
        Volume::new(grid(), values.collect::<Vec<f32>>()).expect("as many voxels")
    };
    let offset = || {
        let honest = hills(&grid(), ScalarType::F64);
        let values = (0..honest.voxels().len()).map(|i| 1e9 + honest.value(i));
        Volume::new(grid(), values.collect::<Vec<f64>>()).expect("as many voxels")
    };
    let over = |low: f64, high: f64| {
        let knots = [knot(low, 0.0, WARM), knot(0.5 * low + 0.5 * high, 0.1, WARM), knot(high, 0.2, COOL)];
        TransferFunction::new(knots.into()).expect("knots ascend")
    };
    let rescaled = move |scalar, slope: f64, intercept: f64| {
        let stored = hills(&grid(), scalar);
        let rescale = Rescale::new(slope, intercept).expect("a slope that is not 0");
        let volume = Volume::rescaled(grid(), stored.voxels().clone(), rescale).expect("as many voxels, all finite");
        let range = volume.range();
        let at = |share: f64| range.min + share * (range.max - range.min);
        Setup::new(volume, over(at(0.3), at(0.8)))
    };
    vec![
        picture("extreme/nan-and-infinity", catches![BricksShifted, shader::NEAREST, KnotMoved], move || {
            Setup::new(spoiled(), soft(ScalarType::F32))
        }),
        picture("extreme/offset-1e9", catches![DecodeOffset, KnotMoved], move || {
            Setup::new(offset(), over(1e9 + 0.2, 1e9 + 0.9))
        }),
        // Seven of 65,536 values, in the middle, where a fraction has too few digits for a value between two of them.
        picture("extreme/16-bits-narrow", catches![shader::FRACTIONS_OF_16_BITS, KnotMoved], move || {
            let honest = hills(&grid(), ScalarType::F32);
            let counts = (0..honest.voxels().len()).map(|i| (8.0 * (honest.value(i) - 0.5)).round() as i16);
            let volume = Volume::new(grid(), counts.collect::<Vec<i16>>()).expect("as many voxels");
            Setup::new(volume, over(-3.0, 3.0)).step(0.25)
        }),
        // Stored integers, of which the greatest stands for the least value.
        picture("extreme/rescaled-u8", catches![DecodeOffset, KnotMoved, shader::NEAREST], move || {
            rescaled(ScalarType::U8, -0.037, 12.5)
        }),
        picture("extreme/rescaled-i16", catches![DecodeOffset, KnotMoved], move || {
            rescaled(ScalarType::I16, 2.5e-4, -1000.0)
        }),
        picture("extreme/rescaled-i32", catches![BricksShifted, KnotMoved], move || {
            rescaled(ScalarType::I32, -1e-6, 1e3)
        }),
        picture("extreme/values-1e30", catches![RedBlueSwapped, ExtinctionScaled], move || {
            Setup::new(times(1e30), over(-3e29, 4e29))
        }),
        picture("extreme/values-1e300", catches![BricksShifted, KnotMoved, shader::NEAREST], move || {
            Setup::new(times(1e300), over(-3e299, 4e299))
        }),
        picture("extreme/values-1e-299", catches![BricksShifted, KnotMoved, shader::NEAREST], move || {
            Setup::new(times(1e-299), over(-3e-300, 4e-300))
        }),
        // The values' range is all that is visible, and 100 orders of magnitude from the last knot.
        picture("extreme/knots-far-apart", catches![RedBlueSwapped, ExtinctionScaled], move || {
            let knots = [knot(-1e100, 0.1, WARM), knot(1e100, 0.2, COOL)];
            Setup::new(times(1.0), TransferFunction::new(knots.into()).expect("knots ascend"))
        }),
        picture("extreme/denormals-told-apart", catches![BricksShifted, KnotMoved, shader::NEAREST], move || {
            Setup::new(tiny(), over(2e-43, 7e-43))
        }),
        picture("extreme/denormals", catches![RedBlueSwapped, ExtinctionScaled], move || {
            Setup::new(tiny(), over(-1.0, 1.0))
        }),
    ]
}

/// 1 x 1 x N and its like.
fn shapes() -> Vec<Case> {
    let of = |dims: [u32; 3], spacing: [f64; 3]| {
        move || {
            let grid = Grid::axis_aligned(dims.into(), spacing.into()).expect("a grid");
            Setup::new(hills(&grid, ScalarType::U16), soft(ScalarType::U16))
        }
    };
    let cube = [1.0; 3];
    vec![
        picture("extreme/1x1x50", catches![LastSampleCut, ExtinctionScaled, IndexSwapped], move || {
            of([1, 1, 50], [9.0, 9.0, 1.0])().step(0.7)
        }),
        picture(
            "extreme/60x1x1",
            catches![BricksShifted, ExtinctionScaled, IndexSwapped],
            of([60, 1, 1], [1.0, 12.0, 12.0]),
        ),
        picture(
            "extreme/1x47x30",
            catches![BricksTransposed, AnchorHalfVoxel, shader::INDEX_STRIDE],
            of([1, 47, 30], cube),
        ),
        picture("extreme/one-voxel", catches![ExtinctionScaled, DomainAtSamples, shader::LAST_NOT_CUT], move || {
            of([1, 1, 1], [30.0; 3])().step(0.13)
        }),
        picture("extreme/2x2x2", catches![BricksShifted, shader::NEAREST, shader::NO_CLAMP], move || {
            of([2, 2, 2], [20.0; 3])().step(0.02)
        }),
        picture("extreme/brick-and-one", catches![BricksShifted, LastSampleCut], of([17, 16, 31], cube)),
        picture("extreme/spacing-1-to-1000", catches![AnchorHalfVoxel, ExtinctionScaled], || {
            // Down the long voxels: a thousand samples in each.
            long_voxels().parallel(DVec3::new(0.004, 0.007, -1.0), 44.0).step(2.0)
        }),
        picture("extreme/spacing-1-to-1000-across", catches![BricksTransposed, PixelCorner], || {
            long_voxels().eye(DVec3::new(-12.0, -9.0, 1400.0), DVec3::new(16.0, 16.0, 1500.0))
        }),
    ]
}

fn long_voxels() -> Setup {
    let grid = Grid::axis_aligned(UVec3::new(33, 29, 3), DVec3::new(1.0, 1.0, 1000.0)).expect("a grid");
    let knots = [knot(0.0, 0.0, WARM), knot(1.0, 0.01, COOL)];
    let transfer = spread(&knots, ScalarType::U16).expect("knots ascend");
    Setup::new(hills(&grid, ScalarType::U16), transfer)
}

/// Rays that no GPU backend marches in one go.
fn long_rays() -> Vec<Case> {
    // 999 knots up and down, so that every segment crosses many: the shaders search them in a loop.
    let comb = || {
        let knot_at = |i: u32| {
            let value = f64::from(i) / 998.0;
            knot(value, 0.02 + 0.06 * f64::from(i % 2), [value, 0.5, 1.0 - value])
        };
        spread(&(0..999).map(knot_at).collect::<Vec<_>>(), ScalarType::F32).expect("knots ascend")
    };
    let seen_by_few = |s: &mut brickfield::Scene| s.size = UVec2::new(3, 2);
    vec![
        picture("extreme/a-million-samples", catches![shader::PASS_FORGETS, shader::PASS_RESTARTS], move || {
            let setup = Setup::new(hills(&grid(), ScalarType::U16), soft(ScalarType::U16));
            setup.step(4e-5).parallel(DVec3::new(1.0, 0.02, 0.03), 24.0).with(seen_by_few)
        }),
        picture("extreme/many-pieces", catches![shader::PASS_FORGETS, shader::NO_ATTENUATION], move || {
            let setup = Setup::new(hills(&grid(), ScalarType::F32), comb()).rule(QuadratureRule::PreIntegrated);
            setup.step(0.25)
        }),
    ]
}

/// Far from the world's origin, far from the volume, and in the middle of a voxel.
fn places() -> Vec<Case> {
    let far_grid = || {
        let first = DVec3::new(1e7, -1e7, 1e7);
        Grid::from_first_sample(DIMS, DVec3::new(1.0, 0.8, 1.3), first, DMat3::IDENTITY).expect("a grid")
    };
    vec![
        picture(
            "extreme/origin-1e7",
            catches![AnchorHalfVoxel, StepScaled, PixelCorner, shader::FLAT_SHELLS],
            move || Setup::new(hills(&far_grid(), ScalarType::U16), soft(ScalarType::U16)),
        ),
        picture("extreme/eye-1e5-away", catches![AnchorHalfVoxel, PixelCorner], || {
            let setup = Setup::new(hills(&grid(), ScalarType::U16), soft(ScalarType::U16));
            setup.with(|s| {
                let target = DVec3::new(20.0, 18.0, 16.5);
                let eye = target + DVec3::new(0.6, -1.0, 0.35) * 1e5;
                let fov_y = 5e-4;
                let projection = brickfield_core::Projection::Perspective { fov_y };
                let camera = brickfield_core::Camera::look_at(eye, target, DVec3::Z, projection);
                s.camera = camera.expect("a camera");
            })
        }),
        picture(
            "extreme/eye-in-a-voxel",
            catches![AnchorHalfVoxel, BricksShifted, BehindTheEye, shader::LAST_NOT_CUT],
            || {
                let setup = Setup::new(hills(&grid(), ScalarType::U16), soft(ScalarType::U16)).step(0.05);
                let eye = DVec3::new(20.31, 17.77, 16.12);
                setup.eye(eye, eye + DVec3::new(0.2, 0.3, -0.1)).with(|s| s.size = UVec2::splat(32))
            },
        ),
    ]
}
