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

@group(0) @binding(0)
var<uniform> parameters: ScanParameters;

@group(0) @binding(1)
var<storage, read_write> values: array<u32>;

@group(0) @binding(2)
var<storage, read_write> block_sums: array<u32>;

@group(0) @binding(3)
var<storage, read_write> status: array<u32>;

@group(0) @binding(4)
var<storage, read> elements: array<Groups, 4>;

@group(0) @binding(5)
var<storage, read_write> total: array<Groups, 4>;

const DIGITS: u32 = 256u;

const MAX_GROUPS: u32 = 65535u;

const SCAN_BLOCK: u32 = 1024u;

const SCAN_PER_THREAD: u32 = 4u;

const SORT_BLOCK: u32 = 2048u;

const STATUS_NEEDED: u32 = 3u;

const STATUS_OVERFLOW: u32 = 0u;

const THREADS: u32 = 256u;

fn blocks(length: u32, each: u32) -> u32 {
    return (length + each - 1u) / each;
}

fn conclude(sum: u32) {
    if parameters.total_word != 4294967295u {
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

fn exclusive_over_group(local: u32, own: u32) -> u32 {
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

fn groups_for(length: u32, each: u32) -> Groups {
    let groups = blocks(length, each);
    return Groups(vec3u(min(groups, MAX_GROUPS), blocks(groups, MAX_GROUPS), 1u), length);
}

fn groups_for_count(count: u32) -> array<Groups, 4> {
    let histogram = DIGITS * blocks(count, SORT_BLOCK);
    return array<Groups, 4>(groups_for(count, THREADS), groups_for(count, SCAN_BLOCK), groups_for(count, SORT_BLOCK), groups_for(histogram, SCAN_BLOCK));
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

struct Groups {
    counts: vec3u,
    length: u32
}

struct ScanParameters {
    which: u32,
    total_word: u32,
    limit: u32
}

var<workgroup> sums: array<u32, 256>;
