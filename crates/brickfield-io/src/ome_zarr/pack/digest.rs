//! A digest by which a store shows that its samples are those that were packed.

use zarrs::storage::{ReadableStorageTraits, StorageError, StoreKey};

/// The digest of the files of all levels, finest first: a CRC-32C over the lengths of their shards, and the bytes of the coarsest level's.
///
/// It tells a store that was written to from one that was not, at the cost of asking for lengths: whoever edits samples changes how well
/// they pack, or the coarsest level.
pub(in super::super) fn digest(
    store: &dyn ReadableStorageTraits,
    levels: &[Vec<StoreKey>],
) -> Result<u32, StorageError> {
    let mut digest = 0;
    for key in levels.iter().flatten() {
        let n_bytes = store.size_key(key)?.unwrap_or(u64::MAX);
        digest = crc32c::crc32c_append(digest, &n_bytes.to_le_bytes());
    }
    for key in levels.last().into_iter().flatten() {
        let bytes = store.get(key)?.unwrap_or_default();
        digest = crc32c::crc32c_append(digest, &bytes);
    }
    Ok(digest)
}

/// The keys of all chunks of a grid, the last axis fastest.
pub(in super::super) fn keys(grid_shape: &[u64], key: impl Fn(&[u64]) -> StoreKey) -> Vec<StoreKey> {
    let n_chunks: u64 = grid_shape.iter().product();
    let at = |mut i: u64| {
        let mut chunk = vec![0; grid_shape.len()];
        for (to, n) in chunk.iter_mut().zip(grid_shape).rev() {
            (*to, i) = (i % n, i / n);
        }
        key(&chunk)
    };
    (0..n_chunks).map(at).collect()
}
