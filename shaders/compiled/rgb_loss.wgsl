@compute @workgroup_size(256)
fn rgb_loss(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group);
    let p = block * 256u + local;
    let pixels = view.size.x * view.size.y;
    var own = 0.0;
    if p < pixels {
        let scale = 0.5 / f32(pixels);
        var weight = 1.0;
        if parameters.weighted != 0u {
            weight = pixel_weights[p];
        }
        let target_rgb = wanted_rgb(wanted[p]);
        let difference = image[p] - target_rgb;
        let residual = UNITS * select(difference, min(difference, vec3f(0.0)), target_rgb >= vec3f(1.0));
        let length = sqrt(dot(residual, residual) + SMOOTHING * SMOOTHING);
        let curvature = weight / length;
        own = 0.5 * weight * (length - SMOOTHING);
        image_gradient[p] = scale * UNITS * curvature * vec4f(residual, UNITS);
    }
    let sum = group_sum(local, own);
    if local == 0u && block * 256u < pixels {
        block_losses[block] = sum;
    }
}

@group(0) @binding(0)
var<uniform> view: View;

@group(0) @binding(1)
var<storage, read> image: array<vec3f>;

@group(0) @binding(2)
var<storage, read> wanted: array<u32>;

@group(0) @binding(3)
var<uniform> parameters: RgbLossParameters;

@group(0) @binding(4)
var<storage, read_write> block_losses: array<f32>;

@group(0) @binding(5)
var<storage, read_write> image_gradient: array<vec4f>;

@group(0) @binding(6)
var<storage, read> pixel_weights: array<f32>;

const MAX_GROUPS: u32 = 65535u;

const SMOOTHING: f32 = 0.5;

const UNITS: f32 = 100.0;

fn group_sum(local: u32, own: f32) -> f32 {
    sums[local] = own;
    workgroupBarrier();
    for (var half = 128u; half > 0u; half /= 2u) {
        if local < half {
            sums[local] += sums[local + half];
        }
        workgroupBarrier();
    }
    return sums[0];
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

fn wanted_rgb(word: u32) -> vec3f {
    return vec3f((vec3u(word) >> vec3u(0u, 10u, 20u)) & vec3u(1023u)) / 1023.0;
}

struct RgbLossParameters {
    weighted: u32
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

var<workgroup> sums: array<f32, 256>;
