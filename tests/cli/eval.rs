//! `eval`.

use std::fs;

use gs_chroma::splats::{read_ply, write_ply};
use serde_json::Value;

use super::program::Place;
use super::scene;
use super::shared::{QUICK_FIT, onnx, place_with_run};

/// Frames enough for Δ = 1, 7 and 10, too few for 30.
const FRAMES: usize = 12;

/// Evaluates the run briefly; gives what `--json` prints.
fn evaluated(place: &Place, more: &[&str]) -> Value {
    let frames = FRAMES.to_string();
    place.json(&[&["eval", "--frames", &frames, "--json"], more].concat())
}

fn of<'a>(scores: &'a Value, method: &str) -> &'a Value {
    let scores = scores.as_array().expect("a list");
    let found = scores.iter().find(|score| score["method"] == method);
    found.unwrap_or_else(|| panic!("no {method} in {scores:?}"))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

#[test]
fn a_run_beside_its_network_and_the_baseline() {
    let place = place_with_run();
    let teacher = onnx("ddcolor_tiny.onnx");
    let found = evaluated(&place, &["--teacher", &teacher, "--baselines"]);
    let written: Value = serde_json::from_slice(&place.read("runs/scene/eval.json")).expect("JSON");
    assert_eq!(found, written);
    assert_eq!(found["measured_on"], "test");
    assert_eq!(found["teacher"]["name"], "ddcolor_tiny.onnx");
    assert_eq!(
        found["views"].as_array().expect("views").len(),
        scene::HELD_OUT
    );

    // What colorize measured of the same pictures.
    let report = place.report("runs/scene");
    let chroma = &report["chroma"];
    let exported = of(&found["pictures"], "exported");
    for (ours, theirs) in [
        (&found["luma"]["psnr"], &report["luma"]["held_out"]["psnr"]),
        (&found["bake"]["mean"], &chroma["bake"]["mean"]),
        (
            &exported["delta_e"]["mean"],
            &chroma["pictures"]["delta_e"]["mean"],
        ),
        (
            &exported["colorfulness"],
            &chroma["pictures"]["colorfulness"],
        ),
    ] {
        assert!(
            (number(ours) - number(theirs)).abs() < 1e-3,
            "{ours} {theirs}"
        );
    }

    // The path: 12 frames, so that 30 is too far.
    let path = &found["path"];
    assert_eq!(
        (&path["frames"], &path["flow"]),
        (&FRAMES.into(), &"geometric".into())
    );
    assert_eq!(path["skipped"], serde_json::json!([30]));
    for (delta, pairs) in [(1, 11), (7, 5), (10, 2)] {
        let scores = path["consistency"].as_array().expect("a list");
        let at: Vec<Value> = scores
            .iter()
            .filter(|s| s["delta"] == delta)
            .cloned()
            .collect();
        let native = of(&Value::Array(at), "native").clone();
        assert_eq!(native["pairs"], pairs);
        let [error, rms] = ["error", "rms"].map(|key| number(&native[key]));
        assert!(
            (255.0 * error.sqrt() - rms).abs() < 1e-9 && rms < 5.0,
            "{native}"
        );
        let values = number(&native["values"]);
        let pixels = f64::from(pairs * (scene::SIZE[0] * scene::SIZE[1]) as i32);
        assert!((values - 2.0 * pixels * number(&native["visible"])).abs() < 0.5);
        assert!(number(&native["visible"]) > 0.1, "{native}");
    }
    let between = &found["between"];
    assert_eq!(between["views"], scene::VIEWS);
    for method in ["native", "exported", "teacher", "per_frame", "photo"] {
        assert!(
            number(&of(&between["consistency"], method)["pairs"]) >= 9.0,
            "{method}"
        );
    }
    // Two views of one splat differ less than two answers of a network.
    let rms = |method| number(&of(&between["consistency"], method)["rms"]);
    assert!(rms("native") < rms("teacher"), "{between}");
}

#[test]
fn the_teacher_that_colored_the_run_is_measured_where_it_still_is() {
    let place = place_with_run();
    let model = onnx("ddcolor_tiny.onnx");
    let found = evaluated(&place, &[]);
    assert_eq!(found["teacher"]["name"], "ddcolor_tiny.onnx");
    let named = evaluated(&place, &["--teacher", &model]);
    assert_eq!(found["pictures"], named["pictures"]);
    // Elsewhere, or gone.
    let report = String::from_utf8(place.read("runs/scene/report.json")).expect("text");
    place.write(
        "runs/scene/report.json",
        report.replace(&model, "gone.onnx"),
    );
    let said = place.run(&["eval", "--frames", "2"]);
    let warned = "warning: the run's teacher is not measured: ";
    assert!(said.stderr.contains(warned), "{}", said.stderr);
}

#[test]
fn the_photos_as_a_teacher_make_no_error() {
    let place = place_with_run();
    let found = evaluated(&place, &["--teacher", "scene/images", "--baselines"]);
    let teacher = of(&found["pictures"], "teacher");
    // The gray has 8 bits, the colors have all theirs.
    assert!(number(&teacher["ab_error"]) < 1e-3, "{teacher}");
    assert!(number(&teacher["delta_e"]["mean"]) < 0.5, "{teacher}");
    let photo = of(&found["pictures"], "photo");
    assert!((number(&teacher["colorfulness"]) - number(&photo["colorfulness"])).abs() < 0.5);
    assert_eq!(photo["ab_error"], Value::Null);
    let rms = |method| number(&of(&found["between"]["consistency"], method)["rms"]);
    assert!((rms("teacher") - rms("photo")).abs() < 1e-3);
    // A folder colors no frames.
    let methods: Vec<&Value> = found["pictures"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|s| &s["method"])
        .collect();
    assert_eq!(
        methods,
        ["exported", "native", "teacher", "rgb_splats", "photo"]
    );
}

#[test]
fn another_recipe_is_measured_beside_the_scene() {
    let place = place_with_run();
    let recipe = ["--recipe", "chromadistill-code"];
    let teacher = ["--teacher", "scene/images"];
    let found = evaluated(&place, &[&teacher[..], &recipe, &recipe].concat());
    let peers = found["peers"].as_array().expect("a list");
    // Named twice, done once.
    assert_eq!(peers.len(), 1, "{peers:?}");
    assert_eq!(peers[0]["method"], "chromadistill_code");
    assert_eq!(
        (&peers[0]["iterations"], &peers[0]["passes"]),
        (&3000.into(), &3000.0.into())
    );
    let [theirs, ours, teacher] =
        ["chromadistill_code", "native", "teacher"].map(|method| of(&found["pictures"], method));
    // It colors; and what it has of lightness is its own, whereas ours is luma's.
    assert!(number(&theirs["ab_error"]) < 0.9 * number(&teacher["colorfulness"]));
    assert!(number(&theirs["diversity"]) > 1.5, "{theirs}");
    let luma = &found["luma"];
    assert!((number(&ours["gray_psnr"]) - number(&luma["psnr"])).abs() < 0.1);
    assert!((number(&ours["sharpness"]) / number(&luma["sharpness"]) - 1.0).abs() < 0.05);
    let lost = number(&luma["psnr"]) - number(&theirs["gray_psnr"]);
    let kept = number(&theirs["sharpness"]) / number(&luma["sharpness"]);
    // Its authors report 0.3 dB and 0.97.
    assert!(lost.abs() > 0.01 && lost < 1.0, "{theirs} {luma}");
    assert!(kept > 0.9, "{theirs} {luma}");
    assert_eq!(number(&teacher["gray_psnr"]), 100.0);
    let page = String::from_utf8(place.read("runs/scene/eval/index.html")).expect("text");
    assert!(
        page.contains("<li>beside ChromaDistill, code: views differ at equal colorfulness by"),
        "{page}"
    );
    // Its splats can be looked at.
    let words = place.succeed(&["info", "runs/scene/eval/chromadistill-code.ply"]);
    assert!(
        words.contains("Gaussians") || words.contains("splats"),
        "{words}"
    );
}

#[test]
fn the_page_shows_every_view_with_files_that_are_there() {
    let place = place_with_run();
    let words = place.succeed(&["eval", "--frames", "3"]);
    for part in [
        "ΔE00",
        "a/b error",
        "Δ = 1",
        "too short",
        "0.01",
        "(x+128)/255",
        "visible pixels × 2",
    ] {
        assert!(words.contains(part), "{part}: {words}");
    }
    let page = String::from_utf8(place.read("runs/scene/eval/index.html")).expect("text");
    // It needs nothing from elsewhere.
    assert!(
        !page.contains("<script src") && !page.contains("http:") && !page.contains("https:"),
        "{page}"
    );
    let film = place.path("runs/scene/eval/flight.mp4").exists();
    assert_eq!(page.contains("<video src=\"flight.mp4\""), film);
    assert_eq!(page.contains("data-frames=\"3\""), !film);
    for part in ["which is invisible", "<li>gray scene: held-out PSNR"] {
        assert!(page.contains(part), "{part}: {page}");
    }
    let mut sources = 0;
    for part in page.split("src=\"").skip(1) {
        let file = part.split('"').next().expect("a name");
        if file.ends_with(".mp4") {
            continue;
        }
        let image = image::open(place.path("runs/scene/eval").join(file)).expect("a picture");
        assert_eq!([image.width(), image.height()], scene::SIZE, "{file}");
        sources += 1;
    }
    // Photo, luma, teacher, ours and three maps a view, luma and ours a frame, and the first where there is
    // no film.
    assert_eq!(sources, 7 * scene::HELD_OUT + 2 * 3 + usize::from(!film));
    assert!(page.contains(&scene::name(8)), "{page}");

    // A second evaluation leaves nothing of the first, a new coloring neither.
    place.write("runs/scene/eval/frame-0099.png", "old");
    place.succeed(&["eval", "--frames", "2"]);
    let files = place.files("runs/scene");
    assert!(
        !files
            .iter()
            .any(|name| name.contains("0099") || name.contains(".eval-")),
        "{files:?}"
    );
    place.succeed(&[
        "colorize",
        "--teacher",
        "scene/images",
        "--solver",
        "adam",
        "--until",
        "62",
    ]);
    let files = place.files("runs/scene");
    assert!(
        !files.iter().any(|name| name.starts_with("eval")),
        "{files:?}"
    );
}

#[test]
fn flow_from_files_takes_the_place_of_depth() {
    let place = place_with_run();
    // Two frames; what stood at x is said to stand at x + 1.
    let [width, height] = scene::SIZE;
    let write = |name: &str, u: f32| {
        let mut bytes = b"PIEH".to_vec();
        bytes.extend([width, height].iter().flat_map(|side| side.to_le_bytes()));
        for _ in 0..width * height {
            bytes.extend([u, 0.0].iter().flat_map(|v| v.to_le_bytes()));
        }
        place.write(&format!("flow/{name}.flo"), bytes);
    };
    write("0000-0001", 1.0);
    write("0001-0000", -1.0);
    let eval = ["eval", "--frames", "2", "--flow", "flow", "--json"];
    let found = place.json(&eval);
    assert_eq!(found["path"]["flow"], "files");
    let score = of(&found["path"]["consistency"], "native");
    let geometric = place.json(&["eval", "--frames", "2", "--json"]);
    let own = number(&of(&geometric["path"]["consistency"], "native")["rms"]);
    assert!((number(&score["rms"]) - own).abs() > 1e-6, "{score}");
    // Nothing is visible where there and back do not meet.
    write("0001-0000", 1.0);
    let found = place.json(&eval);
    let score = of(&found["path"]["consistency"], "native");
    assert_eq!(
        (&score["values"], &score["error"]),
        (&0.into(), &Value::Null)
    );

    fs::remove_file(place.path("flow/0001-0000.flo")).expect("a file");
    let error = fails(&place, &eval, 1);
    assert!(
        error.contains("0001-0000.flo") && error.contains("--flow"),
        "{error}"
    );
    place.write("flow/0001-0000.flo", "no flow");
    assert!(fails(&place, &eval, 1).contains("no .flo file"));
}

#[test]
fn a_perceptual_distance_by_a_network_of_ones_own() {
    let place = place_with_run();
    let with = |name: &str| {
        let network = onnx(name);
        place.json(&["eval", "--frames", "2", "--lpips", &network, "--json"])
    };
    let found = with("perceptual.onnx");
    // That network's distance is the mean squared error of values in [-1, 1].
    for view in found["views"].as_array().expect("views") {
        for score in [&view["luma"], of(&view["pictures"], "exported")] {
            let want = 4.0 * 10_f64.powf(-number(&score["psnr"]) / 10.0);
            assert!(
                (number(&score["lpips"]) / want - 1.0).abs() < 1e-3,
                "{score}"
            );
        }
    }
    // A smaller picture loses detail, and errors with it.
    let small = number(&with("perceptual_small.onnx")["luma"]["lpips"]);
    assert!(
        small > 0.0 && small < number(&found["luma"]["lpips"]),
        "{small}"
    );
    for (name, part) in [
        ("ddcolor_tiny.onnx", "two inputs"),
        ("truncated.onnx", "not a usable ONNX model"),
        ("missing.onnx", "no such file"),
    ] {
        let error = fails(
            &place,
            &["eval", "--frames", "2", "--lpips", &onnx(name)],
            1,
        );
        assert!(error.contains(name) && error.contains(part), "{error}");
    }
}

/// The one line of error of a run that fails with this code.
fn fails(place: &Place, arguments: &[&str], code: i32) -> String {
    let done = place.run(arguments);
    assert_eq!(done.code, Some(code), "{arguments:?}: {}", done.stderr);
    done.stderr
}

#[test]
fn what_cannot_be_measured_is_said_with_the_remedy() {
    let place = place_with_run();
    let eval = ["eval", "--frames", "2"];
    for wrong in [
        &["eval", "--frames", "1"][..],
        &["eval", "--frames", "many"],
        &["eval", "--baselines"],
    ] {
        fails(&place, wrong, 2);
    }
    // A folder that is no page is not replaced.
    place.write("runs/scene/eval/notes.txt", "mine");
    let error = fails(&place, &eval, 1);
    assert!(error.contains("in the way"), "{error}");
    fs::remove_dir_all(place.path("runs/scene/eval")).expect("a folder");

    let chroma = place.read("runs/scene/chroma.npy");
    place.write("runs/scene/chroma.npy", &chroma[..chroma.len() - 4]);
    let error = fails(&place, &eval, 1);
    assert!(
        error.contains("chroma.npy") && error.contains("colorize"),
        "{error}"
    );
    // Without it the exported file is measured alone.
    fs::remove_file(place.path("runs/scene/chroma.npy")).expect("a file");
    let done = place.run(&[&eval[..], &["--json"]].concat());
    assert!(done.stderr.contains("chroma.npy"), "{}", done.stderr);
    let found: Value = serde_json::from_str(&done.stdout).expect("JSON");
    assert_eq!(found["bake"], Value::Null);
    of(&found["pictures"], "exported");

    // Another file, then colors of other Gaussians in a run of a former version, then none.
    let luma = place.path("runs/scene/luma.ply");
    let some = read_ply(&luma).expect("a scene").splats.chosen(&[0, 1]);
    let color = place.path("runs/scene/color.ply");
    write_ply(&color, &some, glam::DVec3::ZERO, &[]).expect("writable");
    let error = fails(&place, &eval, 1);
    assert!(
        error.contains("not the file that this run wrote"),
        "{error}"
    );
    place.forget_files("runs/scene");
    let error = fails(&place, &eval, 1);
    assert!(error.contains("luma.ply"), "{error}");
    fs::remove_file(place.path("runs/scene/color.ply")).expect("a file");
    let error = fails(&place, &eval, 1);
    assert!(error.contains("not colored yet"), "{error}");
    // Nothing of a failure stays behind.
    let files = place.files("runs/scene");
    assert!(
        !files.iter().any(|name| name.contains(".eval-")),
        "{files:?}"
    );
}

#[test]
fn gray_photos_have_no_colors_to_compare() {
    let place = place_with_run();
    for index in 0..scene::VIEWS {
        let path = place.path("scene/images").join(scene::name(index));
        image::open(&path)
            .expect("a photo")
            .into_luma8()
            .save(path)
            .expect("writable");
    }
    let found = evaluated(&place, &[]);
    let exported = of(&found["pictures"], "exported");
    for key in ["psnr", "ssim", "delta_e", "ab_error", "lpips"] {
        assert_eq!(exported[key], Value::Null, "{key}");
    }
    assert!(number(&exported["colorfulness"]) > 0.0);
    assert!(number(&found["bake"]["mean"]) > 0.0);
    let between = found["between"]["consistency"].as_array().expect("a list");
    assert!(between.iter().all(|score| score["method"] != "photo"));
}

#[test]
fn a_single_photo_is_measured_on_itself() {
    let place = Place::new();
    scene::write_moved(&place.path("scene"), [0.0; 3]);
    let images = String::from_utf8(place.read("scene/sparse/images.txt")).expect("text");
    let first: String = images.split_inclusive('\n').take(2).collect();
    place.write("scene/sparse/images.txt", first);
    place.succeed(&QUICK_FIT);
    place.succeed(&[
        "colorize",
        "--teacher",
        "scene/images",
        "--solver",
        "adam",
        "--until",
        "5",
    ]);
    let found = evaluated(&place, &["--teacher", "scene/images"]);
    assert_eq!(found["measured_on"], "train");
    assert_eq!(found["views"].as_array().expect("views").len(), 1);
    assert_eq!(found["between"]["consistency"], serde_json::json!([]));
    // The path stands still, and so do its colors.
    let score = of(&found["path"]["consistency"], "native");
    assert!(number(&score["rms"]) < 1e-3, "{score}");
    let words = place.succeed(&["eval", "--frames", "2"]);
    assert!(
        words.contains("One training view against its photo"),
        "{words}"
    );
}

/// A program that answers to ffmpeg's name, on a PATH where there is nothing else of it.
#[cfg(unix)]
fn with_encoder(place: &Place, script: &str) -> super::program::Done {
    use std::os::unix::fs::PermissionsExt as _;
    place.write("bin/ffmpeg", script);
    let encoder = place.path("bin/ffmpeg");
    fs::set_permissions(&encoder, fs::Permissions::from_mode(0o755)).expect("executable");
    let mut command = place.command(&["eval", "--frames", "3"]);
    command.env("PATH", place.path("bin"));
    super::program::Done::of(command.output())
}

#[cfg(unix)]
#[test]
fn the_path_becomes_a_film_where_something_makes_films() {
    let place = place_with_run();
    let page = || String::from_utf8(place.read("runs/scene/eval/index.html")).expect("text");
    let film = "#!/bin/sh\n[ \"$1\" = -version ] && exit 0\nfor last; do :; done\n\
                while read -r line; do :; done\nprintf 12345678 > \"$last\"\n";
    let done = with_encoder(&place, film);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let film = page().contains("<video src=\"flight.mp4\"");
    assert!(film, "{}", done.stderr);
    assert!(!page().contains("figure class=\"flight\" data-frames"));
    assert_eq!(place.read("runs/scene/eval/flight.mp4"), b"12345678");

    let done = with_encoder(&place, "#!/bin/sh\necho no such encoder >&2\nexit 1\n");
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let warned = "warning: no film of the path: ffmpeg failed: no such encoder";
    assert!(done.stderr.contains(warned), "{}", done.stderr);
    assert!(page().contains("data-frames=\"3\"") && !page().contains("<video"));

    fs::remove_file(place.path("bin/ffmpeg")).expect("a file");
    let mut command = place.command(&["eval", "--frames", "3"]);
    let done = super::program::Done::of(command.env("PATH", place.path("bin")).output());
    assert!(!done.stderr.contains("film"), "{}", done.stderr);
    assert!(page().contains("data-frames=\"3\"") && page().contains("frames of 64×48 pixels"));
}
