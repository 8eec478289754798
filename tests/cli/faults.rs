//! Writes that fail, each in turn: nothing is half-written, one line says so, and the next
//! command finds everything as it was.

use super::program::{Done, Place, files_below};
use super::shared::{QUICK_FIT, onnx, place_with_run};

/// Successes in a row after which no step is left to fail.
const ENOUGH: usize = 2;

/// Steps that fail.
#[derive(Clone, Copy, PartialEq)]
enum Steps {
    /// Each, alone and with all that follow.
    Each,
    /// The first, then twice as many, with all that follow.
    Some,
}

/// Runs a command with its steps of writing failing in turn. Files in `kept` belong together:
/// all are as they were, or all as a whole command leaves them. Other files are those of `made`,
/// or none.
fn writes_fail_well(steps: Steps, arguments: &[&str], kept: &[&str], made: &[&str]) {
    let whole = place_with_run();
    let before: Vec<_> = kept.iter().map(|name| whole.read(name)).collect();
    let files_before = whole.files("");
    whole.succeed(arguments);
    let after: Vec<_> = kept.iter().map(|name| whole.read(name)).collect();
    let files_after = whole.files("");
    let made: Vec<_> = made.iter().map(|name| (*name, whole.read(name))).collect();
    let lasting: &[&str] = if steps == Steps::Each {
        &["", "-"]
    } else {
        &["-"]
    };
    for lasts in lasting {
        let place = place_with_run();
        let (mut struck, mut in_a_row) = (0, 0);
        let mut step = 1_u64;
        loop {
            let done = failing(&place, arguments, &format!("{step}{lasts}"));
            let told: Vec<&str> = done.stderr.lines().collect();
            let context = format!("{arguments:?}, step {step}{lasts}: {told:?}");
            let errors = told.iter().filter(|line| line.starts_with("error: "));
            match done.code {
                Some(0) => in_a_row += 1,
                Some(1) => {
                    (struck, in_a_row) = (struck + 1, 0);
                    assert_eq!(errors.count(), 1, "{context}");
                    assert!(told.last().is_some_and(|line| line.starts_with("error: ")));
                    assert!(done.stderr.contains("storage"), "{context}");
                }
                _ => panic!("{context}"),
            }
            // Any command that looks at the run finishes what is complete.
            place.succeed(&["info", "runs/scene"]);
            let now: Vec<_> = kept.iter().map(|name| place.read(name)).collect();
            assert!(now == before || now == after, "{context}");
            for (name, bytes) in &made {
                let whole = !place.path(name).exists() || place.read(name) == *bytes;
                assert!(whole, "{context}: {name}");
            }
            for (name, _) in files_below(&place.path("")) {
                let known = files_before.contains(&name) || files_after.contains(&name);
                assert!(known, "{context}: left {name}");
            }
            if in_a_row == ENOUGH {
                break;
            }
            step += match steps {
                Steps::Each => 1,
                Steps::Some => step,
            };
        }
        assert!(struck > 2, "{arguments:?}: {struck}");
        println!("{arguments:?}: {struck} of {step} steps{lasts} failed");
        place.succeed(arguments);
        assert_eq!(place.files(""), files_after, "{arguments:?}");
    }
}

fn failing(place: &Place, arguments: &[&str], fault: &str) -> Done {
    let mut command = place.command(arguments);
    Done::of(command.env("GS_CHROMA_TEST_FAULT", fault).output())
}

fn fit_fails_well(steps: Steps) {
    writes_fail_well(steps, &QUICK_FIT, &["runs/scene/luma.ply"], &[]);
}

fn colorize_fails_well(steps: Steps) {
    let teacher = onnx("ddcolor_tiny.onnx");
    let colorize = ["colorize", "runs/scene", "--teacher", &teacher];
    let short = ["--rounds", "1", "--sh-degree", "0", "--teacher-size", "32"];
    let kept = ["runs/scene/color.ply", "runs/scene/chroma.npy"];
    writes_fail_well(steps, &[&colorize[..], &short].concat(), &kept, &[]);
}

fn render_and_eval_fail_well(steps: Steps) {
    let kept = ["runs/scene/luma.ply", "runs/scene/color.ply"];
    let render = ["render", "runs/scene", "-o", "pictures"];
    let place = place_with_run();
    place.succeed(&render);
    let pictures = place.files("pictures");
    let pictures: Vec<_> = pictures.iter().map(|n| format!("pictures/{n}")).collect();
    let made: Vec<&str> = pictures.iter().map(String::as_str).collect();
    writes_fail_well(steps, &render, &kept, &made);
    let eval = ["eval", "runs/scene", "--frames", "3"];
    writes_fail_well(steps, &eval, &kept, &[]);
}

#[test]
fn some_writes_of_a_run_fail_well() {
    fit_fails_well(Steps::Some);
}

#[test]
#[ignore = "hundreds of trainings: make test-all"]
fn every_write_of_a_run_fails_well() {
    fit_fails_well(Steps::Each);
    colorize_fails_well(Steps::Each);
    render_and_eval_fail_well(Steps::Each);
}

#[test]
fn every_write_of_one_file_fails_well() {
    let kept = ["runs/scene/luma.ply", "runs/scene/color.ply"];
    let export = ["export", "runs/scene", "-o", "far/scene.ply"];
    writes_fail_well(Steps::Each, &export, &kept, &["far/scene.ply"]);
    let network = onnx("ddcolor_tiny.onnx");
    let check = ["teacher", "check", &network, "--manifest", "network.toml"];
    writes_fail_well(Steps::Each, &check, &kept, &["network.toml"]);
}

/// A sweep goes on where its own files could not be written.
#[test]
fn a_sweep_fails_well() {
    let place = place_with_run();
    let sweep = ["tradeoff", "scene", "-o", "out", "--preset", "draft"];
    let knobs = ["--knobs", "iterations", "--budget", "0.2", "--"];
    let short = ["--iterations", "3", "--without", "background"];
    let sweep = [&sweep[..], &knobs, &short].concat();
    let mut struck = 0;
    for step in [1, 3, 8] {
        let done = failing(&place, &sweep, &step.to_string());
        if done.code == Some(1) {
            struck += 1;
            let last = done.stderr.lines().last().unwrap_or_default();
            assert!(last.starts_with("error: "), "{step}: {}", done.stderr);
        }
        if place.path("out/tradeoff.json").exists() {
            let kept =
                serde_json::from_slice::<serde_json::Value>(&place.read("out/tradeoff.json"));
            assert!(kept.is_ok(), "{step}");
        }
    }
    assert!(struck > 1, "{struck}");
    place.succeed(&sweep);
}
