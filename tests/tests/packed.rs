//! Packed slots, which the device unpacks, are those that the cpu unpacks, bit by bit, on either GPU backend; and a shader that unpacks
//! them wrongly is noticed. Prints `no device` where there is none.

mod devices;

use std::sync::Arc;

use brickfield::bricks::{BlockOptions, BrickTree, BuildOptions, build_blocks, build_tree};
use brickfield::core::glam::{DVec3, UVec2, UVec3};
use brickfield::core::{
    BlockSide, BrickSide, Camera, Grid, Interblock, Knot, Level, TransferFunction, Volume, Voxels, WorldPos,
};
use brickfield::frame::{Backend, Evaluate, Frame, FramePlan, Join, ShaderFunction, Upload};
use brickfield::lod::Criterion;
use brickfield::{
    BlockResidency, BlockStyle, Residency, Scene, Skipping, TrimResidency, TrimmedVolume, Trimming, prepare,
    prepare_blocks, prepare_trimmed,
};
use brickfield_ash::{AshBackend, Options, Validation};
use brickfield_shaders::ShaderLibrary;
use brickfield_wgpu::WgpuBackend;
use devices::on_both_backends;

/// A backend on this machine's default device, with its own shaders or others.
trait Open: Backend + Evaluate + Sized {
    /// `None` without a device.
    fn open(library: ShaderLibrary) -> Option<Self>;
}

impl Open for WgpuBackend {
    fn open(library: ShaderLibrary) -> Option<WgpuBackend> {
        let mut backend = devices::wgpu()?;
        backend.set_library(library);
        Some(backend)
    }
}

impl Open for AshBackend {
    fn open(library: ShaderLibrary) -> Option<AshBackend> {
        devices::ash(&Options::default()).map(|backend| backend.with_library(library))
    }
}

on_both_backends! {
    bricks_of_every_type_are_unpacked_to_their_samples
    lossy_bricks_are_unpacked_to_the_samples_of_the_cpu
    flat_blocks_and_trimmed_bricks_look_as_plain_ones
    a_brick_that_comes_is_brought_and_unpacked_alone
    shaders_that_unpack_wrongly_are_noticed
}

const PACKED: Upload = Upload::Packed { max_error: 0 };

/// Waves that leave no sample equal to its neighbours, a slab of one value, and noise in a corner: kernels, one value, plain. Values go
/// from 0 to 1.
fn waves(p: DVec3, dims: DVec3) -> f64 {
    let noise = (p.x * 12.9898 + p.y * 78.233 + p.z * 37.719).sin().abs() * 43_758.545;
    let unit = p / dims;
    match unit {
        u if u.z > 0.6 && u.x > 0.6 && u.y > 0.5 => noise.fract(),
        u if u.x < 0.45 && u.z > 0.45 => 0.25,
        u => 0.5 + 0.25 * (4.0 * u.x + 7.0 * u.y * u.y).sin() + 0.24 * (9.0 * u.z + 3.0 * u.x * u.y).cos(),
    }
}

/// A volume whose bricks at the upper ends reach beyond it.
fn volume<T>(sample: impl Fn(f64) -> T) -> Volume
where
    Voxels: From<Vec<T>>,
{
    let dims = UVec3::new(41, 37, 50);
    let grid = Grid::axis_aligned(dims, DVec3::ONE).unwrap();
    let voxel = |i: u32| {
        let p = UVec3::new(i % dims.x, i / dims.x % dims.y, i / (dims.x * dims.y));
        sample(waves(p.as_dvec3(), dims.as_dvec3()))
    };
    Volume::new(grid, (0..grid.n_voxels() as u32).map(voxel).collect::<Vec<T>>()).unwrap()
}

/// Every type whose samples are packed, each with its range.
fn volumes() -> [Volume; 4] {
    [
        volume(|v| (v * 255.0) as u8),
        volume(|v| (v * 255.0 - 128.0) as i8),
        volume(|v| (v * 65_535.0) as u16),
        volume(|v| (v * 65_535.0 - 32_768.0) as i16),
    ]
}

fn tree(volume: &Volume, side: BrickSide) -> BrickTree {
    build_tree(volume, &BuildOptions { side, ..BuildOptions::default() }).unwrap()
}

/// Every value of a volume is seen, thinly.
fn scene(volume: &Volume, upload: Upload) -> Scene {
    let range = volume.range();
    let knot = |at: f64, extinction, color| Knot { value: range.min + at * (range.max - range.min), extinction, color };
    let knots =
        vec![knot(0.0, 0.01, [1.0, 0.0, 0.1]), knot(0.5, 0.08, [0.1, 1.0, 0.0]), knot(1.0, 0.02, [0.0, 0.3, 1.0])];
    let camera = Camera::framing(&volume.grid().world_box(), DVec3::new(1.0, 0.7, 0.4), DVec3::Z).unwrap();
    let scene = Scene::new(camera, UVec2::new(40, 32), TransferFunction::new(knots).unwrap());
    Scene { upload, skipping: Skipping::Off, ..scene }
}

fn plan(tree: &BrickTree, scene: &Scene) -> FramePlan {
    prepare(tree, scene, &mut Residency::default()).unwrap()
}

/// The bytes of slots that are packed, as they are brought; and those of the others.
fn bytes(plan: &FramePlan) -> (u64, u64) {
    let chunks = plan.field().slots().all_samples().iter().flatten();
    chunks.fold((0, 0), |(packed, plain), chunk| match chunk.packed() {
        Some(samples) => (packed + samples.n_bytes() as u64, plain),
        None => (packed, plain + chunk.bytes().len() as u64),
    })
}

/// Values at samples of every slot: exactly those of its chunk.
fn is_unpacked<B: Open>(backend: &mut B, tree: &BrickTree, plan: &FramePlan) -> bool {
    let (slots, dims) = (plan.field().slots(), tree.layout().dims());
    let positions: Vec<UVec3> = (0..dims.element_product())
        .step_by(3)
        .map(|i| UVec3::new(i % dims.x, i / dims.x % dims.y, i / (dims.x * dims.y)))
        .collect();
    let inputs: Vec<[f32; 4]> = positions.iter().map(|p| p.as_vec3().extend(0.0).to_array()).collect();
    let found = backend.evaluate(plan, ShaderFunction::Sample, &inputs).unwrap();
    let cells = tree.layout().side().n_cells();
    let n = tree.layout().side().n_samples();
    positions.iter().zip(found).all(|(p, found)| {
        let cell = (p / cells).min(plan.field().index().dims() - 1);
        let brickfield::frame::IndexEntry::Resident { slot, .. } = plan.field().index().at(cell) else { return false };
        let local = p - cell * cells;
        let i = (local.x + n * (local.y + n * local.z)) as usize;
        let read = slots.format().read(slots.samples(slot).unwrap().bytes(), i);
        let expected = slots.decode().value(read);
        (f64::from(found[0]) - expected).abs() < 0.25
    })
}

/// The picture of a packed plan is that of a plain plan, bit by bit, on all backends.
fn bricks_of_every_type_are_unpacked_to_their_samples<B: Open>() {
    let Some(mut backend) = B::open(ShaderLibrary::embedded()) else { return };
    for (volume, side) in volumes().iter().zip([BrickSide::S16, BrickSide::S32, BrickSide::S32, BrickSide::S16]) {
        let what = volume.scalar_type();
        let tree = tree(volume, side);
        let (plain, packed) = (plan(&tree, &scene(volume, Upload::Plain)), plan(&tree, &scene(volume, PACKED)));
        let ((none, all), (n_packed, n_plain)) = (bytes(&plain), bytes(&packed));
        assert!(
            none == 0 && n_packed > 0 && n_packed + n_plain < all * 9 / 10,
            "{what}: {n_packed}, {n_plain} of {all}"
        );
        let (expected, found) = (backend.render(&plain).unwrap(), backend.render(&packed).unwrap());
        assert!(expected.image.pixels().iter().any(|pixel| pixel[3] > 0.1));
        assert!(expected.image == found.image, "{what}: another picture");
        let saved = expected.uploaded_bytes - found.uploaded_bytes;
        assert_eq!(saved, all - n_packed - n_plain, "{what}");
        assert!(is_unpacked(&mut backend, &tree, &packed), "{what}: other samples");
    }
}

fn lossy_bricks_are_unpacked_to_the_samples_of_the_cpu<B: Open>() {
    let Some(mut backend) = B::open(ShaderLibrary::embedded()) else { return };
    for (volume, max_error) in volumes().iter().zip([1, 4, 300, 2]) {
        let what = volume.scalar_type();
        let tree = tree(volume, BrickSide::S16);
        let exact = plan(&tree, &scene(volume, PACKED));
        let lossy = plan(&tree, &scene(volume, Upload::Packed { max_error }));
        let slots = |plan: &FramePlan| plan.field().slots().all_samples().to_vec();
        let format = lossy.field().slots().format();
        let mut worst = 0.0f64;
        for (a, b) in slots(&exact).iter().flatten().zip(slots(&lossy).iter().flatten()) {
            let read = |bytes: &[u8], i| format.read(bytes, i) * format.unit();
            let n = a.bytes().len() / format.n_bytes();
            worst = (0..n).map(|i| (read(a.bytes(), i) - read(b.bytes(), i)).abs()).fold(worst, f64::max);
        }
        assert!(worst > 0.5 && worst < f64::from(max_error) + 0.5, "{what}: {worst} of {max_error}");
        let brought = |plan| bytes(plan).0 + bytes(plan).1;
        assert!(brought(&lossy) < brought(&exact), "{what}");
        backend.render(&lossy).unwrap();
        assert!(is_unpacked(&mut backend, &tree, &lossy), "{what}: other samples");
    }
}

/// Extents that are no cubes, and blocks at several levels.
fn flat_blocks_and_trimmed_bricks_look_as_plain_ones<B: Open>() {
    let Some(mut backend) = B::open(ShaderLibrary::embedded()) else { return };
    for volume in volumes() {
        let what = volume.scalar_type();
        let volume = Arc::new(volume);
        let [plain, packed] = [Upload::Plain, PACKED].map(|upload| scene(&volume, upload));
        let trimmed = TrimmedVolume::new(Arc::clone(&volume), BrickSide::S16);
        let range = volume.range();
        let opaque = |at: f64| Knot {
            value: range.min + at * (range.max - range.min),
            extinction: if at > 0.5 { 0.1 } else { 0.0 },
            color: [0.9, at, 0.2],
        };
        let transfer = TransferFunction::new(vec![opaque(0.0), opaque(0.45), opaque(0.7), opaque(1.0)]).unwrap();
        let mut render = |upload: &Scene| {
            let scene = Scene { transfer: transfer.clone(), skipping: Skipping::On, ..upload.clone() };
            let plan = prepare_trimmed(&trimmed, &scene, Trimming::Packed, &mut TrimResidency::default()).unwrap();
            (bytes(&plan), backend.render(&plan).unwrap())
        };
        let (expected, found) = (render(&plain), render(&packed));
        assert!(found.0.0 > 0 && expected.1.image == found.1.image, "{what}: trimmed bricks");
        let options = BlockOptions { side: BlockSide::V16, ..BlockOptions::default() };
        let blocks = build_blocks(Arc::clone(&volume), &options).unwrap();
        let n_blocks = brickfield::bricks::BlockSource::layout(&blocks).n_blocks_total();
        for levels in [vec![Level(0); n_blocks], (0..n_blocks).map(|i| Level((i % 5) as u8)).collect()] {
            let style = BlockStyle { join: Join::Blend(Interblock::MinimumDistance), ..BlockStyle::default() };
            let mut render = |scene: &Scene| {
                let plan = prepare_blocks(&blocks, scene, &levels, style, &mut BlockResidency::default()).unwrap();
                (bytes(&plan), backend.render(&plan).unwrap())
            };
            let (expected, found) = (render(&plain), render(&packed));
            assert!(found.0.0 > 0 && expected.1.image == found.1.image, "{what}: blocks at {:?}", levels.iter().max());
        }
    }
}

/// Index, beams, uniforms and knots are fewer.
const NUMBERS_BYTES: u64 = 8 << 10;

fn a_brick_that_comes_is_brought_and_unpacked_alone<B: Open>() {
    let Some(mut backend) = B::open(ShaderLibrary::embedded()) else { return };
    let volume = volume(|v| (v * 65_535.0) as u16);
    let tree = tree(&volume, BrickSide::S16);
    let mut residency = Residency::default();
    let coarse = Scene { detail: vec![Criterion::Uniform(Level(1))], ..scene(&volume, PACKED) };
    let near = Criterion::DistanceFrom { point: WorldPos(volume.grid().world_box().min), factor: 1.0 };
    let fine = Scene { detail: vec![near], ..coarse.clone() };
    let mut frames: Vec<(Frame, u64)> = Vec::new();
    for scene in [&coarse, &fine, &coarse, &coarse] {
        let plan = prepare(&tree, scene, &mut residency).unwrap();
        let frame = backend.render(&plan).unwrap();
        let alone = B::open(ShaderLibrary::embedded()).unwrap().render(&plan).unwrap();
        assert!(frame.image == alone.image, "a fresh backend has another picture");
        frames.push((frame, residency.copied().n_bricks as u64));
    }
    assert!(frames[1].1 > 0 && frames[3].1 == 0);
    // With the third one, most slots are free: the bricks that are left move together, and are brought anew.
    for (frame, n_new) in [&frames[0], &frames[1], &frames[3]] {
        // A brick of 4,096 samples of 16 bits is plain at the most.
        assert!(frame.uploaded_bytes <= n_new * 8192 + NUMBERS_BYTES, "{n_new} bricks: {} bytes", frame.uploaded_bytes);
    }
}

/// Each patch is of one thing that unpacking must get right.
fn shaders_that_unpack_wrongly_are_noticed<B: Open>() {
    let patches = [
        ("unzigzag", "return i32(n >> 1u) ^ -i32(n & 1u);", "return i32(n >> 1u);"),
        ("undo_line", "detail >> 1u", "detail / 2"),
        ("undo_line", "select(1, 2, is_inner)", "2"),
        ("undo_line", "i > 0u && i + 1u < n_low", "i + 1u < n_low"),
        ("across_axis", "decoding.axis == 1u", "decoding.axis == 2u"),
        ("detail_number", "low.x * own.y * own.z, n.x * low.y * own.z", "low.x * own.y * own.z, low.x * low.y * own.z"),
        ("number", "8u * (in_run % 4u)", "8u * (in_run % 2u)"),
        ("widths_before", "n == 4u", "n > 4u"),
        ("number", "packed_words[first + 1u] << (32u - shift)", "0u"),
        ("coefficient", "return brick.value;", "return brick.value + 1;"),
        ("sample", "value * brick.step", "value"),
        ("store", "decoding.sample_bits * i", "decoding.sample_bits * (n - 1u - i)"),
    ];
    let cases: Vec<(BrickTree, FramePlan)> = volumes()
        .iter()
        .zip([0, 1, 0, 300])
        .map(|(volume, max_error)| {
            let tree = tree(volume, BrickSide::S16);
            let plan = plan(&tree, &scene(volume, Upload::Packed { max_error }));
            (tree, plan)
        })
        .collect();
    for (function, from, to) in patches {
        let library = ShaderLibrary::embedded().patched_in("decode", function, from, to).unwrap();
        let Some(mut backend) = B::open(library) else { return };
        let is_right = cases.iter().all(|(tree, plan)| is_unpacked(&mut backend, tree, plan));
        assert!(!is_right, "{function}: `{from}` as `{to}` is not noticed");
    }
}

#[test]
fn the_layer_is_silent_while_slots_are_unpacked() {
    let options = Options { validation: Validation::On, copy_bytes: 4096, ..Options::default() };
    let Some(mut backend) = devices::ash(&options) else { return };
    for volume in volumes() {
        backend.render(&plan(&tree(&volume, BrickSide::S16), &scene(&volume, PACKED))).unwrap();
    }
    assert_eq!(backend.validation_messages(), Vec::<String>::new());
}
