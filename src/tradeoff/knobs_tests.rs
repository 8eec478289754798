//! What is tried around a base.

use super::*;
use crate::{luma::LumaSettings, run::Work, tradeoff::around::ColorAround};

fn around() -> Around {
    Around {
        iterations: 700,
        side: 400,
        largest_side: 500,
        luma: Preset::Draft.settings(),
        splats: 8_000,
        adam: 150,
        presets: vec![("balanced", 2.5), ("paper", 4.0)],
        color: None,
    }
}

fn of(around: &Around, knob: &str) -> Vec<String> {
    let values = values(around, &[knob.to_owned()]);
    values.into_iter().map(|value| value.value).collect()
}

#[test]
fn values_lie_around_the_base() {
    let around = around();
    assert_eq!(of(&around, "iterations"), ["350", "1400", "175"]);
    assert_eq!(of(&around, "max-side"), ["300", "200"], "600 is no photo's");
    assert_eq!(of(&around, "max-splats"), ["4000", "2000"]);
    assert_eq!(of(&around, "sh-degree"), ["1", "2", "3"]);
    let full = Around {
        splats: 12_000,
        ..around.clone()
    };
    assert_eq!(of(&full, "max-splats"), ["6000", "3000", "24000"]);
    let tiny = Around { side: 20, ..around };
    assert_eq!(
        of(&tiny, "max-side"),
        ["30"],
        "15 is too small for fit; 10 too"
    );
}

#[test]
fn colors_have_knobs_once_there_are_colors() {
    let gray = values(&around(), &[]);
    assert!(gray.iter().all(|value| value.stage == PointStage::Luma));
    let mut colored = Around {
        color: Some(ColorAround {
            rounds: 4,
            corrects_views: true,
            teacher_size: Some(256),
        }),
        ..around()
    };
    assert_eq!(of(&colored, "rounds"), ["2", "1"]);
    assert_eq!(of(&colored, "until"), ["775", "1000"]);
    assert_eq!(of(&colored, "teacher-size"), ["128", "384"]);
    assert_eq!(of(&colored, "correct-views"), ["off"]);
    if let Some(color) = &mut colored.color {
        color.teacher_size = None;
    }
    assert!(of(&colored, "teacher-size").is_empty(), "a folder");
}

#[test]
fn times_are_guessed_relative_to_the_base() {
    let all = values(&around(), &[]);
    assert!(all.iter().all(|v| v.time > 0.0 && v.time < 5.0), "{all:?}");
    let half = all.iter().find(|v| v.value == "350").expect("half");
    assert_eq!(half.time, 0.5);
}

#[test]
fn another_preset_is_as_much_work_as_its_amounts_say() {
    let amounts = |iterations, stop_when_flat| Work {
        settings: LumaSettings {
            max_splats: 24_000,
            stop_when_flat,
            ..LumaSettings::new(iterations)
        },
        max_side: None,
    };
    let around = around();
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
    // Twice the iterations, of 500 pixels instead of 400, with Gaussians below any cap.
    let pixels = 0.5 * 1.25_f64.powi(2);
    let (base, twice) = (amounts(700, None), amounts(1_400, Some(0.1)));
    close(around.work(&twice, &base), 2.0 * (pixels + 0.5));
    // A base of 2,800 that ended after 700; one that ends early too, and one that does not.
    let base = amounts(2_800, Some(0.3));
    close(around.work(&twice, &base), 0.5 * (pixels + 0.5));
    let all = amounts(1_400, None);
    close(around.work(&all, &base), 2.0 * (pixels + 0.5));
    let full = Around {
        splats: 12_000,
        ..around
    };
    close(full.work(&all, &base), 2.0 * (pixels + 1.0));
    let presets = values(&full, &["preset".to_owned()]);
    let times: Vec<_> = presets.iter().map(|v| (&v.value[..], v.time)).collect();
    assert_eq!(times, [("balanced", 2.5), ("paper", 4.0)]);
}

fn setting(knob: &str, value: &str) -> Setting {
    Setting {
        knob: knob.to_owned(),
        value: value.to_owned(),
    }
}

#[test]
fn a_setting_is_an_option_or_a_setting_of_luma() {
    let settings = [setting("until", "775"), setting("scales", "1")];
    let given = |option, value: &str| (option, Some(value.to_owned()));
    assert_eq!(
        options(&settings),
        [
            given("--solver", "adam"),
            given("--until", "775"),
            given("--scales", "1")
        ]
    );
    let settings = [
        setting("storage", "half"),
        setting("iterations", "4000"),
        setting("alpha-min", "0.008"),
    ];
    assert!(options(&settings).is_empty());
    let mut luma = Preset::Balanced.settings();
    turn(&mut luma, &settings);
    let wanted = LumaSettings {
        iterations: 4_000,
        stop_when_flat: None,
        numerics: "alpha-min=0.008,storage=half".parse().expect("numerics"),
        ..Preset::Balanced.settings()
    };
    assert_eq!(luma, wanted);
}

#[test]
fn every_value_of_luma_changes_something() {
    let around = around();
    for value in values(&around, &[]) {
        let settings = [value.setting()];
        let mut luma = around.luma.clone();
        turn(&mut luma, &settings);
        let changed = luma != around.luma || !options(&settings).is_empty();
        assert!(changed, "{} {}", value.knob, value.value);
    }
    assert_eq!(preset(&[setting("preset", "paper")]), Some(Preset::Paper));
    assert_eq!(preset(&[setting("scales", "1")]), None);
}

#[test]
fn names_are_unique_and_conflicts_mutual() {
    let mut names: Vec<&str> = knob_names().collect();
    names.sort_unstable();
    let count = names.len();
    names.dedup();
    assert_eq!(names.len(), count);
    for knob in knobs() {
        for other in knob.conflicts {
            let other = knobs().find(|k| k.name == *other).expect("a knob");
            assert!(other.conflicts.contains(&knob.name), "{}", knob.name);
        }
    }
}
