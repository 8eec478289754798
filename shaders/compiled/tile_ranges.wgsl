@compute @workgroup_size(256)
fn tile_ranges(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let tile = linear_group(group) * 256u + local;
    if tile > view.tiles.x * view.tiles.y {
        return;
    }
    var low = 0u;
    var high = status[STATUS_INSTANCES];
    while (low < high) {
        let middle = (low + high) / 2u;
        if keys[middle] < tile {
            low = middle + 1u;
        }
        else {
            high = middle;
        }
    }
    starts[tile] = low;
}

@group(0) @binding(0)
var<uniform> view: View;

@group(0) @binding(1)
var<storage, read> keys: array<u32>;

@group(0) @binding(2)
var<storage, read> status: array<u32>;

@group(0) @binding(3)
var<storage, read_write> starts: array<u32>;

const MAX_GROUPS: u32 = 65535u;

const STATUS_INSTANCES: u32 = 2u;

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
