//! With FFmpeg and COLMAP, where they are installed.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::program::Place;

/// The bundled scene's photos.
pub(super) const GARDEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo/images");

/// Whether a program can be started; says so where it cannot.
pub(super) fn is_there(program: &str, argument: &str) -> bool {
    let asked = Command::new(program)
        .arg(argument)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    let there = asked.is_ok();
    if !there {
        eprintln!("skipped: no {program} here");
    }
    there
}

/// A gray film of the bundled scene's photos: to the last one and back to the seventh, 20 frames.
fn film(place: &Place) {
    fs::create_dir_all(place.path("shots")).expect("writable");
    let there = 0..14;
    let back = (7..13).rev();
    for (frame, photo) in there.chain(back).enumerate() {
        let photo = Path::new(GARDEN).join(format!("garden_{photo:02}.jpg"));
        fs::copy(photo, place.path(&format!("shots/{frame:02}.jpg"))).expect("writable");
    }
    let made = Command::new("ffmpeg")
        .args(["-v", "error", "-nostdin", "-framerate", "24", "-i"])
        .arg(place.path("shots/%02d.jpg"))
        .args([
            "-vf",
            "format=gray,format=yuv420p",
            "-c:v",
            "mpeg4",
            "-q:v",
            "2",
        ])
        .arg(place.path("garden.mp4"))
        .status();
    assert!(made.expect("ffmpeg").success());
}

#[test]
fn a_film_of_the_bundled_scene() {
    if !(is_there("ffmpeg", "-version") && is_there("colmap", "help")) {
        return;
    }
    let place = Place::new();
    film(&place);
    let told = place.json(&["prepare", "garden.mp4", "-o", "house", "--json"]);
    let placed = told["poses"]["placed"].as_u64().expect("a number");
    assert!(placed >= 18 && told["photos"] == 20, "{told:#}");
    assert_eq!(told["poses"]["pieces"][0], placed);
    // They are where fit looks for them, and sound.
    let info = place.json(&["info", "house", "--json"]);
    assert_eq!(info["views"], placed);
    assert_eq!(info["warnings"], Value::Array(Vec::new()), "{info:#}");
    let error = info["reprojection_error"].as_f64().expect("a number");
    assert!(error < 1.0, "{error}");
    let again = place.json(&["prepare", "garden.mp4", "-o", "house", "--json"]);
    assert_eq!(again, told);
}
