var<workgroup> sums: array<f32, 256>;

// The sum over a workgroup of 256 threads in a fixed order, valid in thread 0.
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
