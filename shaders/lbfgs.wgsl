// L-BFGS (Nocedal 1980; Nocedal and Wright 2006, algorithm 7.4) on arrays that stay on the
// device: no number is read back between the steps. Sums run in a fixed order.
//
// There is no line search. A step that raised the loss is undone, what is remembered is
// forgotten, and the step of the majorizer is taken instead: the quadratic that touches the
// loss from above, its matrix AᵀWA replaced by row sums, which bound it.
//
// Unknowns may have floors. One that stands at its floor, and would go below, is held there;
// the others are put onto theirs if they go below (after Bertsekas 1982, projected Newton).
import package::common::numeric::linear_group;

struct LbfgsParameters {
    // Unknowns: `planes` times Gaussians.
    length: u32,
    splats: u32,
    // Planes of `diagonal`.
    diagonals: u32,
    blocks: u32,
    // Added to the matrix's diagonal: decides where the pictures do not.
    ridge: f32,
    // What a diagonal entry is of the sum of weights that `diagonal` holds.
    diagonal_scale: f32,
}

// Pairs of displacements and changes of the gradient that are remembered.
const MEMORY: u32 = 5u;
// Scalars that the steps share. The loss at the accepted point, UNKNOWN before the first.
const LOSS: u32 = 0u;
// 1 where the present point is accepted.
const ACCEPTED: u32 = 1u;
// 1 where there is an accepted point before it.
const PAIRED: u32 = 2u;
// Displacement · change of the newest pair.
const CURVATURE: u32 = 3u;
// What the inverse of the majorizer's diagonal is multiplied by.
const SCALE: u32 = 4u;
// What `lbfgs_add` multiplies by.
const FACTOR: u32 = 5u;
// For each pair: one over displacement · change, 0 where it does not count.
const RHO: u32 = 6u;
const ALPHA: u32 = RHO + MEMORY;

const UNKNOWN: f32 = 3.4028235e38;

// A loss may rise by this share: the views' corrections, which it is measured with, move
// from step to step.
const TOLERANCE: f32 = 1e-4;

// The scale is at least 1 where the loss is convex. Steps shorter than this share of the
// majorizer's come from pairs that say nothing.
const LEAST_SCALE: f32 = 1e-3;

@group(0) @binding(0) var<uniform> parameters: LbfgsParameters;
// Which pair a step is about.
@group(0) @binding(1) var<uniform> pair: u32;
@group(0) @binding(2) var<storage, read_write> unknowns: array<f32>;
@group(0) @binding(3) var<storage, read_write> gradient: array<f32>;
// Sums of weights, `[diagonals, N]`: a plane for each channel, or one for all.
@group(0) @binding(4) var<storage, read> diagonal: array<f32>;
// The least that each unknown may be.
@group(0) @binding(5) var<storage, read> floors: array<f32>;
// The losses whose sum is minimized.
@group(0) @binding(6) var<storage, read> losses: array<f32>;
// The accepted point, and the gradient there.
@group(0) @binding(7) var<storage, read_write> accepted_unknowns: array<f32>;
@group(0) @binding(8) var<storage, read_write> accepted_gradient: array<f32>;
// Inverse of the majorizer's diagonal there; 0 for the unknowns that are held.
@group(0) @binding(9) var<storage, read_write> preconditioner: array<f32>;
// Becomes the step.
@group(0) @binding(10) var<storage, read_write> direction: array<f32>;
// Of one pair.
@group(0) @binding(11) var<storage, read_write> displacement: array<f32>;
@group(0) @binding(12) var<storage, read_write> change: array<f32>;
@group(0) @binding(13) var<storage, read_write> block_sums: array<f32>;
@group(0) @binding(14) var<storage, read_write> scalars: array<f32>;
// Any of the arrays above.
@group(0) @binding(15) var<storage, read> left: array<f32>;
@group(0) @binding(16) var<storage, read> right: array<f32>;
// What the ridge draws the unknowns to.
@group(0) @binding(17) var<storage, read> origin: array<f32>;

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

// Leaves the workgroup's sum for the kernel that adds up the blocks.
fn leave_sum(block: u32, local: u32, own: f32) {
    let sum = sum_of_group(local, own);
    if local == 0u && block < parameters.blocks {
        block_sums[block] = sum;
    }
}

// The sum of what the blocks left, valid in thread 0.
fn total(local: u32) -> f32 {
    var own = 0.0;
    for (var block = local; block < parameters.blocks; block += 256u) {
        own += block_sums[block];
    }
    return sum_of_group(local, own);
}

// One over the majorizer's diagonal. Blend weights sum to at most one a pixel, so the sum
// of a Gaussian's weights bounds its row.
fn inverse_diagonal(k: u32) -> f32 {
    let n = parameters.splats;
    let of_channel = (k / n) % parameters.diagonals * n + k % n;
    return 1.0 / (parameters.diagonal_scale * diagonal[of_channel] + parameters.ridge);
}

// The ridge's part of the gradient, and partial sums of its part of the loss.
@compute @workgroup_size(256)
fn lbfgs_ridge(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group, groups);
    let k = block * 256u + local;
    var own = 0.0;
    if k < parameters.length {
        let off = unknowns[k] - origin[k];
        gradient[k] += parameters.ridge * off;
        own = 0.5 * parameters.ridge * off * off;
    }
    leave_sum(block, local, own);
}

// After `lbfgs_ridge`: whether the last step was a good one.
@compute @workgroup_size(256)
fn lbfgs_judge(@builtin(local_invocation_index) local: u32) {
    let of_ridge = total(local);
    workgroupBarrier();
    var own = 0.0;
    for (var i = local; i < arrayLength(&losses); i += 256u) {
        own += losses[i];
    }
    let loss = sum_of_group(local, own) + of_ridge;
    if local != 0u {
        return;
    }
    let first = scalars[LOSS] == UNKNOWN;
    let accepted = first || loss <= scalars[LOSS] * (1.0 + TOLERANCE);
    scalars[ACCEPTED] = select(0.0, 1.0, accepted);
    scalars[PAIRED] = select(0.0, 1.0, accepted && !first);
    scalars[LOSS] = select(UNKNOWN, loss, accepted);
    if first || !accepted {
        scalars[SCALE] = 1.0;
        for (var i = 0u; i < MEMORY; i++) {
            scalars[RHO + i] = 0.0;
        }
    }
}

// Keeps an accepted point and how it differs from the one before; goes back to that from
// any other.
@compute @workgroup_size(256)
fn lbfgs_pair(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group, groups) * 256u + local;
    if k >= parameters.length {
        return;
    }
    if scalars[ACCEPTED] == 0.0 {
        unknowns[k] = accepted_unknowns[k];
        gradient[k] = accepted_gradient[k];
        return;
    }
    displacement[k] = unknowns[k] - accepted_unknowns[k];
    change[k] = gradient[k] - accepted_gradient[k];
    accepted_unknowns[k] = unknowns[k];
    accepted_gradient[k] = gradient[k];
}

// What is held, and the gradient of the rest as the direction to begin with.
@compute @workgroup_size(256)
fn lbfgs_begin(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group, groups) * 256u + local;
    if k >= parameters.length {
        return;
    }
    if scalars[ACCEPTED] > 0.0 {
        let held = unknowns[k] <= floors[k] && gradient[k] >= 0.0;
        preconditioner[k] = select(inverse_diagonal(k), 0.0, held);
    }
    direction[k] = select(0.0, gradient[k], preconditioner[k] > 0.0);
}

// Partial sums of a scalar product.
@compute @workgroup_size(256)
fn lbfgs_dot(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group, groups);
    let k = block * 256u + local;
    var own = 0.0;
    if k < parameters.length {
        own = left[k] * right[k];
    }
    leave_sum(block, local, own);
}

// After `lbfgs_dot` of the newest displacement and change.
@compute @workgroup_size(256)
fn lbfgs_curvature(@builtin(local_invocation_index) local: u32) {
    let sum = total(local);
    if local == 0u {
        scalars[CURVATURE] = sum;
    }
}

// Partial sums of change · inverse diagonal · change.
@compute @workgroup_size(256)
fn lbfgs_spread(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group, groups);
    let k = block * 256u + local;
    var own = 0.0;
    if k < parameters.length {
        own = change[k] * preconditioner[k] * change[k];
    }
    leave_sum(block, local, own);
}

// After `lbfgs_spread`: whether the new pair counts, and how long steps are.
@compute @workgroup_size(256)
fn lbfgs_scale(@builtin(local_invocation_index) local: u32) {
    let sum = total(local);
    if local != 0u {
        return;
    }
    let curvature = scalars[CURVATURE];
    let counts = scalars[PAIRED] > 0.0 && sum > 0.0 && curvature > LEAST_SCALE * sum;
    scalars[RHO + pair] = 0.0;
    if counts {
        scalars[RHO + pair] = 1.0 / curvature;
        scalars[SCALE] = curvature / sum;
    }
}

// After `lbfgs_dot` of displacement and direction, newest pair first: the change is to be added.
@compute @workgroup_size(256)
fn lbfgs_alpha(@builtin(local_invocation_index) local: u32) {
    let sum = total(local);
    if local == 0u {
        scalars[ALPHA + pair] = scalars[RHO + pair] * sum;
        scalars[FACTOR] = -scalars[ALPHA + pair];
    }
}

// After `lbfgs_alpha` or `lbfgs_beta`.
@compute @workgroup_size(256)
fn lbfgs_add(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group, groups) * 256u + local;
    if k < parameters.length {
        direction[k] += scalars[FACTOR] * left[k];
    }
}

// Between the two passes over the pairs.
@compute @workgroup_size(256)
fn lbfgs_precondition(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group, groups) * 256u + local;
    if k < parameters.length {
        direction[k] *= scalars[SCALE] * preconditioner[k];
    }
}

// After `lbfgs_dot` of change and direction, oldest pair first: the displacement is to be added.
@compute @workgroup_size(256)
fn lbfgs_beta(@builtin(local_invocation_index) local: u32) {
    let sum = total(local);
    if local == 0u {
        scalars[FACTOR] = scalars[ALPHA + pair] - scalars[RHO + pair] * sum;
    }
}

// The step, but for what is held.
@compute @workgroup_size(256)
fn lbfgs_step(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group, groups) * 256u + local;
    if k < parameters.length && preconditioner[k] > 0.0 {
        unknowns[k] = max(unknowns[k] - direction[k], floors[k]);
    }
}
