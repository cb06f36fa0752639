//! Which image of a store is read: one of a multiscale group, of a Bio-Formats series, of a field of a plate, of labels;
//! or a plain array.

use serde_json::Value;
use zarrs::storage::{ListableStorageTraits, ReadableStorage};

use super::image::ZarrImage;
use super::metadata::ArrayMetadata;
use super::node::{Node, arrays_within, checked_path, joined};
use crate::choice::Entries;
use crate::opened::FileFacts;
use crate::{ChoiceKind, ReadError};

/// An image at one level, and its array.
pub(super) type ImageArray = (ZarrImage, ArrayMetadata);

/// The image and its array at the level that is wanted.
pub(super) fn find(
    store: &ReadableStorage,
    list: &dyn ListableStorageTraits,
    found: &mut FileFacts,
) -> Result<ImageArray, ReadError> {
    let levels = find_levels(store, list, Depth::OneLevel, found)?;
    levels.into_iter().next().ok_or(ReadError::Missing { field: "multiscales/datasets/path" })
}

/// Which levels of an image are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Depth {
    /// The one that is wanted, else the finest.
    OneLevel,
    /// That one and all coarser ones.
    AllCoarser,
}

/// The image and its arrays at some levels, the finest first; at least one.
pub(super) fn find_levels(
    store: &ReadableStorage,
    list: &dyn ListableStorageTraits,
    depth: Depth,
    found: &mut FileFacts,
) -> Result<Vec<ImageArray>, ReadError> {
    let root = Node::read(store, "")?.ok_or(ReadError::Missing { field: "zarr.json, .zgroup, .zarray or .zattrs" })?;
    if root.is_array {
        return Ok(vec![plain_array(store, String::new())?]);
    }
    if !root.multiscales().is_empty() {
        let chosen = choose_image(found, names_of(root.multiscales()))?;
        return multiscale(store, "", &root, chosen, depth, found);
    }
    if let Some(plate) = root.ome().get("plate") {
        return Err(plate_refused(plate));
    }
    let images = inner_images(store, &root)?;
    if !images.is_empty() {
        let names = images.iter().map(|image| image.name.clone()).collect();
        let image = &images[choose_image(found, names)?];
        let node = group_of(store, &image.path)?;
        return multiscale(store, &image.path, &node, 0, depth, found);
    }
    let arrays = arrays_within(store, list)?;
    if arrays.is_empty() {
        return Err(ReadError::Missing { field: "multiscales (in zarr.json or .zattrs), or an array," });
    }
    Ok(vec![choose_array(store, arrays, found)?])
}

/// A group that is an image, and its name.
struct InnerImage {
    path: String,
    name: String,
}

/// The images in the groups of a series, of a field of a plate, or of labels.
fn inner_images(store: &ReadableStorage, root: &Node) -> Result<Vec<InnerImage>, ReadError> {
    let ome = root.ome();
    if let Some(fields) = ome["well"]["images"].as_array() {
        let paths = fields.iter().map(|field| field["path"].as_str().unwrap_or_default().to_owned());
        return named_paths(paths.collect());
    }
    if ome["labels"].is_array() {
        return named_paths(strings(&ome["labels"]));
    }
    let series = Node::read(store, "OME")?.map_or(Vec::new(), |node| strings(&node.ome()["series"]));
    match series.is_empty() {
        false => series_images(store, &mut series.into_iter()),
        // Without a list they are numbered.
        true => series_images(store, &mut (0..MAX_SERIES).map(|i| i.to_string())),
    }
}

const MAX_SERIES: usize = 1 << 12;

/// The images up to the first that is not there.
fn series_images(
    store: &ReadableStorage,
    paths: &mut dyn Iterator<Item = String>,
) -> Result<Vec<InnerImage>, ReadError> {
    let mut images = Vec::new();
    for path in paths {
        checked_path(&path, "OME/series")?;
        let Some(node) = Node::read(store, &path)?.filter(|node| !node.multiscales().is_empty()) else { break };
        let name = node.multiscales()[0]["name"].as_str().unwrap_or(&path).to_owned();
        images.push(InnerImage { path, name });
    }
    Ok(images)
}

fn named_paths(paths: Vec<String>) -> Result<Vec<InnerImage>, ReadError> {
    let image = |path: String| {
        checked_path(&path, "path of an image")?;
        Ok(InnerImage { name: path.clone(), path })
    };
    paths.into_iter().map(image).collect()
}

fn strings(list: &Value) -> Vec<String> {
    list.as_array().into_iter().flatten().filter_map(|text| text.as_str().map(str::to_owned)).collect()
}

fn plate_refused(plate: &Value) -> ReadError {
    let well = plate["wells"][0]["path"].as_str().unwrap_or("A/1");
    ReadError::field(
        "the folder",
        "a plate of wells",
        format!("one well of it or one field, such as {well} or {well}/0"),
    )
}

fn group_of(store: &ReadableStorage, path: &str) -> Result<Node, ReadError> {
    let node = Node::read(store, path)?.filter(|node| !node.multiscales().is_empty());
    node.ok_or_else(|| ReadError::field("path of an image", path, "a group with multiscales"))
}

fn names_of(multiscales: &[Value]) -> Vec<String> {
    multiscales.iter().map(|m| m["name"].as_str().unwrap_or_default().to_owned()).collect()
}

fn choose_image(found: &mut FileFacts, names: Vec<String>) -> Result<usize, ReadError> {
    Ok(found.choose(ChoiceKind::Image, Entries::Named(names))? as usize)
}

/// An image of a group from the level that is wanted on, else from the finest.
fn multiscale(
    store: &ReadableStorage,
    group: &str,
    node: &Node,
    chosen: usize,
    depth: Depth,
    found: &mut FileFacts,
) -> Result<Vec<ImageArray>, ReadError> {
    let multiscale = &node.multiscales()[chosen];
    let datasets = datasets_of(node, multiscale);
    let level = found.choices.choose(ChoiceKind::Level, Entries::Numbered(datasets.len() as u64), 0)?.entry as usize;
    let n_levels = match depth {
        Depth::OneLevel => 1,
        Depth::AllCoarser => datasets.len().saturating_sub(level).max(1),
    };
    found.frame = node.frame().unwrap_or(found.frame);
    let level_of = |level| level_of(store, group, node, (multiscale, &datasets), level);
    (level..level + n_levels).map(level_of).collect()
}

/// The datasets of an image, the finest first: details that refine the first one of OME-Zarr come before it.
fn datasets_of<'a>(node: &'a Node, multiscale: &'a Value) -> Vec<&'a Value> {
    node.details().into_iter().chain(multiscale["datasets"].as_array().into_iter().flatten()).collect()
}

fn level_of(
    store: &ReadableStorage,
    group: &str,
    node: &Node,
    (multiscale, datasets): (&Value, &[&Value]),
    level: usize,
) -> Result<ImageArray, ReadError> {
    let dataset = *datasets.get(level).unwrap_or(&&Value::Null);
    let path = dataset["path"].as_str().ok_or(ReadError::Missing { field: "multiscales/datasets/path" })?;
    let path = joined(group, checked_path(path, "datasets/path")?);
    let array = ArrayMetadata::read(store, &path)?;
    let image = ZarrImage::of_multiscale(path, multiscale, dataset, node.ome())?;
    let finest = ZarrImage::of_multiscale(String::new(), multiscale, datasets[0], node.ome())?;
    Ok((image.in_group(node)?.turned(node.steps(), &finest), array))
}

fn plain_array(store: &ReadableStorage, path: String) -> Result<ImageArray, ReadError> {
    let array = ArrayMetadata::read(store, &path)?;
    let names = match &array.dimension_names {
        Value::Null => Node::read(store, &path)?.map_or(Value::Null, |node| node.array_dimensions().clone()),
        names => names.clone(),
    };
    Ok((ZarrImage::of_array(path, &names, array.shape.len())?, array))
}

/// The array that is wanted, else the first of those with most axes: the others are positions along them.
fn choose_array(store: &ReadableStorage, paths: Vec<String>, found: &mut FileFacts) -> Result<ImageArray, ReadError> {
    let mut n_axes = Vec::new();
    for path in &paths {
        n_axes.push(ArrayMetadata::n_axes(store, path)?);
    }
    let most = n_axes.iter().max().copied().unwrap_or(0);
    let preferred = n_axes.iter().position(|n| *n == most).unwrap_or(0);
    let chosen = found.choose_or(ChoiceKind::Array, Entries::Named(paths.clone()), preferred as u64)?;
    plain_array(store, paths[chosen as usize].clone())
}
