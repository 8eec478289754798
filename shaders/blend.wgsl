// Front-to-back blending. A workgroup draws a tile, a thread four pixels of a
// column. The Gaussians of the tile's list come in batches: each thread fetches
// one and notes which of the tile's eight parts (8 by 4 pixels, eight
// neighboring threads) it touches; then each part draws what touches it.
//
// With `simd` eight threads draw the tile, two columns each, as in `blend_backward`.
//
// With `depth` colors are depths, and the picture's are those of the Gaussians with which the
// transmittance falls to what is asked: a pixel begins at minus that, and where it is not
// reached ends at minus what is left to ask of Gaussians behind.
import package::common::color::Color;
import package::common::constants::{TILE_SIDE, TRANSMITTANCE_MIN};
import package::common::numeric::linear_group;
@if(playcanvas) import package::common::playcanvas::falloff;
import package::common::portion::Portion;
import package::common::projected::Projected;
@if(!simd) import package::common::projected::{power_cutoff, touches};
import package::common::quad::{Quad, contributes, powers, quad_alpha};
@if(!depth) import package::common::quad::{pixel_of, weighted};
import package::common::view::View;

const BATCH: u32 = 64u;
@if(!simd) const PARTS: u32 = 8u;
@if(!simd) const PART_SIZE: vec2f = vec2f(8.0, 4.0);
@if(simd) const THREADS: u32 = 8u;

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
@if(!simd) var<workgroup> touching: array<atomic<u32>, 16>;
// Threads that have a pixel left to draw.
var<workgroup> drawing: atomic<u32>;
var<workgroup> uniform_drawing: u32;

// Four pixels of a column.
struct Pixels {
    color: Quad,
    transmittance: vec4f,
    @if(!depth) last: vec4u,
    // Pixels that are drawn on.
    live: vec4<bool>,
}

fn begin(first: vec2u) -> Pixels {
    let rows = first.y + vec4u(0u, 1u, 2u, 3u);
    let inside = vec4<bool>(first.x < view.size.x) & (rows < vec4u(view.size.y));
    var pixels = Pixels();
    pixels.transmittance = vec4f(1.0);
    pixels.live = inside;
    @if(depth) {
        for (var row = 0u; row < 4u; row++) {
            if inside[row] {
                pixels.color[row] = image[rows[row] * view.size.x + first.x];
            }
        }
    }
    return pixels;
}

// Draws one instance, number `own` of the tile's list. `d` is the first pixel relative to its
// center.
fn draw(pixels: ptr<function, Pixels>, own: u32, conic_opacity: vec4f, d: vec2f, splat_color: Color) {
    let transmittance = (*pixels).transmittance;
    let power = powers(conic_opacity.xyz, d);
    @if(!playcanvas) let alpha = quad_alpha(conic_opacity.w * exp(-power));
    @if(playcanvas) let alpha = quad_alpha(conic_opacity.w * falloff(power));
    let next = transmittance * (1.0 - alpha);
    let hit = contributes(power, alpha) & (*pixels).live;
    let open = next >= vec4f(TRANSMITTANCE_MIN);
    let used = hit & open;
    @if(!depth) {
        (*pixels).color += weighted(select(vec4f(0.0), alpha * transmittance, used), splat_color);
        (*pixels).last = select((*pixels).last, vec4u(own + 1u), used);
    }
    @if(depth) {
        let color = (*pixels).color;
        (*pixels).color = select(color, vec4f(splat_color), used & (next <= -color));
    }
    (*pixels).transmittance = select(transmittance, next, used);
    (*pixels).live = (*pixels).live & (open | !hit);
}

fn end(first: vec2u, pixels: Pixels) {
    for (var row = 0u; row < 4u; row++) {
        if all(first + vec2u(0u, row) < view.size) {
            let p = (first.y + row) * view.size.x + first.x;
            @if(!depth) {
                image[p] = pixel_of(pixels.color, row);
                lasts[p] = pixels.last[row];
            }
            @if(depth) {
                let color = pixels.color[row];
                image[p] = select(color, color / pixels.transmittance[row], color < 0.0);
            }
        }
    }
}

// Fetches a member of the batch.
fn fetch(member: u32, slot: u32) -> Projected {
    let i = instance_splats[slot];
    let splat = projected[i];
    means[member] = splat.mean;
    conic_opacities[member] = splat.conic_opacity;
    batch_colors[member] = colors[i];
    return splat;
}

@if(!simd)
@compute @workgroup_size(16, 4)
fn blend(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u, @builtin(local_invocation_index) thread: u32) {
    let tile = portion.first + linear_group(group);
    if tile >= view.tiles.x * view.tiles.y {
        return;
    }
    let corner = vec2u(tile % view.tiles.x, tile / view.tiles.x) * TILE_SIDE;
    let first = corner + vec2u(local.x, local.y * 4u);
    let center = vec2f(first) + 0.5;
    let part = thread / 8u;
    let start = starts[tile];
    let count = starts[tile + 1u] - start;
    var pixels = begin(first);
    for (var batch = 0u; batch < count; batch += BATCH) {
        if thread < 2u * PARTS {
            atomicStore(&touching[thread], 0u);
        }
        if thread == 0u {
            atomicStore(&drawing, 0u);
        }
        workgroupBarrier();
        if batch + thread < count {
            let splat = fetch(thread, slots[start + batch + thread]);
            let cutoff = power_cutoff(splat.conic_opacity.w);
            for (var p = 0u; p < PARTS; p++) {
                let low = vec2f(corner) + 0.5 + vec2f(vec2u(p % 2u, p / 2u)) * PART_SIZE;
                if touches(splat, cutoff, low, low + PART_SIZE - 1.0) {
                    atomicOr(&touching[2u * p + thread / 32u], 1u << (thread % 32u));
                }
            }
        }
        if any(pixels.live) {
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
            while left != 0u && any(pixels.live) {
                let k = 32u * word + firstTrailingBit(left);
                left &= left - 1u;
                draw(&pixels, batch + k, conic_opacities[k], center - means[k], batch_colors[k]);
            }
        }
        workgroupBarrier();
    }
    end(first, pixels);
}

@if(simd)
@compute @workgroup_size(THREADS)
fn blend(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let tile = portion.first + linear_group(group);
    if tile >= view.tiles.x * view.tiles.y {
        return;
    }
    let left = vec2u(tile % view.tiles.x, tile / view.tiles.x) * TILE_SIDE + vec2u(thread, 0u);
    let right = left + vec2u(THREADS, 0u);
    let start = starts[tile];
    let count = starts[tile + 1u] - start;
    var left_0 = begin(left);
    var left_1 = begin(left + vec2u(0u, 4u));
    var left_2 = begin(left + vec2u(0u, 8u));
    var left_3 = begin(left + vec2u(0u, 12u));
    var right_0 = begin(right);
    var right_1 = begin(right + vec2u(0u, 4u));
    var right_2 = begin(right + vec2u(0u, 8u));
    var right_3 = begin(right + vec2u(0u, 12u));
    for (var batch = 0u; batch < count; batch += BATCH) {
        let members = min(BATCH, count - batch);
        if thread == 0u {
            atomicStore(&drawing, 0u);
        }
        workgroupBarrier();
        for (var k = thread; k < members; k += THREADS) {
            _ = fetch(k, slots[start + batch + k]);
        }
        var live = any(left_0.live | left_1.live | left_2.live | left_3.live
            | right_0.live | right_1.live | right_2.live | right_3.live);
        if live {
            atomicStore(&drawing, 1u);
        }
        workgroupBarrier();
        if thread == 0u {
            uniform_drawing = atomicLoad(&drawing);
        }
        if workgroupUniformLoad(&uniform_drawing) == 0u {
            break;
        }
        for (var k = 0u; k < members && live; k++) {
            let own = batch + k;
            let conic_opacity = conic_opacities[k];
            let color = batch_colors[k];
            let d = vec2f(left) + 0.5 - means[k];
            let e = d + vec2f(f32(THREADS), 0.0);
            draw(&left_0, own, conic_opacity, d, color);
            draw(&left_1, own, conic_opacity, d + vec2f(0.0, 4.0), color);
            draw(&left_2, own, conic_opacity, d + vec2f(0.0, 8.0), color);
            draw(&left_3, own, conic_opacity, d + vec2f(0.0, 12.0), color);
            draw(&right_0, own, conic_opacity, e, color);
            draw(&right_1, own, conic_opacity, e + vec2f(0.0, 4.0), color);
            draw(&right_2, own, conic_opacity, e + vec2f(0.0, 8.0), color);
            draw(&right_3, own, conic_opacity, e + vec2f(0.0, 12.0), color);
            live = any(left_0.live | left_1.live | left_2.live | left_3.live
                | right_0.live | right_1.live | right_2.live | right_3.live);
        }
        workgroupBarrier();
    }
    end(left, left_0);
    end(left + vec2u(0u, 4u), left_1);
    end(left + vec2u(0u, 8u), left_2);
    end(left + vec2u(0u, 12u), left_3);
    end(right, right_0);
    end(right + vec2u(0u, 4u), right_1);
    end(right + vec2u(0u, 8u), right_2);
    end(right + vec2u(0u, 12u), right_3);
}
