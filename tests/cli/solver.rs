//! `colorize --solver irls`, the default.

use gs_chroma::splats::read_ply;
use image::imageops::{FilterType, resize};
use image::{Rgb, RgbImage};

use super::program::Place;
use super::scene;
use super::shared::{LUMA, onnx, place_with_run};

/// Two rounds; one would do to be quick, but then nothing is repeated.
const QUICK: [&str; 5] = ["colorize", "--rounds", "2", "--json", "--teacher"];

#[test]
fn the_default_solver_says_what_it_did() {
    let place = place_with_run();
    let teacher = onnx("ddcolor_tiny.onnx");
    let chroma = &place.json(&[&QUICK[..], &[&teacher]].concat())["chroma"];
    assert_eq!(chroma["settings"]["solver"], "irls");
    assert_eq!(chroma["iterations"], 2);
    assert_eq!(chroma["until"], LUMA + 2);
    assert_eq!(chroma["settings"]["robust"], 10.0);
    assert_eq!(chroma["settings"]["correct_views"], true);
    assert_eq!(chroma["settings"]["fill"], true);
    assert_eq!(chroma["pinned_views"], 8);
    let (estimated, taken) = (
        &chroma["estimated_device_memory"],
        &chroma["peak_device_memory"],
    );
    assert!(estimated.as_u64() > Some(0), "{estimated}");
    assert!(taken.is_null() || taken.as_u64() > Some(0), "{taken}");
    // Eight views a round; in the end half a pass.
    assert_eq!(chroma["passes"], 8.0 * 2.5);
    assert!(chroma["moved"].as_f64() > Some(0.1), "{}", chroma["moved"]);

    let plain = ["--robust", "off", "--correct-views", "off", "--fill", "off"];
    let choices = ["--sh-degree", "1"];
    let arguments = [&QUICK[..], &[&teacher], &plain, &choices].concat();
    let chroma = &place.json(&arguments)["chroma"];
    assert_eq!(chroma["settings"]["robust"], serde_json::Value::Null);
    assert_eq!(chroma["settings"]["correct_views"], false);
    assert_eq!(chroma["settings"]["fill"], false);
    assert_eq!(chroma["iterations"], 2);
    assert_eq!(chroma["settings"]["sh_degree"], 1);
}

/// A teacher that agrees about what COLMAP's points show and contradicts itself elsewhere: to
/// bring its views into line there would set them apart here.
#[test]
fn views_that_corrections_do_not_help_are_taken_as_they_are() {
    let place = place_with_run();
    scene::write_tracks(&place.path("scene"), |[x, _]| x < 26.0);
    for index in 0..scene::VIEWS {
        let gray = image::DynamicImage::from(scene::photo(index)).to_luma8();
        let painted = RgbImage::from_fn(scene::SIZE[0], scene::SIZE[1], |x, y| {
            let level = f32::from(gray.get_pixel(x, y).0[0]);
            let tint = match (x < 30, index % 2) {
                (true, _) => [1.0 + 0.2 * (y as f32 / 24.0 - 1.0), 1.0, 0.8],
                (false, 0) => [1.5, 0.9, 0.5],
                (false, _) => [0.5, 0.9, 1.5],
            };
            Rgb(tint.map(|t| (t * level).min(255.0) as u8))
        });
        let path = place.path("painted").join(scene::name(index));
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        painted.save(path).expect("an image");
    }
    let colorize = ["colorize", "--teacher", "painted", "--correct-views"];
    let told = |switch: &str| {
        let output = format!("{switch}.ply");
        let done = place.run(&[&colorize[..], &[switch, "-o", &output]].concat());
        assert_eq!(done.code, Some(0), "{}", done.stderr);
        done.stderr.contains("view correction is off")
    };
    assert!(told("on") && !told("off"));
    // Rounds with corrections came first, so that colors are nearly those without.
    let [on, off] = ["on.ply", "off.ply"].map(|name| read_ply(&place.path(name)).expect(name));
    let [on, off] = [on, off].map(|read| read.splats.sh.coefficients);
    let apart = on.iter().zip(&off).map(|(x, y)| (x - y).abs());
    let apart = apart.sum::<f32>() / on.len() as f32;
    let size = off.iter().map(|value| value.abs()).sum::<f32>() / off.len() as f32;
    assert!(apart < 0.15 * size, "{apart} of {size}");
}

#[test]
fn solving_again_gives_the_same_bytes() {
    let place = place_with_run();
    let teacher = onnx("ddcolor_tiny.onnx");
    for output in ["first.ply", "second.ply"] {
        place.succeed(&[&QUICK[..], &[&teacher, "-o", output]].concat());
    }
    assert!(place.read("first.ply") == place.read("second.ply"));
}

/// The least that there may be, as the error says, gives the same file.
#[test]
fn a_memory_limit_changes_no_byte() {
    let place = place_with_run();
    let teacher = onnx("ddcolor_tiny.onnx");
    let with = |rest: &[&'static str]| [&QUICK[..], &[&teacher], rest].concat();
    place.succeed(&with(&["-o", "all.ply"]));
    // Budgets that hold some views or one are tests/device/kernels': this scene is too small for them.
    let report = place.json(&with(&["--memory-limit", "1", "-o", "few.ply"]));
    let estimated = report["chroma"]["estimated_device_memory"].as_u64();
    assert!(
        estimated.is_some_and(|bytes| bytes <= 1 << 20),
        "{estimated:?}"
    );
    assert!(place.read("all.ply") == place.read("few.ply"));
}

#[test]
fn options_of_the_other_solver_are_refused() {
    let place = place_with_run();
    let teacher = onnx("ddcolor_tiny.onnx");
    let adam = ["--solver", "adam"];
    let cases: [(&[&str], &str); 5] = [
        (&["--until", "62"], "--until needs --solver adam"),
        (&["--scales", "1"], "--scales needs --solver adam"),
        (
            &[&adam[..], &["--rounds", "2"]].concat(),
            "--rounds needs --solver irls",
        ),
        (
            &[&adam[..], &["--fill", "on"]].concat(),
            "--fill needs --solver irls",
        ),
        (
            &[&adam[..], &["--correct-views", "on"]].concat(),
            "--correct-views needs --solver irls",
        ),
    ];
    for (options, message) in cases {
        let done = place.run(&[&["colorize", "--teacher", &teacher], options].concat());
        assert_eq!(done.code, Some(2), "{options:?}: {}", done.stderr);
        assert!(done.stderr.contains(message), "{}", done.stderr);
    }
    for wrong in [
        ["--robust", "0"],
        ["--robust", "nan"],
        ["--sh-degree", "4"],
        ["--scales", "5"],
        ["--rounds", "0"],
    ] {
        let done = place.run(&[&["colorize", "--teacher", &teacher], &wrong[..]].concat());
        assert_eq!(done.code, Some(2), "{wrong:?}");
    }
}

/// Paints some photos' copies in one color, keeping their lightness out of it.
fn paint(place: &Place, photos: &[usize], color: [u8; 3]) {
    let [width, height] = scene::SIZE;
    let flat = RgbImage::from_pixel(4, 4, Rgb(color));
    for &photo in photos {
        let file = place.path(&format!("three/{}", scene::name(photo)));
        std::fs::create_dir_all(file.parent().expect("a folder")).expect("a folder");
        resize(&flat, width, height, FilterType::Nearest)
            .save(file)
            .expect("a picture");
    }
}

/// Three frames colored by hand color the whole scene, from every side.
#[test]
fn three_painted_frames_color_the_whole_scene() {
    let place = place_with_run();
    paint(&place, &[1, 2, 3], [200, 120, 80]);
    let report = place.json(&[&QUICK[..], &["three"]].concat());
    assert_eq!(report["chroma"]["colored_views"], 3);
    // These show all of it, but for some of what surrounds it.
    let unseen = report["chroma"]["unseen"].as_f64();
    assert!(unseen.is_some_and(|unseen| unseen < 0.3), "{unseen:?}");
    place.succeed(&["render", "--views", "all", "-o", "pictures"]);
    let mut grays = Vec::new();
    for photo in 0..scene::VIEWS {
        let file = format!("pictures/{}", scene::name(photo));
        let file = place.path(&file).with_extension("png");
        let picture = image::open(file).expect("a picture").to_rgb8();
        // Where the scene is bright enough to have a color, it is warm.
        let lit: Vec<_> = (picture.pixels()).filter(|p| p.0[0] > 60).collect();
        let warm = lit.iter().filter(|p| p.0[0] > p.0[2] + 8).count();
        grays.push(1.0 - warm as f64 / lit.len().max(1) as f64);
    }
    assert!(grays.iter().all(|&gray| gray < 0.05), "{grays:?}");
}
