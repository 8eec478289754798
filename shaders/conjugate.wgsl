// Preconditioned conjugate gradients (Hestenes and Stiefel 1952) on arrays that stay on
// the device: no number is read back between the steps. Sums run in a fixed order.
//
// The matrix is AᵀWA + ridge; the caller makes `product` = AᵀWA · direction between
// `conjugate_direction` and `conjugate_product`.
//
// Unknowns may have floors. One that stands at its floor when a round begins, and would go
// below, is held there for the round; the others go where they like, and those that end
// below their floor are put onto it in the end (after Bertsekas 1982, projected Newton).
import package::common::numeric::linear_group;

struct ConjugateParameters {
    // Unknowns: `planes` times Gaussians.
    length: u32,
    splats: u32,
    blocks: u32,
    // Added to the matrix's diagonal: decides where the pictures do not.
    ridge: f32,
    // What a diagonal entry is of the sum of weights that `diagonal` holds.
    diagonal_scale: f32,
}

// Scalars that the steps share.
const RHO: u32 = 0u;
const ALPHA: u32 = 1u;
const BETA: u32 = 2u;

@group(0) @binding(0) var<uniform> parameters: ConjugateParameters;
@group(0) @binding(1) var<storage, read_write> unknowns: array<f32>;
// Minus the gradient, in the end b - Ax.
@group(0) @binding(2) var<storage, read_write> residual: array<f32>;
@group(0) @binding(3) var<storage, read_write> direction: array<f32>;
@group(0) @binding(4) var<storage, read> product: array<f32>;
// Sums of weights, planes of the constant harmonic: the first two `[2, N]`.
@group(0) @binding(5) var<storage, read> diagonal: array<f32>;
@group(0) @binding(6) var<storage, read_write> block_sums: array<f32>;
@group(0) @binding(7) var<storage, read_write> scalars: array<f32>;
// The least that each unknown may be.
@group(0) @binding(8) var<storage, read> floors: array<f32>;
// What residuals are multiplied by: 0 for the unknowns that are held.
@group(0) @binding(9) var<storage, read_write> preconditioner: array<f32>;

var<workgroup> sums: array<f32, 256>;

// The sum over the workgroup, valid in thread 0.
fn sum_of_group(local: u32, own: f32) -> f32 {
    sums[local] = own;
    workgroupBarrier();
    for (var half = 128u; half > 0u; half /= 2u) {
        if local < half {
            sums[local] += sums[local + half];
        }
        workgroupBarrier();
    }
    return sums[0];
}

// One over an estimate of the matrix's diagonal. Blend weights sum to at most one a pixel,
// so the sum of a Gaussian's weights bounds its row.
fn inverse_diagonal(k: u32) -> f32 {
    let n = parameters.splats;
    let of_channel = (k / n) % 2u * n + k % n;
    return 1.0 / (parameters.diagonal_scale * diagonal[of_channel] + parameters.ridge);
}

// Leaves the workgroup's sum for the kernel that adds up the blocks.
fn leave_sum(block: u32, local: u32, own: f32) {
    let sum = sum_of_group(local, own);
    if local == 0u && block < parameters.blocks {
        block_sums[block] = sum;
    }
}

// Turns a gradient into the residual of a fresh system, the ridge's part included, and
// begins with the preconditioned residual as the direction.
@compute @workgroup_size(256)
fn conjugate_begin(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group, groups);
    let k = block * 256u + local;
    var own = 0.0;
    if k < parameters.length {
        residual[k] = -residual[k] - parameters.ridge * unknowns[k];
        let held = unknowns[k] <= floors[k] && residual[k] <= 0.0;
        preconditioner[k] = select(inverse_diagonal(k), 0.0, held);
        let z = residual[k] * preconditioner[k];
        direction[k] = z;
        own = residual[k] * z;
    }
    leave_sum(block, local, own);
}

// Partial sums of direction · matrix · direction.
@compute @workgroup_size(256)
fn conjugate_product(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group, groups);
    let k = block * 256u + local;
    var own = 0.0;
    if k < parameters.length {
        own = direction[k] * (product[k] + parameters.ridge * direction[k]);
    }
    leave_sum(block, local, own);
}

// One step along the direction, and partial sums of the new residual's square.
@compute @workgroup_size(256)
fn conjugate_step(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group, groups);
    let k = block * 256u + local;
    var own = 0.0;
    if k < parameters.length {
        let alpha = scalars[ALPHA];
        unknowns[k] += alpha * direction[k];
        residual[k] -= alpha * (product[k] + parameters.ridge * direction[k]);
        own = residual[k] * (residual[k] * preconditioner[k]);
    }
    leave_sum(block, local, own);
}

// The next direction.
@compute @workgroup_size(256)
fn conjugate_direction(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group, groups) * 256u + local;
    if k < parameters.length {
        direction[k] = residual[k] * preconditioner[k] + scalars[BETA] * direction[k];
    }
}

// The end of a round.
@compute @workgroup_size(256)
fn conjugate_end(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group, groups) * 256u + local;
    if k < parameters.length {
        unknowns[k] = max(unknowns[k], floors[k]);
    }
}

fn total(local: u32) -> f32 {
    var own = 0.0;
    for (var block = local; block < parameters.blocks; block += 256u) {
        own += block_sums[block];
    }
    return sum_of_group(local, own);
}

// A ratio of sums of squares; 0 where nothing is left to do.
fn ratio(above: f32, below: f32) -> f32 {
    if below > 0.0 {
        return above / below;
    }
    return 0.0;
}

// After `conjugate_begin`.
@compute @workgroup_size(256)
fn conjugate_rho(@builtin(local_invocation_index) local: u32) {
    let sum = total(local);
    if local == 0u {
        scalars[RHO] = sum;
    }
}

// After `conjugate_product`: how far to go.
@compute @workgroup_size(256)
fn conjugate_alpha(@builtin(local_invocation_index) local: u32) {
    let sum = total(local);
    if local == 0u {
        scalars[ALPHA] = ratio(scalars[RHO], sum);
    }
}

// After `conjugate_step`: how much of the old direction to keep.
@compute @workgroup_size(256)
fn conjugate_beta(@builtin(local_invocation_index) local: u32) {
    let sum = total(local);
    if local == 0u {
        scalars[BETA] = ratio(sum, scalars[RHO]);
        scalars[RHO] = sum;
    }
}
