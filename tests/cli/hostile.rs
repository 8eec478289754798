//! Input that lies, never ends, or was exchanged.

use std::{
    fs,
    path::PathBuf,
    process::{Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use image::{Luma, codecs::jpeg::JpegEncoder};

use super::program::{Done, Place};
use super::scene;
use super::shared::{QUICK_FIT, onnx, place_with_run, place_with_scene};

/// No input of a few bytes may keep the program longer.
const PATIENCE: Duration = Duration::from_secs(20);

/// Runs the program, which may not take long over it.
fn run_within_patience(place: &Place, arguments: &[&str]) -> Done {
    let mut command = place.command(arguments);
    let piped = command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = piped.stdin(Stdio::null()).spawn().expect("it starts");
    let begun = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if begun.elapsed() > PATIENCE {
            child.kill().expect("a child");
            child.wait().expect("a child");
            panic!("{arguments:?} does not end");
        }
        sleep(Duration::from_millis(20));
    }
    Done::of(child.wait_with_output())
}

/// It ends with one line that has these words.
fn refused(place: &Place, arguments: &[&str], words: &[&str]) {
    let done = run_within_patience(place, arguments);
    let told: Vec<&str> = done.stderr.lines().collect();
    assert_eq!(done.code, Some(1), "{arguments:?}: {told:?}");
    assert_eq!(told.len(), 1, "{arguments:?}: {told:?}");
    for word in words {
        assert!(told[0].contains(word), "{arguments:?}: {told:?}");
    }
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_no_input() {
    let network = onnx("ddcolor_tiny.onnx");
    let colorize = ["colorize", "runs/scene", "--teacher", &network];
    let fit = ["plan", "scene"];
    let render = ["render", "runs/scene", "-o", "pictures"];
    let cases: [(&str, &[&str]); 6] = [
        ("scene/images/03.png", &fit),
        ("scene/sparse/0/cameras.bin", &fit),
        ("runs/scene/report.json", &render),
        ("runs/scene/report.json", &["info", "runs/scene"]),
        ("runs/scene/luma.ply", &colorize),
        ("runs/scene/color.ply", &render),
    ];
    for (name, arguments) in cases {
        let place = place_with_run();
        let path = place.path(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
        let _ = fs::remove_file(&path);
        let made = Command::new("mkfifo").arg(&path).status();
        assert!(made.expect("mkfifo").success());
        let words = match name {
            // A folder is a capture, and a file a photo, where they are found.
            "scene/images/03.png" | "scene/sparse/0/cameras.bin" => vec![],
            _ => vec!["is a pipe or a device"],
        };
        let words = [&words[..], &[name.rsplit('/').next().expect("a name")]].concat();
        refused(&place, arguments, &words);
    }
    let place = place_with_run();
    for arguments in [
        &[
            "fit",
            "scene",
            "-o",
            "out",
            "--preset",
            "draft",
            "--init",
            "/dev/zero",
        ][..],
        &["export", "/dev/zero", "-o", "out.ply"],
        &["info", "/dev/zero"],
        &["teacher", "check", &network, "--photo", "/dev/zero"],
        &[&colorize[..], &["--teacher-profile", "/dev/zero"]].concat(),
    ] {
        refused(&place, arguments, &["/dev/zero"]);
    }
}

/// A gray JPEG of this size.
fn jpeg([width, height]: [u32; 2]) -> Vec<u8> {
    let shade = |x, y| Luma([(x * 5 + y * y) as u8]);
    let picture = image::GrayImage::from_fn(width, height, shade);
    let mut file = Vec::new();
    JpegEncoder::new(&mut file)
        .encode_image(&picture)
        .expect("a picture");
    file
}

#[test]
fn pictures_that_lie_about_their_size_cost_nothing() {
    let place = place_with_scene();
    let mut file = jpeg([16, 12]);
    let frame = file.windows(2).position(|pair| pair == [0xff, 0xc0]);
    let at = frame.expect("a frame") + 5;
    file[at..at + 4].copy_from_slice(&[0x26, 0x16, 0x32, 0xc8]);
    for view in 0..scene::VIEWS {
        place.write(&format!("scene/images/{}", scene::name(view)), &file);
    }
    let begun = Instant::now();
    refused(&place, &QUICK_FIT, &["13000×9750", "cannot hold"]);
    assert!(begun.elapsed() < Duration::from_secs(5));
}

#[test]
fn a_photo_with_too_few_data_is_refused() {
    let place = place_with_scene();
    let whole = jpeg(scene::SIZE);
    place.write("scene/images/03.png", &whole);
    let fit = [&QUICK_FIT[..], &["-o", "out", "--force"]].concat();
    assert_eq!(run_within_patience(&place, &fit).code, Some(0));
    let cut = [&whole[..whole.len() - 40], &[0xff, 0xd9]].concat();
    place.write("scene/images/03.png", cut);
    refused(&place, &fit, &["03.png", "ends before its last pixels"]);
}

#[test]
fn names_do_not_steer_the_terminal() {
    let place = place_with_scene();
    let done = place.run(&["info", "no\u{1b}[2J\u{202e}such\nfolder"]);
    assert_eq!(done.code, Some(1));
    assert_eq!(done.stderr.lines().count(), 1, "{:?}", done.stderr);
    let expected = "no\\u{1b}[2J\\u{202e}such\\nfolder";
    assert!(done.stderr.contains(expected), "{:?}", done.stderr);
}

/// Without a cache folder from the system, no path depends on the current folder.
#[test]
fn no_library_comes_out_of_the_current_folder() {
    let place = place_with_scene();
    for cache in [None, Some("."), Some("gs")] {
        for folder in ["gs-chroma", "gs/gs-chroma", ".cache/gs-chroma"] {
            place.write(&format!("{folder}/onnxruntime/libonnxruntime.so"), "none");
        }
        let check = ["teacher", "check", &onnx("ddcolor_tiny.onnx")];
        let mut command = place.command(&check);
        command.env_remove("HOME").env_remove("XDG_CACHE_HOME");
        cache.map(|path| command.env("XDG_CACHE_HOME", path));
        let done = Done::of(command.output());
        assert!(!done.stderr.contains("not a usable"), "{}", done.stderr);
    }
}

#[test]
fn photos_that_were_exchanged_are_noticed() {
    let network = onnx("ddcolor_tiny.onnx");
    let colorize = ["colorize", "runs/scene", "--teacher", &network];
    let colorize = [&colorize[..], &["--solver", "adam", "--until", "62"]].concat();
    let place = place_with_run();
    let quiet = run_within_patience(&place, &colorize);
    assert!(!quiet.stderr.contains("warning"), "{}", quiet.stderr);

    // One photo.
    let photo = |view| format!("scene/images/{}", scene::name(view));
    let trained = place.read(&photo(3));
    let others = image::load_from_memory(&place.read(&photo(4))).expect("a photo");
    others
        .to_luma8()
        .save(place.path(&photo(3)))
        .expect("writable");
    let told = run_within_patience(&place, &colorize);
    assert_eq!(told.code, Some(0), "{}", told.stderr);
    let words = "warning: 1 of 10 photos in ";
    assert!(told.stderr.contains(words), "{}", told.stderr);
    assert!(told.stderr.contains("03.png"), "{}", told.stderr);
    let warnings = &place.report("runs/scene")["chroma"]["warnings"];
    assert_eq!(warnings.as_array().map(Vec::len), Some(1));

    // One that has another's name.
    place.write(&photo(3), place.read(&photo(5)));
    place.write(&photo(5), trained);
    let before = place.read("runs/scene/color.ply");
    let done = run_within_patience(&place, &colorize);
    assert_eq!(done.code, Some(1), "{}", done.stderr);
    let error = done.stderr.lines().last().expect("a line");
    assert!(
        error.contains("photo 03.png is what 05.png was") && error.contains("--force"),
        "{error}"
    );
    assert!(place.read("runs/scene/color.ply") == before);
    let forced = run_within_patience(&place, &[&colorize[..], &["--force"]].concat());
    assert_eq!(forced.code, Some(0), "{}", forced.stderr);
}

/// Coloring does without the answers of another time.
#[test]
fn a_cache_that_cannot_be_written_is_told() {
    let place = place_with_run();
    fs::remove_dir_all(place.path("runs/scene/teacher")).expect("a folder");
    place.write("runs/scene/teacher", "a file");
    let network = onnx("ddcolor_tiny.onnx");
    let colorize = ["colorize", "runs/scene", "--teacher", &network];
    let done = place.run(&[&colorize[..], &["--solver", "adam", "--until", "62"]].concat());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let words = "warning: the network's answers are not cached";
    assert!(done.stderr.contains(words), "{}", done.stderr);
}

/// ONNX Runtime has telemetry of its own, which keeps an identifier in the user's cache.
#[cfg(target_os = "linux")]
#[test]
fn no_telemetry_is_queued() {
    let place = place_with_scene();
    let cache = std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from);
    let home = std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".cache"));
    let library = cache.or(home).expect("a home").join("gs-chroma");
    fs::create_dir_all(place.path("home/.cache")).expect("writable");
    std::os::unix::fs::symlink(library, place.path("home/.cache/gs-chroma")).expect("writable");
    let mut command = place.command(&["teacher", "check", &onnx("ddcolor_tiny.onnx")]);
    command.env("HOME", place.path("home"));
    let done = Done::of(command.env_remove("XDG_CACHE_HOME").output());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let mut kept = fs::read_dir(place.path("home/.cache")).expect("a folder");
    let others = kept.find(|entry| entry.as_ref().is_ok_and(|e| e.file_name() != "gs-chroma"));
    assert!(others.is_none(), "{others:?}");
}
