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
        var live = any(left_0.live | left_1.live | left_2.live | left_3.live | right_0.live | right_1.live | right_2.live | right_3.live);
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
            live = any(left_0.live | left_1.live | left_2.live | left_3.live | right_0.live | right_1.live | right_2.live | right_3.live);
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

@group(0) @binding(0)
var<uniform> view: View;

@group(0) @binding(1)
var<storage, read> starts: array<u32>;

@group(0) @binding(2)
var<storage, read> slots: array<u32>;

@group(0) @binding(3)
var<storage, read> instance_splats: array<u32>;

@group(0) @binding(4)
var<storage, read> projected: array<Projected>;

@group(0) @binding(5)
var<storage, read> colors: array<Color>;

@group(0) @binding(6)
var<storage, read_write> image: array<Color>;

@group(0) @binding(7)
var<storage, read_write> lasts: array<u32>;

@group(0) @binding(8)
var<uniform> portion: Portion;

alias Color = vec3f;

alias Quad = mat3x4f;

const ALPHA_MAX: f32 = 0.99;

const BATCH: u32 = 64u;

const MAX_GROUPS: u32 = 65535u;

const RESCALE: f32 = 1.0186573603637743;

const TAIL: f32 = 0.01831563888873418;

const THREADS: u32 = 8u;

const TILE_SIDE: u32 = 16u;

fn begin(first: vec2u) -> Pixels {
    let rows = first.y + vec4u(0u, 1u, 2u, 3u);
    let inside = vec4<bool>(first.x < view.size.x) & (rows < vec4u(view.size.y));
    var pixels = Pixels();
    pixels.transmittance = vec4f(1.0);
    pixels.live = inside;
    return pixels;
}

fn contributes(power: vec4f, alpha: vec4f) -> vec4<bool> {
    return (power >= vec4f(0.0)) & (alpha >= vec4f(ALPHA_MIN));
}

fn draw(pixels: ptr<function, Pixels>, own: u32, conic_opacity: vec4f, d: vec2f, splat_color: Color) {
    let transmittance = (*pixels).transmittance;
    let power = powers(conic_opacity.xyz, d);
    let alpha = quad_alpha(conic_opacity.w * falloff(power));
    let next = transmittance * (1.0 - alpha);
    let hit = contributes(power, alpha) & (*pixels).live;
    let open = next >= vec4f(TRANSMITTANCE_MIN);
    let used = hit & open;
    {
        (*pixels).color += weighted(select(vec4f(0.0), alpha * transmittance, used), splat_color);
        (*pixels).last = select((*pixels).last, vec4u(own + 1u), used);
    }
    (*pixels).transmittance = select(transmittance, next, used);
    (*pixels).live = (*pixels).live & (open | !hit);
}

fn end(first: vec2u, pixels: Pixels) {
    for (var row = 0u; row < 4u; row++) {
        if all(first + vec2u(0u, row) < view.size) {
            let p = (first.y + row) * view.size.x + first.x;
            {
                image[p] = pixel_of(pixels.color, row);
                lasts[p] = pixels.last[row];
            }
        }
    }
}

fn falloff(power: vec4f) -> vec4f {
    return RESCALE * (exp(-power) - TAIL);
}

fn fetch(member: u32, slot: u32) -> Projected {
    let i = instance_splats[slot];
    let splat = projected[i];
    means[member] = splat.mean;
    conic_opacities[member] = splat.conic_opacity;
    batch_colors[member] = colors[i];
    return splat;
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

fn pixel_of(quad: Quad, k: u32) -> Color {
    return vec3f(quad[0][k], quad[1][k], quad[2][k]);
}

fn powers(conic: vec3f, d: vec2f) -> vec4f {
    let dy = d.y + vec4f(0.0, 1.0, 2.0, 3.0);
    return 0.5 * (conic.x * d.x * d.x + conic.z * dy * dy) + conic.y * d.x * dy;
}

fn quad_alpha(raw: vec4f) -> vec4f {
    return min(vec4f(ALPHA_MAX), raw);
}

fn weighted(weights: vec4f, color: Color) -> Quad {
    return Quad(weights * color.x, weights * color.y, weights * color.z);
}

override ALPHA_MIN: f32 = 0.00392156862745098;

override TRANSMITTANCE_MIN: f32 = 0.0001;

struct Pixels {
    color: Quad,
    transmittance: vec4f,
    last: vec4u,
    live: vec4<bool>
}

struct Portion {
    first: u32
}

struct Projected {
    mean: vec2f,
    extent: vec2f,
    conic_opacity: vec4f
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

var<workgroup> conic_opacities: array<vec4f, BATCH>;

var<workgroup> drawing: atomic<u32>;

var<workgroup> means: array<vec2f, BATCH>;

var<workgroup> uniform_drawing: u32;
