// How wanted colors wait for their view, a word a pixel, and how the loss of a residual
// begins.

// Where |r| turns from a parabola into a line, in CIELAB units: far below a
// visible difference, wide enough that the gradient has no jump at zero.
const SMOOTHING: f32 = 0.5;

// a in the lower half, b in the upper, both in 256ths of a CIELAB unit.
fn wanted_ab(word: u32) -> vec2f {
    let halves = vec2i(bitcast<i32>(word << 16u), bitcast<i32>(word)) >> vec2u(16u);
    return vec2f(halves) / 256.0;
}

// R, G and B of ten bits each, the red lowest; 1 is white.
fn wanted_rgb(word: u32) -> vec3f {
    return vec3f((vec3u(word) >> vec3u(0u, 10u, 20u)) & vec3u(1023u)) / 1023.0;
}
