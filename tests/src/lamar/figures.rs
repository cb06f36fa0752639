//! Figures 8 and 14 as pictures.

use brickfield::bricks::{BrickTree, Downsampling};
use brickfield::frame::{Backend, Lengths};
use brickfield::lod::Criterion;
use brickfield::overlay::{show_bricks, show_camera};
use brickfield::{Residency, Scene, Viewpoint, prepare};
use brickfield_core::glam::UVec2;
use brickfield_core::{BrickId, BrickSide, Camera, Image};

use super::LamarArgs;
use super::scenes::{Geometry, data_sets, geometries, geometries_of, scene, tree, views};
use super::seams::{camera as cube_camera, cube};
use crate::compare::rivals::Rivals;
use crate::paper::panels::{beside, stacked};
use crate::paper::{Missed, PaperError, Subject, frame_of};

/// Bricks' side in figure 14: the paper's.
const SIDE: BrickSide = BrickSide::S16;

pub(super) fn run(args: &LamarArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    // For looking, larger than for timing.
    let args = &args.with(|common| common.size *= 2);
    // The last is a rasteriser, if there is one.
    let Some(backend) = rivals.present.last_mut() else { return Ok(Vec::new()) };
    figure_8(args, backend.as_mut())?;
    for data_set in data_sets(args)? {
        figure_14(args, backend.as_mut(), &data_set?)?;
    }
    Ok(Vec::new())
}

/// The constant cube, its bricks of several levels: each geometry without correction, with it, and the difference.
fn figure_8(args: &LamarArgs, backend: &mut dyn Backend) -> Result<(), PaperError> {
    let (volume, fog) = cube();
    let tree = tree(&volume, SIDE, Downsampling::Subsample)?;
    let detail = [Criterion::Distance { factor: 1.5 }];
    let mut rows: [Vec<Image<f32>>; 3] = Default::default();
    for geometry in geometries(args).into_iter().take(3) {
        let geometry = drawable(args, backend, geometry);
        let of = |lengths| Scene { lengths, ..scene(args, &fog, cube_camera().expect("a camera"), geometry, &detail) };
        let nominal = render(&tree, &of(Lengths::Nominal), backend)?.0;
        let truth = render(&tree, &of(Lengths::True), backend)?.0;
        rows[2].push(difference(&nominal, &truth));
        rows[0].push(nominal);
        rows[1].push(truth);
    }
    let what = "object planes, viewport planes, shells; uncorrected, corrected, the opacity that is missing (blue) or too much (red), full at 1/4";
    args.common.write_picture("figure8", &stacked(&rows.map(|row| beside(&row))), what)
}

/// From the surface and from inside: the bricks and the picture, with fixed tiles and with multiresolution.
fn figure_14(args: &LamarArgs, backend: &mut dyn Backend, data_set: &Subject) -> Result<(), PaperError> {
    let tree = tree(&data_set.volume, SIDE, Downsampling::Subsample)?;
    // Beside the line of the views, so that cameras are seen from their sides.
    let overview: Viewpoint = "from=-1,-0.4,0.5 zoom=0.8".parse().expect("a viewpoint");
    let overview = overview.camera(data_set.volume.grid(), data_set.frame, args.common.size)?;
    let mut rows = Vec::new();
    for (_, camera) in views(data_set, args.common.size)?.into_iter().skip(1) {
        let mut panels = Vec::new();
        // Distances of the paper's own factor.
        for criterion in [Criterion::FullResolution, Criterion::Distance { factor: 1.0 }] {
            let detail = [criterion];
            let scene = scene(args, &data_set.transfer, camera, geometries(args)[3], &detail);
            let (picture, bricks) = render(&tree, &scene, backend)?;
            panels.extend([boxes(&tree, &overview, &camera, &bricks, args.common.size), picture]);
        }
        rows.push(beside(&panels));
    }
    let name =
        data_set.name.rsplit('/').next().unwrap_or(&data_set.name).split('.').next().unwrap_or_default().to_owned();
    let what = "from the surface, from inside; fixed tiles and their picture, multiresolution and its picture";
    args.common.write_picture(&format!("figure14-{name}"), &stacked(&rows), what)
}

/// Without a rasteriser the same samples, by rays.
fn drawable(args: &LamarArgs, backend: &dyn Backend, geometry: Geometry) -> Geometry {
    match geometries_of(args, backend).any(|own| own == geometry) {
        true => geometry,
        false => Geometry { technique: brickfield::Technique::RayCasting, ..geometry },
    }
}

fn render(
    tree: &BrickTree,
    scene: &Scene,
    backend: &mut dyn Backend,
) -> Result<(Image<f32>, Vec<BrickId>), PaperError> {
    let mut residency = Residency::default();
    let plan = prepare(tree, scene, &mut residency)?;
    let frame = frame_of(backend, &plan)?;
    Ok((frame.image, residency.bricks().to_vec()))
}

/// The bricks that a camera draws, and the camera, from outside.
fn boxes(tree: &BrickTree, overview: &Camera, camera: &Camera, bricks: &[BrickId], size: UVec2) -> Image<f32> {
    let nothing = Image::transparent(size);
    let grid = tree.grid();
    let drawn = show_bricks(&nothing, overview, grid, tree.layout(), bricks);
    show_camera(&drawn, overview, camera, size, 0.12 * grid.world_box().diagonal())
}

/// By how much the first picture is more opaque: white where equal, blue where it is less, red where it is more; full colour
/// from a quarter on.
fn difference(a: &Image<f32>, b: &Image<f32>) -> Image<f32> {
    let mut out = a.clone();
    for (to, from) in out.pixels_mut().iter_mut().zip(b.pixels()) {
        let more = (4.0 * (to[3] - from[3])).clamp(-1.0, 1.0);
        let rest = 1.0 - more.abs();
        *to = if more < 0.0 { [rest, rest, 1.0, 1.0] } else { [1.0, rest, rest, 1.0] };
    }
    out
}
