// Smoothed L1 between rendered and wanted a/b, value and gradient: of each channel, or
// of their distance in the a, b plane. It may decline to a constant for large
// residuals, so that a teacher who is plainly wrong does not count. With the gradient goes
// the curvature, the slope over the residual: the weight of the pixel in the quadratic
// that touches the loss from above. `agreeing`: the picture shall agree with that of the next
// coarser scale as well.
import package::common::correction::{Correction, corrected};
import package::common::group_sum::group_sum;
import package::common::numeric::linear_group;
import package::common::pyramid::place_in_coarser;
import package::common::view::View;
import package::common::wanted::{SMOOTHING, wanted_ab};

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> image: array<vec2f>;
@group(0) @binding(2) var<storage, read> wanted: array<u32>;
@group(0) @binding(3) var<uniform> weights: ChromaLossWeights;
@group(0) @binding(4) var<storage, read_write> block_losses: array<f32>;
// Gradient, then curvature.
@group(0) @binding(5) var<storage, read_write> image_gradient: array<vec4f>;
// How much each wanted pixel counts: 0 not at all, 1 as an ordinary one, more where
// somebody painted it by hand.
@group(0) @binding(6) var<storage, read> pixel_weights: array<f32>;
// `[views]`
@group(0) @binding(7) var<storage, read> corrections: array<Correction>;
// The a/b rendered at the next coarser scale.
@if(agreeing) @group(0) @binding(8) var<storage, read> coarser: array<vec2f>;

struct ChromaLossWeights {
    coarser_size: vec2u,
    teacher: f32,
    // Weight of the agreement with the coarser scale.
    agreement: f32,
    // One over the residual at which the loss has all but leveled off; 0: never.
    decline: f32,
    // Which correction is this view's.
    view_index: u32,
    // 1 where pixel_weights has a weight for each pixel.
    weighted: u32,
    // 1 where a and b are judged together, by their distance.
    joint: u32,
}

struct Penalty {
    value: vec2f,
    // Slope over residual.
    curvature: vec2f,
}

fn penalty(residual: vec2f, decline: f32, joint: bool) -> Penalty {
    let squares = residual * residual;
    let length = sqrt(select(squares, vec2f(squares.x + squares.y), joint) + SMOOTHING * SMOOTHING);
    // Half of a distance is each channel's.
    let share = select(1.0, 0.5, joint);
    if decline > 0.0 {
        let kept = exp(-decline * (length - SMOOTHING));
        return Penalty(share * (1.0 - kept) / decline, kept / length);
    }
    return Penalty(share * (length - SMOOTHING), 1.0 / length);
}

// Bilinear sample of the coarser image at this pixel, half-pixel centers.
@if(agreeing) fn upsampled(pixel: vec2u) -> vec2f {
    let x = place_in_coarser(pixel.x, view.size.x, weights.coarser_size.x);
    let y = place_in_coarser(pixel.y, view.size.y, weights.coarser_size.y);
    let width = weights.coarser_size.x;
    let top = mix(coarser[y.low * width + x.low], coarser[y.low * width + x.high], x.share);
    let bottom = mix(coarser[y.high * width + x.low], coarser[y.high * width + x.high], x.share);
    return mix(top, bottom, y.share);
}

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
        // What somebody painted is neither corrected nor doubted.
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
        @if(agreeing) {
            let drift = image[p] - upsampled(vec2u(p % view.size.x, p / view.size.x));
            let agreed = penalty(drift, 0.0, false);
            loss += weights.agreement * agreed.value;
            curvature += weights.agreement * agreed.curvature;
            gradient += weights.agreement * agreed.curvature * drift;
        }
        own = 0.5 * (loss.x + loss.y);
        image_gradient[p] = scale * vec4f(gradient, curvature);
    }
    let sum = group_sum(local, own);
    if local == 0u && block * 256u < pixels {
        block_losses[block] = sum;
    }
}
