//! Frames in batches: caches smaller than the bricks that a view shows, and an orbit.

use std::time::Instant;

use brickfield::frame::{Backend, Frame};
use brickfield::{
    BackendKind, CacheCounts, CacheOptions, Eviction, Scene, TrimCache, Trimming, prepare_trimmed_batches, render_ahead,
};
use brickfield_core::glam::DVec3;
use brickfield_core::{Camera, Image};
use serde::Serialize;

use super::TongArgs;
use super::data::{DataSet, Renderer, data_sets_of_batches};
use crate::compare::rivals::Rivals;
use crate::metrics::{greatest_difference, median};
use crate::paper::{Missed, PaperError, mib, print};
use crate::turns::{Ratio, Spread, take_turns};

/// The caches, as parts of the bytes of a view's pages.
const SHARES: [u64; 4] = [1, 2, 4, 16];
/// Views of the orbit.
const N_VIEWS: usize = 36;

/// A line of the table.
#[derive(Clone, Debug, Serialize)]
struct BatchRow {
    data: String,
    renderer: &'static str,
    backend: &'static str,
    /// The view's pages are so many times the cache.
    share: u64,
    /// Whether a batch is prepared while the one before it is drawn.
    is_ahead: bool,
    n_places: usize,
    n_pages: usize,
    n_batches: usize,
    /// Of a frame after one like it.
    n_hits: usize,
    n_misses: usize,
    uploaded_bytes: u64,
    ms: Spread,
    /// Of its time over that of a single batch.
    ratio: Ratio,
    /// The greatest difference of a channel from a single batch's picture.
    difference: f64,
}

/// A cache, and how its frames are rendered.
struct Contestant {
    share: u64,
    is_ahead: bool,
    cache: TrimCache,
}

pub(super) fn run(args: &TongArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    print(&format!(
        "{} x {} pixels, steps of {} voxel(s), exact, bricks of {} in pages as large, trimmed along all axes. A cache of the view's pages, and of parts of them. Hits, misses and\n\
         bytes: of a frame after one like it; what leaves the cache is used last. Frames: from the scene to the picture, the second of two, medians of {} rounds.\n\
         \"In turn\": a batch is prepared after the one before it is drawn, else meanwhile.\n",
        args.common.size.x, args.common.size.y, args.common.step, args.side, args.common.frames
    ))?;
    let (mut rows, mut missed) = (Vec::new(), Vec::new());
    for data_set in data_sets_of_batches(args)? {
        let data_set = data_set?;
        print(&data_set.subject.name)?;
        print(HEADER)?;
        for renderer in Renderer::ALL {
            let scene = data_set.scene(args, renderer, data_set.subject.transfer.clone())?;
            let draws = |backend: &dyn Backend| {
                renderer == Renderer::Rays || backend.describe().backend != BackendKind::Cpu.name()
            };
            for backend in rivals.present.iter_mut().filter(|backend| draws(backend.as_ref())) {
                for row in contest(args, backend.as_mut(), &data_set, (renderer, &scene))? {
                    print(&line(&row))?;
                    missed.extend(other_picture(&row));
                    rows.push(row);
                }
            }
        }
        if let Some(backend) = rivals.present.last_mut() {
            orbit(args, backend.as_mut(), &data_set)?;
        }
    }
    args.common.write_rows("batches.json", &rows)?;
    Ok(missed)
}

const HEADER: &str = "  renderer backend  cache            places / pages  batches   hits  misses  uploaded MiB   frame ms (min to max)         over one batch               difference";

/// A frame of a cache, and its milliseconds from the scene on.
fn frame_of(
    backend: &mut dyn Backend,
    data: &DataSet,
    scene: &Scene,
    contestant: &mut Contestant,
) -> Result<(Frame, f64), PaperError> {
    let begin = Instant::now();
    let mut batches = prepare_trimmed_batches(&data.trimmed, scene, Trimming::Packed, &mut contestant.cache)?;
    let frame = match contestant.is_ahead {
        true => render_ahead(backend, batches.size(), batches),
        false => backend.render_batches(batches.size(), &mut batches),
    };
    let name = backend.describe().backend;
    let frame = frame.map_err(|source| PaperError::Render { backend: name, source })?;
    Ok((frame, begin.elapsed().as_secs_f64() * 1e3))
}

/// Bytes of the pages that a view shows.
fn page_bytes(args: &TongArgs, data: &DataSet, scene: &Scene) -> Result<u64, PaperError> {
    let mut all = cache(args, u64::MAX, Eviction::default());
    drop(prepare_trimmed_batches(&data.trimmed, scene, Trimming::Packed, &mut all)?);
    let (n_pages, n_places) = (all.counts().n_pages as u64, all.counts().n_places.max(1) as u64);
    Ok(all.n_texture_bytes() / n_places * n_pages)
}

fn cache(args: &TongArgs, n_bytes: u64, eviction: Eviction) -> TrimCache {
    TrimCache::new(CacheOptions { n_bytes, page_side: Some(args.side.n_samples()), eviction })
}

/// The caches take turns on a backend.
fn contest(
    args: &TongArgs,
    backend: &mut dyn Backend,
    data: &DataSet,
    (renderer, scene): (Renderer, &Scene),
) -> Result<Vec<BatchRow>, PaperError> {
    let visible_bytes = page_bytes(args, data, scene)?;
    let of = |share: u64, is_ahead| Contestant {
        share,
        is_ahead,
        cache: cache(args, if share == 1 { u64::MAX } else { visible_bytes / share }, Eviction::default()),
    };
    let mut contestants: Vec<Contestant> = SHARES.map(|share| of(share, true)).into_iter().collect();
    contestants.push(of(4, false));
    let mut last: Vec<Option<(Image<f32>, CacheCounts, u64)>> = vec![None; contestants.len()];
    let ms = take_turns::<PaperError>(contestants.len(), args.common.frames, |turn| {
        let contestant = &mut contestants[turn.contestant];
        // The backend still holds another cache's bricks.
        frame_of(backend, data, scene, contestant)?;
        let (frame, ms) = frame_of(backend, data, scene, contestant)?;
        last[turn.contestant] = Some((frame.image, contestant.cache.counts(), frame.uploaded_bytes));
        Ok(ms)
    })?;
    let last: Vec<_> = last.into_iter().map(|last| last.expect("all had their turns")).collect();
    let row = |(i, contestant): (usize, &Contestant)| {
        let (image, counts, uploaded_bytes) = &last[i];
        BatchRow {
            data: data.subject.name.clone(),
            renderer: renderer.name(),
            backend: backend.describe().backend,
            share: contestant.share,
            is_ahead: contestant.is_ahead,
            n_places: counts.n_places,
            n_pages: counts.n_pages,
            n_batches: counts.n_batches,
            n_hits: counts.n_hits,
            n_misses: counts.n_misses,
            uploaded_bytes: *uploaded_bytes,
            ms: Spread::of(&ms[i]),
            ratio: Ratio::of(&ms[i], &ms[0]),
            difference: greatest_difference(image, &last[0].0),
        }
    };
    Ok(contestants.iter().enumerate().map(row).collect())
}

fn line(row: &BatchRow) -> String {
    let ms = format!("{:.1} ({:.1} to {:.1})", row.ms.median, row.ms.min, row.ms.max);
    let Ratio { median, low, high, confidence, .. } = row.ratio;
    let ratio = format!("{median:.2} ({low:.2} to {high:.2}, {:.0} %)", (100.0 * confidence).floor());
    let cache = format!("1/{}{}", row.share, if row.is_ahead { "" } else { ", in turn" });
    format!(
        "  {:<8} {:<8} {cache:<16} {:>6} / {:<6} {:>8} {:>6} {:>7} {:>13.2}   {ms:<29} {ratio:<28} {:.1e}",
        row.renderer,
        row.backend,
        row.n_places,
        row.n_pages,
        row.n_batches,
        row.n_hits,
        row.n_misses,
        mib(row.uploaded_bytes),
        row.difference
    )
}

/// A picture in batches is that of one batch, bit by bit.
fn other_picture(row: &BatchRow) -> Option<Missed> {
    // NaN is a difference, too.
    let is_equal = row.difference == 0.0;
    (!is_equal).then(|| {
        let BatchRow { data, renderer, backend, share, difference, .. } = row;
        let what = format!(
            "{data}, {renderer}, {backend}, a cache of 1/{share}: a channel differs by {difference:.1e} from a single batch"
        );
        Missed::of_pictures(what)
    })
}

/// Views around the volume, with a cache of half of what the first view shows.
fn orbit(args: &TongArgs, backend: &mut dyn Backend, data: &DataSet) -> Result<(), PaperError> {
    let first = data.scene(args, Renderer::Rays, data.subject.transfer.clone())?;
    let n_bytes = page_bytes(args, data, &first)? / 2;
    for eviction in Eviction::ALL {
        let mut contestant = Contestant { share: 2, is_ahead: true, cache: cache(args, n_bytes, eviction) };
        let (mut hits, mut misses, mut uploaded, mut ms) = (0, 0, 0, Vec::new());
        for view in 0..N_VIEWS {
            let angle = std::f64::consts::TAU * view as f64 / N_VIEWS as f64;
            let from = DVec3::new(angle.cos(), angle.sin(), 0.4);
            let camera = Camera::framing(&data.subject.volume.grid().world_box(), from, DVec3::Z)?;
            let scene = Scene { camera, ..first.clone() };
            let (frame, of_frame) = frame_of(backend, data, &scene, &mut contestant)?;
            let counts = contestant.cache.counts();
            (hits, misses, uploaded) =
                (hits + counts.n_hits, misses + counts.n_misses, uploaded + frame.uploaded_bytes);
            ms.push(of_frame);
        }
        print(&format!(
            "  orbit of {N_VIEWS} views on {}, a cache of 1/2, {}: {hits} hits, {misses} misses, {:.1} MiB uploaded, a frame {:.1} ms (median), all {:.1} s",
            backend.describe().backend,
            eviction.name(),
            mib(uploaded),
            median(ms.clone()),
            ms.iter().sum::<f64>() * 1e-3
        ))?;
    }
    Ok(())
}
