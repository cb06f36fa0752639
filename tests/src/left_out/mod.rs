//! What a scene's shader leaves out, and what that saves: the specialised shader next to the general one, which has everything that the
//! scene's data allow.

mod edits;
mod scenes;

use std::path::PathBuf;

use brickfield::frame::{Backend, FramePlan, ShaderChoice};
use brickfield::open_backend;
use brickfield::options::values;
use brickfield::{BackendKind, Validation};
use brickfield_core::Image;
use brickfield_core::glam::UVec2;
use brickfield_shaders::{PipelineKey, ShaderLibrary, Variant};
use clap::Parser;
use serde::Serialize;

use crate::compare::rivals::RivalArgs;
use crate::metrics::{greatest_difference, median};
use crate::paper::{PaperError, device_bytes, frame_of, mib, print, write_rows};
use crate::turns::{Ratio, take_turns};
use edits::{EditsRow, edits};
use scenes::{edited, scenes};

/// The shader of each of a dozen scenes next to the general one: code, bindings, bytes, pipelines, time; equal pictures
///
/// Exit status: 0 done, 1 failed, 2 unusable arguments, 3 a required backend is absent, 4 pictures differ.
#[derive(Parser, Clone, Debug)]
#[command(name = "compare --left-out")]
pub struct LeftOutArgs {
    /// Compare what shaders leave out
    #[arg(long, required = true)]
    pub left_out: bool,
    /// Size of the pictures in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "128x128")]
    pub size: UVec2,
    /// Only scenes whose name contains this
    #[arg(long, value_name = "TEXT")]
    pub only: Option<String>,
    /// Rounds in which the two shaders take turns. Fewer than 6 give no interval of 95 %
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: u32,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub rivals: RivalArgs,
    /// Folder that receives the table as JSON
    #[arg(long, value_name = "DIR", default_value = "target/left-out")]
    pub out: PathBuf,
}

/// A scene on a backend.
#[derive(Clone, Debug, Serialize)]
struct LeftOutRow {
    scene: &'static str,
    backend: &'static str,
    specialised: Code,
    general: Code,
    /// Samples, padding and lists that the plan brings to a device.
    device_bytes: u64,
    /// Segments in the domain, and those with something to see.
    n_samples: u64,
    n_visible_samples: u64,
    /// The first frame over the others' median, the samples being there: compilation and the pipeline, in milliseconds.
    pipeline_ms: [f64; 2],
    /// Medians of frames, specialised and general, and the ratio of the first to the second.
    ms: [f64; 2],
    ratio: Ratio,
    /// Whether both pictures are equal to the bit; the greatest difference of a channel.
    is_equal: bool,
    difference: f64,
}

/// What is left of a shader.
#[derive(Clone, Debug, Serialize)]
struct Code {
    bindings: Vec<&'static str>,
    n_functions: usize,
    spirv_bytes: usize,
}

const CHOICES: [ShaderChoice; 2] = [ShaderChoice::Own, ShaderChoice::General];
/// Pictures of two shaders may differ by this much where a compiler contracts their sums in other ways.
const ROUNDING: f64 = 1e-6;

/// Runs the scenes, prints a line for each, and returns the complaints about pictures.
///
/// # Errors
/// A folder that cannot be written, a scene that is refused, a backend that fails.
pub fn left_out(args: &LeftOutArgs) -> Result<Vec<String>, PaperError> {
    std::fs::create_dir_all(&args.out).map_err(|source| PaperError::Out { path: args.out.clone(), source })?;
    let mut rivals = args.rivals.open()?;
    print(&format!(
        "{} x {} pixels, exact. Specialised / general: the shader of the scene, and one that draws other transfer functions, levels and empty blocks of its data. Pipeline: the first\n\
         frame over the others, the samples being there. Ratio: specialised over general, median of {} rounds in which both took turns.\n",
        args.size.x, args.size.y, args.frames
    ))?;
    let library = ShaderLibrary::embedded();
    let (mut rows, mut complaints) = (Vec::new(), Vec::new());
    for scene in scenes(args.size)? {
        if args.only.as_ref().is_some_and(|text| !scene.name.contains(text.as_str())) {
            continue;
        }
        let sum = brickfield::cpu::discrete(&scene.complete);
        let n_samples = (sum.n_samples, sum.n_visible_samples);
        // Shaders are those of GPU backends.
        for backend in rivals.present.iter_mut().filter(|backend| backend.describe().backend != BackendKind::Cpu.name())
        {
            let row = of_scene(args, backend.as_mut(), &library, (scene.name, n_samples), &scene.plan)?;
            print(&line(&row))?;
            // NaN is a difference, too.
            let is_alike = row.difference <= ROUNDING;
            if !is_alike {
                complaints.push(format!("{}, {}: a channel differs by {:.1e}", row.scene, row.backend, row.difference));
            }
            rows.push(row);
        }
    }
    write_rows(&args.out.join("left-out.json"), &rows)?;
    if args.only.as_ref().is_none_or(|text| "edits".contains(text.as_str())) {
        let names = rivals.present.iter().map(|backend| backend.describe().backend);
        let names: Vec<_> = names.filter(|name| *name != BackendKind::Cpu.name()).collect();
        let rows = edits(args, &names, &edited(args.size)?)?;
        complaints.extend(rows.iter().filter_map(EditsRow::complaint));
        write_rows(&args.out.join("edits.json"), &rows)?;
    }
    Ok(complaints)
}

fn of_scene(
    args: &LeftOutArgs,
    backend: &mut dyn Backend,
    library: &ShaderLibrary,
    (scene, (n_samples, n_visible_samples)): (&'static str, (u64, u64)),
    plan: &FramePlan,
) -> Result<LeftOutRow, PaperError> {
    let mut pictures: [Option<Image<f32>>; 2] = [None, None];
    let ms = take_turns::<PaperError>(2, args.frames, |turn| {
        let begin = std::time::Instant::now();
        backend.choose_shaders(CHOICES[turn.contestant]);
        let frame = frame_of(backend, plan)?;
        pictures[turn.contestant] = Some(frame.image);
        Ok(begin.elapsed().as_secs_f64() * 1e3)
    })?;
    let [own, general] = pictures.map(|picture| picture.expect("both had their turns"));
    let medians = [median(ms[0].clone()), median(ms[1].clone())];
    let name = backend.describe().backend;
    let [own_choice, general_choice] = CHOICES;
    let first = [
        first_frame(args, name, plan, [general_choice, own_choice])?,
        first_frame(args, name, plan, [own_choice, general_choice])?,
    ];
    let key = PipelineKey::of(plan);
    let code = |variant: &Variant| -> Result<Code, PaperError> {
        let shader = library.specialise(variant)?;
        Ok(Code {
            bindings: shader.bindings.iter().map(|binding| binding.resource.name()).collect(),
            n_functions: shader.counts.functions,
            spirv_bytes: 4 * shader.spirv()?.len(),
        })
    };
    Ok(LeftOutRow {
        scene,
        backend: name,
        specialised: code(&key.variant)?,
        general: code(&key.general().variant)?,
        device_bytes: device_bytes(plan),
        n_samples,
        n_visible_samples,
        pipeline_ms: [0, 1].map(|i| (first[i] - medians[i]).max(0.0)),
        ms: medians,
        ratio: Ratio::of(&ms[0], &ms[1]),
        is_equal: own == general,
        difference: greatest_difference(&own, &general),
    })
}

/// Milliseconds of the first frame with the second choice, on a backend that has rendered with the first one alone.
fn first_frame(
    args: &LeftOutArgs,
    name: &str,
    plan: &FramePlan,
    [before, choice]: [ShaderChoice; 2],
) -> Result<f64, PaperError> {
    let mut backend = open(args, name)?;
    backend.choose_shaders(before);
    frame_of(backend.as_mut(), plan)?;
    backend.choose_shaders(choice);
    let begin = std::time::Instant::now();
    frame_of(backend.as_mut(), plan)?;
    Ok(begin.elapsed().as_secs_f64() * 1e3)
}

/// A backend by its own name, as if nothing had been drawn yet.
fn open(args: &LeftOutArgs, name: &str) -> Result<Box<dyn Backend>, PaperError> {
    let kind: BackendKind = name.parse().expect("a backend's own name");
    open_backend(kind, args.rivals.adapter.as_deref(), Validation::Off).map_err(|source| PaperError::Reopen { source })
}

fn line(row: &LeftOutRow) -> String {
    let LeftOutRow { specialised: own, general, pipeline_ms, ms, .. } = row;
    let picture = match row.is_equal {
        true => "equal to the bit".to_owned(),
        false => format!("differs by {:.1e}", row.difference),
    };
    format!(
        "{:<28} {:<5} bindings {:>2} / {:<2} functions {:>2} / {:<2} SPIR-V {:>6} / {:<6} device {:>6.2} MiB, samples {:>8} ({:>7} visible), pipeline {:>5.1} / {:<5.1} ms, frame {:>6.1} / {:<6.1} ms, ratio {}; {picture}",
        row.scene,
        row.backend,
        own.bindings.len(),
        general.bindings.len(),
        own.n_functions,
        general.n_functions,
        own.spirv_bytes,
        general.spirv_bytes,
        mib(row.device_bytes),
        row.n_samples,
        row.n_visible_samples,
        pipeline_ms[0],
        pipeline_ms[1],
        ms[0],
        ms[1],
        row.ratio
    )
}
