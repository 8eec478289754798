// Sums the gradient records of a Gaussian's instances in emission order, then
// turns the moments of dL/dpower into the gradients of center, conic and opacity:
// power = ½(A dx² + C dy²) + B dx dy with d = pixel - center, and alpha = opacity·exp(-power).
// With M the sums of dL/dpower times 1, dx, dy, dx², dx dy, dy²:
//     ∂center = −(A Mx + B My, B Mx + C My),  ∂A = ½Mxx,  ∂B = Mxy,  ∂C = ½Myy,  ∂o = −M1/o.
import package::common::constants::{ALPHA_MIN, STATUS_INSTANCES, STATUS_VISIBLE};
import package::common::numeric::linear_group;
import package::common::partials::{PARTIAL_STRIDE, PARTIAL_WORDS, PartialWord};
@if(half) import package::common::partials::unpacked;
@if(playcanvas) import package::common::partials::PARTIAL_OPACITY;
@if(geometry) import package::common::projected::Projected;

@group(0) @binding(0) var<storage, read> order: array<u32>;
@group(0) @binding(1) var<storage, read> offsets: array<u32>;
@group(0) @binding(2) var<storage, read> status: array<u32>;
@group(0) @binding(3) var<storage, read> partials: array<PartialWord>;
// `[N, PARTIAL_STRIDE]`, written for visible Gaussians only.
@group(0) @binding(4) var<storage, read_write> gradients: array<f32>;
@if(geometry) @group(0) @binding(5) var<storage, read> projected: array<Projected>;

// Records from which on they are loaded together; for fewer it is not worth a loop of its own.
const MANY: u32 = 32u;

// What a word of a record holds.
@if(!half) fn figures(at: u32) -> f32 { return partials[at]; }
@if(half) fn figures(at: u32) -> vec2f { return unpacked(partials[at]); }

@compute @workgroup_size(256)
fn sum_instances(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let rank = linear_group(group) * 256u + local;
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
    var slot = begin;
    // A Gaussian that covers the picture has thousands of records: the loads of four are under
    // way together, where waiting for each would be what takes time. The order stays.
    if end - begin >= MANY {
        for (; slot + 3u < end; slot += 4u) {
            for (var c = 0u; c < PARTIAL_WORDS; c++) {
                let at = slot * PARTIAL_WORDS + c;
                let first = figures(at);
                let second = figures(at + PARTIAL_WORDS);
                let third = figures(at + 2u * PARTIAL_WORDS);
                let fourth = figures(at + 3u * PARTIAL_WORDS);
                @if(!half) { sum[c] = sum[c] + first + second + third + fourth; }
                @if(half) {
                    sum[2u * c] = sum[2u * c] + first.x + second.x + third.x + fourth.x;
                    sum[2u * c + 1u] = sum[2u * c + 1u] + first.y + second.y + third.y + fourth.y;
                }
            }
        }
    }
    for (; slot < end; slot++) {
        for (var c = 0u; c < PARTIAL_WORDS; c++) {
            let one = figures(slot * PARTIAL_WORDS + c);
            @if(!half) { sum[c] += one; }
            @if(half) {
                sum[2u * c] += one.x;
                sum[2u * c + 1u] += one.y;
            }
        }
    }
    let i = order[rank];
    @if(geometry) {
        let q = projected[i].conic_opacity;
        let m = sum;
        sum[0] = -(q.x * m[1] + q.y * m[2]);
        sum[1] = -(q.y * m[1] + q.z * m[2]);
        sum[2] = 0.5 * m[3];
        sum[3] = m[4];
        sum[4] = 0.5 * m[5];
        // A Gaussian whose color is not finite has opacity 0 and no moments.
        @if(!playcanvas) sum[5] = -m[0] / max(q.w, ALPHA_MIN);
        @if(playcanvas) sum[5] = m[PARTIAL_OPACITY] / max(q.w, ALPHA_MIN);
    }
    for (var c = 0u; c < PARTIAL_STRIDE; c++) {
        gradients[i * PARTIAL_STRIDE + c] = sum[c];
    }
}
