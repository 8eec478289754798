//! `scan`: what happens beyond a limit, and without a total.

use gs_chroma::{
    low_level::doctor::kernels::{Scanned, scan_on},
    raster::{constants::*, groups::Groups},
};

use crate::kernels::harness::raster;

fn scan(values: &[u32], total_word: Option<usize>, limit: usize) -> Scanned {
    scan_on(&raster(), values, total_word, limit).unwrap()
}

#[test]
fn up_to_the_limit_only_the_total_is_noted() {
    for len in [0, 1, 1025, 262_145] {
        let values = vec![2; len];
        let Scanned { status, groups, .. } = scan(&values, Some(STATUS_INSTANCES), 2 * len);
        let mut words = [0; STATUS_WORDS];
        words[STATUS_INSTANCES] = 2 * len as u32;
        assert_eq!(status, words, "{len}");
        assert_eq!(groups, Groups::for_count(2 * len), "{len}");
    }
}

#[test]
fn beyond_the_limit_the_total_counts_as_nothing() {
    for len in [1, 257, 5000, 300_000] {
        let values = vec![3; len];
        let total = 3 * len as u32;
        let Scanned { status, groups, .. } =
            scan(&values, Some(STATUS_INSTANCES), total as usize - 1);
        let mut words = [0; STATUS_WORDS];
        (words[STATUS_OVERFLOW], words[STATUS_NEEDED]) = (1, total);
        assert_eq!(status, words, "{len}");
        assert_eq!(groups, Groups::for_count(0), "{len}");
    }
}

#[test]
fn without_a_total_the_status_stays_as_it_is() {
    let values = vec![5; 3000];
    let Scanned { sums, status, .. } = scan(&values, None, 0);
    assert!(sums.iter().enumerate().all(|(i, &sum)| sum == 5 * i as u32));
    assert_eq!(status, [0; STATUS_WORDS]);
}

/// More workgroups than there may be in one row.
#[test]
fn a_large_total_takes_several_rows() {
    let total = 70_000 * 256;
    let values = vec![total as u32 / 4; 4];
    let found = scan(&values, Some(STATUS_INSTANCES), total).groups;
    assert_eq!(found, Groups::for_count(total));
    assert_eq!(found[0].counts, [65_535, 2, 1]);
    // 8,750 blocks of 2,048.
    assert_eq!(found[2].counts, [8_750, 1, 1]);
    assert_eq!(found[3].length, 256 * 8_750);
}
