//! Every format and variant, from fixtures made here.

mod bad_input;
mod common;
mod damaged;
#[cfg(feature = "dicom")]
mod dicom;
mod metaimage;
#[cfg(feature = "nifti")]
mod nifti;
mod nrrd;
#[cfg(feature = "ome-zarr")]
mod ome_zarr;
mod raw;
mod seeds;
#[cfg(feature = "tiff")]
mod tiff;
#[cfg(feature = "vti")]
mod vti;
