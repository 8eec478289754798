@compute @workgroup_size(16, 4)
fn luma_loss(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32, @builtin(local_invocation_id) id: vec3u) {
    for (var task = local; task < HALO * 4u; task += 64u) {
        let row = task / 4u;
        let quad = (task % 4u) * 4u;
        let s = span(group, row, quad);
        var x = image_run(s);
        var y = photo_run(s);
        store(0u, row, quad, windowed(x));
        store(1u, row, quad, windowed(y));
        store(2u, row, quad, windowed(times(x, x)));
        store(3u, row, quad, windowed(times(y, y)));
        store(4u, row, quad, windowed(times(x, y)));
    }
    workgroupBarrier();
    let mu_x = column_sums(0u, id);
    let mu_y = column_sums(1u, id);
    let variance_x = column_sums(2u, id) - mu_x * mu_x;
    let variance_y = column_sums(3u, id) - mu_y * mu_y;
    let covariance = column_sums(4u, id) - mu_x * mu_y;
    let a = 2.0 * mu_x * mu_y + C1;
    let b = 2.0 * covariance + C2;
    let c = mu_x * mu_x + mu_y * mu_y + C1;
    let d = variance_x + variance_y + C2;
    let ssim = a * b / (c * d);
    let product = 2.0 * a / (c * d);
    let square = -ssim / d;
    let mean = 2.0 * mu_y * b / (c * d) - 2.0 * mu_x * ssim / c - mu_y * product - 2.0 * mu_x * square;
    let first = group.xy * SIDE + vec2u(id.x, id.y * 4u);
    var loss = 0.0;
    for (var k = 0u; k < 4u; k++) {
        let pixel = first + vec2u(0u, k);
        if all(pixel < view.size) {
            let p = pixel.y * view.size.x + pixel.x;
            let x = shown(p);
            let y = photo_at(p);
            {
                by_mean[p] = mean[k];
                by_square[p] = square[k];
                by_product[p] = product[k];
                loss += L1_WEIGHT * abs(x - y) + SSIM_WEIGHT * (1.0 - ssim[k]);
            }
        }
    }
    losses[local] = loss;
    workgroupBarrier();
    for (var half = 32u; half > 0u; half /= 2u) {
        if local < half {
            losses[local] += losses[local + half];
        }
        workgroupBarrier();
    }
    if local == 0u {
        block_losses[group.y * groups.x + group.x] = losses[0];
    }
}

@compute @workgroup_size(16, 4)
fn luma_loss_backward(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32, @builtin(local_invocation_id) id: vec3u) {
    for (var task = local; task < HALO * 4u; task += 64u) {
        let row = task / 4u;
        let quad = (task % 4u) * 4u;
        let s = span(group, row, quad);
        let a = slopes_quad(s, 0);
        let b = slopes_quad(s, 4);
        {
            store(0u, row, quad, windowed(Run(a[0], b[0])));
            store(1u, row, quad, windowed(Run(a[1], b[1])));
            store(2u, row, quad, windowed(Run(a[2], b[2])));
        }
    }
    workgroupBarrier();
    let mean = column_sums(0u, id);
    let square = column_sums(1u, id);
    let product = column_sums(2u, id);
    let pixels = f32(view.size.x * view.size.y);
    let first = group.xy * SIDE + vec2u(id.x, id.y * 4u);
    for (var k = 0u; k < 4u; k++) {
        let pixel = first + vec2u(0u, k);
        if all(pixel < view.size) {
            let p = pixel.y * view.size.x + pixel.x;
            let x = shown(p);
            let y = photo_at(p);
            {
                let ssim_gradient = mean[k] + 2.0 * x * square[k] + y * product[k];
                image_gradient[p] = slope(p) * (L1_WEIGHT * sign(x - y) - SSIM_WEIGHT * ssim_gradient) / pixels;
            }
        }
    }
}

@group(0) @binding(0)
var<uniform> view: View;

@group(0) @binding(1)
var<storage, read> image: array<f32>;

@group(0) @binding(2)
var<storage, read> photo: array<u32>;

@group(0) @binding(3)
var<storage, read_write> by_mean: array<f32>;

@group(0) @binding(4)
var<storage, read_write> by_square: array<f32>;

@group(0) @binding(5)
var<storage, read_write> by_product: array<f32>;

@group(0) @binding(6)
var<storage, read_write> block_losses: array<f32>;

@group(0) @binding(7)
var<storage, read_write> image_gradient: array<f32>;

const C1: f32 = 0.0001;

const C2: f32 = 0.0009;

const HALO: u32 = 16u + 2u * RADIUS;

const L1_WEIGHT: f32 = 0.8;

const RADIUS: u32 = 2u;

const SIDE: u32 = 16u;

const SSIM_WEIGHT: f32 = 0.2;

const WINDOW: array<f32, 3> = array<f32, 3>(0.12007838424321347, 0.2338807565853503, 0.29208171834287244);

fn column_quad(moment: u32, at: u32) -> vec4f {
    return vec4f(rows[moment][at], rows[moment][at + SIDE], rows[moment][at + 2u * SIDE], rows[moment][at + 3u * SIDE]);
}

fn column_sums(moment: u32, id: vec3u) -> vec4f {
    let at = id.y * 4u * SIDE + id.x;
    return windowed(Run(column_quad(moment, at), column_quad(moment, at + 4u * SIDE)));
}

fn has(s: Span, k: i32) -> vec4<bool> {
    let columns = s.column + k + vec4i(0, 1, 2, 3);
    return (columns >= vec4i(0)) & (columns < vec4i(i32(view.size.x))) & vec4<bool>(s.inside);
}

fn image_quad(s: Span, k: i32) -> vec4f {
    let p = indices(s, k);
    return select(vec4f(0.0), vec4f(shown(p.x), shown(p.y), shown(p.z), shown(p.w)), has(s, k));
}

fn image_run(s: Span) -> Run {
    return Run(image_quad(s, 0), image_quad(s, 4));
}

fn indices(s: Span, k: i32) -> vec4u {
    let columns = s.column + k + vec4i(0, 1, 2, 3);
    return s.row + vec4u(clamp(columns, vec4i(0), vec4i(i32(view.size.x) - 1)));
}

fn photo_at(p: u32) -> f32 {
    return f32((photo[p / 4u] >> (8u * (p % 4u))) & 255u) / 255.0;
}

fn photo_quad(s: Span, k: i32) -> vec4f {
    let p = indices(s, k);
    return select(vec4f(0.0), vec4f(photo_at(p.x), photo_at(p.y), photo_at(p.z), photo_at(p.w)), has(s, k));
}

fn photo_run(s: Span) -> Run {
    return Run(photo_quad(s, 0), photo_quad(s, 4));
}

fn shown(p: u32) -> f32 {
    return image[p];
}

fn slope(p: u32) -> f32 {
    return 1.0;
}

fn slopes_quad(s: Span, k: i32) -> mat3x4f {
    let p = indices(s, k);
    let known = has(s, k);
    return mat3x4f(select(vec4f(0.0), vec4f(by_mean[p.x], by_mean[p.y], by_mean[p.z], by_mean[p.w]), known), select(vec4f(0.0), vec4f(by_square[p.x], by_square[p.y], by_square[p.z], by_square[p.w]), known), select(vec4f(0.0), vec4f(by_product[p.x], by_product[p.y], by_product[p.z], by_product[p.w]), known));
}

fn span(group: vec3u, row: u32, quad: u32) -> Span {
    let at = vec2i(group.xy * SIDE + vec2u(quad, row)) - i32(RADIUS);
    let height = i32(view.size.y);
    return Span(u32(clamp(at.y, 0, height - 1)) * view.size.x, at.x, at.y >= 0 && at.y < height);
}

fn store(moment: u32, row: u32, quad: u32, sums: vec4f) {
    let at = row * SIDE + quad;
    rows[moment][at] = sums.x;
    rows[moment][at + 1u] = sums.y;
    rows[moment][at + 2u] = sums.z;
    rows[moment][at + 3u] = sums.w;
}

fn times(v: Run, w: Run) -> Run {
    return Run(v.a * w.a, v.b * w.b);
}

fn windowed(v: Run) -> vec4f {
    return WINDOW[0] * (v.a + v.b) + WINDOW[1] * (vec4f(v.a.yzw, v.b.x) + vec4f(v.a.w, v.b.xyz)) + WINDOW[2] * vec4f(v.a.zw, v.b.xy);
}

struct Run {
    a: vec4f,
    b: vec4f
}

struct Span {
    row: u32,
    column: i32,
    inside: bool
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

var<workgroup> losses: array<f32, 64>;

var<workgroup> rows: array<array<f32, HALO * SIDE>, 5>;
