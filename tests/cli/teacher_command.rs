//! A program of the user's as a teacher.

use std::fs;

use crate::{
    program::{Done, Place},
    scene,
};

/// A shell script that copies a colored picture of the scene for the gray one it is given, and
/// notes each start.
const COPY: &str = "set -e\necho start >> starts.txt\ntest -s \"$1\"\ncp colored.png \"$2\"\n";

/// A run named with a space, and a picture in color.
fn trained() -> Place {
    let place = Place::new();
    scene::write(&place.path("a scene"));
    scene::photo(0)
        .save(place.path("colored.png"))
        .expect("writable");
    place.write("copy it.sh", COPY);
    let fit = "fit|a scene|-o|a run|--preset|draft|--iterations|3|--max-splats|100";
    place.succeed(&fit.split('|').collect::<Vec<_>>());
    place
}

fn color(place: &Place, command: &str) -> Done {
    place.run(&[
        "colorize",
        "a run",
        "--rounds",
        "1",
        "--teacher-command",
        command,
    ])
}

fn starts(place: &Place) -> usize {
    let notes = fs::read_to_string(place.path("starts.txt")).unwrap_or_default();
    notes.lines().count()
}

#[test]
fn a_program_colors_photos_once() {
    let place = trained();
    let command = "sh 'copy it.sh' {in} {out}";
    let done = color(&place, command);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert_eq!(starts(&place), scene::VIEWS);
    let chroma = &place.report("a run")["chroma"];
    assert_eq!(chroma["teachers"][0]["kind"], "folder", "{chroma}");
    let path = chroma["teachers"][0]["path"].as_str().expect("a path");
    let kept = format!(
        "a run/{}",
        &path[path.find("teacher/").expect("in the run")..]
    );
    assert_eq!(place.files(&kept).len(), scene::VIEWS);

    // What it has colored is used again, until the program is another.
    fs::remove_file(place.path(&format!("{kept}/03.png.png"))).expect("a picture");
    assert_eq!(color(&place, command).code, Some(0));
    assert_eq!(starts(&place), scene::VIEWS + 1);
    place.write("copy it.sh", format!("{COPY}# another\n"));
    assert_eq!(color(&place, command).code, Some(0));
    assert_eq!(starts(&place), 2 * scene::VIEWS + 1);

    // One start for all.
    let all = "set -e\necho start >> starts.txt\ncd \"$1\"\nfind . -name '*.png' | while read -r name; do\n\
        mkdir -p \"$2/$(dirname \"$name\")\"; cp \"$3\" \"$2/$name\"; done\n";
    place.write("all.sh", all);
    let before = starts(&place);
    let picture = place.path("colored.png");
    let done = color(
        &place,
        &format!("sh all.sh {{in_dir}} {{out_dir}} '{}'", picture.display()),
    );
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert_eq!(starts(&place), before + 1);
}

#[test]
fn programs_that_fail_are_told_of() {
    let place = trained();
    for (script, wanted) in [
        (
            "echo no weights >&2; exit 3",
            "sh failed: no weights (exit status: 3)",
        ),
        ("exit 0", "sh: 00.png.png: no picture at {out}"),
        ("echo text > \"$2\"", "sh: 00.png.png:"),
        (
            "cp square.png \"$2\"",
            "8×8 pixels, of another aspect than 64×48",
        ),
    ] {
        image::RgbImage::new(8, 8)
            .save(place.path("square.png"))
            .expect("writable");
        place.write("copy it.sh", script);
        let done = color(&place, "sh 'copy it.sh' {in} {out}");
        assert_eq!(
            (
                done.code,
                done.stderr
                    .lines()
                    .last()
                    .is_some_and(|line| line.contains(wanted))
            ),
            (Some(1), true),
            "{}",
            done.stderr
        );
    }
    let done = color(&place, "no-such-program {in} {out}");
    assert!(
        done.stderr.contains("no-such-program is not installed"),
        "{}",
        done.stderr
    );
    assert!(!place.path("a run/color.ply").exists());
    let left: Vec<String> = place.files("a run/teacher");
    assert_eq!(left, [""; 0]);
    // Paths are words, whatever they hold, and a shell is not there.
    for wrong in [
        "python mine.py",
        "python mine.py {in} {out_dir}",
        "{in} {out}",
        "python 'mine.py {in} {out}",
    ] {
        let done = color(&place, wrong);
        assert_eq!(done.code, Some(2), "{wrong}: {}", done.stderr);
    }
    place.write("copy it.sh", COPY);
    let done = color(&place, "sh 'copy it.sh' {in} {out} ; touch harm.txt");
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(!place.path("harm.txt").exists());
}
