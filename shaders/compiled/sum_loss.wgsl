@compute @workgroup_size(256)
fn sum_loss(@builtin(local_invocation_index) local: u32) {
    var sum = 0.0;
    for (var k = local; k < parameters.blocks; k += 256u) {
        sum += block_losses[k];
    }
    sum = group_sum(local, sum);
    if local == 0u && status[STATUS_OVERFLOW] == 0u {
        status[STATUS_STEPS] += 1u;
        losses[parameters.entry] = sum / f32(parameters.pixels);
    }
}

@group(0) @binding(0)
var<uniform> parameters: SumLossParameters;

@group(0) @binding(1)
var<storage, read> block_losses: array<f32>;

@group(0) @binding(2)
var<storage, read_write> losses: array<f32>;

@group(0) @binding(3)
var<storage, read_write> status: array<u32>;

const STATUS_OVERFLOW: u32 = 0u;

const STATUS_STEPS: u32 = 5u;

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

struct SumLossParameters {
    blocks: u32,
    pixels: u32,
    entry: u32
}

var<workgroup> sums: array<f32, 256>;
