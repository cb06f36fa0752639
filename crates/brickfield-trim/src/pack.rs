//! Boxes of texels in one texture.

use std::cmp::Reverse;

use brickfield_core::glam::UVec3;

/// Boxes in a texture, none over another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PackedBoxes {
    /// Texels of the texture along x, y, z.
    pub texels: UVec3,
    /// The first texel of each box.
    pub origins: Vec<UVec3>,
}

/// Why boxes do not lie in a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum PackError {
    #[error("box {index} has {n} texels along {axis}; it must have 1 to {most}")]
    Box { index: usize, axis: char, n: u32, most: u32 },
    #[error("{n_boxes} boxes take {needed} texels along z, over {} x {}; the texture may have {}", most.x, most.y, most.z)]
    Full { n_boxes: usize, needed: u64, most: UVec3 },
}

/// Packs boxes of texels into one texture of at most `most` texels along x, y, z.
///
/// From the thickest along z to the thinnest, a box goes to the first shelf with room; shelves lie side by side in layers. Of several
/// widths of the texture, the one that leaves the least texels is taken. No box is rotated.
///
/// ```text
///   a layer, from above                       layers, from the side
/// +---------+-------+------+              +----------------------+
/// |         |       |      |  shelf       |  ...                 |
/// |         |       +------+              +-----+----+---+-------+
/// +-------+-+--+----+------+              |     |    +---+       |
/// |       |    +----+      |  shelf       |     |    |   |       |
/// +-------+----+-----------+              +-----+----+---+-------+
/// ```
///
/// # Errors
/// If a box has no texels or more than the texture along an axis, or not all boxes have room.
pub fn pack_boxes(boxes: &[UVec3], most: UVec3) -> Result<PackedBoxes, PackError> {
    for (index, n) in boxes.iter().enumerate() {
        for (axis, name) in ['x', 'y', 'z'].into_iter().enumerate() {
            if !(1..=most[axis]).contains(&n[axis]) {
                return Err(PackError::Box { index, axis: name, n: n[axis], most: most[axis] });
            }
        }
    }
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by_key(|i| (Reverse(boxes[*i].z), Reverse(boxes[*i].y), Reverse(boxes[*i].x)));
    let shelved: Vec<Shelved> = widths(boxes, most).into_iter().map(|width| shelve(boxes, &order, width)).collect();
    let fits = shelved.iter().filter(|s| s.height <= u64::from(most.z));
    match fits.min_by_key(|s| s.n_texels()) {
        Some(best) => {
            Ok(PackedBoxes { texels: best.width.extend_z(best.height as u32), origins: best.origins.clone() })
        }
        None => {
            let needed = shelved.iter().map(|s| s.height).min().unwrap_or(0);
            Err(PackError::Full { n_boxes: boxes.len(), needed, most })
        }
    }
}

/// Texels of a texture along x and y.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Width {
    x: u32,
    y: u32,
}

impl Width {
    fn extend_z(self, z: u32) -> UVec3 {
        UVec3::new(self.x, self.y, z)
    }
}

/// Widths from that of a cube of the boxes' texels up to half as much again, and the greatest.
fn widths(boxes: &[UVec3], most: UVec3) -> Vec<Width> {
    let n_texels: f64 = boxes.iter().map(|n| n.as_dvec3().element_product()).sum();
    let least = boxes.iter().fold(UVec3::ZERO, |least, n| least.max(*n));
    let around = |part: u32| {
        let side = (n_texels.cbrt() * (1.0 + f64::from(part) / 16.0)).ceil() as u32;
        Width { x: side.clamp(least.x, most.x), y: side.clamp(least.y, most.y) }
    };
    let mut widths: Vec<Width> = (0..=8).map(around).chain([Width { x: most.x, y: most.y }]).collect();
    widths.dedup();
    widths
}

struct Shelved {
    /// Texels that boxes take along x and y.
    width: Width,
    height: u64,
    origins: Vec<UVec3>,
}

impl Shelved {
    fn n_texels(&self) -> u128 {
        u128::from(self.width.x) * u128::from(self.width.y) * u128::from(self.height)
    }
}

/// A row of boxes along x.
struct Shelf {
    y: u32,
    depth: u32,
    /// Texels along x that are taken.
    x: u32,
}

/// Shelves side by side along y; as high as the first box.
struct Layer {
    z: u64,
    shelves: Vec<Shelf>,
    /// Texels along y that are taken.
    y: u32,
}

/// Puts boxes on shelves; `order` has them by falling thickness.
fn shelve(boxes: &[UVec3], order: &[usize], most: Width) -> Shelved {
    let mut layers: Vec<Layer> = Vec::new();
    let (mut width, mut height) = (Width::default(), 0);
    let mut origins = vec![UVec3::ZERO; boxes.len()];
    for &i in order {
        let n = boxes[i];
        let (layer, shelf) = room(&mut layers, n, most).unwrap_or_else(|| {
            layers.push(Layer { z: height, shelves: vec![Shelf { y: 0, depth: n.y, x: 0 }], y: n.y });
            height += u64::from(n.z);
            (layers.len() - 1, 0)
        });
        let (z, shelf) = (layers[layer].z, &mut layers[layer].shelves[shelf]);
        origins[i] = UVec3::new(shelf.x, shelf.y, u32::try_from(z).unwrap_or(u32::MAX));
        shelf.x += n.x;
        width = Width { x: width.x.max(shelf.x), y: width.y.max(shelf.y + n.y) };
    }
    Shelved { width, height, origins }
}

/// The first layer and shelf with room for a box that is no thicker than any layer; a shelf is added where a layer has room for one.
fn room(layers: &mut [Layer], n: UVec3, most: Width) -> Option<(usize, usize)> {
    for (i, layer) in layers.iter_mut().enumerate() {
        if let Some(shelf) = layer.shelves.iter().position(|s| n.y <= s.depth && n.x <= most.x - s.x) {
            return Some((i, shelf));
        }
        if n.y <= most.y - layer.y {
            layer.shelves.push(Shelf { y: layer.y, depth: n.y, x: 0 });
            layer.y += n.y;
            return Some((i, layer.shelves.len() - 1));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn equal_boxes_leave_no_texel() {
        let packed = pack_boxes(&[UVec3::splat(4); 27], UVec3::splat(64)).unwrap();
        assert_eq!(packed.texels, UVec3::splat(12));
        assert_eq!(pack_boxes(&[], UVec3::splat(64)).unwrap().texels, UVec3::ZERO);
    }

    #[test]
    fn boxes_without_room_are_named() {
        let error = |boxes: &[UVec3]| pack_boxes(boxes, UVec3::new(8, 8, 10)).unwrap_err().to_string();
        assert_eq!(error(&[UVec3::ONE, UVec3::new(1, 9, 1)]), "box 1 has 9 texels along y; it must have 1 to 8");
        assert_eq!(error(&[UVec3::new(0, 1, 1)]), "box 0 has 0 texels along x; it must have 1 to 8");
        assert_eq!(error(&[UVec3::splat(6); 2]), "2 boxes take 12 texels along z, over 8 x 8; the texture may have 10");
    }

    proptest! {
        #[test]
        fn no_two_boxes_share_a_texel(
            boxes in prop::collection::vec(prop::array::uniform3(1..17u32).prop_map(UVec3::from), 0..60)
        ) {
            let packed = pack_boxes(&boxes, UVec3::new(40, 60, 4096)).unwrap();
            let ends: Vec<UVec3> = packed.origins.iter().zip(&boxes).map(|(origin, n)| origin + n).collect();
            prop_assert!(ends.iter().all(|end| end.cmple(packed.texels).all()));
            prop_assert!(packed.texels.cmple(UVec3::new(40, 60, 4096)).all());
            for i in 0..boxes.len() {
                for j in 0..i {
                    let apart = ends[i].cmple(packed.origins[j]) | ends[j].cmple(packed.origins[i]);
                    prop_assert!(apart.any(), "boxes {} and {}", i, j);
                }
            }
        }
    }
}
