//! Light on surfaces: fields of every kind, lights of every kind, every rule; pairs of them.

use brickfield::bricks::Downsampling;
use brickfield::frame::{Division, Join, Mode, Placement, Target};
use brickfield::lod::Criterion;
use brickfield::optics::{LightSource, LightTerms, LitSides};
use brickfield::{BlockStyle, Technique, TransparentBlocks};
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BlockSide, BrickSide, Grid, Interblock, Level, ScalarType, TransferFunction};
use brickfield_optics::QuadratureRule;

use super::fields::{COOL, WARM, checkers, grid, hills, knot, ramp, shell, skew_grid, soft, sparse};
use super::setup::{FlatLevels, Setup, catches, picture};
use crate::conformance::case::Case;
use crate::conformance::plan_mutants::PlanMutant::*;
use crate::conformance::shader_mutants as shader;
use crate::conformance::storage::Storage;
use crate::volumes::{fill_unit, spread};

/// Every term counts; highlights are small.
pub(super) const SHINY: LightTerms = LightTerms { ambient: 0.15, diffuse: 0.7, specular: 0.5, shininess: 20 };
/// No axis, no symmetry, and not where the eye is.
pub(super) const ASIDE: LightSource = LightSource::Direction(DVec3::new(-0.7, -0.4, 0.9));

/// Beside a volume of this grid.
fn beside(grid: &Grid) -> LightSource {
    let b = grid.world_box();
    LightSource::Place(b.center() + b.extent() * DVec3::new(-0.4, -0.9, 0.7))
}

fn lit(scalar: ScalarType, source: LightSource) -> Setup {
    Setup::new(hills(&grid(), scalar), soft(scalar)).lit(source, SHINY)
}

fn skewed(scalar: ScalarType, source: LightSource) -> Setup {
    Setup::new(hills(&skew_grid(), scalar), soft(scalar)).lit(source, SHINY)
}

fn large() -> Grid {
    Grid::axis_aligned(UVec3::new(71, 66, 53), DVec3::ONE).expect("a grid")
}

/// Looks from near by: bricks of several levels.
fn of_several_levels(scalar: ScalarType, source: LightSource) -> Setup {
    Setup::new(hills(&large(), scalar), soft(scalar))
        .lit(source, SHINY)
        .detail(Criterion::Distance { factor: 1.0 }, Downsampling::Average)
        .eye(DVec3::new(-4.0, -9.0, 20.0), DVec3::new(30.0, 30.0, 25.0))
}

fn random(setup: Setup, side: BlockSide, join: Join) -> Setup {
    setup.blocks(
        side,
        FlatLevels::Random,
        BlockStyle { join, transparent: TransparentBlocks::Blended, ..BlockStyle::default() },
    )
}

pub(super) fn cases() -> Vec<Case> {
    [bricks(), levels(), blocks(), stored(), surface(), extremes()].into_iter().flatten().collect()
}

fn bricks() -> Vec<Case> {
    let (u8, u16, f32) = (ScalarType::U8, ScalarType::U16, ScalarType::F32);
    vec![
        picture(
            "light/head",
            catches![
                shader::GRADIENT_OF_ONE_PATCH,
                shader::SURFACES_EVERYWHERE,
                shader::HIGHLIGHT_WITHOUT_STRENGTH,
                shader::SLOPE_OVER_TWO_STEPS,
                FlatBelowScaled,
                DiffuseDimmed,
            ],
            move || lit(u8, LightSource::Head),
        ),
        picture(
            "light/direction-skew-gauss2",
            catches![shader::NORMAL_OF_THE_GRID, shader::LIGHT_FROM_BEHIND, shader::NOT_HALFWAY, LightTurned],
            move || skewed(u16, ASIDE).rule(QuadratureRule::Gauss2),
        ),
        picture(
            "light/place-skew-pre-integrated",
            catches![shader::LIGHT_IN_VOXELS, shader::NEAR_SHADE_ALONE, LightTurned],
            move || skewed(f32, beside(&skew_grid())).rule(QuadratureRule::PreIntegrated),
        ),
        picture("light/head-parallel-both-sides", catches![shader::BACK_IN_THE_DARK, FlatBelowScaled], move || {
            lit(u16, LightSource::Head)
                .with(|s| s.light = s.light.map(|light| light.on_sides(LitSides::Both)))
                .rule(QuadratureRule::LeftRiemann)
                .parallel(DVec3::new(-0.5, 0.8, -0.3), 50.0)
        }),
        picture("light/place-parallel", catches![shader::NOT_HALFWAY, shader::LIGHT_FROM_BEHIND], move || {
            skewed(u8, beside(&skew_grid()))
                .rule(QuadratureRule::LeftExponential)
                .parallel(DVec3::new(0.3, 0.5, -0.8), 60.0)
        }),
        picture("light/direction-object-planes-pre-integrated", catches![shader::NEAR_SHADE_ALONE], move || {
            lit(u8, ASIDE).rule(QuadratureRule::PreIntegrated).step(1.5).with(|s| {
                (s.placement, s.division) = (Placement::ObjectPlanes, Division::Brick);
            })
        }),
        // Bricks that are transparent serve the gradients of others.
        picture("light/skipping", catches![shader::GRADIENT_OF_ONE_PATCH, VisibleTooSmall], move || {
            let volume = sparse(&large(), u8);
            Setup::new(volume, soft(u8)).lit(LightSource::Head, SHINY)
        }),
        picture("light/skipping-full-bricks-gauss2", catches![shader::SURFACES_EVERYWHERE], move || {
            let volume = checkers(UVec3::new(71, 66, 53));
            Setup::new(volume, soft(u8)).lit(ASIDE, SHINY).rule(QuadratureRule::Gauss2).step(0.9)
        }),
        // All of the second brick is transparent: only gradients ask for it.
        picture("light/beside-the-dark", catches![BrickTransparent, shader::GRADIENT_OF_ONE_PATCH], move || {
            let square = |x: f64| (x / 31.0).powi(2);
            let knots = [knot(square(15.3), 0.3, WARM), knot(square(15.4), 0.0, COOL)];
            let grid = Grid::axis_aligned(UVec3::new(31, 16, 16), DVec3::ONE).expect("a grid");
            let volume = fill_unit(&grid, u16, |p| square(p.x));
            Setup::new(volume, spread(&knots, u16).expect("knots ascend")).lit(ASIDE, SHINY)
        }),
        picture("light/polygons", catches![PolygonsReversed, shader::GRADIENT_OF_ONE_PATCH], move || {
            lit(u16, ASIDE).with(|s| {
                (s.division, s.placement) = (Division::Brick, Placement::ViewportPlanes);
                s.technique = Technique::Polygons(Target::Float32);
            })
        }),
        picture("light/jump", catches![DiffuseDimmed], move || {
            let knots = [knot(0.4, 0.0, WARM), knot(0.4, 0.3, WARM), knot(0.9, 0.5, COOL)];
            let transfer = spread(&knots, u16).expect("knots ascend");
            Setup::new(shell(&grid(), u16), transfer).lit(LightSource::Head, SHINY)
        }),
        picture("light/fast", catches![shader::SURFACES_EVERYWHERE, RedBlueSwapped], move || {
            lit(f32, LightSource::Head).with(|s| s.mode = Mode::FAST)
        }),
    ]
}

fn levels() -> Vec<Case> {
    let (u16, f32) = (ScalarType::U16, ScalarType::F32);
    vec![
        picture("light/several-levels", catches![shader::SPACING_OF_LEVEL_0, shader::LEVEL_SCALE], move || {
            of_several_levels(u16, LightSource::Head)
        }),
        picture("light/several-levels-gauss2-bricks", catches![shader::SPACING_OF_LEVEL_0], move || {
            of_several_levels(f32, ASIDE).rule(QuadratureRule::Gauss2).with(|s| s.division = Division::Brick)
        }),
        picture("light/placed-levels", catches![shader::PLACED_SCALE, shader::PLACED_AXES], move || {
            of_several_levels(u16, beside(&large())).stored(Storage::Placed)
        }),
        picture("light/averages", catches![shader::PLACED_FIRST, shader::PLACED_SCALE, DiffuseDimmed], move || {
            let volume = ramp(&Grid::axis_aligned(UVec3::new(61, 47, 33), DVec3::ONE).expect("a grid"));
            Setup::new(volume, soft(f32)).lit(ASIDE, SHINY).stored(Storage::Averages)
        }),
    ]
}

fn blocks() -> Vec<Case> {
    let (u8, u16, f32) = (ScalarType::U8, ScalarType::U16, ScalarType::F32);
    use Interblock::{BoundarySplit, MaximumDistance, MinimumDistance};
    let equal = |setup: Setup, level, scheme| {
        let style =
            BlockStyle { join: Join::Blend(scheme), transparent: TransparentBlocks::Blended, ..BlockStyle::default() };
        setup.blocks(BlockSide::V8, FlatLevels::All(Level(level)), style)
    };
    vec![
        picture("light/blocks-nearest", catches![shader::BLOCK_SAMPLES_AT_CORNER, DiffuseDimmed], move || {
            random(lit(u16, LightSource::Head), BlockSide::V8, Join::Shared)
        }),
        picture(
            "light/blocks-maximum-distance",
            catches![
                shader::SPACING_OF_OWN_BLOCK,
                shader::MAXIMUM_TO_THE_FACE,
                shader::ONE_SAMPLE_FORGOTTEN,
                FlatBelowScaled
            ],
            move || random(lit(u8, LightSource::Head), BlockSide::V8, Join::Blend(MaximumDistance)),
        ),
        picture(
            "light/blocks-minimum-distance-gauss2",
            catches![shader::SPACING_OF_OWN_BLOCK, shader::MINIMUM_IS_MAXIMUM],
            move || {
                let setup = lit(u16, beside(&grid())).rule(QuadratureRule::Gauss2);
                random(setup, BlockSide::V16, Join::Blend(MinimumDistance))
            },
        ),
        picture(
            "light/blocks-boundary-split-skew-pre-integrated",
            catches![shader::SPACING_OF_OWN_BLOCK, shader::NORMAL_OF_THE_GRID, shader::SPLIT_SWAPPED],
            move || {
                let setup = skewed(f32, ASIDE).rule(QuadratureRule::PreIntegrated);
                random(setup, BlockSide::V8, Join::Blend(BoundarySplit))
            },
        ),
        picture("light/blocks-parallel-polygons", catches![shader::SPACING_OF_OWN_BLOCK, LightTurned], move || {
            let setup = lit(u8, ASIDE).parallel(DVec3::new(-0.5, 0.8, -0.3), 50.0).with(|s| {
                (s.division, s.placement) = (Division::Brick, Placement::ObjectPlanes);
                s.technique = Technique::Polygons(Target::Float32);
            });
            random(setup, BlockSide::V16, Join::Blend(MaximumDistance))
        }),
        picture("light/blocks-skipping", catches![shader::BLOCKS_SWAPPED, shader::SPACING_OF_OWN_BLOCK], move || {
            let knots = [knot(0.3, 0.0, WARM), knot(0.9, 0.5, COOL)];
            let transfer = spread(&knots, u8).expect("knots ascend");
            let setup = Setup::new(sparse(&large(), u8), transfer).lit(LightSource::Head, SHINY);
            random(setup, BlockSide::V8, Join::Blend(MaximumDistance))
        }),
        // The volume's own samples know of these.
        picture("light/blocks-equal", catches![shader::NEAREST, shader::SLOPE_OVER_TWO_STEPS], move || {
            equal(lit(u8, LightSource::Head), 0, MaximumDistance)
        }),
        picture("light/blocks-equal-skew", catches![shader::NORMAL_OF_THE_GRID, LightTurned], move || {
            equal(skewed(u16, ASIDE).rule(QuadratureRule::Gauss2), 0, BoundarySplit)
        }),
        picture("light/blocks-all-of-level-2", catches![shader::NEAREST, FlatBelowScaled], move || {
            equal(lit(u16, beside(&grid())), 2, MaximumDistance)
        }),
    ]
}

/// Normals of gradients that lie beside the samples.
fn stored() -> Vec<Case> {
    let (u8, u16, f32) = (ScalarType::U8, ScalarType::U16, ScalarType::F32);
    use Interblock::{BoundarySplit, MaximumDistance};
    let equal = |setup: Setup, level| {
        let style = BlockStyle {
            join: Join::Blend(MaximumDistance),
            transparent: TransparentBlocks::Blended,
            ..BlockStyle::default()
        };
        setup.blocks(BlockSide::V8, FlatLevels::All(Level(level)), style).stored_normals()
    };
    vec![
        picture("light/stored-nearest", catches![shader::STORED_LENGTH_NOT_SQUARED, DiffuseDimmed], move || {
            random(lit(u8, LightSource::Head), BlockSide::V8, Join::Shared).stored_normals()
        }),
        picture(
            "light/stored-maximum-distance-gauss2",
            catches![
                shader::ONE_GRADIENT_FORGOTTEN,
                shader::STORED_DIRECTION_UNSIGNED,
                shader::MAXIMUM_TO_THE_FACE,
                FlatBelowScaled
            ],
            move || {
                let setup = lit(u16, beside(&grid())).rule(QuadratureRule::Gauss2);
                random(setup, BlockSide::V8, Join::Blend(MaximumDistance)).stored_normals()
            },
        ),
        picture(
            "light/stored-boundary-split-skew-pre-integrated",
            catches![shader::STORED_ACROSS_BLOCKS, shader::NORMAL_OF_THE_GRID, LightTurned],
            move || {
                let setup = skewed(f32, ASIDE).rule(QuadratureRule::PreIntegrated);
                random(setup, BlockSide::V16, Join::Blend(BoundarySplit)).stored_normals()
            },
        ),
        picture("light/stored-equal", catches![shader::STORED_LENGTH_NOT_SQUARED, shader::NEAREST], move || {
            equal(skewed(u16, ASIDE), 0)
        }),
        picture("light/stored-all-of-level-1", catches![shader::STORED_DIRECTION_UNSIGNED], move || {
            equal(lit(u8, LightSource::Head).parallel(DVec3::new(-0.5, 0.8, -0.3), 50.0), 1)
        }),
        picture("light/stored-all-of-one-sample", catches![shader::STORED_LENGTH_NOT_SQUARED], move || {
            equal(lit(u16, LightSource::Head), 3)
        }),
        picture("light/stored-fast", catches![RedBlueSwapped, RowsFlipped], move || {
            equal(lit(f32, LightSource::Head), 0).with(|s| s.mode = Mode::FAST)
        }),
    ]
}

/// Normals of surface voxels.
fn surface() -> Vec<Case> {
    let (u8, u16, f32) = (ScalarType::U8, ScalarType::U16, ScalarType::F32);
    use Interblock::{BoundarySplit, MaximumDistance};
    // Nothing below a third: outside and inside of a shell.
    let transfer = |scalar| {
        let knots = [knot(0.33, 0.0, WARM), knot(0.4, 0.25, WARM), knot(0.8, 0.6, COOL)];
        spread(&knots, scalar).expect("knots ascend")
    };
    let of = move |grid: Grid, scalar| {
        let setup = Setup::new(shell(&grid, scalar), transfer(scalar));
        setup.lit(beside(&grid), SHINY).surface_normals()
    };
    let equal = |setup: Setup, level| {
        let style = BlockStyle {
            join: Join::Blend(MaximumDistance),
            transparent: TransparentBlocks::Blended,
            ..BlockStyle::default()
        };
        setup.blocks(BlockSide::V8, FlatLevels::All(Level(level)), style)
    };
    vec![
        // The volume's own voxels know of these.
        picture("light/surface-equal-skew", catches![SurfaceTurned, SurfaceOfSix, SurfaceUnweighted], move || {
            equal(of(skew_grid(), u16), 0)
        }),
        picture(
            "light/surface-equal-gauss2-parallel",
            catches![SurfaceEverywhere, SurfaceUnweighted, shader::STORED_DIRECTION_UNSIGNED, LightTurned],
            move || {
                let setup = of(grid(), u8).rule(QuadratureRule::Gauss2);
                equal(setup.parallel(DVec3::new(-0.5, 0.8, -0.3), 40.0), 0)
            },
        ),
        // A jump down: the values above are outside, too, and the knot of the jump is.
        picture("light/surface-both-sides-of-a-band", catches![SurfaceTurned, SurfaceOfSix], move || {
            let knots = [knot(0.3, 0.0, WARM), knot(0.4, 0.4, WARM), knot(0.8, 0.4, COOL), knot(0.8, 0.0, COOL)];
            let transfer = spread(&knots, u8).expect("knots ascend");
            let setup = Setup::new(hills(&grid(), u8), transfer).lit(beside(&grid()), SHINY).surface_normals();
            equal(setup, 0)
        }),
        picture(
            "light/surface-maximum-distance",
            catches![shader::ONE_GRADIENT_FORGOTTEN, shader::STORED_LENGTH_NOT_SQUARED, SurfaceTurned],
            move || random(of(grid(), u8), BlockSide::V8, Join::Blend(MaximumDistance)),
        ),
        picture(
            "light/surface-boundary-split-skew-pre-integrated",
            catches![shader::STORED_ACROSS_BLOCKS, shader::NORMAL_OF_THE_GRID, SurfaceEverywhere],
            move || {
                let setup = of(skew_grid(), f32).rule(QuadratureRule::PreIntegrated);
                random(setup, BlockSide::V16, Join::Blend(BoundarySplit))
            },
        ),
        picture("light/surface-nearest", catches![SurfaceEverywhere, shader::LIGHT_FROM_BEHIND], move || {
            random(of(grid(), u16), BlockSide::V8, Join::Shared)
        }),
        picture("light/surface-all-of-level-1-polygons", catches![SurfaceTurned, DiffuseDimmed], move || {
            let setup = of(skew_grid(), u8).with(|s| {
                (s.division, s.placement) = (Division::Brick, Placement::ViewportPlanes);
                s.technique = Technique::Polygons(Target::Float32);
            });
            equal(setup, 1)
        }),
        picture("light/surface-fast", catches![RedBlueSwapped, SurfaceTurned], move || {
            equal(of(grid(), u8), 0).with(|s| s.mode = Mode::FAST)
        }),
    ]
}

fn extremes() -> Vec<Case> {
    let (u8, u16) = (ScalarType::U8, ScalarType::U16);
    let of = move |dims: [u32; 3]| {
        let grid = Grid::axis_aligned(dims.into(), DVec3::ONE).expect("a grid");
        Setup::new(hills(&grid, u16), soft(u16)).lit(LightSource::Head, SHINY)
    };
    vec![
        // Light from within, and the eye beside it.
        picture("light/inside", catches![shader::LIGHT_FROM_BEHIND, BehindTheEye], move || {
            let eye = DVec3::new(21.3, 20.2, 17.9);
            lit(u8, LightSource::Place(eye + DVec3::new(3.1, -4.2, 2.3))).eye(eye, eye + DVec3::new(5.0, -2.0, 1.0))
        }),
        // From right behind, as the middle of the picture sees it.
        picture("light/behind", catches![DiffuseDimmed], move || {
            let (center, eye) = (grid().world_box().center(), DVec3::new(-20.0, -50.0, 30.0));
            lit(u8, LightSource::Direction(center - eye)).lens(eye, center, 0.7).odd()
        }),
        picture("light/fog", catches![DiffuseDimmed, FlatBelowScaled], move || {
            let fog = TransferFunction::constant(0.04, WARM).expect("a transfer function");
            Setup::new(hills(&grid(), u8), fog).lit(ASIDE, SHINY)
        }),
        picture("light/1x47x30", catches![DiffuseDimmed, shader::INDEX_STRIDE], move || of([1, 47, 30])),
        picture("light/1x1x50", catches![ExtinctionScaled], move || of([1, 1, 50]).step(0.7)),
        picture("light/bricks-of-64", catches![FlatBelowScaled], move || lit(u16, ASIDE).side(BrickSide::S64)),
        // A pass ends early, so that the rounds of all loops are few enough.
        picture("light/long-rays", catches![shader::PASS_FORGETS, DiffuseDimmed], move || {
            let setup = lit(u8, LightSource::Head).step(0.01).with(|s| s.size = UVec3::new(4, 3, 0).truncate());
            random(setup, BlockSide::V8, Join::Blend(Interblock::MaximumDistance))
        }),
        // Hardly anything is flat: roundings of values are amplified.
        picture("light/steep", catches![DiffuseDimmed, shader::NORMAL_OF_THE_GRID], move || {
            skewed(u16, ASIDE).flat_below_times(1e-3)
        }),
        picture("light/brightest", catches![DiffuseDimmed], move || {
            let bright = LightTerms { ambient: 2.0, diffuse: 4.0, specular: 8.0, shininess: 255 };
            lit(u8, LightSource::Head).lit(ASIDE, bright)
        }),
    ]
}
