//! A store that is served over a slow link, and over one that fails.
//!
//! The link is that of a comparison of others: 30 Mbit/s, 10 ms before each answer.

use std::path::Path;
use std::time::{Duration, Instant};

use brickfield::delivery::{Delivery, DeliveryError};
use brickfield::fetch::{Client, FetchOptions};
use brickfield::frame::Backend;
use brickfield::optics::automatic;
use brickfield::serve::{Faults, ServeOptions, Server, Throttle};
use brickfield::{BlockResidency, Codec, Scene, StoreLimits, Viewpoint, prepare_blocks};
use brickfield_core::{Aabb, Image};
use serde::Serialize;

use super::SaladiArgs;
use super::data::style;
use super::stores::{files, store, volume_of};
use crate::compare::rivals::Rivals;
use crate::metrics::greatest_difference;
use crate::paper::{Missed, PaperError, frame_of, print};

/// What a delivery took.
#[derive(Clone, Debug, Serialize)]
struct ServedRow {
    data: String,
    codec: &'static str,
    /// To the first picture, to the region, to all that the view shows, to everything.
    ms: [f64; 4],
    n_bytes: [u64; 4],
    n_requests: [u64; 4],
}

/// Links that fail, and how.
fn faults() -> [(&'static str, Faults); 6] {
    let none = Faults::default();
    [
        ("every 5th body is cut", Faults { cut_every: 5, ..none }),
        ("every 4th range is ignored", Faults { ignore_range_every: 4, ..none }),
        ("every 3rd answer is 503", Faults { unavailable_every: 3, ..none }),
        ("every 4th Content-Range is wrong", Faults { wrong_range_every: 4, ..none }),
        ("every answer is 503", Faults { unavailable_every: 1, ..none }),
        ("the server dies after 12 requests", Faults { die_after: Some(12), ..none }),
    ]
}

pub(super) fn run(args: &SaladiArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    let Some(backend) = rivals.present.first_mut() else { return Ok(Vec::new()) };
    print(
        "Over 30 Mbit/s, 10 ms before each answer, in this process. Times are of fetching and decoding to the moment when a picture can be drawn;\n\
         drawing is not in them. Region: the middle half along each axis.\n",
    )?;
    print(
        "data                 codec  first picture        region   all that shows     everything  ms\n                            KiB, requests",
    )?;
    let (mut rows, mut missed) = (Vec::new(), Vec::new());
    for (name, path) in files(args)? {
        let opened = volume_of(&path)?;
        let camera = Viewpoint::default().camera(opened.volume.grid(), opened.frame, args.common.size)?;
        let scene =
            Scene { step_voxels: args.common.step, ..Scene::new(camera, args.common.size, automatic(&opened.volume)) };
        let half = 0.25 * opened.volume.grid().dims().as_dvec3();
        let region = Aabb { min: half, max: 3.0 * half };
        let haar = store(args, &name, &path, Codec::Haar)?;
        let zstd = store(args, &name, &path, Codec::Zstd)?;
        for (codec, store) in [(Codec::Haar, &haar), (Codec::Zstd, &zstd)] {
            let row = timed(&name, codec, store, &scene, &region)?;
            print_row(&row)?;
            rows.push(row);
        }
        missed.extend(with_faults(backend.as_mut(), &name, &haar, &scene)?);
    }
    args.common.write_rows("saladi-served.json", &rows)?;
    Ok(missed)
}

fn slow_link() -> ServeOptions {
    let throttle = Throttle { bits_per_second: 30e6, latency: Duration::from_millis(10) };
    ServeOptions { throttle: Some(throttle), ..ServeOptions::default() }
}

fn timed(data: &str, codec: Codec, store: &Path, scene: &Scene, region: &Aabb) -> Result<ServedRow, PaperError> {
    let server = Server::start(store, slow_link())?;
    let client = Client::open(server.url(), FetchOptions::default())?;
    let mut row =
        ServedRow { data: data.to_owned(), codec: codec.name(), ms: [0.0; 4], n_bytes: [0; 4], n_requests: [0; 4] };
    let begin = Instant::now();
    let mut delivery = Delivery::begin(&server.url(), client, StoreLimits::default())?;
    let mut note = |i: usize, delivery: &Delivery| {
        row.ms[i] = begin.elapsed().as_secs_f64() * 1e3;
        (row.n_bytes[i], row.n_requests[i]) = (delivery.n_bytes(), delivery.client().counts().n_requests);
    };
    note(0, &delivery);
    let mut plan = delivery.plan(scene, Some(region))?;
    for (i, n) in [(1, plan.n_of_region()), (2, plan.n_visible()), (3, plan.n_items())] {
        while plan.n_fetched() < n && delivery.fetch(&mut plan, u64::MAX)? > 0 {}
        note(i, &delivery);
    }
    server.shutdown();
    Ok(row)
}

fn print_row(row: &ServedRow) -> Result<(), PaperError> {
    let [a, b, c, d] = row.ms;
    print(&format!("{:20} {:5}  {a:13.0} {b:13.0} {c:16.0} {d:14.0}", row.data, row.codec))?;
    let cell = |i: usize| format!("{:.0}, {}", row.n_bytes[i] as f64 / 1024.0, row.n_requests[i]);
    print(&format!("{:26}  {:>13} {:>13} {:>16} {:>14}", "", cell(0), cell(1), cell(2), cell(3)))
}

/// Everything, over a link that fails: the picture is the same, or the failure is reported.
fn with_faults(backend: &mut dyn Backend, data: &str, store: &Path, scene: &Scene) -> Result<Vec<Missed>, PaperError> {
    let good = delivered(backend, store, Faults::default(), scene)?.0;
    let mut missed = Vec::new();
    for (what, faults) in faults() {
        let ends_badly = faults.die_after.is_some() || faults.unavailable_every == 1;
        let line = match delivered(backend, store, faults, scene) {
            Ok((image, n_retries)) => {
                let difference = greatest_difference(&image, &good);
                if difference != 0.0 || ends_badly {
                    missed.push(Missed::of_pictures(format!(
                        "{data}: {what}: a picture that differs by {difference:.1e}"
                    )));
                }
                format!("the same picture (difference {difference}), {n_retries} retries")
            }
            Err(PaperError::Delivery(DeliveryError::Fetch(fault))) => {
                missed.extend((!ends_badly).then(|| Missed::of_pictures(format!("{data}: {what}: {fault}"))));
                format!("reported: {fault}")
            }
            Err(other) => return Err(other),
        };
        print(&format!("  {what}: {line}"))?;
    }
    Ok(missed)
}

/// The picture of everything, and how often the client tried again.
fn delivered(
    backend: &mut dyn Backend,
    store: &Path,
    faults: Faults,
    scene: &Scene,
) -> Result<(Image<f32>, u64), PaperError> {
    let server = Server::start(store, ServeOptions { faults, ..ServeOptions::default() })?;
    let options = FetchOptions { first_backoff: Duration::from_millis(5), ..FetchOptions::default() };
    let client = Client::open(server.url(), options)?;
    let mut delivery = Delivery::begin(&server.url(), client, StoreLimits::default())?;
    let mut plan = delivery.plan(scene, None)?;
    while delivery.fetch(&mut plan, u64::MAX)? > 0 {}
    let frame_plan =
        prepare_blocks(delivery.blocks(), scene, delivery.levels(), style(), &mut BlockResidency::default())?;
    let image = frame_of(backend, &frame_plan)?.image;
    let n_retries = delivery.client().counts().n_retries;
    server.shutdown();
    Ok((image, n_retries))
}
