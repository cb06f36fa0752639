//! Proxy geometry: the same samples through the rasteriser and blending.

use brickfield::Technique;
use brickfield::bricks::Downsampling;
use brickfield::frame::{Division, Lengths, Placement, Target};
use brickfield::lod::Criterion;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Grid, ScalarType, TransferFunction, Volume, WorldPos};
use brickfield_optics::QuadratureRule;

use super::fields::{WARM, checkers, grid, hills, skew_grid, soft};
use super::setup::{Setup, catches, picture};
use crate::conformance::case::{Case, Mutant};
use crate::conformance::plan_mutants::PlanMutant::*;
use crate::conformance::shader_mutants as shader;

const FACETS: Placement = Placement::TessellatedShells { facet_pixels: 12 };
const PLACEMENTS: [Placement; 3] = [FACETS, Placement::ViewportPlanes, Placement::ObjectPlanes];

pub(super) fn cases() -> Vec<Case> {
    [plain(), levels(), rules(), views(), degenerate(), nominal(), targets(), stiff()].into_iter().flatten().collect()
}

fn large() -> Volume {
    hills(&Grid::axis_aligned(DVec3::new(71.0, 66.0, 53.0).as_uvec3(), DVec3::ONE).expect("a grid"), ScalarType::U16)
}

/// A scene of polygons, two voxels apart.
fn polygons(volume: Volume, transfer: TransferFunction, placement: Placement) -> Setup {
    Setup::new(volume, transfer).step(2.0).with(|s| {
        (s.placement, s.division, s.technique) = (placement, Division::Brick, Technique::Polygons(Target::Float32));
    })
}

fn each(
    name: &str,
    mutants: Vec<Mutant>,
    setup: impl Fn(Placement) -> Setup + Clone + Send + Sync + 'static,
) -> Vec<Case> {
    let case = |placement: Placement| {
        let setup = setup.clone();
        picture(format!("polygons/{name}-{}", placement.name()), mutants.clone(), move || setup(placement))
    };
    PLACEMENTS.into_iter().map(case).collect()
}

fn plain() -> Vec<Case> {
    let faces = catches![PolygonsReversed, PolygonsMissing, ExitsMissing, shader::POLYGON_NOT_CUT];
    let one = each("one-level", faces.clone(), |p| polygons(hills(&grid(), ScalarType::U8), soft(ScalarType::U8), p));
    let skew = each("skew", catches![PolygonsReversed, shader::LAST_SURFACE_BESIDE], |p| {
        polygons(hills(&skew_grid(), ScalarType::I16), soft(ScalarType::I16), p)
    });
    let skip = each("skip", catches![PolygonsMissing, shader::FOREIGN_BRICK], |p| {
        polygons(checkers(DVec3::new(71.0, 66.0, 53.0).as_uvec3()), soft(ScalarType::U8), p)
    });
    let clip = each("clip", catches![ExitsMissing, ClipIgnored], |p| {
        polygons(hills(&grid(), ScalarType::U8), soft(ScalarType::U8), p).clip([3.3, 1.1, 4.5], [31.2, 22.7, 26.0])
    });
    [one, skew, skip, clip].into_iter().flatten().collect()
}

fn levels() -> Vec<Case> {
    let of_levels = |p| {
        polygons(large(), soft(ScalarType::U16), p)
            .detail(Criterion::Distance { factor: 1.0 }, Downsampling::Average)
            .eye(DVec3::new(-6.0, -14.0, 30.0), DVec3::new(35.0, 33.0, 26.0))
            .step(0.8)
    };
    let constant = |p| {
        polygons(large(), TransferFunction::constant(0.04, WARM).expect("a transfer function"), p)
            .detail(Criterion::Distance { factor: 1.0 }, Downsampling::Average)
            .eye(DVec3::new(-6.0, -14.0, 30.0), DVec3::new(35.0, 33.0, 26.0))
    };
    let several = each("several-levels", catches![PolygonsReversed, ExitsMissing, shader::STEPS_OF_LEVEL_0], of_levels);
    several.into_iter().chain(each("constant", catches![PolygonsMissing, ExitsMissing], constant)).collect()
}

fn rules() -> Vec<Case> {
    let case = |rule: QuadratureRule| {
        picture(format!("polygons/rule-{}", rule.name()), catches![PolygonsMissing, ExtinctionScaled], move || {
            polygons(hills(&grid(), ScalarType::U8), soft(ScalarType::U8), Placement::ObjectPlanes).rule(rule)
        })
    };
    QuadratureRule::ALL.into_iter().map(case).collect()
}

/// Edge-on, along a diagonal, from inside, through a very wide lens, with parallel rays.
fn views() -> Vec<Case> {
    let scene = |p| polygons(large(), soft(ScalarType::U16), p);
    let center = DVec3::new(35.0, 33.0, 26.0);
    let along = move |p, direction: DVec3| scene(p).eye(center - direction * 90.0, center);
    let inside = move |p| scene(p).eye(DVec3::new(21.3, 40.2, 17.9), DVec3::new(60.0, 20.0, 30.0));
    let on_a_face = move |p| scene(p).eye(DVec3::new(30.5, 45.5, 17.9), DVec3::new(60.0, 20.0, 30.0));
    let wide = move |p| scene(p).lens(DVec3::new(21.3, 40.2, 17.9), DVec3::new(60.0, 20.0, 30.0), 2.9);
    let both = || catches![PolygonsReversed, PolygonsMissing, ExitsMissing];
    let mut cases = each("edge-on", both(), move |p| along(p, DVec3::X));
    cases.extend(each("along-z", both(), move |p| along(p, DVec3::Z)));
    cases.extend(each("along-a-diagonal", both(), move |p| along(p, DVec3::new(1.0, 1.0, 0.0).normalize())));
    cases.extend(each("along-the-space-diagonal", both(), move |p| along(p, DVec3::ONE.normalize())));
    cases.extend(each("inside", both(), inside));
    cases.extend(each("eye-on-a-face", both(), on_a_face));
    cases.extend(each("wide", both(), wide));
    cases.extend(each("parallel", both(), move |p| scene(p).parallel(DVec3::new(0.5, -1.0, 0.4), 110.0)));
    cases.extend(each("parallel-edge-on", both(), move |p| scene(p).parallel(DVec3::Y, 110.0)));
    cases.push(picture("polygons/three-stacks", catches![StackMissing, shader::STACK_FLAT], move || {
        wide(Placement::ObjectPlanes)
    }));
    cases
}

/// Where rounding decides which brick a ray is in, whether a surface lies in it, or which pixels a polygon covers.
fn degenerate() -> Vec<Case> {
    let thirds = || {
        let grid = Grid::axis_aligned(UVec3::new(71, 66, 53), DVec3::splat(1.0 / 3.0)).expect("a grid");
        hills(&grid, ScalarType::U16)
    };
    let center = DVec3::new(35.0, 33.0, 26.0);
    // Finer above y = 30.5 than below.
    let mixed = |p| {
        let finer = Criterion::DistanceFrom { point: WorldPos(DVec3::new(50.0, 45.0, 45.0)), factor: 1.0 };
        polygons(large(), soft(ScalarType::U16), p).detail(finer, Downsampling::Subsample)
    };
    // Faces of bricks are at 15.5 + 15 i, 100 steps and their multiples from the eye.
    let on_faces = move |p| {
        let eye = DVec3::new(15.5 - 100.0, 33.0, 26.0) / 3.0;
        polygons(thirds(), soft(ScalarType::U16), p).lens(eye, DVec3::new(35.0, 33.0, 26.0) / 3.0, 0.5).step(1.0)
    };
    let on_faces_parallel = move |p| polygons(thirds(), soft(ScalarType::U16), p).parallel(DVec3::X, 24.0).step(1.0);
    // Below it by less than f32 can tell.
    let along_x = move |p, y, z| mixed(p).lens(DVec3::new(-3.0, y, z), DVec3::new(35.0, y, z), 1.1).odd();
    let in_a_face = move |p| along_x(p, 30.5 - 1e-9, 26.0);
    let in_two_faces = move |p| along_x(p, 30.5 - 1e-9, 30.5 - 1e-9);
    let magnified =
        move |p| polygons(large(), soft(ScalarType::U16), p).lens(DVec3::new(-40.0, -70.0, 41.0), center, 2e-5);
    // Two stacks are as steep for many a pixel's ray.
    let along_a_tie =
        move |p| polygons(large(), soft(ScalarType::U16), p).lens(center - DVec3::new(60.0, 60.0, 7.0), center, 4e-3);
    // Nearer to a face than half a voxel: which of the two bricks is behind the other?
    let beside_a_face = move |p| {
        polygons(large(), soft(ScalarType::U16), p).eye(DVec3::new(30.3, 45.3, 17.9), DVec3::new(60.0, 60.0, 30.0))
    };
    // Bricks end where the volume does, half a voxel behind their last samples; the eye is beside its corner.
    let beside_the_corner = |p| {
        let grid = Grid::axis_aligned(UVec3::new(46, 61, 31), DVec3::ONE).expect("a grid");
        polygons(hills(&grid, ScalarType::U8), soft(ScalarType::U8), p).lens(
            DVec3::splat(-0.7),
            DVec3::splat(25.0),
            2.5,
        )
    };
    let eye_in_a_corner = move |p| mixed(p).eye(DVec3::splat(30.5) + 1e-5, center + 20.0);
    let steps = |p| polygons(large(), soft(ScalarType::U16), p).step(1e12);
    let both = || catches![PolygonsReversed, ExitsMissing];
    let mut cases = each("surfaces-on-faces", both(), on_faces);
    cases.extend(each("surfaces-on-faces-parallel", both(), on_faces_parallel));
    cases.extend(each("rays-in-a-face", both(), in_a_face));
    cases.extend(each("rays-in-two-faces", both(), in_two_faces));
    cases.extend(each("magnified", both(), magnified));
    cases.extend(each("eye-in-a-corner", both(), eye_in_a_corner));
    cases.extend(each("along-a-tie", both(), along_a_tie));
    cases.extend(each("eye-beside-a-face", both(), beside_a_face));
    cases.extend(each("eye-beside-the-corner", both(), beside_the_corner));
    cases.extend(each("one-step", catches![ExitsMissing], steps));
    cases
}

fn nominal() -> Vec<Case> {
    each("nominal", catches![PolygonsReversed, PolygonsMissing, shader::NOMINAL_STRETCHED], |p| {
        polygons(hills(&grid(), ScalarType::U8), soft(ScalarType::U8), p).with(|s| s.lengths = Lengths::Nominal)
    })
}

/// Optical depths of a step from next to nothing to beyond all f32.
fn stiff() -> Vec<Case> {
    let case = |extinction: f64| {
        let mutants = if extinction < 1.0 { catches![ExtinctionScaled] } else { catches![RedBlueSwapped] };
        picture(format!("polygons/extinction-{extinction:e}"), mutants, move || {
            let transfer = TransferFunction::constant(extinction, WARM).expect("a transfer function");
            polygons(hills(&grid(), ScalarType::U8), transfer, Placement::ObjectPlanes)
        })
    };
    [1e-3, 1e3, 1e9].into_iter().map(case).collect()
}

fn targets() -> Vec<Case> {
    let float16 = |p| {
        polygons(hills(&grid(), ScalarType::U8), soft(ScalarType::U8), p)
            .with(|s| s.technique = Technique::Polygons(Target::Float16))
    };
    let in_batches = |p| polygons(hills(&grid(), ScalarType::U8), soft(ScalarType::U8), p).triangles_at_a_time(100);
    let mut cases = each("rgba16float", catches![PolygonsReversed, ExitsMissing], float16);
    cases.extend(each("in-batches", catches![BatchesForgotten, PolygonsReversed], in_batches));
    cases.extend(each("in-batches-rgba16float", catches![BatchesForgotten], move |p| {
        float16(p).triangles_at_a_time(100)
    }));
    cases
}
