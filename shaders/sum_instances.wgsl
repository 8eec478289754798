// Sums the gradient records of a Gaussian's instances in emission order.
import package::common::constants::{STATUS_INSTANCES, STATUS_VISIBLE};
import package::common::numeric::linear_group;
import package::common::partials::PARTIAL_STRIDE;

@group(0) @binding(0) var<storage, read> order: array<u32>;
@group(0) @binding(1) var<storage, read> offsets: array<u32>;
@group(0) @binding(2) var<storage, read> status: array<u32>;
@group(0) @binding(3) var<storage, read> partials: array<f32>;
// `[N, PARTIAL_STRIDE]`, written for visible Gaussians only.
@group(0) @binding(4) var<storage, read_write> gradients: array<f32>;

@compute @workgroup_size(256)
fn sum_instances(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let rank = linear_group(group, groups) * 256u + local;
    if rank >= status[STATUS_VISIBLE] {
        return;
    }
    let instances = status[STATUS_INSTANCES];
    let begin = min(offsets[rank], instances);
    var end = instances;
    if rank + 1u < status[STATUS_VISIBLE] {
        end = min(offsets[rank + 1u], instances);
    }
    var sum: array<f32, PARTIAL_STRIDE>;
    for (var slot = begin; slot < end; slot++) {
        for (var c = 0u; c < PARTIAL_STRIDE; c++) {
            sum[c] += partials[slot * PARTIAL_STRIDE + c];
        }
    }
    let i = order[rank];
    for (var c = 0u; c < PARTIAL_STRIDE; c++) {
        gradients[i * PARTIAL_STRIDE + c] = sum[c];
    }
}
