//! Where the bytes of levels lie: for those who fetch them in an order of their own.

use std::ops::Range;

use brickfield_core::glam::{U64Vec3, UVec3};
use brickfield_core::{BlockLayout, BlockSide};

use super::super::pack::{DETAILS_KEY, FOLDER};
use super::ZarrLevels;
use super::parts::{Parts, StoredPlace};
use crate::ReadError;
use crate::ome_zarr::metadata::ArrayMetadata;
use crate::ome_zarr::node::{Node, joined};
use crate::ome_zarr::positions;

/// A range of bytes of an object; all of it if there is no range.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct ObjectRange {
    /// The object.
    pub key: String,
    /// Its bytes.
    pub range: Option<Range<u64>>,
}

impl ObjectRange {
    fn whole(key: String) -> ObjectRange {
        ObjectRange { key, range: None }
    }
}

/// The bytes of a chunk of a level: the least that can be read alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredChunk {
    /// The first of its samples.
    pub first: UVec3,
    /// How many of its samples lie in the level, along x, y, z.
    pub extent: UVec3,
    /// Its bytes.
    pub bytes: ObjectRange,
    /// Their number.
    pub n_bytes: u64,
}

/// The document by which a store is opened.
pub const ROOT_DOCUMENT: &str = "zarr.json";

/// The other documents of a store, as its root document has them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StatedDocuments {
    /// Keys and bytes of those that it states.
    pub stated: Vec<(String, Vec<u8>)>,
    /// Keys of those that must be read.
    pub others: Vec<String>,
}

/// The other documents of a store of [`PyramidWriter`](super::super::PyramidWriter), from the bytes of its root document.
///
/// # Errors
/// If the bytes are no JSON.
pub fn stated_documents(root: &[u8]) -> Result<StatedDocuments, ReadError> {
    let root: serde_json::Value = serde_json::from_slice(root).map_err(|e| ReadError::decoder(ROOT_DOCUMENT, e))?;
    let stated = root["consolidated_metadata"]["metadata"].as_object();
    let document = |(path, json): (&String, &serde_json::Value)| {
        let bytes = serde_json::to_vec(json).map_err(|e| ReadError::decoder(ROOT_DOCUMENT, e))?;
        Ok((joined(path, ROOT_DOCUMENT), bytes))
    };
    let stated = stated.into_iter().flatten().map(document).collect::<Result<_, ReadError>>()?;
    let details = root["attributes"][DETAILS_KEY]["path"].as_str();
    Ok(StatedDocuments { stated, others: details.map(|path| joined(path, ROOT_DOCUMENT)).into_iter().collect() })
}

impl ZarrLevels {
    /// Bytes that say where the chunks of a level lie: the indices of its shards. Nothing is read.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn indices(&self, level: usize) -> Vec<ObjectRange> {
        let parts = &self.levels[level].parts;
        let index = |key: String| ObjectRange { key, range: parts.index_range() };
        match parts.is_sharded() {
            true => self.shards(level).into_iter().map(index).collect(),
            false => Vec::new(),
        }
    }

    /// All bytes of a level. Nothing is read.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn whole_level(&self, level: usize) -> Vec<ObjectRange> {
        self.shards(level).into_iter().map(ObjectRange::whole).collect()
    }

    fn shards(&self, level: usize) -> Vec<String> {
        let keys = self.levels[level].parts.chunk_keys();
        keys.into_iter().map(|key| key.as_str().to_owned()).collect()
    }

    /// The number of bytes of [`stored_summaries`](Self::stored_summaries), if the store states it. Nothing is read but documents.
    ///
    /// # Errors
    /// If a document cannot be read.
    pub fn n_stored_summary_bytes(&self, side: BlockSide) -> Result<Option<u64>, ReadError> {
        Ok(Node::read(&self.store, &self.group)?.and_then(|node| node.stated_summary_bytes(side)))
    }

    /// All bytes of the summaries of blocks of a side; none if the store is not packed. Nothing is read but documents.
    ///
    /// # Errors
    /// If a document cannot be read.
    pub fn stored_summaries(&self, side: BlockSide) -> Result<Vec<ObjectRange>, ReadError> {
        let path = joined(&self.group, &format!("{FOLDER}/{side}"));
        if !self.is_packed || Node::read(&self.store, &path)?.is_none() {
            return Ok(Vec::new());
        }
        let metadata = ArrayMetadata::read(&self.store, &path)?;
        let n_layers = BlockLayout::new(self.facts.grid.dims(), side).n_blocks().z;
        let parts = Parts::new(&self.store, &path, &metadata)?;
        Ok(parts
            .chunk_keys()
            .into_iter()
            .take(n_layers as usize)
            .map(|k| ObjectRange::whole(k.as_str().into()))
            .collect())
    }

    /// The chunks of a level, z slowest; of one that holds nothing but the fill value there are no bytes. Indices of shards are read, and
    /// lengths of chunks that are objects of their own.
    ///
    /// # Errors
    /// Indices that are damaged, or lost from a packed store.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn stored_chunks(&self, level: usize) -> Result<Vec<StoredChunk>, ReadError> {
        let array = &self.levels[level];
        let side = U64Vec3::from(array.along_volume(&array.parts.part_shape)).as_uvec3();
        let n = (array.dims - 1) / side + 1;
        let mut chunks = Vec::new();
        for at in positions(n) {
            let part = array.part_at(at.as_u64vec3());
            let index = self.index_of(&array.parts, level, array.parts.chunk_of(&part))?;
            let StoredPlace { key, range, n_bytes } = array.parts.stored_place(&part, index.as_deref())?;
            let (first, bytes) = (at * side, ObjectRange { key, range });
            chunks.push(StoredChunk { first, extent: side.min(array.dims - first), bytes, n_bytes });
        }
        Ok(chunks)
    }
}
