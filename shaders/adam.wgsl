// Adam over planes `[planes, N]` with one learning rate a plane.
import package::common::adam::{AdamParameters, GRADIENT_MAX, adam_step};
import package::common::constants::{STATUS_OVERFLOW, STATUS_REFUSED};
import package::common::numeric::{is_within, linear_group};

@group(0) @binding(0) var<uniform> parameters: AdamParameters;
@group(0) @binding(1) var<storage, read_write> status: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read> gradient: array<f32>;
@group(0) @binding(3) var<storage, read_write> values: array<f32>;
@group(0) @binding(4) var<storage, read_write> first_moment: array<f32>;
@group(0) @binding(5) var<storage, read_write> second_moment: array<f32>;

@compute @workgroup_size(256)
fn adam(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group) * 256u + local;
    // After an overflow nothing moves until the host has grown the buffers and
    // repeats the iteration.
    if k >= parameters.splat_count * parameters.planes || atomicLoad(&status[STATUS_OVERFLOW]) != 0u {
        return;
    }
    let plane = k / parameters.splat_count;
    let g = gradient[k];
    // Nothing known leads here; if something does, it is counted, and a parameter
    // that has no gradient stays what it is.
    if !is_within(g, GRADIENT_MAX) {
        atomicAdd(&status[STATUS_REFUSED], 1u);
        return;
    }
    let rate = parameters.learning_rates[plane / 4u][plane % 4u];
    let correction = vec2f(parameters.correction1, parameters.correction2);
    let next = adam_step(vec3f(values[k], first_moment[k], second_moment[k]), g, rate, correction);
    values[k] = next.x;
    first_moment[k] = next.y;
    second_moment[k] = next.z;
}
