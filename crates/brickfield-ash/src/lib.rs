#![doc = include_str!("../README.md")]

mod backend;
mod cells;
mod decode;
mod error;
mod evaluate;
mod march;
mod mesh;
mod options;
mod polygons;
mod probe;
mod resources;
mod staging;
mod stored_pipelines;
mod texture;
mod vulkan;

pub use backend::AshBackend;
pub use brickfield_frame::AdapterKind;
pub use error::ConnectError;
pub use options::{AdapterChoice, AdapterSummary, Options, Validation, adapters};
pub use stored_pipelines::{PipelineFile, SaveError};
pub use vulkan::ValidationLog;
