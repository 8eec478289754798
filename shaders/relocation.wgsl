// What densification by relocation adds to a step (Kheradmand et al. 2024, "3D
// Gaussian Splatting as Markov Chain Monte Carlo"): noise on the means, shaped like
// each Gaussian and stilled by its opacity.
import package::common::constants::{PLANE_LOG_SCALE, PLANE_MEAN, PLANE_OPACITY, PLANE_QUAT, QUAT_NORM_MIN_SQ, STATUS_OVERFLOW};
import package::common::numeric::{linear_group, sigmoid};
import package::common::rotation::rotation_from_quat;

struct RelocationParameters {
    splat_count: u32,
    // Of the noise; another one each step.
    seed: u32,
    // World units of noise for one world unit of variance.
    noise: f32,
    // Gaussians from this on stay as they are.
    trained: u32,
}

// Above an opacity of 1 - 0.995 the noise falls off, a hundredth at a time.
const STILLED_ABOVE: f32 = 0.005;
const STEEPNESS: f32 = 100.0;
const TAU: f32 = 6.283185307179586;

@group(0) @binding(0) var<uniform> parameters: RelocationParameters;
@group(0) @binding(1) var<storage, read> status: array<u32>;
@group(0) @binding(2) var<storage, read_write> geometry: array<f32>;

// PCG hash (Jarzynski and Olano 2020).
fn pcg(value: u32) -> u32 {
    let state = value * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// A number above 0 and at most 1.
fn uniform_above_zero(bits: u32) -> f32 {
    return (f32(bits >> 8u) + 1.0) / 16777216.0;
}

// Cosine and sine of so many turns. Vulkan allows its own an error of 2⁻¹¹ and promises nothing
// beyond half a turn; these are Taylor's sums over an eighth of a turn on both sides of the
// nearest quarter, within 1e-7 on every device.
fn cos_sin(turns: f32) -> vec2f {
    let quarter = round(4.0 * turns);
    let x = TAU * (turns - 0.25 * quarter);
    let q = x * x;
    let c = 1.0 + q * (-0.5 + q * (1.0 / 24.0 + q * (-1.0 / 720.0 + q * (1.0 / 40320.0))));
    let s = x * (1.0 + q * (-1.0 / 6.0 + q * (1.0 / 120.0 + q * (-1.0 / 5040.0 + q * (1.0 / 362880.0)))));
    switch u32(quarter) % 4u {
        case 0u: { return vec2f(c, s); }
        case 1u: { return vec2f(-s, c); }
        case 2u: { return vec2f(-c, -s); }
        default: { return vec2f(s, -c); }
    }
}

// Three numbers from the normal distribution (Box and Muller 1958).
fn normal3(i: u32) -> vec3f {
    let a = pcg(i ^ pcg(parameters.seed));
    let b = pcg(a);
    let c = pcg(b);
    let d = pcg(c);
    let radius = sqrt(-2.0 * log(vec2f(uniform_above_zero(a), uniform_above_zero(c))));
    return vec3f(radius.x * cos_sin(uniform_above_zero(b)), radius.y * cos_sin(uniform_above_zero(d)).x);
}

fn plane(index: u32, i: u32) -> f32 {
    return geometry[index * parameters.splat_count + i];
}

@compute @workgroup_size(256)
fn relocation_noise(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let i = linear_group(group) * 256u + local;
    if i >= parameters.trained || status[STATUS_OVERFLOW] != 0u {
        return;
    }
    let quat = vec4f(plane(PLANE_QUAT, i), plane(PLANE_QUAT + 1u, i), plane(PLANE_QUAT + 2u, i), plane(PLANE_QUAT + 3u, i));
    let log_scale = vec3f(plane(PLANE_LOG_SCALE, i), plane(PLANE_LOG_SCALE + 1u, i), plane(PLANE_LOG_SCALE + 2u, i));
    let rotation = rotation_from_quat(quat * inverseSqrt(max(dot(quat, quat), QUAT_NORM_MIN_SQ)));
    let stillness = sigmoid(STEEPNESS * (STILLED_ABOVE - sigmoid(plane(PLANE_OPACITY, i))));
    let moved = rotation * (exp(2.0 * log_scale) * (normal3(i) * rotation));
    for (var axis = 0u; axis < 3u; axis++) {
        geometry[(PLANE_MEAN + axis) * parameters.splat_count + i] += parameters.noise * stillness * moved[axis];
    }
}
