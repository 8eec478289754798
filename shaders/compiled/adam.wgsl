@compute @workgroup_size(256)
fn adam(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group) * 256u + local;
    if k >= parameters.splat_count * parameters.planes || atomicLoad(&status[STATUS_OVERFLOW]) != 0u {
        return;
    }
    let plane = k / parameters.splat_count;
    let g = gradient[k];
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

@group(0) @binding(0)
var<uniform> parameters: AdamParameters;

@group(0) @binding(1)
var<storage, read_write> status: array<atomic<u32>>;

@group(0) @binding(2)
var<storage, read> gradient: array<f32>;

@group(0) @binding(3)
var<storage, read_write> values: array<f32>;

@group(0) @binding(4)
var<storage, read_write> first_moment: array<f32>;

@group(0) @binding(5)
var<storage, read_write> second_moment: array<f32>;

const BETA1: f32 = 0.9;

const BETA2: f32 = 0.999;

const EPSILON: f32 = 1e-15;

const GRADIENT_MAX: f32 = 1e18;

const MAX_GROUPS: u32 = 65535u;

const ONE_LESS_BETA2: f32 = 0.001;

const STATUS_OVERFLOW: u32 = 0u;

const STATUS_REFUSED: u32 = 6u;

fn adam_step(state: vec3f, gradient: f32, rate: f32, correction: vec2f) -> vec3f {
    let m = BETA1 * state.y + (1.0 - BETA1) * gradient;
    let v = BETA2 * state.z + ONE_LESS_BETA2 * gradient * gradient;
    return vec3f(state.x - rate * (m * correction.x) / (sqrt(v * correction.y) + EPSILON), m, v);
}

fn is_within(x: f32, bound: f32) -> bool {
    return (bitcast<u32>(x) & 2147483647u) <= bitcast<u32>(bound);
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

struct AdamParameters {
    splat_count: u32,
    planes: u32,
    correction1: f32,
    correction2: f32,
    trained: u32,
    learning_rates: array<vec4f, 12>
}
