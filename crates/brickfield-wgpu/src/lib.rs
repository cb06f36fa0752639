#![doc = include_str!("../README.md")]

mod adapter;
mod backend;
mod buffer;
mod cells;
mod clock;
mod decode;
mod device;
mod mesh;
mod picture;
mod pipeline;
mod polygons;
mod probe;
mod resources;
mod texture;

pub use adapter::{AdapterChoice, AdapterSummary, OpenError, adapters};
pub use backend::WgpuBackend;
pub use brickfield_frame::AdapterKind;
