// The adjoint of `blend`: for each instance, the gradient with respect to its
// color and, where the geometry is trained, its center, conic and opacity.
//
// A workgroup takes a tile, a thread eight pixels of a column, as two quads. The
// Gaussians of the tile's list come in batches: threads fetch them and note which
// of the tile's four parts (8 by 8 pixels, eight neighboring threads) they touch.
// Each thread adds up its own pixels' share of a Gaussian that touches its part and
// leaves it in workgroup memory; then the threads add up the shares, one figure
// each, in a fixed order. No float atomics, no subgroups, the same bits every run.
//
// With `simd` eight threads, a vector register of a processor, take the whole tile, two
// columns each: on software devices every access to memory takes a lane at a time and
// costs more than the arithmetic of eight pixels, so that parts do not pay.
//
// Transmittance is recomputed front to back as `blend` computed it; nothing is
// recovered by dividing by 1 - alpha.
import package::common::color::Color;
@if(geometry) import package::common::color::color_dot;
import package::common::constants::{ALPHA_MAX, ALPHA_MIN, TILE_SIDE};
import package::common::numeric::linear_group;
import package::common::partials::{PARTIAL_STRIDE, PARTIAL_WORDS, PartialWord};
@if(half) import package::common::partials::packed;
@if(geometry) import package::common::partials::{PARTIAL_COLOR, PARTIAL_PULL};
@if(playcanvas) import package::common::partials::PARTIAL_OPACITY;
@if(playcanvas) import package::common::playcanvas::{RESCALE, falloff};
import package::common::portion::Portion;
import package::common::projected::Projected;
@if(!simd) import package::common::projected::{power_cutoff, touches};
import package::common::quad::{contributes, powers, quad_alpha};
@if(geometry) import package::common::quad::Quad;
import package::common::view::View;

// Four figures of four pixels, a column a pixel.
@if(figures) alias Quad = mat4x4f;

@if(!simd) const THREADS: u32 = 32u;
@if(!simd) const BATCH: u32 = 16u;
@if(simd) const THREADS: u32 = 8u;
@if(simd) const BATCH: u32 = 48u;
@if(!simd) const PARTS: u32 = 4u;
// Threads of a part, and pixels on its side.
const PART: u32 = 8u;
// A word more than there are figures, if these are even: neighboring threads
// write to different banks.
const SHARE: u32 = PARTIAL_STRIDE | 1u;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> slots: array<u32>;
@group(0) @binding(3) var<storage, read> instance_splats: array<u32>;
@group(0) @binding(4) var<storage, read> projected: array<Projected>;
@group(0) @binding(5) var<storage, read> lasts: array<u32>;
// Gradient of the loss with respect to each pixel, on frozen geometry its curvature too.
@group(0) @binding(6) var<storage, read> image_gradient: array<Color>;
// `[instances, PARTIAL_WORDS]` by emission slot.
@group(0) @binding(7) var<storage, read_write> partials: array<PartialWord>;
@if(geometry) @group(0) @binding(8) var<storage, read> colors: array<Color>;
@if(geometry) @group(0) @binding(9) var<storage, read> image: array<Color>;
@group(0) @binding(10) var<uniform> portion: Portion;

// Shares of one batch, `[instance, thread, figure]`. A figure is a sum over
// pixels: of dL/dpower times 1, dx, dy, dx², dx·dy, dy², of the pull, then of the
// weighted gradient, a channel each.
var<workgroup> shares: array<f32, BATCH * THREADS * SHARE>;
var<workgroup> means: array<vec2f, BATCH>;
var<workgroup> conic_opacities: array<vec4f, BATCH>;
@if(geometry) var<workgroup> batch_colors: array<Color, BATCH>;
// Where the gradient of an instance goes.
var<workgroup> batch_slots: array<u32, BATCH>;
// Parts that an instance touches, a bit each; instances that touch a part.
@if(!simd) var<workgroup> touched: array<u32, BATCH>;
@if(!simd) var<workgroup> touching: array<atomic<u32>, PARTS>;
// Instances of each part up to the last that one of its pixels used; of the tile.
@if(!simd) var<workgroup> part_lasts: array<atomic<u32>, PARTS>;
@if(simd) var<workgroup> tile_last: atomic<u32>;
var<workgroup> uniform_last: u32;

// One thread's share of one instance.
struct Share {
    // Sums of dL/dpower times 1, dx, dy, dx² and dx·dy, dy².
    @if(geometry) moments: vec4f,
    @if(geometry) moments_y: vec2f,
    // Sum of the lengths of the gradients with respect to the center.
    @if(geometry) pull: f32,
    // Sum of alpha times dL/dalpha.
    @if(playcanvas) opacity: f32,
    // Sum of the weighted gradient.
    color: Color,
}

struct Pixels {
    transmittance: vec4f,
    // Gradient times the color still to come, summed over the channels.
    @if(geometry) remaining: vec4f,
    gradient: Quad,
    last: vec4u,
}

// The gradient of four pixels, weighted and added up.
@if(luma) fn gathered(weight: vec4f, quad: Quad) -> Color { return dot(weight, quad); }
@if(rgb) fn gathered(weight: vec4f, quad: Quad) -> Color { return weight * quad; }
@if(figures) fn gathered(weight: vec4f, quad: Quad) -> Color { return quad * weight; }
@if(luma) fn insert(quad: Quad, k: u32, color: Color) -> Quad { var q = quad; q[k] = color; return q; }
@if(rgb) fn insert(quad: Quad, k: u32, color: Color) -> Quad {
    var q = quad;
    q[0][k] = color.x;
    q[1][k] = color.y;
    q[2][k] = color.z;
    return q;
}
@if(figures) fn insert(quad: Quad, k: u32, color: Color) -> Quad { var q = quad; q[k] = color; return q; }

fn load(first: vec2u) -> Pixels {
    var pixels = Pixels();
    pixels.transmittance = vec4f(1.0);
    for (var k = 0u; k < 4u; k++) {
        let at = first + vec2u(0u, k);
        if all(at < view.size) {
            let p = at.y * view.size.x + at.x;
            let gradient = image_gradient[p];
            pixels.gradient = insert(pixels.gradient, k, gradient);
            pixels.last[k] = lasts[p];
            @if(geometry) { pixels.remaining[k] = color_dot(gradient, image[p]); }
        }
    }
    return pixels;
}

// An instance of a batch.
struct Member {
    // Its place in the tile's list.
    own: u32,
    mean: vec2f,
    conic_opacity: vec4f,
    @if(geometry) color: Color,
}

fn member_at(member: u32, own: u32) -> Member {
    var found = Member();
    found.own = own;
    found.mean = means[member];
    found.conic_opacity = conic_opacities[member];
    @if(geometry) { found.color = batch_colors[member]; }
    return found;
}

// Adds one quad's share of an instance and moves the quad behind it. `d` is the
// first pixel relative to the Gaussian's center.
fn accumulate(share: ptr<function, Share>, pixels: ptr<function, Pixels>, member: Member, d: vec2f) {
    let conic_opacity = member.conic_opacity;
    let power = powers(conic_opacity.xyz, d);
    @if(!playcanvas) let raw = conic_opacity.w * exp(-power);
    @if(playcanvas) let raw = conic_opacity.w * falloff(power);
    let alpha = quad_alpha(raw);
    let before = (*pixels).transmittance;
    let hit = contributes(power, alpha) & (vec4u(member.own) < (*pixels).last);
    let weight = select(vec4f(0.0), alpha * before, hit);
    (*share).color += gathered(weight, (*pixels).gradient);
    (*pixels).transmittance = select(before, before * (1.0 - alpha), hit);
    @if(geometry) {
        let contribution = (*pixels).gradient * member.color;
        let behind = (*pixels).remaining - weight * contribution;
        (*pixels).remaining = behind;
        let v_alpha = before * contribution - behind / (1.0 - alpha);
        // The cap on alpha passes no gradient.
        @if(!playcanvas) let v_power = select(vec4f(0.0), -alpha * v_alpha, hit & (raw < vec4f(ALPHA_MAX)));
        @if(playcanvas) let v_raw = select(vec4f(0.0), v_alpha, hit & (raw < vec4f(ALPHA_MAX)));
        @if(playcanvas) let v_power = -conic_opacity.w * RESCALE * exp(-power) * v_raw;
        let rows = d.y + vec4f(0.0, 1.0, 2.0, 3.0);
        let sum = v_power.x + v_power.y + v_power.z + v_power.w;
        let sum_y = dot(v_power, rows);
        (*share).moments += vec4f(sum, sum * d.x, sum_y, sum * d.x * d.x);
        (*share).moments_y += vec2f(sum_y * d.x, dot(v_power, rows * rows));
        let to_ndc = 0.5 * vec2f(view.size);
        let slope_x = to_ndc.x * (conic_opacity.x * d.x + conic_opacity.y * rows);
        let slope_y = to_ndc.y * (conic_opacity.y * d.x + conic_opacity.z * rows);
        (*share).pull += dot(abs(v_power), sqrt(slope_x * slope_x + slope_y * slope_y));
        @if(playcanvas) { (*share).opacity += dot(alpha, v_raw); }
    }
}

// Instances up to the last that one of the pixels used.
fn last_of(pixels: Pixels) -> u32 {
    let last = pixels.last;
    return max(max(last.x, last.y), max(last.z, last.w));
}

// Fetches a member of the batch.
fn fetch(member: u32, slot: u32) -> Projected {
    let i = instance_splats[slot];
    let splat = projected[i];
    batch_slots[member] = slot;
    means[member] = splat.mean;
    conic_opacities[member] = splat.conic_opacity;
    @if(geometry) { batch_colors[member] = colors[i]; }
    return splat;
}

// Leaves a thread's share of a member.
fn leave(member: u32, thread: u32, share: Share) {
    let at = (member * THREADS + thread) * SHARE;
    @if(geometry) {
        shares[at] = share.moments.x;
        shares[at + 1u] = share.moments.y;
        shares[at + 2u] = share.moments.z;
        shares[at + 3u] = share.moments.w;
        shares[at + 4u] = share.moments_y.x;
        shares[at + 5u] = share.moments_y.y;
        shares[at + PARTIAL_PULL] = share.pull;
    }
    @if(luma) { shares[at + PARTIAL_COLOR] = share.color; }
    @if(rgb) {
        shares[at + PARTIAL_COLOR] = share.color.x;
        shares[at + PARTIAL_COLOR + 1u] = share.color.y;
        shares[at + PARTIAL_COLOR + 2u] = share.color.z;
    }
    @if(playcanvas) { shares[at + PARTIAL_OPACITY] = share.opacity; }
    @if(figures) {
        shares[at] = share.color.x;
        shares[at + 1u] = share.color.y;
        shares[at + 2u] = share.color.z;
        shares[at + 3u] = share.color.w;
    }
}

// One figure of a batch's member, the shares of all threads added up.
@if(!simd) fn figure_sum(member: u32, figure: u32) -> f32 {
    var parts = touched[member];
    var sum = 0.0;
    while parts != 0u {
        let at = (member * THREADS + firstTrailingBit(parts) * PART) * SHARE + figure;
        parts &= parts - 1u;
        for (var t = 0u; t < PART; t++) {
            sum += shares[at + t * SHARE];
        }
    }
    return sum;
}
@if(simd) fn figure_sum(member: u32, figure: u32) -> f32 {
    let at = member * THREADS * SHARE + figure;
    // No loop: llvmpipe ends a thread's loops after 65,535 iterations altogether.
    let first = shares[at] + shares[at + SHARE] + (shares[at + 2u * SHARE] + shares[at + 3u * SHARE]);
    let others = shares[at + 4u * SHARE] + shares[at + 5u * SHARE] + (shares[at + 6u * SHARE] + shares[at + 7u * SHARE]);
    return first + others;
}

// A word of the member's record.
@if(!half) fn record_word(member: u32, word: u32) -> f32 { return figure_sum(member, word); }
@if(half) fn record_word(member: u32, word: u32) -> u32 {
    return packed(figure_sum(member, 2u * word), figure_sum(member, 2u * word + 1u));
}

// Writes the records of a batch.
fn record(members: u32, thread: u32) {
    for (var task = thread; task < PARTIAL_WORDS * members; task += THREADS) {
        let member = task / PARTIAL_WORDS;
        let word = task % PARTIAL_WORDS;
        partials[batch_slots[member] * PARTIAL_WORDS + word] = record_word(member, word);
    }
}

// Instances from `used` on, behind the last one used, have no gradient, and must say so.
fn record_unused(tile: u32, used: u32, thread: u32) {
    let start = starts[tile];
    let count = starts[tile + 1u] - start;
    for (var own = used + thread; own < count; own += THREADS) {
        let at = slots[start + own] * PARTIAL_WORDS;
        for (var c = 0u; c < PARTIAL_WORDS; c++) {
            partials[at + c] = PartialWord();
        }
    }
}

@if(!simd)
@compute @workgroup_size(THREADS)
fn blend_backward(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let tile = portion.first + linear_group(group);
    if tile >= view.tiles.x * view.tiles.y {
        return;
    }
    let corner = vec2u(tile % view.tiles.x, tile / view.tiles.x) * TILE_SIDE;
    let first = corner + vec2u(thread % TILE_SIDE, (thread / TILE_SIDE) * PART);
    let part = thread / PART;
    var upper = load(first);
    var lower = load(first + vec2u(0u, 4u));
    if thread < PARTS {
        atomicStore(&part_lasts[thread], 0u);
    }
    workgroupBarrier();
    atomicMax(&part_lasts[part], max(last_of(upper), last_of(lower)));
    workgroupBarrier();
    if thread == 0u {
        uniform_last = max(max(atomicLoad(&part_lasts[0]), atomicLoad(&part_lasts[1])),
            max(atomicLoad(&part_lasts[2]), atomicLoad(&part_lasts[3])));
    }
    let used = workgroupUniformLoad(&uniform_last);
    let start = starts[tile];
    for (var batch = 0u; batch < used; batch += BATCH) {
        let members = min(BATCH, used - batch);
        if thread < PARTS {
            atomicStore(&touching[thread], 0u);
        }
        workgroupBarrier();
        if thread < members {
            let splat = fetch(thread, slots[start + batch + thread]);
            let cutoff = power_cutoff(splat.conic_opacity.w);
            var parts = 0u;
            for (var p = 0u; p < PARTS; p++) {
                let low = vec2f(corner + vec2u(p % 2u, p / 2u) * PART) + 0.5;
                if batch + thread < atomicLoad(&part_lasts[p]) && touches(splat, cutoff, low, low + f32(PART - 1u)) {
                    parts |= 1u << p;
                    atomicOr(&touching[p], 1u << thread);
                }
            }
            touched[thread] = parts;
        }
        workgroupBarrier();
        var left = atomicLoad(&touching[part]);
        while left != 0u {
            let member = firstTrailingBit(left);
            left &= left - 1u;
            let splat = member_at(member, batch + member);
            let d = vec2f(first) + 0.5 - splat.mean;
            var share = Share();
            accumulate(&share, &upper, splat, d);
            accumulate(&share, &lower, splat, d + vec2f(0.0, 4.0));
            leave(member, thread, share);
        }
        workgroupBarrier();
        record(members, thread);
        workgroupBarrier();
    }
    record_unused(tile, used, thread);
}

@if(simd)
@compute @workgroup_size(THREADS)
fn blend_backward(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let tile = portion.first + linear_group(group);
    if tile >= view.tiles.x * view.tiles.y {
        return;
    }
    let left = vec2u(tile % view.tiles.x, tile / view.tiles.x) * TILE_SIDE + vec2u(thread, 0u);
    let right = left + vec2u(PART, 0u);
    var left_0 = load(left);
    var left_1 = load(left + vec2u(0u, 4u));
    var left_2 = load(left + vec2u(0u, 8u));
    var left_3 = load(left + vec2u(0u, 12u));
    var right_0 = load(right);
    var right_1 = load(right + vec2u(0u, 4u));
    var right_2 = load(right + vec2u(0u, 8u));
    var right_3 = load(right + vec2u(0u, 12u));
    if thread == 0u {
        atomicStore(&tile_last, 0u);
    }
    workgroupBarrier();
    let left_last = max(max(last_of(left_0), last_of(left_1)), max(last_of(left_2), last_of(left_3)));
    let right_last = max(max(last_of(right_0), last_of(right_1)), max(last_of(right_2), last_of(right_3)));
    atomicMax(&tile_last, max(left_last, right_last));
    workgroupBarrier();
    if thread == 0u {
        uniform_last = atomicLoad(&tile_last);
    }
    let used = workgroupUniformLoad(&uniform_last);
    let start = starts[tile];
    for (var batch = 0u; batch < used; batch += BATCH) {
        let members = min(BATCH, used - batch);
        for (var member = thread; member < members; member += THREADS) {
            _ = fetch(member, slots[start + batch + member]);
        }
        workgroupBarrier();
        for (var member = 0u; member < members; member++) {
            let splat = member_at(member, batch + member);
            let d = vec2f(left) + 0.5 - splat.mean;
            let e = d + vec2f(f32(PART), 0.0);
            var share = Share();
            accumulate(&share, &left_0, splat, d);
            accumulate(&share, &left_1, splat, d + vec2f(0.0, 4.0));
            accumulate(&share, &left_2, splat, d + vec2f(0.0, 8.0));
            accumulate(&share, &left_3, splat, d + vec2f(0.0, 12.0));
            accumulate(&share, &right_0, splat, e);
            accumulate(&share, &right_1, splat, e + vec2f(0.0, 4.0));
            accumulate(&share, &right_2, splat, e + vec2f(0.0, 8.0));
            accumulate(&share, &right_3, splat, e + vec2f(0.0, 12.0));
            leave(member, thread, share);
        }
        workgroupBarrier();
        record(members, thread);
        workgroupBarrier();
    }
    record_unused(tile, used, thread);
}
