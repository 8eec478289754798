//! `scan`: exclusive prefix sums and their total.

use std::sync::Arc;

use crate::{
    doctor::measured::{Row, Sample},
    gpu::{Buffer, GpuError, Recorder},
    oracle::random::Random,
    raster::{Raster, constants::*, scan::Scan},
};

/// Around a thread's four, a workgroup's 1,024, and its 256 block sums.
const LENGTHS: [usize; 16] = [
    1, 2, 3, 4, 5, 255, 256, 257, 1023, 1024, 1025, 2048, 70_000, 262_144, 262_145, 300_000,
];

/// Scans on the device; gives the sums and the status words, of which
/// `total_word` receives the total, unless that is beyond `limit`.
///
/// # Errors
/// [`GpuError`].
pub fn scan_on(
    raster: &Raster,
    values: &[u32],
    total_word: Option<usize>,
    limit: usize,
) -> Result<(Vec<u32>, Vec<u32>), GpuError> {
    let (gpu, kernels) = (&raster.gpu, raster.scan_kernels());
    let buffer = Buffer::from_slice(gpu, "values", values)?;
    let status = Buffer::zeros(gpu, "status", STATUS_WORDS)?;
    let scan = Scan::new(gpu, kernels, &buffer, &status, total_word, limit)?;
    let mut recorder = Recorder::new(gpu);
    scan.record(kernels, &mut recorder);
    recorder.submit();
    Ok((buffer.read(gpu)?, status.read(gpu)?))
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let mut samples = Vec::new();
    for length in LENGTHS {
        let mut random = Random::new(length as u64);
        let values: Vec<u32> = (0..length).map(|_| (random.bits() % 7) as u32).collect();
        let mut total = 0;
        let mut expected = Vec::new();
        for &value in &values {
            expected.push(f64::from(total));
            total += value;
        }
        expected.push(f64::from(total));
        let (mut sums, status) = scan_on(raster, &values, Some(STATUS_INSTANCES), total as usize)?;
        sums.push(status[STATUS_INSTANCES]);
        samples.push(Sample::new(
            sums.into_iter().map(f64::from).collect(),
            expected,
        ));
    }
    Ok(vec![Row::exact("scan", "sums and total", &samples)])
}
