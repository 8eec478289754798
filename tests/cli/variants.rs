//! Scenes made from others: that they can be fitted, and what they call for.

#[path = "../../tools/make_variants/variants/mod.rs"]
mod made;

use clap::ValueEnum;
use made::Variant;

use super::program::Place;
use super::scene;

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

#[test]
fn the_plan_tells_pairs_apart() {
    let place = Place::new();
    let demo = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo");
    for (variant, control, effect) in [
        (Variant::Barrel, Variant::BarrelControl, "lens"),
        (Variant::Fisheye, Variant::FisheyeControl, "lens"),
        (Variant::Masked, Variant::MaskedControl, "masks"),
        (Variant::Exposure, Variant::ExposureControl, "exposure"),
        (Variant::Dust, Variant::DustControl, "robust"),
        (Variant::Distances, Variant::DistancesControl, "antialias"),
        (Variant::Sky, Variant::SkyControl, "background"),
        (Variant::Gloss, Variant::GlossControl, "luma-degree"),
    ] {
        for (variant, on) in [(variant, true), (control, false)] {
            let name = make(&place, demo, variant);
            // Of draft the degree is 0, whatever the evidence.
            let plan = place.json(&["plan", &name, "--json", "--preset", "balanced"]);
            let effects = plan["effects"].as_array().expect("effects");
            let found = effects.iter().find(|found| found["name"] == effect);
            assert_eq!(found.expect(effect)["on"], on, "{name}: {found:?}");
        }
    }
}
