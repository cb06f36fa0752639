//! Shader functions one by one, against their equations in f64.
//!
//! Inputs are f32, so equations are evaluated at the very number that the function sees. Tolerances: scalar functions 3e-6
//! relative (exp is allowed 3 + 2|x| ulp in WGSL, and beyond depth 20 nothing is left of it) and 1e-30 absolute (denormals
//! may be flushed); classification 2e-6 of the function's greatest extinction, plus the effect of a value's rounding at the
//! function's greatest slope; segments the same for their alpha; sampled values 4e-6 of the field's range; rays 4e-6 of the
//! volume's size.

use brickfield::bricks::Downsampling;
use brickfield::frame::{FramePlan, ShaderFunction};
use brickfield::lod::Criterion;
use brickfield::{Residency, prepare};
use brickfield_core::glam::DVec3;
use brickfield_core::{Knot, ScalarType, TransferFunction};
use brickfield_optics::{QuadratureRule, alpha, depth};

use super::fields::{COOL, WARM, grid, hills, knot, skew_grid, soft};
use super::setup::{OBLIQUE, Setup, catches};
use crate::conformance::case::{Case, Check, FunctionPoint, FunctionTest, Mutant};
use crate::conformance::plan_mutants::PlanMutant::*;
use crate::conformance::samples::{PlanSamples, Samples};
use crate::conformance::shader_mutants as shader;

pub(super) fn cases() -> Vec<Case> {
    [scalars(), classifications(), segments(), samples(), rays()].into_iter().flatten().collect()
}

pub(super) fn function(
    name: impl Into<String>,
    mutants: Vec<Mutant>,
    plan: impl Fn() -> FramePlan + Send + Sync + 'static,
    function: ShaderFunction,
    points: impl Fn(&FramePlan) -> Vec<FunctionPoint> + Send + Sync + 'static,
) -> Case {
    let test = move || {
        let plan = plan();
        let points = points(&plan);
        FunctionTest { plan, function, points }
    };
    Case { name: name.into(), check: Check::Function(Box::new(test)), mutants }
}

fn planned(setup: Setup) -> FramePlan {
    let subject = setup.build();
    prepare(&subject.tree, &subject.scene, &mut Residency::default()).expect("a case's scene is one")
}

fn plain() -> FramePlan {
    planned(Setup::new(hills(&grid(), ScalarType::U16), soft(ScalarType::U16)))
}

fn scalars() -> Vec<Case> {
    let depths = || decades(-30, 12).chain((0..200).map(|i| 0.005 * f64::from(i)));
    let opacities = || decades(-30, -1).chain((0..=256).map(|i| f64::from(i) / 256.0));
    let points = |inputs: Vec<f64>, f: fn(f64) -> f64| {
        inputs.into_iter().map(move |x| relative_point(x as f32, f)).collect::<Vec<_>>()
    };
    vec![
        function(
            "function/alpha",
            catches![shader::ALPHA_LINEAR, shader::ALPHA_CANCELS],
            plain,
            ShaderFunction::Alpha,
            move |_| points(depths().collect(), alpha),
        ),
        function("function/depth", catches![shader::DEPTH_LINEAR], plain, ShaderFunction::Depth, move |_| {
            points(opacities().collect(), depth)
        }),
    ]
}

/// 1, 2 and 5 times the powers of ten.
fn decades(from: i32, to: i32) -> impl Iterator<Item = f64> {
    (from..=to).flat_map(|e| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(e)))
}

fn relative_point(x: f32, f: fn(f64) -> f64) -> FunctionPoint {
    let expected = f(f64::from(x));
    FunctionPoint {
        input: [x, 0.0, 0.0, 0.0],
        expected: [expected, 0.0, 0.0, 0.0],
        tolerance: [3e-6 * expected.abs() + 1e-30, 0.0, 0.0, 0.0],
    }
}

/// A transfer function with jumps, colours that turn, and great and small extinctions.
fn rugged() -> TransferFunction {
    let knots: Vec<Knot> = vec![
        knot(-3.0, 0.0, WARM),
        knot(-1.0, 0.5, COOL),
        knot(-1.0, 2.0, WARM),
        knot(0.5, 0.25, [0.0, 1.0, 0.5]),
        knot(0.75, 4.0, [1.0, 0.0, 0.5]),
        knot(2.0, 4.0, COOL),
        knot(2.0, 0.0, COOL),
        knot(7.0, 1.0, WARM),
    ];
    TransferFunction::new(knots).expect("knots ascend")
}

/// Even knots, a jump among them: 241 are found by a table, 400 by a loop.
fn even_knots(n: u32) -> TransferFunction {
    let value = |i: u32| f64::from(if i == 200 { 199 } else { i }) * 0.01;
    let wave = |i: u32| 0.5 + 0.5 * (0.7 * f64::from(i)).sin();
    let knots = (0..n).map(|i| knot(value(i), 2.0 * wave(i), [wave(i + 1), wave(i + 2), wave(i + 3)]));
    TransferFunction::new(knots.collect()).expect("knots ascend")
}

fn with_transfer(transfer: TransferFunction, rule: QuadratureRule) -> FramePlan {
    planned(Setup::new(hills(&grid(), ScalarType::F32), transfer).rule(rule))
}

/// Values from far below to far above the knots, and the knots themselves (right-continuous: exactly there).
fn values(transfer: &TransferFunction) -> Vec<f32> {
    let knots = transfer.knots();
    let (low, high) = (knots[0].value, knots[knots.len() - 1].value);
    let spread = (high - low).max(1.0);
    let grid = (0..=400).map(|i| low + spread * (f64::from(i) / 200.0 - 0.5));
    grid.chain([low - 1e6 * spread, high + 1e6 * spread])
        .chain(knots.iter().map(|k| k.value))
        .map(|v| v as f32)
        .collect()
}

/// Greatest extinction, and greatest change of extinction or colour per unit of value.
pub(super) fn steepness(transfer: &TransferFunction) -> (f64, f64) {
    let most = transfer.knots().iter().map(|k| k.extinction).fold(0.0, f64::max);
    let slopes = transfer.knots().windows(2).filter(|k| k[1].value > k[0].value).map(|k| {
        let change = (0..3)
            .map(|c| (k[1].color[c] - k[0].color[c]).abs())
            .fold((k[1].extinction - k[0].extinction).abs(), f64::max);
        change / (k[1].value - k[0].value)
    });
    (most, slopes.fold(0.0, f64::max))
}

fn classify_points(plan: &FramePlan) -> Vec<FunctionPoint> {
    let transfer = plan.transfer();
    let (most, slope) = steepness(transfer);
    let point = |v: f32| {
        let o = transfer.at(f64::from(v));
        let by_value = slope * rounding(transfer, f64::from(v));
        let t = 2e-6 + by_value;
        FunctionPoint {
            input: [v, 0.0, 0.0, 0.0],
            expected: [o.color[0], o.color[1], o.color[2], o.extinction],
            tolerance: [t, t, t, 2e-6 * most + by_value],
        }
    };
    values(transfer).into_iter().map(point).collect()
}

/// How far a value may be off that is taken relative to the first knot; beyond the knots it does not matter.
fn rounding(transfer: &TransferFunction, value: f64) -> f64 {
    let knots = transfer.knots();
    let (first, last) = (knots[0].value, knots[knots.len() - 1].value);
    4.0 / f64::from(1 << 24) * (value.clamp(first, last).abs() + first.abs() + last.abs())
}

fn classifications() -> Vec<Case> {
    let case = |name, mutants, transfer: fn() -> TransferFunction| {
        let plan = move || with_transfer(transfer(), QuadratureRule::MidpointExponential);
        function(name, mutants, plan, ShaderFunction::Classify, classify_points)
    };
    vec![
        case(
            "function/classify",
            catches![KnotMoved, shader::LEFT_CONTINUOUS, shader::STEPS, shader::NOT_CONSTANT_OUTSIDE],
            rugged,
        ),
        case("function/classify-constant", catches![ExtinctionScaled, RedBlueSwapped], || {
            TransferFunction::constant(0.7, COOL).expect("a constant")
        }),
        case("function/classify-many-knots", catches![KnotMoved, shader::STEPS, shader::LEFT_CONTINUOUS], || {
            even_knots(400)
        }),
        case(
            "function/classify-table",
            catches![KnotMoved, shader::STEPS, shader::LEFT_CONTINUOUS, shader::BIN_BEYOND],
            || even_knots(241),
        ),
        case("function/classify-steep", catches![ExtinctionScaled, shader::STEPS], || {
            TransferFunction::new(vec![knot(0.0, 0.0, WARM), knot(1.0, 1e12, COOL)]).expect("knots ascend")
        }),
    ]
}

/// Segments of all lengths between values near and far; both ways for the rules of two nodes.
fn segment_points(plan: &FramePlan) -> Vec<FunctionPoint> {
    let (rule, transfer) = (plan.sampling().rule(), plan.transfer());
    let ends = [-4.0f32, -2.3, -1.5, -0.2, 0.6, 0.7, 1.4, 2.5, 5.0, 9.0];
    let lengths = [1e-12f32, 1e-6, 1e-3, 0.1, 1.0, 30.0, 1e6, 1e12];
    let point = |a: f32, b: f32, length: f32| {
        let s = rule.segment(transfer, &[a.into(), b.into()], length.into());
        let t = |x: f64| 2e-5 * x.abs() + 1e-30;
        let most = alpha(s.depth);
        FunctionPoint {
            input: [a, b, length, 0.0],
            expected: [s.emission[0], s.emission[1], s.emission[2], s.depth],
            tolerance: [t(most), t(most), t(most), t(s.depth)],
        }
    };
    let pairs = ends.iter().flat_map(|a| ends.iter().map(move |b| (*a, *b)));
    pairs.flat_map(|(a, b)| lengths.map(|l| point(a, b, l))).collect()
}

fn segments() -> Vec<Case> {
    let case = |rule: QuadratureRule| {
        let mutants = match rule {
            QuadratureRule::LeftRiemann => catches![shader::EULER_DEPTH],
            QuadratureRule::LeftExponential | QuadratureRule::MidpointExponential => {
                catches![shader::NO_SELF_ATTENUATION, shader::ALPHA_LINEAR]
            }
            QuadratureRule::PreIntegrated => catches![shader::PIECE_MEAN],
            QuadratureRule::Gauss2 => catches![shader::GAUSS_UNWEIGHTED],
        };
        let mutants = [mutants, catches![ExtinctionScaled, KnotMoved]].concat();
        let name = format!("function/segment-{}", rule.name());
        function(name, mutants, move || with_transfer(rugged(), rule), ShaderFunction::Segment, segment_points)
    };
    QuadratureRule::ALL.map(case).into()
}

/// Positions inside, outside, on samples and on brick faces (inner ones a hair to either side).
fn sample_points(plan: &FramePlan) -> Vec<FunctionPoint> {
    let last = plan.field().last_sample();
    let range = 65535.0;
    let grid = (0..1000u32).map(|i| {
        let f = |k: u32| f64::from(i.wrapping_mul(k) % 1009) / 1008.0;
        last * DVec3::new(f(7), f(131), f(577)) * 1.2 - 0.1 * last
    });
    let samples = (0..12u32).map(|i| (DVec3::new(1.0, 2.0, 3.0) * f64::from(i)).min(last));
    let point = |q: DVec3| {
        let input = q.as_vec3();
        let value = PlanSamples(plan).around(input.as_dvec3()).map(|c| c.value());
        let (expected, tolerance) = (value.unwrap_or(0.0), 4e-6 * range);
        FunctionPoint {
            input: [input.x, input.y, input.z, 0.0],
            expected: [expected, if value.is_some() { 1.0 } else { 0.0 }, 0.0, 0.0],
            tolerance: [tolerance, 0.0, 0.0, 0.0],
        }
    };
    let away = |q: &DVec3| far_from_faces(plan, *q);
    grid.chain(samples).filter(away).map(point).collect()
}

/// On a face between levels either side is right.
fn far_from_faces(plan: &FramePlan, q: DVec3) -> bool {
    let n_cells = f64::from(plan.field().index().lattice().cell_samples);
    let off = |x: f64| ((x / n_cells).round() * n_cells - x).abs();
    off(q.x).min(off(q.y)).min(off(q.z)) > 1e-3
}

fn samples() -> Vec<Case> {
    let case =
        |name, mutants, plan: fn() -> FramePlan| function(name, mutants, plan, ShaderFunction::Sample, sample_points);
    vec![
        case(
            "function/sample",
            catches![
                BricksShifted,
                IndexSwapped,
                LastSampleCut,
                DecodeOffset,
                BytesSwapped,
                shader::NEAREST,
                shader::LERP_SWAPPED,
                shader::ONE_LAYER,
                shader::GATHERED_BESIDE,
                shader::NO_CLAMP,
                shader::INDEX_STRIDE,
                shader::ATLAS_ROW
            ],
            plain,
        ),
        case("function/sample-levels", catches![WrongLevel, shader::LEVEL_SCALE, shader::BLOCK_CORNER], || {
            let setup = Setup::new(hills(&grid(), ScalarType::U16), soft(ScalarType::U16));
            let near = DVec3::new(-4.0, -9.0, 20.0);
            let detail = Criterion::Distance { factor: 1.0 };
            planned(setup.detail(detail, Downsampling::Average).eye(near, DVec3::new(20.0, 18.0, 16.0)))
        }),
        case("function/sample-transparent", catches![BrickTransparent], || {
            let knots = [knot(0.6, 0.0, WARM), knot(1.0, 0.3, COOL)];
            let transfer = crate::volumes::spread(&knots, ScalarType::U16).expect("knots ascend");
            planned(Setup::new(hills(&grid(), ScalarType::U16), transfer))
        }),
    ]
}

fn ray_points(plan: &FramePlan, function: ShaderFunction) -> Vec<FunctionPoint> {
    let size = plan.size();
    let scale = plan.domain().extent().length() + plan.rays().anchor.iter().map(|a| a.length()).fold(0.0, f64::max);
    let point = |i: u32| {
        let (x, y) = (i % size.x, i / size.x);
        let ray = plan.rays().ray(x, y);
        let (v, w, t) = match function {
            ShaderFunction::RayAnchor => (ray.anchor, ray.t_anchor, 4e-6 * (scale + ray.t_anchor.abs())),
            _ => (ray.direction, 0.0, 4e-6 * ray.direction.length()),
        };
        FunctionPoint { input: [x as f32, y as f32, 0.0, 0.0], expected: [v.x, v.y, v.z, w], tolerance: [t; 4] }
    };
    (0..size.x * size.y).map(point).collect()
}

fn skew() -> Setup {
    Setup::new(hills(&skew_grid(), ScalarType::U16), soft(ScalarType::U16))
}

fn rays() -> Vec<Case> {
    let case = |name, mutants, plan: fn() -> FramePlan, f| function(name, mutants, plan, f, move |p| ray_points(p, f));
    let (anchor, direction) = (ShaderFunction::RayAnchor, ShaderFunction::RayDirection);
    let perspective = || planned(skew());
    let parallel = || planned(skew().parallel(-OBLIQUE, 80.0));
    vec![
        case(
            "function/ray-anchor",
            catches![
                AnchorHalfVoxel,
                PixelCorner,
                RowsFlipped,
                PhaseHalfStep,
                shader::FLAT_SHELLS,
                shader::PIXEL_CORNER
            ],
            perspective,
            anchor,
        ),
        case(
            "function/ray-direction",
            catches![Parallel, NotNormalised, RowsFlipped, shader::NOT_NORMALISED],
            perspective,
            direction,
        ),
        case(
            "function/ray-anchor-parallel",
            catches![AnchorHalfVoxel, PixelCorner, shader::PIXEL_CORNER],
            parallel,
            anchor,
        ),
    ]
}
