//! Dispatches over tiles that are cut, as they are on devices that somebody watches.

use std::sync::Arc;

use gs_chroma::{
    gpu::default_tiles_at_once,
    low_level::doctor::{kernels::TOPICS, stage},
    raster::Raster,
    splats::{ShField, Splats},
};

use crate::kernels::{
    harness::{bits, gpu, splats},
    oracle::{
        random::{Random, random_scene, random_view},
        view::View,
    },
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

/// Small, faint Gaussians in one tile, near the number at which llvmpipe ends a thread's loops
/// (docs/limits.md): the kernels for processors and those for GPUs draw and differentiate all.
#[test]
fn long_lists_are_drawn_to_their_end() {
    let view = View {
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        translation: [0.0; 3],
        fx: 16.0,
        fy: 16.0,
        cx: 8.0,
        cy: 8.0,
        width: 16,
        height: 16,
        ..random_view(0)
    };
    let count = 25_000;
    let mut random = Random::new(7);
    let splats = Splats {
        means: (0..count)
            .map(|_| {
                let [x, y, z] = random.array(-1.0, 1.0);
                let depth = 2.0 + 0.5 * z;
                [x * 0.48 * depth, y * 0.48 * depth, depth].map(|v: f64| v as f32)
            })
            .collect(),
        quats: vec![[1.0, 0.0, 0.0, 0.0]; count],
        log_scales: vec![[-8.0; 3]; count],
        opacity_logits: vec![-5.2; count],
        sh: ShField {
            degree: 0,
            channels: 1,
            coefficients: (0..count).map(|_| random.range(-1.0, 1.0) as f32).collect(),
        },
    };
    let upstream = vec![1.0; view.width * view.height];
    let [gpus, processors] = [false, true].map(|simd| {
        let raster = Arc::new(Raster::new(&gpu().with_simd(simd)));
        let stage = stage::Stage::with_capacity(&raster, &splats, &view, 2 * count).unwrap();
        let image = stage.forward().unwrap();
        assert_eq!(stage.status().unwrap().instances, count);
        (image, stage.backward(&upstream).unwrap().field)
    });
    let apart = |a: &[f32], b: &[f32]| {
        let each = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        each.fold(0.0, f32::max)
    };
    assert!(apart(&gpus.0, &processors.0) < 1e-5);
    assert!(apart(&gpus.1, &processors.1) < 1e-7);
    // The farthest that any pixel shows has a gradient, too.
    let last = splats.means.iter().zip(&processors.1);
    let last = last.filter(|(_, gradient)| **gradient != 0.0);
    let last = last.map(|([_, _, z], _)| *z).fold(0.0, f32::max);
    assert!(last > 2.499, "{last}");
}
