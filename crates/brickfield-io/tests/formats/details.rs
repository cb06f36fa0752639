//! Stores whose finest level is details of level 1.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::{fs, io};

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Grid, Level, Objects, Rescale, Scalar, ScalarType, ValueRange, Voxels};
use brickfield_io::ome_zarr::{
    Finest, ObjectRange, PyramidOptions, PyramidWriter, ROOT_DOCUMENT, StatedDocuments, ZarrLevels, stated_documents,
};
use brickfield_io::{Compression, OpenOptions, SaveNote, open};

const DIMS: UVec3 = UVec3::new(75, 40, 69);

fn grid() -> Grid {
    Grid::axis_aligned(DIMS, DVec3::new(0.5, 1.0, 2.0)).unwrap()
}

fn options(rescale: Rescale) -> PyramidOptions {
    let mut options =
        PyramidOptions { coarsest: Level(1), finest: Finest::Details, rescale, ..PyramidOptions::default() };
    options.save.compression = Compression::Lossless;
    options
}

/// A soft ball, noise and the extremes of the type.
fn samples<T: Scalar>(least: f64, most: f64) -> Vec<T> {
    let sample = |i: u32| {
        let p = UVec3::new(i % DIMS.x, i / DIMS.x % DIMS.y, i / DIMS.x / DIMS.y);
        let noise = f64::from(i.wrapping_mul(2_654_435_761) >> 28);
        match i % 997 {
            0 => least,
            1 => most,
            _ => (least / 2.0 + 9.0 * p.as_dvec3().distance(DIMS.as_dvec3() / 2.0) + noise).clamp(least, most),
        }
    };
    (0..DIMS.element_product()).map(|i| T::from_f64(sample(i).round())).collect()
}

/// Means of cells of up to 2 x 2 x 2 samples, rounded to the nearest, halves up.
fn means<T: Scalar>(samples: &[T]) -> Vec<T> {
    let n = Level(1).dims_of(DIMS);
    let mut sums = vec![(0.0, 0.0); n.element_product() as usize];
    for (i, sample) in (0..).zip(samples) {
        let cell = UVec3::new(i % DIMS.x, i / DIMS.x % DIMS.y, i / DIMS.x / DIMS.y) / 2;
        let sum = &mut sums[(cell.x + n.x * (cell.y + n.y * cell.z)) as usize];
        *sum = (sum.0 + sample.to_f64(), sum.1 + 1.0);
    }
    sums.into_iter().map(|(sum, n)| T::from_f64((sum / n + 0.5).floor())).collect()
}

fn write<T: Scalar>(path: &Path, samples: &[T], rescale: Rescale) -> Vec<SaveNote> {
    let mut writer = PyramidWriter::create(path, &grid(), T::TYPE, &options(rescale)).unwrap();
    let notes = writer.notes();
    for slices in samples.chunks((DIMS.x * DIMS.y) as usize * 13) {
        writer.push(Level(0), T::wrap(slices.to_vec())).unwrap();
    }
    writer.push(Level(1), T::wrap(means(samples))).unwrap();
    writer.finish().unwrap();
    notes
}

fn comes_back<T: Scalar>(least: f64, most: f64) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("head.zarr");
    let written: Vec<T> = samples(least, most);
    assert_eq!(write(&path, &written, Rescale::IDENTITY), [SaveNote::DetailsOwn]);
    let read = open(&path, &OpenOptions::default()).unwrap();
    assert_eq!((read.volume.voxels(), read.volume.grid()), (&T::wrap(written.clone()), &grid()));
    let levels = ZarrLevels::open(&path, &OpenOptions::default(), 1 << 20).unwrap();
    assert_eq!((levels.n_levels(), levels.shifts(1)), (2, Some(UVec3::ONE)));
    assert_eq!(levels.box_voxels(1, UVec3::ZERO, levels.dims(1)).unwrap(), T::wrap(means(&written)));
    for (first, extent) in [(UVec3::ZERO, UVec3::ONE), (UVec3::new(30, 31, 63), UVec3::new(45, 9, 6))] {
        let end = first + extent;
        let row = |y: u32, z: u32| (DIMS.x * (y + DIMS.y * z) + first.x) as usize;
        let rows = (first.z..end.z).flat_map(|z| (first.y..end.y).map(move |y| (y, z)));
        let expected = rows.flat_map(|(y, z)| written[row(y, z)..][..extent.x as usize].to_vec()).collect();
        assert_eq!(levels.box_voxels(0, first, extent).unwrap(), T::wrap(expected));
    }
}

#[test]
fn samples_of_every_integer_type_come_back() {
    comes_back::<u8>(0.0, 255.0);
    comes_back::<i8>(-128.0, 127.0);
    comes_back::<u16>(0.0, 65_535.0);
    comes_back::<i16>(-32_768.0, 32_767.0);
    comes_back::<u32>(0.0, 4_294_967_295.0);
    comes_back::<i32>(-2_147_483_648.0, 2_147_483_647.0);
}

#[test]
fn slope_and_intercept_are_kept_beside_stored_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("head.zarr");
    let rescale = Rescale::new(0.5, -1024.0).unwrap();
    let notes = write::<u8>(&path, &samples(0.0, 255.0), rescale);
    assert_eq!(notes, [SaveNote::RescaleOwn, SaveNote::DetailsOwn]);
    let volume = open(&path, &OpenOptions::default()).unwrap().volume;
    assert_eq!((volume.scalar_type(), volume.rescale()), (ScalarType::U8, rescale));
    assert_eq!(volume.range(), ValueRange { min: -1024.0, max: -896.5 });
    assert_eq!(ZarrLevels::open(&path, &OpenOptions::default(), 0).unwrap().facts().rescale, rescale);
    // A wrong one is an error.
    edit(&path.join("zarr.json"), |text| text.replace("\"slope\": 0.5", "\"slope\": 0.0"));
    let fault = open(&path, &OpenOptions::default()).unwrap_err().to_string();
    assert!(fault.contains("brickfield_rescale") && fault.contains("a finite slope"), "{fault}");
}

/// Level 1 is an ordinary image; what it has nothing of is level 0.
#[test]
fn the_metadata_of_ome_zarr_begin_with_level_1() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("head.zarr");
    let written = samples(0.0, 255.0);
    write::<u8>(&path, &written, Rescale::IDENTITY);
    assert!(!path.join("0").exists());
    edit(&path.join("zarr.json"), |text| text.replace("brickfield_details\"", "somebody_else\""));
    let read = open(&path, &OpenOptions::default()).unwrap();
    assert_eq!(read.volume.voxels(), &Voxels::U8(means(&written)));
    assert_eq!(read.volume.grid().spacing(), 2.0 * grid().spacing());
}

#[test]
fn floats_and_volumes_without_level_1_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("head.zarr");
    let refused = |scalar, coarsest| {
        let options = PyramidOptions { coarsest: Level(coarsest), ..options(Rescale::IDENTITY) };
        PyramidWriter::create(&path, &grid(), scalar, &options).err().unwrap().to_string()
    };
    assert!(refused(ScalarType::F32, 3).contains("details are those of integers, and the samples are f32"));
    assert!(refused(ScalarType::U8, 0).contains("its coarsest level must be at least 1"));
    assert!(!path.exists());
}

fn edit(path: &Path, change: impl Fn(&str) -> String) {
    let text = fs::read_to_string(path).unwrap();
    let changed = change(&text);
    assert_ne!(text, changed);
    fs::write(path, changed).unwrap();
}

/// A store with a chunk that is damaged, lost, or of another extent or type is an error, which names the chunk.
#[test]
fn damaged_details_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("head.zarr");
    write::<u8>(&path, &samples(0.0, 255.0), Rescale::IDENTITY);
    let shard = path.join("brickfield_details/0/c/0/0/0");
    let intact = fs::read(&shard).unwrap();
    let fault = || open(&path, &OpenOptions::default()).unwrap_err().to_string();
    for at in (0..intact.len()).step_by(intact.len() / 37) {
        let mut damaged = intact.clone();
        damaged[at] ^= 16;
        fs::write(&shard, damaged).unwrap();
        let fault = fault();
        assert!(fault.contains("array \"brickfield_details/0\""), "byte {at}: {fault}");
    }
    fs::write(&shard, &intact[..intact.len() - 1]).unwrap();
    assert!(fault().contains("expected within the"), "{}", fault());
    fs::remove_file(&shard).unwrap();
    assert!(fault().contains("is lost"), "{}", fault());
    fs::write(&shard, &intact).unwrap();
    let metadata = path.join("brickfield_details/0/zarr.json");
    edit(&metadata, |text| text.replace("\"uint8\"", "\"int8\""));
    assert!(fault().contains("of their type"), "{}", fault());
    edit(&metadata, |text| text.replace("\"int8\"", "\"uint8\""));
    // Another volume's details.
    edit(&metadata, |text| text.replacen("75", "73", 1));
    assert!(fault().contains("level of details"), "{}", fault());
}

/// The objects of a folder.
struct Folder(PathBuf);

impl Objects for Folder {
    fn n_bytes(&self, key: &str) -> io::Result<Option<u64>> {
        Ok(fs::metadata(self.0.join(key)).ok().map(|m| m.len()))
    }

    fn read(&self, key: &str, ranges: &[Range<u64>]) -> io::Result<Option<Vec<Vec<u8>>>> {
        let Ok(bytes) = fs::read(self.0.join(key)) else { return Ok(None) };
        let part = |range: &Range<u64>| bytes.get(range.start as usize..range.end as usize).map(<[u8]>::to_vec);
        let parts: Option<Vec<_>> = ranges.iter().map(part).collect();
        parts.map(Some).ok_or(io::ErrorKind::UnexpectedEof.into())
    }
}

#[test]
fn objects_are_read_as_files_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("head.zarr");
    let written = samples(0.0, 255.0);
    write::<u8>(&path, &written, Rescale::IDENTITY);
    let objects = Arc::new(Folder(path.clone()));
    let levels = ZarrLevels::of_objects(objects.clone(), &path, &OpenOptions::default(), 1 << 20).unwrap();
    assert_eq!(levels.box_voxels(0, UVec3::ZERO, DIMS).unwrap(), Voxels::U8(written));
    // Indices and chunks are all the bytes of all shards.
    for level in 0..2 {
        let chunks = levels.stored_chunks(level).unwrap();
        let n_voxels: u64 = chunks.iter().map(|chunk| chunk.extent.as_u64vec3().element_product()).sum();
        assert_eq!(n_voxels, levels.dims(level).as_u64vec3().element_product());
        let ranges = levels.indices(level).into_iter().chain(chunks.iter().map(|chunk| chunk.bytes.clone()));
        let mut left: BTreeMap<String, u64> = BTreeMap::new();
        for ObjectRange { key, range } in ranges {
            let range = range.unwrap();
            *left.entry(key.clone()).or_insert_with(|| objects.n_bytes(&key).unwrap().unwrap()) -=
                range.end - range.start;
        }
        assert!(left.values().all(|n| *n == 0), "{left:?}");
        let shards: Vec<_> = levels.whole_level(level).into_iter().map(|whole| whole.key).collect();
        assert_eq!(left.keys().cloned().collect::<Vec<_>>(), shards);
        assert!(
            chunks.iter().all(|chunk| chunk.bytes.range.as_ref().is_some_and(|r| r.end - r.start == chunk.n_bytes))
        );
    }
}

/// One request finds the documents that every program reads.
#[test]
fn the_root_document_has_those_of_all_levels() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("head.zarr");
    write::<u8>(&path, &samples(0.0, 255.0), Rescale::IDENTITY);
    let StatedDocuments { stated, others } = stated_documents(&fs::read(path.join(ROOT_DOCUMENT)).unwrap()).unwrap();
    assert_eq!((stated.len(), &others[..]), (1, &["brickfield_details/0/zarr.json".to_owned()][..]));
    let json = |bytes: &[u8]| serde_json::from_slice::<serde_json::Value>(bytes).unwrap();
    for (key, bytes) in stated {
        assert_eq!(json(&bytes), json(&fs::read(path.join(key)).unwrap()));
    }
    assert!(stated_documents(b"{").is_err());
    assert_eq!(stated_documents(b"{}").unwrap(), StatedDocuments::default());
}
