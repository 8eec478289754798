// The adjoint of `blend`, one lane a Gaussian instead of one thread a pixel.
//
// A workgroup takes a tile's list in buckets. In a bucket each lane owns one
// instance and walks over all pixels of the tile, one step behind the lane
// before it, so that a pixel meets the instances in depth order. The pixel's
// running state lies in workgroup memory; in any step no two lanes touch the
// same pixel. Each lane sums its own Gaussian's gradient in registers in a
// fixed order: no atomics, no reduction, the same bits every run.
//
// Transmittance is recomputed front to back, as `blend` computed it; nothing is
// recovered by dividing by 1 - alpha.
import package::common::color::{Color, color_dot};
import package::common::constants::{ALPHA_MAX, ALPHA_MIN, TILE_PIXELS, TILE_SIDE};
import package::common::numeric::linear_group;
import package::common::partials::{PARTIAL_COLOR, PARTIAL_STRIDE};
import package::common::projected::{Projected, power_at, raw_alpha};
import package::common::view::View;

const BUCKET: u32 = 32u;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> slots: array<u32>;
@group(0) @binding(3) var<storage, read> instance_splats: array<u32>;
@group(0) @binding(4) var<storage, read> projected: array<Projected>;
@group(0) @binding(5) var<storage, read> lasts: array<u32>;
// Gradient of the loss with respect to each pixel.
@group(0) @binding(6) var<storage, read> image_gradient: array<Color>;
// `[instances, PARTIAL_STRIDE]` by emission slot.
@group(0) @binding(7) var<storage, read_write> partials: array<f32>;
@if(geometry) @group(0) @binding(8) var<storage, read> colors: array<Color>;
@if(geometry) @group(0) @binding(9) var<storage, read> image: array<Color>;

var<workgroup> transmittance: array<f32, TILE_PIXELS>;
// Gradient times the colour that is still to come behind the lane at work.
@if(geometry) var<workgroup> remaining: array<f32, TILE_PIXELS>;
var<workgroup> gradient: array<Color, TILE_PIXELS>;
var<workgroup> pixel_last: array<u32, TILE_PIXELS>;
var<workgroup> tile_last: atomic<u32>;
var<workgroup> uniform_last: u32;

@compute @workgroup_size(BUCKET)
fn blend_backward(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let tile = linear_group(group, groups);
    if tile >= view.tiles.x * view.tiles.y {
        return;
    }
    let origin = vec2u(tile % view.tiles.x, tile / view.tiles.x) * TILE_SIDE;
    if lane == 0u {
        atomicStore(&tile_last, 0u);
    }
    workgroupBarrier();
    for (var k = lane; k < TILE_PIXELS; k += BUCKET) {
        let pixel = origin + vec2u(k % TILE_SIDE, k / TILE_SIDE);
        pixel_last[k] = 0u;
        if all(pixel < view.size) {
            let p = pixel.y * view.size.x + pixel.x;
            transmittance[k] = 1.0;
            gradient[k] = image_gradient[p];
            pixel_last[k] = lasts[p];
            atomicMax(&tile_last, lasts[p]);
            @if(geometry) { remaining[k] = color_dot(image_gradient[p], image[p]); }
        }
    }
    workgroupBarrier();
    if lane == 0u {
        uniform_last = atomicLoad(&tile_last);
    }
    let used = workgroupUniformLoad(&uniform_last);
    let start = starts[tile];
    for (var first = 0u; first < used; first += BUCKET) {
        let own = first + lane;
        let live = own < used;
        var slot = 0u;
        var mean = vec2f();
        var conic_opacity = vec4f();
        @if(geometry) var color = Color();
        if live {
            slot = slots[start + own];
            let i = instance_splats[slot];
            mean = projected[i].mean - vec2f(origin) - 0.5;
            conic_opacity = projected[i].conic_opacity;
            @if(geometry) { color = colors[i]; }
        }
        var v_color = Color();
        // Sums of dL/dpower times 1, dx, dy, dx², dx·dy, dy².
        @if(geometry) var moment0 = 0.0;
        @if(geometry) var moment1 = vec2f();
        @if(geometry) var moment2 = vec3f();
        for (var step = 0u; step < TILE_PIXELS + BUCKET - 1u; step++) {
            // Wraps around before the lane's first pixel: then it is out of range too.
            let k = step - lane;
            if live && k < TILE_PIXELS {
                if own < pixel_last[k] {
                    let d = vec2f(vec2u(k % TILE_SIDE, k / TILE_SIDE)) - mean;
                    let power = power_at(conic_opacity.xyz, d);
                    let raw = raw_alpha(conic_opacity.w, power);
                    let alpha = min(ALPHA_MAX, raw);
                    if power >= 0.0 && alpha >= ALPHA_MIN {
                        let before = transmittance[k];
                        let weight = alpha * before;
                        let g = gradient[k];
                        v_color += weight * g;
                        transmittance[k] = before * (1.0 - alpha);
                        @if(geometry) {
                            let shown = color_dot(g, color);
                            let behind = remaining[k] - weight * shown;
                            remaining[k] = behind;
                            if raw < ALPHA_MAX {
                                let v_alpha = before * shown - behind / (1.0 - alpha);
                                let v_power = -alpha * v_alpha;
                                moment0 += v_power;
                                moment1 += v_power * d;
                                moment2 += v_power * d.xxy * d.xyy;
                            }
                        }
                    }
                }
            }
            workgroupBarrier();
        }
        if live {
            let at = slot * PARTIAL_STRIDE;
            @if(geometry) {
                let conic = conic_opacity.xyz;
                partials[at] = -(conic.x * moment1.x + conic.y * moment1.y);
                partials[at + 1u] = -(conic.y * moment1.x + conic.z * moment1.y);
                partials[at + 2u] = 0.5 * moment2.x;
                partials[at + 3u] = moment2.y;
                partials[at + 4u] = 0.5 * moment2.z;
                // A Gaussian whose colour is not finite has opacity 0 and no moments.
                partials[at + 5u] = -moment0 / max(conic_opacity.w, ALPHA_MIN);
            }
            let c = at + PARTIAL_COLOR;
            @if(luma) { partials[c] = v_color; }
            @if(chroma) { partials[c] = v_color.x; partials[c + 1u] = v_color.y; }
            @if(rgb) { partials[c] = v_color.x; partials[c + 1u] = v_color.y; partials[c + 2u] = v_color.z; }
        }
    }
    // Instances behind the last one used have no gradient, and must say so.
    let count = starts[tile + 1u] - start;
    for (var own = used + lane; own < count; own += BUCKET) {
        let at = slots[start + own] * PARTIAL_STRIDE;
        for (var c = 0u; c < PARTIAL_STRIDE; c++) {
            partials[at + c] = 0.0;
        }
    }
}
