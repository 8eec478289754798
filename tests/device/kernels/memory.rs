//! Estimates of both stages' device memory hold.

use std::{ops::ControlFlow, sync::Arc};

use gs_chroma::{
    chroma::{
        ChromaError, ChromaSettings, FrozenField, FrozenViews, IrlsSolver, MemoryBudget, Targets,
        Task, bake, solve, teacher::AbImage,
    },
    gpu::{Gpu, GpuError},
    luma::{Demand, LumaError, LumaSettings, LumaTrainer, TrainingView, resident_photos},
    raster::{ColorKind, Raster},
    splats::{Splats, init::initial_splats},
};

use crate::kernels::{
    harness::{camera, cameras},
    oracle::random::{Random, oblique_view},
};

const COUNT: usize = 100_000;

/// Color fields that stage 2 solves for, in harmonics of a degree, each kind and each degree once;
/// RGB is for new light.
const SOLVED: [(ColorKind, u32); 2] = [(ColorKind::Chroma, 3), (ColorKind::Rgb, 0)];

fn start(count: usize, sh_degree: u32) -> Splats {
    let mut random = Random::new(4);
    let points: Vec<_> = (0..count)
        .map(|_| (random.array(-1.0, 1.0).map(|v| v as f32), 0.5))
        .collect();
    initial_splats(&points, 1.0, sh_degree)
}

fn trainer(gpu: &Gpu, start: &Splats, limit: Option<u64>) -> Result<LumaTrainer, LumaError> {
    let camera = camera(&oblique_view());
    let gray = vec![128; (camera.width * camera.height) as usize];
    let settings = LumaSettings {
        memory_limit: limit,
        ..LumaSettings::new(10)
    };
    let raster = Arc::new(Raster::new(gpu));
    LumaTrainer::new(
        raster,
        settings,
        1.0,
        start,
        vec![TrainingView::new(camera, gray)],
    )
}

#[test]
fn a_training_takes_what_was_estimated() {
    for sh_degree in [0, 3] {
        // A device of its own: other tests allocate on the shared one.
        let gpu = Gpu::open().unwrap();
        let start = start(COUNT, sh_degree);
        let before = gpu.allocated_bytes().unwrap();
        let _trainer = trainer(&gpu, &start, None).unwrap();
        // What uploads pass through is free again once they are done.
        gpu.queue().submit([]);
        gpu.wait().unwrap();
        let taken = (gpu.allocated_bytes().unwrap() - before) as f64;
        let demand = Demand::of([camera(&oblique_view())].iter(), false, sh_degree, u64::MAX);
        let expected = demand.bytes(COUNT, 4 * COUNT) as f64;
        let ratio = taken / expected;
        assert!((0.98..1.02).contains(&ratio), "degree {sh_degree}: {ratio}");
    }
}

#[test]
fn what_is_beyond_the_limit_is_refused_before_it_is_taken() {
    let gpu = Gpu::open().unwrap();
    let start = start(COUNT, 0);
    let before = gpu.allocated_bytes().unwrap();
    let refused = trainer(&gpu, &start, Some(30 << 20)).err().unwrap();
    let LumaError::Gpu(GpuError::OverLimit { splats, needed, .. }) = refused else {
        panic!("{refused}");
    };
    assert_eq!(splats, COUNT);
    assert!(needed > 30 << 20);
    // Parameters and pictures come first; the rest is never asked for.
    gpu.wait().unwrap();
    assert!(gpu.allocated_bytes().unwrap() - before < 10 << 20);
}

/// Photos that would take more than a quarter of the limit come one at a time, and all where
/// settings say so.
#[test]
fn streamed_photos_train_alike() {
    let gpu = Gpu::open().unwrap();
    let camera = camera(&oblique_view());
    let pixels = (camera.width * camera.height) as usize;
    let views: Vec<TrainingView> = (0..20)
        .map(|k| {
            let gray = (0..pixels).map(|p| (p * (k + 1)) as u8).collect();
            TrainingView::new(camera.clone(), gray)
        })
        .collect();
    let cameras = || views.iter().map(|view| &view.camera);
    let start = initial_splats(&[([0.0; 3], 0.5), ([0.1, 0.2, 0.0], 0.3)], 1.0, 0);
    let demand = |settings: &LumaSettings| {
        Demand::of(
            cameras(),
            false,
            settings.sh_degree,
            resident_photos(settings),
        )
    };
    let resident = LumaSettings::new(45);
    let all = demand(&resident);
    let limited = LumaSettings {
        memory_limit: Some(4 * all.photos - 4),
        ..resident.clone()
    };
    let streamed = LumaSettings {
        stream_photos: true,
        ..resident.clone()
    };
    assert!(!all.streams && demand(&limited).streams && demand(&streamed).streams);
    let raster = Arc::new(Raster::new(&gpu));
    let trained = |settings| {
        let raster = raster.clone();
        let mut trainer = LumaTrainer::new(raster, settings, 1.0, &start, views.clone()).unwrap();
        trainer.train(&mut |_| {}).unwrap();
        trainer.splats().unwrap()
    };
    let [resident, limited, streamed] = [resident, limited, streamed].map(trained);
    assert!(resident == limited && resident == streamed);
}

/// Gaussians that wait on the host: the device holds those of one view.
#[test]
fn coloring_from_the_host_takes_what_was_estimated() {
    for (color, sh_degree) in SOLVED {
        let of_limit = |limit| coloring(color, sh_degree, Some(limit), true);
        let Err(ChromaError::OverLimit { needed, splats, .. }) = of_limit(1) else {
            panic!("a byte is enough");
        };
        assert!(splats <= COUNT / 10, "{splats}");
        let (taken, estimated, views) = of_limit(needed).unwrap();
        assert_eq!((estimated, views), (needed, 0));
        let ratio = taken as f64 / estimated as f64;
        // What is on its way is gone at times.
        let what = format!("{color:?}, degree {sh_degree}: {ratio:.3}");
        assert!((0.7..1.01).contains(&ratio), "{what}");
    }
}

/// The most that the device holds while stage 2 solves and bakes at a degree, or while RGB is
/// solved for; what it was said to hold, and how many views stayed there.
fn coloring(
    color: ColorKind,
    sh_degree: u32,
    limit: Option<u64>,
    streams: bool,
) -> Result<(u64, u64, usize), ChromaError> {
    let gpu = Gpu::open().unwrap();
    let luma_degree = if color == ColorKind::Rgb {
        sh_degree
    } else {
        1
    };
    let luma = start(COUNT / 10, luma_degree);
    let cameras: Vec<_> = cameras().iter().map(|c| c.resized(200, 150)).collect();
    let mut targets = Targets::new(3);
    let tasks = (cameras.iter().enumerate()).map(|(view, camera)| {
        let [width, height] = [camera.width, camera.height];
        let pixels = (width * height) as usize;
        let target = match color {
            ColorKind::Rgb => targets.push_rgb([width, height], &vec![[0.3; 3]; pixels], None)?,
            _ => {
                let ab = vec![[20.0, -10.0]; pixels];
                targets.push_ab(&AbImage { width, height, ab }, None)?
            }
        };
        Ok::<_, ChromaError>(Task { view, target })
    });
    let tasks = tasks.collect::<Result<Vec<_>, _>>()?;
    let raster = Arc::new(Raster::new(&gpu));
    let before = gpu.allocated_bytes().unwrap();
    let room = MemoryBudget {
        limit,
        color,
        sh_degree,
        weighted: false,
        streams,
    };
    // New light is solved for at one scale, too.
    let scales = if streams || color == ColorKind::Rgb {
        1
    } else {
        3
    };
    let frozen = FrozenViews::new(&raster, &luma, 1.0, &cameras, scales, room)?;
    assert_eq!(frozen.streamed().is_some(), streams && limit.is_some());
    // What comes and goes is met by looking more often.
    let rounds = if streams { 2 } else { 1 };
    let mut peak = 0;
    let mut look = |_| {
        peak = peak.max(gpu.allocated_bytes().unwrap() - before);
        ControlFlow::Continue(())
    };
    let settings = ChromaSettings {
        sh_degree,
        rounds,
        ..ChromaSettings::irls()
    };
    if color == ColorKind::Rgb {
        let start = luma.sh.to_rgb();
        IrlsSolver::starting_at(&frozen, &settings, &targets, tasks, &start)?.run(&mut look)?;
    } else {
        let solved = solve(&frozen, &settings, &targets, tasks, &mut look)?;
        // Rounds of the bake take the same, one after the other.
        let baked = bake(&frozen, &luma, &solved.chroma, &mut |progress| {
            let looked = look(progress);
            if progress.iteration < rounds {
                looked
            } else {
                ControlFlow::Break(())
            }
        });
        assert!(matches!(baked, Err(ChromaError::Cancelled)));
    }
    Ok((peak, frozen.demand(), frozen.pinned()))
}

#[test]
fn coloring_takes_what_was_estimated() {
    for (color, sh_degree) in SOLVED {
        let of_limit = |limit| coloring(color, sh_degree, limit, false);
        let Err(ChromaError::OverLimit { needed, .. }) = of_limit(Some(1)) else {
            panic!("a byte is enough");
        };
        let all = of_limit(None).unwrap();
        let one = of_limit(Some(needed)).unwrap();
        assert_eq!((all.2, one.2), (5, 0));
        let mut found = vec![all, one];
        // Between both: at one degree, for that takes less time.
        if sh_degree == 0 {
            let half = of_limit(Some((needed + all.1) / 2)).unwrap();
            assert!((1..5).contains(&half.2), "{}", half.2);
            found.push(half);
        }
        for (taken, estimated, views) in found {
            let ratio = taken as f64 / estimated as f64;
            let what = format!("{color:?}, degree {sh_degree}, {views} views: {ratio:.3}");
            assert!((0.97..1.01).contains(&ratio), "{what}");
        }
    }
}
