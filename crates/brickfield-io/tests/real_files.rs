//! Real files, held against their manifest. They lie in the folder that BRICKFIELD_DATA names; without it these tests
//! check nothing, and say so.

use std::path::{Path, PathBuf};

use brickfield_io::{Limits, Opened, open};
use serde_json::Value;

/// The data folder, or nothing with a message. The message goes past the capture of test output.
fn data_folder() -> Option<PathBuf> {
    let folder = std::env::var_os("BRICKFIELD_DATA").map(PathBuf::from);
    if folder.is_none() {
        eprintln!("no data: set BRICKFIELD_DATA; nothing was checked");
    }
    folder
}

fn manifest(folder: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(folder.join("MANIFEST.json")).expect("BRICKFIELD_DATA has a MANIFEST.json");
    serde_json::from_str(&text).expect("MANIFEST.json is a list")
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
    ("spm152", "mri/spm152.nii.gz", "f32", 90.739_097_595_214_84 / 250.0),
    ("fetal_template_T2", "mri/fetal_template_T2.nrrd", "f32", 1.0),
    ("hydrogen", "formats/hydrogen.vti", "f32", 1.0),
    ("GE_head_dicom", "ct/GE_head_dicom", "i16", 1.0),
    ("mri-stack.ome.zarr", "formats/mri-stack.ome.zarr", "u8", 1.0),
    ("mri-stack.tif", "formats/mri-stack.tif", "u8", 1.0),
];

#[test]
fn files_are_what_the_manifest_says() {
    let Some(folder) = data_folder() else { return };
    let manifest = manifest(&folder);
    let faults: Vec<String> = FILES.iter().filter_map(|file| check(&folder, &manifest, file).err()).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

fn check(
    folder: &Path,
    manifest: &[Value],
    (name, path, scalar, slope): &(&str, &str, &str, f64),
) -> Result<(), String> {
    let entry = manifest.iter().find(|e| e["name"] == *name).ok_or(format!("{name}: not in the manifest"))?;
    let opened = open(&folder.join(path), &Limits::default()).map_err(|e| e.to_string())?;
    println!("{name}: {}", summary(&opened));
    for note in &opened.notes {
        println!("    note: {note}");
    }
    let numbers = |key: &str| -> Vec<f64> { entry[key].as_array().unwrap().iter().filter_map(Value::as_f64).collect() };
    let (grid, range) = (opened.volume.grid(), opened.volume.range());
    let dims = grid.dims().to_array().map(f64::from);
    expect(name, "dims", &dims, &numbers("dims"), 0.0)?;
    expect(name, "spacing", &grid.spacing().to_array(), &numbers("spacing"), 5e-5)?;
    let stated = ["min", "max"].map(|key| entry[key].as_f64().unwrap() * slope);
    expect(name, "range", &[range.min, range.max], &stated, 1e-9)?;
    match opened.volume.scalar_type().name() == *scalar {
        true => Ok(()),
        false => Err(format!("{name}: type {}, expected {scalar}", opened.volume.scalar_type())),
    }
}

fn expect(name: &str, what: &str, found: &[f64], expected: &[f64], tolerance: f64) -> Result<(), String> {
    let agree = found.len() == expected.len() && found.iter().zip(expected).all(|(f, e)| (f - e).abs() <= tolerance);
    if agree { Ok(()) } else { Err(format!("{name}: {what} {found:?}, the manifest has {expected:?}")) }
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

#[test]
fn colours_and_foreign_formats_are_refused_by_name() {
    let Some(folder) = data_folder() else { return };
    let refusal = |path| open(&folder.join(path), &Limits::default()).unwrap_err().to_string();
    assert!(refusal("formats/ct_perfusion_rgb.nii.gz").contains("RGB24"));
    assert!(refusal("formats/vdb/sphere_points.vdb").contains("OpenVDB"));
}

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
    ("formats/mri-stack.tif", "the file ends at byte ", ", before the tags of page 2 of 27 at byte 1135163"),
];

#[test]
fn half_a_file_says_how_much_of_it_came() {
    let Some(folder) = data_folder() else { return };
    let cut = tempfile::tempdir().unwrap();
    for (path, before, after) in HALVES {
        let bytes = std::fs::read(folder.join(path)).unwrap();
        let half = cut.path().join(Path::new(path).file_name().unwrap());
        std::fs::write(&half, &bytes[..bytes.len() / 2]).unwrap();
        let said = open(&half, &Limits::default()).unwrap_err().fault.to_string();
        let n_bytes = said.strip_prefix(before).and_then(|s| s.strip_suffix(after));
        let n_bytes: u64 = n_bytes.and_then(|n| n.parse().ok()).unwrap_or_else(|| panic!("{path}: {said}"));
        assert!(n_bytes > 500_000, "{path}: {said}");
    }
}
