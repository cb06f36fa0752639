//! Saving volumes, in any format: whole or not at all.

use std::path::Path;

use brickfield_core::Volume;

use crate::saved::{check_folder_of, folder_of};
use crate::{ByteOrder, Format, SaveError, SaveOptions, Saved, metaimage, nrrd, raw, vol};

/// Ends of names, and the formats that they stand for.
const SAVED_FORMATS: [(&str, Format); 7] = [
    (".nrrd", Format::Nrrd),
    (".mha", Format::MetaImage),
    (".nii", Format::Nifti),
    (".nii.gz", Format::Nifti),
    (".zarr", Format::OmeZarr),
    (".vol", Format::Vol),
    (".raw", Format::Raw),
];

/// Saves a volume in the format that the end of the name suggests: `.nrrd`, `.mha`, `.nii`, `.nii.gz`, `.zarr`, `.vol` or `.raw`.
///
/// Values, spacing and direction survive: a format that has no rescale gets the values (f32 if it holds all of them exactly,
/// else f64). `.raw` holds the values alone. What the file does not state is noted in [`Saved::notes`].
///
/// # Errors
/// If the format cannot say where the volume lies, or the folder cannot be written to.
pub fn save(path: &Path, volume: &Volume, options: &SaveOptions) -> Result<Saved, SaveError> {
    match checked_format(path)? {
        Format::Nrrd => nrrd::save(path, volume, options),
        Format::MetaImage => metaimage::save(path, volume, options),
        #[cfg(feature = "nifti")]
        Format::Nifti => crate::nifti::save(path, volume, options),
        #[cfg(feature = "ome-zarr")]
        Format::OmeZarr => crate::ome_zarr::save(path, volume, options),
        Format::Vol => vol::save(path, volume, options),
        Format::Raw => raw::save(path, volume, ByteOrder::Little),
        format => Err(feature_off(path, format)),
    }
}

/// Whether a volume could be saved here: before the work of reading it is done.
///
/// # Errors
/// As [`save`], but for those of the volume.
pub fn check_save_path(path: &Path) -> Result<(), SaveError> {
    match checked_format(path)? {
        Format::Nifti if !cfg!(feature = "nifti") => Err(feature_off(path, Format::Nifti)),
        Format::OmeZarr if !cfg!(feature = "ome-zarr") => Err(feature_off(path, Format::OmeZarr)),
        _ => check_folder_of(path),
    }
}

/// The format that the end of the name says, for a path that may be written to.
fn checked_format(path: &Path) -> Result<Format, SaveError> {
    let name = path.file_name().map(|name| name.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let is_of = |(end, _): &(&str, Format)| name.len() > end.len() && name.ends_with(end);
    let found = SAVED_FORMATS.into_iter().find(is_of);
    let (_, format) = found.ok_or_else(|| SaveError::UnknownExtension { path: path.to_owned() })?;
    let folder = folder_of(path);
    match format {
        _ if !folder.is_dir() => Err(SaveError::NoFolder { path: path.to_owned(), folder: folder.to_owned() }),
        Format::OmeZarr if path.exists() => Err(SaveError::IsThere { path: path.to_owned() }),
        _ if path.is_dir() => Err(SaveError::IsFolder { path: path.to_owned() }),
        format => Ok(format),
    }
}

fn feature_off(path: &Path, format: Format) -> SaveError {
    let feature = if format == Format::Nifti { "nifti" } else { "ome-zarr" };
    let fault = format!("is left out of this build (cargo feature `{feature}`)");
    SaveError::Unsupported { path: path.to_owned(), format, fault }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SAVED_EXTENSIONS;

    #[test]
    fn messages_list_the_ends_of_names() {
        let ends = SAVED_FORMATS.map(|(end, _)| end);
        let listed = [&ends[..6].join(", "), ends[6]].join(" and ");
        assert_eq!(listed, SAVED_EXTENSIONS);
    }
}
