//! Standard codecs of pictures, by a Python with numpy and imagecodecs, if there is one.

use std::io::Write;
use std::process::Command;

use brickfield_core::{ScalarType, Volume, with_voxels};
use serde::Deserialize;

use crate::paper::PaperError;

/// The variable that names a Python; `python3` unless it is set.
const PYTHON: &str = "BRICKFIELD_PYTHON";
const SCRIPT: &str = include_str!("peers.py");

/// What a codec makes of the slices of a volume, on one core.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct PeerSlices {
    /// Its name.
    #[serde(skip)]
    pub(crate) codec: String,
    /// Bytes of each slice.
    pub(crate) n_bytes: Vec<u64>,
    pub(crate) encode_mb_s: f64,
    pub(crate) decode_mb_s: f64,
}

/// Every codec that there is; none if there is no such Python, or if the samples are no integers of 8 or 16 bits.
pub(crate) fn peers(volume: &Volume, wanted: &[&str]) -> Result<Vec<PeerSlices>, PaperError> {
    let kind = match volume.scalar_type() {
        ScalarType::U8 => "<u1",
        ScalarType::I8 => "<i1",
        ScalarType::U16 => "<u2",
        ScalarType::I16 => "<i2",
        _ => return Ok(Vec::new()),
    };
    let out = |source| PaperError::Out { path: std::env::temp_dir(), source };
    let mut file = tempfile::NamedTempFile::new().map_err(out)?;
    let bytes: Vec<u8> = with_voxels!(volume.voxels(), v => v.iter().flat_map(|s| s.to_le_bytes()).collect());
    file.write_all(&bytes).map_err(out)?;
    let dims = volume.grid().dims();
    let python = std::env::var(PYTHON).unwrap_or_else(|_| "python3".to_owned());
    let mut command = Command::new(python);
    command.args(["-c", SCRIPT]).arg(file.path()).args(dims.to_array().map(|n| n.to_string())).arg(kind).args(wanted);
    let Ok(output) = command.output() else { return Ok(Vec::new()) };
    let message = String::from_utf8_lossy(&output.stderr);
    if message.contains("ModuleNotFoundError") {
        return Ok(Vec::new());
    }
    if !output.status.success() {
        return Err(PaperError::OwnProcess { what: format!("standard codecs: {}", message.trim_end()) });
    }
    let found: serde_json::Map<String, serde_json::Value> = serde_json::from_slice(&output.stdout)
        .map_err(|e| PaperError::OwnProcess { what: format!("standard codecs: {e}") })?;
    let of = |(codec, json): (String, serde_json::Value)| {
        let slices: PeerSlices = serde_json::from_value(json)
            .map_err(|e| PaperError::OwnProcess { what: format!("standard codecs: {codec}: {e}") })?;
        Ok(PeerSlices { codec, ..slices })
    };
    found.into_iter().map(of).collect()
}

/// The codec that pictures of slices are delivered by.
pub(crate) fn peer_slices(volume: &Volume) -> Result<Option<PeerSlices>, PaperError> {
    Ok(peers(volume, &["HTJ2K"])?.into_iter().next())
}
