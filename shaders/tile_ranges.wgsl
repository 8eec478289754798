// Where each tile's instances begin in the sorted list: a binary search a tile
// needs no clearing and no neighbor's key.
import package::common::constants::STATUS_INSTANCES;
import package::common::numeric::linear_group;
import package::common::view::View;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> keys: array<u32>;
@group(0) @binding(2) var<storage, read> status: array<u32>;
// `[tiles + 1]`: tile t owns the instances starts[t] .. starts[t + 1].
@group(0) @binding(3) var<storage, read_write> starts: array<u32>;

@compute @workgroup_size(256)
fn tile_ranges(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let tile = linear_group(group) * 256u + local;
    if tile > view.tiles.x * view.tiles.y {
        return;
    }
    var low = 0u;
    var high = status[STATUS_INSTANCES];
    while low < high {
        let middle = (low + high) / 2u;
        if keys[middle] < tile {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    starts[tile] = low;
}
