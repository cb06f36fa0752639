//! The options of `compare --paper wynn`.

use clap::{Parser, ValueEnum};

use crate::paper::{PaperArgs, asked_parts};

/// Wynn, Barnes, Hamann and Miller 1999 on this project's data
///
/// Files are terrains (HGT, USGS DEM, GeoTIFF). Exit status: 0 done, 1 failed, 2 unusable arguments or no data, 3 a required backend is
/// absent, 4 a claim was missed (--check).
#[derive(Parser, Clone, Debug)]
#[command(name = "compare --paper wynn")]
pub struct WynnArgs {
    /// The options that papers share
    #[command(flatten)]
    pub common: PaperArgs,
    /// Parts to run; all but `large` by default
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_enum)]
    pub part: Vec<Part>,
    /// Frames of the part `flight`
    #[arg(long, default_value_t = 180, value_parser = clap::value_parser!(u32).range(40..=10_000))]
    pub flight_frames: u32,
    /// The frame time that the part `flight` keeps to, in milliseconds
    #[arg(long, default_value_t = 60.0, value_parser = brickfield::options::values::positive)]
    pub flight_ms: f64,
    /// Zones along a side of the generated grids of the part `large`
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1024,4096,16384",
          value_parser = clap::value_parser!(u32).range(16..=32_768))]
    pub large_zones: Vec<u32>,
}

/// The parts of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Table 1: frame rates, polygons and errors
    Table,
    /// Errors by number of triangles, next to a uniform grid and to right-triangulated irregular networks
    Errors,
    /// Figure 15: a part of the terrain, six times as large
    Zoom,
    /// Figure 16: mesh lines over a perturbed Mandelbrot set
    Mandelbrot,
    /// Frame times on a flight, with and without prediction
    Flight,
    /// Three dimensions: cells as a volume, planes as surfaces, and both
    Cells,
    /// Generated grids: time to build, bytes of a zone, time to select, memory
    Large,
}

impl Part {
    /// A heading.
    pub const fn title(self) -> &'static str {
        match self {
            Part::Table => "Table 1: frame rates, polygons, errors",
            Part::Errors => "Errors by number of triangles",
            Part::Zoom => "Figure 15: six times as large",
            Part::Mandelbrot => "Figure 16: mesh lines",
            Part::Flight => "Frame times on a flight",
            Part::Cells => "Three dimensions",
            Part::Large => "Generated grids",
        }
    }

    /// Whether it reads terrains.
    pub(super) const fn needs_data(self) -> bool {
        matches!(self, Part::Table | Part::Errors | Part::Zoom | Part::Flight)
    }
}

impl WynnArgs {
    /// The parts to be run, each once.
    pub fn parts(&self) -> Vec<Part> {
        match self.part.is_empty() {
            true => asked_parts(&[Part::Table, Part::Errors, Part::Zoom, Part::Mandelbrot, Part::Flight, Part::Cells]),
            false => asked_parts(&self.part),
        }
    }
}
