#![doc = include_str!("../README.md")]

mod atlas;
mod backend;
mod error;
mod evaluate;
mod march;
mod options;
mod polygons;
mod probe;
mod scene;
mod staging;
mod variants;
mod vulkan;

pub use backend::AshBackend;
pub use brickfield_frame::AdapterKind;
pub use error::ConnectError;
pub use options::{AdapterChoice, AdapterSummary, Options, Validation, adapters};
pub use vulkan::ValidationLog;
