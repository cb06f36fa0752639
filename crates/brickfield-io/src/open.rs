//! Opening a path, in any format.

use std::fs::File;
use std::io::{BufReader, Seek};
use std::path::Path;

use crate::error::Shown;
#[cfg(feature = "nifti")]
use crate::files::ByteSource;
use crate::files::{open_regular, read_head};
use crate::folder::visit_files;
use crate::foreign::{ForeignFormat, after_user_block, foreign};
use crate::grids::OPENED_BY;
use crate::grids::plot3d::is_plot3d;
use crate::{
    Folder, Format, GridFormat, Note, OpenError, OpenOptions, Opened, RawSpec, ReadError, metaimage, nrrd, raw,
    vtk_legacy,
};

/// Opens a volume: a file, or a folder of DICOM slices, of OME-Zarr, or of pictures.
///
/// The format is told by content where it has a magic, else by extension. A structured grid is refused by name:
/// [`open_grid`](crate::open_grid) opens it.
///
/// # Errors
/// One line that names the path, what is wrong, the value and the bound.
pub fn open(path: &Path, options: &OpenOptions) -> Result<Opened, OpenError> {
    let format = detect(path)?;
    let opened = match path.is_dir() {
        true => open_folder(path, format, options),
        false => open_file(path, format, options),
    };
    opened.map_err(|fault| OpenError::new(path, fault))
}

/// Opens raw voxels of a given shape. A file that begins like a file of a known format gets a note.
///
/// # Errors
/// One line that names the path, what is wrong, the value and the bound.
pub fn open_raw(path: &Path, spec: &RawSpec, options: &OpenOptions) -> Result<Opened, OpenError> {
    read_raw(path, spec, options).map_err(|fault| OpenError::new(path, fault))
}

fn read_raw(path: &Path, spec: &RawSpec, options: &OpenOptions) -> Result<Opened, ReadError> {
    let mut file = buffered(path)?;
    let head = read_head(&mut file, HEAD_BYTES)?;
    file.rewind().map_err(|e| ReadError::io("the file", e))?;
    let mut opened = raw::read(file, spec, options)?;
    if let Some(begins_like) = known_start(&head, path) {
        opened.notes.push(Note::ReadAsRaw { begins_like });
    }
    Ok(opened)
}

/// The name of the format that begins like this.
fn known_start(head: &[u8], path: &Path) -> Option<&'static str> {
    format_within(head).map(Format::name).or_else(|| foreign(head, path).map(|foreign| foreign.name))
}

/// The format that a file begins like, inside a gzip wrapper or not.
fn format_within(head: &[u8]) -> Option<Format> {
    Format::from_magic(ungzipped(head).as_deref().unwrap_or(head))
}

/// The format of a file or folder: by content where it has a magic, else by extension.
///
/// # Errors
/// If there is no such file, if it is empty, or if neither content nor extension is known.
pub fn detect(path: &Path) -> Result<Format, OpenError> {
    let format = match path.is_dir() {
        true => detect_folder(path),
        false => detect_file(path),
    };
    format.map_err(|fault| OpenError::new(path, fault))
}

const HEAD_BYTES: u64 = 4096;

fn detect_file(path: &Path) -> Result<Format, ReadError> {
    let mut file = buffered(path)?;
    let head = read_head(&mut file, HEAD_BYTES)?;
    if head.is_empty() {
        return Err(ReadError::Empty);
    }
    if let Some(ForeignFormat { name, hint }) = foreign(&head, path) {
        return Err(ReadError::unsupported("format", name, hint));
    }
    let inner = ungzipped(&head);
    match Format::from_magic(inner.as_deref().unwrap_or(&head)) {
        Some(format) if inner.is_none() || format.may_be_gzipped() => Ok(format),
        Some(format) => {
            Err(ReadError::unsupported("gzip around", format, "around NIfTI and MGH it is; unpack it first"))
        }
        None => match after_user_block(&mut file, path)? {
            Some(ForeignFormat { name, hint }) => Err(ReadError::unsupported("format", name, hint)),
            None => match Format::from_extension(path) {
                Some(Format::Raw) if is_plot3d(&mut file)? => Err(grid_of(GridFormat::Plot3d)),
                Some(format) => Ok(format),
                None => Err(GridFormat::from_extension(path)
                    .map_or(ReadError::UnknownFormat { found: Shown::of_bytes(&head) }, grid_of)),
            },
        },
    }
}

fn grid_of(format: GridFormat) -> ReadError {
    ReadError::unsupported("format", format, OPENED_BY)
}

/// The first bytes inside a gzip wrapper, if there is one.
fn ungzipped(head: &[u8]) -> Option<Vec<u8>> {
    #[cfg(feature = "gzip")]
    if head.starts_with(&[0x1f, 0x8b]) {
        use std::io::Read;
        let mut inner = vec![0; HEAD_BYTES as usize];
        let mut gz = flate2::read::GzDecoder::new(head);
        let mut n = 0;
        // The head of the wrapper is cut off somewhere, so an error ends it as well.
        while let Ok(m @ 1..) = gz.read(&mut inner[n..]) {
            n += m;
        }
        inner.truncate(n);
        return Some(inner);
    }
    let _ = head;
    None
}

fn detect_folder(path: &Path) -> Result<Format, ReadError> {
    let zarr_marks = ["zarr.json", ".zattrs", ".zgroup", ".zarray"];
    if zarr_marks.iter().any(|mark| path.join(mark).is_file()) {
        return Ok(Format::OmeZarr);
    }
    let n_entries = path.read_dir().map_err(|e| ReadError::io("the folder", e))?.count();
    let mut slice = |name: &str| Ok(detect_file(&path.join(name)).ok().filter(|format| *format == Format::Dicom));
    match visit_files(path, &mut slice)? {
        Some(format) => Ok(format),
        None if has_picture(path) => Ok(Format::Pictures),
        None => Err(ReadError::UnknownFolder { n_entries }),
    }
}

/// Whether a file of the folder is a picture.
fn has_picture(folder: &Path) -> bool {
    #[cfg(any(feature = "tiff", feature = "png"))]
    for entry in folder.read_dir().into_iter().flatten().flatten() {
        let head = buffered(&entry.path()).and_then(|mut file| read_head(&mut file, 8));
        if head.is_ok_and(|head| crate::pictures::PictureKind::of_head(&head).is_some()) {
            return true;
        }
    }
    let _ = folder;
    false
}

/// The folder of a file.
pub(crate) fn parent(path: &Path) -> Folder {
    Folder(path.parent().unwrap_or(Path::new("")).to_owned())
}

pub(crate) fn buffered(path: &Path) -> Result<BufReader<File>, ReadError> {
    let file = open_regular(path).map_err(|e| ReadError::io("the file", e))?;
    Ok(BufReader::with_capacity(1 << 16, file))
}

fn open_file(path: &Path, format: Format, options: &OpenOptions) -> Result<Opened, ReadError> {
    let mut file = buffered(path)?;
    let folder = parent(path);
    match format {
        Format::Nrrd => nrrd::read(file, &folder, options),
        Format::MetaImage => metaimage::read(file, &folder, options),
        #[cfg(feature = "nifti")]
        Format::Nifti if is_image_of_pair(path) => {
            let header = crate::wrapped::open_part(&format!("{}.hdr", stem(path)), &folder)?;
            crate::nifti::read(header, &stem(path), &folder, options)
        }
        #[cfg(feature = "nifti")]
        Format::Nifti => crate::nifti::read(file, &stem(path), &folder, options),
        #[cfg(feature = "mgh")]
        Format::Mgh => crate::mgh::read(file, options),
        #[cfg(feature = "vti")]
        Format::Vti => crate::vti::read(file, &folder, options),
        Format::VtkLegacy => vtk_legacy::read(file, options),
        Format::Vol => crate::vol::read(file, options),
        // DICOMDIR: what it lists lies beside and below it.
        #[cfg(feature = "dicom")]
        Format::Dicom if crate::dicom::is_index(&file_name(path), &folder, &options.limits) => {
            open_folder(&folder.0, format, options)
        }
        #[cfg(feature = "dicom")]
        Format::Dicom => crate::dicom::read(&[file_name(path)], &folder, options),
        #[cfg(feature = "tiff")]
        Format::Tiff => crate::tiff::read(file, &folder, options),
        Format::Raw => {
            Err(ReadError::Missing { field: "the shape of a raw file (--raw NXxNYxNZ,TYPE, or `open_raw`)" })
        }
        Format::OmeZarr => Err(ReadError::UnknownFormat { found: Shown::of_bytes(&read_head(&mut file, 16)?) }),
        #[allow(unreachable_patterns)]
        _ => Err(feature_off(format)),
    }
}

fn open_folder(path: &Path, format: Format, options: &OpenOptions) -> Result<Opened, ReadError> {
    #[cfg(not(any(feature = "dicom", feature = "ome-zarr", feature = "tiff", feature = "png")))]
    let _ = (path, options);
    match format {
        #[cfg(feature = "dicom")]
        Format::Dicom => {
            let mut names = Vec::new();
            visit_files::<()>(path, &mut |name| {
                names.push(name.to_owned());
                Ok(None)
            })?;
            crate::dicom::read(&names, &Folder(path.to_owned()), options)
        }
        #[cfg(feature = "ome-zarr")]
        Format::OmeZarr => crate::ome_zarr::read(path, options),
        #[cfg(any(feature = "tiff", feature = "png"))]
        Format::Pictures => {
            let names = file_names(path).map_err(|e| ReadError::io("the folder", e))?;
            crate::pictures::read(&names, &Folder(path.to_owned()), options)
        }
        _ => Err(feature_off(format)),
    }
}

fn feature_off(format: Format) -> ReadError {
    let feature = match format {
        Format::Nifti => "nifti",
        Format::Mgh => "mgh",
        Format::Vti => "vti",
        Format::Dicom => "dicom",
        Format::OmeZarr => "ome-zarr",
        Format::Tiff => "tiff",
        _ => "default",
    };
    ReadError::FeatureOff { format, feature }
}

#[cfg(any(feature = "dicom", feature = "nifti", feature = "tiff", feature = "png"))]
fn file_name(path: &Path) -> String {
    path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

/// The file with the header of a NIfTI file or pair, and its name without the end.
#[cfg(feature = "nifti")]
pub(crate) fn nifti_header(path: &Path, folder: &Folder) -> Result<(Box<dyn ByteSource>, String), ReadError> {
    let stem = stem(path);
    let header: Box<dyn ByteSource> = match is_image_of_pair(path) {
        true => {
            let name = format!("{stem}.hdr");
            folder.open_owned(&name).or_else(|e| folder.open_owned(&format!("{name}.gz")).map_err(|_| e))?
        }
        false => Box::new(buffered(path)?),
    };
    Ok((header, stem))
}

/// The file's name without `.hdr`, `.img`, `.hdr.gz` or `.img.gz`.
#[cfg(feature = "nifti")]
fn stem(path: &Path) -> String {
    let name = file_name(path);
    let plain = name.strip_suffix(".gz").unwrap_or(&name);
    plain.rsplit_once('.').map_or(plain, |(stem, _)| stem).to_owned()
}

/// Whether the file has the samples of a NIfTI pair, by its name; a header in it is told by its content.
#[cfg(feature = "nifti")]
fn is_image_of_pair(path: &Path) -> bool {
    let is_named = Format::from_extension(path) == Some(Format::Nifti);
    let name = file_name(path).to_ascii_lowercase();
    let head = || buffered(path).and_then(|mut file| read_head(&mut file, HEAD_BYTES)).unwrap_or_default();
    is_named && name.trim_end_matches(".gz").ends_with(".img") && format_within(&head()) != Some(Format::Nifti)
}

/// Names of the regular files in a folder, in order.
#[cfg(any(feature = "tiff", feature = "png"))]
fn file_names(folder: &Path) -> std::io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in folder.read_dir()? {
        let path = entry?.path();
        if path.is_file() {
            names.push(file_name(&path));
        }
    }
    names.sort();
    Ok(names)
}
