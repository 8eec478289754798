//! An old film comes back in color: all steps one after the other, with FFmpeg and COLMAP.

use std::io::Write;
use std::process::{Command, Stdio};

use serde_json::{Value, json};

use super::real::GARDEN;
use crate::program::Place;
use crate::shared::onnx;

/// Width and height of the bundled photos.
const SIZE: [usize; 2] = [324, 216];

/// Photos of the film: to the last one and back to the seventh.
const FRAMES: usize = 20;

/// Frames a second. Fewer get a pose, so that some have none.
const RATE: &str = "24000/1001";
const PER_SECOND: &str = "19";

/// Steps of a number generator that is the same everywhere; gives -1 to 1.
fn random(state: &mut u64) -> f64 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) as f64 / f64::from(1 << 30) - 1.0
}

/// Gray frames that flicker, with grain.
fn frames() -> Vec<u8> {
    let mut state = 1;
    let mut frames = Vec::new();
    for photo in (0..14).chain((7..13).rev()) {
        let path = format!("{GARDEN}/garden_{photo:02}.jpg");
        let photo = image::open(path).expect("a photo").into_luma8();
        assert_eq!(photo.dimensions(), SIZE.map(|side| side as u32).into());
        let [gain, offset] = [1.0 + 0.06 * random(&mut state), 4.0 * random(&mut state)];
        let pixels = photo.iter().map(|&value| {
            let value = gain * f64::from(value) + offset + 6.0 * random(&mut state);
            value.clamp(0.0, 255.0) as u8
        });
        frames.extend(pixels);
    }
    frames
}

/// `film.mp4`: the frames, and a tone.
fn film(place: &Place) {
    let [width, height] = SIZE;
    let mut child = Command::new("ffmpeg")
        .args(["-v", "error", "-f", "rawvideo", "-pix_fmt", "gray", "-s"])
        .arg(format!("{width}x{height}"))
        .args(["-framerate", RATE, "-i", "pipe:0", "-f", "lavfi", "-i"])
        .args(["sine=440", "-shortest", "-c:v", "libx264", "-crf", "8"])
        .args(["-vf", "scale=in_range=full:out_range=limited"])
        .args(["-pix_fmt", "yuv420p"])
        .arg(place.path("film.mp4"))
        .stdin(Stdio::piped())
        .spawn()
        .expect("ffmpeg");
    let mut to = child.stdin.take().expect("a pipe");
    to.write_all(&frames()).expect("ffmpeg takes it");
    drop(to);
    assert!(child.wait().expect("ffmpeg").success());
}

/// Streams of a film of a kind, `v` or `a`, by `ffprobe`.
pub(super) fn streams(place: &Place, film: &str, kind: &str) -> Value {
    let said = Command::new("ffprobe")
        .args(["-v", "error", "-count_frames", "-of", "json"])
        .args(["-select_streams", kind, "-show_entries"])
        .arg("stream=codec_name,width,height,r_frame_rate,avg_frame_rate,nb_read_frames,duration")
        .arg(place.path(film))
        .output()
        .expect("ffprobe");
    let said: Value = serde_json::from_slice(&said.stdout).expect("JSON");
    said["streams"].clone()
}

/// `L*`, a and b of the pixels of each frame of a film.
fn decoded(place: &Place, film: &str) -> Vec<Vec<[f64; 3]>> {
    let done = Command::new("ffmpeg")
        .args(["-v", "error", "-nostdin", "-i"])
        .arg(place.path(film))
        .args(["-f", "rawvideo", "-pix_fmt", "rgb24", "-"])
        .output();
    let bytes = done.expect("ffmpeg").stdout;
    let frames = bytes.chunks(3 * SIZE[0] * SIZE[1]);
    let lab = |p: &[u8]| {
        let rgb = std::array::from_fn(|k| f64::from(p[k]) / 255.0);
        gs_chroma::color::srgb_to_lab(rgb)
    };
    frames
        .map(|frame| frame.chunks(3).map(lab).collect())
        .collect()
}

/// A mean over pixels.
fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// Mean CIELAB chroma of a frame.
fn chroma(frame: &[[f64; 3]]) -> f64 {
    mean(frame.iter().map(|lab| lab[1].hypot(lab[2])))
}

#[test]
#[ignore = "needs FFmpeg and COLMAP: make test-all"]
fn an_old_film_comes_back_in_color() {
    let place = Place::new();
    film(&place);
    let house = ["-o", "house", "--pose-fps", PER_SECOND];
    let made = place.json(&[&["prepare", "film.mp4", "--json"], &house[..]].concat());
    assert_eq!(
        made["film"]["frames"].as_array().map(Vec::len),
        Some(FRAMES)
    );
    let posed = made["poses"]["placed"].as_u64().expect("a number");
    assert!((12..FRAMES as u64).contains(&posed), "{made:#}");
    let quick = [
        "--preset",
        "draft",
        "--iterations",
        "60",
        "--max-side",
        "160",
    ];
    place.succeed(&[&["fit", "house"], &quick[..]].concat());
    place.succeed(&["colorize", "--teacher", &onnx("ddcolor_tiny.onnx")]);
    let told = place.json(&["frames", "-o", "colored.mp4", "--json"]);
    assert_eq!(told["photos"], json!(FRAMES));
    assert_eq!(told["placed"], json!(posed));
    assert_eq!(told["carried"], json!(FRAMES as u64 - posed));

    // The same film but for its colors: size, rate, number and duration of frames, and sound.
    let pictures = streams(&place, "colored.mp4", "v");
    assert_eq!(pictures, streams(&place, "film.mp4", "v"));
    assert_eq!(pictures[0]["nb_read_frames"], json!(FRAMES.to_string()));
    assert_eq!(pictures[0]["r_frame_rate"], json!(RATE));
    let sound = |film| streams(&place, film, "a").as_array().map(Vec::len);
    assert_eq!(
        (sound("film.mp4"), sound("colored.mp4")),
        (Some(1), Some(1))
    );
    // Frame by frame as light as it was, but for grain that the codec rounds off, and colorful.
    let [before, after] = ["film.mp4", "colored.mp4"].map(|film| decoded(&place, film));
    assert_eq!([before.len(), after.len()], [FRAMES; 2]);
    for (index, (old, new)) in before.iter().zip(&after).enumerate() {
        let darker = old.iter().zip(new).map(|(old, new)| old[0] - new[0]);
        let apart = mean(darker.clone().map(f64::abs));
        assert!(apart < 2.0, "frame {index}: {apart}");
        let darker = mean(darker);
        assert!(darker.abs() < 0.5, "frame {index}: {darker}");
        let [gray, colored] = [chroma(old), chroma(new)];
        assert!(
            gray < 1.0 && colored > 4.0,
            "frame {index}: {gray} {colored}"
        );
    }
}
