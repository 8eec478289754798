@compute @workgroup_size(256)
fn view_correction(@builtin(local_invocation_index) local: u32) {
    for (var v = local; v < parameters.views; v += 256u) {
        corrections[v] = teacher_of(v);
    }
    var center = gathered(local, Correction(), true);
    for (var k = 0u; k < GATHERINGS; k++) {
        center = gathered(local, center, false);
    }
    for (var v = local; v < parameters.views; v += 256u) {
        let gain = corrections[v].gain + vec4f(1.0, 0.0, 0.0, 1.0) - center.gain;
        let offset = corrections[v].offset - center.offset;
        let determinant = gain.x * gain.w - gain.y * gain.z;
        if determinant > DETERMINANT_MIN {
            let inverse = vec4f(gain.w, -gain.y, -gain.z, gain.x) / determinant;
            corrections[v] = Correction(inverse, -vec2f(dot(inverse.xy, offset), dot(inverse.zw, offset)), vec2f());
        }
        else {
            corrections[v] = Correction(vec4f(1.0, 0.0, 0.0, 1.0), vec2f(), vec2f());
        }
    }
}

@compute @workgroup_size(256)
fn view_correction_sums(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let pixels = view.size.x * view.size.y;
    if group.x * 256u >= pixels {
        if local < SUMS {
            view_sums[(parameters.view_index * SUM_GROUPS + group.x) * SUMS + local] = 0.0;
        }
        return;
    }
    var own: array<f32, SUMS>;
    for (var p = group.x * 256u + local; p < pixels; p += 256u * SUM_GROUPS) {
        var weight = 0.5 * (image_gradient[p].z + image_gradient[p].w);
        if parameters.weighted != 0u && (pixel_weights[p] > 1.0 || pixel_weights[p] <= 0.0) {
            weight = 0.0;
        }
        let x = image[p];
        if all(x == vec2f()) {
            weight = 0.0;
        }
        let t = wanted_ab(wanted[p]);
        own[0] += weight;
        own[1] += weight * x.x;
        own[2] += weight * x.y;
        own[3] += weight * t.x;
        own[4] += weight * t.y;
        own[5] += weight * x.x * x.x;
        own[6] += weight * x.x * x.y;
        own[7] += weight * x.y * x.y;
        own[8] += weight * t.x * x.x;
        own[9] += weight * t.x * x.y;
        own[10] += weight * t.y * x.x;
        own[11] += weight * t.y * x.y;
    }
    for (var s = 0u; s < SUMS; s++) {
        sums[s * 256u + local] = own[s];
    }
    workgroupBarrier();
    for (var half = 128u; half > 0u; half /= 2u) {
        if local < half {
            for (var s = 0u; s < SUMS; s++) {
                sums[s * 256u + local] += sums[s * 256u + local + half];
            }
        }
        workgroupBarrier();
    }
    if local < SUMS {
        view_sums[(parameters.view_index * SUM_GROUPS + group.x) * SUMS + local] = sums[local * 256u];
    }
}

@group(0) @binding(0)
var<uniform> view: View;

@group(0) @binding(1)
var<storage, read> image: array<vec2f>;

@group(0) @binding(2)
var<storage, read> wanted: array<u32>;

@group(0) @binding(3)
var<storage, read> image_gradient: array<vec4f>;

@group(0) @binding(4)
var<uniform> parameters: CorrectionParameters;

@group(0) @binding(5)
var<storage, read_write> view_sums: array<f32>;

@group(0) @binding(6)
var<storage, read_write> corrections: array<Correction>;

@group(0) @binding(7)
var<storage, read> pixel_weights: array<f32>;

const DETERMINANT_MIN: f32 = 0.1;

const GAIN_UNITS: f32 = 10.0;

const GATHERINGS: u32 = 16u;

const NEAR: f32 = 10.0;

const PRIOR_VARIANCE: f32 = 4.0;

const SUMS: u32 = 12u;

const SUM_GROUPS: u32 = 64u;

fn distance_of(a: Correction, b: Correction) -> f32 {
    return length(a.offset - b.offset) + GAIN_UNITS * length(a.gain - b.gain);
}

fn gathered(local: u32, center: Correction, alike: bool) -> Correction {
    var gain = vec4f();
    var offset = vec2f();
    var weights = 0.0;
    for (var v = local; v < parameters.views; v += 256u) {
        let own = corrections[v];
        let weight = select(1.0 / max(distance_of(own, center), NEAR), 1.0, alike);
        gain += weight * own.gain;
        offset += weight * own.offset;
        weights += weight;
    }
    sums[local] = gain.x;
    sums[256u + local] = gain.y;
    sums[512u + local] = gain.z;
    sums[768u + local] = gain.w;
    sums[1024u + local] = offset.x;
    sums[1280u + local] = offset.y;
    sums[1536u + local] = weights;
    workgroupBarrier();
    for (var half = 128u; half > 0u; half /= 2u) {
        if local < half {
            for (var s = 0u; s < 7u; s++) {
                sums[s * 256u + local] += sums[s * 256u + local + half];
            }
        }
        workgroupBarrier();
    }
    let sum = sums[1536];
    let found = Correction(vec4f(sums[0], sums[256], sums[512], sums[768]) / sum, vec2f(sums[1024], sums[1280]) / sum, vec2f());
    workgroupBarrier();
    return found;
}

fn teacher_of(index: u32) -> Correction {
    var s: array<f32, SUMS>;
    for (var g = 0u; g < SUM_GROUPS; g++) {
        for (var k = 0u; k < SUMS; k++) {
            s[k] += view_sums[(index * SUM_GROUPS + g) * SUMS + k];
        }
    }
    if !(s[0] > 0.0) {
        return Correction(vec4f(1.0, 0.0, 0.0, 1.0), vec2f(), vec2f());
    }
    for (var k = 1u; k < SUMS; k++) {
        s[k] /= s[0];
    }
    let x = vec2f(s[1], s[2]);
    let t = vec2f(s[3], s[4]);
    let xx = max(s[5] - x.x * x.x, 0.0) + PRIOR_VARIANCE;
    let yy = max(s[7] - x.y * x.y, 0.0) + PRIOR_VARIANCE;
    let bound = 0.999 * sqrt(xx * yy);
    let xy = clamp(s[6] - x.x * x.y, -bound, bound);
    let across = vec4f(s[8] - t.x * x.x, s[9] - t.x * x.y, s[10] - t.y * x.x, s[11] - t.y * x.y) + vec4f(PRIOR_VARIANCE, 0.0, 0.0, PRIOR_VARIANCE);
    let inverse = vec3f(yy, -xy, xx) / (xx * yy - xy * xy);
    let gain = vec4f(across.x * inverse.x + across.y * inverse.y, across.x * inverse.y + across.y * inverse.z, across.z * inverse.x + across.w * inverse.y, across.z * inverse.y + across.w * inverse.z);
    return Correction(gain, t - vec2f(dot(gain.xy, x), dot(gain.zw, x)), vec2f());
}

fn wanted_ab(word: u32) -> vec2f {
    let halves = vec2i(bitcast<i32>(word << 16u), bitcast<i32>(word)) >> vec2u(16u);
    return vec2f(halves) / 256.0;
}

struct Correction {
    gain: vec4f,
    offset: vec2f,
    padding: vec2f
}

struct CorrectionParameters {
    views: u32,
    view_index: u32,
    weighted: u32,
    padding: u32
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

var<workgroup> sums: array<f32, 256 * SUMS>;
