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

const MAX_GROUPS: u32 = 65535u;

const OF_SORT: u32 = 2u;

const SORT_BLOCK: u32 = 2048u;

const SORT_ROUNDS: u32 = 8u;

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

var<workgroup> bases: array<u32, 256>;

var<workgroup> counts: array<atomic<u32>, 256>;

var<workgroup> masks: array<atomic<u32>, 2048>;
