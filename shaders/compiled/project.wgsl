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
    if !(all_finite3(mean) && all_finite4(quat) && all_finite3(log_scale) && is_finite(logit) && all_finite3(scale) && is_finite(norm_sq) && norm_sq > QUAT_NORM_MIN_SQ) {
        atomicAdd(&status[STATUS_POISONED], 1u);
        return;
    }
    let f = footprint(view, mean, quat * inverseSqrt(norm_sq), scale);
    if !(f.camera.z > view.center_near.w) {
        return;
    }
    let determinant = determinant_of(f);
    let conic = vec3f(f.covariance.z, -f.covariance.y, f.covariance.x) / determinant;
    if !(determinant > 0.0 && is_finite(determinant) && all_finite3(conic) && conic.x > 0.0 && conic.z > 0.0) {
        return;
    }
    let opacity = sigmoid(logit);
    if !(opacity >= ALPHA_MIN) {
        return;
    }
    let center = view.intrinsics.xy * f.camera.xy / f.camera.z + view.intrinsics.zw;
    let extent = sqrt(2.0 * max(power_cutoff(opacity), 0.0) * f.covariance.xz);
    let size = vec2f(view.size);
    if !(center.x + extent.x > 0.0 && center.y + extent.y > 0.0 && center.x - extent.x < size.x && center.y - extent.y < size.y) {
        return;
    }
    projected[i] = Projected(center, extent, vec4f(conic, opacity));
    depths[i] = bitcast<u32>(f.camera.z);
    visible[i] = 1u;
}

@group(0) @binding(0)
var<uniform> view: View;

@group(0) @binding(1)
var<storage, read> geometry: array<f32>;

@group(0) @binding(2)
var<storage, read_write> projected: array<Projected>;

@group(0) @binding(3)
var<storage, read_write> visible: array<u32>;

@group(0) @binding(4)
var<storage, read_write> depths: array<u32>;

@group(0) @binding(5)
var<storage, read_write> ranks: array<u32>;

@group(0) @binding(6)
var<storage, read_write> status: array<atomic<u32>>;

const BLUR: f32 = 0.3;

const INVISIBLE: u32 = 4294967295u;

const MAX_GROUPS: u32 = 65535u;

const PLANE_LOG_SCALE: u32 = 7u;

const PLANE_MEAN: u32 = 0u;

const PLANE_OPACITY: u32 = 10u;

const PLANE_QUAT: u32 = 3u;

const QUAT_NORM_MIN_SQ: f32 = 1e-8;

const STATUS_POISONED: u32 = 4u;

fn all_finite3(v: vec3f) -> bool {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

fn all_finite4(v: vec4f) -> bool {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z) && is_finite(v.w);
}

fn determinant_of(f: Footprint) -> f32 {
    let normal = cross(f.row_x, f.row_y);
    return dot(normal, normal) + BLUR * (f.covariance.x + f.covariance.z - BLUR);
}

fn footprint(view: View, mean: vec3f, unit_quat: vec4f, scale: vec3f) -> Footprint {
    var f: Footprint;
    f.world_to_camera = world_to_camera(view);
    f.camera = f.world_to_camera * mean + vec3f(view.row0.w, view.row1.w, view.row2.w);
    let rotation = rotation_from_quat(unit_quat);
    f.axes = mat3x3f(rotation[0] * scale.x, rotation[1] * scale.y, rotation[2] * scale.z);
    f.slope = clamp(f.camera.xy / f.camera.z, view.slope_limits.xy, view.slope_limits.zw);
    let focal = view.intrinsics.xy / f.camera.z;
    let in_camera = f.world_to_camera * f.axes;
    let row0 = vec3f(in_camera[0].x, in_camera[1].x, in_camera[2].x);
    let row1 = vec3f(in_camera[0].y, in_camera[1].y, in_camera[2].y);
    let row2 = vec3f(in_camera[0].z, in_camera[1].z, in_camera[2].z);
    f.row_x = focal.x * (row0 - f.slope.x * row2);
    f.row_y = focal.y * (row1 - f.slope.y * row2);
    f.covariance = vec3f(dot(f.row_x, f.row_x) + BLUR, dot(f.row_x, f.row_y), dot(f.row_y, f.row_y) + BLUR);
    return f;
}

fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 2147483647u) < 2139095040u;
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

fn plane(index: u32, i: u32) -> f32 {
    return geometry[index * view.splat_count + i];
}

fn power_cutoff(opacity: f32) -> f32 {
    return log(opacity / ALPHA_MIN);
}

fn rotation_from_quat(q: vec4f) -> mat3x3f {
    let w = q.x;
    let x = q.y;
    let y = q.z;
    let z = q.w;
    return mat3x3f(vec3f(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)), vec3f(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)), vec3f(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)));
}

fn sigmoid(x: f32) -> f32 {
    return 1.0 / (1.0 + exp(-x));
}

fn world_to_camera(view: View) -> mat3x3f {
    return transpose(mat3x3f(view.row0.xyz, view.row1.xyz, view.row2.xyz));
}

override ALPHA_MIN: f32 = 0.00392156862745098;

struct Footprint {
    camera: vec3f,
    slope: vec2f,
    axes: mat3x3f,
    world_to_camera: mat3x3f,
    row_x: vec3f,
    row_y: vec3f,
    covariance: vec3f
}

struct Projected {
    mean: vec2f,
    extent: vec2f,
    conic_opacity: vec4f
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
