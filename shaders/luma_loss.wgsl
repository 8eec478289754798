// 0.8·L1 + 0.2·(1 - SSIM) over one channel, value and gradient, in two passes.
//
// SSIM after Wang et al. 2004 with the 11×11 Gaussian window of σ = 1.5 and
// zeros outside the image, as 3DGS trains. The first pass writes what the
// second one needs: the derivatives of each window's SSIM with respect to the
// window's mean, mean square and mean product.
import package::common::view::View;

const RADIUS: u32 = 5u;
const SIDE: u32 = 16u;
// A block with its halo.
const APRON: u32 = 26u;
const WINDOW: array<f32, 11> = array<f32, 11>(
    0.00102838008447911, 0.007598758135239185, 0.03600077212843083, 0.10936068950970002,
    0.2130055377112537, 0.26601172486179436, 0.2130055377112537, 0.10936068950970002,
    0.03600077212843083, 0.007598758135239185, 0.00102838008447911);
const C1: f32 = 0.0001;
const C2: f32 = 0.0009;
const L1_WEIGHT: f32 = 0.8;
const SSIM_WEIGHT: f32 = 0.2;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> image: array<f32>;
// Four 8-bit pixels to a word.
@group(0) @binding(2) var<storage, read> photo: array<u32>;
// Derivatives of a window's SSIM, by pixel; an array each, for three of an 8K
// image in one would not fit into the smallest binding limit (128 MiB).
@group(0) @binding(3) var<storage, read_write> by_mean: array<f32>;
@group(0) @binding(4) var<storage, read_write> by_square: array<f32>;
@group(0) @binding(5) var<storage, read_write> by_product: array<f32>;
@group(0) @binding(6) var<storage, read_write> block_losses: array<f32>;
@group(0) @binding(7) var<storage, read_write> image_gradient: array<f32>;

fn photo_at(p: u32) -> f32 {
    return f32((photo[p / 4u] >> (8u * (p % 4u))) & 255u) / 255.0;
}

var<workgroup> apron_image: array<f32, 676>;
var<workgroup> apron_photo: array<f32, 676>;
// Sums along rows: five moments in the first pass, three slopes in the second.
var<workgroup> rows: array<array<f32, 416>, 5>;
var<workgroup> losses: array<f32, 256>;

// Index into the image of a cell of the apron, or 0xffffffff outside.
fn apron_pixel(group: vec3u, cell: u32) -> u32 {
    let at = vec2i(group.xy * SIDE) + vec2i(vec2u(cell % APRON, cell / APRON)) - i32(RADIUS);
    if any(at < vec2i(0)) || any(at >= vec2i(view.size)) {
        return 0xffffffffu;
    }
    return u32(at.y) * view.size.x + u32(at.x);
}

@compute @workgroup_size(16, 16)
fn luma_loss(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32, @builtin(local_invocation_id) id: vec3u) {
    for (var cell = local; cell < APRON * APRON; cell += 256u) {
        let p = apron_pixel(group, cell);
        apron_image[cell] = 0.0;
        apron_photo[cell] = 0.0;
        if p != 0xffffffffu {
            apron_image[cell] = image[p];
            apron_photo[cell] = photo_at(p);
        }
    }
    workgroupBarrier();
    for (var cell = local; cell < SIDE * APRON; cell += 256u) {
        let first = (cell / SIDE) * APRON + cell % SIDE;
        var sums = array<f32, 5>();
        for (var k = 0u; k < 11u; k++) {
            let x = apron_image[first + k];
            let y = apron_photo[first + k];
            sums[0] += WINDOW[k] * x;
            sums[1] += WINDOW[k] * y;
            sums[2] += WINDOW[k] * x * x;
            sums[3] += WINDOW[k] * y * y;
            sums[4] += WINDOW[k] * x * y;
        }
        for (var m = 0u; m < 5u; m++) {
            rows[m][cell] = sums[m];
        }
    }
    workgroupBarrier();
    let pixel = group.xy * SIDE + id.xy;
    losses[local] = 0.0;
    if all(pixel < view.size) {
        var moments = array<f32, 5>();
        for (var k = 0u; k < 11u; k++) {
            let cell = (id.y + k) * SIDE + id.x;
            for (var m = 0u; m < 5u; m++) {
                moments[m] += WINDOW[k] * rows[m][cell];
            }
        }
        let mu_x = moments[0];
        let mu_y = moments[1];
        let variance_x = moments[2] - mu_x * mu_x;
        let variance_y = moments[3] - mu_y * mu_y;
        let covariance = moments[4] - mu_x * mu_y;
        let a = 2.0 * mu_x * mu_y + C1;
        let b = 2.0 * covariance + C2;
        // Both at least C1 and C2 but for rounding, so never zero.
        let c = mu_x * mu_x + mu_y * mu_y + C1;
        let d = variance_x + variance_y + C2;
        let ssim = a * b / (c * d);
        let product = 2.0 * a / (c * d);
        let square = -ssim / d;
        let p = pixel.y * view.size.x + pixel.x;
        by_mean[p] = 2.0 * mu_y * b / (c * d) - 2.0 * mu_x * ssim / c
            - mu_y * product - 2.0 * mu_x * square;
        by_square[p] = square;
        by_product[p] = product;
        let center = (id.y + RADIUS) * APRON + id.x + RADIUS;
        let difference = apron_image[center] - apron_photo[center];
        losses[local] = L1_WEIGHT * abs(difference) + SSIM_WEIGHT * (1.0 - ssim);
    }
    workgroupBarrier();
    for (var half = 128u; half > 0u; half /= 2u) {
        if local < half {
            losses[local] += losses[local + half];
        }
        workgroupBarrier();
    }
    if local == 0u {
        block_losses[group.y * groups.x + group.x] = losses[0];
    }
}

fn slope(plane: u32, p: u32) -> f32 {
    switch plane {
        case 0u: { return by_mean[p]; }
        case 1u: { return by_square[p]; }
        default: { return by_product[p]; }
    }
}

// One kind of slope, weighted and added up along rows.
fn row_sums(plane: u32, group: vec3u, local: u32) {
    for (var cell = local; cell < APRON * APRON; cell += 256u) {
        let p = apron_pixel(group, cell);
        apron_image[cell] = 0.0;
        if p != 0xffffffffu {
            apron_image[cell] = slope(plane, p);
        }
    }
    workgroupBarrier();
    for (var cell = local; cell < SIDE * APRON; cell += 256u) {
        let first = (cell / SIDE) * APRON + cell % SIDE;
        var sum = 0.0;
        for (var k = 0u; k < 11u; k++) {
            sum += WINDOW[k] * apron_image[first + k];
        }
        rows[plane][cell] = sum;
    }
    workgroupBarrier();
}

@compute @workgroup_size(16, 16)
fn luma_loss_backward(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32, @builtin(local_invocation_id) id: vec3u) {
    row_sums(0u, group, local);
    row_sums(1u, group, local);
    row_sums(2u, group, local);
    let pixel = group.xy * SIDE + id.xy;
    if any(pixel >= view.size) {
        return;
    }
    var sums = vec3f();
    for (var k = 0u; k < 11u; k++) {
        let cell = (id.y + k) * SIDE + id.x;
        sums += WINDOW[k] * vec3f(rows[0][cell], rows[1][cell], rows[2][cell]);
    }
    let p = pixel.y * view.size.x + pixel.x;
    let x = image[p];
    let y = photo_at(p);
    let ssim_gradient = sums.x + 2.0 * x * sums.y + y * sums.z;
    image_gradient[p] = (L1_WEIGHT * sign(x - y) - SSIM_WEIGHT * ssim_gradient) / f32(view.size.x * view.size.y);
}
