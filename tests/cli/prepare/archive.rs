//! Archive formats in and out, with FFmpeg itself: numbered DPX and films of 10 bits go through
//! `prepare` and `frames`, and come back with their lightness, rate and time code.

use std::{
    fs,
    io::Write,
    process::{Command, Stdio},
};

use gs_chroma::color::gray_from_rgb;
use image::{DynamicImage, imageops::FilterType};
use serde_json::{Value, json};

use super::fakes::{piece, place_with, refused, succeed};
use crate::{program::Place, scene, shared::place_with_run};

/// Frames of a film: names of photos that lie in no other folder.
const FRAMES: usize = 8;

/// A 10-bit value of each pixel of the scene's photos, enlarged, not all of them multiples of 4.
fn values(frame: usize, [width, height]: [u32; 2]) -> Vec<u16> {
    let photo = DynamicImage::from(scene::photo(frame)).to_luma8();
    let large = image::imageops::resize(&photo, width, height, FilterType::Triangle);
    let value = |(i, gray): (usize, &u8)| u16::from(*gray) * 4 + (i % 4) as u16;
    large.iter().enumerate().map(value).collect()
}

/// A DPX file of 10 bits as a scanner writes it: logarithmic, film rate and time code, little-endian.
fn dpx(frame: usize, rate: f32) -> Vec<u8> {
    let [width, height] = scene::SIZE;
    let mut bytes = vec![0xff; 2048];
    let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
    put(0, b"XPDS");
    put(4, &2048_u32.to_le_bytes());
    put(8, b"V1.0\0\0\0\0");
    put(16, &(2048 + 4 * width * height).to_le_bytes());
    put(768, &[0, 0, 1, 0]);
    put(772, &width.to_le_bytes());
    put(776, &height.to_le_bytes());
    put(780, &[0; 4]);
    put(800, &[50, 3, 1, 10, 1, 0, 0, 0]);
    put(808, &2048_u32.to_le_bytes());
    put(1724, &rate.to_le_bytes());
    // 01:00:00:10 and on, in decimal digits.
    put(1920, &[0x10 + frame as u8 % 6, (frame / 6) as u8, 0, 1]);
    for value in values(frame, scene::SIZE) {
        let value = u32::from(value);
        bytes.extend((value << 22 | value << 12 | value << 2).to_le_bytes());
    }
    bytes
}

/// A place with a fake of COLMAP and FFmpeg itself.
fn place_with_ffmpeg() -> Place {
    let place = place_with(&["colmap"]);
    for program in ["ffmpeg", "ffprobe"] {
        let path = std::env::var_os("PATH").unwrap_or_default();
        let mut found = std::env::split_paths(&path).map(|folder| folder.join(program));
        let found = found.find(|path| path.is_file()).expect("a program");
        std::os::unix::fs::symlink(found, place.path(&format!("bin/{program}"))).expect("writable");
    }
    let names: Vec<String> = (1..=FRAMES).map(|k| format!("{k:06}.png")).collect();
    piece(&place, 0, &names);
    place
}

/// A colored run whose photos are the frames that were prepared: its poses are those of these names.
fn run_of(house: &Place) -> (Place, Value) {
    let place = place_with_run();
    let mut film: Value = serde_json::from_slice(&house.read("house/film.json")).expect("JSON");
    let names: Vec<String> = (0..FRAMES).map(scene::name).collect();
    for (prepared, name) in film["frames"]
        .as_array()
        .expect("frames")
        .iter()
        .zip(&names)
    {
        let prepared = prepared.as_str().expect("a name");
        let frame = house.read(&format!("house/frames/{prepared}"));
        place.write(&format!("scene/frames/{name}"), &frame);
        place.write(&format!("scene/images/{name}"), &frame);
    }
    film["frames"] = json!(names);
    place.write("scene/film.json", film.to_string());
    (place, film)
}

/// FFmpeg with bytes on its input; gives its output.
fn ffmpeg(arguments: &[&str], input: Vec<u8>) -> Vec<u8> {
    let mut child = Command::new("ffmpeg")
        .args(["-v", "error", "-y"])
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("ffmpeg");
    let mut pipe = child.stdin.take().expect("a pipe");
    let written = std::thread::spawn(move || pipe.write_all(&input));
    let done = child.wait_with_output().expect("an end");
    let _ = written.join();
    assert!(done.status.success(), "{arguments:?}");
    done.stdout
}

/// What `ffprobe` tells of a film's pictures, and of the first frame.
fn probe(place: &Place, name: &str) -> Value {
    let done = Command::new("ffprobe")
        .args([
            "-v",
            "error",
            "-of",
            "json",
            "-show_streams",
            "-show_format",
        ])
        .args(["-show_frames", "-read_intervals", "%+#1"])
        .arg(place.path(name))
        .output();
    serde_json::from_slice(&done.expect("ffprobe").stdout).expect("JSON")
}

/// Planes of values, as FFmpeg decodes a file to a pixel format.
fn planes(place: &Place, name: &str, format: &str) -> Vec<f64> {
    let path = place.path(name);
    let path = path.to_str().expect("a path");
    let bytes = ffmpeg(
        &["-i", path, "-pix_fmt", format, "-f", "rawvideo", "-"],
        Vec::new(),
    );
    let words = bytes
        .chunks_exact(2)
        .map(|word| u16::from_le_bytes([word[0], word[1]]));
    words.map(f64::from).collect()
}

/// Gray of the same lightness as pixels of G, B, R planes up to `white`, and whether any has color.
fn gray_of(planes: &[f64], pixels: usize, white: f64) -> (Vec<f64>, bool) {
    let frames = planes.chunks_exact(3 * pixels);
    let mut colored = false;
    let gray = frames.flat_map(|frame| {
        (0..pixels).map(move |i| [2, 0, 1].map(|c| frame[c * pixels + i] / white))
    });
    let gray = gray.map(|rgb| {
        colored |= (rgb[0] - rgb[2]).abs() > 0.05;
        gray_from_rgb(rgb)
    });
    (gray.collect(), colored)
}

/// By how many 10-bit values pictures differ in gray from what is wanted, at most and in the mean.
fn differences(gray: &[f64], wanted: impl Iterator<Item = f64>) -> [f64; 2] {
    let wanted: Vec<f64> = wanted.collect();
    assert_eq!(gray.len(), wanted.len());
    let apart = (gray.iter().zip(&wanted)).map(|(gray, wanted)| (1023.0 * gray - wanted).abs());
    let (most, sum) = apart.fold((0.0_f64, 0.0), |(most, sum), d| (most.max(d), sum + d));
    [most, sum / wanted.len() as f64]
}

/// The values of a frame at the photos' size.
fn scanned(frame: usize) -> impl Iterator<Item = f64> {
    values(frame, scene::SIZE).into_iter().map(f64::from)
}

/// A 10-bit value in the limited range of films: 64 to 940.
fn limited(value: u16) -> u16 {
    ((64 * 1023 + 876 * u32::from(value) + 511) / 1023) as u16
}

/// Text at a path of a report of `ffprobe`.
fn text<'a>(probed: &'a Value, path: &str) -> &'a str {
    probed
        .pointer(path)
        .and_then(Value::as_str)
        .unwrap_or_default()
}

#[test]
#[ignore = "needs FFmpeg: make test-all"]
fn numbered_dpx_come_back_as_they_were_and_in_other_kinds() {
    let house = place_with_ffmpeg();
    for frame in 0..FRAMES {
        house.write(
            &format!("reel 50%/scan_{:07}.dpx", 86_400 + frame),
            dpx(frame, 16.0),
        );
    }
    house.write("reel 50%/notes.txt", "a reel");
    let prepare = [
        "prepare", "reel 50%", "-o", "house", "--start", "0", "--end", "0.5",
    ];
    let done = succeed(&house, &prepare);
    assert!(done.stderr.contains("logarithmic"), "{done:?}");
    let (place, film) = run_of(&house);
    assert_eq!(film["frame_rate"], json!([16, 1]));
    let signal = &film["signal"];
    for (key, value) in [
        ("bits", json!(10)),
        ("dpx_transfer", json!(3)),
        ("timecode", json!("01:00:00:10")),
        ("names", json!("scan_%07d.dpx")),
        ("first", json!(86_400)),
    ] {
        assert_eq!(signal[key], value, "{signal}");
    }
    // Code values as they are, whatever they stand for.
    for frame in 0..FRAMES {
        let path = place.path(&format!("scene/frames/{}", scene::name(frame)));
        let gray = image::open(path).expect("a frame").into_luma16();
        let gray: Vec<f64> = gray.iter().map(|&v| f64::from(v) / 65_535.0).collect();
        let [most, _] = differences(&gray, scanned(frame));
        assert!(most < 0.2, "{frame}: {most}");
    }
    let told = place.json(&["frames", "-o", "out", "--json"]);
    assert_eq!(
        (&told["codec"], &told["photos"]),
        (&json!("dpx"), &json!(8))
    );
    let names: Vec<String> = (0..FRAMES)
        .map(|k| format!("scan_{:07}.dpx", 86_400 + k))
        .collect();
    assert_eq!(place.files("out"), names);
    let pixels = (scene::SIZE[0] * scene::SIZE[1]) as usize;
    let mut any = false;
    for (frame, name) in names.iter().enumerate() {
        let planes = planes(&place, &format!("out/{name}"), "gbrp10le");
        let (gray, colored) = gray_of(&planes, pixels, 1023.0);
        let [most, _] = differences(&gray, scanned(frame));
        assert!(most <= 1.0, "{name}: {most}");
        any |= colored;
    }
    assert!(any, "no color at all");
    let last = probe(&place, &format!("out/{}", names[6]));
    assert_eq!(text(&last, "/frames/0/tags/timecode"), "01:00:01:00");
    // Logarithmic, as they were.
    assert_eq!(place.read(&format!("out/{}", names[6]))[801], 3);
    // Once more into the same folder, which holds nothing else; and in other kinds.
    place.succeed(&["frames", "-o", "out"]);
    for (codec, extension, format, white) in [
        ("tiff", "tif", "gbrp16le", 65_535.0),
        ("exr", "exr", "gbrpf32le", 1.0),
    ] {
        let folder = format!("as {codec}");
        for _ in 0..2 {
            place.succeed(&["frames", "-o", &folder, "--codec", codec]);
        }
        let name = format!("{folder}/scan_0086403.{extension}");
        let (gray, _) = match codec {
            "exr" => gray_of(&light(&place, &name), pixels, white),
            _ => gray_of(&planes(&place, &name, format), pixels, white),
        };
        let [most, _] = differences(&gray, scanned(3));
        assert!(most <= 1.0, "{codec}: {most}");
    }
    // What is missing is named.
    fs::remove_file(house.path("reel 50%/scan_0086404.dpx")).expect("a file");
    refused(&house, &prepare, &["scan_0086404.dpx is missing"]);
}

/// G, B and R planes of an EXR file's linear light, encoded as sRGB.
fn light(place: &Place, name: &str) -> Vec<f64> {
    let path = place.path(name);
    let path = path.to_str().expect("a path");
    let bytes = ffmpeg(
        &["-i", path, "-pix_fmt", "gbrpf32le", "-f", "rawvideo", "-"],
        Vec::new(),
    );
    let floats = bytes
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    floats
        .map(|light| gs_chroma::color::linear_to_srgb(f64::from(light)))
        .collect()
}

#[test]
#[ignore = "needs FFmpeg: make test-all"]
fn films_of_10_bits_keep_lightness_rate_time_code_and_sound() {
    const SIZE: [u32; 2] = [256, 192];
    let house = place_with_ffmpeg();
    let mut input = Vec::new();
    for frame in 0..FRAMES {
        let gray = values(frame, SIZE);
        input.extend(gray.iter().flat_map(|&value| limited(value).to_le_bytes()));
        input.extend(512_u16.to_le_bytes().repeat(gray.len()));
    }
    let source = house.path("film.mkv");
    let source = source.to_str().expect("a path");
    ffmpeg(
        &[
            "-f",
            "rawvideo",
            "-pix_fmt",
            "yuv422p10le",
            "-video_size",
            "256x192",
            "-framerate",
            "24000/1001",
            "-i",
            "-",
            "-f",
            "lavfi",
            "-i",
            "sine=d=0.33:r=48000",
            "-c:v",
            "ffv1",
            "-color_range",
            "tv",
            "-c:a",
            "pcm_s16le",
            "-timecode",
            "00:59:59:20",
            source,
        ],
        input,
    );
    succeed(
        &house,
        &[
            "prepare", "film.mkv", "-o", "house", "--start", "0", "--end", "1",
        ],
    );
    let (place, film) = run_of(&house);
    assert_eq!(film["signal"]["timecode"], "00:59:59:20");
    for (output, codec, format, most, mean) in [
        ("out.mkv", "ffv1", "gbrp10le", 1.0, 0.4),
        ("out.mov", "prores", "yuv422p10le", 8.0, 0.8),
        ("4444.mov", "prores", "yuv444p12le", 8.0, 0.8),
        ("out.mxf", "dnxhd", "yuv422p10le", 8.0, 0.8),
    ] {
        let mut arguments = vec!["frames", "-o", output];
        if output == "4444.mov" {
            arguments.extend(["--codec", "prores4444"]);
        }
        place.succeed(&arguments);
        let probed = probe(&place, output);
        let streams = probed["streams"].as_array().expect("streams");
        let of = |kind: &str| streams.iter().find(|stream| stream["codec_type"] == kind);
        let video = of("video").expect("pictures");
        assert_eq!(video["codec_name"], codec, "{output}");
        assert_eq!(video["pix_fmt"], format, "{output}");
        assert_eq!(video["r_frame_rate"], "24000/1001", "{output}");
        if output != "out.mkv" {
            assert_eq!(video["field_order"], "progressive", "{output}");
        }
        let audio = of("audio").expect("sound");
        assert_eq!(audio["codec_name"], "pcm_s16le", "{output}");
        assert!(
            probed.to_string().contains("00:59:59:20"),
            "{output}: {probed:#}"
        );
        let found = compared(&place, output, format, SIZE);
        assert!(found[0] <= most && found[1] <= mean, "{output}: {found:?}");
    }
    let changes: Value = serde_json::from_slice(&place.read("out.changes.json")).expect("JSON");
    assert_eq!(changes["frames"][7]["timecode"], "01:00:00:03");
    assert_eq!(changes["source"]["sha256"].as_str().map(str::len), Some(64));
}

/// [`differences`] of a film's pictures.
fn compared(place: &Place, name: &str, format: &str, size: [u32; 2]) -> [f64; 2] {
    let pixels = (size[0] * size[1]) as usize;
    let of_frames = (0..FRAMES).flat_map(|frame| values(frame, size));
    let wanted = of_frames.map(|value| (f64::from(limited(value)) - 64.0) / 876.0 * 1023.0);
    let planes = planes(place, name, format);
    if format.starts_with("gbr") {
        return differences(&gray_of(&planes, pixels, 1023.0).0, wanted);
    }
    // Y′CbCr of BT.709, of which chroma may have half the width.
    let [step, unit] = if format.contains("422") {
        [2, 1]
    } else {
        [1, 4]
    };
    let length = pixels + 2 * pixels / step;
    let gray = planes.chunks_exact(length).flat_map(|frame| {
        (0..pixels).map(move |i| {
            let chroma = |c: usize| {
                (frame[pixels + c * pixels / step + i / step] / unit as f64 - 512.0) / 896.0
            };
            let y = (frame[i] / unit as f64 - 64.0) / 876.0;
            let [cb, cr] = [chroma(0), chroma(1)];
            let [r, b] = [y + 1.5748 * cr, y + 1.8556 * cb];
            gray_from_rgb([r, (y - 0.2126 * r - 0.0722 * b) / 0.7152, b])
        })
    });
    differences(&gray.collect::<Vec<_>>(), wanted)
}
