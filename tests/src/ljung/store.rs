//! A volume on disk, larger than its budget: memory, bytes, and the error of the part that is drawn worst.

use std::path::{Path, PathBuf};

use brickfield::bricks::BlockSource;
use brickfield::cpu::discrete;
use brickfield::frame::{Backend, Join, Mode, SampleFormat};
use brickfield::io::OpenOptions;
use brickfield::lod::{
    BlockBudget, BlockErrors, BlockSelection, BudgetSize, OneSampleBlocks, Slab, select_block_levels,
};
use brickfield::optics::automatic;
use brickfield::{BlockResidency, Codec, Scene, StoreBlocks, StoreLimits, Viewpoint, prepare_blocks};
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Aabb, Grid, Image, Interblock, Level, ScalarType, TransferFunction};
use serde::Serialize;

use super::LjungArgs;
use super::error::Error;
use super::schemes::style;
use crate::compare::rivals::Rivals;
use crate::memory;
use crate::paper::{Missed, PaperError, frame_of, mib, print};
use crate::volumes::pack_phantom;

/// Voxels along a side of the part whose error is measured.
const PART: u32 = 192;
const JOIN: Join = Join::Blend(Interblock::MaximumDistance);

/// A backend's frame.
#[derive(Clone, Debug, Serialize)]
struct StoreRow {
    backend: &'static str,
    voxel_bytes: u64,
    budget_bytes: u64,
    n_blocks_per_level: Vec<usize>,
    host_bytes: u64,
    device_bytes: u64,
    summary_bytes: u64,
    read_bytes: u64,
    uploaded_bytes: u64,
    resident_before: Option<u64>,
    peak: Option<u64>,
    part: Error,
}

pub(super) fn run(args: &LjungArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    let path = stored(args)?;
    let (mut rows, mut missed) = (Vec::new(), Vec::new());
    for backend in &mut rivals.present {
        let row = of_backend(args, &path, backend.as_mut())?;
        print(&row.to_string())?;
        if row.host_bytes.max(row.device_bytes) > row.budget_bytes {
            missed.push(Missed::of_pictures(format!("{}: voxels take more than the budget", row.backend)));
        }
        rows.push(row);
    }
    args.common.write_rows("store.json", &rows)?;
    Ok(missed)
}

/// The store that is named, else a generated one.
fn stored(args: &LjungArgs) -> Result<PathBuf, PaperError> {
    if let Some(path) = &args.store {
        return Ok(path.clone());
    }
    let dims = args.store_dims;
    let path = args.common.out.join(format!("store-{}x{}x{}.zarr", dims.x, dims.y, dims.z));
    if path.exists() {
        print(&format!("{} is there", path.display()))?;
        return Ok(path);
    }
    memory::restart_peak();
    pack_phantom(dims, ScalarType::U8, Codec::Zstd, &path, &mut |_| ())?;
    let (n_bytes, peak) = (dims.as_u64vec3().element_product(), peak_text(memory::peak()));
    print(&format!("packed {:.0} MiB of voxels as {}; {peak}", mib(n_bytes), path.display()))?;
    Ok(path)
}

fn peak_text(peak: Option<u64>) -> String {
    peak.map_or("peak memory unknown on this system".to_owned(), |peak| format!("peak memory {:.0} MiB", mib(peak)))
}

fn of_backend(args: &LjungArgs, path: &Path, backend: &mut dyn Backend) -> Result<StoreRow, PaperError> {
    let resident_before = memory::resident();
    memory::restart_peak();
    let budget_bytes = args.store_mib << 20;
    let limits = StoreLimits::of_budget(budget_bytes);
    let store = StoreBlocks::open(path, args.blocks, limits, &OpenOptions::default(), &mut |_| ())?;
    let transfer = automatic(&store.overview(StoreBlocks::OVERVIEW_BYTES)?);
    let slab = Slab::of_block(store.layout(), store.grid());
    let errors = BlockErrors::estimate(store.layout(), store.summaries(), &transfer, slab)?;
    let size = BudgetSize::Bytes(budget_bytes - limits.cache_bytes);
    let (scalar, one_sample) = (store.scalar_type(), OneSampleBlocks::Free);
    let sample_bytes = SampleFormat::of(scalar).n_bytes() as u8;
    let budget = BlockBudget { size, scalar, sample_bytes, one_sample };
    let selection = select_block_levels(store.layout(), errors.levels(), None, &budget)?;
    let camera = Viewpoint::default().camera(store.grid(), store.facts().frame, args.common.size)?;
    let scene = Scene { step_voxels: args.common.step, ..Scene::new(camera, args.common.size, transfer.clone()) };
    let mut residency = BlockResidency::default();
    let plan = prepare_blocks(&store, &scene, selection.levels.levels(), style(JOIN), &mut residency)?;
    let name = backend.describe().backend;
    let frame = frame_of(backend, &plan)?;
    let peak = memory::peak();
    args.common.write_picture(&format!("store-{name}"), &frame.image, "the store within its budget")?;
    let slots = plan.field().slots();
    let (slot_bytes, sample_bytes) = (slots.n_bytes() as u64, slots.format().n_bytes() as u64);
    let host_bytes = slot_bytes + store.n_bytes_kept();
    let device_bytes = slot_bytes + residency.n_free_texels() * sample_bytes;
    let (read_bytes, uploaded_bytes) = (store.n_bytes_read(), frame.uploaded_bytes);
    drop((plan, residency, frame));
    let part = error_of_part(args, &store, worst_part(&store, &errors, &selection), &transfer, &selection, backend)?;
    Ok(StoreRow {
        backend: name,
        voxel_bytes: store.grid().n_voxels() as u64 * store.scalar_type().n_bytes() as u64,
        budget_bytes,
        n_blocks_per_level: selection.levels.n_blocks_per_level()[..store.layout().side().levels().count()].to_vec(),
        host_bytes,
        device_bytes,
        summary_bytes: store.n_summary_bytes(),
        read_bytes,
        uploaded_bytes,
        resident_before,
        peak,
        part,
    })
}

/// A box of voxels around the block whose estimated error is the greatest.
fn worst_part(store: &StoreBlocks, errors: &BlockErrors, selection: &BlockSelection) -> (UVec3, UVec3) {
    let (layout, levels) = (store.layout(), selection.levels.levels());
    let error = |i: &usize| errors.levels()[*i][usize::from(levels[*i].0)];
    let worst = (0..levels.len()).max_by(|a, b| error(a).total_cmp(&error(b))).unwrap_or(0);
    let block = layout.block(worst);
    let center = layout.first_voxel(block) + layout.extent(block) / 2;
    let n = layout.dims().min(UVec3::splat(PART));
    let first = center.saturating_sub(n / 2).min(layout.dims() - n);
    (first, n)
}

/// The error of a part, drawn with the blocks of the budget, against the same with all its blocks at full resolution.
fn error_of_part(
    args: &LjungArgs,
    store: &StoreBlocks,
    (first, n): (UVec3, UVec3),
    transfer: &TransferFunction,
    selection: &BlockSelection,
    backend: &mut dyn Backend,
) -> Result<Error, PaperError> {
    let (layout, grid) = (store.layout(), store.grid());
    let clip = Aabb { min: first.as_dvec3(), max: (first + n).as_dvec3() };
    let axes = grid.index_to_world().matrix3;
    let corner = grid.index_to_world().transform_point3(clip.min + DVec3::splat(0.5));
    let own = Grid::from_first_sample(n, grid.spacing(), corner, axes).expect("a part of a grid is one");
    let camera = Viewpoint::default().camera(&own, store.facts().frame, args.common.size)?;
    let scene = Scene::new(camera, args.common.size, transfer.clone());
    let scene = Scene { step_voxels: args.common.step, mode: Mode::Exact, clip: Some(clip), ..scene };
    let whole: Vec<Level> = layout.blocks().map(|block| full_inside(store, block, &clip)).collect();
    let mut residency = BlockResidency::default();
    let answer: Image<f64> = discrete(&prepare_blocks(store, &scene, &whole, style(JOIN), &mut residency)?).image;
    let mut residency = BlockResidency::default();
    let plan = prepare_blocks(store, &scene, selection.levels.levels(), style(JOIN), &mut residency)?;
    let (frame, name) = (frame_of(backend, &plan)?, backend.describe().backend);
    args.common.write_picture(&format!("store-part-{name}"), &frame.image, "the part that is drawn worst")?;
    Ok(Error::of(&frame.image, &answer)?)
}

/// Level 0 for blocks that values inside a box are interpolated from, else one sample.
fn full_inside(store: &StoreBlocks, block: UVec3, clip: &Aabb) -> Level {
    let (layout, around) = (store.layout(), f64::from(store.layout().side().n_voxels()));
    let low = layout.first_voxel(block).as_dvec3();
    let b = Aabb { min: low - around, max: low + layout.extent(block).as_dvec3() + around };
    if b.intersection(clip).is_empty() { layout.side().one_sample() } else { Level(0) }
}

impl std::fmt::Display for StoreRow {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let before = self.resident_before.map(|before| format!(" ({:.0} before)", mib(before))).unwrap_or_default();
        let memory = peak_text(self.peak) + &before;
        write!(
            f,
            "{}: {:.0} MiB of voxels, {} MiB on host and device; blocks of levels from 0: {:?}\n  voxels on the host {:.1} MiB, on the device {:.1} MiB; \
             summaries {:.1} MiB; {memory}\n  read {:.1} MiB, uploaded {:.1} MiB\n  the part of {PART}^3 voxels around the block with the greatest error: \
             {}",
            self.backend,
            mib(self.voxel_bytes),
            self.budget_bytes >> 20,
            self.n_blocks_per_level,
            mib(self.host_bytes),
            mib(self.device_bytes),
            mib(self.summary_bytes),
            mib(self.read_bytes),
            mib(self.uploaded_bytes),
            self.part,
        )
    }
}
