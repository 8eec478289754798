// The loss of the recipes that RGB splats are colored by elsewhere: differences of L, a and b
// between RGB pictures as drawn and as wanted, and how much neighboring pixels differ; value
// and gradient. `agreeing`: a and b shall agree with those of the next coarser scale as well.
import package::common::lab::{lab_of, rgb_gradient};
import package::common::group_sum::group_sum;
import package::common::numeric::linear_group;
import package::common::pyramid::place_in_coarser;
import package::common::view::View;
import package::common::wanted::{SMOOTHING, wanted_rgb};

// Black to white, in CIELAB's lightness.
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
    // Weight of the total variation of R, G and B.
    variation: f32,
    // 1 where pixel_weights has a weight for each pixel.
    weighted: u32,
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

// |r|, smoothed over `width`, and its slope.
struct Distance {
    value: vec3f,
    slope: vec3f,
}

fn distance_of(r: vec3f, width: f32) -> Distance {
    let length = sqrt(r * r + width * width);
    return Distance(length - width, r / length);
}

fn total_variation(p: u32) -> Distance {
    let width = view.size.x;
    let at = vec2u(p % width, p / width);
    let here = image[p];
    let smoothing = SMOOTHING / UNITS;
    var sum = Distance(vec3f(0.0), vec3f(0.0));
    // What lies right and below is counted here; what lies left and above, there.
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
        @if(agreeing) {
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
