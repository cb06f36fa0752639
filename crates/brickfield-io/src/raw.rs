//! Raw voxels: a file that says nothing about itself, so the caller does.

use std::fmt;
use std::io::{BufRead, Seek};
use std::path::Path;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Rescale, ScalarType, Volume};

use crate::detached::Promised;
use crate::limits::CheckedShape;
use crate::opened::FileFacts;
use crate::placement::GridPlacement;
use crate::save_note::Stated;
use crate::saved::{SaveError, save_atomically, values, write_samples};
use crate::slices::{SamplesAt, StoredVolume};
use crate::stored::{ByteSkip, Encoding, StoredSamples};
use crate::{ByteOrder, Format, NoFiles, OpenOptions, Opened, ReadError, SaveNote, SaveOptions, Saved, WorldFrame};

/// The numbers that a raw file does not state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawSpec {
    /// Voxels along x (fastest), y, z.
    pub dims: UVec3,
    /// The type of one sample.
    pub scalar: ScalarType,
    /// Which end of a sample comes first.
    pub order: ByteOrder,
    /// Bytes before the first sample.
    pub skip_bytes: u64,
    /// World units between samples.
    pub spacing: DVec3,
}

impl RawSpec {
    /// Little-endian, from the first byte on, spacing 1.
    pub fn new(dims: UVec3, scalar: ScalarType) -> RawSpec {
        RawSpec { dims, scalar, order: ByteOrder::Little, skip_bytes: 0, spacing: DVec3::ONE }
    }
}

/// As `brickfield --raw` takes it.
impl fmt::Display for RawSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (dims, spacing) = (self.dims, self.spacing);
        write!(f, "{}x{}x{},{}", dims.x, dims.y, dims.z, self.scalar)?;
        if self.order == ByteOrder::Big {
            f.write_str(",big")?;
        }
        if self.skip_bytes > 0 {
            write!(f, ",skip={}", self.skip_bytes)?;
        }
        write!(f, ",spacing={}:{}:{}", spacing.x, spacing.y, spacing.z)
    }
}

/// Reads raw voxels. The outer corner of the first voxel is the world's origin.
///
/// # Errors
/// As [`ReadError`] lists them: a shape beyond the limits or the file, a spacing that is not above 0.
pub fn read(mut input: impl BufRead + Seek, spec: &RawSpec, options: &OpenOptions) -> Result<Opened, ReadError> {
    described(spec, options)?.read(&mut input, &NoFiles)
}

/// The volume of the caller's numbers.
pub(crate) fn described(spec: &RawSpec, options: &OpenOptions) -> Result<StoredVolume, ReadError> {
    let shape = CheckedShape::claim(spec.dims.to_array().map(u64::from), spec.scalar, &options.limits)?;
    let grid = GridPlacement::axis_aligned(spec.spacing, 0.5 * spec.spacing).grid(shape.dims)?;
    let byte_skip = ByteSkip::Bytes(spec.skip_bytes);
    let stored = StoredSamples { encoding: Encoding::Raw, order: spec.order, line_skip: 0, byte_skip };
    let promised = Promised { n_voxels: shape.n_voxels() as u128, n_before: 0 };
    let (found, place) = (FileFacts::plain(Format::Raw, options), SamplesAt::Here("the file"));
    Ok(StoredVolume { found, grid, rescale: Rescale::IDENTITY, shape, stored, promised, place })
}

/// Saves the values alone, x fastest: whole or not at all, for the file is renamed into place.
///
/// # Errors
/// If the folder cannot be written to.
pub fn save(path: &Path, volume: &Volume, order: ByteOrder) -> Result<Saved, SaveError> {
    let voxels = values(volume);
    save_atomically(path, |out| write_samples(out, &voxels, order))?;
    let grid = volume.grid();
    let spec = RawSpec { order, spacing: grid.spacing(), ..RawSpec::new(grid.dims(), voxels.scalar_type()) };
    let stated = Stated { frame: WorldFrame::Plain, unit: false };
    let mut saved = Saved::of(Format::Raw, volume, spec.scalar, &SaveOptions::default(), stated);
    saved.notes.push(SaveNote::SamplesAlone { spec: spec.to_string() });
    Ok(saved)
}
