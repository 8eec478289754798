// Adam (Kingma & Ba 2015) over planes `[planes, N]` with one learning rate a plane.
import package::common::constants::{STATUS_OVERFLOW, STATUS_REFUSED};
import package::common::numeric::{is_within, linear_group};

struct AdamParameters {
    splat_count: u32,
    planes: u32,
    // 1/(1 - β₁ᵗ) and 1/(1 - β₂ᵗ).
    correction1: f32,
    correction2: f32,
    // By plane, four to a vector.
    learning_rates: array<vec4f, 12>,
}

const BETA1: f32 = 0.9;
const BETA2: f32 = 0.999;
// Written out: 1 - 0.999 in f32 is off by 1e-5.
const ONE_LESS_BETA2: f32 = 0.001;
// Small enough never to matter beside a gradient that a pixel could notice (3DGS).
const EPSILON: f32 = 1e-15;
// The second moment holds squares: a larger gradient would make it infinite, and
// an infinite moment stops its parameter for ever.
const GRADIENT_MAX: f32 = 1e18;

@group(0) @binding(0) var<uniform> parameters: AdamParameters;
@group(0) @binding(1) var<storage, read_write> status: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read> gradient: array<f32>;
@group(0) @binding(3) var<storage, read_write> values: array<f32>;
@group(0) @binding(4) var<storage, read_write> first_moment: array<f32>;
@group(0) @binding(5) var<storage, read_write> second_moment: array<f32>;

@compute @workgroup_size(256)
fn adam(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group, groups) * 256u + local;
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
    let m = BETA1 * first_moment[k] + (1.0 - BETA1) * g;
    let v = BETA2 * second_moment[k] + ONE_LESS_BETA2 * g * g;
    first_moment[k] = m;
    second_moment[k] = v;
    let rate = parameters.learning_rates[plane / 4u][plane % 4u];
    values[k] -= rate * (m * parameters.correction1) / (sqrt(v * parameters.correction2) + EPSILON);
}
