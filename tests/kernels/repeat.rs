//! The same bits every run, and whatever room the tile lists begin with.

use std::sync::{Arc, LazyLock};

use gs_chroma::{
    doctor::stage,
    luma::{LumaProgress, LumaSettings, LumaTrainer, TrainingView},
    optimize::view_at,
    raster::{Field, Geometry, Raster, Renderer},
    splats::Splats,
};

use crate::{
    harness::{Stage, bits, camera, gpu, raster, splats},
    oracle::{
        random::{Random, oblique_view, random_scene},
        scene::View,
    },
};

const COUNT: usize = 40;

/// A seed with which training begins with the far view.
const FAR_FIRST: u64 = 3;

/// Tile-list entries that a training begins with, for each Gaussian.
const ROOM: usize = 4;

#[test]
fn forward_and_backward_give_the_same_bits() {
    let (scene, view) = random_scene::<1>(11, 400, 3);
    let splats = splats(&scene);
    let mut random = Random::new(1);
    let upstream: Vec<f64> = (0..view.width * view.height)
        .map(|_| random.range(-1.0, 1.0))
        .collect();
    let run = || {
        let stage = Stage::new(&splats, &view);
        let gradient = stage.backward(&upstream).bits_without(None);
        (bits(&stage.image()), gradient, stage.tiles())
    };
    let first = run();
    for _ in 1..5 {
        assert!(run() == first);
    }
}

/// Timing a dispatch must not change what it computes; without timestamp queries
/// the host does it.
#[test]
fn timed_dispatches_give_the_same_bits() {
    let (scene, view) = random_scene::<1>(12, 200, 1);
    let splats = splats(&scene);
    let picture = Stage::new(&splats, &view).forward();
    let timed = gpu().timed().unwrap();
    let raster = Arc::new(Raster::new(&timed));
    let stage = stage::Stage::new(&raster, &splats, &view).unwrap();
    // More dispatches than one set of timestamps holds.
    for _ in 0..150 {
        assert_eq!(bits(&stage.forward().unwrap()), bits(&picture));
    }
    let times = timed.timings().unwrap();
    let blend = times.iter().find(|time| time.kernel == "blend").unwrap();
    assert_eq!(blend.dispatches, 150);
    assert!(times.iter().all(|time| time.seconds >= 0.0) && blend.seconds > 0.0);
    assert!(timed.timings().unwrap().is_empty());
    assert!(gpu().timings().unwrap().is_empty());
}

/// A far view, in which Gaussians touch few tiles, and two near ones.
fn views() -> Vec<View> {
    let view = |scale: f64, shift: f64| View {
        fx: 60.0 * scale,
        fy: 60.0 * scale,
        cx: 64.0,
        cy: 48.0,
        width: 128,
        height: 96,
        translation: [0.3 + shift, -0.2, 0.5],
        ..oblique_view()
    };
    vec![view(0.25, 0.0), view(1.3, 0.1), view(1.2, -0.1)]
}

/// Trains on pictures of a scene, starting beside it; gives the splats and
/// what was reported.
fn train(start: &Splats, target: &Splats) -> (Splats, Vec<LumaProgress>) {
    let mut settings = LumaSettings::new(60);
    settings.seed = FAR_FIRST;
    settings.sh_degree = 1;
    settings.pull_threshold = 1e-6;
    // Ten more, however many bystanders there are.
    settings.max_splats = start.len() + 10;
    settings.prune_share = 1.0;
    settings.schedule.densify_from = 20;
    settings.schedule.densify_every = 25;
    settings.schedule.densify_until = 60;
    settings.schedule.reset_every = 40;
    settings.schedule.raise_degree_every = 20;
    let geometry = Geometry::upload(gpu(), target).unwrap();
    let field = Field::upload(gpu(), &target.sh).unwrap();
    let mut renderer = Renderer::new(raster(), geometry, vec![field], 0.01).unwrap();
    let photos = views().into_iter().map(|view| {
        let camera = camera(&view);
        let picture = renderer.render(&camera).unwrap().remove(0);
        let gray = picture.pixels.iter().map(|v| (v * 255.0) as u8).collect();
        TrainingView::new(camera, gray)
    });
    let views = photos.collect();
    let mut trainer = LumaTrainer::new(raster(), settings, 4.0, start, views).unwrap();
    let mut reports = Vec::new();
    trainer
        .train(&mut |progress| reports.push(progress))
        .unwrap();
    (trainer.splats().unwrap(), reports)
}

fn start_and_target() -> [Splats; 2] {
    let mut target = splats(&random_scene::<1>(12, COUNT, 1).0);
    let scales = target.log_scales.as_flattened_mut();
    scales.iter_mut().for_each(|scale| *scale += 0.9);
    let mut start = target.clone();
    let mut random = Random::new(3);
    for value in start.means.as_flattened_mut() {
        *value += random.range(-0.05, 0.05) as f32;
    }
    start.sh.coefficients.fill(0.1);
    start.opacity_logits.fill(-1.5);
    [start, target]
}

fn same(a: &Splats, b: &Splats) -> bool {
    let all = |s: &Splats| {
        let [means, scales] = [&s.means, &s.log_scales].map(|v| bits(v.as_flattened()));
        let quats = bits(s.quats.as_flattened());
        let rest = [&s.opacity_logits, &s.sh.coefficients].map(|v| bits(v));
        (means, scales, quats, rest)
    };
    all(a) == all(b)
}

/// A training whose lists overflow, and what it reported.
static TRAINED: LazyLock<(Splats, Vec<LumaProgress>)> = LazyLock::new(|| {
    let [start, target] = start_and_target();
    train(&start, &target)
});

#[test]
fn training_twice_gives_the_same_splats() {
    let [start, target] = start_and_target();
    let (first, reports) = &*TRAINED;
    assert!(first.len() > COUNT, "densification took place");
    let iterations: Vec<_> = reports.iter().map(|r| r.iteration).collect();
    assert_eq!(iterations, [25, 40, 50, 60]);
    let losses: Vec<_> = reports.iter().map(|r| r.loss).collect();
    let least = losses.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(least < losses[0], "training learns: {losses:?}");
    assert!(same(&train(&start, &target).0, first));
}

/// Gaussians behind every camera change nothing but the room that the lists
/// begin with: with them nothing overflows, without them every near view does.
#[test]
fn overflow_changes_nothing() {
    let [start, target] = start_and_target();
    let entries = entries(&start);
    let room = COUNT * ROOM;
    assert!(entries[0] <= room && entries[1] > room, "{entries:?}");
    // The overflow comes after a step that has to be kept.
    assert_eq!(view_at(FAR_FIRST, entries.len(), 0), 0);
    let bystanders = 500;
    assert!(entries.iter().all(|&needed| 2 * needed < bystanders * ROOM));
    let [centre, forward] = [oblique_view().centre(), oblique_view().rotation[2]];
    let mut roomy = start.clone();
    for _ in 0..bystanders {
        let behind = std::array::from_fn(|k| (centre[k] - 50.0 * forward[k]) as f32);
        roomy.means.push(behind);
        roomy.quats.push([1.0, 0.0, 0.0, 0.0]);
        roomy.log_scales.push([-3.0; 3]);
        roomy.opacity_logits.push(1.0);
        roomy.sh.coefficients.extend([0.0; 4]);
    }
    let (long, _) = train(&roomy, &target);
    assert!(same(&TRAINED.0, &without(&long, bystanders)));
}

/// Tile-list entries that each view needs.
fn entries(splats: &Splats) -> Vec<usize> {
    let count = |view: View| {
        let stage = Stage::new(splats, &view);
        stage.forward();
        stage.status().instances
    };
    views().into_iter().map(count).collect()
}

/// The splats without those behind every camera.
fn without(splats: &Splats, bystanders: usize) -> Splats {
    let keep: Vec<usize> = (0..splats.len())
        .filter(|&i| splats.sh.coefficients[4 * i..4 * i + 4] != [0.0; 4])
        .collect();
    assert_eq!(keep.len() + bystanders, splats.len());
    let mut kept = Splats {
        means: keep.iter().map(|&i| splats.means[i]).collect(),
        quats: keep.iter().map(|&i| splats.quats[i]).collect(),
        log_scales: keep.iter().map(|&i| splats.log_scales[i]).collect(),
        opacity_logits: keep.iter().map(|&i| splats.opacity_logits[i]).collect(),
        sh: splats.sh.clone(),
    };
    kept.sh.coefficients = keep
        .iter()
        .flat_map(|&i| splats.sh.coefficients[4 * i..4 * i + 4].to_vec())
        .collect();
    kept
}
