@compute @workgroup_size(256)
fn shade(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let i = linear_group(group) * 256u + local;
    if i >= view.splat_count || ranks[i] == INVISIBLE {
        return;
    }
    let mean = vec3f(geometry[i], geometry[view.splat_count + i], geometry[2u * view.splat_count + i]);
    let direction = normalize(mean - view.center_near.xyz);
    var sum = coefficient(0u, i) * sh_term(0u, direction).value;
    let count = (view.sh_degree + 1u) * (view.sh_degree + 1u);
    for (var k = 1u; k < count; k++) {
        sum += coefficient(k, i) * sh_term(k, direction).value;
    }
    if !drawable(sum) {
        projected[i].conic_opacity.w = 0.0;
        ranks[i] = INVISIBLE;
        colors[i] = Color();
        atomicAdd(&status[STATUS_POISONED], 1u);
        return;
    }
    colors[i] = color_from_sh(sum);
}

@group(0) @binding(0)
var<uniform> view: View;

@group(0) @binding(1)
var<storage, read> geometry: array<f32>;

@group(0) @binding(2)
var<storage, read> sh: array<f32>;

@group(0) @binding(3)
var<storage, read_write> ranks: array<u32>;

@group(0) @binding(4)
var<storage, read_write> projected: array<Projected>;

@group(0) @binding(5)
var<storage, read_write> colors: array<Color>;

@group(0) @binding(6)
var<storage, read_write> status: array<atomic<u32>>;

alias Color = vec3f;

const CHANNELS: u32 = 3u;

const COLOR_MAX: f32 = 10000.0;

const INVISIBLE: u32 = 4294967295u;

const MAX_GROUPS: u32 = 65535u;

const SH_C0: f32 = 0.28209479177387814;

const SH_C1: f32 = 0.4886025119029199;

const SH_C2: array<f32, 5> = array<f32, 5>(1.0925484305920792, -1.0925484305920792, 0.31539156525252005, -1.0925484305920792, 0.5462742152960396);

const SH_C3: array<f32, 7> = array<f32, 7>(-0.5900435899266435, 2.890611442640554, -0.4570457994644658, 0.3731763325901154, -0.4570457994644658, 1.445305721320277, -0.5900435899266435);

const STATUS_POISONED: u32 = 4u;

fn coefficient(k: u32, i: u32) -> Color {
    let first = k * CHANNELS * view.splat_count + i;
    return vec3f(sh[first], sh[first + view.splat_count], sh[first + 2u * view.splat_count]);
}

fn color_from_sh(sum: Color) -> Color {
    return max(sum + 0.5, vec3f(0.0));
}

fn drawable(c: Color) -> bool {
    return is_within(c.x, COLOR_MAX) && is_within(c.y, COLOR_MAX) && is_within(c.z, COLOR_MAX);
}

fn is_within(x: f32, bound: f32) -> bool {
    return (bitcast<u32>(x) & 2147483647u) <= bitcast<u32>(bound);
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
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

struct Projected {
    mean: vec2f,
    extent: vec2f,
    conic_opacity: vec4f
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
