//! Summaries of blocks, as an array of columns.

use brickfield_core::glam::UVec3;
use brickfield_core::{BlockLayout, BlockSide, BlockSummary, N_BLOCK_BINS, N_BLOCK_LEVELS, ValueRange};
use serde_json::{Value, json};
use zarrs::array::{Array, CodecOptions};
use zarrs::storage::{ReadableStorageTraits, WritableStorage, WritableStorageTraits};

use super::Fault;

/// The group of the arrays of summaries; each has the name of its side.
pub(in super::super) const FOLDER: &str = "brickfield_blocks";

/// Numbers of a summary.
pub(in super::super) const N_COLUMNS: usize = 4 + N_BLOCK_LEVELS + N_BLOCK_BINS;

/// Layers of blocks, one after the other, each a chunk.
pub(super) struct SummaryWriter {
    array: Array<dyn WritableStorageTraits>,
    path: String,
    metadata: Value,
    side: BlockSide,
    n_blocks: UVec3,
    n_layers: u32,
}

impl SummaryWriter {
    pub(super) fn new(store: &WritableStorage, dims: UVec3, side: BlockSide) -> Result<SummaryWriter, Fault> {
        let n_blocks = BlockLayout::new(dims, side).n_blocks();
        let metadata = metadata(n_blocks);
        let path = format!("{FOLDER}/{side}");
        let array =
            Array::new_with_metadata(store.clone(), &format!("/{path}"), serde_json::from_value(metadata.clone())?)?;
        Ok(SummaryWriter { array, path, metadata, side, n_blocks, n_layers: 0 })
    }

    pub(super) fn side(&self) -> BlockSide {
        self.side
    }

    pub(super) fn n_blocks(&self) -> UVec3 {
        self.n_blocks
    }

    pub(super) fn n_layers(&self) -> u32 {
        self.n_layers
    }

    /// The bytes of the layers that are written.
    pub(super) fn n_bytes(&self, store: &dyn ReadableStorageTraits) -> Result<u64, Fault> {
        let key = |layer: u32| self.array.chunk_key(&[u64::from(layer), 0, 0, 0]);
        let sizes = (0..self.n_layers).map(|layer| Ok(store.size_key(&key(layer))?.unwrap_or(0)));
        sizes.sum()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.n_layers == 0
    }

    pub(super) fn push(&mut self, summaries: &[BlockSummary]) -> Result<(), Fault> {
        let n_layer = self.n_blocks.x as usize * self.n_blocks.y as usize;
        for layer in summaries.chunks_exact(n_layer) {
            let numbers: Vec<f64> = layer.iter().flat_map(columns_of).collect();
            let whole = CodecOptions::default().with_store_empty_chunks(true);
            self.array.store_chunk_opt(&[u64::from(self.n_layers), 0, 0, 0], numbers, &whole)?;
            self.n_layers += 1;
        }
        Ok(())
    }

    /// The array's path, and its metadata. Those that `zarrs` writes have codecs by bare names, which not every reader takes.
    pub(super) fn metadata(&self) -> (String, &Value) {
        (self.path.clone(), &self.metadata)
    }
}

fn columns_of(summary: &BlockSummary) -> [f64; N_COLUMNS] {
    let BlockSummary { range, mean, counts, kept_variance, variance } = summary;
    let mut columns = [0.0; N_COLUMNS];
    columns[..4].copy_from_slice(&[range.min, range.max, *mean, *variance]);
    columns[4..4 + N_BLOCK_LEVELS].iter_mut().zip(kept_variance).for_each(|(to, from)| *to = f64::from(*from));
    columns[4 + N_BLOCK_LEVELS..].iter_mut().zip(counts).for_each(|(to, from)| *to = f64::from(*from));
    columns
}

/// The summary of its columns.
pub(in super::super) fn summary_of(columns: &[f64; N_COLUMNS]) -> BlockSummary {
    let [min, max, mean, variance, ..] = *columns;
    BlockSummary {
        range: ValueRange { min, max },
        mean,
        counts: std::array::from_fn(|bin| columns[4 + N_BLOCK_LEVELS + bin] as u16),
        kept_variance: std::array::from_fn(|level| columns[4 + level] as f32),
        variance,
    }
}

fn column_names() -> Vec<String> {
    let names = ["least", "greatest", "mean", "variance"].map(str::to_owned).into_iter();
    let kept = (0..N_BLOCK_LEVELS).map(|level| format!("part of the variance kept at level {level}"));
    let counts = (0..N_BLOCK_BINS).map(|bin| format!("voxels in bin {bin} of {N_BLOCK_BINS}, of 65535"));
    names.chain(kept).chain(counts).collect()
}

fn metadata(n_blocks: UVec3) -> Value {
    json!({
        "zarr_format": 3,
        "node_type": "array",
        "shape": [n_blocks.z, n_blocks.y, n_blocks.x, N_COLUMNS as u32],
        "data_type": "float64",
        "chunk_grid": {
            "name": "regular",
            "configuration": { "chunk_shape": [1, n_blocks.y, n_blocks.x, N_COLUMNS as u32] }
        },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
        "fill_value": "NaN",
        "codecs": [
            { "name": "bytes", "configuration": { "endian": "little" } },
            { "name": "zstd", "configuration": { "level": 1, "checksum": false } },
            { "name": "crc32c" }
        ],
        "dimension_names": ["z", "y", "x", "column"],
        "attributes": { "columns": column_names() }
    })
}
