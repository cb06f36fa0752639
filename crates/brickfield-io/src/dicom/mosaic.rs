//! Siemens mosaics: the slices of a volume as the tiles of one frame.
//!
//! ```text
//!  0 1 2    n = 7 slices: ceil(sqrt(7)) = 3 tiles a side; the last tiles are empty.
//!  3 4 5    The stated position is that of a slice as large as the frame, around the same centre:
//!  6 . .    slice 0 begins half the difference further along rows and columns.
//! ```

use std::rc::Rc;

use brickfield_core::glam::DVec3;

use super::elements::DataSet;
use super::image::Image;
use super::slice::{Scopes, Slice};
use super::tags;
use crate::ReadError;

pub(super) fn is_mosaic(elements: &DataSet) -> bool {
    elements.text(tags::IMAGE_TYPE).is_some_and(|kinds| kinds.split('\\').any(|kind| kind.trim() == "MOSAIC"))
}

/// The slices of a mosaic.
///
/// # Errors
/// If nothing says how many there are, or in which direction they follow each other, or they do not fill a square.
pub(super) fn tiles(image: Rc<Image>, elements: &DataSet) -> Result<Vec<Slice>, ReadError> {
    let csa = elements.bytes(tags::SIEMENS_CSA_IMAGE_HEADER).unwrap_or_default();
    let n_slices = elements.number(tags::SIEMENS_MOSAIC_COUNT).filter(|n| *n >= 1.0);
    let n_slices = n_slices.or_else(|| csa_numbers(csa, "NumberOfImagesInMosaic")?.first().copied());
    let n_slices = n_slices.ok_or(ReadError::Missing { field: "NumberOfImagesInMosaic of a Siemens mosaic" })?;
    let n_side = n_slices.sqrt().ceil();
    let divides = |n: u64| n.is_multiple_of(n_side as u64) && n >= n_side as u64;
    if !(1.0..=65536.0).contains(&n_slices) || !divides(image.columns) || !divides(image.rows) {
        let size = format!("{n_slices} in {} x {}", image.columns, image.rows);
        return Err(ReadError::field("NumberOfImagesInMosaic", size, "tiles of one size"));
    }
    let (n_side, n_slices) = (n_side as u64, n_slices as u64);
    let (columns, rows) = (image.columns / n_side, image.rows / n_side);
    let whole = Scopes { frame: None, shared: None, file: elements }.slice(&image, 0);
    let placed = first_tile(&whole, [columns, rows], csa)?;
    let tile = |i: u64| Slice {
        corner: [i % n_side * columns, i / n_side * rows],
        columns,
        rows,
        position: placed.map(|(first, step)| first + step * i as f64),
        step_from: whole.stated_step.map(|step| step.from),
        location: None,
        ..whole.clone()
    };
    Ok((0..n_slices).map(tile).collect())
}

/// The position of the first tile and the step to the next, unless the file does not place its slices.
fn first_tile(whole: &Slice, tile: [u64; 2], csa: &[u8]) -> Result<Option<(DVec3, DVec3)>, ReadError> {
    let (Some(position), Some(normal), Some([along_row, along_column]), Some([dx, dy]), Some(step)) =
        (whole.position, whole.normal(), whole.orientation, whole.pixel_spacing, whole.stated_step)
    else {
        return Ok(None);
    };
    let missing = ReadError::Missing { field: "SliceNormalVector of a Siemens mosaic" };
    let stated = csa_numbers(csa, "SliceNormalVector").and_then(|n| <[f64; 3]>::try_from(n).ok()).ok_or(missing)?;
    let sign = if normal.dot(DVec3::from(stated)) < 0.0 { -1.0 } else { 1.0 };
    let half = |whole: u64, tile: u64| (whole - tile) as f64 / 2.0;
    let across = along_row * dx * half(whole.columns, tile[0]) + along_column * dy * half(whole.rows, tile[1]);
    Ok(Some((position + across, normal * (sign * step.length))))
}

const CSA_NAME_BYTES: usize = 64;
const CSA_TAG_BYTES: usize = 84;
const CSA_ITEM_BYTES: usize = 16;
const MAX_CSA_TAGS: u32 = 1024;

/// The numbers of an entry of a Siemens CSA header, in either version.
///
/// A tag is a name of 64 bytes, four numbers, the number of items, and one more number. An item is four numbers of which
/// the second (the first one in version 1, too) is its length, then a text, filled up to a multiple of 4.
fn csa_numbers(csa: &[u8], wanted: &str) -> Option<Vec<f64>> {
    let mut at = if csa.starts_with(b"SV10") { csa.get(8..)? } else { csa };
    let n_tags = word(at, 0)?.min(MAX_CSA_TAGS);
    at = at.get(8..)?;
    for _ in 0..n_tags {
        let name = at.get(..CSA_NAME_BYTES)?.split(|b| *b == 0).next()?;
        let is_wanted = name == wanted.as_bytes();
        let n_items = word(at, 76)?;
        at = at.get(CSA_TAG_BYTES..)?;
        let mut numbers = Vec::new();
        for _ in 0..n_items {
            let length = word(at, 4)? as usize;
            let value = at.get(CSA_ITEM_BYTES..CSA_ITEM_BYTES.checked_add(length)?)?;
            let text = String::from_utf8_lossy(value);
            if is_wanted && let Ok(number) = text.trim_matches(['\0', ' ']).parse() {
                numbers.push(number);
            }
            at = at.get(CSA_ITEM_BYTES + length.next_multiple_of(4)..)?;
        }
        if is_wanted {
            return Some(numbers);
        }
    }
    None
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}
