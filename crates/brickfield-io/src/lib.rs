#![doc = include_str!("../README.md")]

mod choice;
mod colour;
#[cfg(feature = "gzip")]
mod deflate;
mod detached;
#[cfg(feature = "dicom")]
pub mod dicom;
mod error;
mod even;
mod file_list;
mod files;
mod folder;
mod foreign;
mod format;
pub mod grids;
#[cfg(any(feature = "dicom", feature = "ome-zarr", feature = "tiff", feature = "png", feature = "vti"))]
mod guard;
mod length_unit;
mod limits;
mod lines;
pub mod metaimage;
#[cfg(feature = "mgh")]
pub mod mgh;
#[cfg(feature = "nifti")]
pub mod nifti;
mod note;
pub mod nrrd;
mod numbers;
#[cfg(feature = "ome-zarr")]
pub mod ome_zarr;
mod open;
mod opened;
mod options;
#[cfg(any(feature = "tiff", feature = "png"))]
mod packed_bits;
#[cfg(any(feature = "tiff", feature = "png"))]
pub mod pictures;
#[cfg(any(feature = "tiff", feature = "png"))]
mod pixel;
mod placement;
pub mod raw;
#[cfg(any(feature = "nifti", feature = "dicom"))]
mod rescale;
#[cfg(any(feature = "dicom", feature = "tiff"))]
mod runs;
mod samples;
mod save;
mod save_note;
mod saved;
mod series;
mod slices;
mod stored;
mod stored_type;
mod stored_voxel;
#[cfg(feature = "tiff")]
pub mod tiff;
pub mod vol;
#[cfg(feature = "vti")]
pub mod vti;
mod vtk_arrays;
pub mod vtk_legacy;
#[cfg(any(feature = "nifti", feature = "mgh"))]
mod wrapped;

pub use choice::{Choice, ChoiceKind, WantedEntries};
pub use error::{Damage, OpenError, ReadError, Shown};
pub use files::{ByteSource, DataFiles, Folder, NoFiles};
pub use format::Format;
pub use grids::{GridFormat, GridNote, GridOptions, OpenedGrids, detect_grid, open_grid};
pub use limits::Limits;
pub use note::Note;
pub use numbers::ByteOrder;
pub use open::{detect, open, open_raw};
pub use opened::{Opened, VolumeFacts, WorldFrame};
pub use options::OpenOptions;
pub use raw::RawSpec;
pub use save::{check_save_path, save};
pub use save_note::{SaveNote, Saved};
pub use saved::{Compression, SAVED_EXTENSIONS, SaveError, SaveOptions};
pub use slices::{SliceSource, open_raw_slices, open_slices};

/// The stored types that can be read, for messages.
pub(crate) const STORED_TYPES: &str = "8 to 64 bit integers, 32 and 64 bit floats are";
