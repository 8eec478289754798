//! `frames` of a film.

use super::program::Place;
use super::scene;
use super::shared::place_with_run;

/// A stand-in for ffmpeg that keeps what it is told and given, and one for ffprobe.
#[cfg(unix)]
fn stand_in(place: &Place, script: &str) -> String {
    use std::os::unix::fs::PermissionsExt;
    const PROBED: &str = r#"{"streams": [
        {"index": 0, "codec_type": "video", "width": 64, "height": 48},
        {"index": 1, "codec_type": "data"},
        {"index": 2, "codec_type": "audio", "codec_name": "mp3", "channels": 2},
        {"index": 3, "codec_type": "audio", "codec_tag_string": "apac", "channels": 4}
      ], "format": {"duration": "70.0"}}"#;
    for (name, script) in [
        (
            "bin/ffmpeg",
            format!("[ \"$1\" = -version ] && exit 0\n{script}"),
        ),
        ("bin/ffprobe", format!("echo '{PROBED}'")),
    ] {
        place.write(name, format!("#!/bin/sh\n{script}\n"));
        let path = place.path(name);
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755)).expect("writable");
    }
    format!("{}:/usr/bin:/bin", place.path("bin").display())
}

/// Keeps pictures as they come, and what is laid under them.
#[cfg(unix)]
const ENCODER: &str = r#"case "$*" in
  *pipe:0*) echo "$@" > told.txt; for last; do :; done; cat > "$last" ;;
  *) echo "$@" > laid.txt; [ -e silent ] && exit 3
     while [ $# -gt 1 ]; do [ "$1" = -i ] && : "${first:=${2#file:}}"; shift; done
     cat "$first" > "$1" ;;
esac"#;

#[cfg(unix)]
#[test]
fn a_film_has_all_frames_the_rate_and_the_sound_of_its_source() {
    use super::program::Done;

    const FILES: [&str; 3] = ["out.changes.html", "out.changes.json", "out.mp4"];
    let place = place_with_run();
    let mut frames = Vec::new();
    for index in 0..8 {
        scene::photo(index)
            .save(place.path("frame.png"))
            .expect("writable");
        frames.push(scene::name(index));
        place.write(
            &format!("scene/frames/{}", scene::name(index)),
            place.read("frame.png"),
        );
    }
    place.write("scene/frames/045.png", place.read("scene/frames/04.png"));
    frames.insert(5, "045.png".to_owned());
    place.write("street.mp4", "a film");
    let film = serde_json::json!({
        "source": place.path("street.mp4"), "start": 65.0, "seconds": 0.375,
        "frame_rate": [24000, 1001], "audio": true, "size": scene::SIZE, "frames": frames,
    });
    place.write("scene/film.json", film.to_string());
    let path = stand_in(&place, ENCODER);
    let run = |arguments: &[&str], path: &str| {
        Done::of(place.command(arguments).env("PATH", path).output())
    };
    let done = run(&["frames", "-o", "films/out.mp4"], &path);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let bytes = place.read("films/out.mp4");
    assert_eq!(
        bytes.len(),
        9 * 3 * (scene::SIZE[0] * scene::SIZE[1]) as usize
    );
    assert_eq!(place.files("films"), FILES);
    let text = |name: &str| String::from_utf8(place.read(name)).expect("text");
    let (told, laid) = (text("told.txt"), text("laid.txt"));
    for words in ["-framerate 24000/1001", "64x48"] {
        assert!(told.contains(words), "{words}: {told}");
    }
    // What can be decoded of the sound, and a word about the rest.
    for words in [
        "-ss 65.000000 -t 0.375000",
        "street.mp4",
        "-map 1:2 -c:a:0 aac",
    ] {
        assert!(laid.contains(words), "{words}: {laid}");
    }
    assert!(!laid.contains("-map 1:3"), "{laid}");
    let left_out = "stream 3 of sound (apac) is left out";
    assert!(done.stderr.contains(left_out), "{}", done.stderr);
    // The same frames as in a folder.
    place.succeed(&["frames", "-o", "out"]);
    let first = image::open(place.path("out/00.png"))
        .expect("a picture")
        .into_rgb8();
    assert!(bytes.starts_with(&first));
    let done = run(
        &["frames", "-o", "films/out.mp4", "--frame-rate", "25"],
        &path,
    );
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(text("told.txt").contains("-framerate 25/1 "));
    // At another rate frames are repeated: the sound does not run any slower.
    let done = run(
        &["frames", "-o", "films/fast.mp4", "--fps", "48000/1001"],
        &path,
    );
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert_eq!(place.read("films/fast.mp4").len(), 2 * bytes.len());
    // Sound that fails takes no picture with it, and a film that is gone is told.
    let silent = |word: &str| {
        let done = run(&["frames", "-o", "films/fast.mp4"], &path);
        assert_eq!(done.code, Some(0), "{}", done.stderr);
        let warned = done
            .stderr
            .lines()
            .any(|line| line.starts_with("warning:") && line.contains(word));
        assert!(warned, "{word}: {}", done.stderr);
        assert!(place.read("films/fast.mp4") == bytes, "{word}");
    };
    place.write("silent", "");
    silent("stream 2 of sound (mp3) is left out");
    std::fs::remove_file(place.path("street.mp4")).expect("a film");
    place.write("bin/ffprobe", "#!/bin/sh\nexit 1\n");
    silent("street.mp4 is gone");
    std::fs::remove_file(place.path("films/fast.mp4")).expect("a film");
    // What fails leaves the film that was there.
    let path = stand_in(&place, "echo warned >&2; echo 'no such codec' >&2; exit 3");
    let done = run(&["frames", "-o", "films/out.mp4"], &path);
    assert_eq!(done.code, Some(1));
    assert!(done.stderr.contains("no such codec"), "{}", done.stderr);
    assert!(!place.files("films").contains(&"fast.mp4".to_owned()));
    assert_eq!(place.read("films/out.mp4"), bytes);
    // A frame that is not there is named.
    std::fs::remove_file(place.path("scene/frames/045.png")).expect("a frame");
    let done = run(&["frames", "-o", "out"], &path);
    assert_eq!(done.code, Some(1));
    assert!(done.stderr.contains("045.png"), "{}", done.stderr);
}
