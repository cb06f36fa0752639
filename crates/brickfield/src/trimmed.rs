//! From a scene and trimmed bricks to a frame plan.

use std::sync::Arc;

use brickfield_bricks::SourceId;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Aabb, BrickId, BrickLayout, BrickSide, Grid, Level, Place, Scalar, Volume, with_voxels};
use brickfield_frame::{
    Chunk, DarkRegions, Drawing, Field, FramePlan, IndexEntry, IndexGrid, IndexLattice, Join, KeptBoxes, Lighting,
    Places, PlanError, PlanParts, QuadratureRule, Reach, Slices, Slots, Upload,
};
use brickfield_lod::back_to_front;
use brickfield_trim::{
    BrickArrays, ClassCounts, DarkValues, Interpolation, MergeError, MergeOptions, PackError, StoredBricks,
    TexelAccount, TrimmedBricks, brick_samples, merge_bricks, pack_bricks, reclassify, samples_of, store_alone,
    trim_bricks,
};
use rayon::prelude::*;

use crate::block_residency::MAX_TEXELS;
use crate::course::{Course, to_sample_space, voxels_in_step};
use crate::encode::Coding;
use crate::prepare::{check_polygons, check_size, check_values};
use crate::{CacheError, Copied, PrepareError, Scene, Skipping, Technique};

/// A volume whose bricks of level 0 are classified slice by slice (Tong, Wang, Tsang and Tang 1999, section 3.2.1).
#[derive(Debug)]
pub struct TrimmedVolume {
    id: SourceId,
    volume: Arc<Volume>,
    arrays: BrickArrays,
}

impl TrimmedVolume {
    /// The min-max arrays of a volume's bricks. Runs on rayon's current thread pool.
    pub fn new(volume: Arc<Volume>, side: BrickSide) -> TrimmedVolume {
        TrimmedVolume { id: SourceId::unique(), arrays: BrickArrays::of_volume(&volume, side), volume }
    }

    /// The volume.
    pub fn volume(&self) -> &Arc<Volume> {
        &self.volume
    }

    /// The min-max arrays.
    pub fn arrays(&self) -> &BrickArrays {
        &self.arrays
    }

    /// Which bricks there are.
    pub fn layout(&self) -> &BrickLayout {
        self.arrays.layout()
    }

    fn grid(&self) -> &Grid {
        self.volume.grid()
    }

    pub(crate) fn id(&self) -> SourceId {
        self.id
    }
}

/// Which samples of bricks are brought to a device, and which of them are drawn. The picture is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Trimming {
    /// Every brick is stored whole and drawn whole: the paper's algorithm I.
    Conventional,
    /// Every brick is stored whole; the boxes around visible samples are drawn: the paper's algorithm II.
    Envelope,
    /// Bricks of which something may be seen are stored whole and drawn whole.
    Visible,
    /// Bricks are trimmed along one axis, each on its own; their boxes are drawn: the paper's algorithm III.
    Alone,
    /// The same, merged into texture chunks: the paper's algorithm IV.
    Merged(MergeOptions),
    /// All three axes are trimmed, and the boxes packed. The default: on six scans it keeps the fewest samples, and its frames take as long as
    /// merged ones (`cargo xtask compare --paper tong --part table`).
    #[default]
    Packed,
}

impl Trimming {
    /// The names of [`of_name`](Self::of_name).
    pub const NAMES: [&'static str; 6] = ["conventional", "envelope", "visible", "alone", "merged", "packed"];

    /// By name, for bricks of `side` samples: merged in the paper's proportions ([`MergeOptions::of_bricks`]).
    pub fn of_name(name: &str, side: BrickSide) -> Option<Trimming> {
        Some(match name {
            "conventional" => Trimming::Conventional,
            "envelope" => Trimming::Envelope,
            "visible" => Trimming::Visible,
            "alone" => Trimming::Alone,
            "merged" => Trimming::Merged(MergeOptions::of_bricks(side)),
            "packed" => Trimming::Packed,
            _ => return None,
        })
    }

    /// Whole bricks where nothing is to be left out.
    pub(crate) fn unless_off(self, skipping: Skipping) -> Trimming {
        match skipping {
            Skipping::On => self,
            Skipping::Off => Trimming::Conventional,
        }
    }

    /// Whether the boxes of bricks are drawn, and not the whole bricks.
    pub(crate) fn draws_boxes(self) -> bool {
        !matches!(self, Trimming::Conventional | Trimming::Visible)
    }
}

/// Why trimmed bricks could not be prepared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum PrepareTrimmedError {
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    #[error("merging trimmed bricks: {0}")]
    Merge(#[from] MergeError),
    #[error("storing trimmed bricks: {0}")]
    Pack(#[from] PackError),
    #[error("drawing trimmed bricks in batches: {0}")]
    Cache(#[from] CacheError),
}

impl From<PlanError> for PrepareTrimmedError {
    fn from(error: PlanError) -> PrepareTrimmedError {
        PrepareTrimmedError::Prepare(error.into())
    }
}

/// The trimmed bricks of the last frame, in one texture.
///
/// An edit of the transfer function classifies every brick again, and gathers the samples of bricks whose box or place is another one.
/// One residency serves one volume at a time: handed another, it begins anew.
#[derive(Debug, Default)]
pub struct TrimResidency {
    held: Option<Held>,
    copied: Copied,
    n_reclassified: usize,
}

#[derive(Debug)]
struct Held {
    source: SourceId,
    trimming: Trimming,
    reach: u32,
    upload: Upload,
    dark: DarkValues,
    /// What may be seen of each brick; what is read of it.
    trimmed: TrimmedBricks,
    grown: TrimmedBricks,
    stored: StoredBricks,
    /// By brick.
    chunks: Vec<Option<Arc<Chunk>>>,
    slots: Arc<Slots>,
    kept: Arc<KeptBoxes>,
    index: Option<Arc<IndexGrid>>,
}

/// Texels of the texture along x, y, z, at most.
const MOST_TEXELS: UVec3 = UVec3::splat(MAX_TEXELS);

impl TrimResidency {
    /// The bricks whose samples the last frame gathered.
    pub fn copied(&self) -> Copied {
        self.copied
    }

    /// How many bricks had another class or box than in the frame before; all of a new volume.
    pub fn n_reclassified(&self) -> usize {
        self.n_reclassified
    }

    /// Texels of the texture, and those of them that hold a sample.
    pub fn account(&self) -> TexelAccount {
        self.held.as_ref().map(|held| held.stored.account()).unwrap_or_default()
    }

    /// The classes of all bricks.
    pub fn counts(&self) -> ClassCounts {
        self.held.as_ref().map(|held| held.trimmed.counts()).unwrap_or_default()
    }

    fn hold(
        &mut self,
        source: &TrimmedVolume,
        scene: &Scene,
        trimming: Trimming,
        reach: u32,
    ) -> Result<&mut Held, PrepareTrimmedError> {
        let dark = DarkValues::of(&scene.transfer);
        let is_kept = |held: &Held| {
            (held.source, held.trimming, held.reach, held.upload) == (source.id, trimming, reach, scene.upload)
        };
        let before = self.held.as_ref().filter(|held| is_kept(held));
        let (trimmed, n_changed) = match before {
            Some(held) if held.dark == dark => (None, 0),
            Some(held) => {
                let mut trimmed = held.trimmed.clone();
                let changed = reclassify(&mut trimmed, &source.arrays, &dark).expect("bricks of the same volume");
                ((!changed.is_empty()).then_some(trimmed), changed.len())
            }
            None => (Some(trim_bricks(&source.arrays, &dark, Interpolation::Trilinear)), source.arrays.arrays().len()),
        };
        let new = match trimmed {
            Some(trimmed) => {
                let grown = trimmed.grown(reach);
                let stored = store(&grown, trimming)?;
                Some(Held::new(source, (trimming, reach, scene.upload), dark.clone(), (trimmed, grown, stored), before))
            }
            None => None,
        };
        self.n_reclassified = n_changed;
        self.copied = Copied::default();
        if let Some((held, copied)) = new {
            (self.held, self.copied) = (Some(held), copied);
        }
        let held = self.held.as_mut().expect("bricks of before, or new ones");
        held.dark = dark;
        Ok(held)
    }
}

/// Where the samples of bricks are stored, of which these are read.
fn store(read: &TrimmedBricks, trimming: Trimming) -> Result<StoredBricks, PrepareTrimmedError> {
    Ok(match trimming {
        Trimming::Conventional | Trimming::Envelope => pack_bricks(&TrimmedBricks::whole(*read.layout()), MOST_TEXELS)?,
        Trimming::Visible => pack_bricks(&read.untrimmed(), MOST_TEXELS)?,
        Trimming::Alone => store_alone(read, MOST_TEXELS)?,
        Trimming::Merged(options) => merge_bricks(read, &options)?.store(MOST_TEXELS)?,
        Trimming::Packed => pack_bricks(read, MOST_TEXELS)?,
    })
}

impl Held {
    fn new(
        source: &TrimmedVolume,
        (trimming, reach, upload): (Trimming, u32, Upload),
        dark: DarkValues,
        (trimmed, grown, stored): (TrimmedBricks, TrimmedBricks, StoredBricks),
        before: Option<&Held>,
    ) -> (Held, Copied) {
        let volume = &source.volume;
        let coding = Coding::of(volume.scalar_type(), volume.rescale(), volume.range()).brought(upload);
        let kept_chunk = |i: usize| {
            let held = before?;
            held.chunks[i].clone().filter(|_| held.stored.places()[i] == stored.places()[i])
        };
        let chunk = |(i, place): (usize, &Option<Place>)| {
            let place = place.as_ref()?;
            Some(match kept_chunk(i) {
                Some(chunk) => (chunk, 0),
                None => {
                    let chunk = Arc::new(gather(volume, &coding, place));
                    let n_bytes = chunk.bytes().len();
                    (chunk, n_bytes)
                }
            })
        };
        let chunks: Vec<Option<(Arc<Chunk>, usize)>> = stored.places().par_iter().enumerate().map(chunk).collect();
        let new = || chunks.iter().flatten().filter(|(_, n_bytes)| *n_bytes > 0);
        let copied = Copied { n_bricks: new().count(), n_bytes: new().map(|(_, n_bytes)| n_bytes).sum() };
        let chunks: Vec<Option<Arc<Chunk>>> = chunks.into_iter().map(|chunk| chunk.map(|(chunk, _)| chunk)).collect();
        let places = stored.places().iter().map(|place| place.unwrap_or_else(nowhere)).collect();
        let places = Places::Table { texels: stored.texels().max(UVec3::ONE), places };
        let slots =
            Slots::new(coding.format, coding.decode(), places, chunks.clone()).expect("bricks fill their places");
        let kept = KeptBoxes::new(kept_boxes(&trimmed));
        let (slots, kept, index) = match before {
            Some(held) => (slots.following(&held.slots), kept.following(&held.kept), held.index.clone()),
            None => (slots, kept, None),
        };
        let (slots, kept) = (Arc::new(slots), Arc::new(kept));
        (
            Held {
                source: source.id,
                trimming,
                reach,
                upload,
                dark,
                trimmed,
                grown,
                stored,
                chunks,
                slots,
                kept,
                index,
            },
            copied,
        )
    }

    /// The field of the bricks that are drawn.
    fn field(&mut self, layout: &BrickLayout, drawn: &[BrickId]) -> Field {
        let index = Arc::new(index_of(layout, drawn, self.index.as_deref()));
        self.index = Some(Arc::clone(&index));
        let field = Field::new(layout.dims(), index, Arc::clone(&self.slots), Join::Shared);
        field.expect("an index of bricks that are stored")
    }
}

/// The place of a brick of which nothing is stored; nobody reads it.
pub(crate) fn nowhere() -> Place {
    Place::even(UVec3::ZERO, UVec3::ONE, Level(0), DVec3::ZERO)
}

/// The index of bricks of level 0, whose slots are numbered as they are.
pub(crate) fn index_of<'a>(
    layout: &BrickLayout,
    bricks: impl IntoIterator<Item = &'a BrickId>,
    before: Option<&IndexGrid>,
) -> IndexGrid {
    let entry = |id: &BrickId| (id.coords, IndexEntry::Resident { slot: layout.ordinal(*id) as u32, reach: Reach(0) });
    let lattice = IndexLattice { cell_samples: layout.side().n_cells(), origin: 0.0 };
    let index = IndexGrid::new(layout.n_bricks(Level(0)), lattice, bricks.into_iter().map(entry));
    match before {
        Some(before) => index.following(before),
        None => index,
    }
}

/// The bricks of a domain of which something is read while they are drawn; `grown` has what is read of each.
pub(crate) fn drawn_bricks(trimming: Trimming, grown: &TrimmedBricks, domain: &Aabb) -> Vec<BrickId> {
    let layout = grown.layout();
    let is_read = |id: &BrickId| trimming == Trimming::Conventional || !grown.kept()[layout.ordinal(*id)].is_empty();
    let in_domain = |id: &BrickId| !to_sample_space(layout.index_box(*id)).intersection(domain).is_empty();
    layout.bricks(Level(0)).filter(|id| is_read(id) && in_domain(id)).collect()
}

/// Whether a volume's bricks can be drawn at all, in a picture of a scene's size.
pub(crate) fn check_bricks(source: &TrimmedVolume, scene: &Scene) -> Result<(), PrepareError> {
    check_size(scene.size)?;
    check_values(source.volume.range())?;
    match source.layout().n_bricks_total(Level(0)) {
        n_bricks if n_bricks >= IndexEntry::MAX_SLOTS as usize => {
            Err(PrepareError::TooManyBricks { n_bricks, limit: IndexEntry::MAX_SLOTS })
        }
        _ => Ok(()),
    }
}

/// The boxes around what may be seen of each brick, in sample space.
pub(crate) fn kept_boxes(trimmed: &TrimmedBricks) -> Vec<Aabb> {
    let layout = trimmed.layout();
    let last = layout.dims() - 1;
    let of_brick = |id: BrickId| {
        let kept = trimmed.kept()[layout.ordinal(id)];
        if kept.is_empty() {
            return Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        }
        let first = brick_samples(layout, id).first + kept.first;
        let end = first + kept.n - 1;
        // Beyond the volume's outer samples values are theirs.
        Aabb {
            min: DVec3::select(first.cmpeq(UVec3::ZERO), DVec3::NEG_INFINITY, first.as_dvec3()),
            max: DVec3::select(end.cmpeq(last), DVec3::INFINITY, end.as_dvec3()),
        }
    };
    layout.bricks(Level(0)).map(of_brick).collect()
}

/// A brick's stored samples in the order of the texture.
pub(crate) fn gather(volume: &Volume, coding: &Coding, place: &Place) -> Chunk {
    let bytes = with_voxels!(volume.voxels(), voxels => {
        let samples = samples_of(place, volume.grid().dims(), voxels).expect("voxels of the volume");
        let mut bytes = vec![0; samples.len() * volume.scalar_type().n_bytes()];
        Scalar::copy_le_bytes(&samples, &mut bytes);
        bytes
    });
    coding.chunk(place.n, bytes)
}

/// How many samples beside a visible one a frame reads: those of a gradient, and those at the other end of a segment.
pub(crate) fn reach_of(grid: &Grid, scene: &Scene) -> u32 {
    let of_light = u32::from(scene.light.is_some());
    match scene.rule {
        QuadratureRule::PreIntegrated => of_light + voxels_in_step(grid, scene),
        _ => of_light,
    }
}

/// The plan of a frame of trimmed bricks, all of level 0: the scene's criteria about levels are not asked. With
/// [`Skipping::Off`](crate::Skipping::Off) it is that of [`Trimming::Conventional`].
///
/// # Errors
/// As [`prepare`](crate::prepare()); options of merging that do not fit the bricks; bricks that do not fit a texture: then the residency
/// is as before.
pub fn prepare_trimmed(
    source: &TrimmedVolume,
    scene: &Scene,
    trimming: Trimming,
    residency: &mut TrimResidency,
) -> Result<FramePlan, PrepareTrimmedError> {
    let trimming = trimming.unless_off(scene.skipping);
    check_bricks(source, scene)?;
    let (layout, grid) = (*source.layout(), source.grid());
    let Course { domain, sampling, rays } = Course::new(grid, scene, Level(0))?;
    let reach = reach_of(grid, scene);
    let held = residency.hold(source, scene, trimming, reach)?;
    let drawn = drawn_bricks(trimming, &held.grown, &domain);
    let drawing = match scene.technique {
        Technique::RayCasting => Drawing::Rays,
        Technique::Polygons(target) => {
            check_polygons(&layout, grid, &rays, sampling.step_world(), drawn.len())?;
            let order = back_to_front(&layout, grid, &scene.camera, &drawn);
            let back_to_front = order.into_iter().map(|i| drawn[i].coords).collect();
            Drawing::Polygons { back_to_front, target, slices: Slices::Together }
        }
    };
    let field = held.field(&layout, &drawn);
    let dark = match trimming.draws_boxes() {
        true => DarkRegions::beside_boxes(&field, Arc::clone(&held.kept)).expect("a box for each brick"),
        false => DarkRegions::default(),
    };
    let parts = PlanParts::new(field, rays, domain, sampling, scene.transfer.clone());
    let lighting = scene.light.map(|light| Lighting::new(light, grid));
    Ok(FramePlan::new(PlanParts { lighting, dark, drawing, ..parts })?)
}

#[cfg(test)]
mod tests {
    use brickfield_core::glam::UVec2;
    use brickfield_core::{Camera, Image, Knot, TransferFunction};
    use brickfield_frame::Feature;
    use brickfield_optics::{Light, LightSource, LightTerms};
    use proptest::prelude::*;

    use super::*;
    use crate::{BackendKind, Validation, open_backend};

    /// Noise of two values, rarely the greater one.
    fn volume(dims: UVec3, seed: u32) -> Arc<Volume> {
        let grid = Grid::axis_aligned(dims, DVec3::ONE).unwrap();
        let noise = |i: u32| (i ^ seed).wrapping_mul(2_654_435_761).rotate_left(15).wrapping_mul(2_246_822_519) >> 16;
        let voxel = |i: u32| if noise(i) % 211 == 0 { 200u8 } else { (noise(i) % 40) as u8 };
        Arc::new(Volume::new(grid, (0..grid.n_voxels() as u32).map(voxel).collect::<Vec<_>>()).unwrap())
    }

    /// Values from a threshold on are seen.
    fn scene(grid: &Grid, threshold: f64) -> Scene {
        let camera = Camera::framing(&grid.world_box(), DVec3::new(1.0, 2.0, 3.0), DVec3::Z).unwrap();
        let knot = |value: f64, extinction: f64| Knot { value, extinction, color: [0.2, 0.5, 1.0] };
        let transfer = TransferFunction::new(vec![knot(threshold, 0.0), knot(threshold + 30.0, 0.4)]).unwrap();
        Scene::new(camera, UVec2::new(20, 16), transfer)
    }

    fn picture(plan: &FramePlan) -> Image<f32> {
        let mut backend = open_backend(BackendKind::Cpu, None, Validation::Off).unwrap();
        backend.render(plan).unwrap().image
    }

    fn all(side: BrickSide) -> [Trimming; 6] {
        Trimming::NAMES.map(|name| Trimming::of_name(name, side).unwrap())
    }

    fn assert_like(found: &Image<f32>, expected: &Image<f32>, what: &str) {
        let channels = found.pixels().iter().flatten().zip(expected.pixels().iter().flatten());
        let most = channels.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(most < 2e-5, "{what}: {most}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn every_trimming_shows_the_whole_picture(
            n in prop::array::uniform3(1u32..50), seed: u32, threshold in 5.0..190.0f64, rule in 0..5usize, is_lit: bool
        ) {
            let source = TrimmedVolume::new(volume(UVec3::from(n), seed), BrickSide::S16);
            let light = Light::new(LightSource::Head, LightTerms::default(), 20.0).unwrap();
            let scene = Scene {
                rule: QuadratureRule::ALL[rule % QuadratureRule::ALL.len()],
                light: is_lit.then_some(light),
                step_voxels: 1.7,
                ..scene(source.grid(), threshold)
            };
            let of = |trimming| picture(&prepare_trimmed(&source, &scene, trimming, &mut TrimResidency::default()).unwrap());
            let whole = of(Trimming::Conventional);
            for trimming in all(BrickSide::S16) {
                assert_like(&of(trimming), &whole, &format!("{trimming:?}"));
            }
        }
    }

    #[test]
    fn an_edit_gathers_bricks_of_another_box_alone() {
        let source = TrimmedVolume::new(volume(UVec3::new(61, 46, 31), 1), BrickSide::S16);
        for trimming in all(BrickSide::S16) {
            let mut residency = TrimResidency::default();
            for threshold in [150.0, 150.0, 120.0, 30.0, 199.0, 250.0, 150.0] {
                let scene = scene(source.grid(), threshold);
                let plan = prepare_trimmed(&source, &scene, trimming, &mut residency).unwrap();
                let fresh = prepare_trimmed(&source, &scene, trimming, &mut TrimResidency::default()).unwrap();
                assert_eq!((picture(&plan), plan.kept()), (picture(&fresh), fresh.kept()), "{trimming:?}, {threshold}");
                let again = prepare_trimmed(&source, &scene, trimming, &mut residency).unwrap();
                assert_eq!((residency.copied(), residency.n_reclassified()), (Copied::default(), 0));
                assert!(Arc::ptr_eq(plan.field().slots(), again.field().slots()));
            }
        }
    }

    #[test]
    fn nothing_visible_is_stored_as_nothing() {
        let source = TrimmedVolume::new(volume(UVec3::new(61, 46, 31), 2), BrickSide::S16);
        for trimming in all(BrickSide::S16).into_iter().skip(2) {
            let mut residency = TrimResidency::default();
            let plan = prepare_trimmed(&source, &scene(source.grid(), 201.0), trimming, &mut residency).unwrap();
            assert!(plan.shows_nothing() && plan.field().slots().n_bytes() == 0, "{trimming:?}");
            assert_eq!((residency.account().n_texels, residency.counts().n_white), (0, source.arrays().arrays().len()));
        }
    }

    #[test]
    fn whole_bricks_need_no_boxes_and_slices_leap_over_nothing() {
        let source = TrimmedVolume::new(volume(UVec3::new(61, 46, 31), 3), BrickSide::S16);
        let scene = scene(source.grid(), 150.0);
        let plan = |scene: &Scene, trimming| prepare_trimmed(&source, scene, trimming, &mut TrimResidency::default());
        for trimming in all(BrickSide::S16) {
            let plan = plan(&scene, trimming).unwrap();
            assert_eq!(plan.features().contains(Feature::SkipDark), trimming.draws_boxes(), "{trimming:?}");
            assert_eq!(plan.kept().is_some(), trimming.draws_boxes());
        }
        let slices = Scene {
            technique: Technique::Polygons(brickfield_frame::Target::Float32),
            placement: brickfield_frame::Placement::ViewportPlanes,
            division: brickfield_frame::Division::Brick,
            ..scene.clone()
        };
        assert!(!plan(&slices, Trimming::Packed).unwrap().features().contains(Feature::SkipDark));
        let n_polygons = |trimming| {
            let mut voxels = vec![0u8; 61 * 46 * 31];
            voxels[7 + 61 * (7 + 46 * 7)] = 200;
            let grid = *source.grid();
            let source = TrimmedVolume::new(Arc::new(Volume::new(grid, voxels).unwrap()), BrickSide::S16);
            let plan = prepare_trimmed(&source, &slices, trimming, &mut TrimResidency::default()).unwrap();
            plan.proxy().unwrap().n_polygons()
        };
        assert!(3 * n_polygons(Trimming::Packed) < n_polygons(Trimming::Visible));
        let too_small = MergeOptions::of_bricks(BrickSide::S16);
        let wide = TrimmedVolume::new(volume(UVec3::new(61, 46, 31), 3), BrickSide::S32);
        let mut residency = TrimResidency::default();
        let before = prepare_trimmed(&source, &scene, Trimming::Packed, &mut residency).unwrap();
        let refused = prepare_trimmed(&wide, &scene, Trimming::Merged(too_small), &mut residency);
        assert!(refused.unwrap_err().to_string().starts_with("merging trimmed bricks: "));
        // The bricks of another volume are still there.
        let after = prepare_trimmed(&source, &scene, Trimming::Packed, &mut residency).unwrap();
        assert!(Arc::ptr_eq(before.field().slots(), after.field().slots()));
    }
}
