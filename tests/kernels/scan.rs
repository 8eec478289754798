//! `scan`: exclusive prefix sums, their total, and what happens beyond a limit.

use gs_chroma::{
    gpu::{Buffer, Recorder},
    raster::{constants::*, scan::Scan},
};

use crate::{
    harness::{gpu, raster},
    oracle::random::Random,
};

/// Scans on the device; gives the sums and the status words.
fn scan(values: &[u32], total_word: Option<usize>, limit: usize) -> (Vec<u32>, Vec<u32>) {
    let (raster, gpu) = (raster(), gpu());
    let buffer = Buffer::from_slice(gpu, "values", values).unwrap();
    let status = Buffer::zeros(gpu, "status", STATUS_WORDS).unwrap();
    let kernels = raster.scan_kernels();
    let scan = Scan::new(gpu, kernels, &buffer, &status, total_word, limit).unwrap();
    let mut recorder = Recorder::new(gpu);
    scan.record(kernels, &mut recorder);
    recorder.submit();
    (buffer.read(gpu).unwrap(), status.read(gpu).unwrap())
}

fn plain(values: &[u32]) -> (Vec<u32>, u32) {
    let mut sum = 0;
    let before = |&value: &u32| {
        let before = sum;
        sum += value;
        before
    };
    let sums = values.iter().map(before).collect();
    (sums, sum)
}

fn values(seed: u64, len: usize) -> Vec<u32> {
    let mut random = Random::new(seed);
    (0..len).map(|_| (random.bits() % 7) as u32).collect()
}

#[test]
fn sums_and_total_are_those_of_a_loop() {
    // Around a thread's four, a workgroup's 1,024, and its 256 block sums.
    for len in [
        0, 1, 2, 3, 4, 5, 255, 256, 257, 1023, 1024, 1025, 2048, 70_000, 262_144, 262_145, 300_000,
    ] {
        let values = values(len as u64, len);
        let (expected, total) = plain(&values);
        let (sums, status) = scan(&values, Some(STATUS_INSTANCES), total as usize);
        assert_eq!(sums, expected, "{len}");
        let mut words = [0; STATUS_WORDS];
        words[STATUS_INSTANCES] = total;
        assert_eq!(status, words, "{len}: the limit itself fits");
    }
}

#[test]
fn beyond_the_limit_the_total_counts_as_nothing() {
    for len in [1, 257, 5000, 300_000] {
        let values = vec![3; len];
        let total = 3 * len as u32;
        let (_, status) = scan(&values, Some(STATUS_INSTANCES), total as usize - 1);
        let mut words = [0; STATUS_WORDS];
        (words[STATUS_OVERFLOW], words[STATUS_NEEDED]) = (1, total);
        assert_eq!(status, words, "{len}");
    }
}

#[test]
fn without_a_total_the_status_stays_as_it_is() {
    let values = values(1, 3000);
    let (sums, status) = scan(&values, None, 0);
    assert_eq!(sums, plain(&values).0);
    assert_eq!(status, [0; STATUS_WORDS]);
}
