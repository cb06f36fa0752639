//! What every format does when it saves: options, errors, values, and a file that is whole or not there.

use std::borrow::Cow;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use brickfield_core::glam::UVec3;
use brickfield_core::{Level, Rescale, ScalarType, Volume, Voxels, with_voxels};

use crate::{ByteOrder, Format, WorldFrame};

/// The statements that are saved beside a volume, and how its samples are compressed.
///
/// ```
/// use brickfield_io::{Compression, SaveOptions};
/// let mut options = SaveOptions::default();
/// options.compression = Compression::Lossless;
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct SaveOptions {
    /// What the axes of the world mean.
    pub frame: WorldFrame,
    /// The unit of world lengths: "mm", "micrometer".
    pub unit: Option<String>,
    /// How samples are compressed.
    pub compression: Compression,
}

/// How samples are compressed, in whatever way the format has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// As they are.
    #[default]
    None,
    /// Without loss: gzip (NRRD), zlib (MetaImage), zstd (OME-Zarr). Of NIfTI the end of the name decides, `.nii` or `.nii.gz`.
    Lossless,
}

/// Why a volume was not saved. An earlier file of its name is unchanged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum SaveError {
    #[error("{}: cannot write: {source}", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error("{}: the end of the name is none of {SAVED_EXTENSIONS}", path.display())]
    UnknownExtension { path: PathBuf },
    #[error("{}: there is no folder {}", path.display(), folder.display())]
    NoFolder { path: PathBuf, folder: PathBuf },
    #[error("{}: it is a folder", path.display())]
    IsFolder { path: PathBuf },
    #[error("{}: there is one already, and a folder is not replaced; remove it, or take another name", path.display())]
    IsThere { path: PathBuf },
    #[error("{}: {format} {fault}", path.display())]
    Unsupported { path: PathBuf, format: Format, fault: String },
    /// Slices that are none of a level; there is nothing at the path.
    #[error("{}: {n_samples} samples of {found} after {n_slices} slices of level {}, which has {} slices of {} x {} samples of {expected}", path.display(), level.0, dims.z, dims.x, dims.y)]
    Slices {
        path: PathBuf,
        level: Level,
        dims: UVec3,
        n_slices: u32,
        n_samples: usize,
        found: ScalarType,
        expected: ScalarType,
    },
    /// Not all slices came; there is nothing at the path.
    #[error("{}: {n_slices} of {n_expected} slices of {what} were handed over; nothing is saved", path.display())]
    Incomplete { path: PathBuf, what: String, n_slices: u32, n_expected: u32 },
}

/// The ends of names that [`save`](crate::save()) knows, for messages and help texts.
pub const SAVED_EXTENSIONS: &str = ".nrrd, .mha, .nii, .nii.gz, .zarr, .vol and .raw";

/// The values of a volume's voxels: as they are stored if they stand for themselves, else f32 if that holds all of them
/// exactly, else f64.
pub(crate) fn values(volume: &Volume) -> Cow<'_, Voxels> {
    let rescale = volume.rescale();
    if rescale == Rescale::IDENTITY {
        return Cow::Borrowed(volume.voxels());
    }
    let n = volume.voxels().len();
    let is_f32 = |i: usize| f64::from(volume.value(i) as f32) == volume.value(i);
    Cow::Owned(match (0..n).all(is_f32) {
        true => Voxels::F32((0..n).map(|i| volume.value(i) as f32).collect()),
        false => Voxels::F64((0..n).map(|i| volume.value(i)).collect()),
    })
}

/// Writes to a temporary file in the same folder, and renames it into place when it is complete and on disk.
pub(crate) fn save_atomically<T>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut tempfile::NamedTempFile>) -> io::Result<T>,
) -> Result<T, SaveError> {
    save_renaming(path, write).map_err(|source| SaveError::Io { path: path.to_owned(), source })
}

/// The folder that a file lies in.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Whether a file can be made in the folder that this one lies in.
pub(crate) fn check_folder_of(path: &Path) -> Result<(), SaveError> {
    let draft = tempfile::Builder::new().prefix(UNFINISHED).tempfile_in(folder_of(path));
    draft.map(drop).map_err(|source| SaveError::Io { path: path.to_owned(), source })
}

/// How the names of unfinished files and folders begin.
pub(crate) const UNFINISHED: &str = ".brickfield-";

fn save_renaming<T>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut tempfile::NamedTempFile>) -> io::Result<T>,
) -> io::Result<T> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED);
    // The mode of an ordinary file (before the umask), not the private mode of temporary files.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder_of(path))?;
    let mut out = BufWriter::with_capacity(1 << 16, &mut file);
    let saved = write(&mut out)?;
    out.flush()?;
    drop(out);
    file.as_file().sync_all()?;
    file.persist(path).map(|_| saved).map_err(|e| e.error)
}

/// Writes all voxels, x fastest.
pub(crate) fn write_samples(out: &mut dyn Write, voxels: &Voxels, order: ByteOrder) -> io::Result<()> {
    macro_rules! write_all {
        ($values:expr) => {
            for value in $values {
                out.write_all(&match order {
                    ByteOrder::Little => value.to_le_bytes(),
                    ByteOrder::Big => value.to_be_bytes(),
                })?;
            }
        };
    }
    with_voxels!(voxels, v => write_all!(v));
    Ok(())
}
