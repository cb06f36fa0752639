//! Where the eye can be, and how rays can run.

use brickfield::Skipping;
use brickfield_core::ScalarType;
use brickfield_core::glam::{DVec3, UVec2};

use super::fields::{grid, hills, skew_grid, soft};
use super::setup::{OBLIQUE, Setup, catches, picture};
use crate::conformance::case::{Case, Mutant};
use crate::conformance::plan_mutants::PlanMutant::*;
use crate::conformance::shader_mutants as shader;

pub(super) fn cases() -> Vec<Case> {
    [eyes(), projections(), axes(), clips()].into_iter().flatten().collect()
}

fn subject() -> Setup {
    Setup::new(hills(&grid(), ScalarType::U16), soft(ScalarType::U16))
}

fn eyes() -> Vec<Case> {
    let case = |name, mutants: Vec<Mutant>, eye: [f64; 3], target: [f64; 3]| {
        picture(name, mutants, move || subject().eye(eye.into(), target.into()))
    };
    let far = [20.0, 14.5, 13.5];
    vec![
        case("eye/outside", catches![NotNormalised, Parallel, shader::NOT_NORMALISED], [61.0, -40.0, 33.0], far),
        case("eye/far", catches![AnchorHalfVoxel, StepScaled, shader::PIXEL_CORNER], [30.0, -90.0, 12.0], far),
        case(
            "eye/inside",
            catches![AnchorHalfVoxel, PixelCorner, BehindTheEye, shader::LAST_NOT_CUT],
            [17.3, 12.1, 20.9],
            [40.0, 30.0, 5.0],
        ),
        case(
            "eye/in-a-voxel-centre",
            catches![AnchorHalfVoxel, shader::NEAREST],
            [10.5, 11.5, 12.5],
            [30.0, 31.0, 25.0],
        ),
        case("eye/on-a-face", catches![AnchorHalfVoxel, RowsFlipped, PixelCorner], [20.0, 0.0, 16.0], far),
        case(
            "eye/on-a-brick-face",
            catches![IndexSwapped, shader::INDEX_STRIDE],
            [15.5, 15.5, 15.5],
            [30.0, 24.0, 18.0],
        ),
        // No ray within ten degrees of a face: where a ray enters along one, f32 knows only to rounding / slope.
        picture("eye/on-a-corner", catches![BricksShifted, shader::LAST_NOT_CUT], move || {
            subject().lens(DVec3::ZERO, DVec3::from(far), 0.5)
        }),
        picture("eye/looks-away", catches![BehindTheEye], || {
            let eye = DVec3::new(20.0, -12.0, 13.5);
            let away = subject().eye(eye, eye - DVec3::Y).blank();
            away.with(|s| s.skipping = Skipping::Off)
        }),
        case("eye/just-outside", catches![LastSegmentDropped, shader::LAST_DROPPED], [20.0, -1e-3, 16.0], far),
    ]
}

fn projections() -> Vec<Case> {
    vec![
        picture("projection/perspective", catches![Parallel, NotNormalised, PixelCorner, shader::FLAT_SHELLS], || {
            subject().step(2.3)
        }),
        picture("projection/parallel", catches![PixelCorner, RowsFlipped, StepScaled, shader::PIXEL_CORNER], || {
            subject().parallel(-OBLIQUE, 50.0)
        }),
        picture("projection/parallel-skew", catches![BricksTransposed, AnchorHalfVoxel], || {
            Setup::new(hills(&skew_grid(), ScalarType::U16), soft(ScalarType::U16))
                .parallel(DVec3::new(1.0, 0.3, -0.8), 60.0)
        }),
    ]
}

/// Rays along each axis, both ways. With a picture 28 units high of 56 rows every ray runs in a plane of a quarter voxel;
/// with 56 units through planes between samples, bricks' faces among them.
fn axes() -> Vec<Case> {
    let ways =
        [("+x", DVec3::X), ("-x", -DVec3::X), ("+y", DVec3::Y), ("-y", -DVec3::Y), ("+z", DVec3::Z), ("-z", -DVec3::Z)];
    let all = ways.map(|(name, way)| {
        let mutants = catches![PixelCorner, BricksShifted, DomainAtSamples, BorderNotShared, shader::NEAREST];
        let mutants = if way.x == 0.0 { mutants } else { catches![PixelCorner, DomainAtSamples, shader::NEAREST] };
        picture(format!("axis/{name}"), mutants, move || subject().parallel(way, 28.0))
    });
    let whole = picture("axis/sample-planes", catches![PixelCorner, LastSegmentDropped, shader::LAST_DROPPED], || {
        subject().parallel(DVec3::X, 56.0)
    });
    let central = picture("axis/perspective", catches![PixelCorner, NotNormalised, shader::NOT_NORMALISED], || {
        // An odd picture: its central ray is parallel to the axis, in a plane of samples.
        let setup = subject().eye(DVec3::new(-30.0, 14.5, 13.5), DVec3::new(20.0, 14.5, 13.5));
        setup.with(|s| s.size = UVec2::new(65, 57))
    });
    all.into_iter().chain([whole, central]).collect()
}

fn clips() -> Vec<Case> {
    vec![
        picture("clip/box", catches![ClipIgnored, LastSegmentDropped, shader::LAST_NOT_CUT], || {
            subject().clip([-5.0, 4.3, 2.0], [21.7, 99.0, 30.5])
        }),
        picture("clip/outside", catches![ClipIgnored], || {
            subject().clip([50.0, 0.0, 0.0], [60.0, 9.0, 9.0]).with(|s| s.skipping = Skipping::Off).blank()
        }),
        picture("clip/thin", catches![AnchorHalfVoxel, ExtinctionScaled, shader::LAST_NOT_CUT], || {
            subject().clip([10.0, 0.0, 0.0], [10.2, 36.0, 33.0])
        }),
        picture("clip/eye-in-the-cut", catches![AnchorHalfVoxel, shader::FIRST_NOT_CUT], || {
            subject()
                .clip([0.0, 10.0, 0.0], [40.0, 36.0, 33.0])
                .eye(DVec3::new(20.0, 5.0, 16.0), DVec3::new(22.0, 30.0, 14.0))
        }),
    ]
}
