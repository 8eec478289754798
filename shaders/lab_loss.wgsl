// The loss of the recipes that RGB splats are colored by elsewhere: differences of L, a and b
// between RGB pictures as drawn and as wanted, at full size and pooled, and how much neighboring
// pixels differ; value and gradient. `agreeing`: a and b shall agree with those of the next
// coarser scale as well.
import package::common::lab::{Lab, lab_of, rgb_gradient};
import package::common::group_sum::group_sum;
import package::common::numeric::linear_group;
import package::common::pyramid::place_in_coarser;
import package::common::view::View;
import package::common::wanted::{SMOOTHING, wanted_rgb};

// Black to white, in CIELAB's lightness, and in R, G and B where these are compared.
const UNITS: f32 = 100.0;

struct LabLossParameters {
    coarser_size: vec2u,
    // Weight of the lightness, and whether its difference is squared.
    lightness: f32,
    squared: u32,
    // Weight of a and of b.
    chroma: f32,
    // Weight of the agreement of a and of b with the coarser scale.
    agreement: f32,
    // Weight of the total variation of R, G and B: half the sum of the mean squared differences
    // across and down.
    variation: f32,
    // 1 where pixel_weights has a weight for each pixel.
    weighted: u32,
    // Coarser scales, each half as large as the last, at which both pictures are pooled and
    // compared; all scales count alike.
    pooled: u32,
    // 1 where R, G and B are compared in place of L, a and b.
    in_rgb: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> image: array<vec3f>;
@group(0) @binding(2) var<storage, read> wanted: array<u32>;
@group(0) @binding(3) var<uniform> parameters: LabLossParameters;
@group(0) @binding(4) var<storage, read_write> block_losses: array<f32>;
// Gradient; the curvature is not told.
@group(0) @binding(5) var<storage, read_write> image_gradient: array<vec4f>;
// How much each wanted pixel counts.
@group(0) @binding(6) var<storage, read> pixel_weights: array<f32>;
// RGB rendered at the next coarser scale.
@if(agreeing) @group(0) @binding(7) var<storage, read> coarser: array<vec3f>;

// |r|, smoothed, and its slope.
struct Distance {
    value: vec3f,
    slope: vec3f,
}

fn distance_of(r: vec3f) -> Distance {
    let length = sqrt(r * r + SMOOTHING * SMOOTHING);
    return Distance(length - SMOOTHING, r / length);
}

// A loss, and its gradient by the drawn R, G and B.
struct Loss {
    value: f32,
    gradient: vec3f,
}

// Share of the total variation that a pixel answers for.
fn total_variation(p: u32) -> Loss {
    let width = view.size.x;
    let at = vec2u(p % width, p / width);
    let here = image[p];
    // One over the values that each mean is over.
    let pairs = 3u * (max(view.size, vec2u(2u)) - 1u) * view.size.yx;
    let across = 1.0 / f32(pairs.x);
    let down = 1.0 / f32(pairs.y);
    var sum = Loss(0.0, vec3f(0.0));
    // What lies right and below is counted here; what lies left and above, there.
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

fn weight_of(p: u32) -> f32 {
    if parameters.weighted == 0u {
        return 1.0;
    }
    return pixel_weights[p];
}

// A color as it is compared.
fn compared(rgb: vec3f) -> Lab {
    if parameters.in_rgb != 0u {
        return Lab(UNITS * rgb, vec3f(UNITS), vec3f(0.0));
    }
    return lab_of(rgb);
}

fn gradient_of(color: Lab, slope: vec3f) -> vec3f {
    if parameters.in_rgb != 0u {
        return slope * color.by_encoded;
    }
    return rgb_gradient(color, slope);
}

// Share of a scale's mean loss that a pixel answers for. A coarser pixel is the mean of the 2×2
// pixels around its center (bilinear, half-pixel centers); what is beyond the last whole one does
// not count. Where one of the four is not known, neither is their mean.
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

// a and b of the coarser picture at this pixel, bilinear.
@if(agreeing) fn upsampled(pixel: vec2u) -> vec2f {
    let x = place_in_coarser(pixel.x, view.size.x, parameters.coarser_size.x);
    let y = place_in_coarser(pixel.y, view.size.y, parameters.coarser_size.y);
    let width = parameters.coarser_size.x;
    let top = mix(coarser_ab(y.low * width + x.low), coarser_ab(y.low * width + x.high), x.share);
    let bottom = mix(coarser_ab(y.high * width + x.low), coarser_ab(y.high * width + x.high), x.share);
    return mix(top, bottom, y.share);
}

@if(agreeing) fn coarser_ab(p: u32) -> vec2f {
    return lab_of(coarser[p]).value.yz;
}

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
        @if(agreeing) {
            let drawn = lab_of(image[p]);
            let drift = distance_of(vec3f(0.0, drawn.value.yz - upsampled(at)));
            let share = parameters.agreement / f32(pixels);
            loss += share * (drift.value.y + drift.value.z);
            gradient += rgb_gradient(drawn, share * vec3f(0.0, drift.slope.yz));
        }
        // The log divides by the pixels.
        own = f32(pixels) * loss;
        image_gradient[p] = vec4f(gradient, 0.0);
    }
    let sum = group_sum(local, own);
    if local == 0u && block * 256u < pixels {
        block_losses[block] = sum;
    }
}
