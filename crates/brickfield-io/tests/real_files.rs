//! Real files, held against their manifest. They lie in the folder that BRICKFIELD_DATA names; without it these tests are
//! ignored, and say why.

use std::path::{Path, PathBuf};

use brickfield_io::{OpenOptions, Opened, open};
use libtest_mimic::{Arguments, Failed, Trial};
use serde_json::Value;

#[path = "real_files/grids.rs"]
mod grids;

fn main() {
    let folder = std::env::var_os("BRICKFIELD_DATA").filter(|f| !f.is_empty()).map(PathBuf::from);
    let trial = |name: &str, test: fn(&Path, &str) -> Result<(), Failed>| {
        let (folder, file) = (folder.clone(), name.to_owned());
        let kind = if folder.is_some() { "" } else { "no data" };
        let trial = Trial::test(name, move || test(&folder.unwrap_or_default(), &file)).with_kind(kind);
        trial.with_ignored_flag(kind == "no data")
    };
    let files = FILES.iter().map(|file| trial(file.0, is_what_the_manifest_says));
    let foreign = FOREIGN.iter().map(|file| trial(file.0, is_refused_by_name));
    let halves = HALVES.iter().map(|file| trial(&format!("{HALF}{}", file.0), half_of_it_says_how_much_came));
    let grids = grids::GRIDS.iter().map(|grid| trial(grid.path, grids::is_as_expected));
    let trials = files.chain(foreign).chain(halves).chain(grids).collect();
    libtest_mimic::run(&Arguments::from_args(), trials).exit();
}

fn manifest(folder: &Path) -> Result<Vec<Value>, Failed> {
    let text = std::fs::read_to_string(folder.join("MANIFEST.json"))?;
    Ok(serde_json::from_str(&text)?)
}

/// Where the manifest's entries lie in the folder, the type they are read as, and the slope by which the manifest's
/// range (of stored values) has to be multiplied.
const FILES: &[(&str, &str, &str, f64)] = &[
    ("aneurism", "ct/aneurism.vti", "u8", 1.0),
    ("engine", "ct/engine.vti", "u8", 1.0),
    ("LIDC2", "ct/LIDC2.mha", "u8", 1.0),
    ("tooth-16bit", "ct/tooth.nhdr", "u16", 1.0),
    ("headsq", "ct/headsq/quarter.nhdr", "i16", 1.0),
    ("frogtissue", "ct/frogtissue.mhd", "u8", 1.0),
    ("fuel", "formats/fuel.nii.gz", "u8", 1.0),
    ("ct_perfusion_rgb", "formats/ct_perfusion_rgb.nii.gz", "u8", 1.0),
    ("spm152", "mri/spm152.nii.gz", "u8", 90.739_101_171_493_53 / 250.0),
    ("fetal_template_T2", "mri/fetal_template_T2.nrrd", "f32", 1.0),
    ("hydrogen", "formats/hydrogen.vti", "f32", 1.0),
    ("GE_head_dicom", "ct/GE_head_dicom", "i16", 1.0),
    ("mri-stack.ome.zarr", "formats/mri-stack.ome.zarr", "u8", 1.0),
    ("mri-stack.tif", "formats/mri-stack.tif", "u8", 1.0),
];

fn is_what_the_manifest_says(folder: &Path, name: &str) -> Result<(), Failed> {
    let manifest = manifest(folder)?;
    let (_, path, scalar, slope) = FILES.iter().find(|file| file.0 == name).ok_or("not in the table")?;
    let entry = manifest.iter().find(|e| e["name"] == name).ok_or("not in the manifest")?;
    let opened = open(&folder.join(path), &OpenOptions::default())?;
    let numbers = |key: &str| -> Vec<f64> { entry[key].as_array().unwrap().iter().filter_map(Value::as_f64).collect() };
    let (grid, range) = (opened.volume.grid(), opened.volume.range());
    let dims = grid.dims().to_array().map(f64::from);
    expect("dims", &dims, &numbers("dims"), 0.0)?;
    expect("spacing", &grid.spacing().to_array(), &numbers("spacing"), 5e-5)?;
    let stated = ["min", "max"].map(|key| entry[key].as_f64().unwrap() * slope);
    expect("range", &[range.min, range.max], &stated, 1e-9)?;
    match opened.volume.scalar_type().name() == *scalar {
        true => Ok(()),
        false => Err(format!("expected {scalar}: {}", summary(&opened)).into()),
    }
}

/// Files of foreign formats, and what the refusal must name.
const FOREIGN: &[(&str, &str)] = &[("formats/vdb/sphere_points.vdb", "OpenVDB")];

fn is_refused_by_name(folder: &Path, path: &str) -> Result<(), Failed> {
    let (_, name) = FOREIGN.iter().find(|file| file.0 == path).ok_or("not in the table")?;
    match open(&folder.join(path), &OpenOptions::default()) {
        Ok(opened) => Err(format!("read as {}", summary(&opened)).into()),
        Err(e) if e.to_string().contains(name) => Ok(()),
        Err(e) => Err(format!("{e}: {name} is not named").into()),
    }
}

fn expect(what: &str, found: &[f64], expected: &[f64], tolerance: f64) -> Result<(), Failed> {
    let agree = found.len() == expected.len() && found.iter().zip(expected).all(|(f, e)| (f - e).abs() <= tolerance);
    if agree { Ok(()) } else { Err(format!("{what} {found:?}, the manifest has {expected:?}").into()) }
}

fn summary(opened: &Opened) -> String {
    let (volume, grid) = (&opened.volume, opened.volume.grid());
    let first = grid.index_to_world().transform_point3(brickfield_core::glam::DVec3::splat(0.5));
    let sum: f64 = (0..volume.voxels().len()).map(|i| volume.voxels().at(i)).sum();
    let steps = grid.index_to_world().matrix3;
    format!(
        "{} {} {} spacing {} first {first} steps {steps} range {}..{} mean {} {:?} {:?}",
        opened.format,
        grid.dims(),
        volume.scalar_type(),
        grid.spacing(),
        volume.range().min,
        volume.range().max,
        sum / volume.voxels().len() as f64,
        opened.frame,
        opened.unit,
    )
}

const HALF: &str = "half of ";

/// Cut in half: the path, and what is said before and after the bytes that came of the promised ones.
const HALVES: &[(&str, &str, &str)] = &[
    (
        "ct/engine.vti",
        "DataArray \"ImageFile\" holds ",
        " bytes, then its compressed data are cut off; 8388608 are promised",
    ),
    ("mri/spm152.nii.gz", "the image holds ", " bytes, then its compressed data are cut off; 11393280 are promised"),
    (
        "ct/LIDC2.mha",
        "the data after the header holds ",
        " bytes, then its compressed data are cut off; 8716288 are promised",
    ),
    ("formats/mri-stack.tif", "the file ends at byte ", ", before the tags of page 2 at byte 1135163"),
];

fn half_of_it_says_how_much_came(folder: &Path, path: &str) -> Result<(), Failed> {
    let (_, before, after) = HALVES.iter().find(|file| path.ends_with(file.0)).ok_or("not in the table")?;
    let path = folder.join(path.trim_start_matches(HALF));
    let bytes = std::fs::read(&path)?;
    let cut = tempfile::tempdir()?;
    let half = cut.path().join(path.file_name().ok_or("no file name")?);
    std::fs::write(&half, &bytes[..bytes.len() / 2])?;
    let said = open(&half, &OpenOptions::default()).map_or_else(|e| e.fault.to_string(), |o| summary(&o));
    let n_bytes = said.strip_prefix(before).and_then(|s| s.strip_suffix(after)).and_then(|n| n.parse().ok());
    if n_bytes.is_some_and(|n: u64| n > 500_000) { Ok(()) } else { Err(said.into()) }
}
