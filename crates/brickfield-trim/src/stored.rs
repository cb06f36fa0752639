//! The samples of trimmed bricks in one texture.

use brickfield_core::glam::UVec3;
use brickfield_core::{Axes, BrickId, BrickLayout, Level, Place};

use crate::merge::alone;
use crate::{PackError, SampleBox, TrimmedBricks, brick_samples, pack_boxes};

/// Trimmed bricks in one texture: for each brick with something to see, the place of its samples in the texture and in space.
///
/// A field's table of places needs no more; a brick without place is empty in the field's index. With
/// [`Interpolation::Trilinear`](crate::Interpolation::Trilinear) a position beyond a place's samples may be moved to them, as a field
/// does: the value there is dark as well. With `Nearest` it must not be drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredBricks {
    layout: BrickLayout,
    texels: UVec3,
    places: Vec<Option<Place>>,
}

/// Texels of a way to store bricks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TexelAccount {
    /// Boxes that are brought to a device one by one.
    pub n_boxes: usize,
    /// Texels of all of it.
    pub n_texels: u64,
    /// Texels that hold a sample of the volume.
    pub n_samples: u64,
}

impl TexelAccount {
    /// Texels that hold no sample.
    pub fn n_padding(&self) -> u64 {
        self.n_texels - self.n_samples
    }
}

/// Voxels that are not those of the bricks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{n_voxels} voxels do not fill the bricks' volume of {} x {} x {}", dims.x, dims.y, dims.z)]
#[allow(missing_docs)]
pub struct VoxelsError {
    pub n_voxels: usize,
    pub dims: UVec3,
}

/// Trims all three axes, and packs the kept boxes into one texture of at most `most` texels along x, y, z.
///
/// A box is stored with its longest side along the texture's x and its shortest along z, so that boxes of like thickness share a layer
/// ([`pack_boxes`]).
///
/// # Errors
/// If the boxes have no room; a box's index is that among the bricks that are not white.
pub fn pack_bricks(trimmed: &TrimmedBricks, most: UVec3) -> Result<StoredBricks, PackError> {
    pack_parts(*trimmed.layout(), &packed_parts(trimmed), most)
}

/// The kept boxes, each with its longest side first.
pub(crate) fn packed_parts(trimmed: &TrimmedBricks) -> Vec<Option<Part>> {
    let longest_first = |n: UVec3| {
        let falls = |axes: &Axes| {
            let n = axes.of_texture().map(|axis| n[axis]);
            n[0] >= n[1] && n[1] >= n[2]
        };
        Axes::ALL.into_iter().find(falls).unwrap_or_default()
    };
    let part = |kept: &SampleBox| (!kept.is_empty()).then(|| Part { samples: *kept, axes: longest_first(kept.n) });
    trimmed.kept().iter().map(part).collect()
}

/// Trims each brick along its trimming axis, which becomes the texture's z, and stores it on its own: bricks before they are merged.
///
/// # Errors
/// As [`pack_bricks`].
pub fn store_alone(trimmed: &TrimmedBricks, most: UVec3) -> Result<StoredBricks, PackError> {
    pack_parts(*trimmed.layout(), &alone_parts(trimmed), most)
}

/// What is stored of each brick that is trimmed along one axis.
pub(crate) fn alone_parts(trimmed: &TrimmedBricks) -> Vec<Option<Part>> {
    trimmed.layout().bricks(Level(0)).map(|id| alone(trimmed, id)).collect()
}

fn pack_parts(layout: BrickLayout, parts: &[Option<Part>], most: UVec3) -> Result<StoredBricks, PackError> {
    let boxes: Vec<UVec3> = parts.iter().flatten().map(Part::n).collect();
    let packed = pack_boxes(&boxes, most)?;
    let mut origins = packed.origins.iter();
    let texels = parts.iter().map(|part| part.as_ref().and_then(|_| origins.next().copied()).unwrap_or_default());
    let texels: Vec<UVec3> = texels.collect();
    Ok(StoredBricks::new(layout, packed.texels, |brick| parts[brick].map(|part| (part, texels[brick]))))
}

/// A part of a brick, and which of its axes each axis of the texture runs along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    pub(crate) samples: SampleBox,
    pub(crate) axes: Axes,
}

impl Part {
    /// Samples along the axes of the texture.
    pub(crate) fn n(&self) -> UVec3 {
        UVec3::from(self.axes.of_texture().map(|axis| self.samples.n[axis]))
    }
}

/// The place of a brick's part that begins at a texel.
pub(crate) fn placed_part(layout: &BrickLayout, id: BrickId, part: &Part, texel: UVec3) -> Place {
    let first = brick_samples(layout, id).first + part.samples.first;
    let even = Place::even(texel, part.samples.n, Level(0), first.as_dvec3());
    Place { n: part.n(), axes: part.axes, ..even }
}

/// The samples of a place of level 0 in the order of the texture, x of the texture fastest, from the voxels of a volume of `dims`, x
/// fastest.
///
/// # Errors
/// If the voxels do not fill the volume.
///
/// # Panics
/// If the place reaches beyond the volume.
pub fn samples_of<T: Copy>(place: &Place, dims: UVec3, voxels: &[T]) -> Result<Vec<T>, VoxelsError> {
    let [nx, ny, nz] = dims.to_array().map(|n| n as usize);
    if voxels.len() != nx * ny * nz {
        return Err(VoxelsError { n_voxels: voxels.len(), dims });
    }
    let strides = [1, nx, nx * ny];
    let [i, j, k] = place.axes.of_texture().map(|axis| strides[axis]);
    let first = place.first.as_uvec3().to_array().into_iter().zip(strides).map(|(p, s)| p as usize * s).sum::<usize>();
    let [ni, nj, nk] = place.n.to_array().map(|n| n as usize);
    let mut samples = Vec::with_capacity(place.n_samples());
    for row in (0..nj * nk).map(|row| first + row % nj * j + row / nj * k) {
        samples.extend((0..ni).map(|x| voxels[row + x * i]));
    }
    Ok(samples)
}

impl StoredBricks {
    /// `part` has, for each brick that is stored, its part and the first texel of it.
    pub(crate) fn new(
        layout: BrickLayout,
        texels: UVec3,
        part: impl Fn(usize) -> Option<(Part, UVec3)>,
    ) -> StoredBricks {
        let place = |id: BrickId| {
            let (part, texel) = part(layout.ordinal(id))?;
            Some(placed_part(&layout, id, &part, texel))
        };
        StoredBricks { layout, texels, places: layout.bricks(Level(0)).map(place).collect() }
    }

    pub(crate) fn of_places(layout: BrickLayout, texels: UVec3, places: Vec<Option<Place>>) -> StoredBricks {
        StoredBricks { layout, texels, places }
    }

    /// Which bricks there are.
    pub fn layout(&self) -> &BrickLayout {
        &self.layout
    }

    /// Texels of the texture along x, y, z.
    pub fn texels(&self) -> UVec3 {
        self.texels
    }

    /// Where the samples of each brick lie, by [`BrickLayout::ordinal`]; `None` of a white brick.
    pub fn places(&self) -> &[Option<Place>] {
        &self.places
    }

    /// The samples of a brick in the order of the texture ([`samples_of`]); none of a white brick.
    ///
    /// # Errors
    /// If the voxels do not fill the volume.
    ///
    /// # Panics
    /// If the layout has no such brick.
    pub fn samples<T: Copy>(&self, ordinal: usize, voxels: &[T]) -> Result<Vec<T>, VoxelsError> {
        match &self.places[ordinal] {
            Some(place) => samples_of(place, self.layout.dims(), voxels),
            None => Ok(Vec::new()),
        }
    }

    /// Texels, and those among them that hold a sample. A box is a brick's.
    pub fn account(&self) -> TexelAccount {
        let stored = || self.places.iter().flatten();
        TexelAccount {
            n_boxes: stored().count(),
            n_texels: self.texels.as_u64vec3().element_product(),
            n_samples: stored().map(|place| place.n_samples() as u64).sum(),
        }
    }
}
