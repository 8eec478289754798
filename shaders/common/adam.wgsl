// A step of Adam (Kingma, Ba 2015, algorithm 1), for `adam` and for the adjoints
// that step at once.

struct AdamParameters {
    splat_count: u32,
    planes: u32,
    // 1/(1 - β₁ᵗ) and 1/(1 - β₂ᵗ).
    correction1: f32,
    correction2: f32,
    // Gaussians from this on stay as they are.
    trained: u32,
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

// Value, first and second moment after a step.
fn adam_step(state: vec3f, gradient: f32, rate: f32, correction: vec2f) -> vec3f {
    let m = BETA1 * state.y + (1.0 - BETA1) * gradient;
    let v = BETA2 * state.z + ONE_LESS_BETA2 * gradient * gradient;
    return vec3f(state.x - rate * (m * correction.x) / (sqrt(v * correction.y) + EPSILON), m, v);
}
