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
    let quat = vec4f(source[PLANE_QUAT * old + i], source[(PLANE_QUAT + 1u) * old + i], source[(PLANE_QUAT + 2u) * old + i], source[(PLANE_QUAT + 3u) * old + i]);
    let log_scale = vec3f(source[PLANE_LOG_SCALE * old + i], source[(PLANE_LOG_SCALE + 1u) * old + i], source[(PLANE_LOG_SCALE + 2u) * old + i]);
    let moved = rotation_from_quat(quat * inverseSqrt(dot(quat, quat))) * (exp(log_scale) * descent.offset);
    destination[PLANE_OPACITY * parameters.new_count + j] += descent.logit_step;
    for (var axis = 0u; axis < 3u; axis++) {
        destination[(PLANE_MEAN + axis) * parameters.new_count + j] += moved[axis];
        destination[(PLANE_LOG_SCALE + axis) * parameters.new_count + j] = log_scale[axis] + descent.log_growth[axis];
    }
}

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

@group(0) @binding(0)
var<uniform> parameters: DensifyParameters;

@group(0) @binding(1)
var<storage, read> plan: array<Descent>;

@group(0) @binding(2)
var<storage, read> source: array<f32>;

@group(0) @binding(3)
var<storage, read_write> destination: array<f32>;

const GEOMETRY_PLANES: u32 = 11u;

const MAX_GROUPS: u32 = 65535u;

const PLANE_LOG_SCALE: u32 = 7u;

const PLANE_MEAN: u32 = 0u;

const PLANE_OPACITY: u32 = 10u;

const PLANE_QUAT: u32 = 3u;

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

fn rotation_from_quat(q: vec4f) -> mat3x3f {
    let w = q.x;
    let x = q.y;
    let y = q.z;
    let z = q.w;
    return mat3x3f(vec3f(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)), vec3f(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)), vec3f(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)));
}

struct DensifyParameters {
    old_count: u32,
    new_count: u32,
    planes: u32
}

struct Descent {
    offset: vec3f,
    source: u32,
    log_growth: vec3f,
    survives: u32,
    logit_step: f32
}
