// Means, quaternions, log-scales and opacity logits to centers, conics and
// opacities on the image plane. One thread a Gaussian.
//
// With `mip` opacities are what they show, not what is stored: the blur spreads a
// Gaussian, and its opacity falls by as much (`compensation`).
//
// Culling tests are written so that NaN fails them.
import package::common::constants::{ALPHA_MIN, INVISIBLE, PLANE_LOG_SCALE, PLANE_MEAN, PLANE_OPACITY, PLANE_QUAT, QUAT_NORM_MIN_SQ, STATUS_POISONED};
import package::common::geometry::{Footprint, determinant_of, footprint};
@if(mip) import package::common::geometry::compensation;
import package::common::numeric::{all_finite3, all_finite4, is_finite, linear_group, sigmoid};
import package::common::projected::{Projected, power_cutoff};
import package::common::view::View;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> geometry: array<f32>;
@group(0) @binding(2) var<storage, read_write> projected: array<Projected>;
@group(0) @binding(3) var<storage, read_write> visible: array<u32>;
@group(0) @binding(4) var<storage, read_write> depths: array<u32>;
@group(0) @binding(5) var<storage, read_write> ranks: array<u32>;
@group(0) @binding(6) var<storage, read_write> status: array<atomic<u32>>;

fn plane(index: u32, i: u32) -> f32 {
    return geometry[index * view.splat_count + i];
}

@compute @workgroup_size(256)
fn project(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let i = linear_group(group) * 256u + local;
    if i >= view.splat_count {
        return;
    }
    visible[i] = 0u;
    ranks[i] = INVISIBLE;

    let mean = vec3f(plane(PLANE_MEAN, i), plane(PLANE_MEAN + 1u, i), plane(PLANE_MEAN + 2u, i));
    let quat = vec4f(plane(PLANE_QUAT, i), plane(PLANE_QUAT + 1u, i), plane(PLANE_QUAT + 2u, i), plane(PLANE_QUAT + 3u, i));
    let log_scale = vec3f(plane(PLANE_LOG_SCALE, i), plane(PLANE_LOG_SCALE + 1u, i), plane(PLANE_LOG_SCALE + 2u, i));
    let logit = plane(PLANE_OPACITY, i);
    let norm_sq = dot(quat, quat);
    let scale = exp(log_scale);
    if !(all_finite3(mean) && all_finite4(quat) && all_finite3(log_scale) && is_finite(logit)
        && all_finite3(scale) && is_finite(norm_sq) && norm_sq > QUAT_NORM_MIN_SQ) {
        atomicAdd(&status[STATUS_POISONED], 1u);
        return;
    }
    let f = footprint(view, mean, quat * inverseSqrt(norm_sq), scale);
    if !(f.camera.z > view.center_near.w) {
        return;
    }
    let determinant = determinant_of(f);
    let conic = vec3f(f.covariance.z, -f.covariance.y, f.covariance.x) / determinant;
    // Overflow of a huge Gaussian ends here: an infinite determinant gives no conic.
    if !(determinant > 0.0 && is_finite(determinant) && all_finite3(conic) && conic.x > 0.0 && conic.z > 0.0) {
        return;
    }
    @if(!mip) let opacity = sigmoid(logit);
    @if(mip) let opacity = sigmoid(logit) * compensation(f, determinant);
    if !(opacity >= ALPHA_MIN) {
        return;
    }
    let center = view.intrinsics.xy * f.camera.xy / f.camera.z + view.intrinsics.zw;
    let extent = sqrt(2.0 * max(power_cutoff(opacity), 0.0) * f.covariance.xz);
    let size = vec2f(view.size);
    if !(center.x + extent.x > 0.0 && center.y + extent.y > 0.0
        && center.x - extent.x < size.x && center.y - extent.y < size.y) {
        return;
    }
    projected[i] = Projected(center, extent, vec4f(conic, opacity));
    // Bits of positive floats sort as the floats do.
    depths[i] = bitcast<u32>(f.camera.z);
    visible[i] = 1u;
}
