//! One field, stored in other ways than `prepare` stores it: through a table of places.

use std::sync::Arc;

use brickfield::frame::{
    AtlasShape, Chunk, Field, FramePlan, IndexEntry, IndexGrid, IndexLattice, Join, Places, PlanParts, Reach,
    SampleFormat, Slots,
};
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Axes, BrickSide, Level, Place, Volume};

/// How the samples of a picture case are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Storage {
    /// As `prepare` does: bricks of one size, found by arithmetic.
    #[default]
    Bricks,
    /// The same bricks through a table: each with its axes permuted in another way, and cut to the samples that are read.
    Placed,
    /// Blocks of 16 voxels, each of another resolution: averages of a linear field, which lie in the middle of the samples that
    /// they average, and one more on every side.
    Averages,
}

impl Storage {
    /// The plan with its field stored this way; averages are those of a linear `volume`.
    pub(crate) fn of(self, plan: FramePlan, volume: Option<&Volume>) -> FramePlan {
        let field = match (self, volume) {
            (Storage::Bricks, _) => return plan,
            (Storage::Averages, Some(volume)) => averages(&plan, volume),
            (Storage::Placed | Storage::Averages, _) => placed(plan.field()),
        };
        let parts = PlanParts::new(field, *plan.rays(), *plan.domain(), *plan.sampling(), plan.transfer().clone());
        let parts = PlanParts { lighting: plan.lighting().copied(), ..parts };
        FramePlan::new(parts).expect("the parts of a plan, but for its field")
    }
}

fn placed(field: &Field) -> Field {
    let (index, slots) = (field.index(), field.slots());
    let side = slots.brick_side().expect("prepare stores bricks of one size");
    let shape = AtlasShape::fit(slots.n_slots(), side, 4096).expect("cases are small");
    let nowhere = Place::even(UVec3::ZERO, UVec3::ONE, Level(0), DVec3::ZERO);
    let (mut places, mut samples) = (vec![nowhere; slots.n_slots() as usize], vec![None; slots.n_slots() as usize]);
    let dims = index.dims();
    let cells = (0..dims.element_product()).map(|i| UVec3::new(i % dims.x, i / dims.x % dims.y, i / dims.x / dims.y));
    for cell in cells {
        let (Some(slot), Some(brick)) = (index.at(cell).slot(), field.place_at(cell)) else { continue };
        let axes = Axes::ALL[slot as usize % Axes::ALL.len()];
        // The samples up to the volume's last one, and one behind it.
        let read = brick.local(field.last_sample()).map(f64::ceil).as_uvec3() + 1;
        let even = Place::even(shape.origin(slot), brick.n.min(read), brick.level, brick.first);
        let n = axes.to_texture(even.n.as_dvec3()).as_uvec3();
        places[slot as usize] = Place { n, axes, ..even };
        let bytes = slots.samples(slot).expect("a slot of the index").bytes();
        samples[slot as usize] = Some(Arc::new(Chunk::new(permuted(bytes, slots.format(), side, (n, axes)))));
    }
    let table = Places::Table { texels: shape.texels(), places };
    let slots = Slots::new(slots.format(), slots.decode(), table, samples).expect("samples that fill their places");
    Field::new(field.dims(), index.clone(), Arc::new(slots), Join::Shared).expect("the same slots")
}

/// The samples of a brick in the order of a texture whose axes are others.
fn permuted(bytes: &[u8], format: SampleFormat, side: BrickSide, (n, axes): (UVec3, Axes)) -> Vec<u8> {
    let (size, brick) = (format.n_bytes(), side.n_samples());
    let from = |i: u32| {
        let p = axes.to_space(UVec3::new(i % n.x, i / n.x % n.y, i / n.x / n.y));
        size * (p.x + brick * (p.y + brick * p.z)) as usize
    };
    (0..n.element_product()).flat_map(|i| &bytes[from(i)..][..size]).copied().collect()
}

/// Voxels along a block's side.
const BLOCK: u32 = 16;

fn averages(plan: &FramePlan, volume: &Volume) -> Field {
    let dims = plan.field().dims();
    let lattice = IndexLattice { cell_samples: BLOCK, origin: -0.5 };
    let cells = lattice.n_cells(dims);
    let (decode, linear) = (plan.field().slots().decode(), linear(volume));
    let (mut entries, mut places, mut samples) = (Vec::new(), Vec::new(), Vec::new());
    for slot in 0..cells.element_product() {
        let cell = UVec3::new(slot % cells.x, slot / cells.x % cells.y, slot / cells.x / cells.y);
        let level = Level((cell.element_sum() % 3) as u8);
        let stride = f64::from(level.stride());
        let n = BLOCK / level.stride() + 2;
        let first = (cell * BLOCK).as_dvec3() + 0.5 * (stride - 1.0) - stride;
        let at = |i: u32| first + UVec3::new(i % n, i / n % n, i / n / n).as_dvec3() * stride;
        let stored = |i: u32| (((linear(at(i)) - decode.offset) / decode.scale) as f32).to_le_bytes();
        entries.push((cell, IndexEntry::Resident { slot, reach: Reach(0) }));
        let texel = UVec3::new(0, 0, slot * (BLOCK + 2));
        places.push(Place::even(texel, UVec3::splat(n), level, first));
        samples.push(Some(Arc::new(Chunk::new((0..n * n * n).flat_map(stored).collect::<Vec<u8>>()))));
    }
    let texels = UVec3::new(BLOCK + 2, BLOCK + 2, cells.element_product() * (BLOCK + 2));
    let slots = Slots::new(SampleFormat::Float32, decode, Places::Table { texels, places }, samples);
    let index = IndexGrid::new(cells, lattice, entries);
    let field = Field::new(dims, Arc::new(index), Arc::new(slots.expect("full places")), Join::Shared);
    field.expect("an index of all blocks")
}

/// The linear field of a volume's samples, beyond the outer ones too.
fn linear(volume: &Volume) -> impl Fn(DVec3) -> f64 {
    let dims = volume.grid().dims();
    let at = |p: UVec3| volume.value((p.x + dims.x * (p.y + dims.y * p.z)) as usize);
    let (origin, last) = (at(UVec3::ZERO), dims - 1);
    let slope = |axis: usize| {
        let mut end = UVec3::ZERO;
        end[axis] = last[axis];
        (at(end) - origin) / f64::from(last[axis].max(1))
    };
    let gradient = DVec3::new(slope(0), slope(1), slope(2));
    move |q| origin + gradient.dot(q)
}
