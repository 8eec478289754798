//! A film of several shots, with FFmpeg and COLMAP themselves.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::real::GARDEN;
use super::restored::streams;
use crate::documented::conforms;
use crate::program::Place;

/// 12 frames of a camera that stands, 5 black ones, and 6 without anything that matches; a tone.
fn film(place: &Place) {
    let grain = "format=gray,noise=alls=4:allf=t,format=yuv420p";
    let graph = format!(
        "[0]scale=216:144,{grain}[a];\
         color=black:s=216x144:d=0.5:r=10,format=yuv420p[b];\
         nullsrc=s=216x144:d=0.6:r=10,geq=lum='128+90*sin(X/40)':cb=128:cr=128,format=yuv420p[c];\
         [a][b][c]concat=n=3[film]"
    );
    let made = Command::new("ffmpeg")
        .args(["-v", "error", "-nostdin", "-framerate", "10", "-loop", "1"])
        .args(["-t", "1.2", "-i"])
        .arg(Path::new(GARDEN).join("garden_08.jpg"))
        .args(["-filter_complex", &graph, "-map", "[film]"])
        .args(["-c:v", "libx264", "-crf", "6"])
        .arg(place.path("silent.mp4"))
        .status();
    assert!(made.expect("ffmpeg").success());
    let made = Command::new("ffmpeg")
        .args(["-v", "error", "-nostdin", "-i"])
        .arg(place.path("silent.mp4"))
        .args(["-f", "lavfi", "-i", "sine=440:duration=2.3", "-c:v", "copy"])
        .arg(place.path("reel.mp4"))
        .status();
    assert!(made.expect("ffmpeg").success());
}

#[test]
#[ignore = "needs FFmpeg and COLMAP: make test-all"]
fn a_film_of_several_shots_comes_back_whole() {
    let place = Place::new();
    film(&place);
    let teacher = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/assets/teacher/demo-teacher.onnx"
    );
    let auto = [
        "auto",
        "reel.mp4",
        "-o",
        "out",
        "--preset",
        "draft",
        "--teacher",
        teacher,
        "--json",
    ];
    let told = place.json(&auto);
    conforms(&told, "reel");
    let shots = told["shots"].as_array().expect("shots");
    assert_eq!(shots.len(), 3, "{told:#}");
    assert_eq!(shots[0]["camera"], "stands", "{told:#}");
    assert!(shots[0]["outcome"]["run"].is_string(), "{told:#}");
    assert_eq!(shots[1]["outcome"]["kind"], "blank");
    assert_eq!(shots[2]["outcome"]["colors"], "gray", "{told:#}");
    let frames = |film: &str| -> Value { streams(&place, film, "v")[0]["nb_read_frames"].clone() };
    assert_eq!(frames("out/colored.mp4"), frames("reel.mp4"));
    assert_eq!(
        streams(&place, "out/colored.mp4", "a")
            .as_array()
            .map(Vec::len),
        Some(1)
    );
    let page = String::from_utf8(place.read("out/index.html")).expect("text");
    for words in [
        "The camera stands",
        "Shows nothing",
        "Left gray: no photo has a pose",
    ] {
        assert!(page.contains(words), "{words}: {page}");
    }
    // Nothing is made again, but a shot that has no scene is tried again.
    let done = place.run(&auto);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let again: Vec<&str> = (done.stderr.lines())
        .filter(|line| line.starts_with("step ") && !line.ends_with("its result is there"))
        .collect();
    assert_eq!(again, ["step 1 of 6, prepare", "step 1 of 6, prepare"]);
    // The first shot, cut in two: the halves are made anew, and what lies behind is not.
    let times = String::from_utf8(place.read("out/shots.json")).expect("text");
    let mut times: Value = serde_json::from_str(&times).expect("JSON");
    let all = times["shots"].as_array_mut().expect("shots");
    all[0] = serde_json::json!([0.6, 1.2]);
    all.insert(0, serde_json::json!([0.0, 0.6]));
    place.write("out/shots.json", times.to_string());
    // In the archive's codec, and the last shot in the teacher's colors.
    let again = [&auto[..], &["--fallback", "teacher", "--codec", "ffv1"]].concat();
    let told = place.json(&again);
    assert_eq!(told["shots"].as_array().map(Vec::len), Some(4), "{told:#}");
    assert_eq!(told["shots"][3]["outcome"]["colors"], "teacher");
    assert_eq!(frames("out/colored.mkv"), frames("reel.mp4"));
    assert_eq!(
        streams(&place, "out/colored.mkv", "v")[0]["codec_name"],
        "ffv1"
    );
}
