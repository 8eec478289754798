//! `gs-chroma studio`: its page starts the program's commands, shows them, and nothing else.

use std::{
    io::{Read, Write},
    net::TcpStream,
    time::{Duration, Instant},
};

use serde_json::{Value, json};

use super::{
    paint::secret_in,
    program::Place,
    shared::{onnx, place_with_run, place_with_scene},
    view_page::{Page, looked_at_by, parts},
};

/// A studio of a place.
struct Desk {
    page: Page,
    secret: String,
}

impl Desk {
    fn of(place: &Place) -> Self {
        let (page, line) = Page::serving(place, &["studio", "--no-open"]);
        let secret = secret_in(&line);
        Self { page, secret }
    }

    fn post(&self, path: &str, body: &Value) -> (u16, String) {
        let own = format!("127.0.0.1:{}", self.page.port);
        self.post_as(path, &own, &format!("http://{own}"), &self.secret, body)
    }

    fn post_as(
        &self,
        path: &str,
        host: &str,
        origin: &str,
        secret: &str,
        body: &Value,
    ) -> (u16, String) {
        let body = body.to_string();
        let length = body.len();
        let head = format!(
            "POST {path} HTTP/1.1\r\nHost: {host}\r\nOrigin: {origin}\r\nX-Secret: {secret}\r\nContent-Length: {length}\r\n\r\n"
        );
        let (code, answer) = parts(&self.page.send((head + &body).as_bytes()));
        (code, String::from_utf8_lossy(&answer).into_owned())
    }

    fn ask(&self, body: Value) {
        let (code, answer) = self.post("/do", &body);
        assert_eq!(code, 200, "{body}: {answer}");
    }

    /// The news once they are as they should be.
    fn once(&self, wanted: impl Fn(&Value) -> bool) -> Value {
        let (begun, mut version) = (Instant::now(), json!(0));
        loop {
            let (code, news) = self.post("/news", &version);
            assert_eq!(code, 200, "{news}");
            let news: Value = serde_json::from_str(&news).expect("JSON");
            if wanted(&news) {
                return news;
            }
            assert!(begun.elapsed() < Duration::from_secs(300), "{news}");
            version = news["version"].clone();
        }
    }
}

#[test]
fn a_job_is_started_stopped_and_resumed_and_its_results_are_handed_out() {
    let place = place_with_scene();
    let desk = Desk::of(&place);
    let make = json!({
        "do": "make", "input": "scene", "name": "house", "teacher": onnx("ddcolor_tiny.onnx"),
        "preset": "draft", "options": "--no-eval",
    });
    desk.ask(make.clone());
    // The same name again, and another job beside it.
    assert_eq!(desk.post("/do", &make).0, 400);
    let mut other = make;
    other["name"] = json!("other");
    let (code, why) = desk.post("/do", &other);
    assert!(code == 400 && why.contains("another job goes on"), "{why}");
    assert!(!place.path("runs/other").exists());

    let begun = |news: &Value| {
        news["jobs"][0]["step"]
            .as_str()
            .is_some_and(|step| !step.is_empty())
    };
    let news = desk.once(begun);
    let command = news["jobs"][0]["command"].as_str().expect("a command");
    assert!(command.starts_with("gs-chroma auto "), "{command}");
    // The scene can be watched as it grows.
    let url = news["jobs"][0]["url"].as_str().expect("an address");
    let host = url.trim_end_matches('/').trim_start_matches("http://");
    let mut live = TcpStream::connect(host).expect("the page listens");
    write!(live, "GET /scene.json HTTP/1.1\r\nHost: {host}\r\n\r\n").expect("sent");
    let mut answer = Vec::new();
    live.read_to_end(&mut answer).expect("an answer");
    assert_eq!(parts(&answer).0, 200);
    let number = &news["jobs"][0]["number"];
    desk.ask(json!({ "do": "stop", "job": number }));
    desk.once(|news| news["jobs"][0]["phase"] == "stopped");
    // It is on the list also of a studio that was opened later.
    drop(desk);
    let desk = Desk::of(&place);
    let news = desk.once(|news| news["runs"][0]["name"] == "house");
    let id = news["runs"][0]["id"].clone();
    assert_eq!(news["runs"][0]["resumes"], true);
    desk.ask(json!({ "do": "resume", "run": id }));
    let news = desk.once(|news| news["jobs"][0]["phase"] != "going");
    assert_eq!(news["jobs"][0]["phase"], "done", "{news}");
    let run = &news["runs"][0];
    assert_eq!(
        (&run["colored"], &run["gray"]),
        (&json!(true), &json!(true))
    );

    desk.ask(json!({ "do": "export", "run": id, "format": "spz" }));
    let news = desk.once(|news| news["jobs"][0]["phase"] == "done");
    let files = news["runs"][0]["files"].as_array().expect("files").clone();
    let place_of = |name: &str| files.iter().position(|file| file["name"] == name);
    assert!(place_of("house.spz").is_some(), "{files:?}");
    let (id, scene) = (id.as_str().expect("an id"), place_of("scene.ply"));
    let (code, ply) = desk
        .page
        .get(&format!("/file/{id}/{}", scene.expect("a file")));
    assert!(code == 200 && ply.starts_with(b"ply\n"));
    let (code, png) = desk.page.get(&format!("/picture/{id}/1"));
    assert_eq!((code, &png[1..4]), (200, &b"PNG"[..]));

    // The page of the run is that of `view`.
    desk.ask(json!({ "do": "view", "run": id }));
    let news = desk.once(|news| news["jobs"][0]["url"].is_string());
    let url = news["jobs"][0]["url"].as_str().expect("an address");
    assert!(
        url.starts_with("http://127.0.0.1:") && !url.contains('#'),
        "{url}"
    );
    desk.ask(json!({ "do": "stop", "job": news["jobs"][0]["number"] }));
    desk.once(|news| news["jobs"][0]["phase"] == "stopped");
}

#[test]
fn nobody_else_starts_anything_and_no_path_leads_out() {
    let place = place_with_run();
    place.write("secret.ply", "not to be seen");
    #[cfg(unix)]
    std::os::unix::fs::symlink(
        place.path("secret.ply"),
        place.path("runs/scene/linked.ply"),
    )
    .expect("a link");
    let desk = Desk::of(&place);
    let own = format!("127.0.0.1:{}", desk.page.port);
    let origin = format!("http://{own}");
    let view = json!({ "do": "fetch", "teacher": "none" });
    for (host, from, secret, code) in [
        ("evil.example", &*origin, &*desk.secret, 421),
        (&*own, "http://evil.example", &*desk.secret, 403),
        (&*own, &*origin, "", 403),
        (&*own, &*origin, "0000", 403),
    ] {
        for path in ["/do", "/news"] {
            assert_eq!(
                desk.post_as(path, host, from, secret, &view).0,
                code,
                "{host} {from}"
            );
        }
    }
    // What goes on is not told without the secret.
    assert_eq!(desk.page.get("/news").0, 404);
    let news = desk.once(|_| true);
    assert_eq!(news["jobs"], json!([]));
    let id = news["runs"][0]["id"].as_str().expect("a run").to_owned();
    let files = news["runs"][0]["files"].as_array().expect("files");
    assert!(files.iter().any(|file| file["name"] == "luma.ply"));
    assert!(files.iter().all(|file| file["name"] != "linked.ply"));
    for path in [
        "/file/../0",
        "/file/..%2f..%2fsecret/0",
        &format!("/file/{id}/../0"),
        &format!("/file/{id}/99"),
        &format!("/file/{id}/-1"),
        &format!("/picture/{id}/secret.ply"),
        "/secret.ply",
        "/runs/scene/report.json",
    ] {
        assert_eq!(desk.page.get(path).0, 404, "{path}");
    }
    for wrong in [
        json!({ "do": "view", "run": "../scene" }),
        json!({ "do": "view", "run": "/etc" }),
        json!({ "do": "stop", "job": 7 }),
        json!({ "do": "shell", "words": ["ls"] }),
        json!({ "do": "export", "run": id, "format": "../x" }),
        json!({ "do": "make", "input": "scene", "name": "../out", "teacher": "t", "preset": null }),
        json!({ "do": "make", "input": "scene", "name": "x", "teacher": "--json", "preset": null }),
        json!({ "do": "make", "input": "scene", "name": "x", "teacher": "t", "preset": null, "options": "-o /tmp" }),
        json!({ "do": "make", "input": "gone.mp4", "name": "x", "teacher": "t", "preset": null }),
    ] {
        assert_eq!(desk.post("/do", &wrong).0, 400, "{wrong}");
    }
    assert_eq!(desk.once(|_| true)["jobs"], json!([]));
    assert!(!place.path("runs/x").exists());
}

#[test]
#[ignore = "needs Chromium, Node and its packages: make test-all"]
fn the_page_makes_a_scene_and_opens_it() {
    let place = place_with_scene();
    let (page, line) = Page::serving(&place, &["studio", "--no-open"]);
    let url = line.split(' ').next().expect("an address");
    let found = looked_at_by("studio.mjs", &[url, "scene", &onnx("ddcolor_tiny.onnx")]);
    assert_eq!(found["made"], true, "{found}");
    assert!(found["cameras"].as_u64().expect("a number") > 0, "{found}");
    drop(page);
}
