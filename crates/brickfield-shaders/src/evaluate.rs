//! Inputs and outputs of [`ShaderFunction`]s, between data values and the shaders' numbers.

use brickfield_frame::{FramePlan, ShaderFunction};

/// The inputs of a function as shaders take them: data values as numbers of the plan's value scale.
pub fn shader_inputs(plan: &FramePlan, function: ShaderFunction, inputs: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let n_values = match function {
        ShaderFunction::Classify => 1,
        ShaderFunction::Segment => 2,
        _ => 0,
    };
    let values = plan.value_scale();
    let number = |x: f32| values.number(x.into()) as f32;
    inputs.iter().map(|x| std::array::from_fn(|i| if i < n_values { number(x[i]) } else { x[i] })).collect()
}

/// The outputs of a function as callers expect them, from a shader's outputs.
pub fn shader_outputs(plan: &FramePlan, function: ShaderFunction, outputs: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let values = plan.value_scale();
    let absolute = |x: &[f32; 4]| match function {
        ShaderFunction::Sample if x[1] != 0.0 => [values.value(x[0].into()) as f32, x[1], x[2], x[3]],
        _ => *x,
    };
    outputs.iter().map(absolute).collect()
}
