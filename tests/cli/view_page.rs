//! `gs-chroma view`, scene.html and `fit --view`: what the server answers to whom, and what the
//! page draws.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use serde_json::Value;

#[cfg(unix)]
use super::program::{Signal, send};
use super::{
    program::Place,
    shared::{onnx, place_with_run, place_with_scene},
};

/// A page that is served, until it is dropped.
pub struct Page {
    program: Child,
    pub port: u16,
}

impl Drop for Page {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

impl Page {
    /// `gs-chroma view` with these arguments.
    fn of(place: &Place, arguments: &[&str]) -> Self {
        Self::and_line(place, arguments).0
    }

    /// The same with the line that names its address.
    pub fn and_line(place: &Place, arguments: &[&str]) -> (Self, String) {
        Self::serving(place, &[&["view", "--no-open"], arguments].concat())
    }

    /// A command that serves a page, with the line that names its address.
    pub fn serving(place: &Place, arguments: &[&str]) -> (Self, String) {
        let mut command = place.command(arguments);
        let spawned = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let mut program = spawned.expect("the program starts");
        let mut line = String::new();
        let stdout = program.stdout.take().expect("a pipe");
        BufReader::new(stdout).read_line(&mut line).expect("a line");
        let port = port_in(&line);
        (Self { port, program }, line)
    }

    fn url(&self) -> String {
        format!("http://127.0.0.1:{}/", self.port)
    }

    /// Sends bytes and gives all that comes back.
    pub fn send(&self, bytes: &[u8]) -> Vec<u8> {
        let mut stream = self.connect();
        stream.write_all(bytes).expect("the page listens");
        let mut answer = Vec::new();
        // Who is refused early may be cut off.
        let _ = stream.read_to_end(&mut answer);
        answer
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).expect("the page listens");
        let wait = Some(Duration::from_secs(30));
        stream.set_read_timeout(wait).expect("a time");
        stream
    }

    /// The code and the body of a GET.
    pub fn get(&self, path: &str) -> (u16, Vec<u8>) {
        let host = format!("127.0.0.1:{}", self.port);
        parts(&self.send(format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n").as_bytes()))
    }

    pub fn about(&self) -> Value {
        let (code, body) = self.get("/scene.json");
        assert_eq!(code, 200);
        serde_json::from_slice(&body).expect("JSON")
    }
}

fn port_in(line: &str) -> u16 {
    let port = line
        .split("127.0.0.1:")
        .nth(1)
        .and_then(|rest| rest.split('/').next());
    let port = port.and_then(|port| port.parse().ok());
    port.unwrap_or_else(|| panic!("names a port: {line}"))
}

pub fn parts(answer: &[u8]) -> (u16, Vec<u8>) {
    let end = answer.windows(4).position(|end| end == b"\r\n\r\n");
    let (head, body) = answer.split_at(end.expect("a head") + 4);
    let head = String::from_utf8_lossy(head);
    let code = head.split(' ').nth(1).and_then(|code| code.parse().ok());
    (code.expect("a code"), body.to_vec())
}

#[test]
fn a_run_is_served_and_nothing_beside_it() {
    let place = place_with_run();
    place.write("secret", "not to be seen");
    place.write("runs/scene/secret", "not to be seen");
    let page = Page::of(&place, &["runs/scene"]);
    let (code, body) = page.get("/");
    assert_eq!(code, 200);
    assert!(String::from_utf8_lossy(&body).contains("viewer.js"));
    let about = page.about();
    assert_eq!(about["name"], "scene");
    assert_eq!(about["scenes"], serde_json::json!(["color", "luma"]));
    let cameras = about["cameras"].as_array().expect("cameras");
    assert!(!cameras.is_empty());
    for kind in ["color", "luma"] {
        let (code, body) = page.get(&format!("/scene/{kind}"));
        assert_eq!((code, &body[..4]), (200, &b"GSCV"[..]), "{kind}");
    }
    let (code, photo) = page.get("/photo/0");
    assert_eq!((code, &photo[1..4]), (200, &b"PNG"[..]));
    let (code, teacher) = page.get("/teacher/0");
    assert_eq!((code, &teacher[1..4]), (200, &b"PNG"[..]));

    let beyond = format!("/photo/{}", cameras.len());
    for path in [
        "/../secret",
        "/../../etc/passwd",
        "/secret",
        "/scene/../secret",
        "/photo/../secret",
        "/photo/-1",
        "/photo/0/..",
        "/%2e%2e/secret",
        "//etc/passwd",
        "/report.json",
        "/luma.ply",
        "file:///etc/passwd",
        &beyond,
        "/photo/99999999999999999999999",
    ] {
        let (code, body) = page.get(path);
        assert_eq!(code, 404, "{path}");
        assert_eq!(body, b"not found", "{path}");
    }
}

#[test]
fn only_this_machine_under_its_own_name_may_ask() {
    let place = place_with_run();
    let page = Page::of(&place, &["runs/scene/color.ply"]);
    let ask = |request: &str| page.send(request.as_bytes());
    for host in ["evil.example", "127.0.0.1", "localhost:1"] {
        let (code, _) = parts(&ask(&format!(
            "GET /scene.json HTTP/1.1\r\nHost: {host}\r\n\r\n"
        )));
        assert_eq!(code, 421, "{host}");
    }
    let host = format!("localhost:{}", page.port);
    for method in ["POST", "PUT", "DELETE", "OPTIONS", "HEAD"] {
        let (code, _) = parts(&ask(&format!(
            "{method} / HTTP/1.1\r\nHost: {host}\r\n\r\n"
        )));
        assert_eq!(code, 405, "{method}");
    }
    assert_eq!(parts(&ask("\0\0\0\r\n\r\n")).0, 400);
    let long = format!(
        "GET /{} HTTP/1.1\r\nHost: {host}\r\n\r\n",
        "a".repeat(40_000)
    );
    // What is not heard to its end may be cut off before the answer is read.
    let answer = ask(&long);
    assert!(answer.is_empty() || parts(&answer).0 == 431);
    let answer = ask(&format!("GET / HTTP/1.1\r\nHost: {host}\r\n\r\n"));
    let head = String::from_utf8_lossy(&answer).into_owned();
    for header in [
        "Content-Security-Policy: default-src 'none'",
        "X-Content-Type-Options: nosniff",
        "Cross-Origin-Resource-Policy: same-origin",
    ] {
        assert!(head.contains(header), "{header}");
    }
    assert!(!head.contains("Access-Control"));
    // What is known already is not sent once more.
    let (_, body) = page.get("/scene.json");
    let head = ask(&format!("GET /scene.json HTTP/1.1\r\nHost: {host}\r\n\r\n"));
    let head = String::from_utf8_lossy(&head).into_owned();
    let tag = head
        .lines()
        .find_map(|line| line.strip_prefix("ETag: "))
        .expect("a tag");
    let again = format!("GET /scene.json HTTP/1.1\r\nHost: {host}\r\nIf-None-Match: {tag}\r\n\r\n");
    let (code, rest) = parts(&ask(&again));
    assert_eq!((code, rest.len()), (304, 0));
    assert!(!body.is_empty());
    // A file has no cameras and no photos, and is seen all the same.
    let about = page.about();
    assert_eq!(about["cameras"], serde_json::json!([]));
    assert!(about["start"]["fx"].is_number() && about["near"].is_number());
    assert_eq!(page.get("/photo/0").0, 404);
}

#[test]
fn who_is_slow_or_leaves_keeps_nobody_waiting() {
    let place = place_with_run();
    let page = Page::of(&place, &["runs/scene"]);
    // Many that say nothing, or begin and leave.
    let silent: Vec<TcpStream> = (0..20).map(|_| page.connect()).collect();
    for _ in 0..20 {
        let mut stream = page.connect();
        stream
            .write_all(b"GET /scene/color HTTP/1.1\r\nHo")
            .expect("heard");
    }
    let begun = Instant::now();
    assert_eq!(page.get("/").0, 200);
    assert!(
        begun.elapsed() < Duration::from_secs(5),
        "{:?}",
        begun.elapsed()
    );
    // They are given up after a while.
    let mut rest = Vec::new();
    let mut first = silent.into_iter().next().expect("one");
    let _ = first.read_to_end(&mut rest);
    assert!(
        begun.elapsed() < Duration::from_secs(20),
        "{:?}",
        begun.elapsed()
    );
    assert!(rest.is_empty());
}

#[test]
fn a_port_that_is_taken_is_named() {
    let place = place_with_run();
    let page = Page::of(&place, &["runs/scene"]);
    let port = page.port.to_string();
    let done = place.run(&["view", "runs/scene", "--no-open", "--port", &port]);
    assert_eq!(done.code, Some(1));
    assert!(
        done.stderr
            .contains(&format!("port {port} of 127.0.0.1 cannot be used")),
        "{}",
        done.stderr
    );
    assert!(
        done.stderr.contains("choose another --port"),
        "{}",
        done.stderr
    );
    // Before a training begins.
    let done = place.run(&["fit", "scene", "-o", "other", "--view", "--port", &port]);
    assert_eq!(done.code, Some(1));
    assert!(!place.path("other").exists());
}

#[cfg(unix)]
#[test]
fn ctrl_c_is_how_it_ends() {
    let place = place_with_run();
    // Its first line may be answered at once: it heeds the signal by then, in every try.
    for _ in 0..5 {
        let mut page = Page::of(&place, &["runs/scene"]);
        send(Signal::SIGINT, page.program.id());
        let status = page.program.wait().expect("it ends");
        assert_eq!(status.code(), Some(0));
    }
}

/// Files of a run without what times are in.
fn bytes_of(place: &Place, run: &str) -> Vec<(String, Vec<u8>)> {
    let names = place.files(run).into_iter();
    let kept = names.filter(|name| {
        name.ends_with(".ply") || name.ends_with(".npy") && !name.contains("teacher")
    });
    kept.map(|name| (name.clone(), place.read(&format!("{run}/{name}"))))
        .collect()
}

/// Runs a command with `--view`, with somebody who looks on and leaves again and again; gives
/// how many scenes were seen.
fn watched(place: &Place, arguments: &[&str]) -> usize {
    let mut command = place.command(&[arguments, &["--view"]].concat());
    // No browser of the tests' user.
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    let spawned = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
    let mut program = spawned.expect("the program starts");
    let mut stderr = BufReader::new(program.stderr.take().expect("a pipe"));
    let mut line = String::new();
    while !line.contains("127.0.0.1:") {
        line.clear();
        assert!(
            stderr.read_line(&mut line).expect("text") > 0,
            "it names its page"
        );
    }
    // What it says else must not fill the pipe.
    std::thread::spawn(move || std::io::copy(&mut stderr, &mut std::io::sink()));
    let port = port_in(&line);
    let mut page = Page { program, port };
    let mut seen = 0;
    while page.program.try_wait().expect("a status").is_none() {
        let Ok(mut stream) = TcpStream::connect(("127.0.0.1", port)) else {
            break;
        };
        for path in ["/scene.json", "/scene/luma", "/scene/color", "/photo/0"] {
            let host = format!("Host: 127.0.0.1:{port}\r\n\r\n");
            let Ok(mut whole) = TcpStream::connect(("127.0.0.1", port)) else {
                break;
            };
            let _ = whole.write_all(format!("GET {path} HTTP/1.1\r\n{host}").as_bytes());
            let mut answer = Vec::new();
            let _ = whole.read_to_end(&mut answer);
            seen += usize::from(answer.windows(4).any(|bytes| bytes == b"GSCV"));
            // One that leaves in the middle.
            let _ = stream.write_all(format!("GET {path} HTTP/1.1\r\n").as_bytes());
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let status = page.program.wait().expect("it ends");
    assert!(status.success(), "{arguments:?}");
    seen
}

#[test]
fn who_looks_on_changes_nothing() {
    let place = place_with_scene();
    let fit = [
        "fit",
        "scene",
        "--preset",
        "draft",
        "--iterations",
        "100",
        "--without",
        "background",
    ];
    let teacher = onnx("ddcolor_tiny.onnx");
    let colorize = |run| ["colorize", run, "--rounds", "6", "--teacher", &teacher];
    place.succeed(&[&fit[..], &["-o", "alone"]].concat());
    place.succeed(&colorize("alone"));
    let mut seen = watched(&place, &[&fit[..], &["-o", "watched"]].concat());
    seen += watched(&place, &colorize("watched"));
    assert!(seen > 0, "a scene was seen on the way");
    assert_eq!(bytes_of(&place, "alone"), bytes_of(&place, "watched"));
    let [mut alone, mut watched] = ["alone", "watched"].map(|run| place.report(run));
    for report in [&mut alone, &mut watched] {
        // Times, memory and stamps of files are the machine's.
        strip(report);
    }
    assert_eq!(alone, watched);
}

fn strip(value: &mut Value) {
    match value {
        Value::Object(fields) => {
            let own = ["seconds", "memory", "stamp"];
            fields.retain(|name, _| !own.iter().any(|own| name.contains(own)));
            fields.values_mut().for_each(strip);
        }
        Value::Array(items) => items.iter_mut().for_each(strip),
        _ => {}
    }
}

/// Node's scripts that open pages.
const SCRIPTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tools/viewers");

/// Findings of the browser at a page.
fn looked_at(arguments: &[&str]) -> Value {
    looked_at_by("page.mjs", arguments)
}

/// The same by another script.
pub fn looked_at_by(script: &str, arguments: &[&str]) -> Value {
    let done = Command::new("node")
        .arg(std::path::Path::new(SCRIPTS).join(script))
        .args(arguments)
        .output()
        .expect("node");
    let text = String::from_utf8_lossy(&done.stdout).into_owned();
    assert!(
        done.status.success(),
        "{text}{}",
        String::from_utf8_lossy(&done.stderr)
    );
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// The least PSNR of the page's pictures beside those of `render`, in dB.
const LIKE: f64 = 50.0;

#[test]
fn a_page_is_no_splat_file() {
    let place = place_with_run();
    let export = ["export", "runs/scene", "-o", "new/scene.html", "--json"];
    let wrote = place.json(&export);
    let bytes = place.read("new/scene.html").len() as u64;
    assert_eq!(wrote["bytes"].as_u64(), Some(bytes), "{wrote}");
    let done = place.run(&[&export[..], &["--viewer", "any", "--colmap-coordinates"]].concat());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    for option in ["--viewer", "--colmap-coordinates"] {
        let told = format!("warning: {option} is for splat files");
        assert!(done.stderr.contains(&told), "{}", done.stderr);
    }
}

#[test]
#[ignore = "needs Chromium, Node and its packages: make test-all"]
fn the_page_draws_what_render_draws() {
    let place = place_with_run();
    place.succeed(&["render", "runs/scene", "--views", "all", "-o", "pictures"]);
    let pictures = place.path("pictures");
    let pictures = pictures.to_str().expect("a path");
    let page = Page::of(&place, &["runs/scene"]);
    let found = looked_at(&[&page.url(), "--reference", pictures, "--turn", "2"]);
    place.succeed(&["export", "runs/scene", "-o", "scene.html"]);
    let url = format!("file://{}", place.path("scene.html").display());
    let sent = looked_at(&[&url, "--reference", pictures]);
    let count = page.about()["cameras"].as_array().map_or(0, Vec::len);
    for found in [found, sent] {
        let psnr = found["psnr"].as_object().expect("pictures");
        assert_eq!(psnr.len(), count);
        for (name, psnr) in psnr {
            assert!(
                psnr.as_f64().is_some_and(|psnr| psnr >= LIKE),
                "{name}: {psnr}"
            );
        }
    }
}
