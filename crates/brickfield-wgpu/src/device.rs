//! A device whose errors come back as values.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use brickfield_frame::{Capabilities, Description, RenderError};
use wgpu::{ErrorFilter, Features};

use crate::OpenError;

/// wgpu does not tell `subTexelPrecisionBits`. Vulkan promises 4; the desktop drivers we know, lavapipe among them, state
/// 8: it is assumed everywhere.
pub(crate) const SUB_TEXEL_BITS: u32 = 8;

/// The optional features that are used where an adapter has them.
const WANTED: Features = Features::TIMESTAMP_QUERY
    .union(Features::FLOAT32_FILTERABLE)
    .union(Features::FLOAT32_BLENDABLE)
    .union(Features::TEXTURE_FORMAT_16BIT_NORM);

/// A device, its queue, and its faults.
pub(crate) struct Device {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) description: Description,
    faults: Arc<Faults>,
}

/// The faults that were reported outside of any call.
#[derive(Default)]
struct Faults {
    lost: AtomicBool,
    uncaptured: Mutex<Option<String>>,
}

impl Device {
    pub(crate) fn open(
        adapter: wgpu::Adapter,
        driver: impl Fn(&wgpu::AdapterInfo) -> String,
    ) -> Result<Device, OpenError> {
        let info = adapter.get_info();
        let limits = adapter.limits();
        let opened = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("brickfield"),
            required_features: WANTED & adapter.features(),
            required_limits: limits.clone(),
            experimental_features: wgpu::ExperimentalFeatures::disabled(),
            memory_hints: wgpu::MemoryHints::default(),
            trace: wgpu::Trace::Off,
        }));
        let (device, queue) =
            opened.map_err(|e| OpenError::NoDevice { adapter: info.name.clone(), message: e.to_string() })?;
        let driver = driver(&info);
        let description = Description::new("wgpu", info.name, driver, capabilities(&limits));
        let faults = Arc::new(Faults::default());
        watch(&device, &faults);
        Ok(Device { device, queue, description, faults })
    }

    /// Runs `call`, which makes `what` of `n_bytes`, and returns the device's error, if it reports one.
    pub(crate) fn checked<T>(
        &self,
        what: &'static str,
        n_bytes: u64,
        call: impl FnOnce() -> T,
    ) -> Result<T, RenderError> {
        let scopes = [ErrorFilter::Internal, ErrorFilter::Validation, ErrorFilter::OutOfMemory]
            .map(|filter| self.device.push_error_scope(filter));
        let made = call();
        let errors: Vec<_> = scopes.into_iter().rev().filter_map(|scope| pollster::block_on(scope.pop())).collect();
        match errors.into_iter().next() {
            Some(wgpu::Error::OutOfMemory { .. }) => Err(RenderError::OutOfMemory { what, n_bytes, available: None }),
            Some(error) => Err(RenderError::Driver { call: what, code: error.to_string() }),
            None => self.sound(what).map(|()| made),
        }
    }

    /// Waits until the device has nothing left to do.
    pub(crate) fn wait(&self, doing: &'static str) -> Result<(), RenderError> {
        let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.sound(doing)?;
        polled.map(|_| ()).map_err(|e| RenderError::Driver { call: doing, code: e.to_string() })
    }

    /// The bytes of a buffer that the device has written.
    pub(crate) fn read(&self, buffer: &wgpu::Buffer, n_bytes: u64) -> Result<wgpu::BufferView, RenderError> {
        const DOING: &str = "reading back";
        let failed = |code: String| RenderError::Driver { call: DOING, code };
        let mapped = Arc::new(Mutex::new(None));
        let result = Arc::clone(&mapped);
        let slice = buffer.slice(..n_bytes);
        slice.map_async(wgpu::MapMode::Read, move |r| *lock(&result) = Some(r.map_err(|e| e.to_string())));
        self.wait(DOING)?;
        let mapped = lock(&mapped).take();
        mapped.unwrap_or_else(|| Err("no answer".to_owned())).map_err(failed)?;
        slice.get_mapped_range().map_err(|e| failed(e.to_string()))
    }

    /// Whether the device's features hold `feature`.
    pub(crate) fn has(&self, feature: Features) -> bool {
        self.device.features().contains(feature)
    }

    fn sound(&self, doing: &'static str) -> Result<(), RenderError> {
        if self.faults.lost.load(Ordering::Acquire) {
            return Err(RenderError::DeviceLost { doing });
        }
        match lock(&self.faults.uncaptured).take() {
            Some(code) => Err(RenderError::Driver { call: doing, code }),
            None => Ok(()),
        }
    }
}

fn watch(device: &wgpu::Device, faults: &Arc<Faults>) {
    let lost = Arc::clone(faults);
    device.set_device_lost_callback(move |reason, message| {
        log::error!("device lost ({reason:?}): {message}");
        lost.lost.store(true, Ordering::Release);
    });
    let uncaptured = Arc::clone(faults);
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
        log::error!("{error}");
        lock(&uncaptured.uncaptured).get_or_insert(error.to_string());
    }));
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn capabilities(limits: &wgpu::Limits) -> Capabilities {
    let mut capabilities = Capabilities::UNLIMITED;
    capabilities.max_texture_3d = limits.max_texture_dimension_3d;
    capabilities.max_layers = limits.max_texture_array_layers;
    capabilities.max_image = limits.max_texture_dimension_2d;
    capabilities.max_buffer_bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    capabilities.max_storage_buffers = limits.max_storage_buffers_per_shader_stage;
    capabilities.sub_texel_bits = SUB_TEXEL_BITS;
    capabilities
}
