// Front-to-back blending, one thread a pixel, one workgroup a tile. All threads
// of a tile read the same Gaussian at the same time, so no staging is needed.
import package::common::color::Color;
import package::common::constants::{ALPHA_MAX, ALPHA_MIN, TILE_SIDE, TRANSMITTANCE_MIN};
import package::common::numeric::linear_group;
import package::common::projected::{Projected, power_at, raw_alpha};
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

@compute @workgroup_size(TILE_SIDE, TILE_SIDE)
fn blend(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let tile = linear_group(group, groups);
    if tile >= view.tiles.x * view.tiles.y {
        return;
    }
    let pixel = vec2u(tile % view.tiles.x, tile / view.tiles.x) * TILE_SIDE + local.xy;
    let center = vec2f(pixel) + 0.5;
    let start = starts[tile];
    let end = starts[tile + 1u];
    var color = Color();
    var transmittance = 1.0;
    var last = 0u;
    var live = all(pixel < view.size);
    for (var k = start; k < end && live; k++) {
        let i = instance_splats[slots[k]];
        let splat = projected[i];
        let power = power_at(splat.conic_opacity.xyz, center - splat.mean);
        let alpha = min(ALPHA_MAX, raw_alpha(splat.conic_opacity.w, power));
        if power >= 0.0 && alpha >= ALPHA_MIN {
            let next = transmittance * (1.0 - alpha);
            if next >= TRANSMITTANCE_MIN {
                color += alpha * transmittance * colors[i];
                transmittance = next;
                last = k - start + 1u;
            } else {
                live = false;
            }
        }
    }
    if all(pixel < view.size) {
        let p = pixel.y * view.size.x + pixel.x;
        image[p] = color;
        lasts[p] = last;
    }
}
