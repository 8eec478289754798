//! Painted input: strokes that color things, and colors of single photos, wherever they lie.

use std::fs;

use image::{Rgb, RgbImage, Rgba, RgbaImage};

use super::{program::Place, scene, shared::place_with_run};

/// A violet that nothing in the bundled garden has: `L*` 46, a 49, b −44.
const VIOLET: [u8; 3] = [152, 78, 184];

/// Boxes within the large pumpkin, and on the lawn beside it, by photo of the bundled scene: left,
/// top, right, bottom.
const PUMPKIN: [(&str, [u32; 4]); 2] = [
    ("garden_02", [200, 172, 232, 200]),
    ("garden_06", [270, 142, 300, 170]),
];
const LAWN: [(&str, [u32; 4]); 2] = [
    ("garden_02", [110, 170, 150, 205]),
    ("garden_06", [150, 185, 200, 210]),
];

/// A scene in `runs/garden` from the bundled photos.
fn garden(place: &Place) {
    let photos = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo");
    let fit = ["fit", photos, "-o", "runs/garden", "--preset", "draft"];
    let short = ["--iterations", "100", "--max-side", "162"];
    let few = ["--max-splats", "4000", "--no-fill-gaps"];
    place.succeed(&[&fit[..], &short, &few].concat());
}

/// Mean a and b in a box of a picture of a view; the box is in pixels of the photo.
fn mean_ab(place: &Place, folder: &str, view: &str, area: [u32; 4]) -> [f64; 2] {
    let names = place.files(folder);
    let name = names.iter().find(|name| name.starts_with(view));
    let path = place.path(folder).join(name.expect("a picture"));
    let picture = image::open(path).expect("a picture").into_rgb8();
    let scale = f64::from(picture.width()) / 324.0;
    let [left, top, right, bottom] = area.map(|v| (f64::from(v) * scale) as u32);
    let mut sum = [0.0; 2];
    let mut count = 0.0;
    for y in top..bottom {
        for x in left..right {
            let rgb = picture.get_pixel(x, y).0.map(|v| f64::from(v) / 255.0);
            let lab = gs_chroma::color::srgb_to_lab(rgb);
            sum = [sum[0] + lab[1], sum[1] + lab[2]];
            count += 1.0;
        }
    }
    sum.map(|sum| sum / count)
}

/// Two boxes' a and b after a coloring with these arguments.
fn colored(place: &Place, arguments: &[&str]) -> [[[f64; 2]; 2]; 2] {
    let teacher = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/assets/teacher/demo-teacher.onnx"
    );
    let colorize = ["colorize", "runs/garden", "--teacher", teacher];
    let short = ["--rounds", "3", "--sh-degree", "0"];
    place.succeed(&[&colorize[..], &short, arguments].concat());
    let _ = fs::remove_dir_all(place.path("views"));
    place.succeed(&["render", "runs/garden", "--views", "all", "-o", "views"]);
    [PUMPKIN, LAWN].map(|boxes| boxes.map(|(view, area)| mean_ab(place, "views", view, area)))
}

fn apart([a, b]: [f64; 2], [c, d]: [f64; 2]) -> f64 {
    (a - c).hypot(b - d)
}

/// One stroke across the pumpkin of one photo makes it violet in that and in another, all of it,
/// and leaves the darker lawn around it alone.
#[test]
fn a_stroke_colors_its_thing_in_all_views_and_nothing_else() {
    let place = Place::new();
    garden(&place);
    let [r, g, b] = VIOLET;
    let on_stroke = |x: u32, y: u32| (190..240).contains(&x) && (182..190).contains(&y);
    let layer = RgbaImage::from_fn(324, 216, |x, y| {
        Rgba([r, g, b, if on_stroke(x, y) { 255 } else { 0 }])
    });
    fs::create_dir(place.path("hints")).expect("writable");
    layer
        .save(place.path("hints/garden_02.png"))
        .expect("writable");
    let hinted = ["--hints", "hints"];
    let after = colored(&place, &hinted);
    let as_painted = colored(&place, &[&hinted[..], &["--grow-hints", "off"]].concat());
    for view in 0..2 {
        let [pumpkin, lawn] = [0, 1].map(|thing: usize| after[thing][view]);
        let off = apart(pumpkin, [49.0, -44.0]);
        assert!(off < 20.0, "{view}: {pumpkin:?}");
        assert!(
            off < 0.6 * apart(as_painted[0][view], [49.0, -44.0]),
            "{as_painted:?}"
        );
        let moved = apart(lawn, as_painted[1][view]);
        assert!(moved < 4.0, "{view}: {lawn:?} {as_painted:?}");
    }
    let claimed = &place.report("runs/garden")["chroma"]["claimed"];
    assert!(claimed.is_null(), "as painted: {claimed}");
}

/// Writes images of one color for some views.
fn paint(place: &Place, folder: &str, views: &[usize]) {
    let [width, height] = scene::SIZE;
    for &view in views {
        let path = place.path(folder).join(scene::name(view));
        fs::create_dir_all(path.parent().expect("a parent")).expect("writable");
        let image = RgbImage::from_pixel(width, height, Rgb(VIOLET));
        image.save(path).expect("writable");
    }
}

const SHORT: [&str; 5] = ["colorize", "--solver", "adam", "--until", "70"];

/// The first and the ninth of the scene's photos are held out.
#[test]
fn hints_on_a_held_out_photo_count_and_it_is_not_measured() {
    let place = place_with_run();
    let [width, height] = scene::SIZE;
    let layer = RgbaImage::from_pixel(width, height, Rgba([152, 78, 184, 255]));
    fs::create_dir_all(place.path("hints")).expect("writable");
    layer
        .save(place.path("hints").join(scene::name(0)))
        .expect("writable");
    let done = place.run(&[&SHORT[..], &["--hints", "hints"]].concat());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(done.stderr.contains("1 held-out photo"), "{}", done.stderr);
    let chroma = &place.report("runs/scene")["chroma"];
    assert_eq!(
        (&chroma["hints"], &chroma["colored_views"]),
        (&1.into(), &1.into())
    );
    assert_eq!(
        chroma["painted_held_out"],
        serde_json::json!([scene::name(0)])
    );
    assert_eq!(chroma["measured_on"], "test");
    assert_eq!(
        chroma["views"].as_array().map(Vec::len),
        Some(scene::HELD_OUT - 1)
    );
    assert!(
        chroma["claimed"].as_f64().is_some_and(|share| share > 0.5),
        "{chroma}"
    );
    // `eval` leaves it out, too.
    let evaluation = place.json(&["eval", "--frames", "2", "--json"]);
    assert_eq!(evaluation["measured_on"], "test");
    assert_eq!(
        evaluation["views"].as_array().map(Vec::len),
        Some(scene::HELD_OUT - 1)
    );
}

#[test]
fn a_folder_of_single_images_counts_wherever_these_lie_and_one_of_all_is_measured() {
    let place = place_with_run();
    paint(&place, "some", &[0, 8]);
    let colorize = |folder: &str| {
        place.json(&[&SHORT[..], &["--json", "--teacher", folder]].concat())["chroma"].clone()
    };
    let some = colorize("some");
    assert_eq!(some["colored_views"], 2);
    assert_eq!(some["measured_on"], "train");
    assert_eq!(some["painted_held_out"].as_array().map(Vec::len), Some(2));
    paint(&place, "all", &(0..scene::VIEWS).collect::<Vec<_>>());
    let all = colorize("all");
    assert_eq!(all["colored_views"], scene::VIEWS - scene::HELD_OUT);
    assert_eq!(all["measured_on"], "test");
    assert_eq!(all["painted_held_out"], serde_json::json!([]));
}

/// The run's report, log and contact sheet tell of its own colors.
#[test]
fn what_is_colored_elsewhere_leaves_the_run_as_it_is() {
    let place = place_with_run();
    paint(&place, "all", &(0..scene::VIEWS).collect::<Vec<_>>());
    let kept = ["report.json", "log.csv", "contact-sheet.png", "color.ply"];
    let read = || kept.map(|name| place.read(&format!("runs/scene/{name}")));
    let before = read();
    place.succeed(&[&SHORT[..], &["--teacher", "all", "-o", "other.ply"]].concat());
    assert!(place.path("other.ply").is_file());
    assert!(before == read());
}

/// `fit` leaves the photos beside what it made of them.
#[test]
fn a_fit_has_a_contact_sheet() {
    let place = super::shared::place_with_scene();
    let done = place.succeed(&super::shared::QUICK_FIT);
    assert!(done.contains("contact-sheet.png"), "{done}");
    let sheet = image::open(place.path("runs/scene/contact-sheet.png")).expect("a picture");
    assert_eq!(sheet.width(), 2 * (scene::SIZE[0] + 4) + 4);
}
