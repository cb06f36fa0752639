//! Peaks of memory: of the process, and of the device's textures and lists.

use super::TongArgs;
use super::algorithm::Algorithm;
use super::data::{Renderer, data_sets};
use crate::compare::rivals::Rivals;
use crate::memory::{peak, resident, restart_peak};
use crate::paper::{Missed, PaperError, device_bytes, frame_of, mib, print};

pub(super) fn run(args: &TongArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    print(
        "Samples: those of the plan, on the host. Device: bytes of the plan's texture, padding included, and of its lists. Process: its peak above the volume, its octree and\n\
         its min-max arrays, while a frame is prepared and rendered; software renderers hold the device's memory there, and what an algorithm before it left may be in use again.\n",
    )?;
    for data_set in data_sets(args)? {
        let data_set = data_set?;
        let arrays: usize = data_set
            .trimmed
            .arrays()
            .arrays()
            .iter()
            .map(|of_brick| of_brick.n_slices().element_sum() as usize * size_of::<brickfield_core::ValueRange>())
            .sum();
        print(&format!(
            "{}: voxels {:.1} MiB, min-max arrays {:.2} MiB",
            data_set.subject.name,
            mib((data_set.subject.volume.voxels().len() * data_set.subject.volume.scalar_type().n_bytes()) as u64),
            mib(arrays as u64)
        ))?;
        let scene = data_set.scene(args, Renderer::Rays, data_set.subject.transfer.clone())?;
        for algorithm in Algorithm::all(args.side) {
            let mut of_backends = Vec::new();
            let mut of_plan = (0, 0);
            for backend in &mut rivals.present {
                restart_peak();
                let before = resident();
                let plan = algorithm.plan(&data_set, &scene)?;
                frame_of(backend.as_mut(), &plan)?;
                of_plan = (plan.field().slots().n_bytes() as u64, device_bytes(&plan));
                let name = backend.describe().backend;
                of_backends.push(match (peak(), before) {
                    (Some(peak), Some(before)) => format!("{name} {:.1}", mib(peak.saturating_sub(before))),
                    _ => format!("{name} unknown"),
                });
            }
            print(&format!(
                "  {:<20} samples {:>8.2} MiB, device {:>8.2} MiB, process, MiB: {}",
                algorithm.name(),
                mib(of_plan.0),
                mib(of_plan.1),
                of_backends.join(", ")
            ))?;
        }
    }
    Ok(Vec::new())
}
