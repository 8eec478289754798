@compute @workgroup_size(256)
fn chroma_loss(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group);
    let p = block * 256u + local;
    let pixels = view.size.x * view.size.y;
    var own = 0.0;
    if p < pixels {
        let scale = 0.5 / f32(pixels);
        var weight = 1.0;
        if weights.weighted != 0u {
            weight = pixel_weights[p];
        }
        let painted = weight > 1.0;
        var target_ab = wanted_ab(wanted[p]);
        if !painted {
            target_ab = corrected(corrections[weights.view_index], target_ab);
        }
        let residual = image[p] - target_ab;
        let taught = penalty(residual, select(weights.decline, 0.0, painted), weights.joint != 0u);
        weight *= weights.teacher;
        var loss = weight * taught.value;
        var curvature = weight * taught.curvature;
        var gradient = curvature * residual;
        own = 0.5 * (loss.x + loss.y);
        image_gradient[p] = scale * vec4f(gradient, curvature);
    }
    let sum = group_sum(local, own);
    if local == 0u && block * 256u < pixels {
        block_losses[block] = sum;
    }
}

@group(0) @binding(0)
var<uniform> view: View;

@group(0) @binding(1)
var<storage, read> image: array<vec2f>;

@group(0) @binding(2)
var<storage, read> wanted: array<u32>;

@group(0) @binding(3)
var<uniform> weights: ChromaLossWeights;

@group(0) @binding(4)
var<storage, read_write> block_losses: array<f32>;

@group(0) @binding(5)
var<storage, read_write> image_gradient: array<vec4f>;

@group(0) @binding(6)
var<storage, read> pixel_weights: array<f32>;

@group(0) @binding(7)
var<storage, read> corrections: array<Correction>;

const MAX_GROUPS: u32 = 65535u;

const SMOOTHING: f32 = 0.5;

fn corrected(correction: Correction, ab: vec2f) -> vec2f {
    return vec2f(dot(correction.gain.xy, ab), dot(correction.gain.zw, ab)) + correction.offset;
}

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

fn penalty(residual: vec2f, decline: f32, joint: bool) -> Penalty {
    let squares = residual * residual;
    let length = sqrt(select(squares, vec2f(squares.x + squares.y), joint) + SMOOTHING * SMOOTHING);
    let share = select(1.0, 0.5, joint);
    if decline > 0.0 {
        let kept = exp(-decline * (length - SMOOTHING));
        return Penalty(share * (1.0 - kept) / decline, kept / length);
    }
    return Penalty(share * (length - SMOOTHING), 1.0 / length);
}

fn wanted_ab(word: u32) -> vec2f {
    let halves = vec2i(bitcast<i32>(word << 16u), bitcast<i32>(word)) >> vec2u(16u);
    return vec2f(halves) / 256.0;
}

struct ChromaLossWeights {
    coarser_size: vec2u,
    teacher: f32,
    agreement: f32,
    decline: f32,
    view_index: u32,
    weighted: u32,
    joint: u32
}

struct Correction {
    gain: vec4f,
    offset: vec2f,
    padding: vec2f
}

struct Penalty {
    value: vec2f,
    curvature: vec2f
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
