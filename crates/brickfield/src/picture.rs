//! Pictures in files: EXR for measuring, PNG for looking.

use std::ffi::OsStr;
use std::io::{Seek, Write};
use std::path::{Path, PathBuf};

use brickfield_core::{Image, LinearRgb};
use exr::prelude::{self as exr_format, WritableImage};
use palette::{LinSrgb, Srgb};

/// Why a picture could not be written. Nothing is left half-written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum PictureError {
    #[error("{}: pictures are written as .exr or .png", path.display())]
    Format { path: PathBuf },
    #[error("{}: it is a folder", path.display())]
    IsFolder { path: PathBuf },
    #[error("{}: there is no folder {}", path.display(), folder.display())]
    NoFolder { path: PathBuf, folder: PathBuf },
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    #[error("{}: {source}", path.display())]
    Exr { path: PathBuf, source: exr_format::Error },
    #[error("{}: {source}", path.display())]
    Png { path: PathBuf, source: image::ImageError },
}

/// A picture's file format, by its extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// Linear, premultiplied, 32-bit float, with attributes.
    Exr,
    /// Over a background, sRGB, 8 bits: never for measuring.
    Png,
}

impl PictureFormat {
    /// The format of a path.
    ///
    /// # Errors
    /// If the extension is neither .exr nor .png.
    pub fn of(path: &Path) -> Result<PictureFormat, PictureError> {
        match path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase).as_deref() {
            Some("exr") => Ok(PictureFormat::Exr),
            Some("png") => Ok(PictureFormat::Png),
            _ => Err(PictureError::Format { path: path.to_owned() }),
        }
    }
}

/// Whether a picture could be written: before the work of making it is done.
///
/// # Errors
/// An unknown extension, or no folder that could hold it and may be written to.
pub fn check_picture_path(path: &Path) -> Result<(), PictureError> {
    PictureFormat::of(path)?;
    let folder = folder_of(path);
    if !folder.is_dir() {
        return Err(PictureError::NoFolder { path: path.to_owned(), folder: folder.to_owned() });
    }
    if path.is_dir() {
        return Err(PictureError::IsFolder { path: path.to_owned() });
    }
    draft(path).map(drop)
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Writes a picture in the format of the path's extension; EXR files carry `attributes`, PNG shows `background` behind.
///
/// # Errors
/// An unknown extension, or an error of the file system or the encoder.
pub fn write_picture(
    path: &Path,
    image: &Image,
    background: LinearRgb,
    attributes: &[(&str, String)],
) -> Result<(), PictureError> {
    match PictureFormat::of(path)? {
        PictureFormat::Exr => write_exr(path, image, attributes),
        PictureFormat::Png => write_png(path, image, background),
    }
}

/// Writes a linear, premultiplied 32-bit float EXR with text attributes.
///
/// # Errors
/// What the file system or the encoder says.
pub fn write_exr(path: &Path, image: &Image, attributes: &[(&str, String)]) -> Result<(), PictureError> {
    let size = (image.size().x as usize, image.size().y as usize);
    let pixel = |at: exr_format::Vec2<usize>| {
        let [r, g, b, a] = image.pixels()[at.y() * size.0 + at.x()];
        (r, g, b, a)
    };
    let mut layer = exr_format::LayerAttributes::named("rgba");
    for (name, value) in attributes {
        let text = exr_format::Text::new_or_none(value.replace(|c: char| !c.is_ascii(), "?"));
        layer.other.extend(text.map(|t| (exr_format::Text::from(*name), exr_format::AttributeValue::Text(t))));
    }
    let channels = exr_format::SpecificChannels::rgba(pixel);
    let layer = exr_format::Layer::new(size, layer, exr_format::Encoding::FAST_LOSSLESS, channels);
    atomically(path, |file| {
        let image = exr_format::Image::from_layer(layer);
        image.write().to_buffered(file).map_err(|source| PictureError::Exr { path: path.to_owned(), source })
    })
}

/// Writes an 8-bit sRGB PNG of the picture over a linear background colour.
///
/// # Errors
/// What the file system or the encoder says.
pub fn write_png(path: &Path, image: &Image, background: LinearRgb) -> Result<(), PictureError> {
    let bytes: Vec<u8> = image.pixels().iter().flat_map(|p| srgb8(*p, background)).collect();
    let buffer = image::RgbImage::from_raw(image.size().x, image.size().y, bytes).expect("three bytes a pixel");
    atomically(path, |mut file| {
        let written = buffer.write_to(&mut file, image::ImageFormat::Png);
        written.map_err(|source| PictureError::Png { path: path.to_owned(), source })
    })
}

/// A premultiplied linear pixel over a linear background, as 8-bit sRGB.
pub fn srgb8(pixel: [f32; 4], background: LinearRgb) -> [u8; 3] {
    let over = |c: usize| pixel[c] + (1.0 - pixel[3]) * background[c] as f32;
    let srgb: Srgb<f32> = Srgb::from_linear(LinSrgb::new(over(0), over(1), over(2)));
    let bytes: Srgb<u8> = srgb.into_format();
    [bytes.red, bytes.green, bytes.blue]
}

/// A file beside the target.
fn draft(path: &Path) -> Result<tempfile::NamedTempFile, PictureError> {
    let draft = tempfile::Builder::new().prefix(".brickfield").tempfile_in(folder_of(path));
    // By kind only: tempfile's own text names a file that nobody asked for.
    draft.map_err(|source| PictureError::Io { path: path.to_owned(), source: source.kind().into() })
}

/// Writes beside the target and renames: readers see the old file or the whole new one.
fn atomically(
    path: &Path,
    write: impl FnOnce(&mut std::io::BufWriter<&std::fs::File>) -> Result<(), PictureError>,
) -> Result<(), PictureError> {
    let io = |source| PictureError::Io { path: path.to_owned(), source };
    let file = draft(path)?;
    let mut writer = std::io::BufWriter::new(file.as_file());
    write(&mut writer)?;
    writer.flush().and_then(|()| writer.stream_position()).map_err(io)?;
    drop(writer);
    make_readable(file.as_file()).map_err(io)?;
    file.persist(path).map(|_| ()).map_err(|e| io(e.error))
}

/// Temporary files are private; pictures have the usual mode.
#[cfg(unix)]
fn make_readable(file: &std::fs::File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn make_readable(_: &std::fs::File) -> std::io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::UVec2;

    fn image() -> Image {
        Image::new(UVec2::new(2, 1), vec![[0.25, 0.5, 1.0, 1.0], [0.0, 0.0, 0.0, 0.25]]).unwrap()
    }

    #[test]
    fn exr_keeps_every_bit_and_the_attributes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write_exr(&path, &image(), &[("backend", "cpu".to_owned())]).unwrap();
        let set = |pixels: &mut Vec<[f32; 4]>, at: exr_format::Vec2<usize>, (r, g, b, a): (f32, f32, f32, f32)| {
            pixels[at.y() * 2 + at.x()] = [r, g, b, a];
        };
        let read = exr_format::read_first_rgba_layer_from_file(&path, |_, _| vec![[0.0; 4]; 2], set).unwrap();
        assert_eq!(read.layer_data.channel_data.pixels, image().pixels());
        assert!(format!("{:?}", read.layer_data.attributes.other).contains("backend"));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn png_is_srgb_over_the_background() {
        assert_eq!(srgb8([0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.5]), [255, 0, 188]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_png(&path, &image(), [1.0; 3]).unwrap();
        assert_eq!(image::open(&path).unwrap().to_rgb8().into_raw(), [137, 188, 255, 225, 225, 225]);
    }

    #[test]
    fn unknown_extensions_and_missing_folders_are_named() {
        let error = |path: &str| write_picture(Path::new(path), &image(), [0.0; 3], &[]).unwrap_err().to_string();
        assert_eq!(error("a.jpg"), "a.jpg: pictures are written as .exr or .png");
        assert!(error("no/such/folder/a.png").starts_with("no/such/folder/a.png: "));
        let early = check_picture_path(Path::new("no/such/a.png")).unwrap_err().to_string();
        assert_eq!(early, "no/such/a.png: there is no folder no/such");
    }
}
