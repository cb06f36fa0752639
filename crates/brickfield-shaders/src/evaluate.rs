//! Inputs and outputs of [`ShaderFunction`]s, between data values and the shaders' values relative to the first knot.

use brickfield_frame::{FramePlan, ShaderFunction};

/// The inputs of a function as shaders take them: data values relative to the plan's first knot.
pub fn shader_inputs(plan: &FramePlan, function: ShaderFunction, inputs: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let n_values = match function {
        ShaderFunction::Classify => 1,
        ShaderFunction::Segment => 2,
        _ => 0,
    };
    let shift =
        |x: &[f32; 4]| std::array::from_fn(|i| if i < n_values { shifted(x[i], -first_value(plan)) } else { x[i] });
    inputs.iter().map(shift).collect()
}

/// The outputs of a function as callers expect them, from what a shader returned.
pub fn shader_outputs(plan: &FramePlan, function: ShaderFunction, outputs: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let absolute = |x: &[f32; 4]| match function {
        ShaderFunction::Sample if x[1] != 0.0 => [shifted(x[0], first_value(plan)), x[1], x[2], x[3]],
        _ => *x,
    };
    outputs.iter().map(absolute).collect()
}

fn first_value(plan: &FramePlan) -> f64 {
    plan.transfer.knots()[0].value
}

fn shifted(value: f32, by: f64) -> f32 {
    (f64::from(value) + by) as f32
}
