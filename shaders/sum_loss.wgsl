// Adds the blocks' losses in a fixed order and files their mean a pixel under
// the iteration's number; counts the step unless the tile lists overflowed.
import package::common::constants::{STATUS_OVERFLOW, STATUS_STEPS};
import package::common::group_sum::group_sum;

struct SumLossParameters {
    blocks: u32,
    pixels: u32,
    entry: u32,
}

@group(0) @binding(0) var<uniform> parameters: SumLossParameters;
@group(0) @binding(1) var<storage, read> block_losses: array<f32>;
@group(0) @binding(2) var<storage, read_write> losses: array<f32>;
@group(0) @binding(3) var<storage, read_write> status: array<u32>;

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
