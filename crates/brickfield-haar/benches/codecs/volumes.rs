//! Volumes of the project's data, as bricks. Only these files are read, not their formats.

use std::fs;
use std::io::Read;
use std::path::Path;

use brickfield_core::glam::UVec3;

/// The volumes.
pub(crate) const NAMES: [&str; 4] = ["LIDC2", "tooth", "spm152", "headsq"];
const SIDE: u32 = 32;

/// Extent and samples of each brick.
pub(crate) enum Bricks {
    U8(Vec<(UVec3, Vec<u8>)>),
    U16(Vec<(UVec3, Vec<u16>)>),
}

/// The bricks of a volume.
pub(crate) fn bricks_of(data: &Path, name: &str) -> Result<Bricks, String> {
    let read = |path: &str| fs::read(data.join(path)).map_err(|error| format!("{path}: {error}"));
    Ok(match name {
        "LIDC2" => {
            let file = read("ct/LIDC2.mha")?;
            let (key, end) = (b"ElementDataFile = LOCAL", b"\n");
            let header = file.windows(key.len()).position(|w| w == key).ok_or("LIDC2.mha has no data")?;
            let inflated = inflated(flate2::read::ZlibDecoder::new(&file[header + key.len() + end.len()..]))?;
            Bricks::U8(cut(UVec3::new(256, 256, 133), &inflated)?)
        }
        "spm152" => {
            let file = inflated(flate2::read::GzDecoder::new(&read("mri/spm152.nii.gz")?[..]))?;
            Bricks::U8(cut(UVec3::new(207, 256, 215), file.get(352..).unwrap_or_default())?)
        }
        "tooth" => {
            let samples =
                read("ct/tooth.raw")?.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect::<Vec<_>>();
            Bricks::U16(cut(UVec3::new(103, 94, 161), &samples)?)
        }
        "headsq" => {
            let slices = (1..=93).map(|i| read(&format!("ct/headsq/quarter.{i}"))).collect::<Result<Vec<_>, _>>()?;
            let samples = slices.concat().chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect::<Vec<_>>();
            Bricks::U16(cut(UVec3::new(64, 64, 93), &samples)?)
        }
        _ => return Err("no such volume".to_owned()),
    })
}

/// The bricks of a file of samples.
pub(crate) fn bricks_of_raw(file: &Path, dims: &str, kind: &str) -> Result<Bricks, String> {
    let bytes = fs::read(file).map_err(|error| format!("{}: {error}", file.display()))?;
    let numbers: Vec<u32> = dims.split('x').filter_map(|n| n.parse().ok()).collect();
    let [x, y, z] = numbers[..] else { return Err(format!("--dims {dims:?} is no NXxNYxNZ")) };
    let n = UVec3::new(x, y, z);
    let words =
        |flipped: u16| bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]]) ^ flipped).collect::<Vec<_>>();
    Ok(match kind {
        "u8" => Bricks::U8(cut(n, &bytes)?),
        "i8" => Bricks::U8(cut(n, &bytes.iter().map(|byte| byte ^ 0x80).collect::<Vec<_>>())?),
        "u16" => Bricks::U16(cut(n, &words(0))?),
        "i16" => Bricks::U16(cut(n, &words(0x8000))?),
        _ => return Err(format!("--type {kind:?} is none of u8, i8, u16, i16")),
    })
}

fn inflated(mut decoder: impl Read) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    decoder.read_to_end(&mut bytes).map_err(|error| error.to_string())?;
    Ok(bytes)
}

/// Bricks of 32^3 voxels without shared ones; the last ones along each axis are smaller.
fn cut<T: Copy>(n: UVec3, voxels: &[T]) -> Result<Vec<(UVec3, Vec<T>)>, String> {
    if voxels.len() != n.element_product() as usize {
        return Err(format!("{} voxels, not {n}", voxels.len()));
    }
    let n_bricks = (n + SIDE - 1) / SIDE;
    let corners = (0..n_bricks.element_product())
        .map(|i| UVec3::new(i % n_bricks.x, i / n_bricks.x % n_bricks.y, i / n_bricks.x / n_bricks.y) * SIDE);
    let brick = |corner: UVec3| {
        let extent = (n - corner).min(UVec3::splat(SIDE));
        let mut samples = Vec::new();
        for (z, y) in (0..extent.z).flat_map(|z| (0..extent.y).map(move |y| (z, y))) {
            let row = (corner.x + n.x * (corner.y + y + n.y * (corner.z + z))) as usize;
            samples.extend_from_slice(&voxels[row..row + extent.x as usize]);
        }
        (extent, samples)
    };
    Ok(corners.map(brick).collect())
}
