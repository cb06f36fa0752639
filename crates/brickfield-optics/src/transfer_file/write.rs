//! Writing transfer functions.

use std::ffi::OsString;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};

use brickfield_core::{Knot, TransferFunction};

use super::TransferFormat;

/// Why a transfer function could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum WriteTransferError {
    #[error("cannot tell the format of {}: its extension must be .json or .toml", path.display())]
    Extension { path: PathBuf },
    #[error("cannot write the transfer function {}: {source}", path.display())]
    Write { path: PathBuf, source: io::Error },
}

impl TransferFormat {
    /// A transfer function as text, extinction per world unit and linear colour, one knot a line; reading it gives the
    /// same numbers.
    pub fn text(self, transfer: &TransferFunction) -> String {
        let (open, join, close) = match self {
            TransferFormat::Json => ("{\n  \"knots\": [\n", ",\n", "\n  ]\n}\n"),
            TransferFormat::Toml => ("knots = [\n", ",\n", ",\n]\n"),
        };
        let lines: Vec<String> = transfer.knots().iter().map(|k| self.line(k)).collect();
        [open, &lines.join(join), close].concat()
    }

    fn line(self, k: &Knot) -> String {
        let [r, g, b] = k.color;
        let (value, extinction) = (k.value, k.extinction);
        match self {
            TransferFormat::Json => format!(
                "    {{ \"value\": {value:?}, \"extinction\": {extinction:?}, \"color\": [{r:?}, {g:?}, {b:?}] }}"
            ),
            TransferFormat::Toml => {
                format!("  {{ value = {value:?}, extinction = {extinction:?}, color = [{r:?}, {g:?}, {b:?}] }}")
            }
        }
    }
}

/// Writes a transfer function to a `.json` or `.toml` file.
///
/// The file appears whole or not at all: the text goes to a file beside it, which is then renamed.
///
/// # Errors
/// Another extension, or the file cannot be written.
pub fn write_transfer(path: &Path, transfer: &TransferFunction) -> Result<(), WriteTransferError> {
    let format =
        TransferFormat::of_path(path).ok_or_else(|| WriteTransferError::Extension { path: path.to_path_buf() })?;
    let beside = path.with_file_name(name_beside(path));
    let written = write_new(&beside, &format.text(transfer)).and_then(|()| fs::rename(&beside, path));
    written.map_err(|source| {
        let _ = fs::remove_file(&beside);
        WriteTransferError::Write { path: path.to_path_buf(), source }
    })
}

fn name_beside(path: &Path) -> OsString {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}-{}.part", process::id(), COUNT.fetch_add(1, Ordering::Relaxed)));
    name
}

fn write_new(path: &Path, text: &str) -> io::Result<()> {
    let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()
}
