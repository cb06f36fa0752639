//! Volumes whose slices are read in order, so that they are never whole in memory.

mod stored;
mod whole;

pub(crate) use stored::{SamplesAt, StoredVolume};

use std::path::Path;

use brickfield_core::Voxels;

use crate::files::ByteSource;
use crate::open::{buffered, parent};
use crate::{
    Format, Limits, OpenError, OpenOptions, RawSpec, ReadError, VolumeFacts, detect, metaimage, nrrd, open, raw,
};
use whole::WholeSlices;

/// A volume whose slices come in order of z, each x fastest.
pub trait SliceSource {
    /// All about the volume but its samples.
    fn facts(&self) -> &VolumeFacts;

    /// The next slices: `n` of them, fewer at the end, and no samples after it; as they are stored, values that are not finite included.
    ///
    /// # Errors
    /// Samples that cannot be had. No more slices come then.
    fn next_slices(&mut self, n: u32) -> Result<Voxels, ReadError>;
}

/// Opens a volume of which the slices are read in order.
///
/// Of NRRD, MetaImage, NIfTI and OME-Zarr, compressed or not, slices are in memory as they are asked for, and `options.limits` do not
/// bound the volume (of OME-Zarr, the chunks of two layers are kept as well). Other formats, and 64-bit integers, whose type depends on all
/// of them, are opened whole, with a note; uneven slices become even then.
///
/// # Errors
/// One line that names the path, what is wrong, the value and the bound.
pub fn open_slices(path: &Path, options: &OpenOptions) -> Result<Box<dyn SliceSource>, OpenError> {
    let format = detect(path)?;
    let unbounded = OpenOptions { limits: Limits::UNBOUNDED, ..options.clone() };
    match in_order(path, format, &unbounded).map_err(|fault| OpenError::new(path, fault))? {
        Some(slices) => Ok(slices),
        None => Ok(Box::new(WholeSlices::new(open(path, options)?, &options.limits))),
    }
}

/// Opens raw voxels of a given shape, of which the slices are read in order.
///
/// # Errors
/// One line that names the path, what is wrong, the value and the bound.
pub fn open_raw_slices(path: &Path, spec: &RawSpec, options: &OpenOptions) -> Result<Box<dyn SliceSource>, OpenError> {
    let unbounded = OpenOptions { limits: Limits::UNBOUNDED, ..options.clone() };
    let opened = || {
        let volume = raw::described(spec, &unbounded)?;
        volume.slices(Box::new(buffered(path)?), parent(path))
    };
    let slices = opened().map_err(|fault| OpenError::new(path, fault))?;
    Ok(Box::new(slices))
}

/// The slices of a file that can be read in order; `None` if it cannot.
fn in_order(path: &Path, format: Format, options: &OpenOptions) -> Result<Option<Box<dyn SliceSource>>, ReadError> {
    let folder = parent(path);
    let described = match format {
        Format::Nrrd => described_by(path, |source| nrrd::described(source, options))?,
        Format::MetaImage => described_by(path, |source| metaimage::described(source, options))?,
        #[cfg(feature = "nifti")]
        Format::Nifti => {
            let (header, stem) = crate::open::nifti_header(path, &folder)?;
            crate::nifti::described_on_disk(header, &stem, &folder, options)?
        }
        #[cfg(feature = "ome-zarr")]
        Format::OmeZarr => return crate::ome_zarr::slices(path, options),
        _ => return Ok(None),
    };
    let (volume, source) = described;
    match volume.can_be_in_order() {
        true => Ok(Some(Box::new(volume.slices(source, folder)?))),
        false => Ok(None),
    }
}

/// A volume by its header, and the file after it.
fn described_by(
    path: &Path,
    describe: impl FnOnce(&mut dyn ByteSource) -> Result<StoredVolume, ReadError>,
) -> Result<(StoredVolume, Box<dyn ByteSource>), ReadError> {
    let mut source = Box::new(buffered(path)?);
    Ok((describe(&mut *source)?, source))
}
