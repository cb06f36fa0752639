//! Inputs and outputs of [`ShaderFunction`]s, between data values and the shaders' numbers.

use brickfield_frame::{FramePlan, ShaderFunction};

/// The inputs of a function as shaders take them: data values as numbers of the plan's value scale.
pub fn shader_inputs(plan: &FramePlan, function: ShaderFunction, inputs: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let has_spreads = plan.spreads().is_some();
    let is_value = |i: usize| match function {
        ShaderFunction::Classify => i == 0 || (has_spreads && i > 1),
        ShaderFunction::Segment => i < 2,
        _ => false,
    };
    let is_deviation = |i: usize| function == ShaderFunction::Classify && has_spreads && i == 1;
    let values = plan.value_scale();
    let input = |x: &[f32; 4], i: usize| match i {
        i if is_value(i) => values.number(x[i].into()) as f32,
        i if is_deviation(i) => (f64::from(x[i]) / values.unit()) as f32,
        i => x[i],
    };
    inputs.iter().map(|x| std::array::from_fn(|i| input(x, i))).collect()
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
