//! Output folders: those of others, and what lies outside of them.

use super::*;

/// A folder that came from elsewhere may name anything.
#[test]
fn what_is_named_outside_of_the_folder_is_left_alone() {
    let place = place_with(&["colmap"]);
    succeed(&place, &PHOTOS);
    place.write("victim/letter.txt", "dear");
    let kept = String::from_utf8(place.read("house/prepare.json")).expect("text");
    for name in ["../victim", "/etc", "images/..", "letter.txt"] {
        let named = kept.replace("\"sparse\"", &format!("{name:?}"));
        place.write("house/prepare.json", named);
        refused(&place, &with(&["--force"]), &["prepare.json", name]);
    }
    assert!(place.path("victim/letter.txt").is_file());
    // A link in a result's place is somebody else's.
    place.write("house/prepare.json", kept);
    fs::rename(place.path("house/sparse"), place.path("elsewhere")).expect("writable");
    std::os::unix::fs::symlink(place.path("elsewhere"), place.path("house/sparse"))
        .expect("writable");
    refused(
        &place,
        &with(&["--force"]),
        &["house/sparse", "was changed"],
    );
    assert!(place.path("elsewhere/0/images.txt").is_file());
}

#[test]
fn what_failed_does_not_keep_another_input_away() {
    let place = place_with(&["colmap"]);
    place.write("fake/fail-mapper", "");
    place.write("wrong/notes.txt", "notes");
    for view in 0..2 {
        let path = place.path(&format!("wrong/{view}.png"));
        scene::photo(view).save(path).expect("writable");
    }
    refused(
        &place,
        &["prepare", "wrong", "-o", "house"],
        &["colmap failed"],
    );
    fs::remove_file(place.path("fake/fail-mapper")).expect("a file");
    let done = succeed(&place, &PHOTOS);
    assert!(done.stdout.starts_with("10 of 10"), "{done:?}");
    refused(
        &place,
        &["prepare", "wrong", "-o", "house"],
        &["was prepared from"],
    );
    let auto = ["auto", "wrong", "-o", "out", "--teacher", "photos"];
    place.write("out/house/prepare.json", place.read("house/prepare.json"));
    let done = run(&place, &auto);
    assert!(
        done.stderr.contains("remove this one") && !done.stderr.contains("--force"),
        "{done:?}"
    );
}

#[test]
fn names_are_no_options_and_no_patterns() {
    let place = place_with(&["colmap"]);
    fs::rename(place.path("photos"), place.path("-my photos %d")).expect("writable");
    let out = "-o=it's %04d";
    let done = succeed(
        &place,
        &["prepare", &format!("--output={out}"), "--", "-my photos %d"],
    );
    let next = "next: gs-chroma fit './-o=it'\\''s %04d'\n";
    assert!(done.stdout.ends_with(next), "{done:?}");
    assert!(place.path(out).join("sparse/0/images.txt").is_file());
    for call in calls(&place) {
        assert!(!call.contains(" -my") && !call.contains(" -o"), "{call}");
    }
}

#[test]
fn folders_of_others_are_left_alone() {
    let place = place_with(&["colmap"]);
    let before = files_below(&place.path(""));
    place.write("mine/letter.txt", "dear");
    refused(
        &place,
        &["prepare", "photos", "-o", "mine"],
        &["mine", "letter.txt", "-o"],
    );
    refused(
        &place,
        &["prepare", "photos", "-o", "mine", "--force"],
        &["letter.txt"],
    );
    refused(
        &place,
        &["prepare", "photos", "-o", "photos/house"],
        &["mixed", "-o"],
    );
    refused(&place, &["prepare", "nowhere", "-o", "house"], &["nowhere"]);
    refused(
        &place,
        &["prepare", "/dev/zero", "-o", "house"],
        &["/dev/zero", "device"],
    );
    fs::create_dir_all(place.path("none")).expect("writable");
    refused(
        &place,
        &["prepare", "none", "-o", "house"],
        &["none", "0 usable photos"],
    );
    fs::remove_dir_all(place.path("house")).expect("a folder");
    let mut after = files_below(&place.path(""));
    after.retain(|(name, _)| !name.starts_with("mine/") && name != "fake/log");
    assert!(before == after);

    // The photos may lie in it under a name of their own.
    fs::create_dir_all(place.path("house")).expect("writable");
    fs::rename(place.path("photos"), place.path("house/photos")).expect("writable");
    succeed(&place, &["prepare", "house/photos", "-o", "house"]);
    fs::create_dir_all(place.path("others")).expect("writable");
    for view in 0..2 {
        scene::photo(view)
            .save(place.path(&format!("others/{view}.png")))
            .expect("writable");
    }
    let others = ["prepare", "others", "-o", "house"];
    refused(&place, &others, &["was prepared from", "photos", "--force"]);
    piece(&place, 0, &["0.png".to_owned(), "1.png".to_owned()]);
    let done = succeed(&place, &[&others[..], &["--force"]].concat());
    assert!(done.stdout.starts_with("2 of 2"), "{done:?}");
}
