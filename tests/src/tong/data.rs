//! The volumes that are rendered, and their scenes.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use brickfield::bricks::{BrickTree, BuildOptions, build_tree};
use brickfield::frame::{Division, Mode, Placement, Target};
use brickfield::trim::DarkValues;
use brickfield::{Scene, Technique, TrimmedVolume, Viewpoint};
use brickfield_core::{BrickSide, Scalar, ScalarType, TransferFunction, ValueRange, with_voxels};
use rayon::prelude::*;

use super::TongArgs;
use crate::paper::{PaperError, Subject};

/// The data sets, as paths below the folder of real volumes.
const DATA: [&str; 6] =
    ["ct/engine.vti", "ct/aneurism.vti", "ct/LIDC2.mha", "ct/tooth.nhdr", "ct/frogtissue.mhd", "mri/spm152.nii.gz"];

/// A volume in bricks, with its transfer function.
pub(super) struct DataSet {
    pub(super) subject: Subject,
    pub(super) trimmed: TrimmedVolume,
    pub(super) tree: BrickTree,
}

/// Whether the data that the parts need are there.
pub(super) fn check_data(args: &TongArgs) -> Result<(), PaperError> {
    args.common.check_data(&DATA, args.parts().into_iter().any(|part| part.needs_data()))
}

/// The volumes that are asked for, one by one.
pub(super) fn data_sets(args: &TongArgs) -> Result<impl Iterator<Item = Result<DataSet, PaperError>>, PaperError> {
    let side = args.side;
    Ok(files(args)?.into_iter().map(move |(name, path)| of_file(side, name, &path)))
}

/// The names of the volumes that are asked for, and their paths.
pub(super) fn files(args: &TongArgs) -> Result<Vec<(String, PathBuf)>, PaperError> {
    args.common.named(&DATA)
}

/// A volume of a file.
pub(super) fn of_file(side: BrickSide, name: String, path: &Path) -> Result<DataSet, PaperError> {
    of_subject(side, Subject::of_file(name, path)?)
}

/// A small generated volume of a type.
pub(super) fn small(args: &TongArgs, scalar: ScalarType) -> Result<DataSet, PaperError> {
    of_subject(args.side, Subject::of_phantom(2 * args.side.n_samples(), scalar))
}

/// The volumes of the part `batches`: one of the data sets and a generated one, or those that are asked for.
pub(super) fn data_sets_of_batches(
    args: &TongArgs,
) -> Result<impl Iterator<Item = Result<DataSet, PaperError>>, PaperError> {
    let is_own = args.common.files.is_empty() && args.common.only.is_none();
    let (side, volume_side) = (args.side, args.volume_side);
    let named = args.common.named(if is_own { &DATA[DATA.len() - 1..] } else { &DATA })?;
    let of_file = move |(name, path): (String, PathBuf)| of_file(side, name, &path);
    let generated = is_own
        .then_some(())
        .into_iter()
        .map(move |()| of_subject(side, Subject::of_phantom(volume_side, ScalarType::U8)));
    Ok(named.into_iter().map(of_file).chain(generated))
}

fn of_subject(side: BrickSide, subject: Subject) -> Result<DataSet, PaperError> {
    let tree = build_tree(&subject.volume, &BuildOptions { side, ..BuildOptions::default() })?;
    Ok(DataSet { trimmed: TrimmedVolume::new(Arc::clone(&subject.volume), side), tree, subject })
}

/// How samples are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Renderer {
    Rays,
    Slices,
}

impl Renderer {
    pub(super) const ALL: [Renderer; 2] = [Renderer::Rays, Renderer::Slices];

    pub(super) const fn name(self) -> &'static str {
        match self {
            Renderer::Rays => "rays",
            Renderer::Slices => "slices",
        }
    }
}

impl DataSet {
    /// The whole volume, obliquely, under a transfer function.
    pub(super) fn scene(
        &self,
        args: &TongArgs,
        renderer: Renderer,
        transfer: TransferFunction,
    ) -> Result<Scene, PaperError> {
        let camera = Viewpoint::default().camera(self.subject.volume.grid(), self.subject.frame, args.common.size)?;
        let scene = Scene::new(camera, args.common.size, transfer);
        let scene = Scene { step_voxels: args.common.step, mode: Mode::Exact, ..scene };
        Ok(match renderer {
            Renderer::Rays => scene,
            // The paper's parallel polygons.
            Renderer::Slices => Scene {
                technique: Technique::Polygons(Target::Float32),
                placement: Placement::ViewportPlanes,
                division: Division::Brick,
                ..scene
            },
        })
    }

    /// The share of voxels that a transfer function makes invisible.
    pub(super) fn empty_share(&self, transfer: &TransferFunction) -> f64 {
        let (dark, rescale) = (DarkValues::of(transfer), self.subject.volume.rescale());
        let is_dark = |value: f64| dark.covers(ValueRange { min: value, max: value });
        let n_dark = with_voxels!(self.subject.volume.voxels(), voxels => {
            voxels.par_iter().filter(|voxel| is_dark(rescale.value(voxel.to_f64()))).count()
        });
        n_dark as f64 / self.subject.volume.voxels().len() as f64
    }
}
