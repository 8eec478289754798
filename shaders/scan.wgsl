// Exclusive prefix sum in place: reduce blocks, scan the block sums, apply.
// The total is checked against a limit: a list that would not fit sets the
// overflow word, is reported with what it needs, and counts as empty from there.
//
// With `simd` eight threads, a vector register of a processor, scan all in one dispatch: a
// dispatch costs more there than thousands of elements, and so does every barrier.
import package::common::constants::{STATUS_NEEDED, STATUS_OVERFLOW};
import package::common::groups::{Groups, blocks, groups_for_count};
@if(!simd) import package::common::groups::SCAN_BLOCK;
@if(!simd) import package::common::numeric::linear_group;

@if(!simd) const SCAN_PER_THREAD: u32 = 4u;
@if(simd) const LANES: u32 = 8u;

struct ScanParameters {
    // Which of `elements` counts the elements to scan.
    which: u32,
    // Status word that receives the total; 0xffffffff: none.
    total_word: u32,
    limit: u32,
}

@group(0) @binding(0) var<uniform> parameters: ScanParameters;
@group(0) @binding(1) var<storage, read_write> values: array<u32>;
@if(!simd) @group(0) @binding(2) var<storage, read_write> block_sums: array<u32>;
@group(0) @binding(3) var<storage, read_write> status: array<u32>;
@group(0) @binding(4) var<storage, read> elements: array<Groups, 4>;
// The workgroups for as many elements as the total says.
@group(0) @binding(5) var<storage, read_write> total: array<Groups, 4>;

@if(!simd) var<workgroup> sums: array<u32, 256>;
@if(simd) var<workgroup> sums: array<u32, LANES>;

// Notes the total.
fn conclude(sum: u32) {
    if parameters.total_word != 0xffffffffu {
        var known = sum;
        if sum > parameters.limit {
            status[STATUS_OVERFLOW] = 1u;
            status[STATUS_NEEDED] = max(status[STATUS_NEEDED], sum);
            known = 0u;
        }
        status[parameters.total_word] = known;
        total = groups_for_count(known);
    }
}

// Inclusive scan over the workgroup; returns the sum before this thread.
@if(!simd) fn exclusive_over_group(local: u32, own: u32) -> u32 {
    sums[local] = own;
    for (var step = 1u; step < 256u; step *= 2u) {
        workgroupBarrier();
        var before = 0u;
        if local >= step {
            before = sums[local - step];
        }
        workgroupBarrier();
        sums[local] += before;
    }
    workgroupBarrier();
    return sums[local] - own;
}

@if(!simd)
@compute @workgroup_size(256)
fn scan_reduce(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group);
    let first = block * SCAN_BLOCK + local * SCAN_PER_THREAD;
    var own = 0u;
    let length = elements[parameters.which].length;
    for (var k = first; k < min(first + SCAN_PER_THREAD, length); k++) {
        own += values[k];
    }
    let before = exclusive_over_group(local, own);
    if local == 255u && block * SCAN_BLOCK < length {
        block_sums[block] = before + own;
    }
}

@if(!simd)
@compute @workgroup_size(256)
fn scan_sums(@builtin(local_invocation_index) local: u32) {
    let block_count = blocks(elements[parameters.which].length, SCAN_BLOCK);
    var carry = 0u;
    for (var first = 0u; first < block_count; first += 256u) {
        let block = first + local;
        var own = 0u;
        if block < block_count {
            own = block_sums[block];
        }
        let before = exclusive_over_group(local, own);
        if block < block_count {
            block_sums[block] = carry + before;
        }
        workgroupBarrier();
        carry += sums[255];
        workgroupBarrier();
    }
    if local == 0u {
        conclude(carry);
    }
}

@if(!simd)
@compute @workgroup_size(256)
fn scan_apply(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = linear_group(group);
    let first = block * SCAN_BLOCK + local * SCAN_PER_THREAD;
    let end = min(first + SCAN_PER_THREAD, elements[parameters.which].length);
    var own = 0u;
    for (var k = first; k < end; k++) {
        own += values[k];
    }
    var before = exclusive_over_group(local, own);
    if first < end {
        before += block_sums[block];
    }
    for (var k = first; k < end; k++) {
        let value = values[k];
        values[k] = before;
        before += value;
    }
}

@if(simd)
@compute @workgroup_size(LANES)
fn scan_whole(@builtin(local_invocation_index) local: u32) {
    let length = elements[parameters.which].length;
    let each = blocks(length, LANES);
    let first = min(local * each, length);
    let end = min(first + each, length);
    var own = 0u;
    for (var k = first; k < end; k++) {
        own += values[k];
    }
    sums[local] = own;
    workgroupBarrier();
    var before = 0u;
    for (var lane = 0u; lane < local; lane++) {
        before += sums[lane];
    }
    if local == LANES - 1u {
        conclude(before + own);
    }
    for (var k = first; k < end; k++) {
        let value = values[k];
        values[k] = before;
        before += value;
    }
}
