@compute @workgroup_size(256)
fn lbfgs_add(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group) * 256u + local;
    if k >= parameters.length || scalars[NEXT] == SHORTER {
        return;
    }
    direction[k] += scalars[FACTOR] * left[k];
}

@compute @workgroup_size(256)
fn lbfgs_alpha(@builtin(local_invocation_index) local: u32) {
    let sum = total(local);
    if local == 0u {
        scalars[ALPHA + pair] = scalars[RHO + pair] * sum;
        scalars[FACTOR] = -scalars[ALPHA + pair];
    }
}

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

@compute @workgroup_size(256)
fn lbfgs_beta(@builtin(local_invocation_index) local: u32) {
    let sum = total(local);
    if local == 0u {
        scalars[FACTOR] = scalars[ALPHA + pair] - scalars[RHO + pair] * sum;
    }
}

@compute @workgroup_size(256)
fn lbfgs_curvature(@builtin(local_invocation_index) local: u32) {
    let sum = total(local);
    if local == 0u {
        scalars[CURVATURE] = sum;
    }
}

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
        let least = select(SHORTENED.x, -0.5 * slope / bend, slope < 0.0 && bend < UNKNOWN);
        scalars[LENGTH] = clamp(least, SHORTENED.x, SHORTENED.y);
        scalars[NEXT] = SHORTER;
    }
    else {
        scalars[NEXT] = SAFE;
        scalars[LENGTH] = 1.0;
        scalars[SCALE] = 1.0;
        for (var i = 0u; i < MEMORY; i++) {
            scalars[RHO + i] = 0.0;
        }
    }
}

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

@compute @workgroup_size(256)
fn lbfgs_moved(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group);
    let k = block * 256u + local;
    var moved = 0.0;
    var weight = 0.0;
    if k < parameters.length {
        let own = diagonal[of_channel(k)];
        moved = own * abs(displacement[k]);
        weight = select(0.0, own, k < parameters.constants);
    }
    leave_sum(block, local, moved);
    workgroupBarrier();
    leave_second_sum(block, local, weight);
}

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
    }
    else {
        unknowns[k] = accepted_unknowns[k];
        gradient[k] = accepted_gradient[k];
    }
}

@compute @workgroup_size(256)
fn lbfgs_precondition(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group) * 256u + local;
    if k >= parameters.length || scalars[NEXT] == SHORTER {
        return;
    }
    direction[k] *= scalars[SCALE] * preconditioner[k];
}

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

@compute @workgroup_size(256)
fn lbfgs_slope(@builtin(local_invocation_index) local: u32) {
    let sum = total(local);
    if local == 0u {
        scalars[SLOPE] = -sum;
    }
}

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

@compute @workgroup_size(256)
fn lbfgs_step(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let k = linear_group(group) * 256u + local;
    if k < parameters.length && preconditioner[k] > 0.0 {
        unknowns[k] = max(unknowns[k] - scalars[LENGTH] * direction[k], floors[k]);
    }
}

@group(0) @binding(0)
var<uniform> parameters: LbfgsParameters;

@group(0) @binding(1)
var<uniform> pair: u32;

@group(0) @binding(10)
var<storage, read_write> direction: array<f32>;

@group(0) @binding(11)
var<storage, read_write> displacement: array<f32>;

@group(0) @binding(12)
var<storage, read_write> change: array<f32>;

@group(0) @binding(13)
var<storage, read_write> block_sums: array<f32>;

@group(0) @binding(14)
var<storage, read_write> scalars: array<f32>;

@group(0) @binding(15)
var<storage, read> left: array<f32>;

@group(0) @binding(16)
var<storage, read> right: array<f32>;

@group(0) @binding(17)
var<storage, read_write> anchors: array<f32>;

@group(0) @binding(18)
var<storage, read_write> pulls: array<f32>;

@group(0) @binding(2)
var<storage, read_write> unknowns: array<f32>;

@group(0) @binding(3)
var<storage, read_write> gradient: array<f32>;

@group(0) @binding(4)
var<storage, read> diagonal: array<f32>;

@group(0) @binding(5)
var<storage, read> floors: array<f32>;

@group(0) @binding(6)
var<storage, read> losses: array<f32>;

@group(0) @binding(7)
var<storage, read_write> accepted_unknowns: array<f32>;

@group(0) @binding(8)
var<storage, read_write> accepted_gradient: array<f32>;

@group(0) @binding(9)
var<storage, read_write> preconditioner: array<f32>;

const AGE: u32 = 8u;

const ALPHA: u32 = RHO + MEMORY;

const CHANGED: u32 = 10u;

const CURVATURE: u32 = 3u;

const FACTOR: u32 = 5u;

const LEAST_SCALE: f32 = 0.001;

const LENGTH: u32 = 6u;

const LOSS: u32 = 0u;

const MAX_GROUPS: u32 = 65535u;

const MEMORY: u32 = 5u;

const MOVED: u32 = 9u;

const NEXT: u32 = 1u;

const ONWARD: f32 = 0.0;

const PAIRED: u32 = 2u;

const RHO: u32 = 11u;

const SAFE: f32 = 2.0;

const SCALE: u32 = 4u;

const SHORTENED: vec2f = vec2f(0.1, 0.5);

const SHORTER: f32 = 1.0;

const SLOPE: u32 = 7u;

const TOLERANCE: f32 = 0.0001;

const UNKNOWN: f32 = 3.4028234663852886e38;

fn group_sum(local: u32, own: f32) -> f32 {
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

fn inverse_diagonal(k: u32) -> f32 {
    let own = of_channel(k);
    let free = parameters.diagonal_scale * diagonal[own] + parameters.ridge;
    return 1.0 / (penalty_factor(k) * free + pulls[own]);
}

fn leave_second_sum(block: u32, local: u32, own: f32) {
    let sum = group_sum(local, own);
    if local == 0u && block < parameters.blocks {
        block_sums[parameters.blocks + block] = sum;
    }
}

fn leave_sum(block: u32, local: u32, own: f32) {
    let sum = group_sum(local, own);
    if local == 0u && block < parameters.blocks {
        block_sums[block] = sum;
    }
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

fn of_channel(k: u32) -> u32 {
    let n = parameters.splats;
    return (k / n) % parameters.diagonals * n + k % n;
}

fn penalty_factor(k: u32) -> f32 {
    return select(parameters.rest, 1.0, k < parameters.constants);
}

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

struct LbfgsParameters {
    length: u32,
    splats: u32,
    diagonals: u32,
    blocks: u32,
    ridge: f32,
    diagonal_scale: f32,
    constants: u32,
    color: f32,
    anchor: f32,
    rest: f32
}

var<workgroup> sums: array<f32, 256>;
