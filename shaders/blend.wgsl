// Front-to-back blending. A workgroup draws a tile, a thread four pixels of a
// column; all threads read the same Gaussian at the same time, so nothing is staged.
import package::common::color::Color;
import package::common::constants::{TILE_SIDE, TRANSMITTANCE_MIN};
import package::common::numeric::linear_group;
import package::common::projected::{Projected, raw_alpha};
import package::common::quad::{Quad, contributes, pixel_of, powers, quad_alpha, weighted};
import package::common::view::View;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> slots: array<u32>;
@group(0) @binding(3) var<storage, read> instance_splats: array<u32>;
@group(0) @binding(4) var<storage, read> projected: array<Projected>;
@group(0) @binding(5) var<storage, read> colors: array<Color>;
@group(0) @binding(6) var<storage, read_write> image: array<Color>;
// Instances of the tile up to and including the last that this pixel used.
@group(0) @binding(7) var<storage, read_write> lasts: array<u32>;

@compute @workgroup_size(16, 4)
fn blend(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let tile = linear_group(group, groups);
    if tile >= view.tiles.x * view.tiles.y {
        return;
    }
    let first = vec2u(tile % view.tiles.x, tile / view.tiles.x) * TILE_SIDE + vec2u(local.x, local.y * 4u);
    let rows = first.y + vec4u(0u, 1u, 2u, 3u);
    let center = vec2f(first) + 0.5;
    let start = starts[tile];
    let end = starts[tile + 1u];
    var color = Quad();
    var transmittance = vec4f(1.0);
    var last = vec4u(0u);
    let inside = vec4<bool>(first.x < view.size.x) & (rows < vec4u(view.size.y));
    var live = inside;
    for (var k = start; k < end && any(live); k++) {
        let i = instance_splats[slots[k]];
        let mean = projected[i].mean;
        let conic_opacity = projected[i].conic_opacity;
        let power = powers(conic_opacity.xyz, center - mean);
        let alpha = quad_alpha(conic_opacity.w * exp(-power));
        let next = transmittance * (1.0 - alpha);
        let hit = contributes(power, alpha) & live;
        let open = next >= vec4f(TRANSMITTANCE_MIN);
        let used = hit & open;
        color += weighted(select(vec4f(0.0), alpha * transmittance, used), colors[i]);
        transmittance = select(transmittance, next, used);
        last = select(last, vec4u(k - start + 1u), used);
        live = live & (open | !hit);
    }
    for (var row = 0u; row < 4u; row++) {
        if inside[row] {
            let p = rows[row] * view.size.x + first.x;
            image[p] = pixel_of(color, row);
            lasts[p] = last[row];
        }
    }
}
