@compute @workgroup_size(256)
fn compact(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let i = linear_group(group) * 256u + local;
    if i >= view.splat_count {
        return;
    }
    let position = positions[i];
    var next = status[STATUS_VISIBLE];
    if i + 1u < view.splat_count {
        next = positions[i + 1u];
    }
    if next > position {
        keys[position] = depths[i];
        values[position] = i;
    }
}

@group(0) @binding(0)
var<uniform> view: View;

@group(0) @binding(1)
var<storage, read> positions: array<u32>;

@group(0) @binding(2)
var<storage, read> depths: array<u32>;

@group(0) @binding(3)
var<storage, read> status: array<u32>;

@group(0) @binding(4)
var<storage, read_write> keys: array<u32>;

@group(0) @binding(5)
var<storage, read_write> values: array<u32>;

const MAX_GROUPS: u32 = 65535u;

const STATUS_VISIBLE: u32 = 1u;

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
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
