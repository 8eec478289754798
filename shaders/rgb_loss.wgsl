// Smoothed L1 between RGB pictures as drawn and as wanted, by their distance in each
// pixel, with gradient and curvature as in `chroma_loss`. Viewers clip what is brighter
// than white: where white is wanted nothing is too bright.
import package::common::group_sum::group_sum;
import package::common::numeric::linear_group;
import package::common::view::View;
import package::common::wanted::{SMOOTHING, wanted_rgb};

// Black to white, in the loss's units: those of CIELAB's lightness.
const UNITS: f32 = 100.0;

struct RgbLossParameters {
    // 1 where pixel_weights has a weight for each pixel.
    weighted: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> image: array<vec3f>;
@group(0) @binding(2) var<storage, read> wanted: array<u32>;
@group(0) @binding(3) var<uniform> parameters: RgbLossParameters;
@group(0) @binding(4) var<storage, read_write> block_losses: array<f32>;
// Gradient with respect to the image, then curvature, the same in all channels.
@group(0) @binding(5) var<storage, read_write> image_gradient: array<vec4f>;
// How much each wanted pixel counts.
@group(0) @binding(6) var<storage, read> pixel_weights: array<f32>;

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
