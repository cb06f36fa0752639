//! Stores of the volumes: packed once, and kept in the output folder.

use std::path::{Path, PathBuf};

use brickfield::io::ome_zarr::ZarrLevels;
use brickfield::io::{Limits, OpenOptions, Opened, open, open_slices};
use brickfield::{Codec, StoreLimits, pack};
use brickfield_core::glam::UVec3;
use brickfield_core::{Rescale, Voxels};
use serde::Serialize;

use super::SaladiArgs;
use crate::paper::{Missed, PaperError, mib, print};

/// A computed tomogram of 8 bits, a magnetic resonance image, and a computed tomogram of 16 bits in slices.
pub(super) const DATA: [&str; 3] = ["ct/LIDC2.mha", "mri/spm152.nii.gz", "ct/GE_head_dicom"];

/// The bytes of a store.
#[derive(Clone, Debug, Serialize)]
struct StoreRow {
    data: String,
    n_voxel_bytes: u64,
    /// All files, by zstd and by haar.
    n_bytes: [u64; 2],
    /// Shards of level 0 alone.
    n_bytes_of_level_0: [u64; 2],
}

/// The names of the volumes that are asked for, and their paths.
pub(super) fn files(args: &SaladiArgs) -> Result<Vec<(String, PathBuf)>, PaperError> {
    args.common.named(&DATA)
}

/// A volume as `pack` reads it: uneven slices are made even.
pub(super) fn volume_of(path: &Path) -> Result<Opened, PaperError> {
    Ok(open(path, &OpenOptions::default())?.evenly_spaced(&Limits::default()))
}

/// A store of a volume in the output folder, packed now.
pub(super) fn store(args: &SaladiArgs, name: &str, path: &Path, codec: Codec) -> Result<PathBuf, PaperError> {
    let plain: String = name.chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
    let out = args.common.out.join(format!("saladi-{plain}-{}.zarr", codec.name()));
    if out.exists() {
        std::fs::remove_dir_all(&out).map_err(|source| PaperError::Out { path: out.clone(), source })?;
    }
    let mut slices = || open_slices(path, &OpenOptions::default());
    pack(path, &mut slices, &out, codec, &mut |_| ())?;
    Ok(out)
}

/// Sizes of stores by haar and by zstd; whether both have the samples of the source.
pub(super) fn run(args: &SaladiArgs) -> Result<Vec<Missed>, PaperError> {
    print("Sizes of whole stores, MiB; ratios are those of the voxels' bytes. Summaries of blocks are in both.\n")?;
    print("data                 voxels   zstd  ratio   haar  ratio   level 0: zstd   haar   haar / zstd, whole")?;
    let (mut rows, mut missed) = (Vec::new(), Vec::new());
    for (name, path) in files(args)? {
        let stores = [store(args, &name, &path, Codec::Zstd)?, store(args, &name, &path, Codec::Haar)?];
        let volume = volume_of(&path)?.volume;
        let n_voxel_bytes = (volume.voxels().len() * volume.scalar_type().n_bytes()) as u64;
        let mut n_bytes = [0; 2];
        let mut of_level_0 = [0; 2];
        for (i, store) in stores.iter().enumerate() {
            n_bytes[i] = bytes_below(store)?;
            let finest = if i == 0 { store.join("0") } else { store.join("brickfield_details/0") };
            of_level_0[i] = bytes_below(&finest)?;
        }
        let [zstd, haar] = n_bytes.map(mib);
        print(&format!(
            "{name:20} {:6.2} {zstd:6.2} {:6.2} {haar:6.2} {:6.2}   {:13.2} {:6.2}   {:.3}",
            mib(n_voxel_bytes),
            mib(n_voxel_bytes) / zstd,
            mib(n_voxel_bytes) / haar,
            mib(of_level_0[0]),
            mib(of_level_0[1]),
            haar / zstd,
        ))?;
        missed.extend(differences(&name, &stores, volume.voxels(), volume.rescale())?);
        rows.push(StoreRow { data: name, n_voxel_bytes, n_bytes, n_bytes_of_level_0: of_level_0 });
    }
    args.common.write_rows("saladi-stores.json", &rows)?;
    Ok(missed)
}

/// Level 0 by haar against the source, and the other levels against those by zstd, where that has the same type.
fn differences(
    name: &str,
    stores: &[PathBuf; 2],
    voxels: &Voxels,
    rescale: Rescale,
) -> Result<Vec<Missed>, PaperError> {
    let opened = |path: &PathBuf| {
        let cache_bytes = StoreLimits::default().cache_bytes;
        ZarrLevels::open(path, &OpenOptions::default(), cache_bytes)
    };
    let (zstd, haar) = (opened(&stores[0])?, opened(&stores[1])?);
    let whole = |levels: &ZarrLevels, level: usize| {
        let fault = |fault| brickfield::io::OpenError { path: stores[0].clone(), fault };
        levels.box_voxels(level, UVec3::ZERO, levels.dims(level)).map_err(fault)
    };
    let mut missed = Vec::new();
    let mut claim = |what: String, holds: bool| -> Result<(), PaperError> {
        print(&format!("  {what}: {}", if holds { "equal" } else { "DIFFERENT" }))?;
        missed.extend((!holds).then(|| Missed::of_pictures(format!("{name}: {what}"))));
        Ok(())
    };
    claim("level 0 of the store by haar and the source, bit by bit".to_owned(), whole(&haar, 0)? == *voxels)?;
    claim("slope and intercept".to_owned(), haar.facts().rescale == rescale)?;
    if zstd.facts().scalar != haar.facts().scalar {
        return Ok(missed);
    }
    let mut is_equal = zstd.n_levels() == haar.n_levels();
    for level in 1..zstd.n_levels().min(haar.n_levels()) {
        is_equal &= whole(&zstd, level)? == whole(&haar, level)?;
    }
    claim(format!("levels 1 to {} of both stores, bit by bit", haar.n_levels() - 1), is_equal)?;
    Ok(missed)
}

/// The bytes of all files below a folder.
fn bytes_below(folder: &Path) -> Result<u64, PaperError> {
    let fault = |source| PaperError::Out { path: folder.to_owned(), source };
    let mut n_bytes = 0;
    for entry in std::fs::read_dir(folder).map_err(fault)? {
        let entry = entry.map_err(fault)?;
        let metadata = entry.metadata().map_err(fault)?;
        n_bytes += if metadata.is_dir() { bytes_below(&entry.path())? } else { metadata.len() };
    }
    Ok(n_bytes)
}
