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
            while (left != 0u && any(pixels.live)) {
                let k = 32u * word + firstTrailingBit(left);
                left &= left - 1u;
                draw(&pixels, batch + k, conic_opacities[k], center - means[k], batch_colors[k]);
            }
        }
        workgroupBarrier();
    }
    end(first, pixels);
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

const PARTS: u32 = 8u;

const PART_SIZE: vec2f = vec2f(8.0, 4.0);

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
    let alpha = quad_alpha(conic_opacity.w * exp(-power));
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

fn fetch(member: u32, slot: u32) -> Projected {
    let i = instance_splats[slot];
    let splat = projected[i];
    means[member] = splat.mean;
    conic_opacities[member] = splat.conic_opacity;
    batch_colors[member] = colors[i];
    return splat;
}

fn least_power(splat: Projected, low: vec2f, high: vec2f) -> f32 {
    let conic = splat.conic_opacity.xyz;
    let nearest = clamp(splat.mean, low, high) - splat.mean;
    if nearest.x == 0.0 && nearest.y == 0.0 {
        return 0.0;
    }
    let lower = low - splat.mean;
    let upper = high - splat.mean;
    let on_vertical = vec2f(nearest.x, clamp(-conic.y * nearest.x / conic.z, lower.y, upper.y));
    let on_horizontal = vec2f(clamp(-conic.y * nearest.y / conic.x, lower.x, upper.x), nearest.y);
    return min(power_at(conic, on_vertical), power_at(conic, on_horizontal));
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

fn pixel_of(quad: Quad, k: u32) -> Color {
    return vec3f(quad[0][k], quad[1][k], quad[2][k]);
}

fn power_at(conic: vec3f, d: vec2f) -> f32 {
    return 0.5 * (conic.x * d.x * d.x + conic.z * d.y * d.y) + conic.y * d.x * d.y;
}

fn power_cutoff(opacity: f32) -> f32 {
    return log(opacity / ALPHA_MIN);
}

fn powers(conic: vec3f, d: vec2f) -> vec4f {
    let dy = d.y + vec4f(0.0, 1.0, 2.0, 3.0);
    return 0.5 * (conic.x * d.x * d.x + conic.z * dy * dy) + conic.y * d.x * dy;
}

fn quad_alpha(raw: vec4f) -> vec4f {
    return min(vec4f(ALPHA_MAX), raw);
}

fn touches(splat: Projected, cutoff: f32, low: vec2f, high: vec2f) -> bool {
    return least_power(splat, low, high) <= cutoff;
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

var<workgroup> touching: array<atomic<u32>, 16>;

var<workgroup> uniform_drawing: u32;
