//! One function of the shaders on a list of inputs.

use ash::vk;
use brickfield_frame::{FramePlan, RenderError, ShaderFunction};
use brickfield_shaders::{Entry, Variant, shader_inputs, shader_outputs};

use crate::AshBackend;
use crate::scene::Slot;
use crate::vulkan::Resource;

/// Inputs of one dispatch: 16 MiB, and far fewer workgroups than every device allows.
const INPUTS_PER_DISPATCH: usize = 1 << 20;

/// The buffers of an evaluation.
pub(crate) struct Lists {
    inputs: Slot,
    outputs: Slot,
}

impl Lists {
    /// No buffers yet.
    pub(crate) fn new() -> Lists {
        let slot = |what| Slot::new(what, vk::BufferUsageFlags::STORAGE_BUFFER);
        Lists { inputs: slot("the list of inputs"), outputs: slot("the list of outputs") }
    }
}

impl AshBackend {
    pub(crate) fn evaluate_all(
        &mut self,
        plan: &FramePlan,
        function: ShaderFunction,
        inputs: &[[f32; 4]],
    ) -> Result<Vec<[f32; 4]>, RenderError> {
        let variant = Variant::of(plan, Entry::Evaluate(function));
        let pipeline = self.variants.pipeline(&self.device, variant)?;
        self.scene.upload(&mut self.queue, &mut self.staging, plan, pipeline)?;
        let mut outputs = Vec::with_capacity(inputs.len());
        for chunk in shader_inputs(plan, function, inputs).chunks(INPUTS_PER_DISPATCH) {
            self.evaluate_chunk(variant, chunk, &mut outputs)?;
        }
        Ok(shader_outputs(plan, function, &outputs))
    }

    /// Appends what the function makes of `inputs` to `outputs`.
    fn evaluate_chunk(
        &mut self,
        variant: Variant,
        inputs: &[[f32; 4]],
        outputs: &mut Vec<[f32; 4]>,
    ) -> Result<(), RenderError> {
        let (scene, n_bytes) = (&self.scene, size_of_val(inputs));
        let target = self.lists.inputs.reserve(&self.device, n_bytes)?;
        self.staging.fill(&mut self.queue, &[(target, bytemuck::cast_slice(inputs))])?;
        let results = self.lists.outputs.reserve(&self.device, n_bytes)?;
        let whole = |buffer| Resource::Buffer { buffer, n_bytes: n_bytes as u64 };
        let bound = self.variants.pipeline(&self.device, variant)?.bind(|binding| match binding {
            6 => Some(whole(target)),
            7 => Some(whole(results)),
            _ => scene.resource(binding),
        })?;
        let groups = bound.workgroups([inputs.len() as u32, 1, 1]);
        self.queue.run("evaluating a function", |recorder| recorder.dispatch(&bound, groups))?;
        let bytes = self.staging.read(&mut self.queue, results, n_bytes)?;
        let n = outputs.len();
        outputs.resize(n + inputs.len(), [0.0; 4]);
        bytemuck::cast_slice_mut(&mut outputs[n..]).copy_from_slice(bytes);
        Ok(())
    }
}
