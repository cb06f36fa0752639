//! Writing files whole or not at all.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use brickfield_core::{Voxels, with_voxels};

use crate::ByteOrder;

/// A file that could not be written. An earlier file of its name is unchanged.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot write: {source}", path.display())]
#[allow(missing_docs)]
pub struct SaveError {
    pub path: PathBuf,
    pub source: io::Error,
}

/// Writes to a temporary file in the same folder, and renames it into place when it is complete and on disk.
pub(crate) fn save_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut tempfile::NamedTempFile>) -> io::Result<()>,
) -> Result<(), SaveError> {
    save_renaming(path, write).map_err(|source| SaveError { path: path.to_owned(), source })
}

fn save_renaming(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut tempfile::NamedTempFile>) -> io::Result<()>,
) -> io::Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".brickfield-");
    // The mode of an ordinary file (before the umask), not the private mode of temporary files.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder)?;
    let mut out = BufWriter::with_capacity(1 << 16, &mut file);
    write(&mut out)?;
    out.flush()?;
    drop(out);
    file.as_file().sync_all()?;
    file.persist(path).map(|_| ()).map_err(|e| e.error)
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
