//! Stores of all levels: written slice by slice, read box by box.

use std::fs;
use std::path::Path;

use brickfield_core::glam::{DMat3, DVec3, UVec3};
use brickfield_core::{
    BlockLayout, BlockSide, BlockSummary, Grid, Level, N_BLOCK_BINS, ScalarType, ValueRange, Voxels,
};
use brickfield_io::ome_zarr::{PyramidOptions, PyramidWriter, ZarrLevels};
use brickfield_io::{ByteOrder, ChoiceKind, Compression, OpenOptions, SaveError, SaveOptions, WorldFrame, open};

use crate::common::*;

const DIMS: UVec3 = UVec3::new(75, 40, 70);
const SPACING: DVec3 = DVec3::new(0.5, 0.75, 2.0);
const FIRST: DVec3 = DVec3::new(-10.0, 20.0, 5.0);

fn grid(dims: UVec3) -> Grid {
    Grid::from_first_sample(dims, SPACING, FIRST, DMat3::IDENTITY).unwrap()
}

fn level_dims(level: u8) -> UVec3 {
    (DIMS - 1) / (1 << level) + 1
}

/// Numbers that tell levels and places apart, some of them 0.
fn numbers(level: u8, dims: UVec3) -> Vec<f64> {
    let n = dims.element_product();
    (0..n)
        .map(|i| if i < n / 2 { 0.0 } else { f64::from(i.wrapping_mul(2_654_435_761) >> 25) + f64::from(level) })
        .collect()
}

fn of_type(scalar: ScalarType, numbers: &[f64]) -> Voxels {
    match scalar {
        ScalarType::U8 => Voxels::from(numbers.iter().map(|v| *v as u8).collect::<Vec<_>>()),
        ScalarType::I8 => Voxels::from(numbers.iter().map(|v| (*v - 50.0) as i8).collect::<Vec<_>>()),
        ScalarType::U16 => Voxels::from(numbers.iter().map(|v| 500 * *v as u16).collect::<Vec<_>>()),
        ScalarType::I16 => Voxels::from(numbers.iter().map(|v| (200.0 * v - 9000.0) as i16).collect::<Vec<_>>()),
        ScalarType::U32 => Voxels::from(numbers.iter().map(|v| 30_000_000 * *v as u32).collect::<Vec<_>>()),
        ScalarType::I32 => Voxels::from(numbers.iter().map(|v| (1e7 * (v - 50.0)) as i32).collect::<Vec<_>>()),
        ScalarType::F32 => Voxels::from(numbers.iter().map(|v| (v / 7.0) as f32).collect::<Vec<_>>()),
        ScalarType::F64 => Voxels::from(numbers.iter().map(|v| v / 7.0).collect::<Vec<_>>()),
    }
}

fn slices(scalar: ScalarType, level: u8, from: u32, n: u32) -> Voxels {
    let dims = level_dims(level);
    let n_slice = (dims.x * dims.y) as usize;
    let (from, n) = (from as usize * n_slice, n as usize * n_slice);
    of_type(scalar, &numbers(level, dims)[from..from + n])
}

const N_LEVELS: u8 = 4;

fn summaries(side: BlockSide) -> Vec<BlockSummary> {
    let layout = BlockLayout::new(DIMS, side);
    let of = |i: usize| BlockSummary {
        range: ValueRange { min: -1.0 - i as f64 / 3.0, max: i as f64 },
        mean: 0.1 * i as f64,
        counts: std::array::from_fn(|bin| (i * N_BLOCK_BINS + bin) as u16),
        kept_variance: std::array::from_fn(|level| 1.0 / (1 + level + i) as f32),
        variance: 1e300 / (1 + i) as f64,
    };
    (0..layout.n_blocks_total()).map(of).collect()
}

fn create(path: &Path, grid: &Grid, scalar: ScalarType, options: &SaveOptions) -> Result<PyramidWriter, SaveError> {
    let options = PyramidOptions { save: options.clone(), coarsest: Level(N_LEVELS - 1), ..PyramidOptions::default() };
    PyramidWriter::create(path, grid, scalar, &options)
}

/// Writes all levels, `n_at_once` slices at a time.
fn write(path: &Path, grid: &Grid, scalar: ScalarType, n_at_once: u32, options: &SaveOptions) {
    let mut writer = create(path, grid, scalar, options).unwrap();
    for level in 0..N_LEVELS {
        let n_slices = level_dims(level).z;
        for z in (0..n_slices).step_by(n_at_once as usize) {
            writer.push(Level(level), slices(scalar, level, z, n_at_once.min(n_slices - z))).unwrap();
        }
    }
    for side in [BlockSide::V16, BlockSide::V32] {
        let n_layer = BlockLayout::new(DIMS, side).n_blocks().with_z(1).element_product() as usize;
        for layers in summaries(side).chunks(2 * n_layer) {
            writer.push_summaries(side, layers).unwrap();
        }
    }
    assert!(!path.exists(), "a store that is not finished has its name");
    writer.finish().unwrap();
}

fn options(compression: Compression) -> SaveOptions {
    let mut options = SaveOptions::default();
    options.compression = compression;
    options.frame = WorldFrame::Lps;
    options.unit = Some("mm".to_owned());
    options
}

fn levels(path: &Path) -> ZarrLevels {
    ZarrLevels::open(path, &OpenOptions::default(), 1 << 20).unwrap()
}

fn read_box(store: &ZarrLevels, level: usize, first: UVec3, extent: UVec3) -> Vec<u8> {
    let mut out = Vec::new();
    store.read_box(level, first, extent, &mut out).unwrap();
    out
}

/// The bytes of a box of a level.
fn expected_box(scalar: ScalarType, level: u8, first: UVec3, extent: UVec3) -> Vec<u8> {
    let dims = level_dims(level);
    let all = bytes(&of_type(scalar, &numbers(level, dims)), ByteOrder::Little);
    let n = scalar.n_bytes();
    let mut out = Vec::new();
    for z in first.z..first.z + extent.z {
        for y in first.y..first.y + extent.y {
            let start = ((z * dims.y + y) * dims.x + first.x) as usize * n;
            out.extend(&all[start..start + extent.x as usize * n]);
        }
    }
    out
}

#[test]
fn all_levels_of_every_type_are_read_as_they_were_written() {
    let folder = tempfile::tempdir().unwrap();
    for (i, scalar) in ScalarType::ALL.into_iter().enumerate() {
        let path = folder.path().join(format!("{scalar}.zarr"));
        let compression = if i % 2 == 0 { Compression::Lossless } else { Compression::None };
        write(&path, &grid(DIMS), scalar, [1, 7, 32, 70][i % 4], &options(compression));
        for level in 0..N_LEVELS {
            let mut wanted = OpenOptions::default();
            wanted.wanted.want(ChoiceKind::Level, level.to_string());
            let opened = open(&path, &wanted).unwrap();
            assert_eq!(
                opened.volume.voxels(),
                &of_type(scalar, &numbers(level, level_dims(level))),
                "{scalar} {level}"
            );
            assert_eq!(
                (opened.frame, opened.unit.as_deref(), &opened.notes[..]),
                (WorldFrame::Lps, Some("millimeter"), &[][..])
            );
        }
        let store = levels(&path);
        assert_eq!(
            (store.n_levels(), store.facts().scalar, store.facts().grid.index_to_world()),
            (4, scalar, grid(DIMS).index_to_world())
        );
        for (level, first, extent) in [
            (0, UVec3::new(30, 0, 31), UVec3::new(40, 40, 3)),
            (0, UVec3::new(74, 39, 69), UVec3::ONE),
            (1, UVec3::new(1, 2, 3), UVec3::new(37, 18, 32)),
            (3, UVec3::ZERO, level_dims(3)),
        ] {
            assert_eq!(read_box(&store, level as usize, first, extent), expected_box(scalar, level, first, extent));
            assert_eq!(store.shifts(level as usize), Some(UVec3::splat(level.into())));
        }
    }
}

#[test]
fn samples_of_a_level_lie_in_the_middle_of_what_they_average() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.zarr");
    let steps = DMat3::from_rotation_x(0.5) * DMat3::from_diagonal(SPACING * DVec3::new(-1.0, 1.0, 1.0));
    let turned = Grid::from_first_sample(DIMS, SPACING, FIRST, steps).unwrap();
    for (name, grid) in [("upright", grid(DIMS)), ("turned", turned)] {
        let path = path.with_file_name(name);
        write(&path, &grid, ScalarType::U8, 32, &options(Compression::Lossless));
        for level in 0..N_LEVELS {
            let mut wanted = OpenOptions::default();
            wanted.wanted.want(ChoiceKind::Level, level.to_string());
            let opened = open(&path, &wanted).unwrap();
            let n = f64::from(1 << level);
            let of_level = opened.volume.grid().index_to_world();
            let of_volume = grid.index_to_world();
            for p in [DVec3::ZERO, DVec3::new(3.0, 4.0, 2.0)] {
                // Sample p covers voxels n p to n (p + 1).
                let expected = of_volume.transform_point3(n * (p + 0.5));
                assert!((of_level.transform_point3(p + 0.5) - expected).length() < 1e-12, "{name} {level}");
            }
        }
    }
}

#[test]
fn summaries_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.zarr");
    write(&path, &grid(DIMS), ScalarType::I16, 32, &options(Compression::Lossless));
    let mut store = levels(&path);
    assert_eq!(store.block_summaries(BlockSide::V16).unwrap(), Some(summaries(BlockSide::V16)));
    assert_eq!(store.block_summaries(BlockSide::V32).unwrap(), Some(summaries(BlockSide::V32)));
    assert_eq!(store.block_summaries(BlockSide::V8).unwrap(), None);
    let mut small = OpenOptions::default();
    small.limits.max_bytes = 100_000;
    let mut small = ZarrLevels::open(&path, &small, 0).unwrap();
    fs::remove_file(path.join("brickfield_blocks/32/c/1/0/0/0")).unwrap();
    let fault = store.block_summaries(BlockSide::V32).unwrap_err().to_string();
    assert!(fault.contains("chunk [1, 0, 0, 0] of array \"brickfield_blocks/32\" is not stored"), "{fault}");
    assert!(small.block_summaries(BlockSide::V16).is_ok());
}

#[test]
fn metadata_are_in_the_form_that_every_reader_takes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.zarr");
    write(&path, &grid(DIMS), ScalarType::I16, 32, &options(Compression::Lossless));
    for array in ["0", "3", "brickfield_blocks/16", "brickfield_blocks/32"] {
        let json = fs::read(path.join(array).join("zarr.json")).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
        // zarr-python refuses codecs by their bare names.
        assert!(json["codecs"].as_array().unwrap().iter().all(serde_json::Value::is_object), "{array}");
    }
    assert!(!path.join("brickfield_blocks/8").join("zarr.json").exists());
}

#[test]
fn no_more_is_read_than_the_box_needs_and_it_is_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.zarr");
    write(&path, &grid(DIMS), ScalarType::U8, 32, &options(Compression::None));
    let chunk = 32 * 32 * 32 + 4;
    let index = 3 * 2 * 16 + 4;
    let store = levels(&path);
    read_box(&store, 0, UVec3::new(33, 1, 65), UVec3::new(30, 30, 5));
    assert_eq!(store.n_bytes_read(), chunk + index);
    read_box(&store, 0, UVec3::new(34, 2, 66), UVec3::new(3, 3, 3));
    assert_eq!(store.n_bytes_read(), chunk + index);
    read_box(&store, 0, UVec3::new(34, 2, 66), UVec3::new(31, 3, 3));
    assert_eq!(store.n_bytes_read(), 2 * chunk + index);
    assert!((2 * 32_768..2 * 32_768 + 1000).contains(&store.n_bytes_kept()));
    // Without room the last chunk is kept alone.
    let store = ZarrLevels::open(&path, &OpenOptions::default(), 1000).unwrap();
    for _ in 0..3 {
        read_box(&store, 0, UVec3::new(33, 1, 65), UVec3::new(30, 30, 5));
    }
    assert_eq!(store.n_bytes_read(), chunk + index);
    assert!((32_768..32_768 + 1000).contains(&store.n_bytes_kept()));
}

#[test]
fn what_is_lost_or_damaged_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.zarr");
    write(&path, &grid(DIMS), ScalarType::U8, 32, &options(Compression::Lossless));
    let fault = |level: usize, first: UVec3| {
        let mut out = Vec::new();
        levels(&path).read_box(level, first, UVec3::ONE, &mut out).unwrap_err().to_string()
    };
    let whole = || open(&path, &OpenOptions::default()).unwrap_err().to_string();
    let shard = path.join("0/c/2/0/0");
    let good = fs::read(&shard).unwrap();
    // A byte of a chunk.
    let mut bad = good.clone();
    let entry = good.first_chunk().map(|offset| u64::from_le_bytes(*offset)).unwrap();
    bad[entry as usize + 10] ^= 1;
    fs::write(&shard, &bad).unwrap();
    let message = fault(0, UVec3::new(0, 0, 69));
    assert!(message.starts_with("the checksum of chunk [2, 0, 0] of array \"0\" of"), "{message}");
    assert!(whole().contains("chunk [2, 0, 0]"), "{}", whole());
    // A byte of the index.
    let mut bad = good.clone();
    bad[20] ^= 1;
    fs::write(&shard, &bad).unwrap();
    let message = fault(0, UVec3::new(0, 0, 69));
    assert_eq!(message, "the checksum of the index of shard [2, 0, 0] of array \"0\" is wrong: it is damaged");
    // Cut off.
    fs::write(&shard, &good[..50]).unwrap();
    let message = fault(0, UVec3::new(0, 0, 69));
    assert!(
        message.contains("shard [2, 0, 0] of array \"0\", with an index of 100 bytes, holds 50 bytes"),
        "{message}"
    );
    // Gone.
    fs::remove_file(&shard).unwrap();
    let lost = "is not stored; all chunks of this store were, so it is lost";
    assert_eq!(fault(0, UVec3::new(0, 0, 69)), format!("chunk [2, 0, 0] of array \"0\" {lost}"));
    assert!(whole().ends_with(lost), "{}", whole());
    // The rest can be read, but not beyond the level.
    assert_eq!(read_box(&levels(&path), 0, UVec3::ZERO, UVec3::ONE), [0]);
    assert!(fault(1, UVec3::new(38, 0, 0)).contains("the box of level 1"), "{}", fault(1, UVec3::new(38, 0, 0)));
}

#[test]
fn an_interrupted_run_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.zarr");
    let scalar = ScalarType::U8;
    let mut writer = create(&path, &grid(DIMS), scalar, &SaveOptions::default()).unwrap();
    writer.push(Level(0), slices(scalar, 0, 0, 40)).unwrap();
    drop(writer);
    assert_eq!(folder.path().read_dir().unwrap().count(), 0);
    // Nor does one that says it is done.
    let mut writer = create(&path, &grid(DIMS), scalar, &SaveOptions::default()).unwrap();
    writer.push(Level(0), slices(scalar, 0, 0, 40)).unwrap();
    let message = writer.finish().unwrap_err().to_string();
    assert!(message.ends_with("a.zarr: 40 of 70 slices of level 0 were handed over; nothing is saved"), "{message}");
    assert_eq!(folder.path().read_dir().unwrap().count(), 0);
    // One that was killed left a folder without metadata, which no reader takes for a store.
    let mut writer = create(&path, &grid(DIMS), scalar, &SaveOptions::default()).unwrap();
    writer.push(Level(0), slices(scalar, 0, 0, 70)).unwrap();
    let left = folder.path().read_dir().unwrap().next().unwrap().unwrap().path().join("store");
    assert!(left.join("0/c/0/0/0").is_file());
    assert!(open(&left, &OpenOptions::default()).is_err());
    assert!(ZarrLevels::open(&left, &OpenOptions::default(), 0).is_err());
}

#[test]
fn slices_that_are_none_and_paths_that_are_taken_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.zarr");
    let mut writer = create(&path, &grid(DIMS), ScalarType::U8, &SaveOptions::default()).unwrap();
    let mut fault = |level, voxels: Voxels| writer.push(Level(level), voxels).unwrap_err().to_string();
    assert!(
        fault(1, vec![0u8; 5].into())
            .contains("5 samples of u8 after 0 slices of level 1, which has 35 slices of 38 x 20 samples of u8")
    );
    assert!(fault(0, vec![0u16; 75 * 40].into()).contains("3000 samples of u16"));
    assert!(fault(3, vec![0u8; 10 * 5 * 10].into()).contains("500 samples of u8 after 0 slices of level 3"));
    assert!(fault(9, vec![0u8; 1].into()).contains("level 9"));
    // Taken before and meanwhile.
    let refused = |outcome: Result<PyramidWriter, SaveError>| outcome.err().map(|e| e.to_string()).unwrap_or_default();
    let taken = refused(create(folder.path(), &grid(DIMS), ScalarType::U8, &SaveOptions::default()));
    assert!(taken.contains("there is one already"), "{taken}");
    let nowhere = folder.path().join("b/c.zarr");
    assert!(
        refused(create(&nowhere, &grid(DIMS), ScalarType::U8, &SaveOptions::default())).contains("there is no folder")
    );
    let dims = UVec3::new(3, 2, 1);
    let mut writer = PyramidWriter::create(&path, &grid(dims), ScalarType::U8, &PyramidOptions::default()).unwrap();
    writer.push(Level(0), vec![1u8; 6].into()).unwrap();
    fs::create_dir(&path).unwrap();
    assert!(writer.finish().unwrap_err().to_string().contains("there is one already"));
}

/// Shards hold 512 x 512 samples of a slice.
#[test]
fn levels_wider_than_a_shard_are_read_as_they_were_written() {
    for dims in [UVec3::new(530, 3, 2), UVec3::new(3, 1030, 2)] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("wide.zarr");
        let written: Vec<u16> =
            (0..dims.element_product()).map(|i| (i.wrapping_mul(2_654_435_761) >> 16) as u16).collect();
        let mut writer =
            PyramidWriter::create(&path, &grid(dims), ScalarType::U16, &PyramidOptions::default()).unwrap();
        writer.push(Level(0), written.clone().into()).unwrap();
        writer.finish().unwrap();
        assert_eq!(open(&path, &OpenOptions::default()).unwrap().volume.voxels(), &Voxels::from(written.clone()));
        let expected: Vec<u8> = written.iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(read_box(&levels(&path), 0, UVec3::ZERO, dims), expected);
    }
}
