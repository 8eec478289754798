//! Every model against what pycolmap computes; `tools/make_lens_fixture.py` writes
//! the file.

use glam::{DVec2, DVec3};
use serde::Deserialize;

use super::model::MODELS;
use super::{Lens, ModelName};

#[derive(Deserialize)]
struct Fixture {
    width: u32,
    height: u32,
    rays: Vec<[f64; 3]>,
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    model: String,
    number: i32,
    parameters: Vec<f64>,
    pixels: Vec<Option<[f64; 2]>>,
}

fn fixture() -> Fixture {
    serde_json::from_str(include_str!("../../../tests/fixtures/lens/colmap.json")).unwrap()
}

fn lens(fixture: &Fixture, case: &Case) -> Lens {
    let model = ModelName::named(&case.model).unwrap();
    model
        .lens(fixture.width, fixture.height, &case.parameters)
        .unwrap()
}

#[test]
fn models_have_colmaps_names_and_numbers() {
    let fixture = fixture();
    for case in &fixture.cases {
        let named = ModelName::named(&case.model).unwrap();
        assert_eq!(ModelName::numbered(case.number), Some(named));
        assert_eq!(named.parameters, case.parameters.len(), "{}", case.model);
    }
    for model in MODELS {
        let there = fixture.cases.iter().any(|case| case.model == model.name);
        assert!(there, "{} is not compared", model.name);
    }
    assert_eq!(ModelName::numbered(-1), None);
    assert_eq!(ModelName::numbered(18), None);
    assert_eq!(ModelName::named("pinhole"), None);
}

#[test]
fn rays_meet_the_pixels_that_colmap_says() {
    let fixture = fixture();
    let (mut compared, mut folded) = (0, 0);
    for case in &fixture.cases {
        let lens = lens(&fixture, case);
        for (ray, expected) in fixture.rays.iter().zip(&case.pixels) {
            let pixel = lens.pixel(DVec3::from(*ray));
            match (pixel, expected) {
                (Some(pixel), Some(expected)) => {
                    let off = pixel.distance(DVec2::from(*expected));
                    let scale = 1.0 + pixel.length();
                    assert!(off < 1e-7 * scale, "{} {ray:?}: {off}", case.model);
                    compared += 1;
                }
                // COLMAP goes on beyond the fold.
                (None, Some(_)) => {
                    let angle = ray[0].hypot(ray[1]).atan2(ray[2]);
                    assert!(lens.projection.radius(angle) > lens.limit, "{}", case.model);
                    folded += 1;
                }
                (Some(_), None) => panic!("{} {ray:?}", case.model),
                (None, None) => {}
            }
        }
    }
    assert!(
        compared > 25 * 20 && folded < compared / 4,
        "{compared} {folded}"
    );
}

#[test]
fn pixels_lead_back_to_their_rays() {
    let fixture = fixture();
    for case in &fixture.cases {
        let lens = lens(&fixture, case);
        let mut count = 0;
        for ray in &fixture.rays {
            let ray = DVec3::from(*ray).normalize();
            let Some(pixel) = lens.pixel(ray) else {
                continue;
            };
            // Beyond, pixels crowd so that their digits no longer tell rays apart.
            if pixel.length() < 1e4 {
                let back = lens.ray(pixel).unwrap_or(DVec3::NAN);
                let off = back.distance(ray);
                assert!(off < 1e-8, "{} {ray}: {off}", case.model);
                count += 1;
            }
        }
        assert!(count >= 9, "{} {count}", case.model);
    }
}
