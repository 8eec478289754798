//! Photos that are cut out, and masks that few photos have.

use image::{GrayImage, Luma, Rgba, RgbaImage};
use serde_json::Value;

use super::program::{Done, Place};
use super::scene;
use super::shared::{QUICK_FIT, place_with_scene};

const PLAN: [&str; 5] = ["plan", "scene", "--json", "--preset", "draft"];

/// Writes the photos anew, transparent where `opacity` says; under it is no photo.
fn cut_out(place: &Place, opacity: impl Fn(u32) -> u8) {
    for index in 0..scene::VIEWS {
        let photo = scene::photo(index);
        let cut = RgbaImage::from_fn(scene::SIZE[0], scene::SIZE[1], |x, y| {
            let [r, g, b] = photo.get_pixel(x, y).0;
            match opacity(x) {
                255 => Rgba([r, g, b, 255]),
                alpha => Rgba([
                    (7 * x + 31 * y) as u8,
                    (91 * x) as u8,
                    (53 * y) as u8,
                    alpha,
                ]),
            }
        });
        let path = place.path("scene/images").join(scene::name(index));
        cut.save(path).expect("a photo");
    }
}

fn warnings(done: &Done) -> Vec<&str> {
    let lines = done.stderr.lines();
    lines
        .filter_map(|line| line.strip_prefix("warning: "))
        .collect()
}

/// The plan, its warnings and the evidence for masks, in per cent.
fn plan(place: &Place, options: &[&str]) -> (Value, Vec<String>, Option<f64>) {
    let done = place.run(&[&PLAN[..], options].concat());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let plan: Value = serde_json::from_str(&done.stdout).expect("JSON");
    let told = warnings(&done).into_iter().map(str::to_owned).collect();
    assert_eq!(plan["effects"][1]["name"], "masks");
    let evidence = plan["effects"][1]["evidence"].as_f64();
    (plan, told, evidence)
}

#[test]
fn transparency_is_taken_for_masks_and_told() {
    let place = place_with_scene();
    cut_out(&place, |x| if x < 16 { 0 } else { 255 });
    let (_, told, masked) = plan(&place, &[]);
    let [line] = &told[..] else {
        panic!("{told:?}")
    };
    assert!(line.starts_with("10 photos have transparency"), "{line}");
    assert!(line.contains("masks off") && line.contains("masks from alpha"));
    assert!(masked.is_some_and(|share| (share - 25.0).abs() < 0.1));
    // Whoever says what is to be is told nothing.
    let (_, told, masked) = plan(&place, &["--masks", "alpha"]);
    assert!(told.is_empty() && masked.is_some(), "{told:?}");
    let (_, told, masked) = plan(&place, &["--masks", "off"]);
    assert!(told.is_empty() && masked.is_none(), "{told:?}");
    // Later commands load the photos alike.
    place.succeed(&QUICK_FIT);
    let capture = &place.report("runs/scene")["capture"];
    assert_eq!(capture["masks"], "alpha");
    assert_eq!(capture["masked_views"], scene::VIEWS);
    let colorize = ["colorize", "--rounds", "1", "--teacher", "photos"];
    let done = place.run(&colorize);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert_eq!(warnings(&done), [""; 0]);
}

/// Transparent pixels affect neither the evidence nor the training.
#[test]
fn what_is_transparent_does_not_count() {
    let [cut, masked] = [true, false].map(|alpha| {
        let place = place_with_scene();
        if alpha {
            cut_out(&place, |x| if x < 16 { 0 } else { 255 });
        } else {
            masks(&place, |index| Some(scene::name(index) + ".png"));
        }
        place.succeed(&QUICK_FIT);
        place
    });
    let effects = |place: &Place| place.report("runs/scene")["effects"].clone();
    assert_eq!(effects(&cut), effects(&masked));
    assert!(cut.read("runs/scene/luma.ply") == masked.read("runs/scene/luma.ply"));
}

#[test]
fn opaque_alpha_is_nothing() {
    let place = place_with_scene();
    let (plain, ..) = plan(&place, &[]);
    cut_out(&place, |_| 255);
    let (opaque, told, _) = plan(&place, &[]);
    assert_eq!(told, [""; 0]);
    assert_eq!(opaque, plain);
    place.succeed(&QUICK_FIT);
    let capture = &place.report("runs/scene")["capture"];
    assert_eq!(capture["masks"], "off");
    assert_eq!(capture["masked_views"], 0);
}

/// Masks of the left quarter under these names.
fn masks(place: &Place, name: impl Fn(usize) -> Option<String>) {
    let [width, height] = scene::SIZE;
    let mask = GrayImage::from_fn(width, height, |x, _| Luma([if x < 16 { 0 } else { 255 }]));
    for name in (0..scene::VIEWS).filter_map(name) {
        let path = place.path("scene/masks").join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
        mask.save(path).expect("writable");
    }
}

#[test]
fn masks_of_no_photo_and_photos_without_masks_are_told() {
    let place = place_with_scene();
    masks(&place, |index| match index {
        0..2 => Some(scene::name(index) + ".png"),
        _ => Some(scene::name(index).replace(".png", "_mask.png")),
    });
    let info = place.run(&["info", "scene", "--json"]);
    for told in [
        warnings(&info),
        plan(&place, &[]).1.iter().map(String::as_str).collect(),
    ] {
        let [strays, few] = told[..] else {
            panic!("{told:?}")
        };
        assert!(strays.starts_with("8 files in scene/masks belong to no photo"));
        assert!(strays.contains("02_mask.png"), "{strays}");
        assert!(few.starts_with("2 of 10 photos have a mask"), "{few}");
    }
    // All of them, and nothing else, is as it should be.
    std::fs::remove_dir_all(place.path("scene/masks")).expect("a folder");
    masks(&place, |index| Some(scene::name(index)));
    assert_eq!(plan(&place, &[]).1, [""; 0]);
}
