#![doc = include_str!("../README.md")]

mod block;
mod brick;
mod camera;
mod companion;
mod grid;
mod image;
mod layout;
mod objects;
mod place;
mod ray;
mod rescale;
mod rounding;
mod scalar;
mod space;
mod structured;
mod transfer;
mod volume;

pub use block::{BlockLayout, BlockSide, BlockSideError, BlockSummary, Interblock, N_BLOCK_BINS, N_BLOCK_LEVELS};
pub use brick::{BrickId, Cut, CutError, Level};
pub use camera::{Camera, CameraError, PixelRays, Projection};
pub use companion::{Companion, GRADIENT_ZERO};
pub use glam;
pub use grid::{Grid, GridError};
pub use image::{Image, ImageSizeError};
pub use layout::{BrickLayout, BrickSide, BrickSideError};
pub use objects::Objects;
pub use place::{Axes, Place};
pub use ray::{Aabb, Ray, Span};
pub use rescale::{Rescale, RescaleError};
pub use rounding::rounded_up;
pub use scalar::{Scalar, ScalarType, Voxels};
pub use space::{IndexPos, SamplePos, WorldPos};
pub use structured::{GridPoints, NodeField, StructuredGrid, StructuredGridError};
pub use transfer::{Knot, LinearRgb, Optics, TransferError, TransferFunction};
pub use volume::{NonFinite, ValueRange, Volume, VolumeError};
