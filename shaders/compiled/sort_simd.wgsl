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

@group(0) @binding(0)
var<uniform> parameters: SortParameters;

@group(0) @binding(1)
var<storage, read> elements: array<Groups, 4>;

@group(0) @binding(2)
var<storage, read> keys: array<u32>;

@group(0) @binding(3)
var<storage, read> values: array<u32>;

@group(0) @binding(4)
var<storage, read_write> histogram: array<u32>;

@group(0) @binding(5)
var<storage, read_write> sorted_keys: array<u32>;

@group(0) @binding(6)
var<storage, read_write> sorted_values: array<u32>;

const DIGITS: u32 = 256u;

const LANES: u32 = 8u;

const MAX_GROUPS: u32 = 65535u;

const OF_SORT: u32 = 2u;

const SORT_BLOCK: u32 = 2048u;

fn blocks(length: u32, each: u32) -> u32 {
    return (length + each - 1u) / each;
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

struct Groups {
    counts: vec3u,
    length: u32
}

struct SortParameters {
    shift: u32
}

var<workgroup> lane_digits: array<u32, DIGITS * LANES>;
