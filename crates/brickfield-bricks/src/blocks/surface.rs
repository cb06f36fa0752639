//! Normals of surface voxels (Saladi, Pinnamaneni and Meyer 2003, section "Illumination").
//!
//! ```text
//! outside     the transfer function makes the voxel's value transparent
//! surface     not outside, and one of the 26 neighbours is
//! normal      the sum, over the outside neighbours, of the direction to each times the difference of the two values, normalised
//! ```
//!
//! Departures from the paper:
//!
//! 1. A voxel whose colour is close to the background's is not outside: a plan has no background.
//! 2. Directions are those of the grid, as are their sums; a sum is then turned to the world as gradients are, divided by the spacing along
//!    each axis. Where voxels are cubes that is the paper's sum. Where they are not, directions in the world would favour the long axis: on
//!    a ball in voxels of 1 : 1 : 2.5 half of the normals are off by more than 34 degrees so, and by more than 7 as it is done here.
//! 3. The volume's faces are no surface: voxels beyond them are not outside (the paper does not speak of them).
//! 4. Where sums cancel, between two outside voxels, there is no normal, and no light.

use std::sync::Arc;

use brickfield_core::glam::{DVec3, IVec3, UVec3};
use brickfield_core::{BlockLayout, Level, TransferFunction, ValueRange};
use rayon::prelude::*;

use super::gradient::{NO_GRADIENT, code};
use super::outside::OutsideValues;
use super::positions;
use super::source::{BlockSource, FetchError, SourceId};

/// The normals of a block's voxels, x fastest.
type Normals = Arc<[[u8; 4]]>;

/// The normals of a source's surface voxels under a transfer function, at full resolution, in the form of
/// [`Companion::SurfaceNormal`](brickfield_core::Companion::SurfaceNormal).
///
/// Four bytes for each voxel of a block with a surface, none for others. A clone shares them.
#[derive(Clone, Debug)]
pub struct SurfaceNormals {
    source: SourceId,
    layout: BlockLayout,
    outside: OutsideValues,
    /// Of each block, by number, the normals of its voxels, x fastest; `None` without a surface.
    blocks: Vec<Option<Normals>>,
}

/// The work that a transfer function made.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SurfaceEdit {
    /// Voxels of the volume.
    pub n_voxels: u64,
    /// Voxels that were read: of blocks with, or beside, values whose transparency changed.
    pub n_examined: u64,
    /// Voxels whose normal was computed: their own transparency changed, or that of a neighbour.
    pub n_recomputed: u64,
    /// Blocks with other normals than before, by number, ascending.
    pub changed: Vec<usize>,
}

/// A sum of directions is 0 if it is this part of the sum of its weights, or less: rounding does not decide which way a normal points.
const CANCELS: f64 = 1e-9;
/// Greater differences of values are as great as this: sums stay finite.
const MOST_DIFFERENCE: f64 = f64::MAX / 64.0;

impl SurfaceNormals {
    /// Of a source of which nothing is outside: there is no surface.
    pub fn none(source: &dyn BlockSource) -> SurfaceNormals {
        let layout = *source.layout();
        let (outside, blocks) = (OutsideValues::default(), vec![None; layout.n_blocks_total()]);
        SurfaceNormals { source: source.id(), layout, outside, blocks }
    }

    /// Under another transfer function: what is the same as before is kept.
    ///
    /// A block is read only if values whose transparency changed lie in its range, or in that of a neighbour; of such a block a voxel is
    /// computed only if its own transparency changed, or that of one of its 26 neighbours.
    ///
    /// # Errors
    /// As [`BlockSource::fetch_around`].
    pub fn after(
        &self,
        source: &dyn BlockSource,
        transfer: &TransferFunction,
    ) -> Result<(SurfaceNormals, SurfaceEdit), FetchError> {
        let before = if self.is_of(source) { self.clone() } else { SurfaceNormals::none(source) };
        let outside = OutsideValues::of(transfer);
        let work = EditedBlocks {
            source,
            layout: &before.layout,
            inside_to_world: source.grid().spacing().recip(),
            differing: before.outside.differing(&outside),
            outside: &outside,
        };
        let n_blocks = before.blocks.len();
        let edited: Vec<EditedBlock> = (0..n_blocks)
            .into_par_iter()
            .filter_map(|i| work.edited(i, &before.blocks[i]).transpose())
            .collect::<Result<_, _>>()?;
        let n_voxels = source.layout().dims().as_u64vec3().element_product();
        let mut edit = SurfaceEdit { n_voxels, ..SurfaceEdit::default() };
        let mut after = SurfaceNormals { outside, ..before };
        for EditedBlock { ordinal, normals, n_examined, n_recomputed } in edited {
            edit.n_examined += n_examined;
            edit.n_recomputed += n_recomputed;
            if after.blocks[ordinal] != normals {
                edit.changed.push(ordinal);
                after.blocks[ordinal] = normals;
            }
        }
        Ok((after, edit))
    }

    /// Whether these are a source's.
    pub fn is_of(&self, source: &dyn BlockSource) -> bool {
        self.source == source.id()
    }

    /// Bytes of normals.
    pub fn n_bytes(&self) -> u64 {
        self.blocks.iter().flatten().map(|normals| size_of_val(&normals[..]) as u64).sum()
    }

    /// The normals of a block's samples of a level, x fastest: at coarser levels the average of its voxels' normals, of which those without
    /// one count as 0.
    ///
    /// # Errors
    /// If the layout has no such block or level.
    pub fn codes(&self, block: UVec3, level: Level) -> Result<Vec<u8>, FetchError> {
        FetchError::unless_exists(&self.layout, block, level)?;
        let n = self.layout.n_samples_total(block, level) as usize;
        Ok(match &self.blocks[self.layout.ordinal(block)] {
            None => NO_GRADIENT.repeat(n),
            Some(normals) if level == Level(0) => normals.as_flattened().to_vec(),
            Some(normals) => averages(normals, self.layout.extent(block), level),
        })
    }
}

/// What an edit of the transfer function changes.
struct EditedBlocks<'a> {
    source: &'a dyn BlockSource,
    layout: &'a BlockLayout,
    /// From a sum of the grid's directions to one of the world along the grid's axes.
    inside_to_world: DVec3,
    outside: &'a OutsideValues,
    /// The values that were outside and are not now, or the other way round.
    differing: OutsideValues,
}

/// A block of which normals may be others.
struct EditedBlock {
    ordinal: usize,
    normals: Option<Normals>,
    n_examined: u64,
    n_recomputed: u64,
}

impl EditedBlocks<'_> {
    /// A block's normals, if they may be others than before.
    fn edited(&self, ordinal: usize, before: &Option<Normals>) -> Result<Option<EditedBlock>, FetchError> {
        let block = self.layout.block(ordinal);
        let (own, around) = (self.source.summaries()[ordinal].range, self.range_around(block));
        if !self.differing.meets(around) {
            return Ok(None);
        }
        if self.outside.covers(own) || !self.outside.meets(around) {
            return Ok(Some(EditedBlock { ordinal, normals: None, n_examined: 0, n_recomputed: 0 }));
        }
        let mut values = Vec::new();
        self.source.fetch_around(block, &mut values)?;
        let voxels = Voxels { values, first: self.layout.first_voxel(block), extent: self.layout.extent(block) };
        let (concerned, n_examined) = (self.concerned(&voxels), u64::from(voxels.extent.element_product()));
        let normals = match concerned.is_empty() {
            true => before.clone(),
            false => self.of_voxels(&voxels, &concerned, before),
        };
        Ok(Some(EditedBlock { ordinal, normals, n_examined, n_recomputed: concerned.len() as u64 }))
    }

    /// The least and the greatest value of a block and those beside it.
    fn range_around(&self, block: UVec3) -> ValueRange {
        let (low, high) = (block.saturating_sub(UVec3::ONE), (block + 1).min(self.layout.n_blocks() - 1));
        let ranges = positions(high - low + 1).map(|p| self.source.summaries()[self.layout.ordinal(low + p)].range);
        ranges.reduce(|a, b| ValueRange { min: a.min.min(b.min), max: a.max.max(b.max) }).expect("the block itself")
    }

    /// The voxels of a block whose own transparency changed, or that of a neighbour, x fastest. A repeated outer voxel stands for a
    /// neighbour, or for the voxel itself.
    fn concerned(&self, voxels: &Voxels) -> Vec<UVec3> {
        let n = voxels.extent + 2;
        let mut is_concerned = vec![false; voxels.extent.element_product() as usize];
        let differing = voxels.values.iter().enumerate().filter(|(_, value)| self.differing.contains(**value));
        for i in differing.map(|(i, _)| i as u32) {
            // The first voxel of the block is the second one of those around it.
            let p = UVec3::new(i % n.x, i / n.x % n.y, i / (n.x * n.y));
            let (low, end) = (p.saturating_sub(UVec3::splat(2)), (p + 1).min(voxels.extent));
            for (y, z) in (low.z..end.z).flat_map(|z| (low.y..end.y).map(move |y| (y, z))) {
                let row = voxels.extent.x * (y + voxels.extent.y * z);
                is_concerned[(row + low.x) as usize..(row + end.x) as usize].fill(true);
            }
        }
        positions(voxels.extent).zip(is_concerned).filter(|(_, is)| *is).map(|(voxel, _)| voxel).collect()
    }

    /// The normals of a block, of which those of some voxels are computed.
    fn of_voxels(&self, voxels: &Voxels, concerned: &[UVec3], before: &Option<Normals>) -> Option<Normals> {
        let (extent, neighbours) = (voxels.extent, neighbours(voxels.extent));
        let is_outside: Vec<bool> = voxels.values.iter().map(|value| self.outside.contains(*value)).collect();
        let normal = |voxel: UVec3| {
            let at = voxels.at(voxel);
            if is_outside[at] {
                return NO_GRADIENT;
            }
            let is_there = |n: &Neighbour| self.has_voxel((voxels.first + voxel).as_ivec3() + n.offset);
            let outside = neighbours.iter().filter(|n| is_outside[n.of(at)] && is_there(n));
            self.normal(outside.map(|n| (n.direction, (voxels.values[at] - voxels.values[n.of(at)]).abs())))
        };
        let none = || vec![NO_GRADIENT; extent.element_product() as usize];
        let mut normals = before.as_ref().map_or_else(none, |normals| normals.to_vec());
        for voxel in concerned {
            normals[(voxel.x + extent.x * (voxel.y + extent.y * voxel.z)) as usize] = normal(*voxel);
        }
        normals.iter().any(|normal| *normal != NO_GRADIENT).then(|| normals.into())
    }

    /// Whether the volume has a voxel.
    fn has_voxel(&self, p: IVec3) -> bool {
        p.cmpge(IVec3::ZERO).all() && p.as_uvec3().cmplt(self.layout.dims()).all()
    }

    /// The normal of directions to outside neighbours and their weights, as four bytes of the direction towards the inside.
    fn normal(&self, outside: impl Iterator<Item = (DVec3, f64)>) -> [u8; 4] {
        let (sum, weights) = outside.fold((DVec3::ZERO, 0.0), |(sum, weights), (direction, weight)| {
            (sum + direction * weight.min(MOST_DIFFERENCE), weights + weight.min(MOST_DIFFERENCE))
        });
        let mean = sum / weights;
        // Not if there is no neighbour, either: that is 0 of 0.
        match mean.length() > CANCELS {
            true => code((-mean * self.inside_to_world).normalize_or_zero()),
            false => NO_GRADIENT,
        }
    }
}

/// The values of a block's voxels, and one beyond on every side.
struct Voxels {
    values: Vec<f64>,
    first: UVec3,
    extent: UVec3,
}

impl Voxels {
    /// The number of a voxel of the block.
    fn at(&self, voxel: UVec3) -> usize {
        let [nx, ny] = [self.extent.x as usize + 2, self.extent.y as usize + 2];
        let [x, y, z] = (voxel + 1).to_array().map(|i| i as usize);
        x + nx * (y + ny * z)
    }
}

/// One of the 26 voxels around a voxel.
struct Neighbour {
    offset: IVec3,
    /// From a voxel's number to its own.
    step: isize,
    direction: DVec3,
}

impl Neighbour {
    /// Its number, by the voxel's.
    #[inline]
    fn of(&self, voxel: usize) -> usize {
        voxel.wrapping_add_signed(self.step)
    }
}

/// The neighbours of a voxel of a block.
fn neighbours(extent: UVec3) -> Vec<Neighbour> {
    let [nx, ny] = [extent.x as isize + 2, extent.y as isize + 2];
    let neighbour = |p: UVec3| {
        let offset = p.as_ivec3() - 1;
        let step = offset.x as isize + nx * (offset.y as isize + ny * offset.z as isize);
        Neighbour { offset, step, direction: offset.as_dvec3().normalize_or_zero() }
    };
    positions(UVec3::splat(3)).filter(|p| *p != UVec3::ONE).map(neighbour).collect()
}

/// The averages of a block's normals at a coarser level.
fn averages(normals: &[[u8; 4]], extent: UVec3, level: Level) -> Vec<u8> {
    let n = level.dims_of(extent);
    let mut sums = vec![(DVec3::ZERO, 0u32); n.element_product() as usize];
    for (voxel, [x, y, z, length]) in positions(extent).zip(normals) {
        let sample = voxel / level.stride();
        let sum = &mut sums[(sample.x + n.x * (sample.y + n.y * sample.z)) as usize];
        let zero = f64::from(NO_GRADIENT[0]);
        let direction = (DVec3::from([x, y, z].map(|c| f64::from(*c))) - zero) / zero;
        *sum = (sum.0 + direction * f64::from(*length) / 255.0, sum.1 + 1);
    }
    sums.into_iter().flat_map(|(sum, count)| code(sum / f64::from(count))).collect()
}
