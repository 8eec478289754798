//! Densification by the rules that 3D Gaussian Splatting publishes (Kerbl et al. 2023): its
//! numbers, and what follows from them.

use gs_chroma::{
    luma::{
        DensifyRules, LumaSettings, Schedule,
        densify::{Descent, Evidence},
        densify_3dgs::{Moment, begin, plan, reset},
    },
    raster::constants::*,
    splats::{InitialPoint, initial_splats},
};

/// arXiv 2308.04079 and its code: every 100 from 500 to 15,000, resets every 3,000, a
/// degree every 1,000; of 30,000 iterations, of which luma takes half.
#[test]
fn the_published_schedule() {
    let published =
        |iterations| Schedule::of(&LumaSettings::new(iterations).by(DensifyRules::Published));
    let schedule = published(15_000);
    let phases = |schedule: &Schedule| {
        [
            schedule.densify_from,
            schedule.densify_until,
            schedule.densify_every,
            schedule.reset_every.unwrap(),
            schedule.raise_degree_every,
            schedule.settle_from,
        ]
    };
    assert_eq!(phases(&schedule), [500, 15_000, 100, 3_000, 1_000, 15_000]);
    assert_eq!(schedule.densifications(), 144);
    let resets = (1..=15_000).filter(|&i| schedule.resets_after(i));
    assert_eq!(resets.collect::<Vec<_>>(), [3_000, 6_000, 9_000, 12_000]);
    assert_eq!(schedule.settling(14_999), 1.0);
    assert_eq!(
        phases(&published(30_000)),
        [500, 15_000, 100, 3_000, 1_000, 30_000]
    );
    assert_eq!(phases(&published(1_500)), [50, 1_500, 25, 300, 100, 1_500]);
    let own = Schedule::of(&LumaSettings::new(15_000));
    assert!(!own.resets_after(3_000));
}

#[test]
fn published_rates_are_those_of_a_longer_run() {
    let means = |iterations| {
        LumaSettings::new(iterations)
            .by(DensifyRules::Published)
            .rates
            .means
    };
    for (iterations, last) in [(60, 1.6e-5), (15_000, 1.6e-5), (30_000, 1.6e-6)] {
        let [first, found] = means(iterations);
        assert_eq!(first, 1.6e-4);
        assert!((found / last - 1.0).abs() < 1e-12, "{iterations}: {found}");
    }
    let preset = LumaSettings::new(700);
    let published = preset.clone().by(DensifyRules::Published);
    assert_eq!(
        [published.pull_threshold, published.prune_opacity],
        [2e-4, 0.005]
    );
    assert_eq!(published.by(DensifyRules::Own), preset);
}

const EXTENT: f64 = 2.0;

/// [`capped`] where there is no lack of room.
fn planned(
    gaussians: &[(f32, f32, f32)],
    held: usize,
    removes_large: bool,
    iteration: usize,
) -> Vec<Descent> {
    capped(1_000_000, gaussians, held, removes_large, iteration)
}

/// The plan for at most `max_splats` Gaussians of (standard deviation, opacity, mean signed pull),
/// the last `held` of them held.
fn capped(
    max_splats: usize,
    gaussians: &[(f32, f32, f32)],
    held: usize,
    removes_large: bool,
    iteration: usize,
) -> Vec<Descent> {
    let n = gaussians.len();
    let mut geometry = vec![0.0; GEOMETRY_PLANES * n];
    let mut statistics = vec![0.0; STATISTICS_PLANES * n];
    for (i, &(deviation, opacity, pull)) in gaussians.iter().enumerate() {
        geometry[PLANE_QUAT * n + i] = 1.0;
        // The largest axis counts.
        for (axis, share) in [0.1, 1.0, 0.01].into_iter().enumerate() {
            geometry[(PLANE_LOG_SCALE + axis) * n + i] = (share * deviation).ln();
        }
        geometry[PLANE_OPACITY * n + i] = (opacity / (1.0 - opacity)).ln();
        // Seen in four views.
        statistics[STAT_PULL * n + i] = 4.0 * pull;
        statistics[STAT_VIEWS * n + i] = 4.0;
    }
    let evidence = Evidence {
        geometry: &geometry,
        statistics: &statistics,
        held,
        reserved: 0,
    };
    let moment = Moment {
        iteration,
        extent: EXTENT,
        removes_large,
    };
    let settings = LumaSettings {
        max_splats,
        ..LumaSettings::new(15_000).by(DensifyRules::Published)
    };
    plan(&settings, &evidence, &moment)
}

fn sources(plan: &[Descent]) -> Vec<(u32, u32)> {
    plan.iter().map(|d| (d.source, d.survives)).collect()
}

/// Either side of each published bound: a gradient of 2e-4, 0.01 extents, an opacity of 0.005.
#[test]
fn small_ones_are_cloned_large_ones_split_faint_ones_removed() {
    let gaussians = [
        (0.019, 0.5, 2.1e-4),
        (0.021, 0.5, 2.1e-4),
        (0.021, 0.5, 1.9e-4),
        (0.019, 0.0049, 1.0),
        (0.019, 0.0051, 0.0),
    ];
    let plan = planned(&gaussians, 0, false, 600);
    let split = [(1, 0), (1, 0)];
    let cloned = [(0, 1), (0, 0)];
    assert_eq!(
        sources(&plan),
        [&[(2, 1), (4, 1)][..], &cloned, &split].concat()
    );
    let clone = plan[3];
    assert_eq!((clone.offset, clone.log_growth), ([0.0; 3], [0.0; 3]));
    assert!(plan.iter().all(|descent| descent.logit_step == 0.0));
    for half in &plan[4..] {
        assert_eq!(half.log_growth, [-0.470_003_63; 3]);
        assert!(half.offset.iter().all(|x| *x != 0.0));
    }
    assert_ne!(plan[4].offset, plan[5].offset);
}

/// What a split makes small enough stays: 0.1 extents of 2 are 0.2, and 0.3 / 1.6 is less.
#[test]
fn large_ones_go_once_opacities_were_reset() {
    let gaussians = [
        (0.19, 0.5, 0.0),
        (0.21, 0.5, 0.0),
        (0.3, 0.5, 1.0),
        (0.33, 0.5, 1.0),
        (9.0, 0.5, 1.0),
    ];
    let all = planned(&gaussians, 1, false, 3_000);
    assert_eq!(all.len(), 2 + 4 + 1);
    let some = planned(&gaussians, 1, true, 3_100);
    assert_eq!(sources(&some), [(0, 1), (2, 0), (2, 0), (4, 1)]);
}

/// Published division comes before removal: a full set divides into the room that large ones leave.
#[test]
fn what_goes_makes_room() {
    let gaussians = [
        (0.3, 0.5, 1.0),
        (0.33, 0.5, 0.0),
        (0.3, 0.5, 2.0),
        (0.1, 0.5, 3.0),
        (9.0, 0.5, 0.0),
    ];
    let plan = |most| sources(&capped(most, &gaussians, 0, true, 3_100));
    assert_eq!(plan(3), [(3, 0), (3, 0)]);
    assert_eq!(plan(5), [(2, 0), (2, 0), (3, 0), (3, 0)]);
    let all = [(0, 0), (0, 0), (2, 0), (2, 0), (3, 0), (3, 0)];
    assert_eq!(plan(6), all);
}

#[test]
fn halves_are_samples_of_the_whole_that_repeat() {
    let gaussians = vec![(0.1, 0.5, 1.0); 2_000];
    let plan = planned(&gaussians, 0, false, 700);
    assert!(plan == planned(&gaussians, 0, false, 700));
    assert!(plan != planned(&gaussians, 0, false, 800));
    let samples = || {
        plan.iter()
            .flat_map(|descent| descent.offset.map(f64::from))
    };
    let count = samples().count() as f64;
    let mean = samples().sum::<f64>() / count;
    let variance = samples().map(|x| x * x).sum::<f64>() / count;
    assert!(
        mean.abs() < 0.03 && (variance - 1.0).abs() < 0.05,
        "{mean} {variance}"
    );
}

#[test]
fn a_reset_leaves_a_hundredth() {
    let mut logits = [3.0, -4.0, -4.6, f32::NEG_INFINITY];
    reset(&mut logits);
    let most = (1.0_f64 / 99.0).ln() as f32;
    assert_eq!(logits, [most, most, -4.6, f32::NEG_INFINITY]);
}

/// As wide as the root mean square of three distances, an opacity of 0.1.
#[test]
fn first_gaussians_are_thin_and_touch() {
    let points = [0.0, 3.0]
        .map(|x| ([x, 0.0, 0.0], 0.5))
        .map(InitialPoint::from);
    let mut splats = initial_splats(&points, 1.0, 0);
    begin(&mut splats);
    for i in 0..2 {
        assert!((splats.log_scales[i][0] - 3.0_f32.ln()).abs() < 1e-6);
        assert!((splats.opacity_logits[i] + 9.0_f32.ln()).abs() < 1e-6);
    }
}
