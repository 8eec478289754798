// Stable least-significant-digit radix sort of 32-bit keys with values, eight
// bits a pass: count digits by block, scan the counts (scan.wgsl), scatter.
//
// A key's rank among equal digits of its round is a population count over a
// bit mask that the workgroup sets with atomicOr: independent of the subgroup
// size and of the order in which threads run.
//
// With `simd` each of eight threads, a vector register of a processor, takes a block by itself,
// key by key: no barriers, and the same order.
import package::common::groups::{OF_SORT, Groups, SORT_BLOCK, blocks};
import package::common::numeric::linear_group;

@if(!simd) const SORT_ROUNDS: u32 = 8u;
@if(simd) const LANES: u32 = 8u;
@if(simd) const DIGITS: u32 = 256u;

struct SortParameters {
    // Lowest bit of this pass.
    shift: u32,
}

@group(0) @binding(0) var<uniform> parameters: SortParameters;
@group(0) @binding(1) var<storage, read> elements: array<Groups, 4>;
@group(0) @binding(2) var<storage, read> keys: array<u32>;
@group(0) @binding(3) var<storage, read> values: array<u32>;
// `[256, blocks]`.
@group(0) @binding(4) var<storage, read_write> histogram: array<u32>;
@group(0) @binding(5) var<storage, read_write> sorted_keys: array<u32>;
@group(0) @binding(6) var<storage, read_write> sorted_values: array<u32>;

@if(!simd) var<workgroup> counts: array<atomic<u32>, 256>;
@if(!simd) var<workgroup> bases: array<u32, 256>;
// `[digits, threads]`: keys so far, or where the next one goes.
@if(simd) var<workgroup> lane_digits: array<u32, DIGITS * LANES>;
// 256 digits × 256 threads, a bit each.
@if(!simd) var<workgroup> masks: array<atomic<u32>, 2048>;

@if(!simd)
@compute @workgroup_size(256)
fn sort_count(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group);
    let count = elements[OF_SORT].length;
    if block * SORT_BLOCK >= count {
        return;
    }
    atomicStore(&counts[local], 0u);
    workgroupBarrier();
    for (var round = 0u; round < SORT_ROUNDS; round++) {
        let k = block * SORT_BLOCK + round * 256u + local;
        if k < count {
            atomicAdd(&counts[(keys[k] >> parameters.shift) & 255u], 1u);
        }
    }
    workgroupBarrier();
    histogram[local * blocks(count, SORT_BLOCK) + block] = atomicLoad(&counts[local]);
}

@if(!simd)
@compute @workgroup_size(256)
fn sort_scatter(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group);
    let count = elements[OF_SORT].length;
    if block * SORT_BLOCK >= count {
        return;
    }
    bases[local] = histogram[local * blocks(count, SORT_BLOCK) + block];
    for (var word = 0u; word < 8u; word++) {
        atomicStore(&masks[word * 256u + local], 0u);
    }
    let word = local / 32u;
    let bit = 1u << (local % 32u);
    for (var round = 0u; round < SORT_ROUNDS; round++) {
        workgroupBarrier();
        let k = block * SORT_BLOCK + round * 256u + local;
        let live = k < count;
        var digit = 0u;
        if live {
            digit = (keys[k] >> parameters.shift) & 255u;
            atomicOr(&masks[digit * 8u + word], bit);
        }
        workgroupBarrier();
        // Every thread also totals one digit for the next round.
        var total = 0u;
        for (var w = 0u; w < 8u; w++) {
            total += countOneBits(atomicLoad(&masks[local * 8u + w]));
        }
        if live {
            var rank = countOneBits(atomicLoad(&masks[digit * 8u + word]) & (bit - 1u));
            for (var w = 0u; w < word; w++) {
                rank += countOneBits(atomicLoad(&masks[digit * 8u + w]));
            }
            let target_index = bases[digit] + rank;
            sorted_keys[target_index] = keys[k];
            sorted_values[target_index] = values[k];
        }
        workgroupBarrier();
        bases[local] += total;
        if live {
            atomicStore(&masks[digit * 8u + word], 0u);
        }
    }
}

@if(simd)
@compute @workgroup_size(LANES)
fn sort_count(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let count = elements[OF_SORT].length;
    let all = blocks(count, SORT_BLOCK);
    let block = linear_group(group) * LANES + lane;
    if block >= all {
        return;
    }
    for (var digit = 0u; digit < DIGITS; digit++) {
        lane_digits[digit * LANES + lane] = 0u;
    }
    let end = min((block + 1u) * SORT_BLOCK, count);
    for (var k = block * SORT_BLOCK; k < end; k++) {
        lane_digits[((keys[k] >> parameters.shift) & 255u) * LANES + lane] += 1u;
    }
    for (var digit = 0u; digit < DIGITS; digit++) {
        histogram[digit * all + block] = lane_digits[digit * LANES + lane];
    }
}

@if(simd)
@compute @workgroup_size(LANES)
fn sort_scatter(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let count = elements[OF_SORT].length;
    let all = blocks(count, SORT_BLOCK);
    let block = linear_group(group) * LANES + lane;
    if block >= all {
        return;
    }
    for (var digit = 0u; digit < DIGITS; digit++) {
        lane_digits[digit * LANES + lane] = histogram[digit * all + block];
    }
    let end = min((block + 1u) * SORT_BLOCK, count);
    for (var k = block * SORT_BLOCK; k < end; k++) {
        let key = keys[k];
        let at = ((key >> parameters.shift) & 255u) * LANES + lane;
        let target_index = lane_digits[at];
        lane_digits[at] = target_index + 1u;
        sorted_keys[target_index] = key;
        sorted_values[target_index] = values[k];
    }
}
