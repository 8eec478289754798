//! `gs-chroma view --paint`: strokes are kept at once, the scene follows, the run stays until it is
//! saved.

use std::time::{Duration, Instant};

use gs_chroma::color::{ciede2000, srgb_to_lab};
use serde_json::{Value, json};

use super::{
    program::{Place, files_below},
    shared::onnx,
    view_page::{Page, looked_at_by, parts},
};

/// A violet that nothing in the bundled garden has.
const VIOLET: [u8; 3] = [152, 78, 184];

/// Mean ΔE00 over all photos between the colors that settle while painting and those of `colorize`
/// with the same strokes.
const NEAR: f64 = 0.5;

/// A quickly colored run of the bundled photos.
fn garden() -> Place {
    let place = Place::new();
    let photos = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo");
    let fit = ["fit", photos, "-o", "runs/garden", "--preset", "draft"];
    let short = ["--iterations", "60", "--max-side", "108"];
    let few = ["--max-splats", "2500", "--no-fill-gaps"];
    place.succeed(&[&fit[..], &short, &few].concat());
    let teacher = onnx("ddcolor_tiny.onnx");
    place.succeed(&["colorize", "runs/garden", "--teacher", &teacher]);
    place
}

/// A page to paint on.
struct Easel {
    page: Page,
    secret: String,
}

impl Easel {
    fn of(place: &Place) -> Self {
        let (page, line) = Page::and_line(place, &["runs/garden", "--paint"]);
        let secret = secret_in(&line);
        Self { page, secret }
    }

    fn post(&self, what: &str, body: &Value) -> u16 {
        let host = format!("127.0.0.1:{}", self.page.port);
        let own = format!("Origin: http://{host}\r\nX-Secret: {}\r\n", self.secret);
        self.post_with(what, &own, body)
    }

    /// What is answered to something that is sent.
    fn answer(&self, what: &str, body: &Value) -> Value {
        let host = format!("127.0.0.1:{}", self.page.port);
        let own = format!("Origin: http://{host}\r\nX-Secret: {}\r\n", self.secret);
        let (code, answer) = self.sent(what, &own, body);
        assert_eq!(code, 200, "{}", String::from_utf8_lossy(&answer));
        serde_json::from_slice(&answer).expect("JSON")
    }

    fn post_with(&self, what: &str, headers: &str, body: &Value) -> u16 {
        self.sent(what, headers, body).0
    }

    fn sent(&self, what: &str, headers: &str, body: &Value) -> (u16, Vec<u8>) {
        let (host, body) = (format!("127.0.0.1:{}", self.page.port), body.to_string());
        let length = body.len();
        let head = format!(
            "POST /paint/{what} HTTP/1.1\r\nHost: {host}\r\n{headers}Content-Length: {length}\r\n\r\n"
        );
        parts(&self.page.send((head + &body).as_bytes()))
    }

    fn news(&self, version: u64) -> Value {
        let (code, body) = self.page.get(&format!("/paint/news/{version}"));
        assert_eq!(code, 200);
        serde_json::from_slice(&body).expect("JSON")
    }

    /// The news once the colors are in a phase.
    fn once(&self, phase: &str) -> Value {
        let (begun, mut version) = (Instant::now(), 0);
        loop {
            let news = self.news(version);
            if news["state"]["phase"] == phase {
                return news;
            }
            assert_ne!(news["state"]["phase"], "failed", "{news}");
            assert!(begun.elapsed() < Duration::from_secs(120), "{news}");
            version = news["version"].as_u64().expect("a number");
        }
    }

    /// A photo as the page shows it, in CIELAB.
    fn photo(&self, what: &str, photo: usize) -> Vec<[f64; 3]> {
        let (code, body) = self.page.get(&format!("/paint/{what}/{photo}"));
        assert_eq!(code, 200, "{what} {photo}");
        let picture = image::load_from_memory(&body)
            .expect("a picture")
            .into_rgb8();
        let lab = |rgb: &image::Rgb<u8>| srgb_to_lab(rgb.0.map(|v| f64::from(v) / 255.0));
        picture.pixels().map(lab).collect()
    }

    fn photos(&self) -> Vec<Vec<[f64; 3]>> {
        let about = self.page.about();
        let count = about["paint"]["photos"].as_array().expect("photos").len();
        (0..count).map(|k| self.photo("photo", k)).collect()
    }
}

/// The secret in an address.
pub fn secret_in(line: &str) -> String {
    let secret = line.split('#').nth(1);
    let secret = secret.and_then(|rest| rest.split(' ').next());
    secret.expect("a secret in the address").to_owned()
}

/// Across the pumpkin of the third photo, which is 108 × 72.
fn across_pumpkin() -> Vec<[f32; 3]> {
    (0..12).map(|k| [63.0 + k as f32, 62.0, 1.5]).collect()
}

fn on_pumpkin(paint: Value) -> Value {
    json!({ "photo": 2, "paint": paint, "points": across_pumpkin() })
}

/// All files of the run but those of painting and the answers that are kept.
fn of_run(place: &Place) -> Vec<(String, Vec<u8>)> {
    let mut files = files_below(&place.path("runs/garden"));
    files.retain(|(name, _)| {
        !["paint/", "teacher/"]
            .iter()
            .any(|own| name.starts_with(own))
    });
    files
}

fn mean_delta(a: &[Vec<[f64; 3]>], b: &[Vec<[f64; 3]>]) -> f64 {
    let pairs = a.iter().zip(b).flat_map(|(a, b)| a.iter().zip(b));
    let deltas: Vec<f64> = pairs.map(|(&a, &b)| ciede2000(a, b)).collect();
    deltas.iter().sum::<f64>() / deltas.len() as f64
}

#[test]
fn the_scene_follows_strokes_which_outlive_a_crash_and_the_run_stays_until_it_is_saved() {
    let place = garden();
    let before = of_run(&place);
    let easel = Easel::of(&place);
    easel.once("ready");
    // Only the page may send anything.
    let host = format!("Origin: http://127.0.0.1:{}\r\n", easel.page.port);
    let stroke = on_pumpkin(json!({ "color": VIOLET }));
    assert_eq!(easel.post_with("stroke", &host, &stroke), 403);
    let foreign = format!(
        "Origin: http://evil.example\r\nX-Secret: {}\r\n",
        easel.secret
    );
    assert_eq!(easel.post_with("stroke", &foreign, &stroke), 403);
    for wrong in [
        json!({}),
        json!({ "photo": 99, "paint": "nothing", "points": [[1, 1, 1]] }),
        json!({ "photo": 2, "paint": "teacher", "points": [] }),
    ] {
        assert_eq!(easel.post("stroke", &wrong), 400);
    }
    assert_eq!(easel.page.get("/paint/photo/99").0, 404);
    assert_eq!(easel.page.get("/paint/layer/2").0, 404);
    // Nobody else paints on it meanwhile.
    let second = place.run(&["view", "runs/garden", "--paint", "--no-open"]);
    assert_eq!(second.code, Some(1));
    assert!(second.stderr.contains("process "), "{}", second.stderr);

    let plain = easel.photos();
    assert_eq!(easel.post("stroke", &stroke), 200);
    // Before anything is solved.
    assert!(
        place
            .path("runs/garden/paint/hints/garden_02.jpg.png")
            .is_file()
    );
    let settled = easel.once("settled");
    assert_eq!(settled["painted"], json!([2]));
    assert_eq!(settled["palette"], json!([VIOLET]));
    let painted = easel.photos();
    let pixel = 62 * 108 + 68;
    let moved = ciede2000(plain[2][pixel], painted[2][pixel]);
    assert!(moved > 10.0, "{moved}");
    assert!(mean_delta(&plain, &painted) > 0.2, "other photos follow");

    assert_eq!(easel.post("undo", &json!({})), 200);
    let undone = easel.news(settled["version"].as_u64().expect("a number"));
    assert_eq!((&undone["undo"], &undone["redo"]), (&json!(0), &json!(1)));
    assert!(
        !place
            .path("runs/garden/paint/hints/garden_02.jpg.png")
            .exists()
    );
    easel.once("settled");
    let apart = mean_delta(&plain, &easel.photos());
    assert!(apart < NEAR, "{apart}");
    assert_eq!(easel.post("redo", &json!({})), 200);
    assert!(of_run(&place) == before, "the run is as it was");

    // It is killed; what was painted is there again.
    drop(easel);
    let log = String::from_utf8(place.read("runs/garden/paint/log.jsonl")).expect("text");
    let acts: Vec<Value> = log
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let acts: Vec<&str> = acts
        .iter()
        .filter_map(|entry| entry["act"].as_str())
        .collect();
    assert_eq!(acts, ["paint", "undo", "redo"]);
    let easel = Easel::of(&place);
    let ready = easel.once("ready");
    assert_eq!(ready["painted"], json!([2]));
    // What was done before can still be undone.
    assert_eq!((&ready["undo"], &ready["redo"]), (&json!(1), &json!(0)));
    let hint = place.path("runs/garden/paint/hints/garden_02.jpg.png");
    let layer = std::fs::read(&hint).expect("the strokes");
    assert_eq!(easel.post("undo", &json!({})), 200);
    assert!(!hint.exists());
    assert_eq!(easel.post("redo", &json!({})), 200);
    assert!(std::fs::read(&hint).expect("the strokes") == layer);
    easel.once("settled");
    let again = easel.photos();
    // Each is as near to what is saved in the end.
    let apart = mean_delta(&painted, &again);
    assert!(apart < 2.0 * NEAR, "{apart}");
    assert!(of_run(&place) == before, "the run is as it was");

    // Saving is the command that the page shows.
    assert_eq!(easel.post("save", &json!({})), 200);
    let command = easel.once("saved")["command"].clone();
    let apart = mean_delta(&again, &easel.photos());
    assert!(apart < NEAR, "{apart}");
    let saved = place.read("runs/garden/chroma.npy");
    drop(easel);
    let command = command.as_str().expect("a command");
    let words: Vec<&str> = command.split(' ').skip(1).collect();
    place.succeed(&words);
    assert!(place.read("runs/garden/chroma.npy") == saved);
}

/// Opaque pixels of a photo's strokes.
fn painted(place: &Place, photo: &str) -> Vec<(u32, u32, [u8; 3])> {
    let path = place.path("runs/garden/paint/hints").join(photo);
    let Ok(layer) = image::open(path) else {
        return Vec::new();
    };
    let layer = layer.into_rgba8();
    let pixels = layer
        .enumerate_pixels()
        .filter(|(.., pixel)| pixel.0[3] > 128);
    pixels
        .map(|(x, y, pixel)| (x, y, [pixel.0[0], pixel.0[1], pixel.0[2]]))
        .collect()
}

#[test]
fn strokes_on_the_scene_come_to_photos_and_the_command_is_as_it_was_chosen() {
    let place = garden();
    let easel = Easel::of(&place);
    let ready = easel.once("ready");
    let photo = "garden_02.jpg.png";
    // From where the third photo was taken, a stroke on the scene is one on that photo.
    let mut camera = easel.page.about()["cameras"][2].clone();
    for key in ["name", "split", "psnr"] {
        camera.as_object_mut().expect("a camera").remove(key);
    }
    let points = across_pumpkin();
    let stroke = json!({ "camera": camera, "paint": { "color": VIOLET }, "points": points });
    let found = easel.answer("view-stroke", &stroke)["photos"].as_u64();
    assert!((1..=3).contains(&found.expect("a number")), "{found:?}");
    let projected = painted(&place, photo);
    let settled = easel.once("settled");
    assert_eq!(settled["undo"], 1);
    assert_eq!(
        settled["painted"].as_array().map(Vec::len),
        found.map(|n| n as usize)
    );
    assert_eq!(easel.post("undo", &json!({})), 200);
    assert!(painted(&place, photo).is_empty());
    assert_eq!(
        easel.post("stroke", &on_pumpkin(json!({ "color": VIOLET }))),
        200
    );
    let direct = painted(&place, photo);
    let same = |a: &(u32, u32, [u8; 3])| direct.iter().any(|b| (a.0, a.1) == (b.0, b.1));
    let both = projected.iter().filter(|pixel| same(pixel)).count();
    let all = projected.len() + direct.len() - both;
    assert!(2 * both > all, "{both} of {all}");
    // From behind a wall nothing can be painted, and by no camera either.
    let mut away = stroke.clone();
    away["camera"]["translation"] = json!([0, 0, -1000]);
    assert_eq!(easel.answer("view-stroke", &away)["photos"], 0);
    away["camera"]["rotation"] = json!([1, 1, 1, 1, 1, 1, 1, 1, 1]);
    assert_eq!(easel.post("view-stroke", &away), 400);

    // The teacher's colors where they are to be kept.
    assert_eq!(easel.post("stroke", &on_pumpkin(json!("teacher"))), 200);
    let (_, png) = easel.page.get("/paint/teacher/2");
    let teacher = image::load_from_memory(&png)
        .expect("a picture")
        .into_rgb8();
    // Under the middle of the brush, where nothing of the stroke before is left.
    let kept = painted(&place, photo);
    let middle = kept.iter().find(|(x, y, _)| (*x, *y) == (68, 61));
    assert_eq!(
        middle.map(|(.., color)| *color),
        Some(teacher.get_pixel(68, 61).0)
    );

    let mut choices = ready["choices"].clone();
    choices["strength"] = json!(0.5);
    choices["robust"] = json!(null);
    choices["sh_degree"] = json!(1);
    assert_eq!(easel.post("choices", &choices), 200);
    let command = easel.news(0)["command"]
        .as_str()
        .expect("a command")
        .to_owned();
    for words in [
        "--strength 0.5",
        "--robust off",
        "--sh-degree 1",
        "--hints ",
    ] {
        assert!(command.contains(words), "{command}");
    }
    choices["strength"] = json!(7);
    assert_eq!(easel.post("choices", &choices), 400);
    assert_eq!(easel.post("save", &json!({})), 200);
    easel.once("saved");
    drop(easel);
    let chroma = place.report("runs/garden")["chroma"].clone();
    assert_eq!(chroma["strength"], 0.5);
    assert_eq!(chroma["settings"]["sh_degree"], 1);
    assert_eq!(chroma["settings"]["robust"], json!(null));
}

/// Colors of a pixel that are plainly others.
fn differs(a: &Value, b: &Value) -> bool {
    let rgb = |value: &Value| [0, 1, 2].map(|k| value[k].as_f64().expect("a number"));
    let lab = |value: &Value| srgb_to_lab(rgb(value).map(|v| v / 255.0));
    ciede2000(lab(a), lab(b)) > 8.0
}

#[test]
#[ignore = "needs Chromium, Node and its packages: make test-all"]
fn the_mouse_paints_and_the_keys_undo() {
    let place = garden();
    let (page, line) = Page::and_line(&place, &["runs/garden", "--paint"]);
    let url = line.split(' ').next().expect("an address");
    let found = looked_at_by("paint.mjs", &[url]);
    assert!(differs(&found["before"], &found["painted"]), "{found}");
    assert!(!differs(&found["before"], &found["undone"]), "{found}");
    drop(page);
    assert!(
        place
            .path("runs/garden/paint/hints/garden_02.jpg.png")
            .is_file()
    );
}

#[test]
fn a_stroke_that_one_of_its_photos_cannot_take_leaves_all_as_they_were() {
    let place = garden();
    let easel = Easel::of(&place);
    easel.once("ready");
    let mut camera = easel.page.about()["cameras"][2].clone();
    for key in ["name", "split", "psnr"] {
        camera.as_object_mut().expect("a camera").remove(key);
    }
    let points = across_pumpkin();
    let stroke = json!({ "camera": camera, "paint": { "color": VIOLET }, "points": points });
    easel.answer("view-stroke", &stroke);
    let photos = easel.news(0)["painted"].clone();
    let photos = photos.as_array().expect("photos");
    let other = photos.iter().filter_map(Value::as_u64).find(|&k| k != 2);
    let other = other.expect("a second photo");
    let about = easel.page.about();
    let name = about["paint"]["photos"][other as usize]["name"]
        .as_str()
        .expect("a name");
    assert_eq!(easel.post("undo", &json!({})), 200);

    // What cannot be replaced by a file: a folder that is not empty. The third photo comes first.
    let hints = place.path("runs/garden/paint/hints");
    let taken = hints.join(format!("{name}.png"));
    std::fs::create_dir(&taken).expect("a folder");
    std::fs::write(taken.join("x"), "x").expect("a file");
    assert_eq!(easel.post("view-stroke", &stroke), 500);
    let left = || std::fs::read_dir(&hints).expect("a folder").count();
    assert_eq!(left(), 1);
    let news = easel.news(0);
    assert_eq!((&news["undo"], &news["painted"]), (&json!(0), &json!([])));
    // Also after a restart.
    drop(easel);
    let easel = Easel::of(&place);
    assert_eq!(easel.once("ready")["undo"], 0);
    std::fs::remove_dir_all(&taken).expect("removed");
    assert_eq!(easel.post("view-stroke", &stroke), 200);
    assert_eq!(
        (left(), easel.news(0)["undo"].clone()),
        (photos.len(), json!(1))
    );
}
