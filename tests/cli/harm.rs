//! Folders of somebody else, originals, and a scene under other photos or poses: nothing is
//! removed, written over or mixed up.

use std::fs;

use image::RgbImage;

use super::program::{Done, Place, files_below};
use super::scene;
use super::shared::{onnx, place_with_run};

/// Commands that open a run.
const OPENING: [&[&str]; 7] = [
    &["info", "runs/scene"],
    &["export", "runs/scene", "-o", "out.ply"],
    &["render", "runs/scene", "-o", "out"],
    &["frames", "runs/scene", "-o", "out"],
    &["eval", "runs/scene", "--frames", "2"],
    &["fit", "runs/scene", "--iterations", "1"],
    &["colorize", "runs/scene", "--teacher", "photos"],
];

fn refused(place: &Place, arguments: &[&str], words: &[&str]) -> Done {
    let done = place.run(arguments);
    assert_eq!(done.code, Some(1), "{arguments:?}: {}", done.stderr);
    let errors = done
        .stderr
        .lines()
        .filter(|line| line.starts_with("error: "));
    let error = errors.collect::<Vec<_>>().join("\n");
    for word in words {
        assert!(error.contains(word), "{arguments:?}: {error}");
    }
    done
}

/// Nothing in this folder but what is new was changed by what `act` does.
fn unharmed(place: &Place, act: impl FnOnce(&Place)) {
    let before = files_below(&place.path(""));
    act(place);
    for (name, bytes) in before {
        assert_eq!(place.read(&name), bytes, "{name}");
    }
}

#[test]
fn a_run_of_somebody_else_removes_nothing() {
    let above = |name: &str, place: &Place| match name {
        "absolute" => place.path("victim").to_string_lossy().into_owned(),
        name => name.to_owned(),
    };
    for (arguments, name) in OPENING.into_iter().zip([
        "../../victim",
        "absolute",
        "",
        "..",
        "notes.txt",
        "eval/../../../victim",
        ".",
    ]) {
        let place = place_with_run();
        place.write("victim/sub/file", "precious");
        let name = above(name, &place);
        place.write("runs/scene/.commit/.removed", format!("{name}\n"));
        place.write("runs/scene/notes.txt", "precious");
        unharmed(&place, |place| {
            refused(
                place,
                arguments,
                &["runs/scene/.commit", "no file of a run"],
            );
        });
    }
}

#[cfg(unix)]
#[test]
fn links_in_a_run_are_neither_locked_nor_followed() {
    use std::os::unix::fs::symlink;
    for (arguments, name) in OPENING
        .into_iter()
        .skip(4)
        .zip([".lock", ".commit", ".lock"])
    {
        let place = place_with_run();
        place.write("victim/.removed", "");
        place.write("victim/precious.txt", "precious");
        let _ = fs::remove_file(place.path("runs/scene/.lock"));
        let to = match name {
            ".commit" => "../../victim",
            _ => "../../victim/precious.txt",
        };
        symlink(to, place.path("runs/scene").join(name)).expect("a link");
        unharmed(&place, |place| {
            refused(place, arguments, &[name]);
        });
    }
    // Neither is a file with a second name emptied, nor answers written elsewhere.
    let place = place_with_run();
    place.write("precious.txt", "precious");
    let _ = fs::remove_file(place.path("runs/scene/.lock"));
    fs::hard_link(place.path("precious.txt"), place.path("runs/scene/.lock")).expect("a link");
    unharmed(&place, |place| {
        refused(place, OPENING[6], &[".lock", "second name"]);
    });
    for (name, words) in [("teacher", "leads out"), ("luma.ply", "leads out")] {
        let place = place_with_run();
        let path = place.path("runs/scene").join(name);
        fs::rename(&path, place.path("elsewhere")).expect("moved");
        symlink("../../elsewhere", &path).expect("a link");
        refused(&place, OPENING[3], &[name, words]);
    }
}

#[test]
fn originals_are_not_written_over() {
    let place = place_with_run();
    fs::copy(place.path("runs/scene/color.ply"), place.path("own.ply")).expect("copied");
    place.write("painted/00.png", place.read("scene/images/00.png"));
    fs::hard_link(place.path("scene/images/00.png"), place.path("photo.mp4")).expect("linked");
    let network = onnx("ddcolor_tiny.onnx");
    unharmed(&place, |place| {
        for arguments in [
            &[
                "render",
                "runs/scene",
                "--views",
                "all",
                "-o",
                "scene/images",
            ][..],
            &["frames", "runs/scene", "-o", "scene/images"],
            &["frames", "runs/scene", "-o", "scene"],
            &["render", "runs/scene", "-o", "painted"],
            &["fit", "scene", "-o", "painted"],
            &["tradeoff", "scene", "-o", "painted"],
        ] {
            refused(
                place,
                arguments,
                &["holds files that this command did not write"],
            );
        }
        for arguments in [
            &["frames", "runs/scene", "-o", "photo.mp4"][..],
            &["export", "runs/scene", "-o", "runs/scene/luma.ply"],
            &["export", "own.ply", "-o", "own.ply"],
            &[
                "render",
                "runs/scene",
                "--path",
                "photos",
                "--save-path",
                "runs/scene/report.json",
            ],
            &[
                "colorize",
                "runs/scene",
                "--teacher",
                &network,
                "-o",
                "runs/scene/luma.ply",
            ],
        ] {
            refused(place, arguments, &["never written over"]);
        }
    });
}

#[test]
fn own_pictures_are_replaced_and_others_are_not() {
    let place = place_with_run();
    let render = ["render", "runs/scene", "-o", "pictures"];
    place.succeed(&render);
    place.succeed(&render);
    RgbImage::new(4, 4)
        .save(place.path("pictures/mine.png"))
        .expect("written");
    refused(&place, &render, &["pictures", "mine.png"]);
}

#[test]
fn another_model_is_refused() {
    let place = place_with_run();
    fs::remove_dir_all(place.path("scene/sparse")).expect("a model");
    scene::write_moved_model(&place.path("scene"), [0.5, 0.0, 0.0]);
    unharmed(&place, |place| {
        for arguments in &OPENING[2..] {
            refused(
                place,
                arguments,
                &["10 of 10 photos have another pose", "`fit`"],
            );
        }
    });
    let info = place.run(OPENING[0]);
    assert_eq!(info.code, Some(0));
    let exported = place.run(OPENING[1]);
    assert_eq!(exported.code, Some(0), "{}", exported.stderr);
}

#[test]
fn photos_that_changed_names_are_refused() {
    let place = place_with_run();
    let [first, second] = ["scene/images/01.png", "scene/images/02.png"];
    let (one, two) = (place.read(first), place.read(second));
    place.write(first, two);
    place.write(second, one);
    for arguments in &OPENING[3..] {
        if arguments[0] != "fit" {
            refused(&place, arguments, &["photo 01.png is what 02.png was"]);
        }
    }
}

#[test]
fn files_of_another_run_are_refused() {
    for name in ["luma.ply", "color.ply", "chroma.npy"] {
        let place = place_with_run();
        let mut bytes = place.read(&format!("runs/scene/{name}"));
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        place.write(&format!("runs/scene/{name}"), bytes);
        for arguments in OPENING.into_iter().skip(1) {
            refused(
                &place,
                arguments,
                &[name, "not the file that this run wrote"],
            );
        }
        let info = place.run(OPENING[0]);
        assert!(
            info.stderr.contains("warning: ") && info.code == Some(0),
            "{info:?}"
        );
    }
}

#[test]
fn the_folder_of_results_stands_for_its_run() {
    let place = place_with_run();
    fs::create_dir(place.path("out")).expect("writable");
    fs::rename(place.path("runs/scene"), place.path("out/run")).expect("moved");
    place.succeed(&["export", "out", "-o", "out.ply"]);
    let named = place.run(&["info", "out"]);
    assert!(named.stdout.contains("color"), "{named:?}");
}
