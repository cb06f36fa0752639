//! The formats, and telling them apart by content first, by extension second.

use std::fmt;
use std::path::Path;

use crate::{metaimage, vol};

/// A volume file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum Format {
    Nrrd,
    MetaImage,
    Nifti,
    Mgh,
    Vti,
    VtkLegacy,
    Dicom,
    OmeZarr,
    Tiff,
    Pictures,
    Vol,
    Raw,
}

impl Format {
    /// All formats.
    pub const ALL: [Format; 12] = [
        Format::Nrrd,
        Format::MetaImage,
        Format::Nifti,
        Format::Mgh,
        Format::Vti,
        Format::VtkLegacy,
        Format::Dicom,
        Format::OmeZarr,
        Format::Tiff,
        Format::Pictures,
        Format::Vol,
        Format::Raw,
    ];

    /// The format's common name.
    pub const fn name(self) -> &'static str {
        match self {
            Format::Nrrd => "NRRD",
            Format::MetaImage => "MetaImage",
            Format::Nifti => "NIfTI",
            Format::Mgh => "MGH",
            Format::Vti => "VTK XML ImageData",
            Format::VtkLegacy => "legacy VTK",
            Format::Dicom => "DICOM",
            Format::OmeZarr => "OME-Zarr",
            Format::Tiff => "TIFF",
            Format::Pictures => "folder of pictures",
            Format::Vol => "VOL",
            Format::Raw => "raw",
        }
    }

    /// Usual ends of file names, in lower case, without the dot.
    pub const fn extensions(self) -> &'static [&'static str] {
        match self {
            Format::Nrrd => &["nrrd", "nhdr"],
            Format::MetaImage => &["mha", "mhd"],
            Format::Nifti => &["nii", "nii.gz", "hdr", "hdr.gz", "img", "img.gz"],
            Format::Mgh => &["mgh", "mgz", "mgh.gz"],
            Format::Vti => &["vti", "pvti"],
            Format::VtkLegacy => &["vtk"],
            Format::Dicom => &["dcm", "dicom", "ima"],
            Format::OmeZarr => &["zarr"],
            Format::Tiff => &["tif", "tiff"],
            Format::Pictures => &[],
            Format::Vol => &["vol"],
            Format::Raw => &["raw", "bin"],
        }
    }

    /// Whether [`open`](crate::open) in this build can read it. Raw files need [`open_raw`](crate::open_raw).
    pub const fn is_readable(self) -> bool {
        match self {
            Format::Nrrd | Format::MetaImage | Format::VtkLegacy | Format::Vol => true,
            Format::Nifti => cfg!(feature = "nifti"),
            Format::Mgh => cfg!(feature = "mgh"),
            Format::Vti => cfg!(feature = "vti"),
            Format::Dicom => cfg!(feature = "dicom"),
            Format::OmeZarr => cfg!(feature = "ome-zarr"),
            Format::Tiff => cfg!(feature = "tiff"),
            Format::Pictures => cfg!(any(feature = "tiff", feature = "png")),
            Format::Raw => false,
        }
    }

    /// Whether files are gzipped as a whole, header and all.
    pub(crate) const fn may_be_gzipped(self) -> bool {
        matches!(self, Format::Nifti | Format::Mgh)
    }

    /// The format that the end of the file's name suggests.
    pub fn from_extension(path: &Path) -> Option<Format> {
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        let ends = |extension: &&str| name.strip_suffix(*extension).is_some_and(|stem| stem.ends_with('.'));
        Format::ALL.into_iter().find(|format| format.extensions().iter().any(ends))
    }

    /// The format whose magic these first bytes of a file have. 352 bytes suffice, 4 KiB are better.
    ///
    /// A gzip wrapper has to be taken off before: of NIfTI and MGH it is usual, of the others it is none.
    pub fn from_magic(head: &[u8]) -> Option<Format> {
        if head.starts_with(b"NRRD00") {
            Some(Format::Nrrd)
        } else if head.starts_with(b"# vtk DataFile") {
            Some(Format::VtkLegacy)
        } else if vol::has_magic(head) {
            Some(Format::Vol)
        } else if head.get(128..132) == Some(b"DICM") {
            Some(Format::Dicom)
        } else if is_nifti(head) {
            Some(Format::Nifti)
        } else if is_tiff(head) {
            Some(Format::Tiff)
        } else if head[..head.len().min(4096)].windows(8).any(|w| w == b"<VTKFile") {
            Some(Format::Vti)
        } else if metaimage::has_magic(head) {
            Some(Format::MetaImage)
        } else if begins_with_dicom_elements(head) {
            Some(Format::Dicom)
        } else if begins_like_mgh(head) {
            Some(Format::Mgh)
        } else {
            None
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// NIfTI-1 by its magic, or by the header size that ANALYZE and NIfTI share; NIfTI-2 by its header size.
fn is_nifti(head: &[u8]) -> bool {
    let magic = head.get(344..348);
    let size = head.first_chunk::<4>().map(|b| (u32::from_le_bytes(*b), u32::from_be_bytes(*b)));
    matches!(magic, Some(b"n+1\0" | b"ni1\0")) || matches!(size, Some((348 | 540, _) | (_, 348 | 540)))
}

/// A DICOM file without preamble has no magic, but its first elements are telling.
fn begins_with_dicom_elements(head: &[u8]) -> bool {
    #[cfg(feature = "dicom")]
    return crate::dicom::begins_with_elements(head);
    #[cfg(not(feature = "dicom"))]
    {
        let _ = head;
        false
    }
}

/// MGH has no magic but its version, and the fields after it.
fn begins_like_mgh(head: &[u8]) -> bool {
    #[cfg(feature = "mgh")]
    return crate::mgh::has_magic(head);
    #[cfg(not(feature = "mgh"))]
    {
        let _ = head;
        false
    }
}

pub(crate) fn is_tiff(head: &[u8]) -> bool {
    let classic_or_big = |a, b| matches!((a, b), (42 | 43, 0));
    match head {
        [b'I', b'I', a, b, ..] => classic_or_big(*a, *b),
        [b'M', b'M', b, a, ..] => classic_or_big(*a, *b),
        _ => false,
    }
}
