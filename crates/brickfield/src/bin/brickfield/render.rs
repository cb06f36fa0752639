//! `brickfield render`.

use brickfield::frame::{Backend, Frame, FramePlan};
use brickfield::options::Subject;
use brickfield::{BackendError, Residency, Scene, check_picture_path, open_backend, prepare, write_picture};

use crate::{Failure, RenderArgs, print};

pub(crate) fn run(args: &RenderArgs) -> Result<(), Failure> {
    // What can be refused is refused before any work is done.
    check_picture_path(&args.out).map_err(Failure::usage)?;
    let mut backend = open(args)?;
    let subject = Subject::open(&args.file, &args.input, &args.tree, &args.view)?;
    let scene = args.sampling.of(args.view.scene(&subject)?);
    let plan = prepare(&subject.tree, &scene, &mut Residency::default()).map_err(Failure::usage)?;
    if plan.visible.is_empty() {
        eprintln!(
            "note: nothing is visible: the transfer function is 0 over all values inside the clip box and the view"
        );
    }
    let frame = backend.render(&plan)?;
    let attributes = attributes(args, backend.as_ref(), &scene);
    write_picture(&args.out, &frame.image, args.view.background.0, &attributes)?;
    print(&summary(backend.as_ref(), &plan, &frame))?;
    check_validation(&backend.validation_messages())
}

fn check_validation(messages: &[String]) -> Result<(), Failure> {
    messages.iter().for_each(|m| eprintln!("validation: {m}"));
    if messages.is_empty() { Ok(()) } else { Err(Failure::Validation { n_messages: messages.len() }) }
}

/// The first candidate that opens; the last one's error if none does.
fn open(args: &RenderArgs) -> Result<Box<dyn Backend>, Failure> {
    let mut last: Option<BackendError> = None;
    for kind in args.candidates()? {
        match open_backend(kind, args.adapter.as_deref(), args.validation()) {
            Ok(backend) => return Ok(backend),
            Err(e) => last = Some(e),
        }
    }
    Err(Failure::Backend(last.expect("at least one candidate")))
}

fn attributes(args: &RenderArgs, backend: &dyn Backend, scene: &Scene) -> Vec<(&'static str, String)> {
    let d = backend.describe();
    vec![
        ("scene", format!("{} {:?}", args.file.display(), scene)),
        ("backend", d.backend.to_owned()),
        ("adapter", format!("{} ({})", d.adapter, d.driver)),
        ("step", format!("{} voxels", scene.step_voxels)),
    ]
}

fn summary(backend: &dyn Backend, plan: &FramePlan, frame: &Frame) -> String {
    let d = backend.describe();
    let t = frame.timing;
    let device = t.device_ms.map(|ms| format!(", device {ms:.1} ms")).unwrap_or_default();
    let mib = plan.bricks.bytes().len() as f64 / f64::from(1 << 20);
    format!(
        "{}: {} ({})\n{} bricks, {mib:.1} MiB\nupload {:.1} ms, render {:.1} ms{device}, read back {:.1} ms\n",
        d.backend,
        d.adapter,
        d.driver,
        plan.bricks.n_bricks(),
        t.upload_ms,
        t.wall_ms,
        t.read_back_ms
    )
}
