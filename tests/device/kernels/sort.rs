//! `sort`: counts below the capacity, keys of fewer bits.

use gs_chroma::low_level::doctor::kernels::sort_on;

use crate::kernels::{harness::raster, oracle::random::Random};

fn check(name: &str, keys: &[u32], count: usize, bits: u32) {
    let mut places: Vec<u32> = (0..count as u32).collect();
    places.sort_by_key(|&place| keys[place as usize]);
    let sorted: Vec<u32> = places.iter().map(|&p| keys[p as usize]).collect();
    let (keys, values) = sort_on(&raster(), keys, count, 0..bits).unwrap();
    assert!(keys == sorted, "{name}, {count} keys of {bits} bits");
    assert!(values == places, "{name}, {count} keys: ties out of order");
}

fn keys(len: usize) -> Vec<u32> {
    let mut random = Random::new(len as u64);
    (0..len).map(|_| random.bits() as u32).collect()
}

#[test]
fn counts_below_the_capacity_leave_the_rest_alone() {
    for count in [0, 1, 2048, 2049, 9_999] {
        check("part", &keys(10_000), count, 32);
    }
    let nothing = sort_on(&raster(), &[], 0, 0..32).unwrap();
    assert_eq!(nothing, (Vec::new(), Vec::new()));
}

#[test]
fn fewer_bits_take_fewer_passes() {
    for bits in [1, 7, 8, 9, 16, 17, 24] {
        let mask = u32::MAX >> (32 - bits);
        let keys: Vec<u32> = keys(5_000).iter().map(|key| key & mask).collect();
        check("narrow", &keys, keys.len(), bits);
    }
}
