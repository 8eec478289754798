// Adam's step where the gradient is known, instead of leaving the gradient.
import package::common::adam::{AdamParameters, GRADIENT_MAX, adam_step};
import package::common::constants::STATUS_REFUSED;
import package::common::numeric::is_within;

@group(0) @binding(8) var<storage, read_write> status: array<atomic<u32>>;
@group(0) @binding(9) var<uniform> parameters: AdamParameters;
@group(0) @binding(10) var<storage, read_write> first_moment: array<f32>;
@group(0) @binding(11) var<storage, read_write> second_moment: array<f32>;

// What element i of `count` of plane `plane` becomes. Nothing known leads to a gradient that
// is refused; if something does, it is counted, and the parameter stays what it is.
fn descended(plane: u32, i: u32, count: u32, value: f32, gradient: f32) -> f32 {
    if i >= parameters.trained { return value; }
    if !is_within(gradient, GRADIENT_MAX) {
        atomicAdd(&status[STATUS_REFUSED], 1u);
        return value;
    }
    let k = plane * count + i;
    let rate = parameters.learning_rates[plane / 4u][plane % 4u];
    let correction = vec2f(parameters.correction1, parameters.correction2);
    let next = adam_step(vec3f(value, first_moment[k], second_moment[k]), gradient, rate, correction);
    first_moment[k] = next.y;
    second_moment[k] = next.z;
    return next.x;
}
