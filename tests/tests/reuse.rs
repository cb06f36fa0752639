//! Data that frames share stays on the device, and no old data is drawn, on either GPU backend. Prints `no device` where there is none.

mod devices;

use std::sync::Arc;

use brickfield::bricks::{BlockOptions, build_blocks};
use brickfield::core::glam::{DVec3, UVec2, UVec3};
use brickfield::core::{
    BlockSide, BrickSide, Camera, Grid, Interblock, Knot, Level, Projection, TransferFunction, Volume,
};
use brickfield::frame::{
    Backend, Chunk, DarkRegions, DarkRuns, Decode, Drawing, Evaluate, Feature, Field, Frame, FramePlan, IndexEntry,
    IndexGrid, IndexLattice, Join, MacrocellRanges, Mode, Occupancy, Places, PlanParts, QuadratureRule, RayFrame,
    Reach, SampleFormat, Sampling, Sequence, ShaderFunction, Slots, Steps,
};
use brickfield::optics::{Light, LightSource, LightTerms, Normals};
use brickfield::{BlockResidency, BlockStyle, Classification, Scene, prepare_blocks};
use brickfield_ash::{AshBackend, Options, Validation};
use brickfield_wgpu::WgpuBackend;
use devices::on_both_backends;

/// A backend on this machine's default device.
trait Open: Backend + Evaluate + Sized {
    /// `None` without a device.
    fn open() -> Option<Self>;
}

impl Open for WgpuBackend {
    fn open() -> Option<WgpuBackend> {
        devices::wgpu()
    }
}

impl Open for AshBackend {
    fn open() -> Option<AshBackend> {
        devices::ash(&Options { validation: Validation::Off, ..Options::default() })
    }
}

on_both_backends! {
    one_brick_in_anothers_place_is_brought_alone
    an_atlas_that_grows_keeps_its_bricks
    leaps_are_over_the_dark_of_the_bricks_that_are_there
    bricks_that_were_not_drawn_for_a_while_are_still_themselves
    an_unchanged_plan_brings_its_numbers_only
    flat_blocks_that_come_move_and_go_are_drawn_where_they_are
}

const SIDE: BrickSide = BrickSide::S16;
const FORMAT: SampleFormat = SampleFormat::Float32;
const DECODE: Decode = Decode { scale: 1.0, offset: 0.0 };
const BRICK_BYTES: u64 = 4 * 16 * 16 * 16;
/// Index, beams, uniforms and knots are fewer.
const NUMBERS_BYTES: u64 = 8 << 10;
const N_BRICKS: u32 = 9;
const CELLS: UVec3 = UVec3::new(3, 3, 1);
const DIMS: UVec3 = UVec3::new(46, 46, 16);
const DARK: f32 = -1.0;

/// A brick of a tone, and its macrocells' distances. No two tones have a visible value in common, or are dark in the same places.
#[derive(Clone)]
struct Brick {
    samples: Arc<Chunk>,
    distances: Arc<Chunk>,
}

fn brick(tone: u32) -> Brick {
    let value = |x: u32, y: u32, z: u32| match (x + 5 * tone) % 16 {
        0..6 => DARK,
        _ => tone as f32 + (x + 2 * y + 3 * z) as f32 / 128.0,
    };
    let bytes: Vec<u8> = (0..4096).flat_map(|i| value(i % 16, i / 16 % 16, i / 256).to_le_bytes()).collect();
    let distances = MacrocellRanges::of(SIDE, FORMAT, &bytes).distances(&DarkRuns::of_transfer(&fog(), FORMAT, DECODE));
    Brick { samples: Arc::new(Chunk::new(bytes)), distances: Arc::new(distances) }
}

fn bricks(tones: impl IntoIterator<Item = u32>) -> Vec<Option<Brick>> {
    tones.into_iter().map(|tone| Some(brick(tone))).collect()
}

/// So thin that the far side of a brick is seen; every value has a colour of its own.
fn fog() -> TransferFunction {
    let knot = |value: f64, extinction, color| Knot { value, extinction, color };
    let (red, green) = ([1.0, 0.0, 0.1], [0.0, 1.0, 0.9]);
    let knots = vec![knot(-0.5, 0.0, red), knot(0.0, 0.05, red), knot(16.0, 0.05, green)];
    TransferFunction::new(knots).unwrap()
}

/// The cell of the index that a slot is drawn in: slots follow one another in another order than cells.
fn cell(slot: u32) -> UVec3 {
    let i = (4 * slot + 2) % N_BRICKS;
    UVec3::new(i % CELLS.x, i / CELLS.x, 0)
}

/// The field of some bricks by their slots; where there is none it is empty.
fn field(bricks: &[Option<Brick>]) -> Field {
    let lattice = IndexLattice { cell_samples: SIDE.n_cells(), origin: 0.0 };
    let filled = (0u32..).zip(bricks).filter(|(_, brick)| brick.is_some()).map(|(slot, _)| slot);
    let entries = filled.map(|slot| (cell(slot), IndexEntry::Resident { slot, reach: Reach(0) }));
    let index = IndexGrid::new(CELLS, lattice, entries);
    let samples = bricks.iter().map(|brick| brick.as_ref().map(|b| b.samples.clone())).collect();
    let slots = Slots::new(FORMAT, DECODE, Places::Even(SIDE), samples).unwrap();
    Field::new(DIMS, Arc::new(index), Arc::new(slots), Join::Shared).unwrap()
}

/// A picture of some bricks, from a side where none is behind another.
fn parts(bricks: &[Option<Brick>]) -> PlanParts {
    let (field, grid) = (field(bricks), Grid::axis_aligned(DIMS, DVec3::ONE).unwrap());
    let (center, domain) = (grid.world_box().center(), field.volume_box());
    let projection = Projection::Orthographic { height: 46.0 };
    let camera = Camera::look_at(center - DVec3::Z * 20.0, center, DVec3::Y, projection).unwrap();
    let sampling = Sampling::new(0.5, QuadratureRule::MidpointExponential, Mode::Exact).unwrap();
    PlanParts {
        field,
        rays: RayFrame::new(&camera, &grid, UVec2::splat(46), &domain, &Steps::shells(sampling.step_world())),
        domain,
        sampling,
        transfer: fog(),
        lighting: None,
        dark: DarkRegions::default(),
        drawing: Drawing::Rays,
        sequence: Sequence::Whole,
    }
}

fn plan(bricks: &[Option<Brick>]) -> FramePlan {
    FramePlan::new(parts(bricks)).unwrap()
}

/// The same, with leaps over what is dark inside of bricks.
fn leaping(bricks: &[Option<Brick>]) -> FramePlan {
    let parts = parts(bricks);
    let distances = bricks.iter().map(|brick| brick.as_ref().map(|b| b.distances.clone())).collect();
    let dark = DarkRegions::new(&parts.field, Occupancy::new(SIDE, distances)).unwrap();
    FramePlan::new(PlanParts { dark, ..parts }).unwrap()
}

/// The frame of a plan of some bricks, which is a fresh backend's, and in which each brick lies where it belongs.
#[track_caller]
fn frame<B: Open>(backend: &mut B, plan: &FramePlan, bricks: &[Option<Brick>]) -> Frame {
    let frame = backend.render(plan).unwrap();
    let local = UVec3::new(7, 4, 11);
    let at = |slot: u32| (cell(slot) * SIDE.n_cells() + local).as_vec3().extend(0.0).to_array();
    let inputs: Vec<_> = (0..bricks.len() as u32).map(at).collect();
    let samples = backend.evaluate(plan, ShaderFunction::Sample, &inputs).unwrap();
    for (slot, (brick, found)) in bricks.iter().zip(samples).enumerate() {
        let i = (local.x + 16 * (local.y + 16 * local.z)) as usize;
        let stored = |brick: &Brick| FORMAT.read(brick.samples.bytes(), i) as f32;
        let [expected, resident] = brick.as_ref().map_or([0.0; 2], |brick| [stored(brick), 1.0]);
        assert!((found[0] - expected).abs() < 1e-5 && found[1] == resident, "slot {slot}: {found:?}, not {expected}");
    }
    let fresh = B::open().unwrap().render(plan).unwrap();
    assert!(frame.image == fresh.image, "a fresh backend has another picture");
    frame
}

fn one_brick_in_anothers_place_is_brought_alone<B: Open>() {
    let Some(mut backend) = B::open() else { return };
    let mut bricks = bricks(0..N_BRICKS);
    let mut before = frame(&mut backend, &plan(&bricks), &bricks);
    assert!(before.uploaded_bytes >= u64::from(N_BRICKS) * BRICK_BYTES);
    for (slot, tone) in [(0, 10), (4, 11), (8, 12), (4, 13)] {
        bricks[slot] = Some(brick(tone));
        let after = frame(&mut backend, &plan(&bricks), &bricks);
        assert!(after.image != before.image, "slot {slot}: its brick is not seen");
        let n_bytes = after.uploaded_bytes;
        assert!((BRICK_BYTES..3 * BRICK_BYTES + NUMBERS_BYTES).contains(&n_bytes), "slot {slot}: {n_bytes} bytes");
        before = after;
    }
}

fn an_atlas_that_grows_keeps_its_bricks<B: Open>() {
    let Some(mut backend) = B::open() else { return };
    grow(&mut backend, plan);
}

/// So do the lists of macrocells' distances; and to leap changes nothing.
fn leaps_are_over_the_dark_of_the_bricks_that_are_there<B: Open>() {
    let Some(mut backend) = B::open() else { return };
    grow(&mut backend, leaping);
    let mut bricks = bricks(0..N_BRICKS);
    for (slot, tone) in [(0, 10), (4, 11), (8, 12)] {
        bricks[slot] = Some(brick(tone));
        let plan = leaping(&bricks);
        assert!(plan.features().contains(Feature::SkipDark));
        let leapt = frame(&mut backend, &plan, &bricks).image;
        let whole = backend.render(&self::plan(&bricks)).unwrap().image;
        let pairs = leapt.pixels().iter().flatten().zip(whole.pixels().iter().flatten());
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst <= 1e-6, "slot {slot}: {worst:e}");
    }
}

fn grow<B: Open>(backend: &mut B, plan: fn(&[Option<Brick>]) -> FramePlan) {
    let bricks = bricks(0..N_BRICKS);
    let mut n_held = 0;
    for n in [2, 3, 9, 2, 9] {
        let n_bytes = frame(backend, &plan(&bricks[..n]), &bricks[..n]).uploaded_bytes;
        let n_new = n.saturating_sub(n_held) as u64;
        let most = n_new * BRICK_BYTES + NUMBERS_BYTES;
        assert!((n_new * BRICK_BYTES..most).contains(&n_bytes), "{n} bricks, {n_new} of them new: {n_bytes} bytes");
        n_held = n_held.max(n);
    }
}

/// What a device is thought to hold must still be there, whatever was brought for frames in between.
fn bricks_that_were_not_drawn_for_a_while_are_still_themselves<B: Open>() {
    let Some(mut backend) = B::open() else { return };
    let (old, new) = (bricks(0..4), bricks(4..8));
    // All slots but one are filled anew, and the one comes back: the last, while there are fewer slots, and one among others.
    for (left_out, n_slots) in [(3, 3), (1, 4)] {
        frame(&mut backend, &plan(&old), &old);
        let mut bricks = new.clone();
        bricks[left_out] = None;
        frame(&mut backend, &plan(&bricks[..n_slots]), &bricks[..n_slots]);
        bricks[left_out] = old[left_out].clone();
        frame(&mut backend, &plan(&bricks), &bricks);
    }
}

fn an_unchanged_plan_brings_its_numbers_only<B: Open>() {
    let Some(mut backend) = B::open() else { return };
    let plan = plan(&bricks(0..N_BRICKS));
    let first = backend.render(&plan).unwrap();
    assert!(first.uploaded_bytes >= u64::from(N_BRICKS) * BRICK_BYTES);
    for plan in [&plan, &plan.clone()] {
        let again = backend.render(plan).unwrap();
        assert!(again.image == first.image);
        assert!((1..4 << 10).contains(&again.uploaded_bytes), "{} bytes", again.uploaded_bytes);
    }
}

#[test]
fn the_layer_is_silent_while_an_atlas_grows_brick_by_brick() {
    let options = Options { validation: Validation::On, copy_bytes: BRICK_BYTES as usize, ..Options::default() };
    let Some(mut backend) = devices::ash(&options) else { return };
    grow(&mut backend, leaping);
    assert_eq!(backend.validation_messages(), Vec::<String>::new());
}

/// Frames of one residency on one device look as each does alone: coarse and fine levels by turns, so that blocks are packed anew, with
/// spreads and gradients and without.
fn flat_blocks_that_come_move_and_go_are_drawn_where_they_are<B: Open>() {
    let Some(mut backend) = B::open() else { return };
    let grid = Grid::axis_aligned(UVec3::new(40, 33, 20), DVec3::ONE).unwrap();
    let voxels: Vec<u8> = (0..grid.n_voxels() as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let volume = Arc::new(Volume::new(grid, voxels).unwrap());
    let blocks = build_blocks(volume, &BlockOptions { side: BlockSide::V8, ..BlockOptions::default() }).unwrap();
    let knot = |value, extinction| Knot { value, extinction, color: [0.9, 0.4, 0.2] };
    let transfer = TransferFunction::new(vec![knot(60.0, 0.0), knot(255.0, 0.1)]).unwrap();
    let camera = Camera::framing(&grid.world_box(), DVec3::new(1.0, 0.8, 0.5), DVec3::Z).unwrap();
    let light = Light::new(LightSource::Head, LightTerms::default(), 20.0).unwrap();
    let n_blocks = brickfield::bricks::BlockSource::layout(&blocks).n_blocks_total();
    let levels = |n_fine: usize, level: u8| {
        (0..n_blocks).map(|i| Level(if i % 7 < n_fine { level } else { 3 })).collect::<Vec<_>>()
    };
    let mut residency = BlockResidency::default();
    for (n_fine, level, is_rich) in [
        (7, 0, true),
        (1, 1, true),
        (6, 0, true),
        (1, 2, false),
        (5, 1, true),
        (2, 0, false),
        (0, 3, true),
        (7, 1, true),
    ] {
        let normals = if is_rich { Normals::Stored } else { Normals::Central };
        let light = Some(light.on_normals(normals));
        let scene = Scene { light, ..Scene::new(camera, UVec2::new(32, 24), transfer.clone()) };
        let classification = if is_rich { Classification::Prefiltered } else { Classification::OfMean };
        let style =
            BlockStyle { join: Join::Blend(Interblock::MaximumDistance), classification, ..BlockStyle::default() };
        let levels = levels(n_fine, level);
        let plan = prepare_blocks(&blocks, &scene, &levels, style, &mut residency).unwrap();
        let alone = prepare_blocks(&blocks, &scene, &levels, style, &mut BlockResidency::default()).unwrap();
        let image = backend.render(&plan).unwrap().image;
        assert!(image.pixels().iter().any(|pixel| pixel[3] > 0.1));
        assert!(image == B::open().unwrap().render(&alone).unwrap().image, "{n_fine} of 7 blocks at level {level}");
    }
}
