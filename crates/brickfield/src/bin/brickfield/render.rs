//! `brickfield render`.

use std::collections::HashSet;
use std::sync::Arc;

#[cfg(feature = "formats")]
use brickfield::StoreBlocks;
use brickfield::bricks::block_memory;
use brickfield::core::{BlockSide, BrickId, Image, Level};
use brickfield::frame::{Backend, Frame, FramePlan, QuadratureRule, Slots};
use brickfield::lod::{BlockLevels, Criterion, select_cut};
#[cfg(feature = "formats")]
use brickfield::optics::Normals;
#[cfg(feature = "formats")]
use brickfield::options::Blocks;
use brickfield::options::{BlockSubject, Boxes, FinestVoxels, OptionError, Subject, values};
use brickfield::overlay::{LevelColor, show_bricks, show_bricks_faintly};
use brickfield::{
    BackendKind, BlockResidency, CacheCounts, CacheOptions, Classification, Residency, Scene, Technique, TrimCache,
    TrimResidency, TrimmedVolume, Trimming, check_picture_path, prepare, prepare_blocks, prepare_trimmed,
    prepare_trimmed_batches, render_ahead, write_picture,
};

use crate::backend::check_validation;
use crate::{Failure, RenderArgs, mib, print};

pub(crate) fn run(args: &RenderArgs) -> Result<(), Failure> {
    // Options that can be refused are refused before any work is done.
    check_picture_path(&args.out).map_err(Failure::usage)?;
    args.view.check()?;
    args.sampling.check()?;
    args.light.check()?;
    check_together(args)?;
    let mut backend = args.backend.open()?;
    #[cfg(feature = "fetch")]
    if let Some(kib) = args.fetch_kib {
        return crate::fetched::render(args, kib, backend.as_mut());
    }
    if let Some(side) = args.flat.blocks {
        return render_blocks(args, side, backend.as_mut());
    }
    if let Some(trimming) = args.trim.as_deref().and_then(|name| Trimming::of_name(name, args.tree.brick)) {
        return render_trimmed(args, trimming, backend.as_mut());
    }
    let subject = Subject::open(&args.file, &args.input, &args.tree, &args.view)?;
    let scene =
        args.sampling.of(args.view.scene(&subject)?, FinestVoxels::Volume(&subject.volume), Classification::OfMean)?;
    let scene = args.light.of(scene, subject.volume.range(), subject.tree.grid())?;
    let mut residency = Residency::default();
    let plan = prepare(&subject.tree, &scene, &mut residency).map_err(Failure::usage)?;
    note_if_nothing_shows(&plan);
    let mut frame = backend.render(&plan)?;
    let shown = args.show_bricks.map(|boxes| ShownBricks::new(boxes, &subject, &scene, residency.bricks()));
    if let Some(shown) = &shown {
        frame.image = shown.over(&frame.image, &subject, &scene);
    }
    let attributes = attributes(args, backend.as_ref(), &scene, &plan);
    write_picture(&args.out, &frame.image, args.view.background.0, &attributes)?;
    print(&summary(backend.as_ref(), &scene, &plan, &frame))?;
    if let Some(shown) = &shown {
        print(&shown.legend())?;
    }
    check_validation(&backend.validation_messages())
}

/// Options of octree, trimmed bricks and flat blocks that exclude each other.
fn check_together(args: &RenderArgs) -> Result<(), OptionError> {
    let exclude = |first: &str, second: &str, reason| {
        Err(OptionError::Exclude { first: first.to_owned(), second: second.to_owned(), reason })
    };
    // clap drops the requirements of options whose requirement is excluded: it is not told that --trim excludes --blocks.
    let of_its_own = match (args.flat.blocks, &args.trim) {
        (Some(_), Some(_)) => return exclude("--trim", "--blocks", "bricks are trimmed, or flat blocks are drawn"),
        (Some(_), None) => "--blocks",
        (None, Some(_)) => "--trim",
        (None, None) => return Ok(()),
    };
    if args.view.lod != [Criterion::FullResolution] {
        return exclude("--lod", of_its_own, "it selects bricks of the octree");
    }
    if (args.flat.classify, args.sampling.rule) == (Classification::Prefiltered, Some(QuadratureRule::PreIntegrated)) {
        return exclude(
            "--classify prefiltered",
            "--rule pre-integrated",
            "the rule looks at the values between its nodes",
        );
    }
    Ok(())
}

/// A store has values alone: options that ask for more are refused before anything is read of it.
#[cfg(feature = "formats")]
pub(crate) fn check_of_store(args: &RenderArgs) -> Result<(), OptionError> {
    let option = match (args.flat.classify, args.light.normals) {
        (Classification::Prefiltered, _) => "--classify prefiltered",
        (_, Normals::Stored) => "--normals stored",
        (_, Normals::Surface) => "--normals surface",
        _ => return Ok(()),
    };
    let reason = "it has values alone; read another format, or leave the option out";
    Err(OptionError::Exclude { first: option.to_owned(), second: "a store".to_owned(), reason })
}

/// Renders flat blocks.
fn render_blocks(args: &RenderArgs, side: BlockSide, backend: &mut dyn Backend) -> Result<(), Failure> {
    let subject = args.flat.open(&args.file, &args.input, side, &args.view)?;
    #[cfg(feature = "formats")]
    if matches!(subject.blocks, Blocks::Store(_)) {
        check_of_store(args)?;
    }
    let source = subject.blocks.source();
    let scene = args.view.scene_of(source.grid(), subject.frame, &subject.transfer)?;
    let scene = args.sampling.of(scene, subject.blocks.finest_voxels(), args.flat.classify)?;
    let scene = args.light.of(scene, source.range(), source.grid())?;
    let selection = args.flat.select(&subject, &scene)?;
    let (levels, mut residency) = (&selection.levels, BlockResidency::default());
    let plan = prepare_blocks(source, &scene, levels.levels(), args.flat.style(), &mut residency)?;
    let frame = backend.render(&plan)?;
    finish(args, backend, &scene, (&plan, &frame))?;
    print(&block_summary(&subject, levels, &residency, &plan))?;
    #[cfg(feature = "formats")]
    if let Blocks::Store(store) = &subject.blocks {
        print(&store_summary(store, frame.uploaded_bytes))?;
    }
    check_validation(&backend.validation_messages())
}

/// Renders trimmed bricks.
fn render_trimmed(args: &RenderArgs, trimming: Trimming, backend: &mut dyn Backend) -> Result<(), Failure> {
    let (volume, frame, transfer) = args.input.open_to_render(&args.file, &args.view)?;
    let source = TrimmedVolume::new(Arc::new(volume), args.tree.brick);
    let (volume, grid) = (source.volume(), source.volume().grid());
    let scene = args.sampling.of(
        args.view.scene_of(grid, frame, &transfer)?,
        FinestVoxels::Volume(volume),
        Classification::OfMean,
    )?;
    let scene = args.light.of(scene, volume.range(), grid)?;
    if let Some(mib) = args.cache_mib {
        return render_in_batches(args, trimming, backend, (&source, &scene), mib);
    }
    let mut residency = TrimResidency::default();
    let plan = prepare_trimmed(&source, &scene, trimming, &mut residency).map_err(Failure::usage)?;
    let frame = backend.render(&plan)?;
    finish(args, backend, &scene, (&plan, &frame))?;
    print(&trim_summary(&source, &residency, &frame))?;
    check_validation(&backend.validation_messages())
}

/// Renders trimmed bricks in batches that fit a cache.
fn render_in_batches(
    args: &RenderArgs,
    trimming: Trimming,
    backend: &mut dyn Backend,
    (source, scene): (&TrimmedVolume, &Scene),
    cache_mib: f64,
) -> Result<(), Failure> {
    let mut cache = TrimCache::new(CacheOptions::of_bytes((cache_mib * f64::from(1 << 20)) as u64));
    let batches = prepare_trimmed_batches(source, scene, trimming, &mut cache).map_err(Failure::usage)?;
    let (size, mut last) = (batches.size(), None);
    let frame = render_ahead(backend, size, batches.inspect(|plan| last = Some(plan.clone())))?;
    let Some(plan) = last else {
        let nothing =
            prepare_trimmed(source, scene, trimming, &mut TrimResidency::default()).map_err(Failure::usage)?;
        finish(args, backend, scene, (&nothing, &frame))?;
        return check_validation(&backend.validation_messages());
    };
    finish(args, backend, scene, (&plan, &frame))?;
    let CacheCounts { n_batches, n_places, n_pages, n_hits, n_misses, .. } = cache.counts();
    print(&format!(
        "{n_batches} batch(es), of which the last is above; {n_pages} pages, {n_misses} brought and {n_hits} found in a cache of {n_places}, {:.1} MiB; {:.1} MiB uploaded\n",
        mib(cache.n_texture_bytes()),
        mib(frame.uploaded_bytes)
    ))?;
    check_validation(&backend.validation_messages())
}

/// Writes the picture, and prints what it was made by.
pub(crate) fn finish(
    args: &RenderArgs,
    backend: &dyn Backend,
    scene: &Scene,
    (plan, frame): (&FramePlan, &Frame),
) -> Result<(), Failure> {
    note_if_nothing_shows(plan);
    let attributes = attributes(args, backend, scene, plan);
    write_picture(&args.out, &frame.image, args.view.background.0, &attributes)?;
    print(&summary(backend, scene, plan, frame))
}

/// The classes of bricks, and the texels that their samples take.
fn trim_summary(source: &TrimmedVolume, residency: &TrimResidency, frame: &Frame) -> String {
    let (counts, account) = (residency.counts(), residency.account());
    let bytes = |n_texels: u64| mib(n_texels * source.volume().scalar_type().n_bytes() as u64);
    format!(
        "bricks of {}: {} white, {} grey, {} black\nkept {:.1} of {:.1} MiB, {:.1} MiB of the texture free; uploaded {:.1} MiB\n",
        source.layout().side(),
        counts.n_white,
        counts.n_grey,
        counts.n_black,
        bytes(account.n_samples),
        bytes(source.volume().voxels().len() as u64),
        bytes(account.n_padding()),
        mib(frame.uploaded_bytes),
    )
}

/// The blocks of each level, and their bytes.
fn block_summary(subject: &BlockSubject, levels: &BlockLevels, residency: &BlockResidency, plan: &FramePlan) -> String {
    let source = subject.blocks.source();
    let layout = source.layout();
    let memory = block_memory(layout, source.scalar_type(), levels.levels());
    let by_level: Vec<String> = layout
        .side()
        .levels()
        .zip(levels.n_blocks_per_level())
        .filter(|(_, n)| *n > 0)
        .map(|(level, n)| format!("{n} of level {}", level.0))
        .collect();
    let slots = plan.field().slots();
    let of = |name: &str, slots: &Arc<Slots>| format!(", {name} {:.2} MiB", mib(slots.n_bytes() as u64));
    let spreads = plan.spreads().map(|spreads| of("spreads", spreads)).unwrap_or_default();
    let companion = plan.lighting().and_then(|lighting| lighting.light.normals().companion());
    let name = companion.map_or("", |companion| companion.name());
    let gradients = plan.gradients().map(|gradients| of(name, gradients)).unwrap_or_default();
    let free = residency.n_free_texels() * slots.format().n_bytes() as u64;
    format!(
        "flat blocks of {}: {}; {:.1}:1\nkept {:.2} MiB{spreads}{gradients}, {:.2} MiB of the texture free; with ghost layers {:.2} MiB (one side), {:.2} MiB (both)\n",
        layout.side(),
        by_level.join(", "),
        memory.ratio(),
        mib(slots.n_bytes() as u64),
        mib(free),
        mib(memory.larger.single_sided_bytes),
        mib(memory.larger.double_sided_bytes),
    )
}

/// The bytes that a store was asked for, that are held beside the blocks, and that went to the device.
#[cfg(feature = "formats")]
fn store_summary(store: &StoreBlocks, uploaded: u64) -> String {
    let missing = match store.n_missing_chunks() {
        0 => String::new(),
        n => format!("; {n} chunks are not stored, and have the fill value"),
    };
    format!(
        "read {:.1} MiB of the store{missing}\nkept beside the blocks: {:.1} MiB of unpacked chunks, {:.1} MiB of summaries\nuploaded {:.1} MiB\n",
        mib(store.n_bytes_read()),
        mib(store.n_bytes_kept()),
        mib(store.n_summary_bytes()),
        mib(uploaded),
    )
}

fn note_if_nothing_shows(plan: &FramePlan) {
    if plan.visible().is_empty() {
        eprintln!(
            "note: nothing is visible: the transfer function is 0 over all values inside the clip box and the view"
        );
    }
}

/// The bricks whose boxes are shown over the picture.
struct ShownBricks<'a> {
    drawn: &'a [BrickId],
    /// Bricks that are selected but show nothing; `None` if their boxes were not asked for.
    faint: Option<Vec<BrickId>>,
}

impl<'a> ShownBricks<'a> {
    fn new(boxes: Boxes, subject: &Subject, scene: &Scene, drawn: &'a [BrickId]) -> ShownBricks<'a> {
        let selected_only = || {
            let selection = select_cut(subject.tree.layout(), subject.tree.grid(), &scene.view(), &scene.detail);
            let drawn: HashSet<BrickId> = drawn.iter().copied().collect();
            selection.drawn().filter(|id| !drawn.contains(id)).collect()
        };
        ShownBricks { drawn, faint: (boxes == Boxes::All).then(selected_only) }
    }

    fn over(&self, image: &Image, subject: &Subject, scene: &Scene) -> Image {
        let (camera, grid, layout) = (&scene.camera, subject.tree.grid(), subject.tree.layout());
        let under = self.faint.as_ref().map(|faint| show_bricks_faintly(image, camera, grid, layout, faint));
        show_bricks(under.as_ref().unwrap_or(image), camera, grid, layout, self.drawn)
    }

    /// How many bricks of each level are shown, and in which colour.
    fn legend(&self) -> String {
        let drawn = format!("boxes: {}\n", by_level(self.drawn));
        match &self.faint {
            Some(faint) => format!("{drawn}faint boxes, in which nothing is visible: {}\n", by_level(faint)),
            None => drawn,
        }
    }
}

fn by_level(bricks: &[BrickId]) -> String {
    let of_level = |level: Level| {
        let n = bricks.iter().filter(|id| id.level == level).count();
        (n > 0).then(|| format!("{n} of level {} ({})", level.0, LevelColor::of(level).name))
    };
    let levels: Vec<_> = (0..32).map(Level).filter_map(of_level).collect();
    if levels.is_empty() { "none".to_owned() } else { levels.join(", ") }
}

fn attributes(
    args: &RenderArgs,
    backend: &dyn Backend,
    scene: &Scene,
    plan: &FramePlan,
) -> Vec<(&'static str, String)> {
    let d = backend.describe();
    let boxes = args.show_bricks.map(|boxes| ("overlay", format!("{boxes:?} bricks as boxes").to_lowercase()));
    let mut attributes = vec![
        ("scene", format!("{} {:?}", args.file.display(), scene)),
        ("backend", d.backend.to_owned()),
        ("adapter", format!("{} ({})", d.adapter, d.driver)),
        ("step", format!("{} voxels", scene.step_voxels)),
        ("sampling", sampling(backend, scene, plan)),
    ];
    attributes.extend(boxes);
    attributes
}

/// Where samples lie and how they are integrated, in the words of the options.
fn sampling(backend: &dyn Backend, scene: &Scene, plan: &FramePlan) -> String {
    let technique = match (scene.technique, plan.proxy()) {
        (Technique::Polygons(target), _) if backend.describe().backend == BackendKind::Cpu.name() => {
            format!("rays cast to the samples of polygons {}", target.name())
        }
        (Technique::Polygons(target), Some(proxy)) => format!("{} polygons {}", proxy.n_polygons(), target.name()),
        _ => "rays cast".to_owned(),
    };
    let (division, lengths) = (values::division_text(scene.division), values::lengths_text(scene.lengths));
    let placement = values::placement_text(scene.placement);
    format!("rule {}, placement {placement}, divide {division}, lengths {lengths}, {technique}", scene.rule.name())
}

fn summary(backend: &dyn Backend, scene: &Scene, plan: &FramePlan, frame: &Frame) -> String {
    let d = backend.describe();
    let t = frame.timing;
    let device = t.device_ms.map(|ms| format!(", device {ms:.1} ms")).unwrap_or_default();
    let mib = mib(plan.field().slots().n_bytes() as u64);
    format!(
        "{}: {} ({})\n{}\n{} bricks, {mib:.1} MiB\nupload {:.1} ms, render {:.1} ms{device}, read back {:.1} ms\n",
        d.backend,
        d.adapter,
        d.driver,
        sampling(backend, scene, plan),
        plan.field().slots().n_filled(),
        t.upload_ms,
        t.wall_ms,
        t.read_back_ms
    )
}
