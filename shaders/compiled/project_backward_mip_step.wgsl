@compute @workgroup_size(256)
fn project_backward(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let i = linear_group(group) * 256u + local;
    let n = view.splat_count;
    if i >= n {
        return;
    }
    let overflow = atomicLoad(&status[STATUS_OVERFLOW]) != 0u;
    {
        if overflow {
            return;
        }
    }
    if ranks[i] == INVISIBLE {
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
    let q = projected[i].conic_opacity;
    let conic = mat2x2f(q.x, q.y, q.y, q.z);
    let v_q = mat2x2f(v_conic.x, 0.5 * v_conic.y, 0.5 * v_conic.y, v_conic.z);
    let v_log_opacity = v_opacity * q.w;
    let v_covariance = conic * v_q * conic + (0.5 * v_log_opacity) * conic;
    let v_xx = -v_covariance[0].x;
    let v_xy = -2.0 * v_covariance[0].y;
    let v_yy = -v_covariance[1].y;
    var v_row_x = 2.0 * v_xx * f.row_x + v_xy * f.row_y;
    var v_row_y = 2.0 * v_yy * f.row_y + v_xy * f.row_x;
    {
        let normal = cross(f.row_x, f.row_y);
        let share = v_log_opacity / dot(normal, normal);
        v_row_x += share * cross(f.row_y, normal);
        v_row_y += share * cross(normal, f.row_x);
    }
    let inverse_z = 1.0 / f.camera.z;
    let focal = view.intrinsics.xy * inverse_z;
    let in_camera = f.world_to_camera * f.axes;
    let r2 = vec3f(in_camera[0].z, in_camera[1].z, in_camera[2].z);
    let v_r0 = focal.x * v_row_x;
    let v_r1 = focal.y * v_row_y;
    let v_r2 = -(f.slope.x * v_r0 + f.slope.y * v_r1);
    let v_slope = -vec2f(dot(r2, v_r0), dot(r2, v_r1));
    var v_camera = vec3f(0.0, 0.0, -(dot(f.row_x, v_row_x) + dot(f.row_y, v_row_y)) * inverse_z);
    let slope = f.camera.xy * inverse_z;
    let free = (slope > view.slope_limits.xy) & (slope < view.slope_limits.zw);
    let v_position = select(vec2f(0.0), v_slope, free) + view.intrinsics.xy * v_center;
    v_camera += vec3f(v_position, -dot(v_position, slope)) * inverse_z;
    let to_world = transpose(f.world_to_camera);
    let v_mean = to_world * v_camera;
    let v_axes = to_world * mat3x3f(vec3f(v_r0.x, v_r1.x, v_r2.x), vec3f(v_r0.y, v_r1.y, v_r2.y), vec3f(v_r0.z, v_r1.z, v_r2.z));
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
    let stored_opacity = sigmoid(plane(PLANE_OPACITY, i));
    store(PLANE_OPACITY, i, v_opacity * q.w * (1.0 - stored_opacity));
    if overflow {
        return;
    }
    let signed_pull = length(0.5 * vec2f(view.size) * v_center);
    statistics[STAT_PULL * n + i] += select(gradients[at + PARTIAL_PULL], signed_pull, SIGNED_PULLS);
    statistics[STAT_VIEWS * n + i] += 1.0;
}

@group(0) @binding(0)
var<uniform> view: View;

@group(0) @binding(1)
var<storage, read_write> geometry: array<f32>;

@group(0) @binding(10)
var<storage, read_write> first_moment: array<f32>;

@group(0) @binding(11)
var<storage, read_write> second_moment: array<f32>;

@group(0) @binding(2)
var<storage, read> ranks: array<u32>;

@group(0) @binding(3)
var<storage, read> projected: array<Projected>;

@group(0) @binding(4)
var<storage, read> gradients: array<f32>;

@group(0) @binding(6)
var<storage, read_write> statistics: array<f32>;

@group(0) @binding(7)
var<storage, read> mean_gradient: array<f32>;

@group(0) @binding(8)
var<storage, read_write> status: array<atomic<u32>>;

@group(0) @binding(9)
var<uniform> parameters: AdamParameters;

const BETA1: f32 = 0.9;

const BETA2: f32 = 0.999;

const BLUR: f32 = 0.3;

const CHANNELS: u32 = 1u;

const EPSILON: f32 = 1e-15;

const GRADIENT_MAX: f32 = 1e18;

const INVISIBLE: u32 = 4294967295u;

const MAX_GROUPS: u32 = 65535u;

const ONE_LESS_BETA2: f32 = 0.001;

const PARTIAL_COLOR: u32 = 7u;

const PARTIAL_PULL: u32 = 6u;

const PARTIAL_STRIDE: u32 = PARTIAL_COLOR + CHANNELS;

const PLANE_LOG_SCALE: u32 = 7u;

const PLANE_MEAN: u32 = 0u;

const PLANE_OPACITY: u32 = 10u;

const PLANE_QUAT: u32 = 3u;

const STATUS_OVERFLOW: u32 = 0u;

const STATUS_REFUSED: u32 = 6u;

const STAT_PULL: u32 = 0u;

const STAT_VIEWS: u32 = 1u;

fn adam_step(state: vec3f, gradient: f32, rate: f32, correction: vec2f) -> vec3f {
    let m = BETA1 * state.y + (1.0 - BETA1) * gradient;
    let v = BETA2 * state.z + ONE_LESS_BETA2 * gradient * gradient;
    return vec3f(state.x - rate * (m * correction.x) / (sqrt(v * correction.y) + EPSILON), m, v);
}

fn descended(plane: u32, i: u32, count: u32, value: f32, gradient: f32) -> f32 {
    if i >= parameters.trained {
        return value;
    }
    if !is_within(gradient, GRADIENT_MAX) {
        atomicAdd(&status[STATUS_REFUSED], 1u);
        return value;
    }
    let k = plane * count + i;
    let rate = parameters.learning_rates[plane / 4u][plane % 4u];
    let correction = vec2f(parameters.correction1, parameters.correction2);
    let next = adam_step(vec3f(value, first_moment[k], second_moment[k]), gradient, rate, correction);
    first_moment[k] = next.y;
    second_moment[k] = next.z;
    return next.x;
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

fn is_within(x: f32, bound: f32) -> bool {
    return (bitcast<u32>(x) & 2147483647u) <= bitcast<u32>(bound);
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

fn log_scales(i: u32) -> vec3f {
    return vec3f(plane(PLANE_LOG_SCALE, i), plane(PLANE_LOG_SCALE + 1u, i), plane(PLANE_LOG_SCALE + 2u, i));
}

fn plane(index: u32, i: u32) -> f32 {
    return geometry[index * view.splat_count + i];
}

fn quat_gradient(q: vec4f, g: mat3x3f) -> vec4f {
    let w = q.x;
    let x = q.y;
    let y = q.z;
    let z = q.w;
    return 2.0 * vec4f(x * (g[1].z - g[2].y) + y * (g[2].x - g[0].z) + z * (g[0].y - g[1].x), -2.0 * x * (g[1].y + g[2].z) + y * (g[0].y + g[1].x) + z * (g[0].z + g[2].x) + w * (g[1].z - g[2].y), x * (g[0].y + g[1].x) - 2.0 * y * (g[0].x + g[2].z) + z * (g[1].z + g[2].y) + w * (g[2].x - g[0].z), x * (g[0].z + g[2].x) + y * (g[1].z + g[2].y) - 2.0 * z * (g[0].x + g[1].y) + w * (g[0].y - g[1].x));
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

fn store(index: u32, i: u32, value: f32) {
    let k = index * view.splat_count + i;
    geometry[k] = descended(index, i, view.splat_count, geometry[k], value);
}

fn world_to_camera(view: View) -> mat3x3f {
    return transpose(mat3x3f(view.row0.xyz, view.row1.xyz, view.row2.xyz));
}

override SIGNED_PULLS: bool = false;

struct AdamParameters {
    splat_count: u32,
    planes: u32,
    correction1: f32,
    correction2: f32,
    trained: u32,
    learning_rates: array<vec4f, 12>
}

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
