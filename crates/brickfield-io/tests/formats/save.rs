//! Volumes that are saved and read back, in every format that is written.

#[cfg(feature = "nifti")]
use brickfield_core::IndexPos;
use brickfield_core::glam::{DMat3, DQuat, DVec3, EulerRot, UVec3};
use brickfield_core::{Grid, Rescale, Volume, Voxels};
#[cfg(feature = "nifti")]
use brickfield_io::nifti;
use brickfield_io::{Compression, Opened, SaveOptions, WorldFrame, check_save_path, open, save};
use proptest::prelude::*;

use crate::common::options;

fn any_dims() -> impl Strategy<Value = UVec3> {
    (1u32..6, 1u32..6, 1u32..6).prop_map(UVec3::from)
}

fn any_spacing() -> impl Strategy<Value = DVec3> {
    (1e-3f64..1e3, 1e-3f64..1e3, 1e-3f64..1e3).prop_map(DVec3::from)
}

fn any_first_sample() -> impl Strategy<Value = DVec3> {
    (-1e7f64..1e7, -1e7f64..1e7, -1e7f64..1e7).prop_map(DVec3::from)
}

fn any_direction() -> impl Strategy<Value = DMat3> {
    let angles = (-3.0f64..3.0, -3.0f64..3.0, -3.0f64..3.0);
    angles.prop_map(|(a, b, c)| DMat3::from_quat(DQuat::from_euler(EulerRot::XYZ, a, b, c)))
}

fn any_voxels(n: usize) -> impl Strategy<Value = Voxels> {
    prop_oneof![
        prop::collection::vec(any::<u8>(), n).prop_map(Voxels::from),
        prop::collection::vec(any::<i8>(), n).prop_map(Voxels::from),
        prop::collection::vec(any::<u16>(), n).prop_map(Voxels::from),
        prop::collection::vec(any::<i16>(), n).prop_map(Voxels::from),
        prop::collection::vec(any::<u32>(), n).prop_map(Voxels::from),
        prop::collection::vec(any::<i32>(), n).prop_map(Voxels::from),
        prop::collection::vec(prop::num::f32::ANY, n).prop_map(Voxels::from),
        prop::collection::vec(prop::num::f64::NORMAL, n).prop_map(Voxels::from),
    ]
}

/// Mostly none, else one that f32 holds, else any; none of them with the greatest f64 numbers beyond their range.
fn any_rescale() -> impl Strategy<Value = Rescale> {
    let of = |(slope, intercept)| Rescale::new(slope, intercept).unwrap();
    prop_oneof![
        Just(Rescale::IDENTITY),
        prop_oneof![Just((0.5, -1024.0)), Just((-0.25, 3.0))].prop_map(of),
        (prop_oneof![-3f64..-1e-3, 1e-3f64..3.0], -1e4f64..1e4).prop_map(of),
    ]
}

fn any_volume(direction: impl Strategy<Value = DMat3>) -> impl Strategy<Value = Volume> {
    let grid =
        (any_dims(), any_spacing(), any_first_sample(), direction).prop_map(|(dims, spacing, first, direction)| {
            Grid::from_first_sample(dims, spacing, first, direction).unwrap()
        });
    (grid, any_rescale()).prop_flat_map(|(grid, rescale)| {
        let volume = move |voxels: Voxels| Volume::rescaled(grid, voxels, rescale).ok();
        any_voxels(grid.n_voxels()).prop_filter_map("values beyond f64", volume)
    })
}

fn values(volume: &Volume) -> Vec<f64> {
    (0..volume.voxels().len()).map(|i| volume.value(i)).collect()
}

/// Saves a volume in a folder of its own, and opens it.
fn saved(volume: &Volume, name: &str, save_options: &SaveOptions) -> Opened {
    noted(volume, name, save_options).0
}

/// The same, and what is said about the file.
fn noted(volume: &Volume, name: &str, save_options: &SaveOptions) -> (Opened, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let saved = save(&path, volume, save_options).unwrap();
    assert_eq!(folder.path().read_dir().unwrap().count(), 1);
    let opened = open(&path, &options()).unwrap();
    assert_eq!(opened.volume.scalar_type(), saved.scalar);
    (opened, saved.notes.iter().map(ToString::to_string).collect())
}

/// Saves and opens; values and place must be those that were saved, to the rounding of decimal texts.
fn check(volume: &Volume, name: &str, save_options: &SaveOptions) -> Result<(), TestCaseError> {
    let opened = saved(volume, name, save_options);
    prop_assert_eq!(values(&opened.volume), values(volume));
    prop_assert_eq!(opened.volume.grid().dims(), volume.grid().dims());
    let (a, b) = (opened.volume.grid().index_to_world(), volume.grid().index_to_world());
    prop_assert!(a.matrix3.abs_diff_eq(b.matrix3, 1e-9 * 1e3), "{} {}", a, b);
    prop_assert!(a.translation.abs_diff_eq(b.translation, 1e-7), "{} {}", a, b);
    prop_assert!(opened.notes.is_empty(), "{:?}", opened.notes);
    if volume.rescale() == Rescale::IDENTITY {
        prop_assert_eq!(opened.volume.voxels(), volume.voxels());
    }
    Ok(())
}

/// Voxels are those that were saved; corners and values are at most as far off as `nifti::save` says.
#[cfg(feature = "nifti")]
fn check_nifti(opened: &Opened, volume: &Volume) -> Result<(), TestCaseError> {
    let (found, grid, range) = (opened.volume.grid(), volume.grid(), volume.range());
    prop_assert_eq!(opened.volume.voxels(), volume.voxels());
    let max_shift = 1e-3 * grid.spacing().min_element() + 1e-7;
    // From sample 0 to one step behind the last.
    for corner in grid.index_box().corners().map(|corner| corner + 0.5) {
        let (a, b) = (found.world(IndexPos(corner)).0, grid.world(IndexPos(corner)).0);
        prop_assert!(a.distance(b) <= max_shift, "{} {}", a, b);
    }
    let max_change = match volume.voxels() {
        Voxels::F32(_) | Voxels::F64(_) => 1e-6 * range.max - 1e-6 * range.min,
        _ => 1e-2 * volume.rescale().slope().abs(),
    };
    for (a, b) in values(&opened.volume).into_iter().zip(values(volume)) {
        prop_assert!((a - b).abs() <= max_change * (1.0 + 1e-9), "{} {}", a, b);
    }
    prop_assert!(opened.notes.is_empty(), "{:?}", opened.notes);
    Ok(())
}

fn compressions() -> Vec<Compression> {
    match cfg!(feature = "gzip") {
        true => vec![Compression::None, Compression::Lossless],
        false => vec![Compression::None],
    }
}

proptest! {
    #[test]
    fn values_and_place_survive(
        volume in any_volume(any_direction()),
        frame in prop_oneof![Just(WorldFrame::Lps), Just(WorldFrame::Plain)],
    ) {
        for compression in compressions() {
            let mut save_options = SaveOptions::default();
            (save_options.frame, save_options.compression) = (frame, compression);
            check(&volume, "volume.nrrd", &save_options)?;
            check(&volume, "volume.mha", &save_options)?;
        }
    }

    #[cfg(feature = "nifti")]
    #[test]
    fn nifti_keeps_stored_voxels_and_their_rescale(volume in any_volume(any_direction())) {
        for name in ["volume.nii", "volume.nii.gz"] {
            check_nifti(&saved(&volume, name, &SaveOptions::default()), &volume)?;
        }
    }

    #[cfg(feature = "ome-zarr")]
    #[test]
    fn ome_zarr_keeps_values_and_place(volume in any_volume(Just(DMat3::IDENTITY))) {
        for compression in compressions() {
            let mut save_options = SaveOptions::default();
            save_options.compression = compression;
            check(&volume, "volume.ome.zarr", &save_options)?;
        }
    }
}

fn small(direction: DMat3) -> Volume {
    let grid = Grid::from_first_sample(UVec3::new(70, 3, 2), DVec3::ONE, DVec3::ZERO, direction).unwrap();
    Volume::new(grid, (0..420).map(|i| i as u16).collect::<Vec<_>>()).unwrap()
}

#[test]
fn the_end_of_the_name_is_the_format() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |name: &str| {
        let path = folder.path().join(name);
        let message = save(&path, &small(DMat3::IDENTITY), &SaveOptions::default()).unwrap_err().to_string();
        // The same before the volume is there.
        assert_eq!(check_save_path(&path).unwrap_err().to_string(), message);
        message
    };
    for name in ["volume.tif", "volume", ".nrrd", "nrrd"] {
        assert!(
            refusal(name).ends_with("the end of the name is none of .nrrd, .mha, .nii, .nii.gz, .zarr, .vol and .raw")
        );
    }
    let message = refusal("none/volume.nrrd");
    let folders = (folder.path().join("none/volume.nrrd"), folder.path().join("none"));
    assert_eq!(message, format!("{}: there is no folder {}", folders.0.display(), folders.1.display()));
    check_save_path(&folder.path().join("volume.nrrd")).unwrap();
    assert_eq!(folder.path().read_dir().unwrap().count(), 0);
}

#[cfg(feature = "ome-zarr")]
#[test]
fn ome_zarr_is_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("volume.zarr");
    let turned = DMat3::from_cols(DVec3::Y, DVec3::X, DVec3::Z);
    let message = save(&path, &small(turned), &SaveOptions::default()).unwrap_err().to_string();
    assert!(
        message.ends_with(
            "axis x of the volume goes along [0, 1, 0] in the world; save it as .nrrd, .mha, .nii or .nii.gz"
        ),
        "{message}"
    );
    assert_eq!(folder.path().read_dir().unwrap().count(), 0);
    // More than one chunk.
    check(&small(DMat3::IDENTITY), "volume.zarr", &SaveOptions::default()).unwrap();
    save(&path, &small(DMat3::IDENTITY), &SaveOptions::default()).unwrap();
    let message = save(&path, &small(DMat3::IDENTITY), &SaveOptions::default()).unwrap_err().to_string();
    assert!(
        message.contains("volume.zarr: there is one already, and a folder is not replaced; remove it"),
        "{message}"
    );
    assert_eq!(check_save_path(&path).unwrap_err().to_string(), message);
    assert_eq!(folder.path().read_dir().unwrap().count(), 1);
}

#[test]
fn a_format_without_slopes_gets_values_in_another_type_and_says_so() {
    let volume = Volume::rescaled(*small(DMat3::IDENTITY).grid(), vec![7u8; 420], Rescale::new(0.5, 0.25).unwrap());
    let volume = volume.unwrap();
    let said = |name: &str| noted(&volume, name, &SaveOptions::default()).1;
    let note = "MetaImage stores no slope and intercept: u8 samples were saved as their values, in f32";
    assert_eq!(said("v.mha"), [note]);
    assert!(said("v.nrrd")[0].starts_with("NRRD stores no slope"));
    #[cfg(feature = "nifti")]
    assert_eq!(said("v.nii"), [""; 0]);
}

#[test]
fn the_frame_survives_or_its_loss_is_said() {
    let mut save_options = SaveOptions::default();
    for frame in [WorldFrame::Lps, WorldFrame::Pictures, WorldFrame::Plain] {
        save_options.frame = frame;
        let mut names = vec!["v.nrrd", "v.mha"];
        names.extend(cfg!(feature = "ome-zarr").then_some("v.zarr"));
        for name in names {
            let (opened, said) = noted(&small(DMat3::IDENTITY), name, &save_options);
            assert_eq!((opened.frame, said), (frame, vec![]), "{name}");
        }
    }
}

#[cfg(feature = "nifti")]
#[test]
fn nifti_states_no_frame_but_the_patients() {
    let noted = |volume: &Volume, frame: WorldFrame| {
        let mut save_options = SaveOptions::default();
        save_options.frame = frame;
        let (opened, said) = noted(volume, "v.nii", &save_options);
        assert_eq!(opened.volume.grid(), volume.grid());
        (opened.frame, said)
    };
    let turned = small(DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0)));
    assert_eq!(noted(&turned, WorldFrame::Lps), (WorldFrame::Lps, vec![]));
    let lost =
        "NIfTI cannot state the frame Plain (axes without meaning); it is read as Lps (+x left, +y back, +z head)";
    assert_eq!(noted(&turned, WorldFrame::Plain), (WorldFrame::Lps, vec![lost.to_owned()]));
    let lost = "NIfTI cannot state the frame Pictures (+x right, +y down, +z into the stack); it is read as Lps (+x left, \
                +y back, +z head), and cameras by name look from other sides";
    assert_eq!(noted(&turned, WorldFrame::Pictures), (WorldFrame::Lps, vec![lost.to_owned()]));
    // Nothing is stated but the lengths of voxels, and nothing is lost.
    assert_eq!(noted(&small(DMat3::IDENTITY), WorldFrame::Plain), (WorldFrame::Plain, vec![]));
}

#[test]
fn a_raw_file_is_told_how_to_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let saved = save(&folder.path().join("v.raw"), &small(DMat3::IDENTITY), &SaveOptions::default()).unwrap();
    assert!(saved.notes[0].to_string().contains("--raw 70x3x2,u16,spacing=1:1:1 reads it"));
}

#[test]
fn units_survive_where_the_format_has_them() {
    let um = ["um", "\u{b5}m", "\u{3bc}m", "micron", "micrometer"];
    let mut cases = vec![("v.nrrd", "mm", "mm"), ("v.nrrd", "\"", "in"), ("v.mha", "millimeter", "mm")];
    cases.extend(um.map(|unit| ("v.mha", unit, "um")));
    cases.extend(["um", "\u{b5}m", "\u{3bc}m"].map(|unit| ("v.nrrd", unit, "um")));
    if cfg!(feature = "nifti") {
        cases.extend(um.map(|unit| ("v.nii", unit, "um")));
        cases.push(("v.nii", "metre", "m"));
    }
    if cfg!(feature = "ome-zarr") {
        cases.extend(um.map(|unit| ("v.zarr", unit, "micrometer")));
        cases.extend([("v.zarr", "\u{c5}", "angstrom"), ("v.zarr", "in", "inch"), ("v.zarr", "pixel", "pixel")]);
    }
    for (name, unit, expected) in cases {
        let mut save_options = SaveOptions::default();
        save_options.unit = Some(unit.to_owned());
        let (opened, said) = noted(&small(DMat3::IDENTITY), name, &save_options);
        assert_eq!((opened.unit.as_deref(), said), (Some(expected), vec![]), "{name} {unit}");
    }
}

#[test]
fn a_unit_that_the_format_has_not_is_said() {
    let mut save_options = SaveOptions::default();
    save_options.unit = Some("nm".to_owned());
    for (name, format) in [("v.mha", "MetaImage"), ("v.nii", "NIfTI")] {
        if name.ends_with(".nii") && !cfg!(feature = "nifti") {
            continue;
        }
        let (opened, said) = noted(&small(DMat3::IDENTITY), name, &save_options);
        let lost = format!("{format} cannot state the unit \"nm\"; lengths are the same numbers without it");
        assert_eq!((opened.unit, said), (None, vec![lost]));
    }
}

/// Which version a volume is written in: 1 or 2.
#[cfg(feature = "nifti")]
fn nifti_version(volume: &Volume) -> u8 {
    let mut bytes = vec![];
    nifti::write(&mut bytes, volume, &SaveOptions::default()).unwrap();
    match bytes.first_chunk().map(|b| u32::from_le_bytes(*b)) {
        Some(348) => 1,
        Some(540) => 2,
        other => panic!("header of {other:?} bytes"),
    }
}

#[cfg(feature = "nifti")]
#[test]
fn nifti_1_is_written_unless_its_rounding_would_be_seen() {
    let turned = DMat3::from_quat(DQuat::from_euler(EulerRot::XYZ, 0.3, -0.2, 0.1));
    let at = |dims: [u32; 3], spacing: f64, first: f64| {
        let grid = Grid::from_first_sample(dims.into(), DVec3::splat(spacing), DVec3::splat(first), turned).unwrap();
        Volume::new(grid, vec![0u8; grid.n_voxels()]).unwrap()
    };
    assert_eq!(nifti_version(&at([512, 4, 2], 0.1, -123.456)), 1);
    assert_eq!(nifti_version(&at([4, 4, 2], 0.1, 1e4 + 0.3)), 2);
    assert_eq!(nifti_version(&at([4, 4, 2], 1e-46, 0.0)), 2);
    assert_eq!(nifti_version(&at([32_767, 1, 1], 0.5, 0.0)), 1);
    assert_eq!(nifti_version(&at([32_768, 1, 1], 0.5, 0.0)), 2);
    let (_, said) = noted(&at([32_768, 1, 1], 0.5, 0.0), "v.nii", &lps());
    let reason = "dimension x is 32768, and NIfTI-1 has at most 32767";
    assert_eq!(said, [format!("the file is NIfTI-2, which many programs do not open, for {reason}")]);
    assert_eq!(noted(&at([4, 4, 2], 0.1, 0.3), "v.nii.gz", &lps()).1, [""; 0]);
    assert!(
        noted(&at([4, 4, 2], 0.1, 1e5 + 0.3), "v.nii", &lps()).1[0].contains("a corner would move by more than 0.001")
    );
}

#[cfg(feature = "nifti")]
fn lps() -> SaveOptions {
    let mut save_options = SaveOptions::default();
    save_options.frame = WorldFrame::Lps;
    save_options
}

#[cfg(feature = "nifti")]
#[test]
fn nifti_2_keeps_slopes_that_f32_would_change() {
    let version = |voxels: Voxels, slope: f64, intercept: f64| {
        let grid = Grid::axis_aligned(UVec3::new(2, 1, 1), DVec3::ONE).unwrap();
        nifti_version(&Volume::rescaled(grid, voxels, Rescale::new(slope, intercept).unwrap()).unwrap())
    };
    assert_eq!(version(vec![0u16, u16::MAX].into(), 0.1, -1024.1), 1);
    assert_eq!(version(vec![0i32, i32::MAX].into(), 0.1, 0.0), 2);
    assert_eq!(version(vec![0i32, i32::MAX].into(), 0.5, 0.0), 1);
    assert_eq!(version(vec![0u8, 255].into(), 1e-6, 1000.1), 2);
    assert_eq!(version(vec![0u8, 0].into(), 1e-60, 3.0), 2);
    assert_eq!(version(vec![-1f32, 1.0].into(), 0.1, 0.3), 1);
    assert_eq!(version(vec![1e9f64, 1e9 + 1.0].into(), 0.1, 0.0), 2);
}
