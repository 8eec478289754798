//! `fit --resume`: what is interrupted goes on, and ends with the same bytes.

use std::{
    io::{BufRead, BufReader, Read},
    process::{Child, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use gs_chroma::splats::{read_ply, write_ply};

use super::program::Place;
#[cfg(unix)]
use super::program::{Signal, send};
use super::scene;
use super::shared::{place_with_run, place_with_scene};

/// A training of a few seconds, from the few points of a scene.
const FIT: [&str; 11] = of_length("300");

const fn of_length(iterations: &str) -> [&str; 11] {
    [
        "fit",
        "scene",
        "--preset",
        "draft",
        "--iterations",
        iterations,
        "--without",
        "background",
        "--no-fill-gaps",
        "-o",
        "run",
    ]
}

/// Checkpoints as often as they are cheap.
const OFTEN: [&str; 2] = ["--checkpoint", "0.0001"];

fn fit(more: &[&'static str]) -> Vec<&'static str> {
    [&FIT[..], &OFTEN, more].concat()
}

/// Waits for a checkpoint of a program that has not ended.
fn wait_for_checkpoint(place: &Place, child: &mut Child, name: &str) {
    let begun = Instant::now();
    while !place.path(name).exists() {
        assert!(child.try_wait().expect("a child").is_none(), "it has ended");
        assert!(begun.elapsed() < Duration::from_secs(120), "no checkpoint");
        sleep(Duration::from_millis(1));
    }
}

/// Kills a command once it has a checkpoint.
fn killed(place: &Place, command: &[&str], checkpoint: &str) {
    let mut command = place.command(&[command, &OFTEN].concat());
    let quiet = command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = quiet.spawn().expect("the program starts");
    wait_for_checkpoint(place, &mut child, checkpoint);
    child.kill().expect("it is there");
    child.wait().expect("a child");
}

/// The log but for its times.
fn log(place: &Place) -> Vec<String> {
    let text = String::from_utf8(place.read("run/log.csv")).expect("text");
    let kept = |line: &str| {
        let mut cells: Vec<&str> = line.split(',').collect();
        cells.remove(3);
        cells.join(",")
    };
    text.lines().map(kept).collect()
}

#[test]
fn a_training_that_is_killed_goes_on() {
    killed_twice(&FIT);
}

/// The statistics of 3DGS's rules are kept as well.
#[test]
fn a_training_as_the_paper_does_it_goes_on() {
    let fit = ["fit", "scene", "--as-paper", "--iterations", "300"];
    killed_twice(&[&fit[..], &["--no-fill-gaps", "-o", "run"]].concat());
}

fn killed_twice(fit: &[&str]) {
    let whole = place_with_scene();
    whole.succeed(&[fit, &OFTEN].concat());
    assert_eq!(
        whole.files("run"),
        ["contact-sheet.png", "log.csv", "luma.ply", "report.json"]
    );
    let place = place_with_scene();
    // Killed again on its way from the first checkpoint.
    for more in [&[][..], &["--resume"]] {
        killed(&place, &[fit, more].concat(), "run/checkpoint");
    }
    place.succeed(&[fit, &["--resume"]].concat());
    assert!(place.read("run/luma.ply") == whole.read("run/luma.ply"));
    assert_eq!(log(&place), log(&whole));
    assert!(!place.path("run/checkpoint").exists());
}

#[cfg(unix)]
#[test]
fn a_signal_is_heeded_and_says_how_to_go_on() {
    let place = place_with_scene();
    for (signal, more) in [
        (Signal::SIGINT, &[][..]),
        (Signal::SIGTERM, &["--resume"][..]),
    ] {
        // None but when it is interrupted.
        let off = ["--checkpoint", "off"];
        let mut command = place.command(&[&of_length("20000")[..], &off, more].concat());
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = child.spawn().expect("the program starts");
        let mut stderr = BufReader::new(child.stderr.take().expect("a pipe"));
        let mut told = String::new();
        // The last of the plan's effects: it trains next.
        while !told.contains("luma-degree ") {
            assert!(stderr.read_line(&mut told).expect("text") > 0, "{told}");
        }
        sleep(Duration::from_millis(300));
        send(signal, child.id());
        stderr.read_to_string(&mut told).expect("text");
        assert_eq!(child.wait().expect("a child").code(), Some(1), "{told}");
        assert!(told.contains("writing a checkpoint"), "{told}");
        let last = told.lines().last().unwrap_or_default();
        assert!(
            last.starts_with("error: interrupted after iteration")
                && last.ends_with("with the same command and --resume"),
            "{last}"
        );
    }
}

#[test]
fn what_cannot_go_on_is_refused_with_what_differs() {
    let place = place_with_scene();
    let refused = |more: &[&'static str], parts: &[&str]| {
        let done = place.run(&fit(more));
        assert_eq!(done.code, Some(1), "{}", done.stderr);
        let errors = done
            .stderr
            .lines()
            .filter(|line| line.starts_with("error:"));
        assert_eq!(errors.count(), 1, "{}", done.stderr);
        for part in parts {
            assert!(done.stderr.contains(part), "{part}: {}", done.stderr);
        }
    };
    killed(&place, &FIT, "run/checkpoint");
    let kept = place.read("run/checkpoint");
    refused(
        &["--resume", "--seed", "7"],
        &["run/checkpoint", "settings.seed (0, now 7)"],
    );
    refused(&["--resume", "--max-side", "48"], &["load.max_side"]);
    refused(&["--resume", "--without", "robust"], &["effects"]);
    // Nothing of it was harmed.
    assert!(place.read("run/checkpoint") == kept);
    let photo = place.read("scene/images/03.png");
    let mut other = super::scene::photo(3);
    other.get_pixel_mut(5, 5).0 = [255, 255, 255];
    other
        .save(place.path("scene/images/03.png"))
        .expect("a photo");
    refused(&["--resume"], &["another training: photos"]);
    place.write("scene/images/03.png", photo);
    let mut damaged = kept.clone();
    damaged[kept.len() / 2] ^= 1;
    place.write("run/checkpoint", damaged);
    refused(&["--resume"], &["run/checkpoint", "is damaged"]);
    place.write("run/checkpoint", &kept);
    // Without the option it is given up, which is told.
    let done = place.run(&fit(&[]));
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let told = |line: &str| line.starts_with("warning: run/checkpoint") && line.contains("resumed");
    assert!(done.stderr.lines().any(told), "{}", done.stderr);
    assert!(!place.path("run/checkpoint").exists());
    refused(
        &["--resume"],
        &["run: nothing to continue", "without --resume"],
    );
}

#[test]
fn what_was_never_begun_begins() {
    let place = place_with_scene();
    let done = place.run(&[&of_length("3")[..], &["--resume"]].concat());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(
        done.stderr.contains("training starts over"),
        "{}",
        done.stderr
    );
    let wrong = place.run(&[&FIT[..], &["--checkpoint", "0"]].concat());
    assert_eq!(wrong.code, Some(2));
}

#[test]
fn a_finished_run_goes_on() {
    let place = Place::new();
    // Coordinates are large, and the run has moved them.
    scene::write_moved(&place.path("scene"), [4e5, -5e6, 100.0]);
    place.succeed(&of_length("100"));
    let psnr = |run: &str| {
        let report = place.report(run);
        report["luma"]["held_out"]["psnr"].as_f64().expect("a PSNR")
    };
    let before = psnr("run");
    let more = ["fit", "run", "--iterations", "50"];
    place.succeed(&[&more[..], &["-o", "more"]].concat());
    place.succeed(&more);
    let report = place.report("run");
    assert_eq!(report["luma"]["iterations"], 150);
    assert_eq!(report["luma"]["settings"]["iterations"], 50);
    let rows = log(&place);
    assert!(rows.iter().any(|row| row.starts_with("150,")), "{rows:?}");
    assert!(rows.iter().any(|row| row.starts_with("100,")), "{rows:?}");
    // It goes on from where it was, and repeats.
    assert!(psnr("run") > before - 0.5, "{} {before}", psnr("run"));
    assert!(place.read("run/luma.ply") == place.read("more/luma.ply"));
    let place = place_with_run();
    for other in [["--preset", "draft"], ["--max-side", "32"]] {
        let done = place.run(&[&["fit", "runs/scene"][..], &other].concat());
        assert_eq!(done.code, Some(2), "{other:?}: {}", done.stderr);
    }
}

/// A coloring with all that a checkpoint has to hold: a degree that is chosen, corrections, a
/// loss that levels off, anchors.
const COLORIZE: [&str; 8] = [
    "colorize",
    "runs/scene",
    "--teacher",
    "colored",
    "--sh-degree",
    "auto",
    "--correct-views",
    "on",
];

/// The run with a folder of images as teacher, whose views contradict each other.
fn place_to_color() -> Place {
    let place = place_with_run();
    for view in 0..scene::VIEWS {
        let mut image = scene::photo(view);
        let cast = 3 * view as u8;
        for pixel in image.pixels_mut() {
            pixel.0[0] = pixel.0[0].saturating_add(cast);
            pixel.0[2] = pixel.0[2].saturating_sub(cast);
        }
        let path = place.path("colored").join(scene::name(view));
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
        image.save(path).expect("writable");
    }
    place
}

fn colors(place: &Place) -> [Vec<u8>; 2] {
    ["color.ply", "chroma.npy"].map(|name| place.read(&format!("runs/scene/{name}")))
}

#[test]
fn a_coloring_that_is_killed_goes_on() {
    killed_and_resumed(&COLORIZE);
}

/// Adam's moments are kept as well; it is killed with hundreds of iterations to go.
#[test]
fn a_descent_that_is_killed_goes_on() {
    let colorize = ["colorize", "runs/scene", "--teacher", "colored"];
    let adam = ["--as-paper", "--until", "660", "--sh-degree", "1"];
    killed_and_resumed(&[&colorize[..], &adam].concat());
}

fn killed_and_resumed(colorize: &[&str]) {
    let whole = place_to_color();
    whole.succeed(colorize);
    let chroma = whole.report("runs/scene")["chroma"].clone();
    let whole = colors(&whole);
    let place = place_to_color();
    killed(&place, colorize, "runs/scene/checkpoint-color");
    let resumed = place.run(&[colorize, &["--resume"]].concat());
    assert_eq!(resumed.code, Some(0), "{}", resumed.stderr);
    assert!(
        !resumed.stderr.contains("starts over"),
        "{}",
        resumed.stderr
    );
    assert!(colors(&place) == whole);
    let now = place.report("runs/scene")["chroma"].clone();
    for key in [
        "loss",
        "iterations",
        "moved",
        "passes",
        "effects",
        "saturation",
    ] {
        assert_eq!(now[key], chroma[key], "{key}");
    }
    // Seconds go on, too.
    let [until, steps] = ["until", "iterations"].map(|key| now[key].as_f64().expect("a number"));
    let log = String::from_utf8(place.read("runs/scene/log.csv")).expect("text");
    let rows = log
        .lines()
        .map(|row| row.split(',').map(|cell| cell.parse().unwrap_or(0.0)));
    let rows = rows
        .map(Iterator::collect)
        .filter(|row: &Vec<f64>| row[0] > until - steps);
    let seconds: Vec<f64> = rows.map(|row| row[3]).collect();
    assert!(seconds.len() > 1 && seconds.is_sorted(), "{seconds:?}");
    assert!(!place.path("runs/scene/checkpoint-color").exists());
}

/// A run that has Gaussians far above all photos, so many that a MiB holds those only that photos
/// may show. They come for each photo; the colors are as with all of them there, and the same
/// bytes where it is killed.
#[test]
fn a_coloring_of_gaussians_that_wait_on_the_host() {
    let many = || {
        let place = place_to_color();
        let path = place.path("runs/scene/luma.ply");
        let mut scene = read_ply(&path).expect("a scene").splats;
        let mut above = scene.chosen(&vec![0; 9000]);
        for (k, mean) in above.means.iter_mut().enumerate() {
            *mean = [0.1 * k as f32, 1000.0, 0.0];
        }
        let shown = scene.len();
        scene.append(above);
        write_ply(&path, &scene, glam::DVec3::ZERO, &[]).expect("writable");
        place.forget_files("runs/scene");
        let [width, height] = scene::SIZE;
        let stroke = image::RgbaImage::from_fn(width, height, |x, y| {
            let inside = x.abs_diff(width / 2) < 6 && y.abs_diff(height / 2) < 3;
            image::Rgba([200, 60, 60, if inside { 255 } else { 0 }])
        });
        std::fs::create_dir(place.path("strokes")).expect("writable");
        let path = place.path("strokes").join(scene::name(2));
        stroke.save(path.with_extension("png")).expect("writable");
        (place, shown)
    };
    let colorize = [
        "colorize",
        "runs/scene",
        "--teacher",
        "colored",
        "--hints",
        "strokes",
        "--rounds",
        "4",
    ];
    let within = [&colorize[..], &["--memory-limit", "1"]].concat();
    let (place, shown) = many();
    let told = place.run(&within);
    assert_eq!(told.code, Some(0), "{}", told.stderr);
    let chroma = place.report("runs/scene")["chroma"].clone();
    let at_a_time = chroma["splats_at_a_time"].as_u64().unwrap_or_default();
    assert!(
        (1..=shown as u64).contains(&at_a_time),
        "{at_a_time} of {shown}"
    );
    let line = format!("at most {at_a_time} that a photo may show come at a time");
    assert!(told.stderr.contains(&line), "{}", told.stderr);
    for bytes in ["estimated_device_memory", "peak_device_memory"] {
        assert!(
            chroma[bytes].as_u64().is_some_and(|bytes| bytes < 1 << 20),
            "{bytes}: {}",
            chroma[bytes]
        );
    }
    let streamed = colors(&place);
    // Adam needs all of them there.
    let adam = ["--solver", "adam", "--until", "62", "--memory-limit", "1"];
    let refused = place.run(&[&colorize[..6], &adam].concat());
    assert_eq!(refused.code, Some(1), "{}", refused.stderr);
    let errors = refused
        .stderr
        .lines()
        .filter(|line| line.starts_with("error:"));
    assert_eq!(errors.count(), 1, "{}", refused.stderr);
    assert!(colors(&place) == streamed);

    let (whole, _) = many();
    whole.succeed(&colorize);
    let all = whole.report("runs/scene")["chroma"].clone();
    assert_eq!(all["splats_at_a_time"], serde_json::Value::Null);
    assert!(all["estimated_device_memory"].as_u64() > Some(1 << 20));
    // A stroke claims the same, by depths of what came for its photo.
    assert!(all["claimed"].as_f64() > Some(0.0), "{all}");
    assert_eq!(all["claimed"], chroma["claimed"]);
    for error in ["mean", "percentile_95"] {
        let of = |chroma: &serde_json::Value| chroma["pictures"]["delta_e"][error].as_f64();
        let apart = of(&all)
            .zip(of(&chroma))
            .map(|(all, some)| (all - some).abs());
        assert!(
            apart.is_some_and(|apart| apart < 0.01),
            "{error}: {apart:?}"
        );
    }

    let (place, _) = many();
    killed(&place, &within, "runs/scene/checkpoint-color");
    place.succeed(&[&within[..], &["--resume"]].concat());
    assert!(colors(&place) == streamed);
}

#[test]
fn a_coloring_by_others_is_not_gone_on_with() {
    let place = place_to_color();
    killed(&place, &COLORIZE, "runs/scene/checkpoint-color");
    std::fs::copy(place.path("colored/00.png"), place.path("colored/03.png")).expect("copied");
    let done = place.run(&[&COLORIZE[..], &["--resume"]].concat());
    assert_eq!(done.code, Some(1), "{}", done.stderr);
    assert!(done.stderr.contains("taught"), "{}", done.stderr);
    // Adam does not go by what the other solver has kept.
    let adam = ["colorize", "runs/scene", "--teacher", "colored", "--resume"];
    let done = place.run(&[&adam[..], &["--solver", "adam", "--until", "62"]].concat());
    assert_eq!(done.code, Some(1), "{}", done.stderr);
    let solver = "settings.solver (\"irls\", now \"adam\")";
    assert!(done.stderr.contains(solver), "{}", done.stderr);
    // Begun anew it says that it gives up what there is.
    let done = place.run(&[&COLORIZE[..4], &["--rounds", "1", "--sh-degree", "0"]].concat());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(
        done.stderr.contains("checkpoint-color is left of"),
        "{}",
        done.stderr
    );
    assert!(!place.path("runs/scene/checkpoint-color").exists());
}

/// Training time before a kill counts toward the time limit.
#[test]
#[ignore = "takes the 12 seconds of its limit: make test-all"]
fn a_time_limit_goes_on_where_it_was() {
    let place = place_with_scene();
    let fit = ["fit", "scene", "--time-limit", "0.2", "-o", "run"];
    let fit = [&fit[..], &["--without", "background"], &OFTEN].concat();
    let mut command = place.command(&fit);
    let quiet = command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = quiet.spawn().expect("the program starts");
    wait_for_checkpoint(&place, &mut child, "run/checkpoint");
    sleep(Duration::from_secs(2));
    child.kill().expect("it is there");
    child.wait().expect("a child");
    let begun = Instant::now();
    place.succeed(&[&fit[..], &["--resume"]].concat());
    let report = place.report("run");
    let all = report["luma"]["seconds"]["all"].as_f64().expect("seconds");
    assert!((6.0..14.0).contains(&all), "{all} of 12 s");
    // The seconds before are in it.
    let now = begun.elapsed().as_secs_f64();
    assert!(all > now + 1.0, "{all} s in all, {now} s now");
}
