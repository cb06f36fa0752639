//! The volumes that are rendered, from where, by which geometry.

use brickfield::bricks::{BrickTree, BuildOptions, Downsampling, build_tree};
use brickfield::frame::{Backend, Division, Placement, Target};
use brickfield::lod::Criterion;
use brickfield::{Scene, Technique, Viewpoint};
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{BrickSide, Camera, Grid, IndexPos, Projection, Ray, TransferFunction, Volume, WorldPos};

use super::{LamarArgs, Part};
use crate::paper::{PaperError, Subject};

/// The data sets, as paths below the folder of real volumes.
const DATA: [&str; 3] = ["ct/engine.vti", "ct/aneurism.vti", "ct/LIDC2.mha"];

/// How samples are placed, and by whom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Geometry {
    pub(super) name: &'static str,
    pub(super) placement: Placement,
    pub(super) technique: Technique,
}

/// Whether the data that the parts need are there, and the text of `--only` is in one of their paths.
pub(super) fn check_data(args: &LamarArgs) -> Result<(), PaperError> {
    args.common.check_data(&DATA, args.parts().into_iter().any(Part::needs_data))
}

/// The volumes that are asked for, one by one.
pub(super) fn data_sets(args: &LamarArgs) -> Result<impl Iterator<Item = Result<Subject, PaperError>>, PaperError> {
    Ok(args.common.named(&DATA)?.into_iter().map(|(name, path)| Subject::of_file(name, &path)))
}

/// The brick sides that are asked for.
pub(super) fn sides(args: &LamarArgs) -> Vec<BrickSide> {
    let wanted = |side: &BrickSide| args.sides.is_empty() || args.sides.contains(side);
    BrickSide::ALL.into_iter().filter(wanted).collect()
}

pub(super) fn tree(volume: &Volume, side: BrickSide, downsampling: Downsampling) -> Result<BrickTree, PaperError> {
    Ok(build_tree(volume, &BuildOptions { side, downsampling, max_bytes: None })?)
}

/// Three views along one line: from outside, from the box's surface, and from half-way to its centre.
pub(super) fn views(data_set: &Subject, size: UVec2) -> Result<[(&'static str, Camera); 3], PaperError> {
    let grid = data_set.volume.grid();
    let outside = Viewpoint::default().camera(grid, data_set.frame, size)?;
    let center = grid.world_box().center();
    let way = surface_from(grid, center, -outside.forward());
    let wide = Projection::Perspective { fov_y: 70f64.to_radians() };
    let at = |share: f64| Camera::look_at(center + way * share, center - way, outside.up(), wide);
    Ok([("outside", outside), ("surface", at(1.0)?), ("inside", at(0.5)?)])
}

/// From a point of the volume to its surface.
fn surface_from(grid: &Grid, from: DVec3, direction: DVec3) -> DVec3 {
    let origin = grid.index(WorldPos(from));
    let ray = Ray { origin: origin.0, direction: grid.world_to_index().transform_vector3(direction) };
    let end = ray.clip(&grid.index_box()).map_or(0.0, |span| span.end);
    grid.world(IndexPos(ray.at(end))).0 - from
}

/// The three proxy geometries, rasterised; and the ray caster, whose shells are spheres.
pub(super) fn geometries(args: &LamarArgs) -> [Geometry; 4] {
    let polygons = |name, placement| Geometry { name, placement, technique: Technique::Polygons(Target::Float32) };
    [
        polygons("object planes", Placement::ObjectPlanes),
        polygons("viewport planes", Placement::ViewportPlanes),
        polygons("shells", Placement::TessellatedShells { facet_pixels: args.facet_pixels }),
        Geometry { name: "ray caster", placement: Placement::Shells, technique: Technique::RayCasting },
    ]
}

/// Whether a backend draws polygons as such.
pub(super) fn rasterises(backend: &dyn Backend) -> bool {
    backend.describe().backend != "cpu"
}

/// The geometries that a backend draws: without a rasteriser, only rays.
pub(super) fn geometries_of(args: &LamarArgs, backend: &dyn Backend) -> impl Iterator<Item = Geometry> + use<> {
    let rasterises = rasterises(backend);
    geometries(args).into_iter().filter(move |g| rasterises || g.technique == Technique::RayCasting)
}

/// A scene of an data_set.
pub(super) fn scene(
    args: &LamarArgs,
    transfer: &TransferFunction,
    camera: Camera,
    geometry: Geometry,
    detail: &[Criterion],
) -> Scene {
    Scene {
        step_voxels: args.common.step,
        placement: geometry.placement,
        technique: geometry.technique,
        division: Division::Brick,
        detail: detail.to_vec(),
        ..Scene::new(camera, args.common.size, transfer.clone())
    }
}
