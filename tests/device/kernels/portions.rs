//! Dispatches over tiles that are cut, as they are on devices that somebody watches.

use std::sync::Arc;

use gs_chroma::{
    gpu::default_tiles_at_once,
    low_level::doctor::{kernels::TOPICS, stage},
    raster::Raster,
};

use crate::kernels::{
    harness::{bits, gpu, splats},
    oracle::random::{Random, random_scene},
};

/// However many tiles a dispatch takes, the last one fewer, the result is the same bytes.
#[test]
fn cut_dispatches_give_the_same_bits() {
    let (scene, view) = random_scene::<1>(13, 400, 3);
    let splats = splats(&scene);
    let mut random = Random::new(2);
    let upstream: Vec<f64> = (0..view.width * view.height)
        .map(|_| random.range(-1.0, 1.0))
        .collect();
    let run = |tiles_at_once: usize| {
        let gpu = gpu().with_tiles_at_once(tiles_at_once);
        let raster = Arc::new(Raster::new(&gpu));
        let stage = stage::Stage::new(&raster, &splats, &view).unwrap();
        let gradient = stage.backward(&upstream).unwrap().bits_without(None);
        (bits(&stage.image().unwrap()), gradient)
    };
    let tiles = view.width.div_ceil(16) * view.height.div_ceil(16);
    assert!(tiles > 5, "{tiles}");
    let whole = run(usize::MAX);
    assert!(whole.0.iter().any(|&bits| bits != 0));
    for tiles_at_once in [1, 4, 5, tiles - 1, tiles, tiles + 1] {
        assert!(run(tiles_at_once) == whole, "{tiles_at_once} at once");
    }
}

/// The doctor on a device that is watched, with the kernels for a GPU and those for a processor:
/// colors and all adjoints, too.
#[test]
fn cut_dispatches_agree_with_the_oracle() {
    for simd in [false, true] {
        let gpu = gpu().with_tiles_at_once(2).with_simd(simd);
        let raster = Arc::new(Raster::new(&gpu));
        for (topic, measure) in TOPICS {
            if ["blend", "adjoint", "viewer"].contains(&topic) {
                for row in measure(&raster).unwrap() {
                    assert!(row.failures.is_empty(), "{topic}, simd {simd}: {row:?}");
                }
            }
        }
    }
}

/// A dispatch must not be folded into two dimensions, whose end would run into the next.
#[test]
fn watched_devices_take_few_tiles_at_once() {
    use wgpu::DeviceType::*;
    let [small, large] = [IntegratedGpu, DiscreteGpu].map(default_tiles_at_once);
    assert!(small < large && large <= 65_535);
    assert_eq!(default_tiles_at_once(Other), small);
    assert_eq!(default_tiles_at_once(Cpu), usize::MAX);
}
