// Tests on the bits: naga compiles `x != x` to an ordered comparison, which is
// false for NaN, and `clamp`, `min` and `max` turn NaN into a number.

fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7fffffffu) < 0x7f800000u;
}

// Whether x is a number of at most this magnitude; by bits, for NaN passes comparisons.
fn is_within(x: f32, bound: f32) -> bool {
    return (bitcast<u32>(x) & 0x7fffffffu) <= bitcast<u32>(bound);
}

fn all_finite3(v: vec3f) -> bool {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

fn all_finite4(v: vec4f) -> bool {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z) && is_finite(v.w);
}

fn sigmoid(x: f32) -> f32 {
    return 1.0 / (1.0 + exp(-x));
}

// The most workgroups of a dispatch in one dimension (WebGPU's limit).
const MAX_GROUPS: u32 = 65535u;

// The workgroup's number: dispatches of more than a row are folded into rows of MAX_GROUPS.
// `num_workgroups` would not do, which Direct3D 12 does not know of indirect dispatches.
fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}
