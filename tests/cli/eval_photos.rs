//! Photos as references of `eval` and `colorize`: neither their exposure counts nor pixels that
//! their mask hides.

use image::{GrayImage, Luma, Rgb, RgbImage};
use serde_json::{Value, json};

use super::program::Place;
use super::scene;
use super::shared::place_with_run;

/// Gain and offset of the photo that was exposed otherwise.
const EXPOSURE: [f64; 2] = [0.8, 0.05];

fn measured(place: &Place) -> Value {
    place.json(&[
        "eval",
        "--frames",
        "2",
        "--teacher",
        "scene/images",
        "--json",
    ])
}

/// Figures of the held-out view 8: PSNR, SSIM, then of the exported picture ΔE00, a/b error and
/// PSNR; and PSNR after the photo's own gain and offset.
fn figures(found: &Value) -> [f64; 6] {
    let views = found["views"].as_array().expect("views");
    let view = views.iter().find(|view| view["name"] == scene::name(8));
    let view = view.expect("view 8");
    let pictures = view["pictures"].as_array().expect("pictures");
    let exported = pictures.iter().find(|score| score["method"] == "exported");
    let exported = exported.expect("the exported picture");
    [
        &view["luma"]["psnr"],
        &view["luma"]["ssim"],
        &exported["delta_e"]["mean"],
        &exported["ab_error"],
        &exported["psnr"],
        &view["luma"]["corrected_psnr"],
    ]
    .map(|value| value.as_f64().expect("a number"))
}

/// Root mean square of a method between the photographed views.
fn between(found: &Value, method: &str) -> f64 {
    let scores = found["between"]["consistency"].as_array().expect("scores");
    let score = scores.iter().find(|score| score["method"] == method);
    score.expect("the method")["rms"]
        .as_f64()
        .expect("a number")
}

fn repaint(place: &Place, change: impl Fn(u32, u32, Rgb<u8>) -> Rgb<u8>) {
    let path = place.path("scene/images").join(scene::name(8));
    let photo = image::open(&path).expect("a photo").to_rgb8();
    RgbImage::from_fn(photo.width(), photo.height(), |x, y| {
        change(x, y, *photo.get_pixel(x, y))
    })
    .save(path)
    .expect("writable");
}

fn edit_report(place: &Place, edit: impl Fn(&mut Value)) {
    let mut report = place.report("runs/scene");
    edit(&mut report);
    place.write("runs/scene/report.json", report.to_string());
}

#[test]
fn a_photo_that_became_darker_is_no_error_of_the_scene() {
    let place = place_with_run();
    let before = figures(&measured(&place));
    let [gain, offset] = EXPOSURE;
    repaint(&place, |_, _, Rgb(rgb)| {
        Rgb(rgb.map(|v| (gain * f64::from(v) + 255.0 * offset).round() as u8))
    });
    let unknown = figures(&measured(&place));
    edit_report(&place, |report| {
        report["luma"]["exposures"] =
            json!([{"name": scene::name(8), "gain": gain, "offset": offset}]);
    });
    let known = figures(&measured(&place));
    // Differences shrink with the gain.
    let lower = -20.0 * gain.log10();
    for corrected in [known[5], unknown[5]] {
        assert!(
            (corrected - before[5] - lower).abs() < 0.1,
            "{before:?} {known:?} {unknown:?}"
        );
    }
    // As viewers show it, the scene is too bright for this photo.
    assert!(known[0] == unknown[0] && known[0] < known[5] - 1.0);
    assert!(
        (known[4] - before[4] - lower).abs() < 0.1,
        "{before:?} {known:?}"
    );
    // Colors pale with it: nothing but its size changes the error.
    let paled = known[2] / before[2];
    assert!(paled > gain && paled < 1.0, "{before:?} {known:?}");
    // Not knowing it costs.
    assert!(unknown[2] > known[2] + 1.0, "{unknown:?} {known:?}");
}

#[test]
fn what_a_mask_hides_is_not_measured() {
    let place = place_with_run();
    // The left part never counts, whatever is there.
    for view in 0..scene::VIEWS {
        let path = place.path(&format!("scene/masks/{}", scene::name(view)));
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
        let [width, height] = scene::SIZE;
        let mask = GrayImage::from_fn(width, height, |x, _| Luma([if x < 24 { 0 } else { 255 }]));
        mask.save(path).expect("writable");
    }
    let open = measured(&place);
    edit_report(&place, |report| {
        report["capture"]["masks"] = "beside".into()
    });
    let before = measured(&place);
    assert_ne!(figures(&open), figures(&before));
    repaint(
        &place,
        |x, _, rgb| if x < 24 { Rgb([255, 0, 255]) } else { rgb },
    );
    let after = measured(&place);
    // Structural similarity looks at pixels beside those that count.
    let [psnr, ssim, rest @ ..] = figures(&after);
    let [psnr_before, ssim_before, rest_before @ ..] = figures(&before);
    assert_eq!((psnr, rest), (psnr_before, rest_before));
    assert!((ssim - ssim_before).abs() < 0.01, "{ssim} {ssim_before}");
    assert_eq!(between(&after, "photo"), between(&before, "photo"));
    assert_eq!(
        after["teacher_colorfulness"],
        before["teacher_colorfulness"]
    );
    edit_report(&place, |report| report["capture"]["masks"] = "off".into());
    let bare = measured(&place);
    assert!(figures(&bare)[2] > figures(&open)[2] + 5.0, "{bare}");
    assert!(
        between(&bare, "photo") > between(&open, "photo") + 1.0,
        "{bare}"
    );
}
