//! A run's folder is always whole, and one process at a time writes into it.

use std::{
    process::Stdio,
    thread::sleep,
    time::{Duration, Instant},
};

#[cfg(unix)]
use super::program::{Signal, send};
use super::shared::{place_with_run, place_with_scene};

#[test]
fn two_processes_do_not_write_into_one_run() {
    let place = place_with_scene();
    let fit = ["fit", "scene", "--preset", "draft", "-o", "run"];
    let mut command = place.command(&[&fit[..], &["--checkpoint", "0.0001"]].concat());
    let quiet = command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut first = quiet.spawn().expect("the program starts");
    let begun = Instant::now();
    while !place.path("run/checkpoint").exists() {
        assert!(begun.elapsed() < Duration::from_secs(120), "no checkpoint");
        sleep(Duration::from_millis(10));
    }
    let done = place.run(&fit);
    let (code, ended) = (done.code, first.try_wait().expect("a child"));
    first.kill().expect("it is there or gone");
    first.wait().expect("a child");
    assert_eq!((code, ended), (Some(1), None), "{}", done.stderr);
    let told = done.stderr.trim_end();
    let holder = format!("process {}", first.id());
    assert!(
        told.starts_with("error: run: ") && told.contains(&holder) && told.lines().count() == 1,
        "{told}"
    );
    // Whoever is dead holds nothing.
    place.succeed(&[&fit[..], &["--iterations", "3"]].concat());
}

/// Leftovers of a process that died while it wrote: unfinished files, and a complete set of files
/// that was not yet in its place.
#[test]
fn what_a_dead_process_left_is_finished_or_removed() {
    let place = place_with_run();
    let before = place.files("runs/scene");
    let report = place.read("runs/scene/report.json");
    place.write("runs/scene/.tmpX1x2X3", "half");
    place.write("runs/scene/.next-X1x2X3/luma.ply", "half");
    place.write("runs/scene/.commit/log.csv", "iteration,loss\n");
    place.write("runs/scene/.commit/.removed", "contact-sheet.png\n");
    // Any command that looks at the run.
    place.succeed(&["info", "runs/scene"]);
    let after = place.files("runs/scene");
    assert!(before.contains(&"contact-sheet.png".to_owned()));
    assert!(
        !after.contains(&"contact-sheet.png".to_owned()),
        "{after:?}"
    );
    assert_eq!(after.len() + 1, before.len(), "{after:?}");
    assert_eq!(place.read("runs/scene/log.csv"), b"iteration,loss\n");
    assert_eq!(place.read("runs/scene/report.json"), report);
}

#[cfg(unix)]
#[test]
fn a_program_that_is_told_to_end_leaves_nothing_behind() {
    let place = place_with_run();
    let before = place.files("runs/scene");
    for (signal, ended) in [(Signal::SIGINT, 130), (Signal::SIGTERM, 143)] {
        let mut command = place.command(&["eval", "runs/scene"]);
        let quiet = command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = quiet.spawn().expect("the program starts");
        let begun = Instant::now();
        while place.files("runs/scene").len() <= before.len() {
            assert!(
                begun.elapsed() < Duration::from_secs(60),
                "nothing is begun"
            );
            sleep(Duration::from_millis(2));
        }
        send(signal, child.id());
        assert_eq!(child.wait().expect("a child").code(), Some(ended));
        assert_eq!(place.files("runs/scene"), before);
    }
    place.succeed(&["eval", "runs/scene"]);
}
