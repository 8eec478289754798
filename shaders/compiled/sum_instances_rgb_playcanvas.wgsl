@compute @workgroup_size(256)
fn sum_instances(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let rank = linear_group(group) * 256u + local;
    if rank >= status[STATUS_VISIBLE] {
        return;
    }
    let instances = status[STATUS_INSTANCES];
    let begin = min(offsets[rank], instances);
    var end = instances;
    if rank + 1u < status[STATUS_VISIBLE] {
        end = min(offsets[rank + 1u], instances);
    }
    var sum: array<f32, PARTIAL_STRIDE>;
    var slot = begin;
    if end - begin >= MANY {
        for (; slot + 3u < end; slot += 4u) {
            for (var c = 0u; c < PARTIAL_WORDS; c++) {
                let at = slot * PARTIAL_WORDS + c;
                let first = figures(at);
                let second = figures(at + PARTIAL_WORDS);
                let third = figures(at + 2u * PARTIAL_WORDS);
                let fourth = figures(at + 3u * PARTIAL_WORDS);
                {
                    sum[c] = sum[c] + first + second + third + fourth;
                }
            }
        }
    }
    for (; slot < end; slot++) {
        for (var c = 0u; c < PARTIAL_WORDS; c++) {
            let one = figures(slot * PARTIAL_WORDS + c);
            {
                sum[c] += one;
            }
        }
    }
    let i = order[rank];
    {
        let q = projected[i].conic_opacity;
        let m = sum;
        sum[0] = -(q.x * m[1] + q.y * m[2]);
        sum[1] = -(q.y * m[1] + q.z * m[2]);
        sum[2] = 0.5 * m[3];
        sum[3] = m[4];
        sum[4] = 0.5 * m[5];
        sum[5] = m[PARTIAL_OPACITY] / max(q.w, ALPHA_MIN);
    }
    for (var c = 0u; c < PARTIAL_STRIDE; c++) {
        gradients[i * PARTIAL_STRIDE + c] = sum[c];
    }
}

@group(0) @binding(0)
var<storage, read> order: array<u32>;

@group(0) @binding(1)
var<storage, read> offsets: array<u32>;

@group(0) @binding(2)
var<storage, read> status: array<u32>;

@group(0) @binding(3)
var<storage, read> partials: array<PartialWord>;

@group(0) @binding(4)
var<storage, read_write> gradients: array<f32>;

@group(0) @binding(5)
var<storage, read> projected: array<Projected>;

alias PartialWord = f32;

const CHANNELS: u32 = 3u;

const MANY: u32 = 32u;

const MAX_GROUPS: u32 = 65535u;

const PARTIAL_COLOR: u32 = 7u;

const PARTIAL_OPACITY: u32 = PARTIAL_COLOR + CHANNELS;

const PARTIAL_STRIDE: u32 = PARTIAL_OPACITY + 1u;

const PARTIAL_WORDS: u32 = PARTIAL_STRIDE;

const STATUS_INSTANCES: u32 = 2u;

const STATUS_VISIBLE: u32 = 1u;

fn figures(at: u32) -> f32 {
    return partials[at];
}

fn linear_group(group: vec3u) -> u32 {
    return group.x + group.y * MAX_GROUPS;
}

override ALPHA_MIN: f32 = 0.00392156862745098;

struct Projected {
    mean: vec2f,
    extent: vec2f,
    conic_opacity: vec4f
}
