//! Packs the phantom at any resolution as a store: slice by slice, never whole in memory.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use brickfield::options::{progress_bar, values};
use brickfield::{Codec, PackProgress};
use brickfield_conformance::volumes::pack_phantom;
use clap::Parser;

/// Packs the phantom as OME-Zarr with all coarser levels; it is made slice by slice, so that a volume larger than memory can be had
#[derive(Parser)]
struct Arguments {
    /// `NXxNYxNZ,TYPE` with TYPE u8 to f64, as `brickfield --raw` has it; the size in millimetres is always the same
    #[arg(value_name = "SPEC", value_parser = values::raw_spec)]
    volume: brickfield::io::RawSpec,
    /// OME-Zarr to write: a folder that is not there yet
    #[arg(short, long, value_name = "STORE")]
    out: PathBuf,
    /// How samples are coded: zstd, haar (integers) or none
    #[arg(long, value_name = "CODEC", default_value = "zstd", value_parser = values::codec)]
    codec: Codec,
}

fn main() -> Result<ExitCode> {
    let Arguments { volume, out, codec } = Arguments::parse();
    let bar = progress_bar("packing the phantom");
    let mut told = |p: PackProgress| {
        bar.set_length(p.n_total);
        bar.set_position(p.n_done);
    };
    let packed = pack_phantom(volume.dims, volume.scalar, codec, &out, &mut told);
    bar.finish_and_clear();
    let packed = packed?;
    println!("{}: {} voxels of {}, levels 0 to {}", out.display(), volume.dims, packed.scalar, packed.coarsest.0);
    Ok(ExitCode::SUCCESS)
}
