// Carries out a densification plan: each new Gaussian is a copy of an old one,
// moved, resized and dimmed where it is the half of a split. Moments follow survivors;
// newcomers start without.
import package::common::constants::{GEOMETRY_PLANES, PLANE_LOG_SCALE, PLANE_MEAN, PLANE_OPACITY, PLANE_QUAT};
import package::common::numeric::linear_group;
import package::common::rotation::rotation_from_quat;

struct Descent {
    // Offset in units of the source's standard deviations.
    offset: vec3f,
    source: u32,
    // Added to the log-scales.
    log_growth: vec3f,
    // 1 for a survivor, which is copied with its moments; 0 for the half of a split.
    survives: u32,
    // Added to the opacity logit.
    logit_step: f32,
}

struct DensifyParameters {
    old_count: u32,
    new_count: u32,
    planes: u32,
}

@group(0) @binding(0) var<uniform> parameters: DensifyParameters;
@group(0) @binding(1) var<storage, read> plan: array<Descent>;
@group(0) @binding(2) var<storage, read> source: array<f32>;
@group(0) @binding(3) var<storage, read_write> destination: array<f32>;

// Geometry `[11, N]`.
@compute @workgroup_size(256)
fn densify_geometry(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let j = linear_group(group) * 256u + local;
    if j >= parameters.new_count {
        return;
    }
    let descent = plan[j];
    let old = parameters.old_count;
    let i = descent.source;
    for (var index = 0u; index < GEOMETRY_PLANES; index++) {
        destination[index * parameters.new_count + j] = source[index * old + i];
    }
    if descent.survives == 1u {
        return;
    }
    let quat = vec4f(source[PLANE_QUAT * old + i], source[(PLANE_QUAT + 1u) * old + i],
        source[(PLANE_QUAT + 2u) * old + i], source[(PLANE_QUAT + 3u) * old + i]);
    let log_scale = vec3f(source[PLANE_LOG_SCALE * old + i], source[(PLANE_LOG_SCALE + 1u) * old + i],
        source[(PLANE_LOG_SCALE + 2u) * old + i]);
    // A Gaussian is split for its gradient, so it was visible, so its quaternion has a length.
    let moved = rotation_from_quat(quat * inverseSqrt(dot(quat, quat))) * (exp(log_scale) * descent.offset);
    destination[PLANE_OPACITY * parameters.new_count + j] += descent.logit_step;
    for (var axis = 0u; axis < 3u; axis++) {
        destination[(PLANE_MEAN + axis) * parameters.new_count + j] += moved[axis];
        destination[(PLANE_LOG_SCALE + axis) * parameters.new_count + j] = log_scale[axis] + descent.log_growth[axis];
    }
}

// Spherical harmonics `[planes, N]`.
@compute @workgroup_size(256)
fn densify_sh(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let j = linear_group(group) * 256u + local;
    if j >= parameters.new_count {
        return;
    }
    for (var index = 0u; index < parameters.planes; index++) {
        destination[index * parameters.new_count + j] = source[index * parameters.old_count + plan[j].source];
    }
}

// Moments `[planes, N]` of either.
@compute @workgroup_size(256)
fn densify_moments(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let j = linear_group(group) * 256u + local;
    if j >= parameters.new_count {
        return;
    }
    for (var index = 0u; index < parameters.planes; index++) {
        destination[index * parameters.new_count + j] = select(0.0, source[index * parameters.old_count + plan[j].source], plan[j].survives == 1u);
    }
}
