//! Lossless ratios and speeds: brickfield-haar, zstd and pco on bricks of 32^3, standard codecs on slices.
//!
//! The bricks are measured by the crate's own benchmark, `cargo bench -p brickfield-haar`; the slices by a Python with imagecodecs, if there
//! is one.

use std::fs;
use std::path::Path;
use std::process::Command;

use brickfield::io::{OpenOptions, open};
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Grid, ScalarType, Volume, with_voxels};
use serde::Serialize;

use super::CodecsArgs;
use super::peers::{PeerSlices, peers};
use crate::paper::{Missed, PaperError, print, write_rows};

/// The four volumes of the aims, and two more; as paths below the folder of real ones.
const DATA: [&str; 6] =
    ["ct/LIDC2.mha", "ct/tooth.nhdr", "mri/spm152.nii.gz", "ct/headsq", "ct/engine.vti", "ct/GE_head_dicom"];

/// A codec on a volume; speeds in millions of bytes a second, on one core and on all.
#[derive(Clone, Debug, Serialize)]
struct CodecRow {
    data: String,
    codec: String,
    ratio: f64,
    encode: f64,
    decode: f64,
    /// `None` of what was measured on one core only.
    encode_all: Option<f64>,
    decode_all: Option<f64>,
}

pub(super) fn run(args: &CodecsArgs) -> Result<Vec<Missed>, PaperError> {
    print(
        "Bricks of 32^3 (brickfield-haar, zstd, pco), slices for codecs of pictures. Speeds: MB/s of samples, on one core; on all cores.\n",
    )?;
    let mut rows = Vec::new();
    for (name, path) in args.volumes(&DATA)? {
        let volume = volume_of(&path)?;
        let (dims, scalar) = (volume.grid().dims(), volume.scalar_type());
        print(&format!("{name}: {} x {} x {} of {scalar}", dims.x, dims.y, dims.z))?;
        print("codec                                   ratio  encode  decode  encode, all  decode, all")?;
        let mut of_volume = of_bricks(&name, &volume)?;
        let peers = peers(&volume, &[])?;
        if peers.is_empty() {
            print(
                "HTJ2K, JPEG-LS, JPEG XL: absent: no Python with numpy and imagecodecs (BRICKFIELD_PYTHON names one)",
            )?;
        }
        let n_bytes = (volume.voxels().len() * scalar.n_bytes()) as f64;
        of_volume.extend(peers.into_iter().map(|peer| of_slices(&name, n_bytes, peer)));
        of_volume.iter().try_for_each(print_row)?;
        aims(&of_volume)?;
        rows.extend(of_volume);
    }
    write_rows(&args.out.join("codecs-table.json"), &rows)?;
    Ok(Vec::new())
}

fn print_row(row: &CodecRow) -> Result<(), PaperError> {
    let all = |speed: Option<f64>| speed.map_or("-".to_owned(), |speed| format!("{speed:.0}"));
    print(&format!(
        "{:38} {:6.3} {:7.0} {:7.0} {:>12} {:>12}",
        row.codec,
        row.ratio,
        row.encode,
        row.decode,
        all(row.encode_all),
        all(row.decode_all)
    ))
}

/// At least HTJ2K's ratio on all four volumes, JPEG XL's at effort 3 on three, 800 MB/s a core when decoding.
fn aims(rows: &[CodecRow]) -> Result<(), PaperError> {
    let of = |codec: &str| rows.iter().find(|row| row.codec == codec);
    let Some(ours) = of(OURS) else { return Ok(()) };
    for peer in ["HTJ2K", "JPEG XL e3"] {
        if let Some(peer) = of(peer) {
            let word = if ours.ratio >= peer.ratio { "reached" } else { "missed" };
            print(&format!("  aim: the ratio of {}: {word}, {:.3} of it", peer.codec, ours.ratio / peer.ratio))?;
        }
    }
    let word = if ours.decode >= DECODE_AIM { "reached" } else { "missed" };
    print(&format!("  aim: {DECODE_AIM:.0} MB/s a core when decoding: {word}, {:.2} of it\n", ours.decode / DECODE_AIM))
}

/// The codec that aims are held against: the smallest brick of all kernels.
const OURS: &str = "the smallest of all kernels";
const DECODE_AIM: f64 = 800.0;

fn of_slices(data: &str, n_bytes: f64, peer: PeerSlices) -> CodecRow {
    let n_encoded: u64 = peer.n_bytes.iter().sum();
    CodecRow {
        data: data.to_owned(),
        codec: peer.codec,
        ratio: n_bytes / n_encoded as f64,
        encode: peer.encode_mb_s,
        decode: peer.decode_mb_s,
        encode_all: None,
        decode_all: None,
    }
}

/// The rows of the benchmark of brickfield-haar.
fn of_bricks(data: &str, volume: &Volume) -> Result<Vec<CodecRow>, PaperError> {
    let kind = match volume.scalar_type() {
        kind @ (ScalarType::U8 | ScalarType::I8 | ScalarType::U16 | ScalarType::I16) => kind.to_string(),
        other => return Err(failed(format!("{data}: samples of {other}; bricks are measured of u8, i8, u16 and i16"))),
    };
    let out = |source| PaperError::Out { path: std::env::temp_dir(), source };
    let file = tempfile::NamedTempFile::new().map_err(out)?;
    let bytes: Vec<u8> = with_voxels!(volume.voxels(), v => v.iter().flat_map(|s| s.to_le_bytes()).collect());
    fs::write(file.path(), bytes).map_err(out)?;
    let dims = volume.grid().dims();
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.args(["bench", "--quiet", "-p", "brickfield-haar", "--profile", "dev", "--bench", "codecs", "--"]);
    command.arg("--raw").arg(file.path());
    command.args(["--dims", &format!("{}x{}x{}", dims.x, dims.y, dims.z), "--type", &kind, "--seconds", "0.3"]);
    let output = command.output().map_err(|e| failed(format!("cargo bench: {e}")))?;
    let (text, message) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let rows: Vec<CodecRow> = text.lines().filter_map(|line| parsed(data, line)).collect();
    match output.status.success() && !rows.is_empty() {
        true => Ok(rows),
        false => Err(failed(format!("cargo bench -p brickfield-haar: {}{}", text.trim_end(), message.trim_end()))),
    }
}

fn failed(what: String) -> PaperError {
    PaperError::OwnProcess { what }
}

/// A line of the benchmark: `| codec | ratio | encode | decode | encode, all | decode, all |`.
fn parsed(data: &str, line: &str) -> Option<CodecRow> {
    let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
    let [codec, ratio, encode, decode, encode_all, decode_all] = cells[..] else { return None };
    let number = |text: &str| text.parse::<f64>().ok();
    Some(CodecRow {
        data: data.to_owned(),
        codec: codec.to_owned(),
        ratio: number(ratio)?,
        encode: number(encode)?,
        decode: number(decode)?,
        encode_all: Some(number(encode_all)?),
        decode_all: Some(number(decode_all)?),
    })
}

/// A volume of a file, or of the slices of headsq, which no header describes: 64 x 64 x 93 of 12 bits.
fn volume_of(path: &Path) -> Result<Volume, PaperError> {
    let slice = |i: u32| path.join(format!("quarter.{i}"));
    if !slice(1).exists() {
        return Ok(open(path, &OpenOptions::default())?.volume);
    }
    let mut bytes = Vec::new();
    for i in 1..=93 {
        bytes.extend(fs::read(slice(i)).map_err(|source| PaperError::Out { path: slice(i), source })?);
    }
    let voxels: Vec<u16> = bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
    let grid = Grid::axis_aligned(UVec3::new(64, 64, 93), DVec3::new(3.2, 3.2, 1.5)).expect("a grid");
    Volume::new(grid, voxels).map_err(|e| failed(format!("{}: {e}", path.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_the_benchmark_are_read() {
        let row = parsed("a", "| haar | 5.603 | 71 | 240 | 139 | 470 |").unwrap();
        assert_eq!((row.codec.as_str(), row.ratio, row.decode_all), ("haar", 5.603, Some(470.0)));
        assert!(
            parsed("a", "| codec | ratio | encode MB/s | decode MB/s | encode, all cores | decode, all cores |")
                .is_none()
        );
        assert!(parsed("a", "|---|---|---|---|---|---|").is_none());
        assert!(parsed("a", "LIDC2: 405 bricks").is_none());
    }
}
