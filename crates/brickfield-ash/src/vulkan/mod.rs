//! Vulkan's objects, each owned by one value, behind functions that cannot be misused from this crate.
//!
//! Three rules make the functions of this module safe. A value keeps its device alive (`Arc<Device>`) and destroys its
//! object when dropped. A [`Recorder`] borrows what it records for as long as [`Queue::run`] lasts. And `run` returns only
//! when the device has finished, so no object is destroyed, rewritten or read while the device works with it.

mod adapter;
mod buffer;
mod canvas;
mod device;
mod image;
mod instance;
mod memory;
mod messages;
mod pipeline;
mod queue;
mod recorder;

pub(crate) use adapter::{PhysicalDevice, physical_devices};
pub(crate) use buffer::{Buffer, HostBuffer};
pub(crate) use canvas::Canvas;
pub(crate) use device::Device;
pub(crate) use image::{Image, Sampler, vulkan_format};
pub(crate) use instance::Instance;
pub(crate) use memory::Residence;
pub use messages::ValidationLog;
pub(crate) use pipeline::{Bindable, BoundPipeline, Pipeline};
pub(crate) use queue::Queue;
pub(crate) use recorder::{ImageBox, Recorder, Triangles, Use};
