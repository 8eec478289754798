//! Films, by a fake of FFmpeg.

use std::fs;

use serde_json::{Value, json};

use super::fakes::{calls, piece, place_with, refused, succeed, version};
use crate::documented::conforms;
use crate::program::Place;
use crate::scene;

const FILM: [&str; 4] = ["prepare", "film.mp4", "-o", "house"];

/// Frames a second of the fake film.
const RATE: usize = 10;

/// A folder with a film of so many frames of each shot, of which all frames are of the scene.
fn place_with_film(shots: &[usize]) -> Place {
    let place = place_with(&["colmap", "ffmpeg", "ffprobe"]);
    place.write("film.mp4", "a film");
    probe(&place, |_| {});
    // Tiny frames of a pattern of its own for each shot.
    let shade = |shot: usize, x: usize, y: usize| match shot % 2 {
        0 => (3 * x + y) as u8,
        _ => 255 - (2 * x * (shot + 1) % 200) as u8,
    };
    let tiny: Vec<u8> = shots
        .iter()
        .enumerate()
        .flat_map(|(shot, &frames)| (0..frames).map(move |_| shot))
        .flat_map(|shot| (0..36 * 64).map(move |p| shade(shot, p % 64, p / 64)))
        .collect();
    place.write("fake/tiny", tiny);
    frames(&place, 40);
    place
}

/// Frames that FFmpeg will write; every third is sharp.
fn frames(place: &Place, count: usize) {
    fs::create_dir_all(place.path("fake/frames")).expect("writable");
    for frame in 0..count {
        let photo = image::DynamicImage::from(scene::photo(frame % scene::VIEWS)).to_luma8();
        let blurred = match frame % 3 {
            1 => photo,
            _ => image::imageops::blur(&photo, 1.5),
        };
        let path = place.path(&format!("fake/frames/{}", name(frame)));
        blurred.save(path).expect("writable");
    }
    let names: Vec<String> = (0..count).map(name).collect();
    piece(place, 0, &names);
}

fn name(frame: usize) -> String {
    format!("{:06}.png", frame + 1)
}

/// Fake output of `ffprobe`, after a change.
fn probe(place: &Place, change: fn(&mut Value)) {
    let mut said = json!({
        "streams": [
            {"index": 0, "codec_type": "video", "pix_fmt": "yuv420p",
             "sample_aspect_ratio": "1:1", "avg_frame_rate": format!("{RATE}/1")},
            {"index": 1, "codec_type": "audio"},
        ],
        "format": {"duration": "12.0", "format_name": "mov,mp4,m4a"},
    });
    change(&mut said);
    place.write("fake/probe", said.to_string());
}

/// The call that writes frames.
fn extraction(place: &Place) -> String {
    let calls = calls(place);
    let found = calls.into_iter().find(|call| call.contains("%06d.png"));
    found.expect("frames are written")
}

#[test]
fn a_film_becomes_what_fit_takes() {
    let place = place_with_film(&[15, 40, 20]);
    let done = succeed(&place, &FILM);
    assert!(done.stderr.contains("3 shots"), "{done:?}");
    assert!(
        done.stderr.contains("the longest, 0:01.50 to 0:05.50"),
        "{done:?}"
    );
    assert!(done.stderr.contains("0:05.50 to 0:07.50"), "{done:?}");
    let calls = calls(&place);
    let written = calls
        .iter()
        .find(|call| call.contains("%06d.png"))
        .expect("frames");
    // Half a frame earlier, so that rounding decides nothing.
    assert!(
        written.contains("-ss 1.450000 -t 4.000000 -protocol_whitelist file -format_whitelist mov"),
        "{written}"
    );
    assert!(written.contains("-pix_fmt gray "), "{written}");
    assert!(
        calls.iter().any(|call| call.contains("sequential_matcher")),
        "{calls:?}"
    );
    assert!(
        calls
            .iter()
            .any(|call| call.contains("--ImageReader.single_camera 1")),
        "{calls:?}"
    );

    let film: Value = serde_json::from_slice(&place.read("house/film.json")).expect("JSON");
    assert_eq!(
        (&film["start"], &film["seconds"]),
        (&json!(1.5), &json!(4.0))
    );
    assert_eq!(
        (&film["frame_rate"], &film["audio"]),
        (&json!([10, 1]), &json!(true))
    );
    assert_eq!(film["size"], json!(scene::SIZE));
    assert_eq!(film["frames"].as_array().map(Vec::len), Some(40));
    let source = fs::canonicalize(place.path("film.mp4")).expect("a film");
    assert_eq!(film["source"].as_str(), source.to_str());
    // 30 of 40 frames, each under its own name.
    let images = place.files("house/images");
    assert_eq!(images.len(), 30);
    for image in &images {
        let frame = place.read(&format!("house/frames/{image}"));
        assert!(place.read(&format!("house/images/{image}")) == frame);
    }
    // All is there the next time, and the shots are still known.
    let done = succeed(&place, &[&FILM[..], &["--json"]].concat());
    assert_eq!(super::calls(&place), [""; 0]);
    let told: Value = serde_json::from_str(&done.stdout).expect("JSON");
    assert_eq!(told["shots"], json!([[0.0, 1.5], [1.5, 5.5], [5.5, 7.5]]));
    assert_eq!(told["film"], film);
    // COLMAP's fake matches nothing.
    assert_eq!(told["motion"], Value::Null);
    conforms(&told, "prepare");
}

#[test]
fn the_sharpest_frames_are_taken() {
    let place = place_with_film(&[40]);
    succeed(&place, &[&FILM[..], &["--per-second", "3.4"]].concat());
    for image in place.files("house/images") {
        let frame: usize = image[..6].parse().expect("a number");
        let is_sharp = (frame - 1) % 3 == 1;
        let first_or_last = !(4..=37).contains(&frame);
        assert!(is_sharp || first_or_last, "{image}");
    }
    // Another rate takes the frames that are there.
    super::calls(&place);
    succeed(&place, &[&FILM[..], &["--pose-fps", "99"]].concat());
    assert_eq!(place.files("house/images").len(), 40);
    let calls = super::calls(&place);
    assert!(
        !calls.iter().any(|call| call.starts_with("ffmpeg")),
        "{calls:?}"
    );
}

#[test]
fn a_short_film_gives_all_its_frames() {
    let place = place_with_film(&[20]);
    fs::remove_dir_all(place.path("fake/frames")).expect("frames");
    frames(&place, 20);
    let done = succeed(&place, &FILM);
    assert!(done.stdout.starts_with("20 of 20"), "{done:?}");
    assert!(!done.stderr.contains("shots"), "{done:?}");
}

#[test]
fn a_part_that_is_asked_for_is_taken() {
    let place = place_with_film(&[15, 40]);
    let done = succeed(
        &place,
        &[&FILM[..], &["--start", "0:02", "--end", "6"]].concat(),
    );
    let written = extraction(&place);
    assert!(written.contains("-ss 2.000000 -t 4.000000"), "{written}");
    let warning = "warning: the chosen part has a cut at 0:03.50";
    assert!(done.stderr.contains(warning), "{done:?}");
    // Without an end, up to the cut.
    let done = succeed(&place, &[&FILM[..], &["--start", "2"]].concat());
    assert!(done.stderr.contains("from 0:02.00 to 0:03.50"), "{done:?}");
    assert!(extraction(&place).contains("-ss 1.950000 -t 1.500000"));
    let late = [&FILM[..], &["--start", "13"]].concat();
    refused(
        &place,
        &late,
        &["ends after 0:12.00", "give an earlier one"],
    );
}

#[test]
fn films_are_made_progressive_and_square() {
    let place = place_with_film(&[40]);
    place.write("fake/idet", "TFF: 30 BFF: 0 Progressive: 4 Undetermined: 6");
    probe(&place, |said| {
        said["streams"][0]["pix_fmt"] = json!("yuv422p10le");
        said["streams"][0]["sample_aspect_ratio"] = json!("16:15");
    });
    let done = succeed(&place, &FILM);
    assert!(done.stderr.contains("interlaced"), "{done:?}");
    let written = extraction(&place);
    assert!(written.contains("-vf bwdif=send_frame,scale="), "{written}");
    assert!(written.contains("-pix_fmt gray16be"), "{written}");
}

/// Seeking loses pictures where there is no index: nothing is sought, and time stamps cut.
#[test]
fn recordings_are_decoded_from_their_beginning() {
    let place = place_with_film(&[40]);
    probe(&place, |said| {
        said["format"]["format_name"] = json!("mpegts");
        said["format"]["start_time"] = json!("1.400000");
        // What the same fake says of packets: four more in the part than there are frames.
        let at = |k: i32| json!({"pts_time": format!("{:.6}", 2.0 + 0.09 * f64::from(k))});
        said["packets"] = Value::Array((0..50).map(at).collect());
    });
    let done = succeed(&place, &FILM);
    let warning = "warning: only 40 of 44 frames could be read";
    assert!(done.stderr.contains(warning), "{done:?}");
    let film: Value = serde_json::from_slice(&place.read("house/film.json")).expect("JSON");
    assert_eq!(film["start"], json!(0.6));
    super::calls(&place);
    succeed(
        &place,
        &[&FILM[..], &["--start", "2", "--end", "4"]].concat(),
    );
    let written = extraction(&place);
    let cut = "-vf setpts=PTS-STARTPTS,trim=start=2.000000:end=4.000000,setpts=PTS-2.000000/TB ";
    assert!(
        written.contains(cut) && !written.contains("-ss"),
        "{written}"
    );
}

#[test]
fn hdr_becomes_sdr_or_is_told() {
    let place = place_with_film(&[40]);
    place.write("fake/filters", " ... zscale V->V\n .S. tonemap V->V\n");
    probe(&place, |said| {
        said["streams"][0]["color_transfer"] = json!("arib-std-b67")
    });
    let done = succeed(&place, &FILM);
    assert!(done.stderr.contains("HDR (arib-std-b67)"), "{done:?}");
    assert!(!done.stderr.contains("warning: "), "{done:?}");
    let written = extraction(&place);
    assert!(
        written.contains("zscale=t=linear") && written.contains("tonemap="),
        "{written}"
    );
    place.write("fake/filters", " ... scale V->V\n");
    let done = succeed(&place, &[&FILM[..], &["--force"]].concat());
    assert!(
        done.stderr
            .contains("warning: the film is HDR (arib-std-b67)"),
        "{done:?}"
    );
    assert!(!extraction(&place).contains("tonemap="));
}

#[test]
fn a_sphere_has_its_lens_or_is_refused_before_any_work() {
    let place = place_with_film(&[40]);
    probe(&place, |said| {
        said["streams"][0]["side_data_list"] = json!([{"projection": "equirectangular"}]);
    });
    refused(
        &place,
        &FILM,
        &["COLMAP 3.8", "EQUIRECTANGULAR", "--install"],
    );
    assert!(!place.path("house").exists());
    version(&place, "4.1.0");
    let done = succeed(&place, &FILM);
    assert!(
        done.stderr.contains("using the lens EQUIRECTANGULAR"),
        "{done:?}"
    );
}

#[test]
fn black_borders_are_masked() {
    let place = place_with_film(&[40]);
    for frame in 0..40 {
        let path = place.path(&format!("fake/frames/{}", name(frame)));
        let mut picture = image::open(&path).expect("a frame").to_luma8();
        for (_, y, pixel) in picture.enumerate_pixels_mut() {
            pixel[0] = if (6..42).contains(&y) { pixel[0] } else { 2 };
        }
        picture.save(&path).expect("writable");
    }
    let done = succeed(&place, &FILM);
    assert!(
        done.stderr.contains("left 0, right 0, top 8, bottom 8"),
        "{done:?}"
    );
    assert!(done.stdout.contains("30 with a mask"), "{done:?}");
    let mask = image::open(
        place
            .path("house/masks")
            .join(format!("{}.png", place.files("house/images")[0])),
    );
    let mask = mask.expect("a mask").to_luma8();
    assert_eq!(
        [
            mask[(5, 7)][0],
            mask[(5, 8)][0],
            mask[(5, 39)][0],
            mask[(5, 40)][0]
        ],
        [0, 255, 255, 0]
    );
}

#[test]
fn films_that_cannot_be_used() {
    let place = place_with_film(&[40]);
    probe(&place, |said| {
        said["streams"][0]["codec_type"] = json!("data")
    });
    refused(&place, &FILM, &["film.mp4", "no moving pictures"]);
    assert!(!place.path("house").exists());
    let photo = ["prepare", "photos/00.png", "-o", "house"];
    refused(&place, &photo, &["00.png", "is a photo", "folder"]);
    probe(&place, |_| {});
    place.write("fake/tiny", vec![0; 64 * 36 * 20]);
    refused(&place, &FILM, &["film.mp4", "only black"]);
    place.write("fake/ffmpeg-version", "4.4.2");
    refused(&place, &FILM, &["ffmpeg 4.4 is too old", "5.1"]);
    let place = place_with(&["colmap"]);
    place.write("film.mp4", "a film");
    refused(
        &place,
        &FILM,
        &["ffmpeg is not installed", "apt-get install ffmpeg"],
    );
    version(&place, "4.0");
}
