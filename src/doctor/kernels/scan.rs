//! `scan`: exclusive prefix sums, their total, and the workgroups for it.

use std::sync::Arc;

use crate::{
    doctor::measured::{Row, Sample},
    gpu::{Buffer, GpuError, Recorder},
    oracle::random::Random,
    raster::{
        Raster,
        constants::*,
        groups::{Count, Groups, WorkKind},
        scan::{Scan, Total},
    },
};

/// Around a thread's four, a workgroup's 1,024, and its 256 block sums.
const LENGTHS: [usize; 16] = [
    1, 2, 3, 4, 5, 255, 256, 257, 1023, 1024, 1025, 2048, 70_000, 262_144, 262_145, 300_000,
];

/// Result of a scan.
pub struct Scanned {
    /// The exclusive sums.
    pub sums: Vec<u32>,
    /// The status words.
    pub status: Vec<u32>,
    /// The workgroups for as many elements as the total says.
    pub groups: Vec<Groups>,
}

/// Scans on the device; `total_word` of the status receives the total, unless that is beyond
/// `limit`.
pub fn scan_on(
    raster: &Raster,
    values: &[u32],
    total_word: Option<usize>,
    limit: usize,
) -> Result<Scanned, GpuError> {
    let (gpu, kernels) = (&raster.gpu, raster.scan_kernels());
    let buffer = Buffer::from_slice(gpu, "values", values)?;
    let status = Buffer::zeros(gpu, "status", STATUS_WORDS)?;
    let (elements, count) = (Count::new(gpu, values.len())?, Count::new(gpu, 0)?);
    let total = total_word.map(|word| Total {
        word,
        count: &count,
        limit,
    });
    let elements = (&elements, WorkKind::Scan);
    let scan = Scan::new(gpu, kernels, &buffer, &status, elements, total)?;
    let mut recorder = Recorder::new(gpu);
    scan.record(&mut recorder);
    recorder.submit();
    Ok(Scanned {
        sums: buffer.read(gpu)?,
        status: status.read(gpu)?,
        groups: count.groups().read(gpu)?,
    })
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
        let scanned = scan_on(raster, &values, Some(STATUS_INSTANCES), total as usize)?;
        let mut found = scanned.sums;
        found.push(scanned.status[STATUS_INSTANCES]);
        let groups = [scanned.groups, Groups::for_count(total as usize).to_vec()];
        let [groups, wanted] = groups.map(|groups| {
            let words = groups.into_iter();
            let words = words.flat_map(|g| [g.counts[0], g.counts[1], g.counts[2], g.length]);
            words.map(f64::from).collect::<Vec<_>>()
        });
        expected.extend(wanted);
        samples.push(Sample::new(
            found.into_iter().map(f64::from).chain(groups).collect(),
            expected,
        ));
    }
    Ok(vec![Row::exact(
        "scan",
        "sums, total and its workgroups",
        &samples,
    )])
}
