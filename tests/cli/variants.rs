//! Scenes made from others: that they can be fitted, and what they call for.

#[path = "../../tools/make_variants/variants/mod.rs"]
mod made;

use clap::ValueEnum;
use made::Variant;

use super::program::Place;
use super::scene;
use super::shared::FEW;

/// Makes a variant in `place` and says in which folder.
fn make(place: &Place, source: &str, variant: Variant) -> String {
    let name = variant.to_possible_value().expect("a name");
    let name = name.get_name().to_owned();
    made::make(source.as_ref(), variant, &place.path(&name), 0).expect("made");
    name
}

#[test]
fn every_variant_can_be_fitted() {
    let place = Place::new();
    scene::write(&place.path("scene"));
    let source = place.path("scene").to_string_lossy().into_owned();
    for &variant in Variant::value_variants() {
        let name = make(&place, &source, variant);
        place.succeed(&["fit", &name, "--preset", "draft", "--iterations", "3"]);
    }
}

/// Trials are a share of the training.
const SHORT: [&str; 4] = ["--iterations", "800", "--max-side", "160"];

/// The plan has an effect on for a variant, off for its control.
fn assert_told_apart(variant: Variant, control: Variant, effect: &str, more: &[&str]) {
    let place = Place::new();
    let demo = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo");
    for (variant, on) in [(variant, true), (control, false)] {
        let name = make(&place, demo, variant);
        // Of draft the degree is 0, whatever the evidence.
        let plan = ["plan", &name, "--json", "--preset", "balanced"];
        let plan = place.json(&[&plan[..], more].concat());
        let effects = plan["effects"].as_array().expect("effects");
        let found = effects.iter().find(|found| found["name"] == effect);
        assert_eq!(found.expect(effect)["on"], on, "{name}: {found:?}");
    }
}

#[test]
fn the_plan_notices_barrel_distortion() {
    assert_told_apart(Variant::Barrel, Variant::BarrelControl, "lens", &[]);
}

#[test]
fn the_plan_notices_fisheyes() {
    assert_told_apart(Variant::Fisheye, Variant::FisheyeControl, "lens", &[]);
}

#[test]
fn the_plan_notices_masks() {
    assert_told_apart(Variant::Masked, Variant::MaskedControl, "masks", &[]);
}

#[test]
fn the_plan_notices_exposures() {
    assert_told_apart(Variant::Exposure, Variant::ExposureControl, "exposure", &[]);
}

#[test]
fn the_plan_notices_dust() {
    assert_told_apart(Variant::Dust, Variant::DustControl, "robust", &[]);
}

/// A plain training does what plain viewers show best: none of it is simulated for its own sake.
#[test]
fn distances_are_put_to_a_trial_by_what_viewers_show() {
    let demo = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo");
    for (variant, iterations, decided_by) in [
        (Variant::Distances, "3500", "trial"),
        // There is no time for a trial.
        (Variant::Distances, "300", "preset"),
        (Variant::DistancesControl, "300", "evidence"),
    ] {
        let place = Place::new();
        let name = make(&place, demo, variant);
        let short = ["--max-side", "160", "--iterations", iterations];
        let plan = place.json(&[&["plan", &name, "--json"][..], &short].concat());
        let effects = plan["effects"].as_array().expect("effects");
        let found = effects.iter().find(|found| found["name"] == "antialias");
        let found = found.expect("antialias");
        assert_eq!(found["decided_by"], decided_by, "{found}");
        assert_eq!(found["on"], false, "{found}");
        let trial = found["trial"].as_f64();
        assert!(trial.is_none_or(|gain| gain < -0.3), "{found}");
        assert_eq!(trial.is_some(), decided_by == "trial");
    }
}

#[test]
fn the_plan_notices_a_sky() {
    assert_told_apart(Variant::Sky, Variant::SkyControl, "background", &SHORT);
}

/// Without it a background would win by standing in the shell's place.
#[test]
fn a_trial_has_the_shell_that_the_run_has() {
    let place = Place::new();
    let demo = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo");
    let sky = make(&place, demo, Variant::Sky);
    let gain = |more: &[&str]| {
        let fit = ["fit", &sky, "-o", "run", "--json", "--preset", "balanced"];
        // Long enough for a trial, and done once it is over.
        let small = ["--max-splats", "1500", "--max-side", "80"];
        let short = ["--target-psnr", "1"];
        let report = place.json(&[&fit[..], &small, &short, more].concat());
        let effects = report["effects"].as_array().expect("effects");
        let found = effects.iter().find(|found| found["name"] == "background");
        assert!(report["luma"]["seconds"]["trial"].as_f64() > Some(0.0));
        found.expect("background")["trial"]
            .as_f64()
            .expect("a trial")
    };
    assert_ne!(gain(&[]), gain(&["--no-surround"]));
}

#[test]
fn the_plan_notices_gloss() {
    // Patches that brighten look like exposures at the points: a trial would tell.
    let alone = ["--without", "exposure", "--iterations", "800"];
    assert_told_apart(Variant::Gloss, Variant::GlossControl, "luma-degree", &alone);
}

/// Photos of the demo as a teacher; each second one warmer by `tint`.
fn teacher(place: &Place, name: &str, tint: f32) -> String {
    let photos = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo/images");
    std::fs::create_dir_all(place.path(name)).expect("a folder");
    for (index, photo) in std::fs::read_dir(photos).expect("the demo").enumerate() {
        let path = photo.expect("a photo").path();
        let mut picture = image::open(&path).expect("a picture").into_rgb8();
        let gain = 1.0 + tint * (index % 2) as f32;
        for pixel in picture.pixels_mut() {
            pixel[0] = (gain * f32::from(pixel[0])).min(255.0) as u8;
            pixel[2] = (f32::from(pixel[2]) / gain) as u8;
        }
        let file = path.file_stem().expect("a name").to_string_lossy();
        let to = place.path(name).join(format!("{file}.png"));
        picture.save(to).expect("writable");
    }
    name.to_owned()
}

#[test]
fn a_teacher_is_corrected_where_its_views_disagree() {
    let place = Place::new();
    let demo = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo");
    let fit = ["fit", demo, "-o", "run", "--max-side", "120"];
    place.succeed(&[&fit[..], &FEW].concat());
    for (name, tint, on) in [("steady", 0.0, false), ("tinted", 0.25, true)] {
        let teacher = teacher(&place, name, tint);
        place.succeed(&["colorize", "run", "--teacher", &teacher, "--rounds", "1"]);
        let effects = &place.report("run")["chroma"]["effects"];
        assert_eq!(effects[0]["name"], "teacher-correction");
        assert_eq!(effects[0]["on"], on, "{name}: {}", effects[0]);
        assert_eq!(
            place.report("run")["chroma"]["settings"]["correct_views"],
            on
        );
    }
}
