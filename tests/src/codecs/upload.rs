//! Packed bricks, which the device unpacks, next to plain ones.

use std::time::Instant;

use brickfield::bricks::{BrickTree, BuildOptions, build_tree};
use brickfield::frame::{Backend, FramePlan, Upload};
use brickfield::{BackendKind, Residency, Scene, Skipping, prepare};
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{BrickSide, Camera, Image};
use serde::Serialize;

use super::CodecsArgs;
use crate::compare::rivals::Rivals;
use crate::metrics::{greatest_difference, median};
use crate::paper::{Missed, PaperError, Subject, frame_of, mib, print, write_rows};
use crate::turns::{Bound, Claim, Ratio, take_turns};

/// The volumes, as paths below the folder of real ones.
const DATA: [&str; 4] = ["ct/LIDC2.mha", "ct/tooth.nhdr", "mri/spm152.nii.gz", "ct/engine.vti"];
const WAYS: [Upload; 2] = [Upload::Plain, Upload::Packed { max_error: 0 }];

/// A volume on a backend; of pairs, plain bricks come first.
#[derive(Clone, Debug, Serialize)]
struct UploadRow {
    data: String,
    scalar: String,
    brick: u32,
    backend: &'static str,
    /// Bytes of samples as the device is brought them; those of all that the first frame brings.
    sample_bytes: [u64; 2],
    uploaded_bytes: [u64; 2],
    /// From the scene to the plan, packing included.
    prepare_ms: [f64; 2],
    /// Bringing all bricks, unpacking included: medians; packed over plain.
    upload_ms: [f64; 2],
    ratio: Ratio,
    /// The greatest difference of a channel between both pictures.
    difference: f64,
}

pub(super) fn run(args: &CodecsArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    print(&format!(
        "All bricks of level 0, lossless. Bytes: of samples as they are brought, plain and packed. Prepare: from the scene to the plan, packing included, once. Upload: until all\n\
         bricks are in the atlas, unpacking included, medians of {} rounds in which both took turns; its ratio is packed over plain.\n",
        args.frames
    ))?;
    let (mut rows, mut missed) = (Vec::new(), Vec::new());
    for (name, path) in args.volumes(&DATA)? {
        let subject = Subject::of_file(name, &path)?;
        for side in [BrickSide::S32, BrickSide::S64] {
            let tree = build_tree(&subject.volume, &BuildOptions { side, ..BuildOptions::default() })?;
            for backend in rivals.present.iter_mut() {
                // The cpu is brought nothing.
                if backend.describe().backend == BackendKind::Cpu.name() {
                    continue;
                }
                let row = of_volume(args, &subject, &tree, backend.as_mut())?;
                print(&line(&row))?;
                missed.extend(claims(&row).into_iter().filter(|claim| !claim.kept).map(|claim| {
                    Missed::of_pictures(format!("{}, bricks of {}, {}: {claim}", row.data, row.brick, row.backend))
                }));
                rows.push(row);
            }
        }
    }
    write_rows(&args.out.join("upload.json"), &rows)?;
    Ok(missed)
}

fn of_volume(
    args: &CodecsArgs,
    subject: &Subject,
    tree: &BrickTree,
    backend: &mut dyn Backend,
) -> Result<UploadRow, PaperError> {
    let mut prepared = Vec::new();
    for upload in WAYS {
        let scene = scene(subject, upload)?;
        let begin = Instant::now();
        let plan = prepare(tree, &scene, &mut Residency::default())?;
        prepared.push((plan, begin.elapsed().as_secs_f64() * 1e3));
    }
    let (mut uploaded_bytes, mut pictures): ([u64; 2], [Option<Image<f32>>; 2]) = ([0; 2], [None, None]);
    let ms = take_turns::<PaperError>(2, args.frames, |turn| {
        let (plan, _) = &prepared[turn.contestant];
        // Whoever has the turn twice in a row finds its bricks there: the other's take their place first.
        if turn.again {
            frame_of(backend, &prepared[1 - turn.contestant].0)?;
        }
        let frame = frame_of(backend, plan)?;
        uploaded_bytes[turn.contestant] = frame.uploaded_bytes;
        pictures[turn.contestant] = Some(frame.image);
        Ok(frame.timing.upload_ms)
    })?;
    let [plain, packed] = pictures.map(|picture| picture.expect("both had their turns"));
    Ok(UploadRow {
        data: subject.name.clone(),
        scalar: subject.volume.scalar_type().to_string(),
        brick: tree.layout().side().n_samples(),
        backend: backend.describe().backend,
        sample_bytes: [0, 1].map(|i| sample_bytes(&prepared[i].0)),
        uploaded_bytes,
        prepare_ms: [0, 1].map(|i| prepared[i].1),
        upload_ms: [0, 1].map(|i| median(ms[i].clone())),
        ratio: Ratio::of(&ms[1], &ms[0]),
        difference: greatest_difference(&plain, &packed),
    })
}

/// A small picture in which every brick is brought.
fn scene(subject: &Subject, upload: Upload) -> Result<Scene, PaperError> {
    let camera = Camera::framing(&subject.volume.grid().world_box(), DVec3::new(0.6, -1.0, 0.35), DVec3::Z)?;
    let scene = Scene::new(camera, UVec2::new(64, 48), subject.transfer.clone());
    Ok(Scene { step_voxels: 4.0, skipping: Skipping::Off, upload, ..scene })
}

fn sample_bytes(plan: &FramePlan) -> u64 {
    let chunks = plan.field().slots().all_samples().iter().flatten();
    chunks.map(|chunk| chunk.packed().map_or(chunk.bytes().len(), |packed| packed.n_bytes()) as u64).sum()
}

fn claims(row: &UploadRow) -> [Claim; 3] {
    let [plain, packed] = row.sample_bytes;
    let [all_plain, all_packed] = row.uploaded_bytes;
    let saved = all_plain as f64 - all_packed as f64;
    [
        Claim::of("the greatest difference between both pictures", row.difference, Bound::AtMost(0.0)),
        Claim::of("plain bytes over packed ones", plain as f64 / packed as f64, Bound::Above(1.0)),
        Claim::of(
            "bytes that a frame saves over those of its samples",
            saved / (plain - packed) as f64,
            Bound::AtLeast(1.0),
        ),
    ]
}

fn line(row: &UploadRow) -> String {
    let [plain, packed] = row.sample_bytes;
    format!(
        "{} ({}), bricks of {}, {}: {:.2} MiB -> {:.2} MiB ({:.2}:1); prepare {:.0} -> {:.0} ms; upload {:.1} -> {:.1} ms, {}; {}",
        row.data,
        row.scalar,
        row.brick,
        row.backend,
        mib(plain),
        mib(packed),
        plain as f64 / packed as f64,
        row.prepare_ms[0],
        row.prepare_ms[1],
        row.upload_ms[0],
        row.upload_ms[1],
        row.ratio,
        if row.difference == 0.0 {
            "equal pictures".to_owned()
        } else {
            format!("pictures differ by {:.1e}", row.difference)
        },
    )
}
