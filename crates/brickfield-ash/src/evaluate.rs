//! One function of the shaders on a list of inputs.

use brickfield_frame::{FramePlan, RenderError, Resource, ShaderFunction};
use brickfield_shaders::{Entry, PipelineKey, Variant, shader_inputs, shader_outputs};

use crate::AshBackend;
use crate::resources::missing;
use crate::staging::Write;

/// Inputs of one dispatch: 16 MiB, and far fewer workgroups than every device allows.
const INPUTS_PER_DISPATCH: usize = 1 << 20;

impl AshBackend {
    pub(crate) fn evaluate_all(
        &mut self,
        plan: &FramePlan,
        function: ShaderFunction,
        inputs: &[[f32; 4]],
    ) -> Result<Vec<[f32; 4]>, RenderError> {
        let variant = Variant::of(plan, Entry::Evaluate(function));
        let pipeline = (&mut self.pipelines, PipelineKey::computing(variant));
        self.resources.bring(&mut self.queue, &mut self.staging, plan, pipeline)?;
        let mut outputs = Vec::with_capacity(inputs.len());
        for chunk in shader_inputs(plan, function, inputs).chunks(INPUTS_PER_DISPATCH) {
            self.evaluate_chunk(variant, chunk, &mut outputs)?;
        }
        Ok(shader_outputs(plan, function, &outputs))
    }

    /// Appends the function's values at `inputs` to `outputs`.
    fn evaluate_chunk(
        &mut self,
        variant: Variant,
        inputs: &[[f32; 4]],
        outputs: &mut Vec<[f32; 4]>,
    ) -> Result<(), RenderError> {
        let n_bytes = size_of_val(inputs);
        self.resources.reserve(Resource::Outputs, n_bytes)?;
        let target = self.resources.reserve(Resource::Inputs, n_bytes)?;
        self.staging.fill(&mut self.queue, &[Write { target, offset: 0, bytes: bytemuck::cast_slice(inputs) }])?;
        let resources = &self.resources;
        let bound = self.pipelines.of(PipelineKey::computing(variant))?.bind(|binding| resources.bindable(binding))?;
        let groups = bound.workgroups([inputs.len() as u32, 1, 1]);
        self.queue.run("evaluating a function", |recorder| recorder.dispatch(&bound, groups))?;
        let results = resources.buffer(Resource::Outputs).ok_or_else(|| missing(Resource::Outputs))?;
        let bytes = self.staging.read(&mut self.queue, results, n_bytes)?;
        let n = outputs.len();
        outputs.resize(n + inputs.len(), [0.0; 4]);
        bytemuck::cast_slice_mut(&mut outputs[n..]).copy_from_slice(bytes);
        Ok(())
    }
}
