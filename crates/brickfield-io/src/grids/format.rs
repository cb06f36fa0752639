//! The formats of structured grids.

use std::fmt;
use std::path::Path;

/// A file format of structured grids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum GridFormat {
    Plot3d,
    Hgt,
    UsgsDem,
    GeoTiff,
    VtkXml,
    VtkLegacy,
}

impl GridFormat {
    /// All formats.
    pub const ALL: [GridFormat; 6] = [
        GridFormat::Plot3d,
        GridFormat::Hgt,
        GridFormat::UsgsDem,
        GridFormat::GeoTiff,
        GridFormat::VtkXml,
        GridFormat::VtkLegacy,
    ];

    /// The format's common name.
    pub const fn name(self) -> &'static str {
        match self {
            GridFormat::Plot3d => "PLOT3D",
            GridFormat::Hgt => "SRTM HGT",
            GridFormat::UsgsDem => "USGS DEM",
            GridFormat::GeoTiff => "GeoTIFF",
            GridFormat::VtkXml => "VTK XML grid",
            GridFormat::VtkLegacy => "legacy VTK grid",
        }
    }

    /// Usual ends of file names, in lower case, without the dot.
    pub const fn extensions(self) -> &'static [&'static str] {
        match self {
            GridFormat::Plot3d => &["xyz", "p3d", "x", "g", "q", "f", "fun", "func"],
            GridFormat::Hgt => &["hgt"],
            GridFormat::UsgsDem => &["dem"],
            GridFormat::GeoTiff => &["tif", "tiff"],
            GridFormat::VtkXml => &["vtr", "vts"],
            GridFormat::VtkLegacy => &["vtk"],
        }
    }

    /// Whether [`open_grid`](crate::open_grid) in this build can read it.
    pub const fn is_readable(self) -> bool {
        let has_tiff = cfg!(feature = "tiff") || !matches!(self, GridFormat::GeoTiff);
        has_tiff && (cfg!(feature = "vti") || !matches!(self, GridFormat::VtkXml))
    }

    /// The format that the end of the file's name suggests.
    pub fn from_extension(path: &Path) -> Option<GridFormat> {
        let extension = path.extension()?.to_string_lossy().to_ascii_lowercase();
        GridFormat::ALL.into_iter().find(|format| format.extensions().contains(&extension.as_str()))
    }
}

impl fmt::Display for GridFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
