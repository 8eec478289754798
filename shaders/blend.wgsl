// Front-to-back blending. A workgroup draws a tile, a thread four pixels of a
// column. The Gaussians of the tile's list come in batches: each thread fetches
// one and notes which of the tile's eight parts (8 by 4 pixels, eight
// neighboring threads) it touches; then each part draws what touches it.
//
// With `depth` colors are depths, and the picture's are those of the Gaussians with which the
// transmittance falls to what is asked: a pixel begins at minus that, and where it is not
// reached ends at minus what is left to ask of Gaussians behind.
import package::common::color::Color;
import package::common::constants::{TILE_SIDE, TRANSMITTANCE_MIN};
import package::common::numeric::linear_group;
@if(playcanvas) import package::common::playcanvas::falloff;
import package::common::portion::Portion;
import package::common::projected::{Projected, power_cutoff, touches};
import package::common::quad::{Quad, contributes, powers, quad_alpha};
@if(!depth) import package::common::quad::{pixel_of, weighted};
import package::common::view::View;

const BATCH: u32 = 64u;
const PARTS: u32 = 8u;
const PART_SIZE: vec2f = vec2f(8.0, 4.0);

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> slots: array<u32>;
@group(0) @binding(3) var<storage, read> instance_splats: array<u32>;
@group(0) @binding(4) var<storage, read> projected: array<Projected>;
@group(0) @binding(5) var<storage, read> colors: array<Color>;
@group(0) @binding(6) var<storage, read_write> image: array<Color>;
// Instances of the tile up to and including the last that this pixel used.
@if(!depth) @group(0) @binding(7) var<storage, read_write> lasts: array<u32>;
@group(0) @binding(8) var<uniform> portion: Portion;

var<workgroup> means: array<vec2f, BATCH>;
var<workgroup> conic_opacities: array<vec4f, BATCH>;
var<workgroup> batch_colors: array<Color, BATCH>;
// Which of the batch touch a part: 32 a word, two words a part.
var<workgroup> touching: array<atomic<u32>, 16>;
// Threads that have a pixel left to draw.
var<workgroup> drawing: atomic<u32>;
var<workgroup> uniform_drawing: u32;

@compute @workgroup_size(16, 4)
fn blend(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u, @builtin(local_invocation_index) thread: u32) {
    let tile = portion.first + linear_group(group);
    if tile >= view.tiles.x * view.tiles.y {
        return;
    }
    let corner = vec2u(tile % view.tiles.x, tile / view.tiles.x) * TILE_SIDE;
    let first = corner + vec2u(local.x, local.y * 4u);
    let rows = first.y + vec4u(0u, 1u, 2u, 3u);
    let center = vec2f(first) + 0.5;
    let part = thread / 8u;
    let start = starts[tile];
    let count = starts[tile + 1u] - start;
    var color = Quad();
    var transmittance = vec4f(1.0);
    @if(!depth) var last = vec4u(0u);
    let inside = vec4<bool>(first.x < view.size.x) & (rows < vec4u(view.size.y));
    @if(depth) {
        for (var row = 0u; row < 4u; row++) {
            if inside[row] {
                color[row] = image[rows[row] * view.size.x + first.x];
            }
        }
    }
    var live = inside;
    for (var batch = 0u; batch < count; batch += BATCH) {
        if thread < 2u * PARTS {
            atomicStore(&touching[thread], 0u);
        }
        if thread == 0u {
            atomicStore(&drawing, 0u);
        }
        workgroupBarrier();
        if batch + thread < count {
            let i = instance_splats[slots[start + batch + thread]];
            let splat = projected[i];
            means[thread] = splat.mean;
            conic_opacities[thread] = splat.conic_opacity;
            batch_colors[thread] = colors[i];
            let cutoff = power_cutoff(splat.conic_opacity.w);
            for (var p = 0u; p < PARTS; p++) {
                let low = vec2f(corner) + 0.5 + vec2f(vec2u(p % 2u, p / 2u)) * PART_SIZE;
                if touches(splat, cutoff, low, low + PART_SIZE - 1.0) {
                    atomicOr(&touching[2u * p + thread / 32u], 1u << (thread % 32u));
                }
            }
        }
        if any(live) {
            atomicStore(&drawing, 1u);
        }
        workgroupBarrier();
        if thread == 0u {
            uniform_drawing = atomicLoad(&drawing);
        }
        if workgroupUniformLoad(&uniform_drawing) == 0u {
            break;
        }
        for (var word = 0u; word < 2u; word++) {
            var left = atomicLoad(&touching[2u * part + word]);
            while left != 0u && any(live) {
                let k = 32u * word + firstTrailingBit(left);
                left &= left - 1u;
                let power = powers(conic_opacities[k].xyz, center - means[k]);
                @if(!playcanvas) let alpha = quad_alpha(conic_opacities[k].w * exp(-power));
                @if(playcanvas) let alpha = quad_alpha(conic_opacities[k].w * falloff(power));
                let next = transmittance * (1.0 - alpha);
                let hit = contributes(power, alpha) & live;
                let open = next >= vec4f(TRANSMITTANCE_MIN);
                let used = hit & open;
                @if(!depth) {
                    color += weighted(select(vec4f(0.0), alpha * transmittance, used), batch_colors[k]);
                    last = select(last, vec4u(batch + k + 1u), used);
                }
                @if(depth) {
                    color = select(color, vec4f(batch_colors[k]), used & (next <= -color));
                }
                transmittance = select(transmittance, next, used);
                live = live & (open | !hit);
            }
        }
        workgroupBarrier();
    }
    for (var row = 0u; row < 4u; row++) {
        if inside[row] {
            let p = rows[row] * view.size.x + first.x;
            @if(!depth) {
                image[p] = pixel_of(color, row);
                lasts[p] = last[row];
            }
            @if(depth) {
                image[p] = select(color[row], color[row] / transmittance[row], color[row] < 0.0);
            }
        }
    }
}
