@compute @workgroup_size(256)
fn lab_loss(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group);
    let p = block * 256u + local;
    let pixels = view.size.x * view.size.y;
    var own = 0.0;
    if p < pixels {
        var weight = 1.0;
        if parameters.weighted != 0u {
            weight = pixel_weights[p];
        }
        let drawn = lab_of(image[p]);
        let residual = drawn.value - lab_of(wanted_rgb(wanted[p])).value;
        let apart = distance_of(residual, SMOOTHING);
        let squared = parameters.squared != 0u;
        let scales = weight * vec3f(parameters.lightness, vec2f(parameters.chroma));
        let value = vec3f(select(apart.value.x, residual.x * residual.x, squared), apart.value.yz);
        let slope = vec3f(select(apart.slope.x, 2.0 * residual.x, squared), apart.slope.yz);
        var loss = dot(scales, value);
        var by_lab = scales * slope;
        {
            let coarse = upsampled(vec2u(p % view.size.x, p / view.size.x));
            let drift = distance_of(vec3f(0.0, drawn.value.yz - coarse), SMOOTHING);
            loss += parameters.agreement * (drift.value.y + drift.value.z);
            by_lab += parameters.agreement * vec3f(0.0, drift.slope.yz);
        }
        let variation = total_variation(p);
        loss += parameters.variation * dot(variation.value, vec3f(1.0));
        let gradient = rgb_gradient(drawn, by_lab) + parameters.variation * variation.slope;
        own = loss;
        image_gradient[p] = vec4f(gradient, 0.0) / f32(pixels);
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
var<uniform> parameters: LabLossParameters;

@group(0) @binding(4)
var<storage, read_write> block_losses: array<f32>;

@group(0) @binding(5)
var<storage, read_write> image_gradient: array<vec4f>;

@group(0) @binding(6)
var<storage, read> pixel_weights: array<f32>;

@group(0) @binding(7)
var<storage, read> coarser: array<vec3f>;

const CUBE_ROOT_FROM: f32 = 0.008856452;

const LINE_SLOPE: f32 = 7.787037;

const MAX_GROUPS: u32 = 65535u;

const POWER_FROM: f32 = 0.04045;

const SMOOTHING: f32 = 0.5;

const TO_X: vec3f = vec3f(0.4339527553, 0.3762194147, 0.18982783);

const TO_Y: vec3f = vec3f(0.212671, 0.71516, 0.072169);

const TO_Z: vec3f = vec3f(0.01775791409, 0.1094765209, 0.872765565);

const UNITS: f32 = 100.0;

fn coarser_ab(p: u32) -> vec2f {
    return lab_of(coarser[p]).value.yz;
}

fn distance_of(r: vec3f, width: f32) -> Distance {
    let length = sqrt(r * r + width * width);
    return Distance(length - width, r / length);
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

fn lab_of(rgb: vec3f) -> Lab {
    let on_line = rgb <= vec3f(POWER_FROM);
    let base = (max(rgb, vec3f(POWER_FROM)) + 0.055) / 1.055;
    var fifth = pow(base * base, vec3f(0.2));
    let fourth = fifth * fifth * fifth * fifth;
    fifth -= (fourth * fifth - base * base) / (5.0 * fourth);
    let linear = select(base * base * fifth, rgb / 12.92, on_line);
    let by_encoded = select(2.4 / 1.055 * base * fifth, vec3f(1.0 / 12.92), on_line);
    let relative = vec3f(dot(TO_X, linear), dot(TO_Y, linear), dot(TO_Z, linear));
    let is_dark = relative <= vec3f(CUBE_ROOT_FROM);
    let bright = max(relative, vec3f(CUBE_ROOT_FROM));
    var root = pow(bright, vec3f(1.0 / 3.0));
    root -= (root * root * root - bright) / (3.0 * root * root);
    let f = select(root, LINE_SLOPE * relative + 4.0 / 29.0, is_dark);
    let by_relative = select(1.0 / (3.0 * root * root), vec3f(LINE_SLOPE), is_dark);
    let value = vec3f(116.0 * f.y - 16.0, 500.0 * (f.x - f.y), 200.0 * (f.y - f.z));
    return Lab(value, by_encoded, by_relative);
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

fn place_in_coarser(pixel: u32, size: u32, coarser_size: u32) -> Place {
    let at = max((2u * pixel + 1u) * coarser_size, size) - size;
    let low = at / (2u * size);
    return Place(low, min(low + 1u, coarser_size - 1u), f32(at % (2u * size)) / f32(2u * size));
}

fn rgb_gradient(lab: Lab, slope: vec3f) -> vec3f {
    let by_f = vec3f(500.0 * slope.y, 116.0 * slope.x - 500.0 * slope.y + 200.0 * slope.z, -200.0 * slope.z);
    let s = by_f * lab.by_relative;
    return (s.x * TO_X + s.y * TO_Y + s.z * TO_Z) * lab.by_encoded;
}

fn total_variation(p: u32) -> Distance {
    let width = view.size.x;
    let at = vec2u(p % width, p / width);
    let here = image[p];
    let smoothing = SMOOTHING / UNITS;
    var sum = Distance(vec3f(0.0), vec3f(0.0));
    if at.x + 1u < width {
        let right = distance_of(here - image[p + 1u], smoothing);
        sum = Distance(sum.value + right.value, sum.slope + right.slope);
    }
    if at.y + 1u < view.size.y {
        let below = distance_of(here - image[p + width], smoothing);
        sum = Distance(sum.value + below.value, sum.slope + below.slope);
    }
    if at.x > 0u {
        sum.slope += distance_of(here - image[p - 1u], smoothing).slope;
    }
    if at.y > 0u {
        sum.slope += distance_of(here - image[p - width], smoothing).slope;
    }
    return sum;
}

fn upsampled(pixel: vec2u) -> vec2f {
    let x = place_in_coarser(pixel.x, view.size.x, parameters.coarser_size.x);
    let y = place_in_coarser(pixel.y, view.size.y, parameters.coarser_size.y);
    let width = parameters.coarser_size.x;
    let top = mix(coarser_ab(y.low * width + x.low), coarser_ab(y.low * width + x.high), x.share);
    let bottom = mix(coarser_ab(y.high * width + x.low), coarser_ab(y.high * width + x.high), x.share);
    return mix(top, bottom, y.share);
}

fn wanted_rgb(word: u32) -> vec3f {
    return vec3f((vec3u(word) >> vec3u(0u, 10u, 20u)) & vec3u(1023u)) / 1023.0;
}

struct Distance {
    value: vec3f,
    slope: vec3f
}

struct Lab {
    value: vec3f,
    by_encoded: vec3f,
    by_relative: vec3f
}

struct LabLossParameters {
    coarser_size: vec2u,
    lightness: f32,
    squared: u32,
    chroma: f32,
    agreement: f32,
    variation: f32,
    weighted: u32
}

struct Place {
    low: u32,
    high: u32,
    share: f32
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
