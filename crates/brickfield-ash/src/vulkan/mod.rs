//! Vulkan's objects, each owned by one value, behind functions that cannot be misused from this crate.
//!
//! Three rules make the functions of this module safe. A value keeps its device alive (`Arc<Device>`) and destroys its
//! object when dropped. A [`Recorder`] borrows the objects that it records for as long as [`Queue::run`] lasts. And `run` returns only
//! when the device has finished, so no object is destroyed, rewritten or read while the device works with it.
//!
//! Vulkan binds no object to a thread, so all of them are `Send`. It demands that no two threads use certain objects at
//! once ("externally synchronized"): the queue, the command pool and its buffer, the fence, a descriptor set and its pool. Each
//! of these is reached only through a mutable borrow of the [`Queue`] or [`Pipeline`] that owns it, so that a backend may move
//! between threads and is used by one at a time. Memory is mapped once, when it is made; the pointer belongs to its
//! [`HostBuffer`]. Instance and device are shared (`Arc<Device>`, therefore `Sync`): only calls that ask for no
//! synchronisation take them by a shared borrow, and the one that destroys each has the last handle. Pipelines are compiled on any
//! thread: the device's cache of them is locked by the driver. The validation layer calls
//! back on the thread that called it; its log is behind a mutex.

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
pub(crate) use canvas::{Canvas, CanvasKind};
pub(crate) use device::{Device, PipelineIdentity};
pub(crate) use image::{Sampler, VulkanImage, vulkan_format};
pub(crate) use instance::Instance;
pub(crate) use memory::Residence;
pub use messages::ValidationLog;
pub(crate) use pipeline::{Bindable, BoundPipeline, Pipeline};
pub(crate) use queue::Queue;
pub(crate) use recorder::{ImageBox, Recorder, Triangles, Use};
