//! Figure 8 in numbers: a constant cube at random cuts, with the light corrected for each segment's true length, and without.

use brickfield::bricks::{BrickTree, Downsampling};
use brickfield::cpu::closed_form::one_color;
use brickfield::frame::{Backend, Lengths, Placement};
use brickfield::lod::{Answer, Criterion, Selection, Tile, select_by};
use brickfield::optics::depth;
use brickfield::{Residency, Scene, prepare, prepare_selection};
use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BrickId, BrickSide, Camera, Grid, Image, Optics, Projection, TransferFunction, Volume};

use super::LamarArgs;
use super::scenes::{Geometry, geometries, geometries_of, rasterises, scene, tree};
use crate::compare::rivals::Rivals;
use crate::metrics::errors;
use crate::paper::{Missed, PaperError, frame_of, print};

/// Voxels along the cube's side.
const SIDE: u32 = 96;
/// The cube's extinction.
const EXTINCTION: f64 = 0.012;
/// Random cuts.
const N_CUTS: u32 = 12;
/// The effect of rounding on a constant field: 200 segments of three roundings each (see the rules of conformance).
const ROUNDING: f64 = 200.0 * 3.0 * 6e-8;

/// The cube of figure 8.
pub(super) fn cube() -> (Volume, TransferFunction) {
    let grid = Grid::axis_aligned(UVec3::splat(SIDE), DVec3::ONE).expect("a cube");
    let volume = Volume::new(grid, vec![128u8; grid.n_voxels()]).expect("one value a voxel");
    (volume, TransferFunction::constant(EXTINCTION, [0.9, 0.55, 0.2]).expect("a transfer function"))
}

/// The camera of figure 8: near, so that perspective is strong.
pub(super) fn camera() -> Result<Camera, PaperError> {
    let center = DVec3::splat(0.5 * f64::from(SIDE));
    let eye = center + DVec3::new(0.75, -1.0, 0.6) * f64::from(SIDE);
    Ok(Camera::look_at(eye, center, DVec3::Z, Projection::Perspective { fov_y: 80f64.to_radians() })?)
}

pub(super) fn run(args: &LamarArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    let (volume, fog) = cube();
    let tree = tree(&volume, BrickSide::S16, Downsampling::Subsample)?;
    let mut missed = seams(args, rivals, &tree, &fog)?;
    missed.extend(figure_8(args, rivals, &tree, &fog)?);
    missed.extend(angles(args, rivals, &tree, &fog)?);
    Ok(missed)
}

/// Corrected: every cut's picture against that of a single level, and against the closed form.
fn seams(
    args: &LamarArgs,
    rivals: &mut Rivals,
    tree: &BrickTree,
    fog: &TransferFunction,
) -> Result<Vec<Missed>, PaperError> {
    let cuts: Vec<Selection> = (0..N_CUTS).map(|number| random_cut(tree, number)).collect();
    let [levels, bricks] = [&n_levels as &dyn Fn(&Selection) -> usize, &|cut| cut.drawn().count()].map(|count| {
        let counts = || cuts.iter().map(count);
        match (counts().min().unwrap_or(0), counts().max().unwrap_or(0)) {
            (least, most) if least == most => least.to_string(),
            (least, most) => format!("{least} to {most}"),
        }
    });
    print(&format!(
        "A cube of {SIDE}^3 equal voxels. With correction: {N_CUTS} random cuts ({levels} levels, {bricks} bricks) against level 0 alone, and all of\n\
         them against the closed form, 1 - e^-depth; rounding may leave {ROUNDING:.1e}:\n"
    ))?;
    let mut missed = Vec::new();
    if cuts.iter().any(|cut| n_levels(cut) < 2) {
        missed.push(Missed::of_pictures("a random cut has one level only".to_owned()));
    }
    for (geometry, i) in pairs(args, rivals) {
        let backend = rivals.present[i].as_mut();
        let scene = scene(args, fog, camera()?, geometry, &[Criterion::FullResolution]);
        let exact = closed_form(&scene, tree.grid());
        let single = render(tree, &scene, None, backend)?;
        // Without a number there is no greatest one: that is an error.
        let greatest_difference = |a: &Image<f32>, b: &Image<f64>| errors(a, b).map(|e| e.worst.difference);
        let (mut seam, mut off) = (0.0f64, greatest_difference(&single, &exact)?);
        for cut in &cuts {
            let picture = render(tree, &scene, Some(cut), backend)?;
            seam = seam.max(greatest_difference(&picture, &single.map(f64::from))?);
            off = off.max(greatest_difference(&picture, &exact)?);
        }
        let name = backend.describe().backend;
        print(&format!(
            "{:<16} {name:<5} greatest difference from level 0 {seam:.2e}, from the closed form {off:.2e}",
            geometry.name
        ))?;
        if !(seam <= ROUNDING && off <= ROUNDING) {
            let what = format!(
                "{}, {name}: a constant field shows its cut by {seam:.2e}, and is off by {off:.2e}",
                geometry.name
            );
            missed.push(Missed::of_pictures(what));
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
) -> Result<Vec<Missed>, PaperError> {
    print(
        "\nWithout correction (figure 8): optical depth over the true one, of pixels behind at least 50 voxels; 1 is right, below it is too\n\
         transparent. Mean in the middle third of the picture and outside of it; least and greatest; one level, then several.\n",
    )?;
    let mut missed = Vec::new();
    let several = random_cut(tree, 3);
    for (geometry, i) in pairs(args, rivals) {
        let backend = rivals.present[i].as_mut();
        let name = backend.describe().backend;
        let corrected = scene(args, fog, camera()?, geometry, &[Criterion::FullResolution]);
        let nominal = Scene { lengths: Lengths::Nominal, ..corrected.clone() };
        let mut found = Vec::new();
        for cut in [None, Some(&several)] {
            let truth = render(tree, &corrected, cut, backend)?;
            found.push(DepthRatios::of(&render(tree, &nominal, cut, backend)?, &truth));
        }
        print(&format!("{:<16} {name:<5} {}   {}", geometry.name, found[0], found[1]))?;
        for ratios in found.iter().filter(|ratios| !ratios.are_of(geometry.placement)) {
            let what = format!("{}, {name}: uncorrected light is not as in figure 8: {ratios}", geometry.name);
            missed.push(Missed::of_pictures(what));
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
) -> Result<Vec<Missed>, PaperError> {
    print(
        "\nObject-aligned planes without correction, parallel rays turned about z: depth over the true one, and the cosine:\n",
    )?;
    let geometry = geometries(args)[0];
    let mut missed = Vec::new();
    for backend in rivals.present.iter_mut().filter(|b| rasterises(b.as_ref())) {
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
            let truth = render(tree, &of(Lengths::True), None, backend.as_mut())?;
            let mean = DepthRatios::of(&render(tree, &of(Lengths::Nominal), None, backend.as_mut())?, &truth).mean;
            ratios.push((degrees, mean, degrees.min(90.0 - degrees).to_radians().cos()));
        }
        let name = backend.describe().backend;
        let words: Vec<String> = ratios.iter().map(|(d, r, c)| format!("{d:.0}: {r:.3} ({c:.3})")).collect();
        print(&format!("{name:<5} {}", words.join("  ")))?;
        let worst = ratios.iter().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |r| r.0);
        if worst != 45.0 || ratios.iter().any(|(_, r, c)| (r - c).abs() > 0.01) {
            let what =
                format!("{name}: uncorrected object-aligned planes are worst at {worst} degrees, or off the cosine");
            missed.push(Missed::of_pictures(what));
        }
    }
    if !rivals.present.iter().any(|b| rasterises(b.as_ref())) {
        missed.push(Missed::of_pictures("object-aligned planes: no backend with a rasteriser".to_owned()));
    }
    Ok(missed)
}

/// Every backend, by its place, with every geometry that it draws.
fn pairs(args: &LamarArgs, rivals: &Rivals) -> Vec<(Geometry, usize)> {
    let of = |i: usize| geometries_of(args, rivals.present[i].as_ref()).map(move |g| (g, i));
    (0..rivals.present.len()).flat_map(of).collect()
}

/// A cut that depends on nothing but its number: of each brick below the root, chance says whether it is divided.
fn random_cut(tree: &BrickTree, number: u32) -> Selection {
    let root = tree.layout().root();
    let chance = |tile: &Tile<'_>| match tile.id() {
        id if id == root => Answer::Descend,
        BrickId { level, coords } => {
            let words = [number, u32::from(level.0), coords.x, coords.y, coords.z];
            // Of five in nine; the multiplier is that of Knuth's generator for 64 bits.
            let mixed = words.iter().fold(0x2545_f491u64, |h, w| {
                let h = (h ^ u64::from(*w)).wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                h ^ h >> 29
            });
            if (mixed >> 16) % 9 < 5 { Answer::Descend } else { Answer::Render }
        }
    };
    select_by(tree.layout(), tree.grid(), chance)
}

fn n_levels(cut: &Selection) -> usize {
    cut.n_drawn_per_level().iter().filter(|n| **n > 0).count()
}

/// The picture of a cut, or of the scene's own.
fn render(
    tree: &BrickTree,
    scene: &Scene,
    cut: Option<&Selection>,
    backend: &mut dyn Backend,
) -> Result<Image<f32>, PaperError> {
    let mut residency = Residency::default();
    let plan = match cut {
        Some(cut) => prepare_selection(tree, scene, cut, &mut residency)?,
        None => prepare(tree, scene, &mut residency)?,
    };
    Ok(frame_of(backend, &plan)?.image)
}

/// The picture of the cube as its extinction and the rays' ways through it say.
fn closed_form(scene: &Scene, grid: &Grid) -> Image<f64> {
    let (size, rays) = (scene.size, scene.camera.pixel_rays(scene.size));
    let Optics { extinction, color } = scene.transfer.at(0.0);
    let mut image = Image::transparent(size);
    for (i, pixel) in image.pixels_mut().iter_mut().enumerate() {
        let way = rays.pixel_ray(i as u32 % size.x, i as u32 / size.x).clip(&grid.world_box());
        *pixel = one_color(extinction * way.map_or(0.0, |span| span.end - span.start.max(0.0)), color);
    }
    image
}

/// Optical depth over true optical depth, of pixels that lie behind enough to tell.
struct DepthRatios {
    middle: f64,
    rim: f64,
    mean: f64,
    least: f64,
    greatest: f64,
}

impl DepthRatios {
    /// Whether the seams are the seams of figure 8 for a geometry.
    fn are_of(&self, placement: Placement) -> bool {
        match placement {
            // The cosine of a ray to its planes is no less than 1 / sqrt 3.
            Placement::ObjectPlanes => [self.rim, self.middle].into_iter().all(|r| 0.57 < r && r < 0.9),
            // Half a field of view of 40 degrees: no less than its cosine.
            Placement::ViewportPlanes => {
                0.76 < self.rim && self.rim < 0.97 && self.rim < self.middle && self.middle < 1.0
            }
            Placement::Shells | Placement::TessellatedShells { .. } => (self.mean - 1.0).abs() < 0.02,
        }
    }

    fn of(image: &Image<f32>, truth: &Image<f32>) -> DepthRatios {
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
        DepthRatios {
            middle: mean(&|middle| middle),
            rim: mean(&|middle| !middle),
            mean: mean(&|_| true),
            least: all().fold(f64::INFINITY, f64::min),
            greatest: all().fold(0.0, f64::max),
        }
    }
}

impl std::fmt::Display for DepthRatios {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let DepthRatios { middle, rim, least, greatest, .. } = self;
        write!(f, "middle {middle:.3}, rim {rim:.3}, {least:.3} to {greatest:.3}")
    }
}
