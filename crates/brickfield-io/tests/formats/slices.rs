//! Volumes slice by slice are the volumes that are read whole.

use std::fs;
use std::path::Path;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Grid, Scalar, ScalarType, Volume, Voxels, with_voxels};
use brickfield_io::{
    Compression, Note, OpenOptions, RawSpec, SaveOptions, SliceSource, VolumeFacts, open, open_raw, open_raw_slices,
    open_slices, save,
};

use crate::common::*;

const DIMS: UVec3 = UVec3::new(7, 5, 11);

fn volume(scalar: ScalarType) -> Volume {
    let grid = Grid::axis_aligned(DIMS, DVec3::new(0.5, 0.25, 2.0)).unwrap();
    let numbers = (0..DIMS.element_product()).map(|i| f64::from(i.wrapping_mul(2_654_435_761) >> 25));
    let voxels = match scalar {
        ScalarType::U8 => Voxels::from(numbers.map(|v| v as u8).collect::<Vec<_>>()),
        ScalarType::I16 => Voxels::from(numbers.map(|v| (100.0 * v - 5000.0) as i16).collect::<Vec<_>>()),
        _ => Voxels::from(numbers.map(|v| (v / 7.0) as f32).collect::<Vec<_>>()),
    };
    Volume::new(grid, voxels).unwrap()
}

/// All voxels, `n` slices at a time, and the facts at the end.
fn read_all(mut slices: Box<dyn SliceSource>, n: u32) -> (Voxels, VolumeFacts) {
    fn appended<T: Scalar>(all: Voxels, more: &[T]) -> Voxels {
        let mut values: Vec<T> = (0..all.len()).map(|i| T::from_f64(all.at(i))).collect();
        values.extend_from_slice(more);
        T::wrap(values)
    }
    let dims = slices.facts().grid.dims();
    let (mut all, mut n_read) = (Voxels::U8(Vec::new()), 0);
    loop {
        let more = slices.next_slices(n).unwrap();
        assert_eq!(more.len(), (n.min(dims.z - n_read) * dims.x * dims.y) as usize);
        n_read = dims.z.min(n_read + n);
        if more.is_empty() {
            return (all, slices.facts().clone());
        }
        all = with_voxels!(&more, v => appended(all, v));
    }
}

fn assert_same(path: &Path) {
    let whole = open(path, &OpenOptions::default()).unwrap();
    for n in [1, 3, 11, 40] {
        let (voxels, facts) = read_all(open_slices(path, &OpenOptions::default()).unwrap(), n);
        assert_eq!(&voxels, whole.volume.voxels(), "{}", path.display());
        assert_eq!(facts.notes, whole.notes);
        assert_eq!((&facts.grid, facts.scalar), (whole.volume.grid(), whole.volume.scalar_type()));
        assert_eq!((facts.rescale, facts.frame, facts.unit), (whole.volume.rescale(), whole.frame, whole.unit.clone()));
        assert_eq!((facts.format, facts.choices), (whole.format, whole.choices.clone()));
    }
}

#[test]
fn slices_of_every_format_are_those_of_the_volume() {
    let folder = tempfile::tempdir().unwrap();
    let ends = [
        "nrrd",
        "mha",
        #[cfg(feature = "nifti")]
        "nii",
        #[cfg(feature = "nifti")]
        "nii.gz",
        #[cfg(feature = "ome-zarr")]
        "zarr",
    ];
    for scalar in [ScalarType::U8, ScalarType::I16, ScalarType::F32] {
        for compression in [
            Compression::None,
            #[cfg(feature = "gzip")]
            Compression::Lossless,
        ] {
            for end in ends {
                let path = folder.path().join(format!("{scalar}-{compression:?}.{end}"));
                let mut options = SaveOptions::default();
                (options.compression, options.unit) = (compression, Some("mm".to_owned()));
                save(&path, &volume(scalar), &options).unwrap();
                assert_same(&path);
            }
        }
    }
}

#[test]
fn the_limit_is_none_of_the_volume() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nrrd");
    save(&path, &volume(ScalarType::U8), &SaveOptions::default()).unwrap();
    let mut options = OpenOptions::default();
    options.limits.max_bytes = 100;
    assert!(open(&path, &options).is_err());
    assert_eq!(&read_all(open_slices(&path, &options).unwrap(), 2).0, volume(ScalarType::U8).voxels());
}

#[test]
fn raw_slices_follow_the_callers_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.raw");
    let mut bytes = vec![9; 13];
    bytes.extend((0..2 * DIMS.element_product()).map(|i| (i * 7) as u8));
    fs::write(&path, &bytes).unwrap();
    let mut spec = RawSpec::new(DIMS, ScalarType::I16);
    (spec.skip_bytes, spec.order) = (13, brickfield_io::ByteOrder::Big);
    let whole = open_raw(&path, &spec, &OpenOptions::default()).unwrap();
    let (voxels, facts) = read_all(open_raw_slices(&path, &spec, &OpenOptions::default()).unwrap(), 4);
    assert_eq!((&voxels, &facts.grid), (whole.volume.voxels(), whole.volume.grid()));
    spec.dims.z += 1;
    let short = open_raw_slices(&path, &spec, &OpenOptions::default()).err().unwrap().to_string();
    assert!(short.contains("a.raw: the file holds 770 bytes; 840 are promised"), "{short}");
}

#[test]
fn slices_in_several_files_and_in_text() {
    let folder = tempfile::tempdir().unwrap();
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 3 6\n";
    let numbers: Vec<u8> = (0..72).collect();
    for i in 0..3 {
        fs::write(folder.path().join(format!("part{i}.raw")), &numbers[i * 24..(i + 1) * 24]).unwrap();
    }
    let list = folder.path().join("list.nhdr");
    fs::write(&list, format!("{header}encoding: raw\ndata file: part%d.raw 0 2 1\n")).unwrap();
    assert_same(&list);
    let text = folder.path().join("text.nrrd");
    let written: Vec<_> = numbers.iter().map(u8::to_string).collect();
    fs::write(&text, format!("{header}encoding: ascii\n\n{}\n", written.join(" "))).unwrap();
    assert_same(&text);
    // More data than promised are noted at the end.
    let long = folder.path().join("long.nrrd");
    let mut bytes = format!("{header}encoding: raw\n\n").into_bytes();
    bytes.extend(0..80);
    fs::write(&long, bytes).unwrap();
    let (_, facts) = read_all(open_slices(&long, &OpenOptions::default()).unwrap(), 2);
    assert_eq!(facts.notes.last(), Some(&Note::SurplusData));
    // A file that is missing is missed at once.
    fs::remove_file(folder.path().join("part2.raw")).unwrap();
    let missing = open_slices(&list, &OpenOptions::default()).err().unwrap().to_string();
    assert!(missing.contains("data file \"part2.raw\""), "{missing}");
}

#[test]
fn of_a_series_the_wanted_volume_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("series.nrrd");
    let mut bytes =
        b"NRRD0004\ntype: uint8\ndimension: 4\nsizes: 3 2 4 5\nkinds: space space space time\nencoding: raw\n\n"
            .to_vec();
    bytes.extend(0..120);
    fs::write(&path, bytes).unwrap();
    let mut options = OpenOptions::default();
    options.wanted.want(brickfield_io::ChoiceKind::Time, "3");
    let (voxels, facts) = read_all(open_slices(&path, &options).unwrap(), 3);
    assert_eq!(voxels, Voxels::from((72..96).collect::<Vec<u8>>()));
    assert_eq!(facts.choices[0].read, 3);
}

#[test]
#[cfg(feature = "gzip")]
fn damage_is_met_where_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nrrd");
    let mut bytes = b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 64 64 200\nencoding: gzip\n\n".to_vec();
    let numbers: Vec<u8> = (0..64u32 * 64 * 200).map(|i| i.wrapping_mul(2_654_435_761).to_le_bytes()[3]).collect();
    let packed = gzip(&numbers);
    bytes.extend(&packed[..packed.len() * 3 / 4]);
    fs::write(&path, bytes).unwrap();
    let mut slices = open_slices(&path, &OpenOptions::default()).unwrap();
    assert_eq!(slices.next_slices(8).unwrap(), Voxels::from(numbers[..8 * 4096].to_vec()));
    let fault = slices.next_slices(192).unwrap_err().to_string();
    assert!(fault.starts_with("slices 8 to 199 of the data after the header holds"), "{fault}");
    assert!(fault.contains("cut off"), "{fault}");
}

#[test]
fn what_cannot_be_read_in_order_is_read_whole_with_a_note() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wide.nrrd");
    let mut bytes = b"NRRD0004\ntype: int64\ndimension: 3\nsizes: 2 2 3\nendian: little\nencoding: raw\n\n".to_vec();
    bytes.extend((0..12i64).flat_map(|i| (i * 30).to_le_bytes()));
    fs::write(&path, bytes).unwrap();
    let (voxels, facts) = read_all(open_slices(&path, &OpenOptions::default()).unwrap(), 2);
    assert_eq!(voxels, Voxels::from((0..12).map(|i| i * 30).collect::<Vec<u16>>()));
    assert_eq!(facts.notes.last(), Some(&Note::ReadWhole { n_bytes: 24 }));
}
