//! `sort`: a stable radix sort.

use std::{ops::Range, sync::Arc};

use crate::{
    doctor::measured::{Row, Sample},
    gpu::{Buffer, GpuError, Recorder},
    oracle::random::Random,
    raster::{Raster, constants::STATUS_WORDS, groups::Count, sort::Sort},
};

/// Makes a key of its place and a random number.
type Pattern = fn(u32, u32) -> u32;

const PATTERNS: [Pattern; 6] = [
    |_, random| random,
    // Equal, sorted, reversed, few distinct, extremes.
    |_, _| 0xdead_beef,
    |i, _| i * 3,
    |i, _| u32::MAX - i * 5,
    |_, random| random % 5 * 0x0101_0101,
    |_, random| if random % 2 == 0 { 0 } else { u32::MAX },
];

/// Around the sizes of a workgroup and of its block.
const LENGTHS: [usize; 10] = [1, 2, 255, 256, 257, 2047, 2048, 2049, 20_000, 100_000];

/// Sorts the first `count` keys by these `bits` of theirs on the device; gives them
/// with the places they had.
pub fn sort_on(
    raster: &Raster,
    keys: &[u32],
    count: usize,
    bits: Range<u32>,
) -> Result<(Vec<u32>, Vec<u32>), GpuError> {
    let gpu = &raster.gpu;
    let status = Buffer::zeros(gpu, "status", STATUS_WORDS)?;
    let (kernels, scan) = (raster.sort_kernels(), raster.scan_kernels());
    let (count_of, room) = (Count::new(gpu, count)?, keys.len());
    let sort = Sort::new(gpu, kernels, scan, &status, &count_of, room, bits)?;
    let places: Vec<u32> = (0..room as u32).collect();
    sort.keys[0].write(gpu, keys);
    sort.values[0].write(gpu, &places);
    let mut recorder = Recorder::new(gpu);
    sort.record(kernels, &mut recorder);
    recorder.submit();
    let read = |buffer: &Buffer<u32>| Ok(buffer.read(gpu)?[..count].to_vec());
    Ok((read(sort.sorted_keys())?, read(sort.sorted_values())?))
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let wide = |values: Vec<u32>| values.into_iter().map(f64::from).collect();
    let (mut sorted, mut origins) = (Vec::new(), Vec::new());
    for pattern in PATTERNS {
        for length in LENGTHS {
            let mut random = Random::new(length as u64);
            let keys: Vec<u32> = (0..length as u32)
                .map(|i| pattern(i, random.bits() as u32))
                .collect();
            let mut places: Vec<u32> = (0..length as u32).collect();
            places.sort_by_key(|&place| keys[place as usize]);
            let expected = places.iter().map(|&p| keys[p as usize]).collect();
            let (keys, values) = sort_on(raster, &keys, length, 0..32)?;
            sorted.push(Sample::new(wide(keys), wide(expected)));
            origins.push(Sample::new(wide(values), wide(places)));
        }
    }
    Ok(vec![
        Row::exact("sort", "keys", &sorted),
        Row::exact("sort", "ties in order", &origins),
    ])
}
