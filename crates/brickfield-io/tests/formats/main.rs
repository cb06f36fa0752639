//! Every format and variant, from fixtures made here.

mod bad_input;
mod common;
mod damaged;
#[cfg(feature = "ome-zarr")]
mod details;
#[cfg(feature = "dicom")]
mod dicom;
#[cfg(feature = "dicom")]
mod dicom_codecs;
#[cfg(feature = "dicom")]
mod dicom_file;
#[cfg(feature = "dicom")]
mod dicom_frames;
#[cfg(feature = "dicom")]
mod dicom_series;
mod grids;
mod metaimage;
#[cfg(feature = "mgh")]
mod mgh;
#[cfg(feature = "nifti")]
mod nifti;
#[cfg(feature = "nifti")]
mod nifti_kinds;
mod nrrd;
mod nrrd_axes;
#[cfg(feature = "ome-zarr")]
mod ome_zarr;
mod pack;
#[cfg(any(feature = "tiff", feature = "png"))]
mod pictures;
mod raw;
mod save;
mod seeds;
mod slices;
mod stored;
#[cfg(feature = "tiff")]
mod tiff;
#[cfg(feature = "tiff")]
mod tiff_bytes;
#[cfg(feature = "tiff")]
mod tiff_colour;
#[cfg(feature = "tiff")]
mod tiff_imagej;
#[cfg(feature = "tiff")]
mod tiff_layout;
#[cfg(feature = "tiff")]
mod tiff_ome;
mod vol;
#[cfg(feature = "vti")]
mod vti;
#[cfg(feature = "vti")]
mod vti_pieces;
mod vtk_legacy;
#[cfg(feature = "ome-zarr")]
mod zarr_arrays;
