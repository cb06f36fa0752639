//! `brickfield render --fetch-kib`: a store that has arrived in part.

use brickfield::core::{BlockSide, Level};
use brickfield::delivery::{Delivery, DeliveryPlan};
use brickfield::fetch::{Client, FetchOptions};
use brickfield::frame::Backend;
use brickfield::options::{FinestVoxels, OptionError};
use brickfield::{BlockResidency, StoreLimits, prepare_blocks};

use crate::backend::check_validation;
use crate::render::{check_of_store, finish};
use crate::{Failure, RenderArgs, mib, print};

/// Fewer bytes than a picture takes.
#[derive(Debug, thiserror::Error)]
#[error("--fetch-kib {kib}: the first picture of this store takes {:.1}", *needed as f64 / 1024.0)]
struct TooFew {
    kib: f64,
    needed: u64,
}

pub(crate) fn render(args: &RenderArgs, kib: f64, backend: &mut dyn Backend) -> Result<(), Failure> {
    check_side(args.flat.blocks)?;
    check_of_store(args)?;
    let most = (kib * 1024.0) as u64;
    // No byte is fetched that is not asked for.
    let options = FetchOptions { max_gap_bytes: 0, ..FetchOptions::default() };
    let client = Client::open(&args.file, options).map_err(Failure::usage)?;
    let mut delivery = Delivery::begin(&args.file.to_string_lossy(), client, StoreLimits::default())?;
    if delivery.n_bytes() > most {
        return Err(Failure::usage(TooFew { kib, needed: delivery.n_bytes() }));
    }
    let facts = delivery.blocks().facts().clone();
    let overview = delivery.overview()?;
    let transfer = args.view.transfer(&overview)?;
    let scene = args.view.scene_of(&facts.grid, facts.frame, &transfer)?;
    let scene = args.sampling.of(scene, FinestVoxels::Volume(&overview), args.flat.classify)?;
    let scene = args.light.of(scene, overview.range(), &facts.grid)?;
    let mut plan = None;
    if delivery.n_bytes() + delivery.n_plan_bytes()? <= most {
        let plan = plan.insert(delivery.plan(&scene, args.region.as_ref())?);
        while delivery.fetch(plan, most.saturating_sub(delivery.n_bytes()))? > 0 {}
    }
    let mut residency = BlockResidency::default();
    let frame_plan = prepare_blocks(delivery.blocks(), &scene, delivery.levels(), args.flat.style(), &mut residency)?;
    let frame = backend.render(&frame_plan)?;
    finish(args, backend, &scene, (&frame_plan, &frame))?;
    print(&summary(&delivery, plan.as_ref()))?;
    check_validation(&backend.validation_messages())
}

fn check_side(side: Option<BlockSide>) -> Result<(), OptionError> {
    match side {
        None | Some(BlockSide::V32) => Ok(()),
        Some(side) => Err(OptionError::Exclude {
            first: format!("--blocks {side}"),
            second: "--fetch-kib".to_owned(),
            reason: "what is fetched are chunks, which hold blocks of 32 voxels",
        }),
    }
}

/// What has arrived, and what of the view is missing.
fn summary(delivery: &Delivery, plan: Option<&DeliveryPlan>) -> String {
    let levels = delivery.levels();
    let n_of = |level: Level| levels.iter().filter(|l| **l == level).count();
    let by_level: Vec<String> = BlockSide::V32
        .levels()
        .map(|level| (n_of(level), level.0))
        .filter(|(n, _)| *n > 0)
        .map(|(n, level)| format!("{n} of level {level}"))
        .collect();
    let counts = delivery.client().counts();
    let state = match plan {
        None => "the first picture; the order of the rest has not been fetched".to_owned(),
        Some(plan) if plan.n_fetched() >= plan.n_visible() => "all that the view shows".to_owned(),
        Some(plan) => format!("{} of {} chunks that the view shows", plan.n_fetched(), plan.n_visible()),
    };
    format!(
        "fetched {:.1} KiB in {} requests ({:.2} MiB on the wire): {state}\nblocks: {}\n",
        delivery.n_bytes() as f64 / 1024.0,
        counts.n_requests,
        mib(counts.n_wire_bytes),
        by_level.join(", ")
    )
}
