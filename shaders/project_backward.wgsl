// The adjoint of `project`: from centers, conics and opacities on the image
// plane to means, quaternions, log-scales and opacity logits. In training (`step`) Adam
// moves the parameters at once, and their gradient is never stored; or (`lazy`) it moves
// those of the Gaussians that the view shows, and the others keep their moments as well.
//
// Derivation. With q̂ = q/|q|, M = R(q̂)·diag(exp s), W the world-to-camera rotation,
// p = W m + t and u = clamp(p.xy / p.z), the 2D covariance Σ is the Gram matrix of
//     ρx = (fx/pz)(r0 − ux r2),   ρy = (fy/pz)(r1 − uy r2),   r = rows of W M,
// plus 0.3 I. Its determinant is |ρx × ρy|² + 0.3 (Σxx + Σyy − 0.3), a sum of positive
// terms, so needles do not cancel to zero. With Q = Σ⁻¹ the gradient goes back through
// dΣ = −Q dQ Q, without a squared determinant to divide by, then through ρ, r, M. Where
// the clamp on u is active no gradient passes through u.
//
// Antialiased, the opacity shown is the one stored times c = |n| / √det Σ, n = ρx × ρy.
// With g the gradient of the opacity shown, times that opacity, d log|n| = n·dn/|n|² adds
// g (ρy × n)/|n|² to the gradient of ρx and g (n × ρx)/|n|² to that of ρy, and
// −½ d log det Σ adds −½ g Q to that of Σ. Nothing is divided by c, and what is shown has
// c ≥ 1/255, so all of it is bounded by some 460 g. A needle or disc seen edge-on has
// n = 0 and is not shown.
import package::common::constants::{INVISIBLE, PLANE_LOG_SCALE, PLANE_MEAN, PLANE_OPACITY, PLANE_QUAT, STAT_PULL, STAT_VIEWS, STATUS_OVERFLOW};
@if(step) import package::common::descend::{descended, status};
import package::common::geometry::footprint;
import package::common::numeric::linear_group;
@if(mip) import package::common::numeric::sigmoid;
import package::common::partials::{PARTIAL_PULL, PARTIAL_STRIDE};
import package::common::projected::Projected;
import package::common::rotation::{quat_gradient, rotation_from_quat};
import package::common::view::View;

// True where densification asks as 3DGS does: pixels that pull apart cancel.
override SIGNED_PULLS: bool = false;

@group(0) @binding(0) var<uniform> view: View;
@if(!step) @group(0) @binding(1) var<storage, read> geometry: array<f32>;
@if(step) @group(0) @binding(1) var<storage, read_write> geometry: array<f32>;
@group(0) @binding(2) var<storage, read> ranks: array<u32>;
@group(0) @binding(3) var<storage, read> projected: array<Projected>;
@group(0) @binding(4) var<storage, read> gradients: array<f32>;
// Planes `[11, N]`.
@if(!step) @group(0) @binding(5) var<storage, read_write> geometry_gradient: array<f32>;
// Planes `[2, N]`, accumulated over iterations.
@group(0) @binding(6) var<storage, read_write> statistics: array<f32>;
// Planes `[3, N]`, what `shade_backward` adds to the means' gradient.
@group(0) @binding(7) var<storage, read> mean_gradient: array<f32>;
@if(!step) @group(0) @binding(8) var<storage, read_write> status: array<atomic<u32>>;

fn plane(index: u32, i: u32) -> f32 {
    return geometry[index * view.splat_count + i];
}

@if(step) fn store(index: u32, i: u32, value: f32) {
    let k = index * view.splat_count + i;
    geometry[k] = descended(index, i, view.splat_count, geometry[k], value);
}

@if(!step) fn store(index: u32, i: u32, value: f32) {
    geometry_gradient[index * view.splat_count + i] = value;
}

fn log_scales(i: u32) -> vec3f {
    return vec3f(plane(PLANE_LOG_SCALE, i), plane(PLANE_LOG_SCALE + 1u, i), plane(PLANE_LOG_SCALE + 2u, i));
}

@compute @workgroup_size(256)
fn project_backward(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let i = linear_group(group) * 256u + local;
    let n = view.splat_count;
    if i >= n {
        return;
    }
    // After an overflow nothing moves until the host has grown the buffers and
    // repeats the iteration.
    let overflow = atomicLoad(&status[STATUS_OVERFLOW]) != 0u;
    @if(step) { if overflow { return; } }
    @if(lazy) { if ranks[i] == INVISIBLE { return; } }
    @if(!lazy) if ranks[i] == INVISIBLE {
        for (var index = PLANE_MEAN; index <= PLANE_OPACITY; index++) {
            store(index, i, 0.0);
        }
        return;
    }
    let at = i * PARTIAL_STRIDE;
    let v_center = vec2f(gradients[at], gradients[at + 1u]);
    let v_conic = vec3f(gradients[at + 2u], gradients[at + 3u], gradients[at + 4u]);
    let v_opacity = gradients[at + 5u];

    let mean = vec3f(plane(PLANE_MEAN, i), plane(PLANE_MEAN + 1u, i), plane(PLANE_MEAN + 2u, i));
    let quat = vec4f(plane(PLANE_QUAT, i), plane(PLANE_QUAT + 1u, i), plane(PLANE_QUAT + 2u, i), plane(PLANE_QUAT + 3u, i));
    let inverse_norm = inverseSqrt(dot(quat, quat));
    let unit = quat * inverse_norm;
    let scale = exp(log_scales(i));
    let f = footprint(view, mean, unit, scale);

    // Conic Q = Σ⁻¹: dΣ = -Q dQ Q, with dQ symmetric.
    let q = projected[i].conic_opacity;
    let conic = mat2x2f(q.x, q.y, q.y, q.z);
    let v_q = mat2x2f(v_conic.x, 0.5 * v_conic.y, 0.5 * v_conic.y, v_conic.z);
    @if(!mip) let v_covariance = conic * v_q * conic;
    // The opacity shown is the one stored times |ρx × ρy| / √det Σ, and -½ d log det Σ
    // is -½ tr(Q dΣ).
    @if(mip) let v_log_opacity = v_opacity * q.w;
    @if(mip) let v_covariance = conic * v_q * conic + (0.5 * v_log_opacity) * conic;
    let v_xx = -v_covariance[0].x;
    let v_xy = -2.0 * v_covariance[0].y;
    let v_yy = -v_covariance[1].y;

    var v_row_x = 2.0 * v_xx * f.row_x + v_xy * f.row_y;
    var v_row_y = 2.0 * v_yy * f.row_y + v_xy * f.row_x;
    // d log|n| = n·dn / |n|², n = ρx × ρy. What is shown has |n| ≥ ALPHA_MIN √det Σ.
    @if(mip) {
        let normal = cross(f.row_x, f.row_y);
        let share = v_log_opacity / dot(normal, normal);
        v_row_x += share * cross(f.row_y, normal);
        v_row_y += share * cross(normal, f.row_x);
    }

    // row_x = fx/z (r0 - slope.x r2), row_y alike; r are the rows of W·axes.
    let inverse_z = 1.0 / f.camera.z;
    let focal = view.intrinsics.xy * inverse_z;
    let in_camera = f.world_to_camera * f.axes;
    let r2 = vec3f(in_camera[0].z, in_camera[1].z, in_camera[2].z);
    let v_r0 = focal.x * v_row_x;
    let v_r1 = focal.y * v_row_y;
    let v_r2 = -(f.slope.x * v_r0 + f.slope.y * v_r1);
    let v_slope = -vec2f(dot(r2, v_r0), dot(r2, v_r1));
    var v_camera = vec3f(0.0, 0.0, -(dot(f.row_x, v_row_x) + dot(f.row_y, v_row_y)) * inverse_z);

    // A clamped slope passes no gradient.
    let slope = f.camera.xy * inverse_z;
    let free = (slope > view.slope_limits.xy) & (slope < view.slope_limits.zw);
    let v_position = select(vec2f(0.0), v_slope, free) + view.intrinsics.xy * v_center;
    v_camera += vec3f(v_position, -dot(v_position, slope)) * inverse_z;

    let to_world = transpose(f.world_to_camera);
    let v_mean = to_world * v_camera;
    let v_axes = to_world * mat3x3f(
        vec3f(v_r0.x, v_r1.x, v_r2.x),
        vec3f(v_r0.y, v_r1.y, v_r2.y),
        vec3f(v_r0.z, v_r1.z, v_r2.z));
    let v_log_scale = vec3f(dot(v_axes[0], f.axes[0]), dot(v_axes[1], f.axes[1]), dot(v_axes[2], f.axes[2]));
    let v_rotation = mat3x3f(v_axes[0] * scale.x, v_axes[1] * scale.y, v_axes[2] * scale.z);
    let v_unit = quat_gradient(unit, v_rotation);
    let v_quat = (v_unit - unit * dot(unit, v_unit)) * inverse_norm;

    for (var axis = 0u; axis < 3u; axis++) {
        store(PLANE_MEAN + axis, i, mean_gradient[axis * n + i] + v_mean[axis]);
        store(PLANE_LOG_SCALE + axis, i, v_log_scale[axis]);
    }
    for (var k = 0u; k < 4u; k++) {
        store(PLANE_QUAT + k, i, v_quat[k]);
    }
    @if(!mip) let stored_opacity = q.w;
    @if(mip) let stored_opacity = sigmoid(plane(PLANE_OPACITY, i));
    store(PLANE_OPACITY, i, v_opacity * q.w * (1.0 - stored_opacity));

    if overflow {
        return;
    }
    let signed_pull = length(0.5 * vec2f(view.size) * v_center);
    statistics[STAT_PULL * n + i] += select(gradients[at + PARTIAL_PULL], signed_pull, SIGNED_PULLS);
    statistics[STAT_VIEWS * n + i] += 1.0;
}
