//! Peaks of memory: of the process, and of the device's textures and lists. Each algorithm has a process of its own on each backend.

use std::path::Path;
use std::process::Command;

use brickfield::frame::ShaderChoice;
use brickfield_core::ValueRange;
use serde::{Deserialize, Serialize};

use super::TongArgs;
use super::algorithm::Algorithm;
use super::data::{DataSet, Renderer, files, of_file, small};
use crate::compare::rivals::Rivals;
use crate::memory::{peak, resident, restart_peak};
use crate::paper::{Missed, PaperError, device_bytes, frame_of, mib, print};

/// What an algorithm takes, in bytes.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Taken {
    /// The voxels, and the min-max arrays of all bricks.
    voxels: u64,
    arrays: u64,
    /// The samples of the plan, on the host.
    samples: u64,
    /// The texture of the plan, padding included, and its lists.
    device: u64,
    /// The peak of the process above volume, octree and arrays; `None` where the system does not tell.
    process: Option<u64>,
}

pub(super) fn run(args: &TongArgs, rivals: &Rivals) -> Result<Vec<Missed>, PaperError> {
    print(
        "Samples: those of the plan, on the host. Device: bytes of the plan's texture, padding included, and of its lists. Process: its peak above the volume, its octree and\n\
         its min-max arrays, while a frame is prepared and rendered, each algorithm in a process of its own; software renderers hold the device's memory there.\n",
    )?;
    let backends: Vec<_> = rivals.present.iter().map(|backend| backend.describe().backend).collect();
    for (name, path) in files(args)? {
        for (i, algorithm) in Algorithm::all(args.side).into_iter().enumerate() {
            let taken = backends.iter().map(|backend| Ok((*backend, in_own_process(args, &path, algorithm, backend)?)));
            let taken: Vec<_> = taken.collect::<Result<_, PaperError>>()?;
            let Some((_, first)) = taken.first() else { continue };
            if i == 0 {
                print(&format!(
                    "{name}: voxels {:.1} MiB, min-max arrays {:.2} MiB",
                    mib(first.voxels),
                    mib(first.arrays)
                ))?;
            }
            let process = |(backend, taken): &(&str, Taken)| match taken.process {
                Some(bytes) => format!("{backend} {:.1}", mib(bytes)),
                None => format!("{backend} unknown"),
            };
            print(&format!(
                "  {:<20} samples {:>8.2} MiB, device {:>8.2} MiB, process, MiB: {}",
                algorithm.name(),
                mib(first.samples),
                mib(first.device),
                taken.iter().map(process).collect::<Vec<_>>().join(", ")
            ))?;
        }
    }
    Ok(Vec::new())
}

/// This program once more, for one algorithm on one backend.
fn in_own_process(args: &TongArgs, file: &Path, algorithm: Algorithm, backend: &str) -> Result<Taken, PaperError> {
    let fault = |what: String| PaperError::OwnProcess { what };
    let program = std::env::current_exe().map_err(|e| fault(e.to_string()))?;
    let mut command = Command::new(program);
    command.args(["--paper", "tong", "--part", "memory", "--memory-of", algorithm.name(), "--backends", backend]);
    let size = args.common.size;
    command.args(["--size", &format!("{}x{}", size.x, size.y), "--step", &args.common.step.to_string()]);
    command.args(["--side", &args.side.to_string()]);
    if let Some(adapter) = &args.common.rivals.adapter {
        command.args(["--adapter", adapter]);
    }
    let output = command.arg("--").arg(file).output().map_err(|e| fault(e.to_string()))?;
    let said = || String::from_utf8_lossy(&output.stderr).trim().to_owned();
    match serde_json::from_slice(&output.stdout) {
        Ok(taken) if output.status.success() => Ok(taken),
        _ => Err(fault(format!("{}: {}", output.status, said()))),
    }
}

/// What one algorithm takes on the one backend, as JSON: the process is this one alone.
pub(super) fn print_own(args: &TongArgs, name: &str) -> Result<(), PaperError> {
    let all = Algorithm::all(args.side);
    let algorithm = all.into_iter().find(|algorithm| algorithm.name() == name);
    let algorithm = algorithm.ok_or_else(|| PaperError::OwnProcess { what: format!("no algorithm {name:?}") })?;
    let mut rivals = args.common.rivals.open()?;
    let backend = rivals.present[0].as_mut();
    let files = files(args)?;
    let [(name, path)] = files.as_slice() else {
        return Err(PaperError::OwnProcess { what: format!("{} files; one is measured at a time", files.len()) });
    };
    let data = of_file(args.side, name.clone(), path)?;
    // A renderer compiles its shaders in its first frame: the general one is the same for a small volume of the same type.
    backend.choose_shaders(ShaderChoice::General);
    let scene = |data: &DataSet| data.scene(args, Renderer::Rays, data.subject.transfer.clone());
    let warm_up = small(args, data.subject.volume.scalar_type())?;
    frame_of(backend, &algorithm.plan(&warm_up, &scene(&warm_up)?)?)?;
    drop(warm_up);
    let scene = scene(&data)?;
    restart_peak();
    let before = resident();
    let plan = algorithm.plan(&data, &scene)?;
    frame_of(backend, &plan)?;
    let process = peak().zip(before).map(|(peak, before)| peak.saturating_sub(before));
    let n_slices = data.trimmed.arrays().arrays().iter().map(|of_brick| u64::from(of_brick.n_slices().element_sum()));
    let volume = &data.subject.volume;
    let taken = Taken {
        voxels: (volume.voxels().len() * volume.scalar_type().n_bytes()) as u64,
        arrays: n_slices.sum::<u64>() * size_of::<ValueRange>() as u64,
        samples: plan.field().slots().n_bytes() as u64,
        device: device_bytes(&plan),
        process,
    };
    print(&serde_json::to_string(&taken).expect("plain numbers"))
}
