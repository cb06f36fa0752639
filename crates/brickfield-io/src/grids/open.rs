//! Opening a file of structured grids, in any format.

use std::fs::File;
use std::io::{BufReader, Seek};
use std::path::Path;

use super::{hgt, plot3d, usgs_dem, vtk_legacy};
use crate::error::Shown;
use crate::files::{ByteSource, read_head};
use crate::open::buffered;
use crate::{Format, GridFormat, GridNote, GridOptions, OpenError, OpenedGrids, ReadError};

/// Opens the structured grids of a file.
///
/// The format is told by content where it has a magic, else by extension, else PLOT3D's by its length. The solution of a
/// PLOT3D grid is the file that `options` names.
///
/// # Errors
/// One line that names the path, what is wrong, the value and the bound.
pub fn open_grid(path: &Path, options: &GridOptions) -> Result<OpenedGrids, OpenError> {
    let format = match options.format {
        Some(format) => format,
        None => detect_grid(path)?,
    };
    match (&options.solution, format) {
        (Some(solution), GridFormat::Plot3d) => open_with_solution(path, solution, options),
        (Some(_), _) => {
            let supported = "a file of its own belongs to a PLOT3D grid only";
            Err(OpenError::new(path, ReadError::unsupported("solution of format", format, supported)))
        }
        (None, _) => open_one(path, format, options).map_err(|fault| OpenError::new(path, fault)),
    }
}

/// The format of a file of structured grids: by content where it has a magic, else by extension, else PLOT3D if one of its
/// layouts has the file's length.
///
/// # Errors
/// If there is no such file, if it is empty, or if neither content nor extension is known.
pub fn detect_grid(path: &Path) -> Result<GridFormat, OpenError> {
    detect(path).map_err(|fault| OpenError::new(path, fault))
}

fn detect(path: &Path) -> Result<GridFormat, ReadError> {
    let mut file = buffered(path)?;
    let head = read_head(&mut file, 4096)?;
    if head.is_empty() {
        return Err(ReadError::Empty);
    }
    match Format::from_magic(&head) {
        Some(Format::VtkLegacy) => return Ok(GridFormat::VtkLegacy),
        Some(Format::Vti) => return Ok(GridFormat::VtkXml),
        Some(Format::Tiff) => return Ok(GridFormat::GeoTiff),
        _ if usgs_dem::has_record_a(&head) => return Ok(GridFormat::UsgsDem),
        _ => {}
    }
    if let Some(format) = GridFormat::from_extension(path) {
        return Ok(format);
    }
    if plot3d::is_plot3d(&mut file)? {
        return Ok(GridFormat::Plot3d);
    }
    match (Format::from_magic(&head), Format::from_extension(path)) {
        (Some(volume), _) => Err(ReadError::unsupported("format", volume, "it is a volume, and no structured grid")),
        // Zeros may follow a PLOT3D file; its reader says more about one that is wrong.
        (None, Some(Format::Raw)) => Ok(GridFormat::Plot3d),
        (None, _) => Err(ReadError::UnknownGridFormat { found: Shown::of_bytes(&head) }),
    }
}

fn open_one(path: &Path, format: GridFormat, options: &GridOptions) -> Result<OpenedGrids, ReadError> {
    let mut file: BufReader<File> = buffered(path)?;
    if read_head(&mut file, 1)?.is_empty() {
        return Err(ReadError::Empty);
    }
    file.rewind().map_err(|e| ReadError::io("the file", e))?;
    match format {
        GridFormat::Plot3d => {
            let mut opened = plot3d::read(file, None, options)?;
            opened.notes.extend(beside(path).map(|name| GridNote::SolutionBeside { name }));
            Ok(opened)
        }
        GridFormat::Hgt => hgt::read(file, hgt::TileCorner::of_name(path)?, options),
        GridFormat::UsgsDem => usgs_dem::read(file, options),
        #[cfg(feature = "tiff")]
        GridFormat::GeoTiff => super::geotiff::read(file, options),
        #[cfg(not(feature = "tiff"))]
        GridFormat::GeoTiff => Err(ReadError::GridFeatureOff { format, feature: "tiff" }),
        #[cfg(feature = "vti")]
        GridFormat::VtkXml => super::vtk_xml::read(file, options),
        #[cfg(not(feature = "vti"))]
        GridFormat::VtkXml => Err(ReadError::GridFeatureOff { format, feature: "vti" }),
        GridFormat::VtkLegacy => vtk_legacy::read(file, options),
    }
}

fn open_with_solution(path: &Path, solution: &Path, options: &GridOptions) -> Result<OpenedGrids, OpenError> {
    let file = buffered(path).map_err(|fault| OpenError::new(path, fault))?;
    let mut values: Box<dyn ByteSource> =
        Box::new(buffered(solution).map_err(|fault| OpenError::new(solution, fault))?);
    plot3d::read_both(file, &mut *values, options).map_err(|(of, fault)| match of {
        plot3d::FileOf::Grid => OpenError::new(path, fault),
        plot3d::FileOf::Solution => OpenError::new(solution, fault),
    })
}

/// The name of a file beside a PLOT3D grid that is named as its solution would be: "combxyz.bin" and "combq.bin".
fn beside(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    let (stem, extension) = name.rsplit_once('.').unwrap_or((name, ""));
    let renamed = stem.rfind("xyz").map(|at| format!("{}q{}.{extension}", &stem[..at], &stem[at + 3..]));
    let is_there = |other: &String| other != name && path.with_file_name(other).is_file();
    [renamed, Some(format!("{stem}.q"))].into_iter().flatten().find(is_there)
}
