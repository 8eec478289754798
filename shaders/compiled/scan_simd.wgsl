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

@group(0) @binding(0)
var<uniform> parameters: ScanParameters;

@group(0) @binding(1)
var<storage, read_write> values: array<u32>;

@group(0) @binding(3)
var<storage, read_write> status: array<u32>;

@group(0) @binding(4)
var<storage, read> elements: array<Groups, 4>;

@group(0) @binding(5)
var<storage, read_write> total: array<Groups, 4>;

const DIGITS: u32 = 256u;

const LANES: u32 = 8u;

const MAX_GROUPS: u32 = 65535u;

const SCAN_BLOCK: u32 = 1024u;

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

fn groups_for(length: u32, each: u32) -> Groups {
    let groups = blocks(length, each);
    return Groups(vec3u(min(groups, MAX_GROUPS), blocks(groups, MAX_GROUPS), 1u), length);
}

fn groups_for_count(count: u32) -> array<Groups, 4> {
    let histogram = DIGITS * blocks(count, SORT_BLOCK);
    return array<Groups, 4>(groups_for(count, THREADS), groups_for(count, SCAN_BLOCK), groups_for(count, SORT_BLOCK), groups_for(histogram, SCAN_BLOCK));
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

var<workgroup> sums: array<u32, LANES>;
