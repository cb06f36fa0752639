//! Figure 8 in numbers: a constant cube at random cuts, with the light corrected for each segment's true length, and without.

use brickfield::bricks::{BrickTree, Downsampling};
use brickfield::frame::{Backend, Lengths, Placement};
use brickfield::lod::Criterion;
use brickfield::optics::depth;
use brickfield::{Residency, Scene, prepare};
use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BrickSide, Camera, Grid, Image, Projection, TransferFunction, Volume, WorldPos};

use super::scenes::{Geometry, geometries, geometries_of, scene, tree};
use super::{LamarArgs, LamarError, print};
use crate::compare::rivals::Rivals;

/// Voxels along the cube's side.
const SIDE: u32 = 96;
/// The cube's extinction.
const EXTINCTION: f64 = 0.012;
/// Random cuts.
const N_CUTS: u32 = 12;
/// What rounding may leave of a constant field: 200 segments of three roundings each (see the rules of conformance).
const ROUNDING: f64 = 200.0 * 3.0 * 6e-8;

/// The cube of figure 8.
pub(super) fn cube() -> (Volume, TransferFunction) {
    let grid = Grid::axis_aligned(UVec3::splat(SIDE), DVec3::ONE).expect("a cube");
    let volume = Volume::new(grid, vec![128u8; grid.n_voxels()]).expect("one value a voxel");
    (volume, TransferFunction::constant(EXTINCTION, [0.9, 0.55, 0.2]).expect("a transfer function"))
}

/// The camera of figure 8: near, so that perspective is strong.
pub(super) fn camera() -> Result<Camera, LamarError> {
    let center = DVec3::splat(0.5 * f64::from(SIDE));
    let eye = center + DVec3::new(0.75, -1.0, 0.6) * f64::from(SIDE);
    Ok(Camera::look_at(eye, center, DVec3::Z, Projection::Perspective { fov_y: 80f64.to_radians() })?)
}

pub(super) fn run(args: &LamarArgs, rivals: &mut Rivals) -> Result<Vec<String>, LamarError> {
    let (volume, fog) = cube();
    let tree = tree(&volume, BrickSide::S16, Downsampling::Subsample)?;
    let mut missed = seams(args, rivals, &tree, &fog)?;
    missed.extend(figure_8(args, rivals, &tree, &fog)?);
    missed.extend(angles(args, rivals, &tree, &fog)?);
    Ok(missed)
}

/// Corrected: every cut's picture against that of a single level.
fn seams(
    args: &LamarArgs,
    rivals: &mut Rivals,
    tree: &BrickTree,
    fog: &TransferFunction,
) -> Result<Vec<String>, LamarError> {
    print(&format!(
        "A cube of {SIDE}^3 equal voxels. With correction, {N_CUTS} random cuts against level 0 alone; rounding may leave {ROUNDING:.1e}:\n"
    ))?;
    let mut missed = Vec::new();
    for (geometry, i) in pairs(args, rivals) {
        let backend = &mut rivals.present[i];
        let picture = |backend: &mut dyn Backend, detail: &[Criterion]| {
            render(tree, &scene(args, fog, camera()?, geometry, detail), backend)
        };
        let single = picture(backend.as_mut(), &[Criterion::FullResolution])?;
        let (mut worst, mut levels) = (0.0f64, 0);
        for cut in 0..N_CUTS {
            let detail = random_cut(cut);
            worst = worst.max(greatest(&picture(backend.as_mut(), &detail)?, &single));
            levels = levels.max(n_levels(tree, &scene(args, fog, camera()?, geometry, &detail))?);
        }
        let name = backend.describe().backend;
        print(&format!(
            "{:<16} {name:<5} greatest difference {worst:.2e} (up to {levels} levels in a cut)",
            geometry.name
        ))?;
        if levels < 2 {
            missed.push(format!("{}, {name}: no cut has several levels", geometry.name));
        }
        if worst > ROUNDING {
            missed.push(format!("{}, {name}: a constant field shows its cut by {worst:.2e}", geometry.name));
        }
    }
    Ok(missed)
}

/// Uncorrected: depth over true depth, at the picture's centre and at its rim, where rays are most oblique.
fn figure_8(
    args: &LamarArgs,
    rivals: &mut Rivals,
    tree: &BrickTree,
    fog: &TransferFunction,
) -> Result<Vec<String>, LamarError> {
    print(
        "\nWithout correction (figure 8): optical depth over the true one, of pixels behind at least 50 voxels; 1 is right, below it is too\n\
         transparent. Mean in the middle third of the picture and outside of it; least and greatest; one level, then several.\n",
    )?;
    let mut missed = Vec::new();
    for (geometry, i) in pairs(args, rivals) {
        let backend = &mut rivals.present[i];
        let name = backend.describe().backend;
        let mut found = Vec::new();
        for detail in [vec![Criterion::FullResolution], random_cut(3)] {
            let corrected = scene(args, fog, camera()?, geometry, &detail);
            let nominal = Scene { lengths: Lengths::Nominal, ..corrected.clone() };
            let truth = render(tree, &corrected, backend.as_mut())?;
            found.push(Ratios::of(&render(tree, &nominal, backend.as_mut())?, &truth));
        }
        print(&format!("{:<16} {name:<5} {}   {}", geometry.name, found[0], found[1]))?;
        for ratios in &found {
            let holds = match geometry.placement {
                Placement::ObjectPlanes => ratios.rim < 0.9 && ratios.middle < 0.9,
                Placement::ViewportPlanes => ratios.rim < 0.97 && ratios.rim < ratios.middle && ratios.middle < 1.0,
                Placement::Shells | Placement::TessellatedShells { .. } => (ratios.mean - 1.0).abs() < 0.02,
            };
            if !holds {
                missed.push(format!("{}, {name}: uncorrected light is not as in figure 8: {ratios}", geometry.name));
            }
        }
    }
    Ok(missed)
}

/// Object-aligned planes by angle, with parallel rays: the paper's worst case is 45 degrees.
fn angles(
    args: &LamarArgs,
    rivals: &mut Rivals,
    tree: &BrickTree,
    fog: &TransferFunction,
) -> Result<Vec<String>, LamarError> {
    print(
        "\nObject-aligned planes without correction, parallel rays turned about z: depth over the true one, and the cosine:\n",
    )?;
    let geometry = geometries(args)[0];
    let mut missed = Vec::new();
    for backend in rivals.present.iter_mut().filter(|b| b.describe().backend != "cpu") {
        let mut ratios = Vec::new();
        for degrees in [0.0f64, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let center = DVec3::splat(0.5 * f64::from(SIDE));
            let parallel = Projection::Orthographic { height: 0.4 * f64::from(SIDE) };
            let camera = Camera::look_at(center - DVec3::new(cos, sin, 0.0) * 200.0, center, DVec3::Z, parallel)?;
            let of = |lengths| Scene {
                lengths,
                step_voxels: 0.25,
                ..scene(args, fog, camera, geometry, &[Criterion::FullResolution])
            };
            let truth = render(tree, &of(Lengths::True), backend.as_mut())?;
            let mean = Ratios::of(&render(tree, &of(Lengths::Nominal), backend.as_mut())?, &truth).mean;
            ratios.push((degrees, mean, degrees.min(90.0 - degrees).to_radians().cos()));
        }
        let name = backend.describe().backend;
        let words: Vec<String> = ratios.iter().map(|(d, r, c)| format!("{d:.0}: {r:.3} ({c:.3})")).collect();
        print(&format!("{name:<5} {}", words.join("  ")))?;
        let worst = ratios.iter().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |r| r.0);
        if worst != 45.0 || ratios.iter().any(|(_, r, c)| (r - c).abs() > 0.01) {
            missed.push(format!(
                "{name}: uncorrected object-aligned planes are worst at {worst} degrees, or off the cosine"
            ));
        }
    }
    if rivals.present.iter().all(|b| b.describe().backend == "cpu") {
        missed.push("object-aligned planes: no backend with a rasteriser".to_owned());
    }
    Ok(missed)
}

/// Every backend, by its place, with every geometry that it draws.
fn pairs(args: &LamarArgs, rivals: &Rivals) -> Vec<(Geometry, usize)> {
    let of = |i: usize| geometries_of(args, rivals.present[i].as_ref()).map(move |g| (g, i));
    (0..rivals.present.len()).flat_map(of).collect()
}

/// A cut that depends on nothing but its number: bricks by their distance from some points.
fn random_cut(number: u32) -> Vec<Criterion> {
    // Weyl's sequence: evenly spread, and the same on every machine.
    let spread = |i: u32| (f64::from(number + 1) * [0.8191, 0.6711, 0.5497, 0.4503][i as usize]).fract();
    let point = |i: u32| DVec3::new(spread(i), spread(i + 1), spread((i + 2) % 4)) * f64::from(SIDE);
    let from = |i: u32| Criterion::DistanceFrom { point: WorldPos(point(i)), factor: 0.4 + 1.2 * spread(3 - i) };
    vec![from(0), from(1)]
}

fn render(tree: &BrickTree, scene: &Scene, backend: &mut dyn Backend) -> Result<Image<f32>, LamarError> {
    let plan = prepare(tree, scene, &mut Residency::default())?;
    let name = backend.describe().backend;
    Ok(backend.render(&plan).map_err(|source| LamarError::Render { backend: name, source })?.image)
}

fn n_levels(tree: &BrickTree, scene: &Scene) -> Result<usize, LamarError> {
    let mut residency = Residency::default();
    prepare(tree, scene, &mut residency)?;
    let mut levels: Vec<_> = residency.bricks().iter().map(|id| id.level).collect();
    levels.sort();
    levels.dedup();
    Ok(levels.len())
}

fn greatest(a: &Image<f32>, b: &Image<f32>) -> f64 {
    let pairs = a.pixels().iter().flatten().zip(b.pixels().iter().flatten());
    pairs.map(|(x, y)| f64::from((x - y).abs())).fold(0.0, f64::max)
}

/// Optical depth over true optical depth, of pixels that lie behind enough to tell.
struct Ratios {
    middle: f64,
    rim: f64,
    mean: f64,
    least: f64,
    greatest: f64,
}

impl Ratios {
    fn of(image: &Image<f32>, truth: &Image<f32>) -> Ratios {
        let size = image.size();
        let is_middle = |i: usize| {
            let at = UVec2::new(i as u32 % size.x, i as u32 / size.x) * 3;
            at.cmpge(size).all() && at.cmplt(size * 2).all()
        };
        let depths = image.pixels().iter().zip(truth.pixels()).map(|(a, b)| (depth(a[3].into()), depth(b[3].into())));
        let told = depths.enumerate().filter(|(_, (_, truth))| *truth > 50.0 * EXTINCTION);
        let ratios: Vec<(bool, f64)> = told.map(|(i, (d, truth))| (is_middle(i), d / truth)).collect();
        let mean = |of: &dyn Fn(bool) -> bool| {
            let own: Vec<f64> = ratios.iter().filter(|(middle, _)| of(*middle)).map(|(_, r)| *r).collect();
            // NaN where there is none: that is within no bound.
            own.iter().sum::<f64>() / own.len() as f64
        };
        let all = || ratios.iter().map(|(_, r)| *r);
        Ratios {
            middle: mean(&|middle| middle),
            rim: mean(&|middle| !middle),
            mean: mean(&|_| true),
            least: all().fold(f64::INFINITY, f64::min),
            greatest: all().fold(0.0, f64::max),
        }
    }
}

impl std::fmt::Display for Ratios {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Ratios { middle, rim, least, greatest, .. } = self;
        write!(f, "middle {middle:.3}, rim {rim:.3}, {least:.3} to {greatest:.3}")
    }
}
