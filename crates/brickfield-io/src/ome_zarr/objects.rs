//! Objects of a store, wherever they are, as `zarrs` reads them.

use std::sync::Arc;

use brickfield_core::Objects;
use zarrs::storage::byte_range::{ByteRange, ByteRangeIterator};
use zarrs::storage::{
    ListableStorageTraits, MaybeBytesIterator, ReadableStorageTraits, StorageError, StoreKey, StoreKeys,
    StoreKeysPrefixes, StorePrefix,
};

pub(super) struct ObjectStorage(pub(super) Arc<dyn Objects>);

impl ReadableStorageTraits for ObjectStorage {
    fn get_partial_many<'a>(
        &'a self,
        key: &StoreKey,
        ranges: ByteRangeIterator<'a>,
    ) -> Result<MaybeBytesIterator<'a>, StorageError> {
        let key = key.as_str();
        let ranges: Vec<ByteRange> = ranges.collect();
        let is_open = |range: &ByteRange| !matches!(range, ByteRange::FromStart(_, Some(_)));
        // Only ranges up to the end need the object's length, which may take a request.
        let n_bytes = match ranges.iter().any(is_open) {
            true => match self.0.n_bytes(key)? {
                Some(n_bytes) => n_bytes,
                None => return Ok(None),
            },
            false => 0,
        };
        let closed = |range: &ByteRange| match *range {
            ByteRange::FromStart(first, Some(n)) => first..first.saturating_add(n),
            ByteRange::FromStart(first, None) => first.min(n_bytes)..n_bytes,
            ByteRange::Suffix(n) => n_bytes.saturating_sub(n)..n_bytes,
        };
        let ranges: Vec<_> = ranges.iter().map(closed).collect();
        let Some(parts) = self.0.read(key, &ranges)? else { return Ok(None) };
        Ok(Some(Box::new(parts.into_iter().map(|part| Ok(part.into())))))
    }

    fn size_key(&self, key: &StoreKey) -> Result<Option<u64>, StorageError> {
        Ok(self.0.n_bytes(key.as_str())?)
    }

    fn supports_get_partial(&self) -> bool {
        true
    }
}

/// Objects are found by what metadata say.
impl ListableStorageTraits for ObjectStorage {
    fn list(&self) -> Result<StoreKeys, StorageError> {
        Err(not_listed())
    }

    fn list_prefix(&self, _: &StorePrefix) -> Result<StoreKeys, StorageError> {
        Err(not_listed())
    }

    fn list_dir(&self, _: &StorePrefix) -> Result<StoreKeysPrefixes, StorageError> {
        Err(not_listed())
    }

    fn size_prefix(&self, _: &StorePrefix) -> Result<u64, StorageError> {
        Err(not_listed())
    }
}

fn not_listed() -> StorageError {
    StorageError::Unsupported("objects are not listed: the store must be an image of OME-Zarr".to_owned())
}
