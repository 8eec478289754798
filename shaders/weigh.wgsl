// A picture times the weight of each of its pixels: the W of AᵀWA.
import package::common::numeric::linear_group;
import package::common::view::View;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> image: array<vec2f>;
@group(0) @binding(2) var<storage, read> weights: array<vec2f>;
@group(0) @binding(3) var<storage, read_write> weighted: array<vec2f>;

@compute @workgroup_size(256)
fn weigh(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let p = linear_group(group, groups) * 256u + local;
    if p < view.size.x * view.size.y {
        weighted[p] = weights[p] * image[p];
    }
}
