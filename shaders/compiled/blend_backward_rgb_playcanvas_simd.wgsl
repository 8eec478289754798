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

@group(0) @binding(0)
var<uniform> view: View;

@group(0) @binding(1)
var<storage, read> starts: array<u32>;

@group(0) @binding(10)
var<uniform> portion: Portion;

@group(0) @binding(2)
var<storage, read> slots: array<u32>;

@group(0) @binding(3)
var<storage, read> instance_splats: array<u32>;

@group(0) @binding(4)
var<storage, read> projected: array<Projected>;

@group(0) @binding(5)
var<storage, read> lasts: array<u32>;

@group(0) @binding(6)
var<storage, read> image_gradient: array<Color>;

@group(0) @binding(7)
var<storage, read_write> partials: array<PartialWord>;

@group(0) @binding(8)
var<storage, read> colors: array<Color>;

@group(0) @binding(9)
var<storage, read> image: array<Color>;

alias Color = vec3f;

alias PartialWord = f32;

alias Quad = mat3x4f;

const ALPHA_MAX: f32 = 0.99;

const BATCH: u32 = 48u;

const CHANNELS: u32 = 3u;

const MAX_GROUPS: u32 = 65535u;

const PART: u32 = 8u;

const PARTIAL_COLOR: u32 = 7u;

const PARTIAL_OPACITY: u32 = PARTIAL_COLOR + CHANNELS;

const PARTIAL_PULL: u32 = 6u;

const PARTIAL_STRIDE: u32 = PARTIAL_OPACITY + 1u;

const PARTIAL_WORDS: u32 = PARTIAL_STRIDE;

const RESCALE: f32 = 1.0186573603637743;

const SHARE: u32 = PARTIAL_STRIDE | 1u;

const TAIL: f32 = 0.01831563888873418;

const THREADS: u32 = 8u;

const TILE_SIDE: u32 = 16u;

fn accumulate(share: ptr<function, Share>, pixels: ptr<function, Pixels>, member: Member, d: vec2f) {
    let conic_opacity = member.conic_opacity;
    let power = powers(conic_opacity.xyz, d);
    let raw = conic_opacity.w * falloff(power);
    let alpha = quad_alpha(raw);
    let before = (*pixels).transmittance;
    let hit = contributes(power, alpha) & (vec4u(member.own) < (*pixels).last);
    let weight = select(vec4f(0.0), alpha * before, hit);
    (*share).color += gathered(weight, (*pixels).gradient);
    (*pixels).transmittance = select(before, before * (1.0 - alpha), hit);
    {
        let contribution = (*pixels).gradient * member.color;
        let behind = (*pixels).remaining - weight * contribution;
        (*pixels).remaining = behind;
        let v_alpha = before * contribution - behind / (1.0 - alpha);
        let v_raw = select(vec4f(0.0), v_alpha, hit & (raw < vec4f(ALPHA_MAX)));
        let v_power = -conic_opacity.w * RESCALE * exp(-power) * v_raw;
        let rows = d.y + vec4f(0.0, 1.0, 2.0, 3.0);
        let sum = v_power.x + v_power.y + v_power.z + v_power.w;
        let sum_y = dot(v_power, rows);
        (*share).moments += vec4f(sum, sum * d.x, sum_y, sum * d.x * d.x);
        (*share).moments_y += vec2f(sum_y * d.x, dot(v_power, rows * rows));
        let to_ndc = 0.5 * vec2f(view.size);
        let slope_x = to_ndc.x * (conic_opacity.x * d.x + conic_opacity.y * rows);
        let slope_y = to_ndc.y * (conic_opacity.y * d.x + conic_opacity.z * rows);
        (*share).pull += dot(abs(v_power), sqrt(slope_x * slope_x + slope_y * slope_y));
        {
            (*share).opacity += dot(alpha, v_raw);
        }
    }
}

fn color_dot(a: Color, b: Color) -> f32 {
    return dot(a, b);
}

fn contributes(power: vec4f, alpha: vec4f) -> vec4<bool> {
    return (power >= vec4f(0.0)) & (alpha >= vec4f(ALPHA_MIN));
}

fn falloff(power: vec4f) -> vec4f {
    return RESCALE * (exp(-power) - TAIL);
}

fn fetch(member: u32, slot: u32) -> Projected {
    let i = instance_splats[slot];
    let splat = projected[i];
    batch_slots[member] = slot;
    means[member] = splat.mean;
    conic_opacities[member] = splat.conic_opacity;
    {
        batch_colors[member] = colors[i];
    }
    return splat;
}

fn figure_sum(member: u32, figure: u32) -> f32 {
    let at = member * THREADS * SHARE + figure;
    let first = shares[at] + shares[at + SHARE] + (shares[at + 2u * SHARE] + shares[at + 3u * SHARE]);
    let others = shares[at + 4u * SHARE] + shares[at + 5u * SHARE] + (shares[at + 6u * SHARE] + shares[at + 7u * SHARE]);
    return first + others;
}

fn gathered(weight: vec4f, quad: Quad) -> Color {
    return weight * quad;
}

fn insert(quad: Quad, k: u32, color: Color) -> Quad {
    var q = quad;
    q[0][k] = color.x;
    q[1][k] = color.y;
    q[2][k] = color.z;
    return q;
}

fn last_of(pixels: Pixels) -> u32 {
    let last = pixels.last;
    return max(max(last.x, last.y), max(last.z, last.w));
}

fn leave(member: u32, thread: u32, share: Share) {
    let at = (member * THREADS + thread) * SHARE;
    {
        shares[at] = share.moments.x;
        shares[at + 1u] = share.moments.y;
        shares[at + 2u] = share.moments.z;
        shares[at + 3u] = share.moments.w;
        shares[at + 4u] = share.moments_y.x;
        shares[at + 5u] = share.moments_y.y;
        shares[at + PARTIAL_PULL] = share.pull;
    }
    {
        shares[at + PARTIAL_COLOR] = share.color.x;
        shares[at + PARTIAL_COLOR + 1u] = share.color.y;
        shares[at + PARTIAL_COLOR + 2u] = share.color.z;
    }
    {
        shares[at + PARTIAL_OPACITY] = share.opacity;
    }
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

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
            {
                pixels.remaining[k] = color_dot(gradient, image[p]);
            }
        }
    }
    return pixels;
}

fn member_at(member: u32, own: u32) -> Member {
    var found = Member();
    found.own = own;
    found.mean = means[member];
    found.conic_opacity = conic_opacities[member];
    {
        found.color = batch_colors[member];
    }
    return found;
}

fn powers(conic: vec3f, d: vec2f) -> vec4f {
    let dy = d.y + vec4f(0.0, 1.0, 2.0, 3.0);
    return 0.5 * (conic.x * d.x * d.x + conic.z * dy * dy) + conic.y * d.x * dy;
}

fn quad_alpha(raw: vec4f) -> vec4f {
    return min(vec4f(ALPHA_MAX), raw);
}

fn record(members: u32, thread: u32) {
    for (var task = thread; task < PARTIAL_WORDS * members; task += THREADS) {
        let member = task / PARTIAL_WORDS;
        let word = task % PARTIAL_WORDS;
        partials[batch_slots[member] * PARTIAL_WORDS + word] = record_word(member, word);
    }
}

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

fn record_word(member: u32, word: u32) -> f32 {
    return figure_sum(member, word);
}

override ALPHA_MIN: f32 = 0.00392156862745098;

struct Member {
    own: u32,
    mean: vec2f,
    conic_opacity: vec4f,
    color: Color
}

struct Pixels {
    transmittance: vec4f,
    remaining: vec4f,
    gradient: Quad,
    last: vec4u
}

struct Portion {
    first: u32
}

struct Projected {
    mean: vec2f,
    extent: vec2f,
    conic_opacity: vec4f
}

struct Share {
    moments: vec4f,
    moments_y: vec2f,
    pull: f32,
    opacity: f32,
    color: Color
}

struct View {
    row0: vec4f,
    row1: vec4f,
    row2: vec4f,
    center_near: vec4f,
    intrinsics: vec4f,
    slope_limits: vec4f,
    size: vec2u,
    tiles: vec2u,
    splat_count: u32,
    sh_degree: u32,
    instance_capacity: u32,
    padding: u32
}

var<workgroup> batch_colors: array<Color, BATCH>;

var<workgroup> batch_slots: array<u32, BATCH>;

var<workgroup> conic_opacities: array<vec4f, BATCH>;

var<workgroup> means: array<vec2f, BATCH>;

var<workgroup> shares: array<f32, BATCH * THREADS * SHARE>;

var<workgroup> tile_last: atomic<u32>;

var<workgroup> uniform_last: u32;
