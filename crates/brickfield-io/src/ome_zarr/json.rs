//! The JSON documents of a store.

use serde_json::Value;
use zarrs::storage::{ReadableStorage, StoreKey};

use crate::ReadError;
use crate::error::counted;
use crate::lines::MAX_HEADER_BYTES;

pub(super) fn numbers(json: &Value, field: &'static str) -> Result<Vec<u64>, ReadError> {
    let list = json[field].as_array().and_then(|list| list.iter().map(Value::as_u64).collect());
    list.ok_or_else(|| ReadError::field(field, &json[field], "a list of integers of at least 0"))
}

/// A JSON document of the store, if it is there.
pub(super) fn read_json(store: &ReadableStorage, key: &str) -> Result<Option<Value>, ReadError> {
    let fault = |e| ReadError::decoder(key, e);
    let store_key = StoreKey::new(key).map_err(|e| ReadError::decoder(key, e))?;
    let Some(n_bytes) = store.size_key(&store_key).map_err(fault)? else { return Ok(None) };
    if n_bytes > MAX_HEADER_BYTES {
        let (n_bytes, max_bytes) = (u128::from(n_bytes), MAX_HEADER_BYTES);
        return Err(ReadError::TooLarge { what: key.to_owned(), n_bytes, max_bytes });
    }
    let Some(bytes) = store.get(&store_key).map_err(fault)? else { return Ok(None) };
    let named = || format!("{key} ({})", counted(bytes.len(), "byte", "bytes"));
    serde_json::from_slice(&bytes).map(Some).map_err(|e| ReadError::decoder(named(), e))
}
