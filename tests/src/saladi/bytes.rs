//! Bytes against error: what a prefix of a delivery shows, in several orders.
//!
//! | order | |
//! |---|---|
//! | view, haar | the whole volume coarse, then what gains most per byte in the view; level 0 as details of level 1 |
//! | view, zstd | the same, of a store whose levels are all arrays |
//! | pyramid, zstd | level by level, chunk by chunk, whatever the view shows |
//! | slices | slices by a standard codec, every 64th first, then those between; in place of one that is missing the nearest one |

use std::path::Path;
use std::sync::Arc;

use brickfield::bricks::{BlockOptions, BlockSource, build_blocks};
use brickfield::delivery::{Delivery, DeliveryPlan};
use brickfield::fetch::{Client, FetchOptions};
use brickfield::frame::Backend;
use brickfield::io::OpenOptions;
use brickfield::lod::BlockLevels;
use brickfield::optics::automatic;
use brickfield::{BlockResidency, Codec, Scene, StoreBlocks, StoreLimits, Viewpoint, prepare_blocks};
use brickfield_core::{Aabb, BlockSide, Image, Level, Scalar, Volume, Voxels, with_voxels};
use serde::Serialize;

use super::SaladiArgs;
use super::data::style;
use super::plot::{Curve, plot};
use super::stores::{files, store, volume_of};
use crate::codecs::peers::{PeerSlices, peer_slices};
use crate::compare::rivals::Rivals;
use crate::metrics::{delta_e, errors};
use crate::paper::{Missed, PaperError, frame_of, print};

const SIDE: BlockSide = BlockSide::V32;

const HAAR: &str = "view, haar";
const ZSTD: &str = "view, zstd";
const PYRAMID: &str = "pyramid, zstd";

/// What a prefix shows.
#[derive(Clone, Debug, Serialize)]
struct BytesRow {
    data: String,
    subject: &'static str,
    order: String,
    n_bytes: u64,
    rmse: f64,
    delta_e_mean: f64,
}

/// The picture of a whole volume or of a region of it.
struct Target<'a> {
    data: &'a str,
    subject: &'static str,
    scene: Scene,
    region: Option<Aabb>,
    answer: Image<f64>,
}

pub(super) fn run(args: &SaladiArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    let Some(backend) = rivals.present.first_mut() else { return Ok(Vec::new()) };
    print(&format!(
        "{} x {} pixels on {}, automatic transfer function, flat blocks of {SIDE}. Bytes: all that has been fetched, documents, indices and\n\
         summaries included. Error: against the picture of all voxels. Region: the middle half along each axis, drawn alone.",
        args.common.size.x,
        args.common.size.y,
        backend.describe().backend
    ))?;
    let (mut rows, mut missed) = (Vec::new(), Vec::new());
    for (name, path) in files(args)? {
        let stores = [store(args, &name, &path, Codec::Haar)?, store(args, &name, &path, Codec::Zstd)?];
        let opened = volume_of(&path)?;
        let volume = Arc::new(opened.volume);
        let camera = Viewpoint::default().camera(volume.grid(), opened.frame, args.common.size)?;
        let scene = Scene { step_voxels: args.common.step, ..Scene::new(camera, args.common.size, automatic(&volume)) };
        let slices = peer_slices(&volume)?;
        let half = 0.25 * volume.grid().dims().as_dvec3();
        let region = Aabb { min: half, max: 3.0 * half };
        for (subject, region) in [("whole", None), ("region", Some(region))] {
            let scene = Scene { clip: region, ..scene.clone() };
            let answer = whole_picture(backend.as_mut(), &stores[0], &scene)?;
            let target = Target { data: &name, subject, scene, region, answer };
            let of_target = run_target(backend.as_mut(), &target, &stores, &volume, slices.as_ref())?;
            print_rows(&of_target)?;
            missed.extend(claims(&target, &of_target)?);
            draw(args, &target, &of_target)?;
            rows.extend(of_target);
        }
    }
    args.common.write_rows("saladi-bytes.json", &rows)?;
    Ok(missed)
}

/// The picture of all voxels, from the files of the store.
fn whole_picture(backend: &mut dyn Backend, store: &Path, scene: &Scene) -> Result<Image<f64>, PaperError> {
    let limits = StoreLimits::default();
    let blocks = StoreBlocks::open(store, SIDE, limits, &OpenOptions::default(), &mut |_| {})?;
    let levels = BlockLevels::uniform(*blocks.layout(), Level(0));
    let plan = prepare_blocks(&blocks, scene, levels.levels(), style(), &mut BlockResidency::default())?;
    Ok(frame_of(backend, &plan)?.image.map(f64::from))
}

fn run_target(
    backend: &mut dyn Backend,
    target: &Target,
    [haar, zstd]: &[std::path::PathBuf; 2],
    volume: &Arc<Volume>,
    slices: Option<&PeerSlices>,
) -> Result<Vec<BytesRow>, PaperError> {
    let by_view = |plan: DeliveryPlan| plan;
    let mut rows = delivered(backend, target, HAAR, haar, by_view)?;
    rows.extend(delivered(backend, target, ZSTD, zstd, by_view)?);
    rows.extend(delivered(backend, target, PYRAMID, zstd, DeliveryPlan::level_by_level)?);
    match slices {
        Some(slices) => rows.extend(in_slices(backend, target, volume, slices)?),
        None => print("slices: absent: no Python with imagecodecs (BRICKFIELD_PYTHON names one)")?,
    }
    Ok(rows)
}

/// Pictures are drawn whenever the bytes have doubled.
struct Doubling {
    next: u64,
}

impl Doubling {
    fn is_due(&mut self, n_bytes: u64) -> bool {
        let is_due = n_bytes >= self.next;
        while self.next <= n_bytes {
            self.next *= 2;
        }
        is_due
    }
}

fn delivered(
    backend: &mut dyn Backend,
    target: &Target,
    order: &str,
    store: &Path,
    ordered: impl Fn(DeliveryPlan) -> DeliveryPlan,
) -> Result<Vec<BytesRow>, PaperError> {
    let client = Client::open(store, FetchOptions { max_gap_bytes: 0, ..FetchOptions::default() })?;
    let mut delivery = Delivery::begin(&store.to_string_lossy(), client, StoreLimits::default())?;
    let (mut rows, mut residency) = (Vec::new(), BlockResidency::default());
    rows.push(row(backend, target, order, &delivery, &mut residency)?);
    let mut plan = ordered(delivery.plan(&target.scene, target.region.as_ref())?);
    let mut doubling = Doubling { next: delivery.n_bytes().next_power_of_two() };
    loop {
        // Up to the next power of two, so that curves have points at the same bytes.
        let n = delivery.fetch(&mut plan, doubling.next.saturating_sub(delivery.n_bytes()))?;
        let is_complete = plan.n_fetched() == plan.n_items();
        if n > 0 && !is_complete {
            continue;
        }
        rows.push(row(backend, target, order, &delivery, &mut residency)?);
        if is_complete {
            return Ok(rows);
        }
        doubling.is_due(doubling.next);
    }
}

fn row(
    backend: &mut dyn Backend,
    target: &Target,
    order: &str,
    delivery: &Delivery,
    residency: &mut BlockResidency,
) -> Result<BytesRow, PaperError> {
    let plan = prepare_blocks(delivery.blocks(), &target.scene, delivery.levels(), style(), residency)?;
    let image = frame_of(backend, &plan)?.image;
    target.row(order, delivery.n_bytes(), &image)
}

impl Target<'_> {
    fn row(&self, order: &str, n_bytes: u64, image: &Image<f32>) -> Result<BytesRow, PaperError> {
        Ok(BytesRow {
            data: self.data.to_owned(),
            subject: self.subject,
            order: order.to_owned(),
            n_bytes,
            rmse: errors(image, &self.answer)?.rmse,
            delta_e_mean: delta_e(image, &self.answer, [0.0; 3])?.mean,
        })
    }
}

/// Slices that arrive coarse first, each whole.
fn in_slices(
    backend: &mut dyn Backend,
    target: &Target,
    volume: &Arc<Volume>,
    slices: &PeerSlices,
) -> Result<Vec<BytesRow>, PaperError> {
    let n = volume.grid().dims().z as usize;
    let order = coarse_first(n);
    let (mut rows, mut arrived, mut n_bytes) = (Vec::new(), vec![false; n], 0);
    let mut doubling = Doubling { next: 1 << 14 };
    for (i, slice) in order.iter().enumerate() {
        arrived[*slice] = true;
        n_bytes += slices.n_bytes[*slice];
        if doubling.is_due(n_bytes) || i + 1 == n {
            let filled = Arc::new(filled(volume, &arrived)?);
            let blocks = build_blocks(filled, &BlockOptions { side: SIDE, ..BlockOptions::default() })?;
            let levels = BlockLevels::uniform(*blocks.layout(), Level(0));
            let plan =
                prepare_blocks(&blocks, &target.scene, levels.levels(), style(), &mut BlockResidency::default())?;
            let image = frame_of(backend, &plan)?.image;
            rows.push(target.row(&format!("slices, {}", slices.codec), n_bytes, &image)?);
        }
    }
    Ok(rows)
}

/// Every 64th slice, then those in the middle between two that are there.
fn coarse_first(n: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).step_by(64).collect();
    for stride in [32, 16, 8, 4, 2, 1] {
        order.extend((0..n).filter(|slice| slice % stride == 0 && slice % (2 * stride) != 0));
    }
    order
}

/// The volume with the nearest slice that is there in place of each that is not.
fn filled(volume: &Volume, arrived: &[bool]) -> Result<Volume, PaperError> {
    fn of<T: Scalar>(voxels: &[T], n_slice: usize, nearest: &[usize]) -> Voxels {
        T::wrap(nearest.iter().flat_map(|slice| &voxels[slice * n_slice..][..n_slice]).copied().collect())
    }
    let there: Vec<usize> = (0..arrived.len()).filter(|slice| arrived[*slice]).collect();
    let nearest: Vec<usize> = (0..arrived.len())
        .map(|slice| there.iter().copied().min_by_key(|other| other.abs_diff(slice)).expect("a slice has arrived"))
        .collect();
    let dims = volume.grid().dims();
    let voxels = with_voxels!(volume.voxels(), v => of(v, (dims.x * dims.y) as usize, &nearest));
    Ok(Volume::rescaled(*volume.grid(), voxels, volume.rescale()).expect("samples of a volume make one"))
}

fn print_rows(rows: &[BytesRow]) -> Result<(), PaperError> {
    let Some(first) = rows.first() else { return Ok(()) };
    print(&format!("\n{}, {}\norder                      KiB      RMSE  mean Delta E", first.data, first.subject))?;
    rows.iter().try_for_each(|row| {
        let kib = row.n_bytes as f64 / 1024.0;
        print(&format!("{:20} {kib:9.1} {:9.2e} {:9.3}", row.order, row.rmse, row.delta_e_mean))
    })
}

/// The error at which orders are compared, as a part of the pyramid's first one.
const PART: f64 = 0.25;

/// All bytes give the picture of all voxels, and of a region the order of the view comes near it earlier than the pyramid does.
fn claims(target: &Target, rows: &[BytesRow]) -> Result<Vec<Missed>, PaperError> {
    let of_order = |order: &str| rows.iter().filter(|row| row.order == order).collect::<Vec<_>>();
    let mut missed = Vec::new();
    for order in [HAAR, ZSTD, PYRAMID] {
        // A store by zstd may have values of another type.
        let most = if order == HAAR { 0.0 } else { 1e-6 };
        if let Some(last) = of_order(order).last().filter(|last| last.rmse > most) {
            let what = format!(
                "{}, {}: {order}: RMSE {:.1e} of all bytes, at most {most:.0e}",
                target.data, target.subject, last.rmse
            );
            missed.push(Missed::of_pictures(what));
        }
    }
    let bound = of_order(PYRAMID).first().map_or(0.0, |first| PART * first.rmse);
    let [by_view, by_pyramid] = [HAAR, PYRAMID].map(|order| needed_bytes(&of_order(order), bound));
    let what = format!(
        "{}, {}: RMSE {bound:.1e} after {:.0} KiB by the view (haar), {:.0} KiB by the pyramid",
        target.data,
        target.subject,
        by_view / 1024.0,
        by_pyramid / 1024.0
    );
    print(&what)?;
    missed.extend((target.region.is_some() && by_view > by_pyramid).then(|| Missed::of_pictures(what)));
    Ok(missed)
}

/// The bytes at which a curve falls to an error, straight between its points in logarithms of both; infinite if it does not.
fn needed_bytes(rows: &[&BytesRow], bound: f64) -> f64 {
    let Some(i) = rows.iter().position(|row| row.rmse <= bound) else { return f64::INFINITY };
    let (at, n_bytes) = (&rows[i], |row: &BytesRow| row.n_bytes as f64);
    let Some(before) = i.checked_sub(1).map(|i| rows[i]) else { return n_bytes(at) };
    let log = |rmse: f64| rmse.max(f64::MIN_POSITIVE).ln();
    let part = (log(before.rmse) - log(bound)) / (log(before.rmse) - log(at.rmse));
    n_bytes(before) * (n_bytes(at) / n_bytes(before)).powf(part)
}

fn draw(args: &SaladiArgs, target: &Target, rows: &[BytesRow]) -> Result<(), PaperError> {
    let mut curves: Vec<Curve> = Vec::new();
    for row in rows {
        let point = (row.n_bytes as f64 / 1024.0, row.rmse);
        match curves.iter_mut().find(|curve| curve.name == row.order) {
            Some(curve) => curve.points.push(point),
            None => curves.push(Curve { name: row.order.clone(), points: vec![point] }),
        }
    }
    let plain: String = target.data.chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
    let path = args.common.out.join(format!("saladi-bytes-{plain}-{}.svg", target.subject));
    let title = format!("{}, {}: error of a prefix", target.data, target.subject);
    plot(&path, &title, ["fetched [KiB]", "RMSE"], &curves)?;
    print(&format!("{}: error against bytes", path.display()))
}
