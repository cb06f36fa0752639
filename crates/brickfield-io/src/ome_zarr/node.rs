//! The nodes of a store: groups and arrays, with their attributes.

use brickfield_core::glam::DMat3;
use brickfield_core::{BlockSide, Rescale};
use serde_json::Value;
use zarrs::storage::{ListableStorageTraits, ReadableStorage, StorePrefix};

use super::json::read_json;
use super::pack::{DETAILS_KEY, RESCALE_KEY, STEPS_KEY, is_packed, stated_digest, stated_summary_bytes};
use crate::files::stays_within;
use crate::{ReadError, WorldFrame};

pub(super) struct Node {
    pub(super) is_array: bool,
    attributes: Value,
}

impl Node {
    /// The node at a path without a slash in front; the root is "".
    pub(super) fn read(store: &ReadableStorage, path: &str) -> Result<Option<Node>, ReadError> {
        let document = |name: &str| read_json(store, &joined(path, name));
        if let Some(json) = document("zarr.json")? {
            let is_array = json["node_type"] == "array";
            return Ok(Some(Node { is_array, attributes: json["attributes"].clone() }));
        }
        let attributes = document(".zattrs")?;
        let is_array = document(".zarray")?.is_some();
        if !is_array && attributes.is_none() && document(".zgroup")?.is_none() {
            return Ok(None);
        }
        Ok(Some(Node { is_array, attributes: attributes.unwrap_or_default() }))
    }

    /// What OME-Zarr says: since 0.5 in a part of its own.
    pub(super) fn ome(&self) -> &Value {
        match &self.attributes["ome"] {
            Value::Null => &self.attributes,
            ome => ome,
        }
    }

    /// The frame, under a key of our own.
    pub(super) fn frame(&self) -> Option<WorldFrame> {
        WorldFrame::of_name(self.attributes[WorldFrame::KEY].as_str()?)
    }

    /// Whether this crate packed the group: then all of its shards are there.
    pub(super) fn is_packed(&self) -> bool {
        is_packed(&self.attributes)
    }

    /// The bytes of its summaries of blocks of a side that a packed store states.
    pub(super) fn stated_summary_bytes(&self, side: BlockSide) -> Option<u64> {
        stated_summary_bytes(&self.attributes, side)
    }

    /// The digest of its samples that a packed store states.
    pub(super) fn stated_digest(&self) -> Option<u64> {
        stated_digest(&self.attributes)
    }

    /// The world steps along x, y and z of the finest level, under a key of our own.
    pub(super) fn steps(&self) -> Option<DMat3> {
        let columns: [[f64; 3]; 3] = serde_json::from_value(self.attributes[STEPS_KEY].clone()).ok()?;
        Some(DMat3::from_cols_array_2d(&columns))
    }

    /// What the samples mean, under a key of our own.
    pub(super) fn rescale(&self) -> Result<Rescale, ReadError> {
        let stated = &self.attributes[RESCALE_KEY];
        if stated.is_null() {
            return Ok(Rescale::IDENTITY);
        }
        let number = |key: &str| stated[key].as_f64().unwrap_or(f64::NAN);
        Rescale::new(number("slope"), number("intercept"))
            .map_err(|_| ReadError::field(RESCALE_KEY, stated, "a finite slope that is not 0 and a finite intercept"))
    }

    /// The dataset of level 0, if it is stored as details of the first dataset of OME-Zarr.
    pub(super) fn details(&self) -> Option<&Value> {
        Some(&self.attributes[DETAILS_KEY]).filter(|dataset| !dataset.is_null())
    }

    /// The names of an array's axes that Zarr v2 writers agreed upon.
    pub(super) fn array_dimensions(&self) -> &Value {
        &self.attributes["_ARRAY_DIMENSIONS"]
    }

    /// The images of a group; an empty list if it has none.
    pub(super) fn multiscales(&self) -> &[Value] {
        self.ome()["multiscales"].as_array().map_or(&[], Vec::as_slice)
    }
}

pub(super) fn joined(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_owned() } else { format!("{path}/{name}") }
}

/// A path of the metadata must stay in the folder.
pub(super) fn checked_path<'a>(path: &'a str, field: &str) -> Result<&'a str, ReadError> {
    match stays_within(path) {
        true => Ok(path),
        false => Err(ReadError::field(field, path, "a path within the folder")),
    }
}

/// Groups in groups are looked into so far.
const MAX_DEPTH: usize = 4;
/// Most groups and arrays that are looked at.
const MAX_NODES: usize = 1 << 12;

/// The paths of the arrays in a group and in groups in it, in order.
pub(super) fn arrays_within(
    store: &ReadableStorage,
    list: &dyn ListableStorageTraits,
) -> Result<Vec<String>, ReadError> {
    let (mut arrays, mut groups, mut n_nodes) = (Vec::new(), vec![(String::new(), 0)], 0);
    while let Some((group, depth)) = groups.pop() {
        let prefix = if group.is_empty() { String::new() } else { format!("{group}/") };
        let prefix = StorePrefix::new(prefix).map_err(|e| ReadError::decoder("a group", e))?;
        let entries = list.list_dir(&prefix).map_err(|e| ReadError::decoder("a group", e))?;
        for child in entries.prefixes() {
            n_nodes += 1;
            if n_nodes > MAX_NODES {
                return Err(ReadError::field("number of groups and arrays", n_nodes, format!("at most {MAX_NODES}")));
            }
            let path = child.as_str().trim_end_matches('/').to_owned();
            match Node::read(store, &path)? {
                Some(node) if node.is_array => arrays.push(path),
                Some(_) if depth < MAX_DEPTH => groups.push((path, depth + 1)),
                _ => {}
            }
        }
    }
    arrays.sort();
    Ok(arrays)
}
