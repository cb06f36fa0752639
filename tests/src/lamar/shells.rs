//! Tessellated shells against spheres: the finer the facets, the nearer.

use brickfield::bricks::Downsampling;
use brickfield::frame::{Placement, Target};
use brickfield::lod::Criterion;
use brickfield::{Residency, Technique, prepare};
use brickfield_core::glam::UVec2;
use brickfield_core::{BrickSide, Image};

use super::LamarArgs;
use super::measure::reference;
use super::scenes::{geometries, rasterises, scene, tree};
use crate::compare::rivals::Rivals;
use crate::metrics::errors;
use crate::orders::OrderRow;
use crate::paper::{Missed, PaperError, frame_of, print};
use crate::volumes::phantom;

/// Facets' sides, in pixels: the coarsest are a sixth of the picture.
const FACETS: [u32; 6] = [64, 32, 16, 8, 4, 2];
/// Errors below this are the rounding of blending.
const FLOOR: f64 = 1e-6;
/// Pictures of this side.
const SIZE: u32 = 384;

pub(super) fn run(args: &LamarArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    let args = args.with(|common| (common.size, common.step) = (UVec2::splat(SIZE), 4.0));
    print(&format!(
        "The phantom, {SIZE} x {SIZE} pixels, steps of 4 voxels so that surfaces show, several levels. RMSE of rasterised shells against\n\
         the f64 sum over spherical ones, by pixels along a facet's side; facets lie inside their sphere by the square of their size.\n"
    ))?;
    let (subject, mut missed) = (phantom(), Vec::new());
    let tree = tree(&subject.volume, BrickSide::S16, Downsampling::Subsample)?;
    let detail = [Criterion::Distance { factor: 4.0 }];
    let rays = scene(&args, &subject.transfer, subject.camera, geometries(&args)[3], &detail);
    let answer: Image<f64> = reference(&tree, &rays)?.image;
    for backend in rivals.present.iter_mut().filter(|b| rasterises(b.as_ref())) {
        let name = backend.describe().backend;
        let mut found = Vec::new();
        for facet_pixels in FACETS {
            let mut scene = rays.clone();
            scene.placement = Placement::TessellatedShells { facet_pixels };
            scene.technique = Technique::Polygons(Target::Float32);
            let plan = prepare(&tree, &scene, &mut Residency::default())?;
            let image = frame_of(backend.as_mut(), &plan)?.image;
            found.push((f64::from(facet_pixels), errors(&image, &answer)?.rmse));
        }
        let words: Vec<String> = found.iter().map(|(side, e)| format!("{side}: {e:.2e}")).collect();
        let row = OrderRow { what: name.to_owned(), order: 2.0, errors: found, floor: FLOOR, n_halvings: 5 };
        let observed = match row.observed() {
            Some(o) => format!("order {:.2} over {} halvings", o.slope, o.n_halvings),
            None => "no order".to_owned(),
        };
        print(&format!("{name:<5} {}   {observed}", words.join("  ")))?;
        if !row.holds() {
            missed.push(Missed::of_pictures(format!("{name}: shells converge with {observed}, not 2 over 5")));
        }
    }
    if !rivals.present.iter().any(|b| rasterises(b.as_ref())) {
        missed.push(Missed::of_pictures("shells: no backend with a rasteriser".to_owned()));
    }
    Ok(missed)
}
