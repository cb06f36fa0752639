#![doc = include_str!("../README.md")]

mod backends;
mod batches;
mod block_residency;
mod blocks;
mod course;
mod encode;
#[cfg(feature = "formats")]
mod pack;
mod picture;
mod prepare;
mod residency;
mod scene;
#[cfg(feature = "formats")]
mod store;
mod surface;
mod trimmed;
mod viewpoint;
mod visibility;

#[cfg(feature = "fetch")]
pub mod delivery;
#[cfg(feature = "cli")]
pub mod options;
#[cfg(feature = "overlay")]
pub mod overlay;

pub use backends::{AdapterInfo, BackendError, BackendKind, BackendStatus, Validation, backends, open_backend};
pub use batches::{
    CacheCounts, CacheError, CacheOptions, Eviction, TrimBatches, TrimCache, prepare_trimmed_batches, render_ahead,
};
pub use block_residency::BlockResidency;
pub use blocks::{BlockStyle, Classification, PrepareBlocksError, TransparentBlocks, prepare_blocks, sample_bytes};
pub use brickfield_bricks as bricks;
pub use brickfield_core as core;
pub use brickfield_cpu as cpu;
pub use brickfield_curvilinear as curvilinear;
#[cfg(feature = "fetch")]
pub use brickfield_fetch as fetch;
pub use brickfield_frame as frame;
pub use brickfield_interp as interp;
pub use brickfield_io as io;
pub use brickfield_lod as lod;
pub use brickfield_optics as optics;
#[cfg(feature = "serve")]
pub use brickfield_serve as serve;
pub use brickfield_trim as trim;
#[cfg(feature = "formats")]
pub use pack::{Codec, PackError, PackProgress, Packed, pack};
pub use picture::{PictureError, PictureFormat, check_picture_path, srgb8, write_exr, write_picture, write_png};
pub use prepare::{MAX_FACETS, MAX_IMAGE, MAX_POLYGONS, MAX_SEGMENTS, PrepareError, prepare, prepare_selection};
pub use residency::{Copied, Residency};
pub use scene::{Quality, Scene, Skipping, Technique};
#[cfg(feature = "formats")]
pub use store::{StoreBlocks, StoreLimits, SummaryProgress};
pub use surface::{SurfaceError, SurfaceNormals, joined_mesh, mesh_of, spectrum, surface_mesh};
pub use trimmed::{PrepareTrimmedError, TrimResidency, TrimmedVolume, Trimming, prepare_trimmed};
pub use viewpoint::{Viewpoint, ViewpointError};
