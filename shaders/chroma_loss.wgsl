// Smoothed L1 between rendered and wanted a/b, value and gradient.
import package::common::numeric::linear_group;
import package::common::view::View;

// Where |r| turns from a parabola into a line, in CIELAB units: far below a
// visible difference, wide enough that the gradient has no jump at zero.
const SMOOTHING: f32 = 0.5;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> image: array<vec2f>;
@group(0) @binding(2) var<storage, read> wanted: array<vec2f>;
// The a/b rendered at the next coarser scale; weight 0 where there is none.
@group(0) @binding(3) var<storage, read> coarser: array<vec2f>;
@group(0) @binding(4) var<uniform> weights: ChromaLossWeights;
@group(0) @binding(5) var<storage, read_write> block_losses: array<f32>;
@group(0) @binding(6) var<storage, read_write> image_gradient: array<vec2f>;

struct ChromaLossWeights {
    coarser_size: vec2u,
    teacher: f32,
    // Weight of the agreement with the coarser scale.
    agreement: f32,
}

var<workgroup> losses: array<f32, 256>;

// Bilinear sample of the coarser image at this pixel, half-pixel centres.
// The position is counted in halves of a fine pixel: integers are exact where a
// quotient in f32 would lose the fraction.
fn upsampled(pixel: vec2u) -> vec2f {
    let at = max((2u * pixel + 1u) * weights.coarser_size, view.size) - view.size;
    let low = at / (2u * view.size);
    let high = min(low + 1u, weights.coarser_size - 1u);
    let t = vec2f(at % (2u * view.size)) / vec2f(2u * view.size);
    let width = weights.coarser_size.x;
    let top = mix(coarser[low.y * width + low.x], coarser[low.y * width + high.x], t.x);
    let bottom = mix(coarser[high.y * width + low.x], coarser[high.y * width + high.x], t.x);
    return mix(top, bottom, t.y);
}

@compute @workgroup_size(256)
fn chroma_loss(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group, groups);
    let p = block * 256u + local;
    let pixels = view.size.x * view.size.y;
    losses[local] = 0.0;
    if p < pixels {
        let scale = 0.5 / f32(pixels);
        let residual = image[p] - wanted[p];
        let length_teacher = sqrt(residual * residual + SMOOTHING * SMOOTHING);
        var loss = weights.teacher * (length_teacher - SMOOTHING);
        var gradient = weights.teacher * residual / length_teacher;
        if weights.agreement > 0.0 {
            let drift = image[p] - upsampled(vec2u(p % view.size.x, p / view.size.x));
            let length_drift = sqrt(drift * drift + SMOOTHING * SMOOTHING);
            loss += weights.agreement * (length_drift - SMOOTHING);
            gradient += weights.agreement * drift / length_drift;
        }
        losses[local] = 0.5 * (loss.x + loss.y);
        image_gradient[p] = scale * gradient;
    }
    workgroupBarrier();
    for (var half = 128u; half > 0u; half /= 2u) {
        if local < half {
            losses[local] += losses[local + half];
        }
        workgroupBarrier();
    }
    if local == 0u && block * 256u < pixels {
        block_losses[block] = losses[0];
    }
}
