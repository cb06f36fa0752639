//! From a scene to a frame plan.

use brickfield_bricks::BrickTree;
use brickfield_core::glam::{UVec2, UVec3};
use brickfield_core::{Aabb, BrickId, BrickLayout, Grid, Level, ValueRange};
use brickfield_frame::{
    DarkRegions, Drawing, FramePlan, IndexEntry, Lighting, Placement, PlacementError, PlanError, PlanParts, RayFrame,
    SamplingError, Slices,
};
use brickfield_lod::{Selection, back_to_front, select_cut};

use crate::course::{Course, segment_reach, to_sample_space};
use crate::visibility::Visibility;
use crate::{Residency, Scene, Skipping, Technique};

/// Why a scene could not be prepared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum PrepareError {
    #[error("a picture of {} x {} pixels; both sides must be 1 to {limit}", size.x, size.y)]
    Size { size: UVec2, limit: u32 },
    #[error("a step of {step_voxels} voxels; it must be finite and above 0")]
    Step { step_voxels: f64 },
    #[error("clip box from {} to {}: every lower corner must be below the upper one", clip.min, clip.max)]
    Clip { clip: Aabb },
    #[error(
        "data values from {:e} to {:e}; renderers take magnitudes and widths from {least:e} to {most:e}: rescale the data", range.min, range.max
    )]
    Values { range: ValueRange, least: f64, most: f64 },
    #[error("rays of {n_segments:.3e} segments; at most {limit} are possible: take a larger step or a nearer eye")]
    TooManySegments { n_segments: f64, limit: u32 },
    #[error("{n_bricks} bricks; an index tells at most {limit} apart: take larger bricks or a coarser level")]
    TooManyBricks { n_bricks: usize, limit: u32 },
    #[error(
        "a selection of bricks of {} in {} samples, for an octree of bricks of {} in {}", selected.1, selected.0, own.1, own.0
    )]
    ForeignSelection { selected: (UVec3, u32), own: (UVec3, u32) },
    #[error(
        "about {n_polygons:.1e} polygons; at most {limit} are possible: take a larger step, larger bricks or a coarser level"
    )]
    TooManyPolygons { n_polygons: f64, limit: u32 },
    #[error("{n_facets} facets with sides of {facet_pixels} px; at most {limit} are possible: take larger facets")]
    TooManyFacets { n_facets: u32, facet_pixels: u32, limit: u32 },
    #[error(transparent)]
    Sampling(#[from] SamplingError),
    #[error(transparent)]
    Placement(#[from] PlacementError),
    #[error(transparent)]
    Plan(#[from] PlanError),
}

/// Most pixels along a side of a picture.
pub const MAX_IMAGE: u32 = 32_768;
/// Greatest magnitude of data values: f64 arithmetic goes a little further.
const MOST_VALUE: f64 = 1e300;
/// Least width of the range of data values that are not all equal.
const LEAST_WIDTH: f64 = 1e-300;
/// Most polygons of a frame, about: a gigabyte of corners.
pub const MAX_POLYGONS: u32 = 1 << 22;
/// Most facets of tessellated shells, two for each of their squares: 64 MiB of planes.
pub const MAX_FACETS: u32 = 1 << 22;
/// Most segments on a ray: an f32 counts them exactly.
pub const MAX_SEGMENTS: u32 = 1 << 24;

/// The plan of a frame: selects the cut that the scene's criteria ask for, drops the bricks that the transfer function and the view make
/// invisible, gathers the rest.
///
/// `residency` carries the bricks from frame to frame. A scene that is drawn again has its plan at once: nothing is selected,
/// compared or copied.
///
/// # Errors
/// A picture size, step, clip box, data value or number of bricks out of range.
pub fn prepare(tree: &BrickTree, scene: &Scene, residency: &mut Residency) -> Result<FramePlan, PrepareError> {
    check_size(scene.size)?;
    residency.serve(tree, scene.upload);
    if let Some(plan) = residency.plan_of(scene) {
        return Ok(plan);
    }
    let selection = select_cut(tree.layout(), tree.grid(), &scene.view(), &scene.detail);
    let plan = plan_selection(tree, scene, &selection, residency)?;
    residency.remember(scene, &plan);
    Ok(plan)
}

/// The plan of a frame of bricks that were selected before, by filters of one's own for example
/// ([`select_by`](brickfield_lod::select_by)); the scene's criteria are not asked.
///
/// Bricks that the selection ignores are left out, with or without [`Skipping`]: their blocks are empty, and so are
/// the segments of [`PreIntegrated`](brickfield_optics::QuadratureRule::PreIntegrated) that end in them.
///
/// # Errors
/// As [`prepare`], and a selection of another octree.
pub fn prepare_selection(
    tree: &BrickTree,
    scene: &Scene,
    selection: &Selection,
    residency: &mut Residency,
) -> Result<FramePlan, PrepareError> {
    check_size(scene.size)?;
    residency.serve(tree, scene.upload);
    plan_selection(tree, scene, selection, residency)
}

fn plan_selection(
    tree: &BrickTree,
    scene: &Scene,
    selection: &Selection,
    residency: &mut Residency,
) -> Result<FramePlan, PrepareError> {
    check_values(tree.summary(tree.layout().root()).range)?;
    check_layout(tree, selection)?;
    let coarsest = selection.drawn().map(|id| id.level).max().unwrap_or(Level(0));
    let Course { domain, sampling, rays } = Course::new(tree.grid(), scene, coarsest)?;
    let resident = resident_bricks(tree, scene, selection, &domain, residency);
    if resident.len() >= IndexEntry::MAX_SLOTS as usize {
        return Err(PrepareError::TooManyBricks { n_bricks: resident.len(), limit: IndexEntry::MAX_SLOTS });
    }
    let drawing = match scene.technique {
        Technique::RayCasting => Drawing::Rays,
        Technique::Polygons(target) => {
            check_polygons(tree.layout(), tree.grid(), &rays, sampling.step_world(), resident.len())?;
            Drawing::Polygons {
                back_to_front: from_back_to_front(tree, scene, &resident),
                target,
                slices: Slices::Together,
            }
        }
    };
    let field = residency.hold(tree, resident);
    // The interior of bricks is not looked at before polygons are drawn.
    let dark = match (scene.skipping, scene.technique) {
        (Skipping::On, Technique::RayCasting) => residency.dark(tree, &scene.transfer),
        _ => DarkRegions::default(),
    };
    let parts = PlanParts::new(field, rays, domain, sampling, scene.transfer.clone());
    let lighting = scene.light.map(|light| Lighting::new(light, tree.grid()));
    Ok(FramePlan::new(PlanParts { lighting, dark, drawing, ..parts })?)
}

/// An index cell of each brick, the farthest brick first.
fn from_back_to_front(tree: &BrickTree, scene: &Scene, bricks: &[BrickId]) -> Vec<UVec3> {
    let order = back_to_front(tree.layout(), tree.grid(), &scene.camera, bricks);
    order.into_iter().map(|i| bricks[i].coords << u32::from(bricks[i].level.0)).collect()
}

/// A brick is as many steps long at every level.
pub(crate) fn check_polygons(
    layout: &BrickLayout,
    grid: &Grid,
    rays: &RayFrame,
    step_world: f64,
    n_bricks: usize,
) -> Result<(), PrepareError> {
    const FACES: f64 = 6.0;
    let voxel = grid.world_box().extent() / grid.dims().as_dvec3();
    let across = match rays.placement {
        // Three stacks, each across an axis.
        Placement::ObjectPlanes => voxel.element_sum(),
        _ => voxel.length(),
    };
    let surfaces = across * f64::from(layout.side().n_cells()) / step_world;
    let of_facets = match rays.placement {
        Placement::TessellatedShells { .. } => f64::from(rays.n_facets()) * rays.n_segments,
        _ => 0.0,
    };
    let n_polygons = n_bricks as f64 * (surfaces + FACES) + of_facets;
    if n_polygons <= f64::from(MAX_POLYGONS) {
        return Ok(());
    }
    Err(PrepareError::TooManyPolygons { n_polygons, limit: MAX_POLYGONS })
}

fn check_layout(tree: &BrickTree, selection: &Selection) -> Result<(), PrepareError> {
    let (selected, own) = (selection.cut().layout(), tree.layout());
    if selected == own {
        return Ok(());
    }
    let of = |layout: &BrickLayout| (layout.dims(), layout.side().n_samples());
    Err(PrepareError::ForeignSelection { selected: of(selected), own: of(own) })
}

pub(crate) fn check_size(size: UVec2) -> Result<(), PrepareError> {
    let sides = 1..=MAX_IMAGE;
    if sides.contains(&size.x) && sides.contains(&size.y) {
        return Ok(());
    }
    Err(PrepareError::Size { size, limit: MAX_IMAGE })
}

/// Whether renderers take the values of a volume.
pub(crate) fn check_values(range: ValueRange) -> Result<(), PrepareError> {
    let magnitude = range.min.abs().max(range.max.abs());
    let is_wide = range.min == range.max || range.max - range.min >= LEAST_WIDTH;
    if magnitude <= MOST_VALUE && is_wide {
        return Ok(());
    }
    Err(PrepareError::Values { range, least: LEAST_WIDTH, most: MOST_VALUE })
}

/// The bricks that the frame needs.
fn resident_bricks(
    tree: &BrickTree,
    scene: &Scene,
    selection: &Selection,
    domain: &Aabb,
    residency: &mut Residency,
) -> Vec<BrickId> {
    if scene.skipping == Skipping::Off {
        return selection.drawn().collect();
    }
    let mut is_seen = |id: BrickId| !residency.is_transparent(tree, &scene.transfer, id);
    let in_domain = |id: &BrickId| !to_sample_space(tree.layout().index_box(*id)).intersection(domain).is_empty();
    let drawn = selection.drawn().filter(in_domain);
    match segment_reach(tree.grid(), scene, tree.layout().side().n_cells()).max(gradient_reach(tree, scene, selection))
    {
        0 => drawn.filter(|id| is_seen(*id)).collect(),
        reach => {
            let seen = selection.cut().bricks().iter().copied().filter(|id| is_seen(*id));
            let visibility = Visibility::around(*tree.layout(), seen, reach);
            drawn.filter(|id| visibility.needs(*id)).collect()
        }
    }
}

/// How many bricks of level 0 a gradient may span beside a node, along an axis: a sample of the node's level. 0 without light.
fn gradient_reach(tree: &BrickTree, scene: &Scene, selection: &Selection) -> u32 {
    if scene.light.is_none() {
        return 0;
    }
    let coarsest = selection.cut().bricks().iter().map(|id| id.level).max().unwrap_or(Level(0));
    coarsest.stride().div_ceil(tree.layout().side().n_cells())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BackendKind, Validation, open_backend};
    use brickfield_bricks::{BuildOptions, build_tree};
    use brickfield_core::glam::DVec3;
    use brickfield_core::{BrickSide, Camera, Grid, Knot, Projection, Rescale, TransferFunction, Volume};
    use brickfield_frame::Division;
    use brickfield_lod::{Answer, Tile, select_by};

    #[test]
    fn values_at_the_ends_of_f64_are_refused() {
        let grid = Grid::axis_aligned(UVec3::splat(4), DVec3::ONE).unwrap();
        let plan = |unit: f64| {
            let values: Vec<f64> = (0..64).map(|i| f64::from(i) * unit).collect();
            let tree = build_tree(&Volume::new(grid, values).unwrap(), &BuildOptions::default()).unwrap();
            let camera = Camera::framing(&grid.world_box(), DVec3::X, DVec3::Z).unwrap();
            let fog = TransferFunction::constant(0.1, [1.0; 3]).unwrap();
            prepare(&tree, &Scene::new(camera, UVec2::new(4, 4), fog), &mut Residency::default())
        };
        assert!([1e298, 1.0, 1e-298, 0.0].into_iter().all(|unit| plan(unit).is_ok()));
        for unit in [1e300, -1e300, 1e-305, 1e-310] {
            assert!(matches!(plan(unit), Err(PrepareError::Values { .. })), "{unit}");
        }
    }

    #[test]
    fn stored_voxels_are_drawn_as_their_values() {
        let grid = Grid::axis_aligned(UVec3::splat(20), DVec3::ONE).unwrap();
        let rescale = Rescale::new(-0.25, 40.0).unwrap();
        let stored: Vec<u8> = (0..8000u32).map(|i| (i % 20 * 12) as u8).collect();
        let values: Vec<f32> = stored.iter().map(|v| rescale.value(f64::from(*v)) as f32).collect();
        let picture = |volume: Volume| {
            let tree = build_tree(&volume, &BuildOptions::default()).unwrap();
            let camera = Camera::framing(&grid.world_box(), DVec3::new(1.0, 2.0, 3.0), DVec3::Z).unwrap();
            let knot = |value: f64, extinction: f64| Knot { value, extinction, color: [0.2, 0.5, 1.0] };
            let transfer = TransferFunction::new(vec![knot(-10.0, 0.0), knot(10.0, 0.2), knot(40.0, 0.05)]).unwrap();
            let scene = Scene::new(camera, UVec2::new(24, 24), transfer);
            let plan = prepare(&tree, &scene, &mut Residency::default()).unwrap();
            let mut backend = open_backend(BackendKind::Cpu, None, Validation::Off).unwrap();
            backend.render(&plan).unwrap().image
        };
        let of_stored = picture(Volume::rescaled(grid, stored, rescale).unwrap());
        let of_values = picture(Volume::new(grid, values).unwrap());
        let pairs = of_stored.pixels().iter().flatten().zip(of_values.pixels().iter().flatten());
        assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-5) && pairs.map(|(a, _)| *a).sum::<f32>() > 10.0);
    }

    #[test]
    fn an_eye_so_far_that_segments_cannot_be_counted_is_refused() {
        let grid = Grid::axis_aligned(UVec3::splat(8), DVec3::ONE).unwrap();
        let tree = build_tree(&Volume::new(grid, vec![1u8; 512]).unwrap(), &BuildOptions::default()).unwrap();
        let fog = TransferFunction::constant(0.1, [1.0; 3]).unwrap();
        let plan = |distance: f64| {
            let projection = Projection::Perspective { fov_y: 0.5 };
            let camera = Camera::look_at(DVec3::X * distance, DVec3::ZERO, DVec3::Z, projection).unwrap();
            prepare(&tree, &Scene::new(camera, UVec2::new(4, 4), fog.clone()), &mut Residency::default())
        };
        assert!(plan(1e6).is_ok());
        assert!(matches!(plan(1e30), Err(PrepareError::TooManySegments { .. })), "{:?}", plan(1e30).err());
    }

    #[test]
    fn a_selection_of_another_octree_is_refused() {
        let tree = |n: u32| {
            let grid = Grid::axis_aligned(UVec3::splat(n), DVec3::ONE).unwrap();
            let volume = Volume::new(grid, vec![1u8; grid.n_voxels()]).unwrap();
            build_tree(&volume, &BuildOptions::default()).unwrap()
        };
        let (tree, other) = (tree(64), tree(65));
        let camera = Camera::framing(&tree.grid().world_box(), DVec3::X, DVec3::Z).unwrap();
        let scene = Scene::new(camera, UVec2::new(4, 4), TransferFunction::constant(0.1, [1.0; 3]).unwrap());
        let of = |of: &BrickTree| select_cut(of.layout(), of.grid(), &scene.view(), &scene.detail);
        let plan = |selection| prepare_selection(&tree, &scene, &selection, &mut Residency::default());
        assert!(plan(of(&tree)).is_ok());
        let refused = plan(of(&other)).unwrap_err().to_string();
        assert!(
            refused.contains("in [65, 65, 65] samples, for an octree") && refused.contains("in [64, 64, 64]"),
            "{refused}"
        );
    }

    #[test]
    fn what_is_kept_from_frame_to_frame_is_what_the_frame_needs() {
        let grid = Grid::axis_aligned(UVec3::new(61, 31, 31), DVec3::ONE).unwrap();
        // A ramp in every brick; beyond the middle with grain.
        let value = |i: usize| (i % 61 % 15 / 2 + if i % 61 > 30 { i / 61 % 2 } else { 0 }) as u8;
        let values: Vec<u8> = (0..grid.n_voxels()).map(value).collect();
        let options = BuildOptions { side: BrickSide::S16, ..BuildOptions::default() };
        let tree = build_tree(&Volume::new(grid, values).unwrap(), &options).unwrap();
        let camera = Camera::framing(&grid.world_box(), DVec3::new(0.3, 1.0, 0.2), DVec3::Z).unwrap();
        let visible = |values: [f64; 2], clip: [f64; 2]| {
            let knot = |value, extinction| Knot { value, extinction, color: [1.0; 3] };
            let transfer = TransferFunction::new(vec![knot(values[0], 0.0), knot(values[1], 0.4)]).unwrap();
            let clip = Aabb { min: DVec3::new(clip[0], 0.0, 0.0), max: DVec3::new(clip[1], 31.0, 31.0) };
            Scene { clip: Some(clip), ..Scene::new(camera, UVec2::new(4, 4), transfer) }
        };
        // As many other bricks; the same bricks with as many other knots; both back again; and some of them.
        let scenes = [
            visible([1.0, 9.0], [0.0, 30.0]),
            visible([1.0, 9.0], [31.0, 61.0]),
            visible([3.0, 9.0], [31.0, 61.0]),
            visible([5.0, 9.0], [31.0, 61.0]),
            visible([1.0, 9.0], [0.0, 30.0]),
            visible([1.0, 9.0], [0.0, 61.0]),
            visible([1.0, 9.0], [0.0, 61.0]),
            visible([1.0, 9.0], [0.0, 10.0]),
        ];
        let mut kept = Residency::default();
        let fresh = |scene: &Scene| {
            let mut residency = Residency::default();
            (prepare(&tree, scene, &mut residency).unwrap(), residency)
        };
        let all: Vec<_> = scenes.iter().map(fresh).collect();
        let n_filled = |i: usize| all[i].0.field().slots().n_filled();
        assert!(n_filled(0) == n_filled(1) && all[0].0.field() != all[1].0.field());
        assert!(all[1].1.bricks() == all[2].1.bricks() && all[1].0.occupancy() != all[2].0.occupancy());
        for (scene, (plan, residency)) in scenes.iter().zip(&all) {
            let got = prepare(&tree, scene, &mut kept).unwrap();
            assert_eq!(kept.bricks(), residency.bricks());
            assert_same_frame(&got, plan);
        }
    }

    /// Whichever slots the bricks are in.
    fn assert_same_frame(a: &FramePlan, b: &FramePlan) {
        assert_eq!((a.visible(), a.beams(), a.features()), (b.visible(), b.beams(), b.features()));
        let dims = a.field().index().dims();
        assert_eq!(dims, b.field().index().dims());
        let cells =
            (0..dims.element_product()).map(|i| UVec3::new(i % dims.x, i / dims.x % dims.y, i / dims.x / dims.y));
        for cell in cells {
            let entries = [a, b].map(|plan| plan.field().index().at(cell));
            assert_eq!(entries[0].reach(), entries[1].reach());
            let of = |plan: &FramePlan, entry: IndexEntry| {
                let slot = entry.slot()?;
                let distances = plan.occupancy().map(|occupancy| occupancy.brick(slot).to_vec());
                Some((plan.field().slots().samples(slot)?.bytes().to_vec(), distances))
            };
            assert_eq!(of(a, entries[0]), of(b, entries[1]));
        }
    }

    /// A ramp of 4 x 1 x 1 bricks of 16, of which a clip box shows some; and the ramp's opposite, as another time step.
    fn time_steps() -> ([BrickTree; 2], impl Fn(f64) -> Scene) {
        let grid = Grid::axis_aligned(UVec3::new(61, 16, 16), DVec3::ONE).unwrap();
        let tree = |value: fn(usize) -> u8| {
            let values: Vec<u8> = (0..grid.n_voxels()).map(value).collect();
            let options = BuildOptions { side: BrickSide::S16, ..BuildOptions::default() };
            build_tree(&Volume::new(grid, values).unwrap(), &options).unwrap()
        };
        let trees = [tree(|i| (i % 61) as u8), tree(|i| 61 - (i % 61) as u8)];
        let camera = Camera::framing(&grid.world_box(), DVec3::new(0.3, 1.0, 0.2), DVec3::Z).unwrap();
        let scene = move |far: f64| {
            let fog = TransferFunction::constant(0.1, [1.0; 3]).unwrap();
            let clip = Aabb { min: DVec3::ZERO, max: DVec3::new(far, 16.0, 16.0) };
            Scene { clip: Some(clip), ..Scene::new(camera, UVec2::new(4, 4), fog) }
        };
        (trees, scene)
    }

    #[test]
    fn time_steps_that_share_a_residency_are_drawn_with_their_own_data() {
        let ([first, second], scene) = time_steps();
        let mut residency = Residency::default();
        let mut plan = |tree| prepare(tree, &scene(61.0), &mut residency).unwrap();
        let (a, b) = (plan(&first), plan(&second));
        assert_same_frame(&b, &prepare(&second, &scene(61.0), &mut Residency::default()).unwrap());
        assert_ne!(a.field().slots().samples(0), b.field().slots().samples(0));
    }

    #[test]
    fn a_scene_that_is_drawn_again_costs_nothing_and_a_brick_more_costs_one() {
        use brickfield_frame::Chunked;
        let ([tree, _], scene) = time_steps();
        let mut residency = Residency::default();
        let mut plan = |far: f64| {
            let plan = prepare(&tree, &scene(far), &mut residency).unwrap();
            (plan, residency.copied().n_bricks)
        };
        let ((two, copied_two), (again, copied_again)) = (plan(20.0), plan(20.0));
        assert_eq!((copied_two, copied_again), (2, 0));
        assert!(two.field().index().id() == again.field().index().id());
        assert!(two.field().slots().id() == again.field().slots().id());
        let (three, copied) = plan(40.0);
        assert_eq!((three.field().slots().n_filled(), copied), (3, 1));
        let chunk = |plan: &FramePlan, slot: u32| plan.field().slots().samples(slot).unwrap().id();
        assert!((0..2).all(|slot| chunk(&two, slot) == chunk(&three, slot)));
    }

    #[test]
    fn bricks_that_a_selection_ignores_are_not_there() {
        let grid = Grid::axis_aligned(UVec3::splat(64), DVec3::ONE).unwrap();
        let tree =
            build_tree(&Volume::new(grid, vec![1u8; grid.n_voxels()]).unwrap(), &BuildOptions::default()).unwrap();
        let near_half = |tile: &Tile<'_>| match tile.sample_box().max.x {
            x if x > 32.0 && tile.id().level == Level(0) => Answer::Ignore,
            _ => Answer::Descend,
        };
        let selection = select_by(tree.layout(), tree.grid(), near_half);
        let camera = Camera::framing(&grid.world_box(), DVec3::new(0.3, 1.0, 0.2), DVec3::Z).unwrap();
        let scene = Scene::new(camera, UVec2::new(4, 4), TransferFunction::constant(0.1, [1.0; 3]).unwrap());
        for skipping in [Skipping::On, Skipping::Off] {
            let (scene, mut residency) = (Scene { skipping, ..scene.clone() }, Residency::default());
            prepare_selection(&tree, &scene, &selection, &mut residency).unwrap();
            let drawn: Vec<_> = selection.drawn().collect();
            assert!(residency.bricks() == drawn && drawn.len() < selection.cut().bricks().len(), "{skipping:?}");
        }
    }

    #[test]
    fn polygons_and_facets_that_no_memory_holds_and_polygons_of_spheres_and_rays_are_refused() {
        let grid = Grid::axis_aligned(UVec3::splat(64), DVec3::ONE).unwrap();
        let tree = build_tree(&Volume::new(grid, vec![1u8; 64 * 64 * 64]).unwrap(), &BuildOptions::default()).unwrap();
        let camera = Camera::framing(&grid.world_box(), DVec3::X, DVec3::Z).unwrap();
        let fog = TransferFunction::constant(0.1, [1.0; 3]).unwrap();
        let plan = |step_voxels, placement, division| {
            let technique = Technique::Polygons(brickfield_frame::Target::Float32);
            let scene = Scene::new(camera, UVec2::new(4, 4), fog.clone());
            let scene = Scene { step_voxels, placement, division, technique, ..scene };
            prepare(&tree, &scene, &mut Residency::default()).map(|plan| plan.proxy().is_some())
        };
        assert_eq!(plan(1.0, Placement::ObjectPlanes, Division::Brick), Ok(true));
        assert_eq!(plan(1.0, Placement::Shells, Division::Brick), Err(PrepareError::Plan(PlanError::RoundPolygons)));
        assert_eq!(
            plan(1.0, Placement::ObjectPlanes, Division::Ray),
            Err(PrepareError::Plan(PlanError::PolygonsOfRays))
        );
        let many = plan(1e-5, Placement::ObjectPlanes, Division::Brick);
        assert!(matches!(many, Err(PrepareError::TooManyPolygons { .. })), "{many:?}");
        let scene = Scene::new(camera, UVec2::new(4096, 2048), fog.clone());
        let facets = |facet_pixels| {
            let scene = Scene { placement: Placement::TessellatedShells { facet_pixels }, ..scene.clone() };
            prepare(&tree, &scene, &mut Residency::default()).map(|_| ())
        };
        let limit = MAX_FACETS;
        let many = PrepareError::TooManyFacets { n_facets: 4 * limit, facet_pixels: 1, limit };
        assert_eq!((facets(1), facets(2)), (Err(many), Ok(())));
    }
}
