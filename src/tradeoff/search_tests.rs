//! The search, on models of quality and time.

use super::report::{Outcome, Point, PointStage, Seconds, Setting};
use super::search::next;
use super::space::{Space, Task, Value, base_name};

/// How a knob's value changes the stage's time and its quality, in dB or ΔE00.
type Effect = (&'static str, &'static str, f64, f64);

const LUMA: [Effect; 5] = [
    ("iterations", "350", 0.5, -1.0),
    ("iterations", "1400", 2.0, 1.0),
    // Half the time for a tenth of the quality that half the iterations cost.
    ("max-splats", "500", 0.5, -0.1),
    // Worth more than the time it takes.
    ("ssim-window", "7", 1.1, 0.8),
    // Worth nothing.
    ("sh-degree", "3", 2.0, -0.5),
];

/// Worth more still.
const PAPER: Effect = ("preset", "paper", 1.1, 0.9);

const COLOR: [Effect; 4] = [
    ("rounds", "2", 0.5, 0.5),
    ("rounds", "8", 2.0, -0.1),
    ("scales", "1", 0.9, -0.3),
    ("chroma-degree", "1", 1.2, -0.2),
];

const BASE_SECONDS: f64 = 40.0;
const BASE_ITERATIONS: usize = 700;

fn space(color: bool) -> Space {
    let values = |stage, effects: &[Effect]| -> Vec<Value> {
        let value = |&(knob, value, time, _): &Effect| Value {
            knob,
            value: value.to_owned(),
            stage,
            time,
            conflicts: &[],
        };
        effects.iter().map(value).collect()
    };
    Space {
        values: [
            values(PointStage::Luma, &LUMA),
            values(PointStage::Color, &COLOR),
        ]
        .concat(),
        iterations: BASE_ITERATIONS,
        color,
    }
}

/// The model's time factor and quality of settings.
fn model(settings: &[Setting], effects: &[Effect]) -> (f64, f64) {
    settings
        .iter()
        .fold((1.0, 0.0), |(time, quality), setting| {
            let known = (effects.iter())
                .chain([&PAPER])
                .find(|e| e.0 == setting.knob && e.1 == setting.value);
            let (factor, change) = known.map_or_else(
                || {
                    let ratio =
                        setting.value.parse::<f64>().expect("iterations") / BASE_ITERATIONS as f64;
                    (ratio, ratio.log2())
                },
                |effect| (effect.2, effect.3),
            );
            (time * factor, quality + change)
        })
}

/// What running a task comes to.
fn run(task: &Task) -> Point {
    let color = task.stage == PointStage::Color;
    let (time, quality) = model(&task.settings, if color { &COLOR } else { &LUMA });
    let own = BASE_SECONDS * time;
    let seconds = Seconds {
        train: if color { BASE_SECONDS } else { own },
        distill: if color { own } else { 0.0 },
        ..Seconds::default()
    };
    Point {
        name: task.name.clone(),
        stage: task.stage,
        phase: task.phase,
        settings: task.settings.clone(),
        commands: Vec::new(),
        took: own + 3.0,
        failed: None,
        outcome: Some(Outcome {
            iterations: BASE_ITERATIONS,
            splats: 1000,
            seconds: seconds.summed(),
            psnr: Some(24.0 + if color { 0.0 } else { quality }),
            corrected_psnr: None,
            ssim: None,
            delta_e: color.then_some(10.0 + quality),
            consistency: None,
            colorfulness: None,
            teacher_colorfulness: None,
            peak_host_memory: None,
            peak_device_memory: None,
        }),
    }
}

/// A whole sweep from points that are there.
fn sweep(space: &Space, mut points: Vec<Point>, budget: f64) -> Vec<Point> {
    while let Some(task) = next(space, &points, budget) {
        assert!(
            points.iter().all(|point| point.name != task.name),
            "{task:?} again"
        );
        points.push(run(&task));
        assert!(points.len() < 200, "no end");
    }
    points
}

fn names(points: &[Point]) -> Vec<&str> {
    points.iter().map(|point| &point.name[..]).collect()
}

const PLENTY: f64 = 1e5;

#[test]
fn the_base_comes_first_and_single_knobs_cheapest_first() {
    let points = sweep(&space(true), Vec::new(), PLENTY);
    let names = names(&points);
    assert_eq!(names[..2], ["base", "color"]);
    let singles = [
        "iterations-350",
        "max-splats-500",
        "rounds-2",
        "scales-1",
        "ssim-window-7",
        "chroma-degree-1",
        "iterations-1400",
        "sh-degree-3",
        "rounds-8",
    ];
    assert_eq!(names[2..11], singles);
}

#[test]
fn what_proved_itself_is_combined_at_few_iterations_first() {
    let points = sweep(&space(false), Vec::new(), PLENTY);
    let names = names(&points);
    // Two proved themselves: each alone and both, halved at each rung.
    for name in [
        "max-splats-500+ssim-window-7+iterations-175",
        "ssim-window-7+iterations-175",
        "max-splats-500+ssim-window-7+iterations-350",
        "max-splats-500+ssim-window-7",
        "max-splats-500+ssim-window-7+iterations-1400",
    ] {
        assert!(names.contains(&name), "{name}: {names:?}");
    }
    assert!(
        !names.iter().any(|name| name.contains("sh-degree-3+")),
        "{names:?}"
    );
    let at = |part: &str| {
        names
            .iter()
            .filter(|n| n.contains('+') && n.ends_with(part))
            .count()
    };
    assert_eq!((at("-175"), at("-1400")), (3, 1), "{names:?}");
}

/// A preset is many knobs: as well as it does, none is turned with it.
#[test]
fn a_preset_stands_alone() {
    let mut space = space(false);
    let mut preset = space.values[3].clone();
    (preset.knob, preset.value) = ("preset", "paper".to_owned());
    space.values.push(preset);
    let points = sweep(&space, Vec::new(), PLENTY);
    let with: Vec<&str> = names(&points)
        .into_iter()
        .filter(|name| name.contains("preset"))
        .collect();
    assert_eq!(with, ["preset-paper"]);
}

#[test]
fn colors_are_combined_too() {
    let points = sweep(&space(true), Vec::new(), PLENTY);
    assert!(names(&points).contains(&"scales-1+chroma-degree-1"));
}

#[test]
fn the_budget_is_kept_and_the_base_runs_anyway() {
    for budget in [1.0, 100.0, 200.0, 300.0, 450.0, 600.0, 2000.0] {
        let points = sweep(&space(true), Vec::new(), budget);
        let spent: f64 = points.iter().map(|point| point.took).sum();
        let bases: f64 = points[..2].iter().map(|point| point.took).sum();
        assert!(spent <= budget.max(bases), "{spent} of {budget}");
        // The model's times are as expected, so that what is left is less than the
        // cheapest point.
        assert!(points.len() > 2 || budget < bases + BASE_SECONDS / 2.0 + 3.0);
    }
}

#[test]
fn combinations_have_a_share_of_a_small_budget() {
    let points = sweep(&space(false), Vec::new(), 400.0);
    let names = names(&points);
    assert!(names.iter().any(|name| name.contains('+')), "{names:?}");
}

/// Stopped after any point, a sweep asks for the same points as without a break.
#[test]
fn a_sweep_that_goes_on_asks_for_the_same() {
    let whole = sweep(&space(true), Vec::new(), 900.0);
    for stop in 0..whole.len() {
        let resumed = sweep(&space(true), whole[..stop].to_vec(), 900.0);
        assert_eq!(names(&resumed), names(&whole), "after {stop}");
    }
}

#[test]
fn what_failed_is_not_asked_again_nor_combined() {
    let space = space(false);
    let mut points = Vec::new();
    while let Some(task) = next(&space, &points, PLENTY) {
        assert!(
            points.iter().all(|p: &Point| p.name != task.name),
            "{task:?} again"
        );
        let mut point = run(&task);
        if task
            .settings
            .iter()
            .any(|setting| setting.knob == "ssim-window")
        {
            (point.outcome, point.failed) = (None, Some("no memory".to_owned()));
        }
        points.push(point);
    }
    let failed = points.iter().filter(|point| point.failed.is_some()).count();
    assert_eq!(failed, 1, "{:?}", names(&points));
}

#[test]
fn nothing_follows_a_base_that_failed() {
    let space = space(true);
    let mut base = run(&next(&space, &[], PLENTY).expect("the base"));
    assert_eq!(base.name, base_name(PointStage::Luma));
    (base.outcome, base.failed) = (None, Some("no memory".to_owned()));
    assert_eq!(next(&space, &[base], PLENTY), None);
}

/// Gray photos say nothing about colors: no ΔE00, and nothing to combine by.
#[test]
fn without_a_truth_colors_are_not_combined() {
    let space = space(true);
    let mut points = Vec::new();
    while let Some(task) = next(&space, &points, PLENTY) {
        let mut point = run(&task);
        if let Some(outcome) = &mut point.outcome {
            outcome.delta_e = None;
        }
        points.push(point);
    }
    let colored = points
        .iter()
        .filter(|point| point.stage == PointStage::Color);
    assert!(colored.clone().count() == 5, "{:?}", names(&points));
}

/// Times that were measured replace the guesses.
#[test]
fn expectations_learn() {
    let mut space = space(false);
    for value in &mut space.values {
        value.time = 1.0;
    }
    let points = sweep(&space, Vec::new(), 0.6 * PLENTY);
    let single = points
        .iter()
        .position(|p| p.name == "iterations-1400")
        .expect("a point");
    let settings = points[single].settings.clone();
    let seconds = |points: &[Point]| {
        super::space::expected(&space, points, PointStage::Luma, &settings).expect("a base")
    };
    assert_eq!(seconds(&points[..single]), BASE_SECONDS + 3.0);
    assert!((seconds(&points[..=single]) - (2.0 * BASE_SECONDS + 3.0)).abs() < 1e-9);
}
