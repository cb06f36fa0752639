//! Formats that are known well enough to be named in an error, with what to do about them.

use std::io::SeekFrom;
use std::path::Path;

use crate::ReadError;
use crate::files::ByteSource;

/// A format that is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ForeignFormat {
    pub(crate) name: &'static str,
    /// What is read, or how to bring the file to it.
    pub(crate) hint: &'static str,
}

const READ_FORMATS: &str =
    "NRRD, MetaImage, NIfTI, MGH, VTI, legacy VTK, DICOM, OME-Zarr, VOL, TIFF and folders of TIFF or PNG slices are";
/// A PNG is one slice.
const PNG: ForeignFormat =
    ForeignFormat { name: "a single PNG", hint: "a stack of slices opens as a folder: name the folder instead" };
const MINC_1: ForeignFormat =
    ForeignFormat { name: "MINC 1 (NetCDF)", hint: "convert it to NIfTI (MINC tools: mnc2nii in.mnc out.nii)" };
const MINC_2: ForeignFormat =
    ForeignFormat { name: "MINC 2 (HDF5)", hint: "convert it to NIfTI (MINC tools: mnc2nii in.mnc out.nii)" };
const NETCDF: ForeignFormat =
    ForeignFormat { name: "NetCDF", hint: "save its array as NRRD or Zarr (Python: xarray, then zarr or pynrrd)" };
const HDF5: ForeignFormat =
    ForeignFormat { name: "HDF5", hint: "save its array as NRRD or Zarr (Python: h5py, then zarr or pynrrd)" };

/// The start of every HDF5 file, or of what follows its user block.
const HDF5_MAGIC: &[u8; 8] = b"\x89HDF\r\n\x1a\n";

/// The format of a file that begins like this; the extension tells MINC from what it is made of.
pub(crate) fn foreign(head: &[u8], path: &Path) -> Option<ForeignFormat> {
    const MAGICS: [(&[u8], &str); 4] = [
        (b" BDV", "OpenVDB"),
        (b"\xff\xd8\xff", "JPEG"),
        (b"\0\0\0\x0cjP", "JPEG 2000"),
        (b"PK\x03\x04", "zip archive"),
    ];
    let is_minc = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mnc"));
    match head {
        [b'C', b'D', b'F', 1 | 2 | 5, ..] => return Some(if is_minc { MINC_1 } else { NETCDF }),
        [0x89, b'P', b'N', b'G', ..] => return Some(PNG),
        [0x89, b'H', b'D', b'F', ..] => return Some(hdf5(path)),
        _ => {}
    }
    let (_, name) = MAGICS.into_iter().find(|(magic, _)| head.starts_with(magic))?;
    Some(ForeignFormat { name, hint: READ_FORMATS })
}

fn hdf5(path: &Path) -> ForeignFormat {
    match path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mnc")) {
        true => MINC_2,
        false => HDF5,
    }
}

/// HDF5 after a user block of 512, 1024, 2048, ... bytes. The source's position is lost.
pub(crate) fn after_user_block(source: &mut dyn ByteSource, path: &Path) -> Result<Option<ForeignFormat>, ReadError> {
    let fault = |e| ReadError::io("the file", e);
    let n_bytes = source.seek(SeekFrom::End(0)).map_err(fault)?;
    let starts = std::iter::successors(Some(512u64), |start| start.checked_mul(2));
    for start in starts.take_while(|start| start + 8 <= n_bytes) {
        source.seek(SeekFrom::Start(start)).map_err(fault)?;
        let mut found = [0; 8];
        source.read_exact(&mut found).map_err(fault)?;
        if found == *HDF5_MAGIC {
            return Ok(Some(hdf5(path)));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    #[test]
    fn hdf5_and_netcdf_are_named() {
        let name = |head: &[u8], path: &str| foreign(head, Path::new(path)).map(|f| f.name);
        assert_eq!(name(HDF5_MAGIC, "a.h5"), Some("HDF5"));
        assert_eq!(name(HDF5_MAGIC, "a.MNC"), Some("MINC 2 (HDF5)"));
        assert_eq!(name(b"CDF\x01", "a.mnc"), Some("MINC 1 (NetCDF)"));
        assert_eq!(name(b"CDF\x02", "a.nc"), Some("NetCDF"));
        assert_eq!(name(b"CDF\x07", "a.nc"), None);
        for n_block_bytes in [512, 1024, 8192] {
            let mut file = vec![7; n_block_bytes];
            file.extend(HDF5_MAGIC);
            let found = after_user_block(&mut Cursor::new(&file), Path::new("a.mat")).unwrap();
            assert_eq!(found, Some(HDF5));
            file.pop();
            assert_eq!(after_user_block(&mut Cursor::new(&file), Path::new("a.mat")).unwrap(), None);
        }
    }
}
