// Keys and values of the depth sort: the visible Gaussians in index order.
import package::common::constants::{STATUS_OVERFLOW, STATUS_VISIBLE};
import package::common::numeric::linear_group;
import package::common::view::View;

@group(0) @binding(0) var<uniform> view: View;
// Exclusive scan of the visibility flags.
@group(0) @binding(1) var<storage, read> positions: array<u32>;
@group(0) @binding(2) var<storage, read> depths: array<u32>;
@group(0) @binding(3) var<storage, read> status: array<u32>;
@group(0) @binding(4) var<storage, read_write> keys: array<u32>;
@group(0) @binding(5) var<storage, read_write> values: array<u32>;

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
