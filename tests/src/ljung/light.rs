//! A ball in the light, whose normals are known: central differences of a quadratic field are exact.
//!
//! The value at p is C - |p - c|^2. Between samples s 2^l apart it is interpolated, which along each axis of the grid takes
//! (s 2^l)^2 f (1 - f) off, f being the place between two samples; an average of 2^l voxels takes s^2 (4^l - 1) / 12 off. Neither
//! changes the difference of two values a whole number of samples apart: the gradient is -2 (p - c) everywhere. Above a value the
//! medium is opaque, so that a pixel shows the first node inside.

use std::sync::Arc;

use brickfield::bricks::{BlockOptions, BlockSource, BrickTree, BuildOptions, Downsampling, build_blocks, build_tree};
use brickfield::frame::{FramePlan, Join};
use brickfield::lod::{BlockLevels, Criterion};
use brickfield::{BlockResidency, BlockStyle, Residency, Scene, TransparentBlocks, prepare, prepare_blocks};
use brickfield_core::glam::{DMat3, DVec3, UVec2, UVec3};
use brickfield_core::{BlockSide, Camera, Grid, Interblock, Knot, Level, ScalarType, TransferFunction, Volume};
use brickfield_optics::{Light, LightSource, LightTerms, Normals};
use serde::Serialize;

use super::LjungArgs;
use crate::compare::rivals::Rivals;
use crate::paper::{Missed, PaperError, frame_of, print};
use crate::volumes::fill;

/// Samples along the axes, and world units between them.
const DIMS: UVec3 = UVec3::new(60, 41, 71);
const SPACING: DVec3 = DVec3::new(1.0, 1.5, 0.9);
/// The ball, in world units.
const RADIUS: f64 = 19.0;
const BLOCK: BlockSide = BlockSide::V8;
const SIZE: UVec2 = UVec2::new(96, 96);
const STEP_VOXELS: f64 = 0.5;
const COLOR: [f64; 3] = [0.8, 0.5, 0.2];
const TERMS: LightTerms = LightTerms { ambient: 0.1, diffuse: 0.7, specular: 0.5, shininess: 20 };
/// In values per world unit: surfaces of the ball have 2 * RADIUS.
const FLAT_BELOW: f64 = 12.0;
/// Rounding of values to f32, and of positions: so near to the ball's value a node may be on either side.
const UNDECIDED: f64 = 2e-3;
/// Most that f32 may be off.
const ROUNDING: f64 = 5e-5;
/// Most that a normal of three bytes may be off: each of its components by 1/254, a highlight by sqrt(shininess) as much.
const CODES: f64 = 3e-2;

/// How a ball's samples are kept.
#[derive(Clone, Copy)]
enum Form {
    Bricks(Level),
    Blocks(Level),
    /// Flat blocks with gradients beside their samples.
    Stored(Level),
}

const FORMS: [Form; 6] = [
    Form::Bricks(Level(0)),
    Form::Bricks(Level(1)),
    Form::Blocks(Level(0)),
    Form::Blocks(Level(1)),
    Form::Stored(Level(0)),
    Form::Stored(Level(1)),
];

/// The error of a picture.
#[derive(Clone, Debug, Serialize)]
struct LightRow {
    backend: &'static str,
    form: String,
    light: &'static str,
    n_lit: usize,
    n_undecided: usize,
    mean: f64,
    max: f64,
    /// Most that is allowed.
    bound: f64,
}

pub(super) fn run(args: &LjungArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    print(&format!(
        "{} x {} x {} samples, rotated and {} : {} : {} apart, {} x {} pixels; the difference to the shade of the known normal, in any channel.\n\
         undecided: pixels with a node so near to the ball's surface that f32 may put it on either side.\n\n\
         backend  field                       light        lit  undecided     mean      max",
        DIMS.x, DIMS.y, DIMS.z, SPACING.x, SPACING.y, SPACING.z, SIZE.x, SIZE.y
    ))?;
    let ball = Ball::new()?;
    let mut rows = Vec::new();
    for (light, source) in lights(&ball.grid) {
        for form in FORMS {
            let scene = ball.scene(form, source);
            let (plan, expected) = (ball.plan(form, &scene)?, ball.expected(form, &scene));
            for backend in &mut rivals.present {
                let name = backend.describe().backend;
                let frame = frame_of(backend.as_mut(), &plan)?;
                let row = row((name, form, light), frame.image.pixels(), &expected);
                print(&line(&row))?;
                rows.push(row);
            }
        }
    }
    args.common.write_rows("light.json", &rows)?;
    let missed = rows.iter().filter(|row| row.max > row.bound || row.n_lit == 0 || row.n_undecided > row.n_lit / 10);
    Ok(missed.map(|row| Missed::of_pictures(format!("a lit ball: {}", line(row)))).collect())
}

fn line(row: &LightRow) -> String {
    format!(
        "{:<8} {:<27} {:<9} {:>6} {:>10} {:>8.1e} {:>8.1e}",
        row.backend, row.form, row.light, row.n_lit, row.n_undecided, row.mean, row.max
    )
}

fn lights(grid: &Grid) -> [(&'static str, LightSource); 3] {
    let b = grid.world_box();
    [
        ("head", LightSource::Head),
        ("direction", LightSource::Direction(DVec3::new(-0.7, -0.4, 0.9))),
        ("place", LightSource::Place(b.center() + b.extent() * DVec3::new(0.7, -0.6, 0.4))),
    ]
}

impl Form {
    const fn level(self) -> Level {
        match self {
            Form::Bricks(level) | Form::Blocks(level) | Form::Stored(level) => level,
        }
    }

    fn name(self) -> String {
        let what = match self {
            Form::Bricks(_) => "bricks",
            Form::Blocks(_) => "flat blocks",
            Form::Stored(_) => "stored gradients",
        };
        format!("{what} of level {}", self.level().0)
    }

    /// Most that a channel may be off.
    const fn bound(self) -> f64 {
        match self {
            Form::Bricks(_) | Form::Blocks(_) => ROUNDING,
            Form::Stored(_) => CODES,
        }
    }
}

/// The pixel that is expected; `None` if f32 may decide either way.
type Expected = Option<[f64; 4]>;

struct Ball {
    grid: Grid,
    center: DVec3,
    volume: Arc<Volume>,
    tree: BrickTree,
}

impl Ball {
    fn new() -> Result<Ball, PaperError> {
        let turn = DMat3::from_rotation_z(0.4) * DMat3::from_rotation_x(-0.7);
        let grid = Grid::from_first_sample(DIMS, SPACING, DVec3::new(5.0, -40.0, 12.0), turn).expect("a grid");
        // Between samples and between blocks, along every axis.
        let center = grid.world_box().center() + DVec3::new(0.31, -0.77, 0.42);
        let volume = fill(&grid, ScalarType::F32, |p| -(p - center).length_squared());
        let options = BuildOptions { downsampling: Downsampling::Subsample, ..BuildOptions::default() };
        Ok(Ball { tree: build_tree(&volume, &options)?, volume: Arc::new(volume), grid, center })
    }

    fn scene(&self, form: Form, source: LightSource) -> Scene {
        let surface = -RADIUS * RADIUS;
        let knot = |extinction| Knot { value: surface, extinction, color: COLOR };
        let transfer = TransferFunction::new(vec![knot(0.0), knot(1e9)]).expect("a jump");
        let camera = Camera::framing(&self.grid.world_box(), DVec3::new(0.6, -1.0, 0.35), DVec3::Z).expect("a box");
        let normals = if matches!(form, Form::Stored(_)) { Normals::Stored } else { Normals::Central };
        let light = Light::new(source, TERMS, FLAT_BELOW).expect("a light").on_normals(normals);
        let detail = vec![Criterion::Uniform(form.level())];
        Scene { light: Some(light), step_voxels: STEP_VOXELS, detail, ..Scene::new(camera, SIZE, transfer) }
    }

    fn plan(&self, form: Form, scene: &Scene) -> Result<FramePlan, PaperError> {
        match form {
            Form::Bricks(_) => Ok(prepare(&self.tree, scene, &mut Residency::default())?),
            Form::Blocks(level) | Form::Stored(level) => {
                let options = BlockOptions { side: BLOCK, ..BlockOptions::default() };
                let blocks = build_blocks(Arc::clone(&self.volume), &options)?;
                let levels = BlockLevels::uniform(*blocks.layout(), level);
                let join = Join::Blend(Interblock::MaximumDistance);
                let style = BlockStyle { join, transparent: TransparentBlocks::Blended, ..BlockStyle::default() };
                Ok(prepare_blocks(&blocks, scene, levels.levels(), style, &mut BlockResidency::default())?)
            }
        }
    }

    fn expected(&self, form: Form, scene: &Scene) -> Vec<Expected> {
        let rays = scene.camera.pixel_rays(SIZE);
        let pixel = |i: u32| {
            let ray = rays.pixel_ray(i % SIZE.x, i / SIZE.x);
            self.pixel(form, scene, (ray.origin, ray.direction))
        };
        (0..SIZE.x * SIZE.y).map(pixel).collect()
    }

    /// Node by node, from the ball's front to its back.
    fn pixel(&self, form: Form, scene: &Scene, (eye, direction): (DVec3, DVec3)) -> Expected {
        let step = STEP_VOXELS * SPACING.min_element();
        let (middle, reach) = ((self.center - eye).dot(direction), RADIUS + 4.0 * SPACING.max_element());
        let mut k = ((middle - reach) / step).floor();
        while k * step < middle + reach {
            let p = eye + direction * ((k + 0.5) * step);
            let inside = self.value(form, p) + RADIUS * RADIUS;
            if inside.abs() < UNDECIDED {
                return None;
            }
            if inside > 0.0 {
                return Some(self.shaded(scene, p, direction));
            }
            k += 1.0;
        }
        Some([0.0; 4])
    }

    /// The value between samples.
    fn value(&self, form: Form, p: DVec3) -> f64 {
        let q = self.grid.world_to_index().transform_point3(p) - 0.5;
        let stride = f64::from(form.level().stride());
        // Where the first sample lies; the variance of the voxels that a sample averages.
        let (first, variance) = match form {
            Form::Bricks(_) => (0.0, 0.0),
            Form::Blocks(_) | Form::Stored(_) => (0.5 * (stride - 1.0), (stride * stride - 1.0) / 12.0),
        };
        let s = (q - first) / stride;
        let f = s - s.floor();
        let lost = stride * stride * (f * (1.0 - f)) + variance;
        -(p - self.center).length_squared() - (SPACING * SPACING * lost).element_sum()
    }

    /// The colour in the light of the known normal.
    fn shaded(&self, scene: &Scene, p: DVec3, direction: DVec3) -> [f64; 4] {
        let outwards = p - self.center;
        let (normal, steepness) = (outwards.normalize(), 2.0 * outwards.length() / FLAT_BELOW);
        let strength = steepness / (1.0 + steepness * steepness).sqrt();
        let to_light = match scene.light.map(|light| light.source()) {
            Some(LightSource::Direction(towards)) => towards,
            Some(LightSource::Place(place)) => (place - p).normalize(),
            _ => -direction,
        };
        let halfway = (to_light - direction).normalize();
        let faced = TERMS.ambient + TERMS.diffuse * normal.dot(to_light).max(0.0);
        let highlight = strength * TERMS.specular * normal.dot(halfway).max(0.0).powi(TERMS.shininess as i32);
        let [r, g, b] = COLOR.map(|c| c * (1.0 - strength + strength * faced) + highlight);
        [r, g, b, 1.0]
    }
}

fn row(
    (backend, form, light): (&'static str, Form, &'static str),
    found: &[[f32; 4]],
    expected: &[Expected],
) -> LightRow {
    let difference =
        |(a, b): (&[f32; 4], &[f64; 4])| (0..4).map(|c| (f64::from(a[c]) - b[c]).abs()).fold(0.0, f64::max);
    let decided = || found.iter().zip(expected).filter_map(|(found, expected)| Some((found, expected.as_ref()?)));
    let lit: Vec<f64> = decided().filter(|(_, expected)| expected[3] > 0.0).map(difference).collect();
    LightRow {
        backend,
        form: form.name(),
        light,
        bound: form.bound(),
        n_lit: lit.len(),
        n_undecided: expected.iter().filter(|pixel| pixel.is_none()).count(),
        mean: lit.iter().sum::<f64>() / lit.len().max(1) as f64,
        max: decided().map(difference).fold(0.0, f64::max),
    }
}
