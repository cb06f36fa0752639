//! Tessellated shells against spheres: the finer the facets, the nearer.

use brickfield::bricks::Downsampling;
use brickfield::frame::{Placement, Target};
use brickfield::lod::Criterion;
use brickfield::{Residency, Technique, prepare};
use brickfield_core::{BrickSide, Image};

use super::measure::reference;
use super::scenes::{geometries, scene, tree};
use super::{LamarArgs, LamarError, print};
use crate::compare::rivals::Rivals;
use crate::metrics::errors;
use crate::orders::fit;
use crate::volumes::phantom;

/// Facets' sides, in pixels: the coarsest are a quarter of the picture.
const FACETS: [u32; 6] = [96, 48, 24, 12, 6, 3];
/// Pictures of this side.
const SIZE: u32 = 384;

pub(super) fn run(args: &LamarArgs, rivals: &mut Rivals) -> Result<Vec<String>, LamarError> {
    let args = LamarArgs { size: brickfield_core::glam::UVec2::splat(SIZE), step: 4.0, ..args.clone() };
    print(&format!(
        "The phantom, {SIZE} x {SIZE} pixels, steps of 4 voxels so that surfaces show, several levels. RMSE of rasterised shells against\n\
         the f64 sum over spherical ones, by pixels along a facet's side; facets lie inside their sphere by the square of their size.\n"
    ))?;
    let (subject, mut missed) = (phantom(), Vec::new());
    let tree = tree(&subject.volume, BrickSide::S16, Downsampling::Subsample)?;
    let detail = [Criterion::Distance { factor: 4.0 }];
    let rays = scene(&args, &subject.transfer, subject.camera, geometries(&args)[3], &detail);
    let answer: Image<f64> = reference(&tree, &rays)?.image;
    for backend in rivals.present.iter_mut().filter(|b| b.describe().backend != "cpu") {
        let name = backend.describe().backend;
        let mut found = Vec::new();
        for facet_pixels in FACETS {
            let mut scene = rays.clone();
            scene.placement = Placement::TessellatedShells { facet_pixels };
            scene.technique = Technique::Polygons(Target::Float32);
            let plan = prepare(&tree, &scene, &mut Residency::default())?;
            let image = backend.render(&plan).map_err(|source| LamarError::Render { backend: name, source })?.image;
            found.push((f64::from(facet_pixels), errors(&image, &answer)?.rmse));
        }
        // Below this, rounding of blending is what is left.
        let clear: Vec<(f64, f64)> = found.iter().copied().filter(|(_, e)| *e > 3e-6).collect();
        let order = fit(&clear);
        let words: Vec<String> = found.iter().map(|(side, e)| format!("{side}: {e:.2e}")).collect();
        print(&format!(
            "{name:<5} {}   order {order:.2} over {} halvings",
            words.join("  "),
            clear.len().saturating_sub(1)
        ))?;
        if clear.len() < 3 || (order - 2.0).abs() > 0.3 {
            missed.push(format!("{name}: shells converge with order {order:.2}, not 2"));
        }
    }
    if rivals.present.iter().all(|b| b.describe().backend == "cpu") {
        missed.push("shells: no backend with a rasteriser".to_owned());
    }
    Ok(missed)
}
