@compute @workgroup_size(256)
fn shade_backward(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let i = linear_group(group) * 256u + local;
    let n = view.splat_count;
    if i >= n {
        return;
    }
    let count = arrayLength(&sh_gradient) / (CHANNELS * n);
    if ranks[i] == INVISIBLE {
        return;
    }
    let v_color = color_gradient(colors[i], gradient_of(i));
    let offset = vec3f(geometry[i], geometry[n + i], geometry[2u * n + i]) - view.center_near.xyz;
    let distance = length(offset);
    let direction = offset / distance;
    for (var k = 0u; k < count; k++) {
        let term = sh_term(k, direction);
        store(k, i, term.value * v_color);
    }
    {
        add_curvatures(i);
    }
}

@group(0) @binding(0)
var<uniform> view: View;

@group(0) @binding(1)
var<storage, read> geometry: array<f32>;

@group(0) @binding(2)
var<storage, read> ranks: array<u32>;

@group(0) @binding(3)
var<storage, read> colors: array<Color>;

@group(0) @binding(4)
var<storage, read> gradients: array<f32>;

@group(0) @binding(5)
var<storage, read_write> sh_gradient: array<f32>;

@group(0) @binding(6)
var<storage, read_write> diagonal: array<f32>;

alias Color = vec2f;

const CHANNELS: u32 = 2u;

const INVISIBLE: u32 = 4294967295u;

const MAX_GROUPS: u32 = 65535u;

const PARTIAL_STRIDE: u32 = 4u;

const SH_C0: f32 = 0.28209479177387814;

const SH_C1: f32 = 0.4886025119029199;

const SH_C2: array<f32, 5> = array<f32, 5>(1.0925484305920792, -1.0925484305920792, 0.31539156525252005, -1.0925484305920792, 0.5462742152960396);

const SH_C3: array<f32, 7> = array<f32, 7>(-0.5900435899266435, 2.890611442640554, -0.4570457994644658, 0.3731763325901154, -0.4570457994644658, 1.445305721320277, -0.5900435899266435);

fn add_curvatures(i: u32) {
    for (var figure = CHANNELS; figure < PARTIAL_STRIDE; figure++) {
        diagonal[(figure - CHANNELS) * view.splat_count + i] += SH_C0 * gradients[i * PARTIAL_STRIDE + figure];
    }
}

fn color_gradient(color: Color, gradient: Color) -> Color {
    return gradient;
}

fn gradient_of(i: u32) -> Color {
    let at = i * PARTIAL_STRIDE;
    return vec2f(gradients[at], gradients[at + 1u]);
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

fn plane_index(k: u32, i: u32) -> u32 {
    return k * CHANNELS * view.splat_count + i;
}

fn sh_term(k: u32, d: vec3f) -> ShTerm {
    let x = d.x;
    let y = d.y;
    let z = d.z;
    switch k {
        case 0u {
            return ShTerm(SH_C0, vec3f(0.0));
        }
        case 1u {
            return ShTerm(-SH_C1 * y, vec3f(0.0, -SH_C1, 0.0));
        }
        case 2u {
            return ShTerm(SH_C1 * z, vec3f(0.0, 0.0, SH_C1));
        }
        case 3u {
            return ShTerm(-SH_C1 * x, vec3f(-SH_C1, 0.0, 0.0));
        }
        case 4u {
            return ShTerm(SH_C2[0] * x * y, SH_C2[0] * vec3f(y, x, 0.0));
        }
        case 5u {
            return ShTerm(SH_C2[1] * y * z, SH_C2[1] * vec3f(0.0, z, y));
        }
        case 6u {
            return ShTerm(SH_C2[2] * (2.0 * z * z - x * x - y * y), SH_C2[2] * vec3f(-2.0 * x, -2.0 * y, 4.0 * z));
        }
        case 7u {
            return ShTerm(SH_C2[3] * x * z, SH_C2[3] * vec3f(z, 0.0, x));
        }
        case 8u {
            return ShTerm(SH_C2[4] * (x * x - y * y), SH_C2[4] * vec3f(2.0 * x, -2.0 * y, 0.0));
        }
        case 9u {
            return ShTerm(SH_C3[0] * y * (3.0 * x * x - y * y), SH_C3[0] * vec3f(6.0 * x * y, 3.0 * (x * x - y * y), 0.0));
        }
        case 10u {
            return ShTerm(SH_C3[1] * x * y * z, SH_C3[1] * vec3f(y * z, x * z, x * y));
        }
        case 11u {
            return ShTerm(SH_C3[2] * y * (4.0 * z * z - x * x - y * y), SH_C3[2] * vec3f(-2.0 * x * y, 4.0 * z * z - x * x - 3.0 * y * y, 8.0 * y * z));
        }
        case 12u {
            return ShTerm(SH_C3[3] * z * (2.0 * z * z - 3.0 * x * x - 3.0 * y * y), SH_C3[3] * vec3f(-6.0 * x * z, -6.0 * y * z, 6.0 * z * z - 3.0 * x * x - 3.0 * y * y));
        }
        case 13u {
            return ShTerm(SH_C3[4] * x * (4.0 * z * z - x * x - y * y), SH_C3[4] * vec3f(4.0 * z * z - 3.0 * x * x - y * y, -2.0 * x * y, 8.0 * x * z));
        }
        case 14u {
            return ShTerm(SH_C3[5] * z * (x * x - y * y), SH_C3[5] * vec3f(2.0 * x * z, -2.0 * y * z, x * x - y * y));
        }
        case default {
            return ShTerm(SH_C3[6] * x * (x * x - 3.0 * y * y), SH_C3[6] * vec3f(3.0 * (x * x - y * y), -6.0 * x * y, 0.0));
        }
    }
}

fn store(k: u32, i: u32, value: Color) {
    let at = plane_index(k, i);
    sh_gradient[at] += value.x;
    sh_gradient[at + view.splat_count] += value.y;
}

struct ShTerm {
    value: f32,
    slope: vec3f
}

struct View {
    row0: vec4f,
    row1: vec4f,
    row2: vec4f,
    center_near: vec4f,
    intrinsics: vec4f,
    slope_limits: vec4f,
    size: vec2u,
    tiles: vec2u,
    splat_count: u32,
    sh_degree: u32,
    instance_capacity: u32,
    padding: u32
}
