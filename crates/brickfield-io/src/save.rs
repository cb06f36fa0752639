//! Saving volumes, in any format: whole or not at all.

use std::path::Path;

use brickfield_core::Volume;

#[cfg(not(all(feature = "nifti", feature = "ome-zarr")))]
use crate::Format;
use crate::{ByteOrder, SaveError, SaveOptions, Saved, metaimage, nrrd, raw};

/// Saves a volume in the format that the end of the name suggests: `.nrrd`, `.mha`, `.nii`, `.nii.gz`, `.zarr` or `.raw`.
///
/// Values, spacing and direction survive: a format that has no rescale gets the values (f32 if it holds all of them exactly,
/// else f64). `.raw` holds the values alone. What the file does not state is noted in [`Saved::notes`].
///
/// # Errors
/// If the format cannot say where the volume lies, or the folder cannot be written to.
pub fn save(path: &Path, volume: &Volume, options: &SaveOptions) -> Result<Saved, SaveError> {
    let name = path.file_name().map(|name| name.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let ends = |end: &str| name.len() > end.len() && name.ends_with(end);
    if ends(".nrrd") {
        nrrd::save(path, volume, options)
    } else if ends(".mha") {
        metaimage::save(path, volume, options)
    } else if ends(".raw") {
        raw::save(path, volume, ByteOrder::Little)
    } else if ends(".nii") || ends(".nii.gz") {
        #[cfg(feature = "nifti")]
        return crate::nifti::save(path, volume, options);
        #[cfg(not(feature = "nifti"))]
        Err(feature_off(path, Format::Nifti, "nifti"))
    } else if ends(".zarr") {
        #[cfg(feature = "ome-zarr")]
        return crate::ome_zarr::save(path, volume, options);
        #[cfg(not(feature = "ome-zarr"))]
        Err(feature_off(path, Format::OmeZarr, "ome-zarr"))
    } else {
        Err(SaveError::UnknownExtension { path: path.to_owned() })
    }
}

#[cfg(not(all(feature = "nifti", feature = "ome-zarr")))]
fn feature_off(path: &Path, format: Format, feature: &str) -> SaveError {
    let fault = format!("is left out of this build (cargo feature `{feature}`)");
    SaveError::Unsupported { path: path.to_owned(), format, fault }
}
