//! `frames`: the photos themselves in color.

use image::{DynamicImage, ImageBuffer, Luma};

use super::documented::conforms;
use super::program::Place;
use super::scene;
use super::shared::{QUICK_FIT, onnx, place_with_run, place_with_scene};

/// `L*`, a and b of a picture's pixels.
fn lab(place: &Place, name: &str) -> Vec<[f64; 3]> {
    let image = image::open(place.path(name)).expect(name).into_rgb16();
    let color = |pixel: &image::Rgb<u16>| pixel.0.map(|v| f64::from(v) / 65535.0);
    let pixels = image.pixels();
    pixels
        .map(|pixel| gs_chroma::color::srgb_to_lab(color(pixel)))
        .collect()
}

/// The mean distance in the a, b plane.
fn apart(one: &[[f64; 3]], other: &[[f64; 3]]) -> f64 {
    let pairs = one.iter().zip(other);
    let sum: f64 = pairs.map(|(x, y)| (x[1] - y[1]).hypot(x[2] - y[2])).sum();
    sum / one.len() as f64
}

#[test]
fn photos_come_back_in_color_at_their_size_with_their_lightness() {
    let place = place_with_scene();
    place.succeed(&[&QUICK_FIT[..], &["--max-side", "32"]].concat());
    place.succeed(&["colorize", "--teacher", &onnx("ddcolor_tiny.onnx")]);
    let told = place.json(&["frames", "-o", "out/frames", "--json"]);
    conforms(&told, "frames");
    let names: Vec<String> = (0..scene::VIEWS).map(scene::name).collect();
    assert_eq!(place.files("out/frames"), names);
    assert_eq!(
        (&told["photos"], &told["placed"], &told["carried"]),
        (&10.into(), &10.into(), &0.into())
    );
    let mut colorful = 0.0_f64;
    for (index, name) in names.iter().enumerate() {
        let colored = image::open(place.path("out/frames").join(name)).expect("a picture");
        assert_eq!(colored.color(), image::ColorType::Rgb8);
        assert_eq!([colored.width(), colored.height()], scene::SIZE);
        let colored = lab(&place, &format!("out/frames/{name}"));
        let photo = scene::photo(index);
        for (lab, rgb) in colored.iter().zip(photo.pixels()) {
            let own = gs_chroma::color::srgb_to_lab(rgb.0.map(|v| f64::from(v) / 255.0))[0];
            assert!((lab[0] - own).abs() < 0.7, "{name}: {} {own}", lab[0]);
            colorful = colorful.max(lab[1].hypot(lab[2]));
        }
    }
    assert!(colorful > 3.0, "{colorful}");
    // Where they come from stands beside them.
    let changes = place.read("out/frames.changes.json");
    let changes: serde_json::Value = serde_json::from_slice(&changes).expect("JSON");
    conforms(&changes, "changes");
    assert_eq!(told["changes"], "out/frames.changes.json");
    let teacher = &changes["teachers"][0];
    assert_eq!(
        teacher["sha256"].as_str().map(str::len),
        Some(64),
        "{teacher}"
    );
    for frame in changes["frames"].as_array().expect("frames") {
        let shares = [
            "scene",
            "teacher",
            "steadied",
            "interpolated",
            "spread",
            "painted",
        ];
        let sum: f64 = shares
            .iter()
            .filter_map(|share| frame[share].as_f64())
            .sum();
        let scene = frame["scene"].as_f64().expect("a share");
        assert!((sum - 1.0).abs() < 1e-6 && scene > 0.1, "{frame}");
    }
    let html = String::from_utf8(place.read("out/frames.changes.html")).expect("text");
    assert!(
        html.contains("<td>00.png</td>")
            && html.contains(" to left/09.png</td>")
            && html.contains("ddcolor_tiny.onnx"),
        "{html}"
    );
    // The same once more, and the teacher's own pictures are others.
    place.succeed(&["frames", "-o", "again"]);
    place.succeed(&["frames", "-o", "alone", "--teacher-alone"]);
    for name in &names {
        let read = |folder: &str| place.read(&format!("{folder}/{name}"));
        assert!(read("out/frames") == read("again"), "{name}");
        assert!(read("out/frames") != read("alone"), "{name}");
    }
}

#[test]
fn a_photo_without_a_pose_takes_its_colors_from_its_neighbors() {
    let place = place_with_run();
    // Between 03 and 04, where both look alike.
    scene::photo(3)
        .save(place.path("scene/images/035.png"))
        .expect("writable");
    let told = place.json(&["frames", "-o", "out", "--json"]);
    assert_eq!((&told["placed"], &told["carried"]), (&10.into(), &1.into()));
    let neighbors = "colored by their neighbors, without a pose: 035.png";
    let done = place.run(&["frames", "-o", "out"]);
    assert!(done.stderr.contains(neighbors), "{}", done.stderr);
    let [carried, own] = ["out/035.png", "out/03.png"].map(|name| lab(&place, name));
    let gray: Vec<[f64; 3]> = own.iter().map(|lab| [lab[0], 0.0, 0.0]).collect();
    let (to_own, to_gray) = (apart(&carried, &own), apart(&gray, &own));
    assert!(to_own < 0.35 * to_gray, "{to_own} {to_gray}");
    // One that is no photo is left out with a word, and so is none of the others.
    place.write("scene/images/036.png", b"no picture");
    let done = place.run(&["frames", "-o", "out"]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(done.stderr.contains("warning: left out") && done.stderr.contains("036.png"));
}

#[test]
fn photos_before_the_first_pose_and_after_the_last_take_the_nearest_ones_colors() {
    let place = place_with_run();
    // Nobody else knows their colors.
    let mut report = place.report("runs/scene");
    report["chroma"]["teachers"] = serde_json::json!([]);
    place.write("runs/scene/report.json", report.to_string());
    for (index, name) in [(0, "0.png"), (9, "z.png")] {
        let path = place.path("scene/images").join(name);
        scene::photo(index).save(path).expect("writable");
    }
    let told = place.json(&["frames", "-o", "out", "--json"]);
    assert_eq!(told["carried"], 2);
    for (name, nearest) in [("0.png", "00.png"), ("z.png", "left/09.png")] {
        let [carried, own] = [name, nearest].map(|name| lab(&place, &format!("out/{name}")));
        let gray: Vec<[f64; 3]> = own.iter().map(|lab| [lab[0], 0.0, 0.0]).collect();
        let (to_own, to_gray) = (apart(&carried, &own), apart(&gray, &own));
        assert!(to_own < 0.35 * to_gray, "{name}: {to_own} {to_gray}");
    }
}

#[test]
fn sixteen_bits_stay_sixteen() {
    let place = place_with_run();
    let gray = ImageBuffer::from_fn(scene::SIZE[0], scene::SIZE[1], |x, y| {
        Luma([(20_000 + 300 * x + 77 * y) as u16])
    });
    let path = place.path("scene/images/02.png");
    DynamicImage::ImageLuma16(gray.clone())
        .save(path)
        .expect("writable");
    place.succeed(&["frames", "-o", "out"]);
    for (name, color) in [
        ("02.png", image::ColorType::Rgb16),
        ("03.png", image::ColorType::Rgb8),
    ] {
        let colored = image::open(place.path("out").join(name)).expect("a picture");
        assert_eq!(colored.color(), color, "{name}");
    }
    for (lab, gray) in lab(&place, "out/02.png").iter().zip(gray.pixels()) {
        let own = gs_chroma::color::srgb_to_lab([f64::from(gray.0[0]) / 65535.0; 3])[0];
        assert!((lab[0] - own).abs() < 0.01, "{} {own}", lab[0]);
    }
}

/// A monochrome camera's files use little of their 16 bits, and some pixels are brighter than what
/// the scene is normalized to.
#[test]
fn nothing_is_clipped_that_the_file_tells_apart() {
    const BLACK: u16 = 178;
    let place = place_with_scene();
    let value = |x: u32, y: u32, gray: u8| match (x, y) {
        (x, 7) if x < 12 => 3900 + 10 * x as u16,
        _ => BLACK + 14 * u16::from(gray),
    };
    let photos: Vec<_> = (0..scene::VIEWS)
        .map(|index| {
            let gray = DynamicImage::ImageRgb8(scene::photo(index)).into_luma8();
            let deep = ImageBuffer::from_fn(gray.width(), gray.height(), |x, y| {
                Luma([value(x, y, gray.get_pixel(x, y).0[0])])
            });
            let path = place.path("scene/images").join(scene::name(index));
            DynamicImage::ImageLuma16(deep.clone())
                .save(path)
                .expect("writable");
            deep
        })
        .collect();
    place.succeed(&QUICK_FIT);
    let [_, high]: [f64; 2] =
        serde_json::from_value(place.report("runs/scene")["capture"]["normalize"].clone())
            .expect("a range");
    assert!(high < 3900.0, "{high}");
    place.succeed(&[
        "colorize",
        "--teacher",
        &onnx("ddcolor_tiny.onnx"),
        "--rounds",
        "1",
    ]);
    let done = place.run(&["frames", "-o", "out"]);
    assert!(
        done.stderr.contains("nothing is clipped"),
        "{}",
        done.stderr
    );
    let values = || {
        photos
            .iter()
            .flat_map(|photo| photo.pixels())
            .map(|pixel| f64::from(pixel.0[0]))
    };
    let low = values().fold(f64::INFINITY, f64::min);
    for (index, photo) in photos.iter().enumerate() {
        let colored = lab(&place, &format!("out/{}", scene::name(index)));
        for (lab, gray) in colored.iter().zip(photo.pixels()) {
            // One line from the least to the greatest of all photos.
            let share = (f64::from(gray.0[0]) - low) / (4010.0 - low);
            let own = gs_chroma::color::srgb_to_lab([share; 3])[0];
            assert!((lab[0] - own).abs() < 0.01, "{index}: {} {own}", lab[0]);
        }
    }
}

#[test]
fn what_it_cannot_do_it_says() {
    let place = place_with_scene();
    place.succeed(&QUICK_FIT);
    let done = place.run(&["frames", "-o", "out"]);
    assert_eq!(done.code, Some(1));
    assert!(
        done.stderr.contains("gs-chroma colorize"),
        "{}",
        done.stderr
    );
    place.succeed(&["colorize", "--teacher", &onnx("ddcolor_tiny.onnx")]);
    let done = place.run(&["frames", "-o", "scene/images"]);
    assert_eq!(done.code, Some(1));
    assert!(done.stderr.contains("did not write"), "{}", done.stderr);
    for (output, word) in [
        ("out.avi", ".mp4, .mov, .m4v, .mkv or .mxf"),
        ("out.zip", "name a folder"),
    ] {
        let done = place.run(&["frames", "-o", output]);
        assert_eq!(done.code, Some(2), "{output}");
        assert!(done.stderr.contains(word), "{output}: {}", done.stderr);
        assert!(!place.path(output).exists(), "{output}");
    }
    for rate in ["0", "25/0", "film"] {
        let done = place.run(&["frames", "-o", "out.mp4", "--fps", rate]);
        assert_eq!(done.code, Some(2), "{rate}");
    }
    let mut command = place.command(&["frames", "-o", "out.mp4"]);
    let done = super::program::Done::of(command.env("PATH", "").output());
    assert_eq!(done.code, Some(1));
    assert!(
        done.stderr.contains("ffmpeg is not installed"),
        "{}",
        done.stderr
    );
    assert!(!place.path("out.mp4").exists());
    // A teacher that is gone is no reason to stop.
    let mut report = place.report("runs/scene");
    report["chroma"]["teachers"][0]["path"] = "gone.onnx".into();
    place.write("runs/scene/report.json", report.to_string());
    let done = place.run(&["frames", "-o", "out"]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(done.stderr.contains("warning:") && done.stderr.contains("gone.onnx"));
    let done = place.run(&["frames", "-o", "out", "--teacher", "gone.onnx"]);
    assert_eq!(done.code, Some(1));
}

#[test]
fn hints_on_a_photo_without_a_pose_are_told() {
    let place = place_with_run();
    let path = place.path("scene/images/unplaced.png");
    scene::photo(2).save(path).expect("writable");
    let mut paint = image::RgbaImage::new(scene::SIZE[0], scene::SIZE[1]);
    paint.put_pixel(9, 9, image::Rgba([255, 0, 0, 255]));
    std::fs::create_dir(place.path("hints")).expect("writable");
    paint
        .save(place.path("hints/unplaced.png"))
        .expect("writable");
    let teacher = onnx("ddcolor_tiny.onnx");
    let done = place.run(&["colorize", "--teacher", &teacher, "--hints", "hints"]);
    assert_eq!(done.code, Some(1));
    for part in ["unplaced.png", "COLMAP placed none", "10 of 11 photos"] {
        assert!(done.stderr.contains(part), "{part}: {}", done.stderr);
    }
}

/// Something came by while three photos of the bundled scene were taken, and is painted in one.
#[test]
fn a_stroke_on_what_the_scene_leaves_open_colors_it_there_and_in_the_photos_around() {
    const PASSES: [usize; 3] = [5, 6, 7];
    let demo = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo");
    let teacher = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/assets/teacher/demo-teacher.onnx"
    );
    let place = Place::new();
    let fit = [
        "fit",
        demo,
        "-o",
        "run",
        "--preset",
        "draft",
        "--iterations",
    ];
    let small = ["80", "--max-side", "162", "--max-splats", "2000"];
    place.succeed(&[&fit[..], &small, &["--no-fill-gaps"]].concat());
    place.succeed(&["colorize", "run", "--teacher", teacher, "--rounds", "1"]);
    let name = |photo: usize| format!("garden_{photo:02}");
    let [left, top, side] = [60, 40, 70];
    let within = |x: u32, y: u32, more: u32| {
        let [x0, y0] = [left - more, top - more];
        (x0..left + side + more).contains(&x) && (y0..top + side + more).contains(&y)
    };
    let copy = |below: &str| {
        let from = std::path::Path::new(demo).join(below);
        std::fs::create_dir_all(place.path("scene").join(below)).expect("a folder");
        for file in std::fs::read_dir(from).expect("files").flatten() {
            let to = place.path("scene").join(below).join(file.file_name());
            std::fs::copy(file.path(), to).expect("a copy");
        }
    };
    for below in ["images", "sparse/0"] {
        copy(below);
    }
    for photo in PASSES {
        let path = place.path(&format!("scene/images/{}.jpg", name(photo)));
        let mut image = image::open(&path).expect("a photo").into_rgb8();
        for (x, y, pixel) in image.enumerate_pixels_mut() {
            if within(x, y, 0) {
                *pixel = image::Rgb([225 + (x % 2) as u8; 3]);
            }
        }
        let encoder = std::fs::File::create(&path).expect("a file");
        image::codecs::jpeg::JpegEncoder::new_with_quality(encoder, 98)
            .encode_image(&image)
            .expect("a photo");
    }
    let mut paint = image::RgbaImage::new(324, 216);
    for x in left + 10..left + side - 10 {
        for y in top + 30..top + 34 {
            paint.put_pixel(x, y, image::Rgba([255, 170, 150, 255]));
        }
    }
    std::fs::create_dir(place.path("hints")).expect("a folder");
    let hint = format!("hints/{}.png", name(PASSES[1]));
    paint.save(place.path(&hint)).expect("a hint");
    let frames = ["frames", "run", "--colmap", "scene", "--json", "-o"];
    place.json(&[&frames[..], &["plain"]].concat());
    let told = place.json(&[&frames[..], &["painted", "--hints", "hints"]].concat());
    assert_eq!(told["painted"], 3, "{told}");
    for photo in 0..14 {
        let [plain, painted] =
            ["plain", "painted"].map(|folder| format!("{folder}/{}.png", name(photo)));
        if !PASSES.contains(&photo) {
            assert!(place.read(&plain) == place.read(&painted), "{photo}");
            continue;
        }
        let [plain, painted] = [plain, painted].map(|file| lab(&place, &file));
        let mut colored = 0;
        for (i, (plain, painted)) in plain.iter().zip(&painted).enumerate() {
            let (x, y) = (i as u32 % 324, i as u32 / 324);
            let moved = gs_chroma::color::ciede2000(*plain, *painted);
            assert!(
                moved < 1.0 || within(x, y, 4),
                "{photo}: {moved} at {x}, {y}"
            );
            colored += usize::from(within(x, y, 0) && painted[1] > 8.0);
        }
        assert!(colored > 3900, "{photo}: {colored} pixels of 4900");
    }
}
