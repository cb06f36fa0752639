//! Stores on disk are the blocks of the volume in memory.

#![cfg(feature = "formats")]

use std::fs;
use std::path::Path;
use std::sync::Arc;

use brickfield::bricks::{BlockOptions, BlockSource, BlockVolume, build_blocks, fetch_values};
use brickfield::core::glam::{DMat3, DVec3, UVec3};
use brickfield::core::{BlockSide, Grid, Level, Rescale, Scalar, ScalarType, ValueRange, Volume, Voxels};
use brickfield::io::{Note, OpenOptions, SaveNote, SaveOptions, open, open_slices, save};
use brickfield::{Codec, PackError, PackProgress, Packed, StoreBlocks, StoreLimits, pack};

fn grid(dims: UVec3) -> Grid {
    Grid::from_first_sample(dims, DVec3::new(0.5, 1.0, 3.0), DVec3::new(7.0, -8.0, 9.0), DMat3::IDENTITY).unwrap()
}

fn noise(dims: UVec3, scalar: ScalarType) -> Voxels {
    fn of<T: Scalar>(values: impl Iterator<Item = f64>) -> Voxels {
        T::wrap(values.map(T::from_f64).collect())
    }
    // A part of one value, then noise.
    let n = dims.element_product();
    let values = (0..n).map(|i| if i < n / 4 { 5.0 } else { f64::from(i.wrapping_mul(2_654_435_761) >> 24) });
    match scalar {
        ScalarType::U8 => of::<u8>(values),
        ScalarType::I8 => of::<i8>(values.map(|v| v - 128.0)),
        ScalarType::U16 => of::<u16>(values.map(|v| 200.0 * v)),
        ScalarType::I16 => of::<i16>(values.map(|v| 200.0 * v - 20_000.0)),
        ScalarType::U32 => of::<u32>(values.map(|v| 1e7 * v)),
        ScalarType::I32 => of::<i32>(values.map(|v| 1e7 * (v - 128.0))),
        ScalarType::F32 => of::<f32>(values.map(|v| v / 3.0)),
        ScalarType::F64 => of::<f64>(values.map(|v| v / 3.0)),
    }
}

fn blocks(volume: &Volume, side: BlockSide) -> BlockVolume {
    build_blocks(Arc::new(volume.clone()), &BlockOptions { side, max_bytes: None }).unwrap()
}

/// Saves a volume and packs it.
fn packed(folder: &Path, volume: &Volume, end: &str) -> Packed {
    packed_by(Codec::Zstd, folder, volume, end)
}

fn packed_by(codec: Codec, folder: &Path, volume: &Volume, end: &str) -> Packed {
    let file = folder.join(format!("volume.{end}"));
    save(&file, volume, &SaveOptions::default()).unwrap();
    let mut last = None;
    let mut told = |p: PackProgress| last = Some(p);
    let mut opened = || open_slices(&file, &OpenOptions::default());
    let packed = pack(&file, &mut opened, &folder.join("store.zarr"), codec, &mut told).unwrap();
    assert!(last.is_some_and(|p| p.n_done == p.n_total && p.n_total > 0));
    packed
}

fn store(folder: &Path, side: BlockSide) -> StoreBlocks {
    let limits = StoreLimits::default();
    StoreBlocks::open(&folder.join("store.zarr"), side, limits, &OpenOptions::default(), &mut |_| {}).unwrap()
}

/// Every block of every level, within a tolerance.
fn assert_same(found: &StoreBlocks, expected: &BlockVolume, tolerance: f64) {
    assert_eq!(found.layout(), expected.layout());
    assert_eq!((found.scalar_type(), found.range()), (expected.scalar_type(), expected.range()));
    assert_eq!(found.summaries(), expected.summaries());
    for block in expected.layout().blocks() {
        for level in expected.layout().side().levels() {
            let [a, b] = [found as &dyn BlockSource, expected].map(|s| fetch_values(s, block, level).unwrap());
            assert_eq!(a.len(), b.len());
            let far = a.iter().zip(&b).find(|(a, b)| (**a - **b).abs() > tolerance);
            assert_eq!(far, None, "block {block} of level {}", level.0);
        }
    }
}

const DIMS: UVec3 = UVec3::new(70, 37, 67);

#[test]
fn a_packed_store_has_the_blocks_of_the_volume() {
    for scalar in ScalarType::ALL {
        let folder = tempfile::tempdir().unwrap();
        let volume = Volume::new(grid(DIMS), noise(DIMS, scalar)).unwrap();
        let packed = packed(folder.path(), &volume, "nrrd");
        assert_eq!((packed.scalar, packed.coarsest, packed.notes), (scalar, Level(5), vec![]));
        let tolerance = if scalar == ScalarType::F64 { 1e-12 } else { 0.0 };
        for side in BlockSide::ALL {
            let found = store(folder.path(), side);
            assert_same(&found, &blocks(&volume, side), tolerance);
            assert_eq!(found.grid().index_to_world(), volume.grid().index_to_world());
        }
        let opened = open(&folder.path().join("store.zarr"), &OpenOptions::default()).unwrap();
        assert_eq!(opened.volume.voxels(), volume.voxels());
    }
}

/// Details and level 1 make the same blocks as arrays of both.
#[test]
fn a_store_of_details_has_the_blocks_of_the_volume() {
    let rescale = Rescale::new(0.5, -1024.0).unwrap();
    for (scalar, rescale) in [(ScalarType::U8, rescale), (ScalarType::I16, Rescale::IDENTITY)] {
        let folder = tempfile::tempdir().unwrap();
        let volume = Volume::rescaled(grid(DIMS), noise(DIMS, scalar), rescale).unwrap();
        let packed = packed_by(Codec::Haar, folder.path(), &volume, "nii");
        assert_eq!(packed.scalar, scalar);
        assert!(packed.notes.contains(&SaveNote::DetailsOwn), "{:?}", packed.notes);
        for side in BlockSide::ALL {
            let found = store(folder.path(), side);
            // Noise takes as many bytes as its voxels.
            let (n_bytes, of_level_0) = (found.n_bytes_read(), (volume.voxels().len() * scalar.n_bytes()) as u64);
            assert!((1..of_level_0).contains(&n_bytes), "summaries are read, not made anew: {n_bytes} bytes");
            assert_same(&found, &blocks(&volume, side), 0.0);
            assert_eq!((found.rescale(), found.range()), (rescale, volume.range()));
        }
        let opened = open(&folder.path().join("store.zarr"), &OpenOptions::default()).unwrap();
        assert_eq!(opened.volume.voxels(), volume.voxels());
    }
}

#[test]
fn the_codec_of_integers_refuses_floats_before_it_begins() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.nrrd");
    save(&file, &Volume::new(grid(DIMS), noise(DIMS, ScalarType::F32)).unwrap(), &SaveOptions::default()).unwrap();
    let mut opened = || open_slices(&file, &OpenOptions::default());
    let out = folder.path().join("store.zarr");
    let fault = pack(&file, &mut opened, &out, Codec::Haar, &mut |_| panic!("work was done")).unwrap_err();
    assert!(matches!(fault, PackError::Floats { scalar: ScalarType::F32, .. }), "{fault}");
    assert!(!out.exists());
}

#[test]
fn only_what_is_fetched_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let volume = Volume::new(grid(DIMS), noise(DIMS, ScalarType::U16)).unwrap();
    packed(folder.path(), &volume, "nrrd");
    let found = store(folder.path(), BlockSide::V16);
    let of_summaries = found.n_bytes_read();
    let mut out = Vec::new();
    found.fetch(UVec3::ZERO, Level(4), &mut out).unwrap();
    let one = found.n_bytes_read() - of_summaries;
    assert!((1..2000).contains(&one), "{one} bytes for one sample");
    for block in found.layout().blocks() {
        found.fetch(block, Level(4), &mut out).unwrap();
    }
    assert_eq!(found.n_bytes_read() - of_summaries, one, "all blocks at one sample lie in one chunk");
    assert!(found.n_bytes_kept() < 100_000);
    found.fetch(UVec3::ZERO, Level(0), &mut out).unwrap();
    assert!(found.n_bytes_read() - of_summaries > one + 1000);
}

#[test]
fn directions_and_rescaled_values_survive() {
    let folder = tempfile::tempdir().unwrap();
    let steps = DMat3::from_rotation_z(0.3) * DMat3::from_diagonal(DVec3::new(-1.0, 2.0, 3.0));
    let grid = Grid::from_first_sample(DIMS, DVec3::new(1.0, 2.0, 3.0), DVec3::new(7.0, -8.0, 9.0), steps).unwrap();
    let rescale = Rescale::new(0.5, -1024.0).unwrap();
    let volume = Volume::rescaled(grid, noise(DIMS, ScalarType::U16), rescale).unwrap();
    let packed = packed(folder.path(), &volume, "nii");
    assert_eq!(packed.scalar, ScalarType::F32);
    assert!(matches!(packed.notes[..], [SaveNote::DirectionOwn, SaveNote::ValuesStored { .. }]), "{:?}", packed.notes);
    let opened = open(&folder.path().join("store.zarr"), &OpenOptions::default()).unwrap();
    let [a, b] = [&opened.volume, &volume].map(|v| v.grid().index_to_world());
    assert!((a.matrix3 - b.matrix3).to_cols_array().into_iter().all(|d| d.abs() < 1e-6));
    assert!((0..1000).all(|i| opened.volume.value(i * 17) == volume.value(i * 17)));
    assert_eq!(store(folder.path(), BlockSide::V32).range(), volume.range());
}

#[test]
fn voxels_that_are_not_finite_are_replaced_as_in_a_volume() {
    let folder = tempfile::tempdir().unwrap();
    let mut values: Vec<f32> = (0..DIMS.element_product()).map(|i| (i % 1000) as f32).collect();
    (values[7], values[90_000], values[170_000]) = (f32::NAN, f32::INFINITY, f32::NEG_INFINITY);
    let volume = Volume::new(grid(DIMS), values.clone()).unwrap();
    let raw = folder.path().join("a.nrrd");
    let mut bytes = b"NRRD0004\ntype: float\ndimension: 3\nsizes: 70 37 67\nendian: little\nencoding: raw\n\n".to_vec();
    bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    fs::write(&raw, bytes).unwrap();
    let mut opened = || open_slices(&raw, &OpenOptions::default());
    let store_path = folder.path().join("store.zarr");
    let packed = pack(&raw, &mut opened, &store_path, Codec::Zstd, &mut |_| {}).unwrap();
    let counts = volume.non_finite();
    assert_eq!(packed.facts.notes, [Note::NonFinite { counts, low: 0.0, high: 999.0 }]);
    assert_same(&store(folder.path(), BlockSide::V16), &blocks(&volume, BlockSide::V16), 0.0);
    assert_eq!(store(folder.path(), BlockSide::V16).note(), None);
    // Those in a store of somebody else, too.
    fs::remove_dir_all(&store_path).unwrap();
    others_store(&store_path, DIMS, &values, &[]);
    assert_same(&store(folder.path(), BlockSide::V16), &blocks(&volume, BlockSide::V16), 1e-3);
    assert_eq!(store(folder.path(), BlockSide::V16).note(), Some(Note::NonFinite { counts, low: 0.0, high: 999.0 }));
}

/// A packed store, and the notes with which it is opened after its arrays `names` were taken from another store.
fn after_an_edit(folder: &Path, names: &[&str]) -> (StoreBlocks, Vec<Note>) {
    let [first, second] = ["first", "second"].map(|name| folder.join(name));
    for (part, values) in [(&first, noise(DIMS, ScalarType::U8)), (&second, Voxels::U8(vec![9; 70 * 37 * 67]))] {
        fs::create_dir_all(part).unwrap();
        packed(part, &Volume::new(grid(DIMS), values).unwrap(), "nrrd");
    }
    for name in names {
        let [to, from] = [&first, &second].map(|part| part.join("store.zarr").join(name));
        fs::remove_dir_all(&to).unwrap();
        fs::rename(from, to).unwrap();
    }
    let found = store(&first, BlockSide::V16);
    let notes = found.facts().notes.clone();
    (found, notes)
}

#[test]
fn summaries_of_other_samples_are_not_taken() {
    let folders = [(); 4].map(|()| tempfile::tempdir().unwrap());
    let (found, notes) = after_an_edit(folders[0].path(), &[]);
    assert_eq!((found.range(), notes), (ValueRange { min: 0.0, max: 255.0 }, vec![]));
    let nine = ValueRange { min: 9.0, max: 9.0 };
    let (found, notes) = after_an_edit(folders[1].path(), &["0", "1", "2", "3", "4", "5"]);
    assert_eq!((found.range(), notes), (nine, vec![Note::ChangedStore]));
    assert!(found.summaries().iter().all(|summary| summary.mean == 9.0 && summary.range == nine));
    // The finest level alone, and the coarsest alone: those may be one byte.
    assert_eq!(after_an_edit(folders[2].path(), &["0"]).1, [Note::ChangedStore]);
    assert_eq!(after_an_edit(folders[3].path(), &["5"]).1, [Note::ChangedStore]);
}

/// OME-Zarr 0.4 of f32 with chunks of 20 samples a side; each further level halves some axes.
fn others_store(path: &Path, dims: UVec3, voxels: &[f32], halved: &[UVec3]) {
    let mut datasets = Vec::new();
    let (mut samples, mut shifts) = (voxels.to_vec(), UVec3::ZERO);
    let mut n = dims;
    for level in 0..=halved.len() {
        if level > 0 {
            let half = halved[level - 1];
            let voxels = Voxels::F32(samples);
            // Each level from the voxels of the one before: the counts of odd ends do not matter here.
            let step = UVec3::ONE << half;
            let m = (n - 1) / step + 1;
            samples = halved_samples(&voxels, n, step, m);
            (n, shifts) = (m, shifts + half);
        }
        let s = (UVec3::ONE << shifts).as_dvec3() * DVec3::new(0.5, 1.0, 3.0);
        datasets.push(format!(
            r#"{{"path":"s{level}","coordinateTransformations":[{{"type":"scale","scale":[1,{},{},{}]}},{{"type":"translation","translation":[0,9,-8,7]}}]}}"#,
            s.z, s.y, s.x
        ));
        write_array(&path.join(format!("s{level}")), n, &samples);
    }
    let axes = r#"[{"name":"c","type":"channel"},{"name":"z","type":"space"},{"name":"y","type":"space"},{"name":"x","type":"space"}]"#;
    let datasets = datasets.join(",");
    let attributes = format!(r#"{{"multiscales":[{{"version":"0.4","axes":{axes},"datasets":[{datasets}]}}]}}"#);
    fs::write(path.join(".zattrs"), attributes).unwrap();
    fs::write(path.join(".zgroup"), r#"{"zarr_format":2}"#).unwrap();
}

fn halved_samples(voxels: &Voxels, n: UVec3, step: UVec3, m: UVec3) -> Vec<f32> {
    let at = |p: UVec3| voxels.at((p.x + n.x * (p.y + n.y * p.z)) as usize);
    let mut out = Vec::new();
    for i in 0..m.element_product() {
        let first = UVec3::new(i % m.x, i / m.x % m.y, i / m.x / m.y) * step;
        let end = (first + step).min(n);
        let (mut sum, mut count) = (0.0, 0.0);
        for z in first.z..end.z {
            for y in first.y..end.y {
                for x in first.x..end.x {
                    sum += at(UVec3::new(x, y, z));
                    count += 1.0;
                }
            }
        }
        out.push((sum / count) as f32);
    }
    out
}

fn write_array(path: &Path, n: UVec3, samples: &[f32]) {
    const SIDE: u32 = 20;
    fs::create_dir_all(path).unwrap();
    let metadata = format!(
        r#"{{"zarr_format":2,"shape":[1,{},{},{}],"chunks":[1,{SIDE},{SIDE},{SIDE}],"dtype":"<f4","compressor":null,"fill_value":0,"order":"C","filters":null,"dimension_separator":"/"}}"#,
        n.z, n.y, n.x
    );
    fs::write(path.join(".zarray"), metadata).unwrap();
    let n_chunks = (n - 1) / SIDE + 1;
    for c in 0..n_chunks.element_product() {
        let c = UVec3::new(c % n_chunks.x, c / n_chunks.x % n_chunks.y, c / n_chunks.x / n_chunks.y);
        let sample = |i: u32| {
            let p = c * SIDE + UVec3::new(i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE);
            let is_inside = p.cmplt(n).all();
            if is_inside { samples[(p.x + n.x * (p.y + n.y * p.z)) as usize] } else { 0.0 }
        };
        let bytes: Vec<u8> = (0..SIDE.pow(3)).flat_map(|i| sample(i).to_le_bytes()).collect();
        let folder = path.join(format!("0/{}/{}", c.z, c.y));
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join(c.x.to_string()), bytes).unwrap();
    }
}

#[test]
fn levels_that_others_lack_are_averaged_from_finer_ones() {
    let values: Vec<f32> = (0..DIMS.element_product()).map(|i| (i.wrapping_mul(2_654_435_761) >> 22) as f32).collect();
    let volume = Volume::new(grid(DIMS), values.clone()).unwrap();
    let (xy, all) = (UVec3::new(1, 1, 0), UVec3::ONE);
    for halved in [&[][..], &[xy], &[xy, xy], &[all], &[xy, all, all]] {
        let folder = tempfile::tempdir().unwrap();
        others_store(&folder.path().join("store.zarr"), DIMS, &values, halved);
        for side in BlockSide::ALL {
            let found = store(folder.path(), side);
            // Levels are averages of averages there, each rounded; those of uneven ends weigh otherwise.
            let tolerance = if halved.len() < 2 { 1e-3 } else { 200.0 };
            assert_same(&found, &blocks(&volume, side), tolerance);
            assert_eq!(found.n_missing_chunks(), 0);
        }
    }
    // Less is read if the store has the level.
    let read_for = |halved: &[UVec3]| {
        let folder = tempfile::tempdir().unwrap();
        others_store(&folder.path().join("store.zarr"), DIMS, &values, halved);
        let found = store(folder.path(), BlockSide::V16);
        let before = found.n_bytes_read();
        found.layout().blocks().for_each(|block| found.fetch(block, Level(2), &mut Vec::new()).unwrap());
        found.n_bytes_read() - before
    };
    // Kept from the pass of the summaries.
    assert_eq!(read_for(&[]), 0);
    assert_eq!(read_for(&[all, all]), 32_000);
}

#[test]
fn a_chunk_that_is_not_stored_is_filled_or_lost() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("store.zarr");
    let values: Vec<f32> = (0..DIMS.element_product()).map(|i| 1.0 + (i % 7) as f32).collect();
    others_store(&path, DIMS, &values, &[]);
    fs::remove_file(path.join("s0/0/1/1/1")).unwrap();
    let found = store(folder.path(), BlockSide::V16);
    assert_eq!(found.range(), ValueRange { min: 0.0, max: 7.0 });
    assert!(found.n_missing_chunks() > 0);
    // Of a store that was packed whole it is an error, which says where.
    fs::remove_dir_all(&path).unwrap();
    packed(folder.path(), &Volume::new(grid(DIMS), values).unwrap(), "nrrd");
    let found = store(folder.path(), BlockSide::V16);
    fs::remove_file(path.join("0/c/1/0/0")).unwrap();
    let fault = found.fetch(UVec3::new(0, 0, 2), Level(0), &mut Vec::new()).unwrap_err();
    let said = fault.to_string();
    assert!(said.starts_with("block (0, 0, 2) of level 0 cannot be fetched: "), "{said}");
    assert!(said.contains("store.zarr: chunk [1, 0, 0] of array \"0\" is not stored"), "{said}");
    assert!(found.fetch(UVec3::new(0, 0, 2), Level(1), &mut Vec::new()).is_ok());
    assert!(found.fetch(UVec3::new(0, 0, 9), Level(1), &mut Vec::new()).is_err());
}

#[test]
fn limits_are_named() {
    let folder = tempfile::tempdir().unwrap();
    packed(folder.path(), &Volume::new(grid(DIMS), noise(DIMS, ScalarType::U8)).unwrap(), "nrrd");
    let open = |side, max_bytes| {
        let limits = StoreLimits { cache_bytes: 0, max_bytes };
        let path = folder.path().join("store.zarr");
        StoreBlocks::open(&path, side, limits, &OpenOptions::default(), &mut |_| {}).err().map(|e| e.to_string())
    };
    assert_eq!(open(BlockSide::V16, 100_000), None);
    let summaries = open(BlockSide::V8, 33_000).unwrap();
    assert!(summaries.contains("summaries of 405 blocks of 8^3 voxels would take"), "{summaries}");
    let chunk = open(BlockSide::V32, 10_000).unwrap();
    assert!(
        chunk.contains("a chunk of shape [32, 32, 32] would take 32768 bytes; the limit is 10000 bytes"),
        "{chunk}"
    );
}

#[test]
fn a_store_that_is_there_is_not_touched() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.nrrd");
    save(&file, &Volume::new(grid(DIMS), noise(DIMS, ScalarType::F32)).unwrap(), &SaveOptions::default()).unwrap();
    let mut opened = || open_slices(&file, &OpenOptions::default());
    let mut told = |_| panic!("work was done");
    let fault = pack(&file, &mut opened, folder.path(), Codec::Zstd, &mut told).unwrap_err();
    assert!(fault.to_string().contains("there is one already"), "{fault}");
    assert_eq!(folder.path().read_dir().unwrap().count(), 1);
}

#[test]
fn voxels_that_are_not_finite_are_found_in_any_slab() {
    let folder = tempfile::tempdir().unwrap();
    let mut values: Vec<f32> = (0..DIMS.element_product()).map(|i| (i % 1000) as f32).collect();
    // In the last of three slabs alone.
    (values[170_000], values[170_001], values[171_000]) = (f32::NAN, 5000.0, f32::INFINITY);
    let volume = Volume::new(grid(DIMS), values.clone()).unwrap();
    others_store(&folder.path().join("store.zarr"), DIMS, &values, &[]);
    let found = store(folder.path(), BlockSide::V16);
    assert_eq!(found.range(), ValueRange { min: 0.0, max: 5000.0 });
    assert_same(&found, &blocks(&volume, BlockSide::V16), 1e-3);
}

#[test]
fn coarse_samples_of_others_stay_in_the_range_of_their_blocks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("store.zarr");
    let values: Vec<f32> = (0..DIMS.element_product()).map(|i| 10.0 + (i % 7) as f32).collect();
    others_store(&path, DIMS, &values, &[UVec3::ONE]);
    // Another filter than the mean, which overshoots.
    let n = (DIMS - 1) / 2 + 1;
    let overshot: Vec<f32> = (0..n.element_product()).map(|i| if i % 2 == 0 { -50.0 } else { 90.0 }).collect();
    write_array(&path.join("s1"), n, &overshot);
    let found = store(folder.path(), BlockSide::V16);
    for (block, level) in [(UVec3::ZERO, Level(1)), (UVec3::new(4, 2, 4), Level(1)), (UVec3::ZERO, Level(2))] {
        let range = found.summaries()[found.layout().ordinal(block)].range;
        let values = fetch_values(&found, block, level).unwrap();
        assert!(values.iter().all(|v| range.contains(*v)), "{block} {level:?} {range:?}");
    }
}

#[test]
fn an_overview_is_the_finest_level_that_fits_over_the_same_box() {
    let folder = tempfile::tempdir().unwrap();
    let volume = Volume::new(grid(DIMS), noise(DIMS, ScalarType::U8)).unwrap();
    packed(folder.path(), &volume, "nrrd");
    let found = store(folder.path(), BlockSide::V16);
    let (all, half) = (DIMS.element_product().into(), (UVec3::new(35, 19, 34).element_product()).into());
    for (max_bytes, dims) in
        [(all, DIMS), (all - 1, UVec3::new(35, 19, 34)), (half, UVec3::new(35, 19, 34)), (100, UVec3::new(5, 3, 5))]
    {
        let overview = found.overview(max_bytes).unwrap();
        assert_eq!(overview.grid().dims(), dims, "{max_bytes}");
        let [a, b] = [&overview, &volume].map(|v| v.grid().spacing() * v.grid().dims().as_dvec3());
        assert!((a - b).length() < 1e-9, "{a} {b}");
    }
    assert_eq!(found.overview(all).unwrap().voxels(), volume.voxels());
}
