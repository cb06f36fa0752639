//! The one trait that crosses crates: a backend replays plans.

use brickfield_core::Image;
use brickfield_core::glam::{UVec2, UVec3};

use crate::{CellsBackend, FramePlan, MeshBackend, TextureLayout};

/// Replays frame plans, and draws meshes and curvilinear cells; decides nothing.
///
/// A backend may move to another thread: a viewer renders on a thread of its own. It is not shared between threads.
pub trait Backend: MeshBackend + CellsBackend + Send {
    /// The backend's name, adapter, driver and capabilities.
    fn describe(&self) -> &Description;

    /// The messages of the driver's validation layer so far; empty without a layer, or if it was not asked for.
    fn validation_messages(&self) -> Vec<String> {
        Vec::new()
    }

    /// Renders a frame. Bricks and shader variants that the plan shares with the last one stay on the device.
    ///
    /// # Errors
    /// A request beyond a limit of the device: the amount that was asked for, and the limit.
    fn render(&mut self, plan: &FramePlan) -> Result<Frame, RenderError> {
        self.render_batches(plan.size(), &mut std::iter::once(plan.clone()))
    }

    /// Renders a frame of `size` pixels in batches, so that the device holds the bricks of one batch at a time; a batch is asked for
    /// when the one before it is drawn.
    ///
    /// Several plans are [`Batch`](crate::Sequence)es of one picture: along every ray the bricks of a batch lie behind those of
    /// earlier ones where rays are cast, and before them where polygons are blended. In exact mode the picture is that of one
    /// batch, bit by bit.
    ///
    /// # Errors
    /// As [`render`](Self::render); a plan of another size.
    fn render_batches(
        &mut self,
        size: UVec2,
        batches: &mut dyn Iterator<Item = FramePlan>,
    ) -> Result<Frame, RenderError>;

    /// Which shaders draw the frames from now on. The cpu has none, and does not change.
    fn choose_shaders(&mut self, choice: ShaderChoice) {
        let _ = choice;
    }

    /// The backend as one that evaluates single functions, if it is.
    fn as_evaluate(&mut self) -> Option<&mut dyn Evaluate> {
        None
    }
}

/// Which shader draws a frame. In exact mode the picture is the same, bit by bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ShaderChoice {
    /// The frame's own, with nothing that the frame does not need; a frame waits until it is compiled.
    #[default]
    Own,
    /// The general one, which draws other transfer functions, levels and empty blocks as well.
    General,
    /// The frame's own, compiled on another thread; the general one until then, if that is there. When both are there they take turns
    /// for some frames, and the quicker one stays. For viewers: an edit does not wait for a compiler.
    Quickest,
}

/// Evaluates single functions of a renderer, so that each can be held against its equation.
pub trait Evaluate {
    /// Evaluates one function on a list of inputs, in the context of a plan.
    ///
    /// # Errors
    /// As [`Backend::render`].
    fn evaluate(
        &mut self,
        plan: &FramePlan,
        function: ShaderFunction,
        inputs: &[[f32; 4]],
    ) -> Result<Vec<[f32; 4]>, RenderError>;
}

/// A backend's name, adapter, driver and capabilities.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Description {
    /// `cpu`, `wgpu` or `ash`.
    pub backend: &'static str,
    /// The adapter's name, as its driver states it.
    pub adapter: String,
    /// The driver's name and version.
    pub driver: String,
    /// Its limits.
    pub capabilities: Capabilities,
}

impl Description {
    /// A description.
    pub fn new(backend: &'static str, adapter: String, driver: String, capabilities: Capabilities) -> Description {
        Description { backend, adapter, driver, capabilities }
    }
}

/// The limits of a backend; a plan is prepared for them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Capabilities {
    /// Most texels along a side of a 3-D texture.
    pub max_texture_3d: u32,
    /// Most layers of a 2-D array.
    pub max_layers: u32,
    /// Most pixels along a side of a picture.
    pub max_image: u32,
    /// Most bytes in a buffer that a shader reads.
    pub max_buffer_bytes: u64,
    /// Most storage buffers that one shader stage reads or writes: Vulkan promises 4, WebGPU 8.
    pub max_storage_buffers: u32,
    /// Bits of a filter weight (`subTexelPrecisionBits`); 23 where f32 arithmetic filters.
    pub sub_texel_bits: u32,
}

impl Capabilities {
    /// No limit, and filters in f32 arithmetic: renderers in main memory.
    pub const UNLIMITED: Capabilities = Capabilities {
        max_texture_3d: u32::MAX,
        max_layers: u32::MAX,
        max_image: u32::MAX,
        max_buffer_bytes: isize::MAX as u64,
        max_storage_buffers: u32::MAX,
        sub_texel_bits: 23,
    };

    /// Most texels along a side of a texture of three axes.
    pub fn max_texels(&self, layout: TextureLayout) -> u32 {
        match layout {
            TextureLayout::Volume => self.max_texture_3d,
            TextureLayout::Layers => self.max_layers.min(self.max_image),
        }
    }
}

/// A rendered frame.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Frame {
    /// Linear, premultiplied RGBA.
    pub image: Image<f32>,
    /// How long it took.
    pub timing: Timing,
    /// Bytes that were brought to the device for it: samples, index, numbers.
    pub uploaded_bytes: u64,
    /// Whether a general shader drew it ([`ShaderChoice`]), or a batch of it.
    pub is_general: bool,
}

impl Frame {
    /// A picture, and its cost.
    pub fn new(image: Image<f32>, cost: Cost) -> Frame {
        let Cost { timing, uploaded_bytes, is_general } = cost;
        Frame { image, timing, uploaded_bytes, is_general }
    }
}

/// The cost of a frame, or of a batch of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Cost {
    pub timing: Timing,
    pub uploaded_bytes: u64,
    pub is_general: bool,
}

impl Cost {
    /// Rendering alone: nothing was uploaded.
    pub fn of_rendering(wall_ms: f64) -> Cost {
        Cost { timing: Timing { wall_ms, ..Timing::default() }, ..Cost::default() }
    }

    fn and(self, next: Cost) -> Cost {
        Cost {
            timing: self.timing.and(&next.timing),
            uploaded_bytes: self.uploaded_bytes + next.uploaded_bytes,
            is_general: self.is_general || next.is_general,
        }
    }
}

/// How long a frame took, in milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timing {
    /// Bringing bricks, index and transfer function to the device, and building the shader variant, if new.
    pub upload_ms: f64,
    /// Rendering as the device's timestamps say; `None` where it has none.
    pub device_ms: Option<f64>,
    /// Rendering as the caller waits for it, without upload and read-back.
    pub wall_ms: f64,
    /// Bringing the picture back.
    pub read_back_ms: f64,
}

impl Timing {
    /// One after the other. A device time is known if both are.
    #[must_use]
    pub fn and(&self, next: &Timing) -> Timing {
        Timing {
            upload_ms: self.upload_ms + next.upload_ms,
            device_ms: self.device_ms.zip(next.device_ms).map(|(a, b)| a + b),
            wall_ms: self.wall_ms + next.wall_ms,
            read_back_ms: self.read_back_ms + next.read_back_ms,
        }
    }
}

/// A function of the renderer that can be held against its equation alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ShaderFunction {
    /// x: optical depth. Returns x: opacity.
    Alpha,
    /// x: opacity. Returns x: optical depth (`brickfield_optics::depth`).
    Depth,
    /// x: data value. Returns linear RGB and extinction. Of a plan with spreads: x: mean, y: standard deviation, z, w: range of values.
    Classify,
    /// x, y: data values at the rule's nodes, z: length in world units. Returns emission and depth.
    Segment,
    /// x, y, z: sample position. Returns x: data value, y: 1 if the position's brick is resident, else 0.
    Sample,
    /// x, y: pixel. Returns the anchor relative to the frame's centre, and its parameter.
    RayAnchor,
    /// x, y: pixel. Returns the direction in voxels per world unit, w: 0.
    RayDirection,
    /// x, y, z: sample position. Returns the weights of flat blocks 0 to 3 of the eight around it ([`Join::Blend`](crate::Join));
    /// 0 of other fields.
    WeightsLow,
    /// The same for blocks 4 to 7.
    WeightsHigh,
}

impl ShaderFunction {
    /// All functions.
    pub const ALL: [ShaderFunction; 9] = [
        ShaderFunction::Alpha,
        ShaderFunction::Depth,
        ShaderFunction::Classify,
        ShaderFunction::Segment,
        ShaderFunction::Sample,
        ShaderFunction::RayAnchor,
        ShaderFunction::RayDirection,
        ShaderFunction::WeightsLow,
        ShaderFunction::WeightsHigh,
    ];

    /// The function's name in shaders and reports.
    pub const fn name(self) -> &'static str {
        match self {
            ShaderFunction::Alpha => "alpha",
            ShaderFunction::Depth => "depth",
            ShaderFunction::Classify => "classify",
            ShaderFunction::Segment => "segment",
            ShaderFunction::Sample => "sample",
            ShaderFunction::RayAnchor => "ray_anchor",
            ShaderFunction::RayDirection => "ray_direction",
            ShaderFunction::WeightsLow => "weights_low",
            ShaderFunction::WeightsHigh => "weights_high",
        }
    }
}

/// Why a frame could not be rendered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum RenderError {
    #[error("a batch of {} x {} pixels in a frame of {} x {}", batch.x, batch.y, size.x, size.y)]
    BatchSize { batch: UVec2, size: UVec2 },
    #[error("a picture of {} x {} pixels is beyond the device's limit of {limit} a side", size.x, size.y)]
    ImageTooLarge { size: UVec2, limit: u32 },
    #[error(
        "{n_bricks} bricks of {side}^3 samples do not fit a texture of at most {limit} texels along each of three axes"
    )]
    AtlasTooLarge { n_bricks: u32, side: u32, limit: u32 },
    #[error("a texture of {} x {} x {} texels is beyond the device's limit of {limit} a side", texels.x, texels.y, texels.z)]
    TextureTooLarge { texels: UVec3, limit: u32 },
    #[error("a shader with {n} storage buffers; the device allows {limit}")]
    TooManyStorageBuffers { n: u32, limit: u32 },
    #[error("{what} of {n_bytes} bytes is beyond the device's limit of {limit} bytes")]
    BufferTooLarge { what: &'static str, n_bytes: u64, limit: u64 },
    #[error("out of device memory: {what} needs {n_bytes} bytes{}", available.map(|a| format!(", the device's heap holds {a}")).unwrap_or_default())]
    OutOfMemory { what: &'static str, n_bytes: u64, available: Option<u64> },
    #[error("no memory for a picture of {} x {} pixels, {n_bytes} bytes", size.x, size.y)]
    NoMemory { size: UVec2, n_bytes: u64 },
    #[error("the device was lost while {doing}")]
    DeviceLost { doing: &'static str },
    #[error("this device cannot {what}")]
    Unsupported { what: &'static str },
    #[error("{call} failed: {code}")]
    Driver { call: &'static str, code: String },
    #[error("shader variant: {message}")]
    Shader { message: String },
}

/// Draws those batches of a frame that show anything, one after the other; `draw` is told whether a batch is the first. The cost of all;
/// `None` if no batch shows anything.
///
/// # Errors
/// A batch of another size than the frame's; a batch that is not drawn.
pub fn draw_batches(
    size: UVec2,
    batches: &mut dyn Iterator<Item = FramePlan>,
    mut draw: impl FnMut(&FramePlan, bool) -> Result<Cost, RenderError>,
) -> Result<Option<Cost>, RenderError> {
    let mut sum: Option<Cost> = None;
    for plan in batches {
        if plan.size() != size {
            return Err(RenderError::BatchSize { batch: plan.size(), size });
        }
        if !plan.shows_nothing() {
            let cost = draw(&plan, sum.is_none())?;
            sum = Some(sum.map_or(cost, |sum| sum.and(cost)));
        }
    }
    Ok(sum)
}

/// Whether the host has memory for a picture.
///
/// # Errors
/// If there is none.
pub fn check_memory(size: UVec2) -> Result<(), RenderError> {
    let n_pixels = size.x as usize * size.y as usize;
    let n_bytes = n_pixels as u64 * size_of::<[f32; 4]>() as u64;
    Vec::<[f32; 4]>::new().try_reserve_exact(n_pixels).map_err(|_| RenderError::NoMemory { size, n_bytes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_backend_may_move_to_another_thread() {
        fn check<T: Send + ?Sized>() {}
        check::<dyn Backend>();
    }
}
