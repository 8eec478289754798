@compute @workgroup_size(256)
fn lab_loss(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group);
    let p = block * 256u + local;
    let pixels = view.size.x * view.size.y;
    var own = 0.0;
    if p < pixels {
        let at = vec2u(p % view.size.x, p / view.size.x);
        let variation = total_variation(p);
        var loss = parameters.variation * variation.value;
        var gradient = parameters.variation * variation.gradient;
        for (var scale = 0u; scale <= parameters.pooled; scale++) {
            let part = of_scale(at, scale);
            loss += part.value / f32(parameters.pooled + 1u);
            gradient += part.gradient / f32(parameters.pooled + 1u);
        }
        {
            let drawn = lab_of(image[p]);
            let drift = distance_of(vec3f(0.0, drawn.value.yz - upsampled(at)));
            let share = parameters.agreement / f32(pixels);
            loss += share * (drift.value.y + drift.value.z);
            gradient += rgb_gradient(drawn, share * vec3f(0.0, drift.slope.yz));
        }
        own = f32(pixels) * loss;
        image_gradient[p] = vec4f(gradient, 0.0);
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

fn compared(rgb: vec3f) -> Lab {
    if parameters.in_rgb != 0u {
        return Lab(UNITS * rgb, vec3f(UNITS), vec3f(0.0));
    }
    return lab_of(rgb);
}

fn distance_of(r: vec3f) -> Distance {
    let length = sqrt(r * r + SMOOTHING * SMOOTHING);
    return Distance(length - SMOOTHING, r / length);
}

fn gradient_of(color: Lab, slope: vec3f) -> vec3f {
    if parameters.in_rgb != 0u {
        return slope * color.by_encoded;
    }
    return rgb_gradient(color, slope);
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

fn of_scale(at: vec2u, scale: u32) -> Loss {
    let side = select(2u, 1u, scale == 0u);
    let cell = at >> vec2u(scale);
    let first = (cell << vec2u(scale)) + ((1u << scale) - side) / 2u;
    let cells = view.size >> vec2u(scale);
    if any(cell >= cells) || any(at < first) || any(at >= first + side) {
        return Loss(0.0, vec3f(0.0));
    }
    let pixels = side * side;
    var drawn_rgb = vec3f(0.0);
    var aim = vec3f(0.0);
    var weight = weight_of(at.y * view.size.x + at.x);
    for (var k = 0u; k < pixels; k++) {
        let q = (first.y + k / side) * view.size.x + first.x + k % side;
        drawn_rgb += image[q] / f32(pixels);
        aim += wanted_rgb(wanted[q]) / f32(pixels);
        weight = min(weight, weight_of(q));
    }
    let drawn = compared(drawn_rgb);
    let residual = drawn.value - compared(aim).value;
    let apart = distance_of(residual);
    let squared = parameters.squared != 0u;
    let scales = vec3f(parameters.lightness, vec2f(parameters.chroma));
    let value = vec3f(select(apart.value.x, residual.x * residual.x, squared), apart.value.yz);
    let slope = vec3f(select(apart.slope.x, 2.0 * residual.x, squared), apart.slope.yz);
    let share = weight / f32(pixels * cells.x * cells.y);
    return Loss(share * dot(scales, value), share * gradient_of(drawn, scales * slope));
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

fn total_variation(p: u32) -> Loss {
    let width = view.size.x;
    let at = vec2u(p % width, p / width);
    let here = image[p];
    let pairs = 3u * (max(view.size, vec2u(2u)) - 1u) * view.size.yx;
    let across = 1.0 / f32(pairs.x);
    let down = 1.0 / f32(pairs.y);
    var sum = Loss(0.0, vec3f(0.0));
    if at.x + 1u < width {
        let right = here - image[p + 1u];
        sum = Loss(sum.value + 0.5 * across * dot(right, right), sum.gradient + across * right);
    }
    if at.y + 1u < view.size.y {
        let below = here - image[p + width];
        sum = Loss(sum.value + 0.5 * down * dot(below, below), sum.gradient + down * below);
    }
    if at.x > 0u {
        sum.gradient += across * (here - image[p - 1u]);
    }
    if at.y > 0u {
        sum.gradient += down * (here - image[p - width]);
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

fn weight_of(p: u32) -> f32 {
    if parameters.weighted == 0u {
        return 1.0;
    }
    return pixel_weights[p];
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
    weighted: u32,
    pooled: u32,
    in_rgb: u32
}

struct Loss {
    value: f32,
    gradient: vec3f
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
