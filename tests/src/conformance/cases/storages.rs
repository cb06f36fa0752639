//! Fields through a table of places: slots of several sizes, resolutions and axes, and averages between samples.

use brickfield::BlockStyle;
use brickfield::bricks::Downsampling;
use brickfield::frame::{Division, Join, Mode, Placement, Upload};
use brickfield::lod::Criterion;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BlockSide, BrickSide, Grid, Interblock, ScalarType};
use brickfield_optics::QuadratureRule;

use super::fields::{COOL, WARM, hills, knot, ramp, soft, sparse};
use super::setup::{FlatLevels, Setup, catches, picture};
use crate::conformance::case::Case;
use crate::conformance::plan_mutants::PlanMutant::*;
use crate::conformance::shader_mutants as shader;
use crate::conformance::storage::Storage;
use crate::volumes::spread;

const PACKED: Upload = Upload::Packed { max_error: 0 };

fn grid() -> Grid {
    Grid::axis_aligned(UVec3::new(71, 66, 53), DVec3::ONE).expect("a grid")
}

fn placed(scalar: ScalarType) -> Setup {
    Setup::new(hills(&grid(), scalar), soft(scalar)).stored(Storage::Placed)
}

/// Looks from near by: bricks of several levels.
fn from_near(setup: Setup) -> Setup {
    let detail = Criterion::Distance { factor: 1.0 };
    let (eye, target) = (DVec3::new(-4.0, -9.0, 20.0), DVec3::new(30.0, 30.0, 25.0));
    setup.detail(detail, Downsampling::Average).eye(eye, target)
}

pub(super) fn cases() -> Vec<Case> {
    vec![
        picture(
            "storage/placed",
            catches![AnchorHalfVoxel, DecodeOffset, shader::PLACED_AXES, shader::LERP_SWAPPED],
            || placed(ScalarType::U16),
        ),
        picture("storage/placed-gauss2-u8", catches![shader::PLACED_AXES, KnotMoved], || {
            placed(ScalarType::U8).rule(QuadratureRule::Gauss2)
        }),
        picture("storage/placed-levels", catches![shader::PLACED_SCALE], || from_near(placed(ScalarType::F32))),
        picture("storage/placed-brick-by-brick", catches![shader::PLACED_SCALE, shader::STEPS_OF_LEVEL_0], || {
            from_near(placed(ScalarType::U16)).with(|s| {
                (s.division, s.placement) = (Division::Brick, Placement::ViewportPlanes);
                s.rule = QuadratureRule::PreIntegrated;
            })
        }),
        picture("storage/placed-skipping", catches![shader::PLACED_AXES, IndexSwapped], || {
            let knots = [knot(0.3, 0.0, WARM), knot(0.9, 0.5, COOL)];
            let transfer = spread(&knots, ScalarType::U8).expect("knots ascend");
            Setup::new(sparse(&grid(), ScalarType::U8), transfer).stored(Storage::Placed)
        }),
        picture("storage/placed-fast", catches![shader::PLACED_AXES, shader::HALF_TEXEL], || {
            placed(ScalarType::U16).with(|s| s.mode = Mode::FAST)
        }),
        picture("storage/packed", catches![shader::UNPACKED_UNSIGNED, shader::UNDONE_AXES, DecodeOffset], || {
            Setup::new(hills(&grid(), ScalarType::I16), soft(ScalarType::I16)).with(|s| s.upload = PACKED)
        }),
        picture("storage/packed-u8", catches![shader::UNDONE_TOWARD_ZERO, shader::UNPREDICTED], || {
            Setup::new(hills(&grid(), ScalarType::U8), soft(ScalarType::U8)).side(BrickSide::S32).with(|s| {
                (s.upload, s.rule) = (PACKED, QuadratureRule::PreIntegrated);
            })
        }),
        picture("storage/packed-lossy-levels", catches![shader::UNPACKED_STEP], || {
            from_near(Setup::new(hills(&grid(), ScalarType::U16), soft(ScalarType::U16)))
                .with(|s| (s.upload, s.mode) = (Upload::Packed { max_error: 40 }, Mode::FAST))
        }),
        picture("storage/packed-blocks", catches![shader::UNPACKED_UNSIGNED, shader::UNDONE_AXES], || {
            let style = BlockStyle { join: Join::Blend(Interblock::MaximumDistance), ..BlockStyle::default() };
            Setup::new(hills(&grid(), ScalarType::I8), soft(ScalarType::I8))
                .blocks(BlockSide::V16, FlatLevels::Random, style)
                .with(|s| s.upload = PACKED)
        }),
        picture("storage/averages", catches![shader::PLACED_FIRST, shader::PLACED_SCALE, AnchorHalfVoxel], || {
            let volume = ramp(&Grid::axis_aligned(UVec3::new(61, 47, 33), DVec3::ONE).expect("a grid"));
            Setup::new(volume, soft(ScalarType::F32)).stored(Storage::Averages)
        }),
    ]
}
