@compute @workgroup_size(256)
fn tile_lists(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let rank = linear_group(group) * 256u + local;
    let emitting = mode.emit == 1u;
    if rank >= status[STATUS_VISIBLE] || (emitting && status[STATUS_INSTANCES] == 0u) {
        return;
    }
    let i = order[rank];
    let splat = projected[i];
    let cutoff = power_cutoff(splat.conic_opacity.w);
    let side = f32(TILE_SIDE);
    let last = vec2f(view.tiles) - 1.0;
    let low = vec2u(clamp(floor((splat.mean - splat.extent) / side), vec2f(0.0), last));
    let high = vec2u(clamp(floor((splat.mean + splat.extent) / side), vec2f(0.0), last));
    var cursor = 0u;
    if emitting {
        cursor = offsets[rank];
    }
    let begin = cursor;
    for (var y = low.y; y <= high.y; y++) {
        var left = low.x;
        while (left <= high.x && !reaches(splat, cutoff, vec2u(left, y))) {
            left++;
        }
        var right = high.x;
        while (right > left && !reaches(splat, cutoff, vec2u(right, y))) {
            right--;
        }
        if emitting {
            for (var x = left; x <= right; x++) {
                let at = cursor + x - left;
                keys[at] = y * view.tiles.x + x;
                slots[at] = at;
                instance_splats[at] = i;
            }
        }
        cursor += right + 1u - left;
    }
    if !emitting {
        offsets[rank] = cursor - begin;
        ranks[i] = rank;
    }
}

@group(0) @binding(0)
var<uniform> view: View;

@group(0) @binding(1)
var<uniform> mode: TileListsMode;

@group(0) @binding(2)
var<storage, read> projected: array<Projected>;

@group(0) @binding(3)
var<storage, read> order: array<u32>;

@group(0) @binding(4)
var<storage, read> status: array<u32>;

@group(0) @binding(5)
var<storage, read_write> ranks: array<u32>;

@group(0) @binding(6)
var<storage, read_write> offsets: array<u32>;

@group(0) @binding(7)
var<storage, read_write> keys: array<u32>;

@group(0) @binding(8)
var<storage, read_write> slots: array<u32>;

@group(0) @binding(9)
var<storage, read_write> instance_splats: array<u32>;

const MAX_GROUPS: u32 = 65535u;

const STATUS_INSTANCES: u32 = 2u;

const STATUS_VISIBLE: u32 = 1u;

const TILE_SIDE: u32 = 16u;

fn least_power(splat: Projected, low: vec2f, high: vec2f) -> f32 {
    let conic = splat.conic_opacity.xyz;
    let nearest = clamp(splat.mean, low, high) - splat.mean;
    if nearest.x == 0.0 && nearest.y == 0.0 {
        return 0.0;
    }
    let lower = low - splat.mean;
    let upper = high - splat.mean;
    let on_vertical = vec2f(nearest.x, clamp(-conic.y * nearest.x / conic.z, lower.y, upper.y));
    let on_horizontal = vec2f(clamp(-conic.y * nearest.y / conic.x, lower.x, upper.x), nearest.y);
    return min(power_at(conic, on_vertical), power_at(conic, on_horizontal));
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

fn power_at(conic: vec3f, d: vec2f) -> f32 {
    return 0.5 * (conic.x * d.x * d.x + conic.z * d.y * d.y) + conic.y * d.x * d.y;
}

fn power_cutoff(opacity: f32) -> f32 {
    return log(opacity / ALPHA_MIN);
}

fn reaches(splat: Projected, cutoff: f32, tile: vec2u) -> bool {
    let corner = vec2f(tile * TILE_SIDE) + 0.5;
    return touches(splat, cutoff, corner, corner + f32(TILE_SIDE - 1u));
}

fn touches(splat: Projected, cutoff: f32, low: vec2f, high: vec2f) -> bool {
    return least_power(splat, low, high) <= cutoff;
}

override ALPHA_MIN: f32 = 0.00392156862745098;

struct Projected {
    mean: vec2f,
    extent: vec2f,
    conic_opacity: vec4f
}

struct TileListsMode {
    emit: u32
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
