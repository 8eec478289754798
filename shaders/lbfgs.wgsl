// L-BFGS (Nocedal 1980; Nocedal and Wright 2006, algorithm 7.4) on arrays that stay on the
// device: no number is read back between the steps. Sums run in a fixed order.
//
// Steps have length 1 until one raises the loss. Then a shorter one is tried, where the
// parabola through both losses and the slope is least (Nocedal and Wright 2006, 3.5); should
// that raise the loss too, what is remembered is forgotten, and the step of the majorizer is
// taken: the quadratic that touches the loss from above, its matrix AᵀWA replaced by row
// sums, which bound it. The second step is the majorizer's as well: the first spans residuals
// from far to near, and says little about the curvature where it ends.
//
// Unknowns may be anchored: from then on each is drawn to where it was accepted, the more the
// more the pictures bent the loss there. Directions that these decide badly, which only a great
// many steps would go along, stay as they are; what they decide goes on.
//
// Unknowns may have floors. One that stands at its floor, and would go below, is held there;
// the others are put onto theirs if they go below (after Bertsekas 1982, projected Newton).
import package::common::group_sum::group_sum;
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
    // How many of the first unknowns are constant harmonics.
    constants: u32,
    // What a constant harmonic of one adds to a color.
    color: f32,
    // What an anchor's pull is of the pictures'.
    anchor: f32,
    // What ridge and bound of a harmonic that is not constant are multiplied by.
    rest: f32,
}

// Pairs of displacements and changes of the gradient that are remembered.
const MEMORY: u32 = 5u;
// Scalars that the steps share. The loss at the accepted point, UNKNOWN before the first.
const LOSS: u32 = 0u;
// What the next step is: one of those below.
const NEXT: u32 = 1u;
// 1 where the present point is accepted and makes a pair with the one before.
const PAIRED: u32 = 2u;
// Displacement · change of the newest pair.
const CURVATURE: u32 = 3u;
// What the inverse of the majorizer's diagonal is multiplied by.
const SCALE: u32 = 4u;
// What `lbfgs_add` multiplies by.
const FACTOR: u32 = 5u;
// What the step is of `direction`.
const LENGTH: u32 = 6u;
// Of the loss along `direction`, at the accepted point.
const SLOPE: u32 = 7u;
// Points accepted so far.
const AGE: u32 = 8u;
// How far the colors went from the accepted point before to this: the mean over what is drawn.
const MOVED: u32 = 9u;
// 1 where what is minimized has changed since the accepted point, as the views' corrections do.
const CHANGED: u32 = 10u;
// For each pair: one over displacement · change, 0 where it does not count.
const RHO: u32 = 11u;
const ALPHA: u32 = RHO + MEMORY;

// The largest number, to so many digits that it is not beyond it: WGSL does not allow that.
const UNKNOWN: f32 = 3.4028234663852886e38;

// The present point is accepted: a step onward.
const ONWARD: f32 = 0.0;
// It is not: less of the same step.
const SHORTER: f32 = 1.0;
// Nor is the shorter one: the majorizer's step.
const SAFE: f32 = 2.0;

// A shorter step is this share of the last at least and at most.
const SHORTENED: vec2f = vec2f(0.1, 0.5);

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
// Where the unknowns are drawn to, and how strongly, planes as `diagonal`: 0 until they are anchored.
@group(0) @binding(17) var<storage, read_write> anchors: array<f32>;
@group(0) @binding(18) var<storage, read_write> pulls: array<f32>;

// Leaves the workgroup's sum for the kernel that adds up the blocks: the first of two.
fn leave_sum(block: u32, local: u32, own: f32) {
    let sum = group_sum(local, own);
    if local == 0u && block < parameters.blocks {
        block_sums[block] = sum;
    }
}

// The same for the second.
fn leave_second_sum(block: u32, local: u32, own: f32) {
    let sum = group_sum(local, own);
    if local == 0u && block < parameters.blocks {
        block_sums[parameters.blocks + block] = sum;
    }
}

// The sum of what the blocks left, valid in thread 0.
fn total(local: u32) -> f32 {
    return total_from(0u, local);
}

fn total_from(first: u32, local: u32) -> f32 {
    var own = 0.0;
    for (var block = local; block < parameters.blocks; block += 256u) {
        own += block_sums[first + block];
    }
    return group_sum(local, own);
}

// One over the majorizer's diagonal. Blend weights sum to at most one a pixel, so the sum
// of a Gaussian's weights bounds its row.
fn inverse_diagonal(k: u32) -> f32 {
    let own = of_channel(k);
    let free = parameters.diagonal_scale * diagonal[own] + parameters.ridge;
    return 1.0 / (penalty_factor(k) * free + pulls[own]);
}

// Photos from one side do not tell a constant color from one that changes with the view: what
// they leave open is made of constant harmonics.
fn penalty_factor(k: u32) -> f32 {
    return select(parameters.rest, 1.0, k < parameters.constants);
}

// Where `diagonal` has an unknown's.
fn of_channel(k: u32) -> u32 {
    let n = parameters.splats;
    return (k / n) % parameters.diagonals * n + k % n;
}

// The parts of ridge and anchors in the gradient, and partial sums of theirs in the loss.
@compute @workgroup_size(256)
fn lbfgs_ridge(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group);
    let k = block * 256u + local;
    var own = 0.0;
    if k < parameters.length {
        let x = unknowns[k];
        let off = x - anchors[k];
        let pull = pulls[of_channel(k)];
        let ridge = penalty_factor(k) * parameters.ridge;
        gradient[k] += ridge * x + pull * off;
        own = 0.5 * (ridge * x * x + pull * off * off);
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
    let loss = group_sum(local, own) + of_ridge;
    if local != 0u {
        return;
    }
    let first = scalars[LOSS] == UNKNOWN;
    let rise = loss - scalars[LOSS];
    let changed = scalars[CHANGED] > 0.0;
    scalars[CHANGED] = 0.0;
    if first || loss <= scalars[LOSS] * (1.0 + TOLERANCE) {
        scalars[PAIRED] = select(0.0, 1.0, !first && !changed && scalars[AGE] >= 2.0);
        scalars[AGE] += 1.0;
        scalars[LOSS] = loss;
        scalars[NEXT] = ONWARD;
        scalars[LENGTH] = 1.0;
        return;
    }
    scalars[PAIRED] = 0.0;
    if scalars[NEXT] == ONWARD {
        let slope = scalars[SLOPE];
        let bend = rise - slope;
        // Nothing is known of a loss that is none, nor of a slope that rises.
        let least = select(SHORTENED.x, -0.5 * slope / bend, slope < 0.0 && bend < UNKNOWN);
        scalars[LENGTH] = clamp(least, SHORTENED.x, SHORTENED.y);
        scalars[NEXT] = SHORTER;
    } else {
        scalars[NEXT] = SAFE;
        scalars[LENGTH] = 1.0;
        scalars[SCALE] = 1.0;
        for (var i = 0u; i < MEMORY; i++) {
            scalars[RHO + i] = 0.0;
        }
    }
}

// Keeps an accepted point and how it differs from the one before; goes back to that from
// any other.
@compute @workgroup_size(256)
fn lbfgs_pair(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group) * 256u + local;
    if k >= parameters.length {
        return;
    }
    if scalars[NEXT] == ONWARD {
        displacement[k] = unknowns[k] - accepted_unknowns[k];
        change[k] = gradient[k] - accepted_gradient[k];
        accepted_unknowns[k] = unknowns[k];
        accepted_gradient[k] = gradient[k];
    } else {
        unknowns[k] = accepted_unknowns[k];
        gradient[k] = accepted_gradient[k];
    }
}

// Anchors the unknowns at the accepted point, where `diagonal` is of it still. Neither the loss
// there changes nor its gradient.
@compute @workgroup_size(256)
fn lbfgs_anchor(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group) * 256u + local;
    if k < parameters.length {
        anchors[k] = accepted_unknowns[k];
        if k < parameters.diagonals * parameters.splats {
            pulls[k] = parameters.anchor * parameters.color * diagonal[k];
        }
    }
}

// Partial sums of how far the unknowns went, and of what they are weighed by: as Gaussians
// are drawn, and as the loss weighs the pixels.
@compute @workgroup_size(256)
fn lbfgs_moved(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group);
    let k = block * 256u + local;
    var moved = 0.0;
    var weight = 0.0;
    if k < parameters.length {
        let own = diagonal[of_channel(k)];
        moved = own * abs(displacement[k]);
        // Once for all harmonics.
        weight = select(0.0, own, k < parameters.constants);
    }
    leave_sum(block, local, moved);
    workgroupBarrier();
    leave_second_sum(block, local, weight);
}

// After `lbfgs_moved`.
@compute @workgroup_size(256)
fn lbfgs_mean(@builtin(local_invocation_index) local: u32) {
    let moved = total(local);
    workgroupBarrier();
    let weight = total_from(parameters.blocks, local);
    if local == 0u {
        let accepted = scalars[NEXT] == ONWARD;
        scalars[MOVED] = select(0.0, parameters.color * moved / weight, accepted && weight > 0.0);
    }
}

// What is held, and the gradient of the rest as the direction to begin with.
@compute @workgroup_size(256)
fn lbfgs_begin(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group) * 256u + local;
    if k >= parameters.length || scalars[NEXT] == SHORTER {
        return;
    }
    if scalars[NEXT] == ONWARD {
        let held = unknowns[k] <= floors[k] && gradient[k] >= 0.0;
        preconditioner[k] = select(inverse_diagonal(k), 0.0, held);
    }
    direction[k] = select(0.0, gradient[k], preconditioner[k] > 0.0);
}

// Partial sums of a scalar product.
@compute @workgroup_size(256)
fn lbfgs_dot(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group);
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
fn lbfgs_spread(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group);
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
fn lbfgs_add(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group) * 256u + local;
    if k >= parameters.length || scalars[NEXT] == SHORTER {
        return;
    }
    direction[k] += scalars[FACTOR] * left[k];
}

// Between the two passes over the pairs.
@compute @workgroup_size(256)
fn lbfgs_precondition(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group) * 256u + local;
    if k >= parameters.length || scalars[NEXT] == SHORTER {
        return;
    }
    direction[k] *= scalars[SCALE] * preconditioner[k];
}

// After `lbfgs_dot` of change and direction, oldest pair first: the displacement is to be added.
@compute @workgroup_size(256)
fn lbfgs_beta(@builtin(local_invocation_index) local: u32) {
    let sum = total(local);
    if local == 0u {
        scalars[FACTOR] = scalars[ALPHA + pair] - scalars[RHO + pair] * sum;
    }
}

// After `lbfgs_dot` of gradient and direction, which is that of the step turned around.
@compute @workgroup_size(256)
fn lbfgs_slope(@builtin(local_invocation_index) local: u32) {
    let sum = total(local);
    if local == 0u {
        scalars[SLOPE] = -sum;
    }
}

// The step, but for what is held.
@compute @workgroup_size(256)
fn lbfgs_step(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group) * 256u + local;
    if k < parameters.length && preconditioner[k] > 0.0 {
        unknowns[k] = max(unknowns[k] - scalars[LENGTH] * direction[k], floors[k]);
    }
}
