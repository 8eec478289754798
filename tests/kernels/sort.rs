//! `sort`: a stable radix sort against the host's.

use gs_chroma::{
    gpu::{Buffer, Recorder},
    raster::{constants::*, sort::Sort},
};

use crate::{
    harness::{gpu, raster},
    oracle::random::Random,
};

/// Sorts the first `count` keys on the device; values are the keys' places.
fn sort(keys: &[u32], count: usize, bits: u32) -> (Vec<u32>, Vec<u32>) {
    let (raster, gpu) = (raster(), gpu());
    let mut words = [0; STATUS_WORDS];
    words[STATUS_VISIBLE] = count as u32;
    let status = Buffer::from_slice(gpu, "status", &words).unwrap();
    let (kernels, scan) = (raster.sort_kernels(), raster.scan_kernels());
    let sort = Sort::new(
        gpu,
        kernels,
        scan,
        &status,
        STATUS_VISIBLE,
        keys.len(),
        bits,
    )
    .unwrap();
    let places: Vec<u32> = (0..keys.len() as u32).collect();
    sort.keys[0].write(gpu, keys);
    sort.values[0].write(gpu, &places);
    let mut recorder = Recorder::new(gpu);
    sort.record(kernels, scan, &mut recorder);
    recorder.submit();
    let read = |buffer: &Buffer<u32>| buffer.read(gpu).unwrap()[..count].to_vec();
    (read(sort.sorted_keys()), read(sort.sorted_values()))
}

fn check(name: &str, keys: &[u32], count: usize, bits: u32) {
    let mut places: Vec<u32> = (0..count as u32).collect();
    places.sort_by_key(|&place| keys[place as usize]);
    let sorted: Vec<u32> = places.iter().map(|&p| keys[p as usize]).collect();
    let (keys, values) = sort(keys, count, bits);
    assert!(keys == sorted, "{name}, {count} keys of {bits} bits");
    assert!(values == places, "{name}, {count} keys: ties out of order");
}

type Pattern = (&'static str, fn(u32, u32) -> u32);

const PATTERNS: [Pattern; 6] = [
    ("random", |_, random| random),
    ("equal", |_, _| 0xdead_beef),
    ("sorted", |i, _| i * 3),
    ("reversed", |i, _| u32::MAX - i * 5),
    ("five distinct", |_, random| random % 5 * 0x0101_0101),
    (
        "extremes",
        |_, random| if random % 2 == 0 { 0 } else { u32::MAX },
    ),
];

fn keys(pattern: fn(u32, u32) -> u32, len: usize) -> Vec<u32> {
    let mut random = Random::new(len as u64);
    (0..len as u32)
        .map(|i| pattern(i, random.bits() as u32))
        .collect()
}

#[test]
fn equals_a_stable_host_sort() {
    for (name, pattern) in PATTERNS {
        for len in [1, 2, 255, 256, 257, 2047, 2048, 2049, 20_000] {
            check(name, &keys(pattern, len), len, 32);
        }
    }
    check("random", &keys(PATTERNS[0].1, 100_000), 100_000, 32);
    check("five distinct", &keys(PATTERNS[4].1, 100_000), 100_000, 32);
}

#[test]
fn counts_below_the_capacity_leave_the_rest_alone() {
    for count in [0, 1, 2048, 2049, 9_999] {
        check("part", &keys(PATTERNS[0].1, 10_000), count, 32);
    }
    assert_eq!(sort(&[], 0, 32), (Vec::new(), Vec::new()));
}

#[test]
fn fewer_bits_take_fewer_passes() {
    for bits in [1, 7, 8, 9, 16, 17, 24] {
        let mask = u32::MAX >> (32 - bits);
        let keys: Vec<u32> = keys(PATTERNS[0].1, 5_000);
        let keys: Vec<u32> = keys.iter().map(|key| key & mask).collect();
        check("narrow", &keys, keys.len(), bits);
    }
}
