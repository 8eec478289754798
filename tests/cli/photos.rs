//! Photos of more than 8 bits, and masks.

use image::{GrayImage, ImageBuffer, Luma};

use super::program::Place;
use super::scene;
use super::shared::{QUICK_FIT, onnx, place_with_scene};

/// The lowest value of the 16-bit photos, and what each level of gray adds.
const DARK: u16 = 13_000;
const STEP: u16 = 30;

/// A second scene, whose gray photos `save` writes anew.
fn gray_scene(place: &Place, name: &str, save: impl Fn(&GrayImage, std::path::PathBuf)) {
    scene::write(&place.path(name));
    for view in 0..scene::VIEWS {
        let gray = image::DynamicImage::from(scene::photo(view)).into_luma8();
        save(
            &gray,
            place.path(&format!("{name}/images/{}", scene::name(view))),
        );
    }
}

fn sixteen_bits(gray: &GrayImage) -> ImageBuffer<Luma<u16>, Vec<u16>> {
    ImageBuffer::from_fn(gray.width(), gray.height(), |x, y| {
        Luma([DARK + STEP * u16::from(gray.get_pixel(x, y).0[0])])
    })
}

fn fit(place: &Place, name: &str, options: &[&str]) {
    let mut arguments = QUICK_FIT;
    arguments[1] = name;
    place.succeed(&[&arguments[..], options].concat());
}

#[test]
fn both_stages_see_what_the_range_makes_of_16_bits() {
    let place = Place::new();
    gray_scene(&place, "eight", |gray, path| {
        gray.save(path).expect("writable")
    });
    gray_scene(&place, "sixteen", |gray, path| {
        sixteen_bits(gray).save(path).expect("writable");
    });
    let range = format!("{DARK},{}", DARK + 255 * STEP);
    fit(&place, "eight", &[]);
    fit(&place, "sixteen", &["--normalize", &range]);
    let [eight, sixteen] = ["eight", "sixteen"].map(|name| {
        let run = format!("runs/{name}");
        let teacher = onnx("ddcolor_tiny.onnx");
        place.succeed(&["colorize", &run, "--rounds", "1", "--teacher", &teacher]);
        let files = ["luma.ply", "color.ply"].map(|file| place.read(&format!("{run}/{file}")));
        // Answers are kept under a hash of the photo.
        (files, place.files(&format!("{run}/teacher")))
    });
    assert!(eight == sixteen);
    let capture = &place.report("runs/sixteen")["capture"];
    let white = DARK + 255 * STEP;
    assert_eq!(
        capture["normalize"],
        serde_json::json!([f64::from(DARK), f64::from(white)])
    );
    assert!(place.report("runs/eight")["capture"]["normalize"].is_null());
}

#[test]
fn a_range_that_is_not_used_is_found() {
    let place = Place::new();
    gray_scene(&place, "scene", |gray, path| {
        sixteen_bits(gray).save(path).expect("writable");
    });
    let info = place.succeed(&["info", "scene"]);
    assert!(
        info.contains(&format!("{} files: gray, 16 bits", scene::VIEWS)),
        "{info}"
    );
    let done = place.run(&QUICK_FIT);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(
        done.stderr.contains("photos are normalized"),
        "{}",
        done.stderr
    );
    let range = &place.report("runs/scene")["capture"]["normalize"];
    let [low, high] = [0, 1].map(|end| range[end].as_f64().expect("a number"));
    assert!(low >= f64::from(DARK) && low < high, "{range}");
    assert!(high <= f64::from(DARK + 255 * STEP), "{range}");

    place.succeed(&[&QUICK_FIT[..], &["--normalize", "off"]].concat());
    assert!(place.report("runs/scene")["capture"]["normalize"].is_null());
}

#[test]
fn masks_beside_the_photos_are_found_and_may_be_left_alone() {
    let place = place_with_scene();
    let alike = ["--without", "background", "-o", "plain"];
    place.succeed(&[&QUICK_FIT[..], &alike].concat());
    for view in 0..scene::VIEWS {
        // Both of COLMAP's ways to name a mask.
        let name = scene::name(view) + [".png", ""][view % 2];
        let path = place.path(&format!("scene/masks/{name}"));
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
        let [width, height] = scene::SIZE;
        let mask = GrayImage::from_fn(width, height, |x, _| Luma([if x < 20 { 0 } else { 255 }]));
        mask.save(path).expect("writable");
    }
    assert!(place.succeed(&["info", "scene"]).contains("10 with a mask"));
    let mut splats = Vec::new();
    for (options, source, views, same) in [
        (&[][..], "beside", scene::VIEWS, false),
        (&["--masked", "remove"], "beside", scene::VIEWS, false),
        (&["--masks", "off"], "off", 0, true),
    ] {
        let alike = ["--without", "background", "-o", "masked"];
        place.succeed(&[&QUICK_FIT[..], options, &alike].concat());
        let report = place.report("masked");
        splats.push(report["luma"]["splats"].as_u64().expect("a number"));
        let capture = &report["capture"];
        assert_eq!(capture["masks"], source);
        assert_eq!(capture["masked_views"], views);
        let equal = place.read("masked/luma.ply") == place.read("plain/luma.ply");
        assert_eq!(equal, same, "{options:?}");
    }
    // What is removed is no longer there, and only then.
    assert!(splats[1] < splats[0] && splats[1] < splats[2], "{splats:?}");
}

#[test]
fn a_range_beyond_all_values_is_refused() {
    let place = place_with_scene();
    for range in ["13000,23000", "-9,0"] {
        let done = place.run(&["plan", "scene", &format!("--normalize={range}")]);
        assert_eq!(done.code, Some(1), "{}", done.stderr);
        let said =
            format!("8 bits a channel, values from 0 to 255: none lies within --normalize {range}");
        assert!(done.stderr.contains(&said), "{}", done.stderr);
    }
}
