//! Trimmed bricks in pages: the texture cache's chunks.

use brickfield_core::glam::UVec3;
use brickfield_core::{BrickId, BrickLayout, Level, Place};

use crate::stored::{Part, alone_parts, packed_parts, placed_part};
use crate::{MergedBricks, PackError, StoredBricks, TexelAccount, TrimmedBricks, pack_boxes};

/// Trimmed bricks in pages of a texture: boxes of equal size that are brought to a device, and leave it, as a whole.
///
/// Bricks that are near each other in space share a page (they follow each other on a Z curve), so that a view from any side asks for
/// the pages of a region one after another.
#[derive(Clone, Debug, PartialEq)]
pub struct PagedBricks {
    layout: BrickLayout,
    texels: UVec3,
    bricks: Vec<Option<PagedBrick>>,
    pages: Vec<Vec<usize>>,
}

/// Where the samples of a brick lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PagedBrick {
    /// The page.
    pub page: usize,
    /// The place in it: its texels are counted from the page's first.
    pub place: Place,
}

impl PagedBrick {
    /// The place in a texture where the page begins at some texel.
    pub fn place_from(&self, page: UVec3) -> Place {
        Place { texel: self.place.texel + page, ..self.place }
    }
}

/// A box of texels that is not divided among pages, with its bricks and where they begin in it.
struct Item {
    n: UVec3,
    bricks: Vec<(usize, Part, UVec3)>,
}

impl PagedBricks {
    /// The kept boxes of bricks, trimmed along all axes ([`pack_bricks`](crate::pack_bricks)), in pages of `texels`.
    ///
    /// # Errors
    /// If a brick does not fit a page; its index is that among the bricks that are not white, along the Z curve.
    pub fn packed(trimmed: &TrimmedBricks, texels: UVec3) -> Result<PagedBricks, PackError> {
        PagedBricks::of_parts(*trimmed.layout(), &packed_parts(trimmed), texels)
    }

    /// Bricks that are trimmed along one axis each ([`store_alone`](crate::store_alone)), in pages of `texels`.
    ///
    /// # Errors
    /// As [`packed`](Self::packed).
    pub fn alone(trimmed: &TrimmedBricks, texels: UVec3) -> Result<PagedBricks, PackError> {
        PagedBricks::of_parts(*trimmed.layout(), &alone_parts(trimmed), texels)
    }

    /// Merged chunks, none of them divided, in pages of `texels`; the paper's texture cache is one page.
    ///
    /// # Errors
    /// If a chunk does not fit a page.
    pub fn merged(merged: &MergedBricks, texels: UVec3) -> Result<PagedBricks, PackError> {
        let item = |chunk: &crate::TextureChunk| {
            let brick = |i: &usize| merged.parts()[*i].map(|part| (*i, part.part(), part.texel));
            Item { n: chunk.n, bricks: chunk.bricks.iter().filter_map(brick).collect() }
        };
        PagedBricks::of_items(*merged.layout(), merged.chunks().iter().map(item).collect(), texels)
    }

    fn of_parts(layout: BrickLayout, parts: &[Option<Part>], texels: UVec3) -> Result<PagedBricks, PackError> {
        let item = |(i, part): (usize, &Option<Part>)| {
            part.map(|part| Item { n: part.n(), bricks: vec![(i, part, UVec3::ZERO)] })
        };
        PagedBricks::of_items(layout, parts.iter().enumerate().filter_map(item).collect(), texels)
    }

    fn of_items(layout: BrickLayout, mut items: Vec<Item>, texels: UVec3) -> Result<PagedBricks, PackError> {
        let ids: Vec<BrickId> = layout.bricks(Level(0)).collect();
        items.sort_by_cached_key(|item| item.bricks.first().map(|(i, ..)| along_curve(ids[*i].coords)));
        let mut paged = PagedBricks { layout, texels, bricks: vec![None; ids.len()], pages: Vec::new() };
        let mut first = 0;
        while first < items.len() {
            let (n, origins) = fill(&items[first..], texels).map_err(|error| counted_from(error, first))?;
            let page = paged.pages.len();
            for (item, origin) in items[first..first + n].iter().zip(origins) {
                for (i, part, texel) in &item.bricks {
                    let place = placed_part(&layout, ids[*i], part, origin + texel);
                    paged.bricks[*i] = Some(PagedBrick { page, place });
                }
            }
            paged.pages.push(items[first..first + n].iter().flat_map(|item| item.bricks.iter().map(|b| b.0)).collect());
            first += n;
        }
        Ok(paged)
    }

    /// Which bricks there are.
    pub fn layout(&self) -> &BrickLayout {
        &self.layout
    }

    /// Texels of a page along x, y, z.
    pub fn texels(&self) -> UVec3 {
        self.texels
    }

    /// Texels of a page.
    pub fn n_page_texels(&self) -> u64 {
        self.texels.as_u64vec3().element_product()
    }

    /// Where each brick lies, by [`BrickLayout::ordinal`]; `None` of a white brick.
    pub fn bricks(&self) -> &[Option<PagedBrick>] {
        &self.bricks
    }

    /// The bricks of each page, by [`BrickLayout::ordinal`].
    pub fn pages(&self) -> &[Vec<usize>] {
        &self.pages
    }

    /// All pages in one texture, one upon the other along z.
    pub fn one_upon_the_other(&self) -> StoredBricks {
        let place = |brick: &PagedBrick| brick.place_from(UVec3::Z * self.texels.z * brick.page as u32);
        let places = self.bricks.iter().map(|brick| brick.as_ref().map(place)).collect();
        StoredBricks::of_places(self.layout, self.texels.with_z(self.texels.z * self.pages.len() as u32), places)
    }

    /// Texels of all pages, and those among them that hold a sample. A box is a page.
    pub fn account(&self) -> TexelAccount {
        TexelAccount {
            n_boxes: self.pages.len(),
            n_texels: self.pages.len() as u64 * self.n_page_texels(),
            n_samples: self.bricks.iter().flatten().map(|brick| brick.place.n_samples() as u64).sum(),
        }
    }
}

/// How many of the first items fill a page, and where they lie in it.
fn fill(items: &[Item], texels: UVec3) -> Result<(usize, Vec<UVec3>), PackError> {
    let page = texels.as_u64vec3().element_product();
    let so_far = items.iter().scan(0, |sum, item| {
        *sum += item.n.as_u64vec3().element_product();
        Some(*sum)
    });
    let mut n = so_far.take_while(|sum| *sum <= page).count().max(1);
    let boxes: Vec<UVec3> = items[..n].iter().map(|item| item.n).collect();
    loop {
        match pack_boxes(&boxes[..n], texels) {
            Ok(packed) => return Ok((n, packed.origins)),
            Err(error) if n == 1 => return Err(error),
            Err(_) => n -= (n / 16).max(1),
        }
    }
}

/// The error about an item, which is counted from the first of all items.
fn counted_from(error: PackError, first: usize) -> PackError {
    match error {
        PackError::Box { index, axis, n, most } => PackError::Box { index: index + first, axis, n, most },
        other => other,
    }
}

/// The place on a Z curve: bits of x, y and z in turn, x lowest.
fn along_curve(p: UVec3) -> u64 {
    let spread = |x: u32| (0..21).map(|bit| u64::from(x >> bit & 1) << (3 * bit)).sum::<u64>();
    spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_goes_through_each_block_before_the_next() {
        let of = |x, y, z| along_curve(UVec3::new(x, y, z));
        assert_eq!([of(0, 0, 0), of(1, 0, 0), of(0, 1, 0), of(1, 1, 1), of(2, 0, 0)], [0, 1, 2, 7, 8]);
        assert!(of(1, 1, 1) < of(0, 0, 2) && of(1 << 20, 0, 0) == 1 << 60);
    }
}
