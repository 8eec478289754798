// Which tiles each visible Gaussian touches. The same pipeline runs twice: it
// counts, then, after a scan of the counts, it emits. Count and emission cannot
// disagree, because they are one compiled loop.
import package::common::constants::{STATUS_INSTANCES, STATUS_VISIBLE, TILE_SIDE};
import package::common::numeric::linear_group;
import package::common::projected::{Projected, power_cutoff, touches};
import package::common::view::View;

struct TileListsMode {
    emit: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> mode: TileListsMode;
@group(0) @binding(2) var<storage, read> projected: array<Projected>;
// Gaussians by depth.
@group(0) @binding(3) var<storage, read> order: array<u32>;
@group(0) @binding(4) var<storage, read> status: array<u32>;
@group(0) @binding(5) var<storage, read_write> ranks: array<u32>;
// Counts when counting; their exclusive scan when emitting.
@group(0) @binding(6) var<storage, read_write> offsets: array<u32>;
@group(0) @binding(7) var<storage, read_write> keys: array<u32>;
@group(0) @binding(8) var<storage, read_write> slots: array<u32>;
@group(0) @binding(9) var<storage, read_write> instance_splats: array<u32>;

// Whether a Gaussian can be seen in a tile.
fn reaches(splat: Projected, cutoff: f32, tile: vec2u) -> bool {
    let corner = vec2f(tile * TILE_SIDE) + 0.5;
    return touches(splat, cutoff, corner, corner + f32(TILE_SIDE - 1u));
}

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
        // An ellipse is convex: what it touches of a row lies between two ends.
        var left = low.x;
        while left <= high.x && !reaches(splat, cutoff, vec2u(left, y)) {
            left++;
        }
        var right = high.x;
        while right > left && !reaches(splat, cutoff, vec2u(right, y)) {
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
        // Where nothing is reached, `left` is one beyond `right`.
        cursor += right + 1u - left;
    }
    if !emitting {
        offsets[rank] = cursor - begin;
        ranks[i] = rank;
    }
}
