//! With FFmpeg and COLMAP themselves.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::fakes::{piece, place_with, refused, succeed};
use crate::program::Place;

/// The bundled scene's photos.
pub(super) const GARDEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo/images");

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

/// FFmpeg alone, on a film of 14 frames that begins 0.6 s later than its sound.
#[cfg(unix)]
#[test]
#[ignore = "needs FFmpeg: make test-all"]
fn no_frame_of_a_recording_is_lost_and_lists_lead_nowhere() {
    let place = place_with(&["colmap"]);
    for program in ["ffmpeg", "ffprobe"] {
        let path = std::env::var_os("PATH").unwrap_or_default();
        let mut found = std::env::split_paths(&path).map(|folder| folder.join(program));
        let found = found.find(|path| path.is_file()).expect("a program");
        std::os::unix::fs::symlink(found, place.path(&format!("bin/{program}"))).expect("writable");
    }
    let film = |name: &str, options: &[&str]| {
        let made = Command::new("ffmpeg")
            .args([
                "-v",
                "error",
                "-f",
                "lavfi",
                "-i",
                "sine=d=1.2",
                "-itsoffset",
                "0.6",
            ])
            .args(["-f", "lavfi", "-i", "testsrc2=s=160x120:r=25:d=0.56"])
            .args(["-map", "0", "-map", "1", "-fps_mode", "passthrough"])
            .args(options)
            .arg(place.path(name))
            .status();
        assert!(made.expect("ffmpeg").success(), "{name}");
    };
    film("a.ts", &["-c:v", "mpeg2video", "-bf", "2", "-c:a", "mp2"]);
    film("a.mpg", &["-c:v", "mpeg2video", "-bf", "2", "-c:a", "mp2"]);
    film("a.mkv", &["-c:v", "mpeg4", "-c:a", "aac"]);
    let names: Vec<String> = (1..=14).map(|k| format!("{k:06}.png")).collect();
    piece(&place, 0, &names);
    for name in ["a.ts", "a.mpg", "a.mkv"] {
        let done = succeed(&place, &["prepare", name, "-o", &format!("{name} out")]);
        assert!(!done.stderr.contains("warning"), "{done:?}");
        let film: Value =
            serde_json::from_slice(&place.read(&format!("{name} out/film.json"))).expect("JSON");
        assert_eq!(film["frames"].as_array().map(Vec::len), Some(14), "{name}");
        let start = film["start"].as_f64().expect("a number");
        // Sound begins earlier by what its codec needs to start.
        assert!((0.55..0.7).contains(&start), "{name}: {start}");
    }
    let list = format!(
        "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\n{}\n#EXT-X-ENDLIST\n",
        place.path("a.ts").display()
    );
    place.write("list.m3u8", &list);
    place.write("list.mp4", &list);
    for name in ["list.m3u8", "list.mp4"] {
        refused(
            &place,
            &["prepare", name, "-o", "house"],
            &[name, "hls", "other files"],
        );
    }
}

#[test]
#[ignore = "needs FFmpeg and COLMAP: make test-all"]
fn a_film_of_the_bundled_scene() {
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
