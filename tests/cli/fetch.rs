//! `teacher list` and `teacher fetch`, and colors by a network's name.

use std::{
    fs,
    io::{BufRead, BufReader},
    process::Stdio,
};

use sha2::{Digest, Sha256};

use super::host::{Answer, Host};
use super::program::{Done, Place};
use super::shared::{QUICK_FIT, onnx, place_with_scene};

/// Path of the tests' network in the cache.
const KEPT: &str = "cache/gs-chroma/teachers/small.onnx";

fn network() -> Vec<u8> {
    fs::read(onnx("ddcolor_tiny.onnx")).expect("the tests' network")
}

fn sha256(bytes: &[u8]) -> String {
    let hash = Sha256::digest(bytes);
    hash.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A table with one network, `small`, that lies at this URL.
fn write_table(place: &Place, url: &str, more: &str) {
    let sha256 = sha256(&network());
    let table = format!(
        "hosts = [\"localhost\"]\n[[teachers]]\nname = \"small\"\nabout = \"for tests\"\n\
         license = \"MIT\"\nprofile = \"ddcolor\"\nurl = \"{url}\"\nsha256 = \"{sha256}\"\n{more}"
    );
    place.write("table.toml", table);
}

/// A host with these answers at `/small.onnx`, and a table that leads there.
fn host(place: &Place, answers: Vec<Answer>) -> Host {
    let host = Host::start(place, |_| vec![("/small.onnx", answers)]);
    write_table(
        place,
        &format!("https://localhost:{}/small.onnx", host.port),
        "",
    );
    host
}

fn fetch(place: &Place, host: &Host) -> Done {
    host.run(
        place,
        &["teacher", "fetch", "small", "--yes", "--patience", "1"],
    )
}

/// Fetches it, and finds it whole.
fn assert_fetched(place: &Place, host: &Host) {
    let done = fetch(place, host);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(done.stdout.contains("small.onnx"), "{}", done.stdout);
    assert_eq!(place.read(KEPT), network());
    assert_eq!(place.files("cache/gs-chroma/teachers"), ["small.onnx"]);
}

/// Fails in one line that says these things and how to do without, and keeps nothing under
/// the network's name.
fn assert_refused(place: &Place, host: &Host, parts: &[&str]) {
    let done = fetch(place, host);
    assert_eq!(done.code, Some(1), "{}", done.stderr);
    let line = done.stderr.lines().last().unwrap_or_default();
    assert!(line.starts_with("error: "), "{line}");
    for part in parts.iter().chain(&["by other means", "small.onnx"]) {
        assert!(line.contains(part), "{part}: {line}");
    }
    assert!(!place.path(KEPT).exists());
}

#[test]
fn a_network_is_fetched_once_and_named_with_its_license() {
    let place = Place::new();
    let host = host(&place, vec![Answer::File(network())]);
    let list = || host.run(&place, &["teacher", "list"]).stdout;
    assert!(
        list().contains("small") && !list().contains("here"),
        "{}",
        list()
    );

    let unasked = host.run(&place, &["teacher", "fetch", "small"]);
    assert_eq!(unasked.code, Some(1));
    assert!(unasked.stderr.contains("--yes"), "{}", unasked.stderr);
    assert_eq!(host.asked(), []);

    let done = fetch(&place, &host);
    for part in ["for tests", "MIT", "MB", "localhost"] {
        assert!(done.stderr.contains(part), "{part}: {}", done.stderr);
    }
    assert_eq!(place.read(KEPT), network());
    assert!(list().contains("here"), "{}", list());
    let again = fetch(&place, &host);
    assert!(again.stdout.contains("is there"), "{}", again.stdout);
    assert_eq!(host.asked().len(), 1);

    let json = host.run(&place, &["teacher", "list", "--json"]).stdout;
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json[0]["teacher"]["name"], "small");
    assert_eq!(json[0]["here"], true);
}

#[test]
fn a_transfer_goes_on_where_it_was_cut_off() {
    let place = Place::new();
    let cut = |count| Answer::CutOff(network(), count);
    let host = host(&place, vec![cut(100), cut(50), Answer::File(network())]);
    assert_fetched(&place, &host);
    let from: Vec<_> = host.asked().iter().map(|(_, from)| *from).collect();
    assert_eq!(from, [0, 100, 150]);
}

#[test]
fn a_later_call_goes_on_as_well() {
    let place = Place::new();
    let host = host(&place, vec![Answer::File(network())]);
    place.write(&format!("{KEPT}.part"), &network()[..120]);
    assert_fetched(&place, &host);
    assert_eq!(host.asked(), [("/small.onnx".to_owned(), 120)]);
}

#[test]
fn a_host_that_cannot_go_on_begins_anew() {
    let place = Place::new();
    let host = host(
        &place,
        vec![Answer::CutOff(network(), 100), Answer::Always(network())],
    );
    assert_fetched(&place, &host);
}

#[test]
fn a_slow_host_is_waited_for() {
    let place = Place::new();
    let host = host(&place, vec![Answer::Slow(network())]);
    assert_fetched(&place, &host);
}

#[test]
fn a_silent_host_is_given_up_and_what_came_is_kept() {
    let place = Place::new();
    let silent = |count| Answer::Silent(network(), count);
    let host = host(&place, vec![silent(64), silent(0)]);
    assert_refused(&place, &host, &["localhost", "64 bytes are kept"]);
    let from: Vec<_> = host.asked().iter().map(|(_, from)| *from).collect();
    // What little it brings does not count.
    assert_eq!(from, [0, 64, 64]);
    assert_eq!(place.read(&format!("{KEPT}.part")), &network()[..64]);
}

#[test]
fn other_bytes_are_not_kept() {
    let place = Place::new();
    let mut wrong = network();
    wrong[40] ^= 1;
    let host = host(&place, vec![Answer::File(wrong.clone())]);
    assert_refused(&place, &host, &[&sha256(&wrong), &sha256(&network())]);
    assert_eq!(place.files("cache/gs-chroma/teachers"), [""; 0]);
}

#[test]
fn a_file_of_another_length_is_refused_before_it_comes() {
    let place = Place::new();
    let host = host(&place, vec![Answer::File(vec![0; 10_000])]);
    let url = format!("https://localhost:{}/small.onnx", host.port);
    write_table(&place, &url, &format!("bytes = {}\n", network().len()));
    assert_refused(&place, &host, &["10000 bytes"]);
}

#[test]
fn redirects_lead_to_hosts_of_the_table_only() {
    let place = Place::new();
    let host = Host::start(&place, |address| {
        vec![
            (
                "/away",
                vec![Answer::Redirect("https://example.org/x".to_owned())],
            ),
            (
                "/plain",
                vec![Answer::Redirect(address.replace("https", "http"))],
            ),
            ("/around", vec![Answer::Redirect("/around".to_owned())]),
            (
                "/here",
                vec![Answer::Redirect(format!("{address}/small.onnx"))],
            ),
            ("/small.onnx", vec![Answer::File(network())]),
        ]
    });
    for (path, part) in [
        ("away", "https://example.org/x"),
        ("plain", "http://localhost"),
        ("around", "redirects"),
        ("nowhere", "404"),
    ] {
        write_table(
            &place,
            &format!("https://localhost:{}/{path}", host.port),
            "",
        );
        assert_refused(&place, &host, &[part]);
    }
    write_table(&place, &format!("https://localhost:{}/here", host.port), "");
    assert_fetched(&place, &host);
}

#[test]
fn a_host_that_nobody_vouches_for_is_not_asked() {
    let place = Place::new();
    let host = host(&place, vec![Answer::File(network())]);
    // Another certificate takes the place of the host's own.
    let other = rcgen::generate_simple_self_signed(["localhost".to_owned()]).expect("made");
    place.write("certificate.pem", other.cert.pem());
    assert_refused(&place, &host, &["localhost", "certificate"]);
    assert_eq!(host.asked(), []);
}

#[test]
fn nobody_there() {
    let place = Place::new();
    let host = host(&place, vec![Answer::File(network())]);
    write_table(&place, "https://localhost:1/small.onnx", "");
    assert_refused(&place, &host, &["localhost:1", "HTTPS_PROXY"]);
}

/// The commands of the README for the user's own photos, without `cargo`'s: at once, and step by
/// step.
fn readme() -> [Vec<String>; 2] {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/README.md");
    let text = fs::read_to_string(path).expect("the README");
    let section = text.split("## Your own photos").nth(1).expect("a section");
    [1, 3].map(|place| {
        let block = section.split("```").nth(place).expect("a block");
        let commands = block.lines().filter_map(|line| {
            let command = line.split('#').next()?.trim();
            command.strip_prefix("gs-chroma ").map(str::to_owned)
        });
        commands.collect()
    })
}

#[test]
fn the_readmes_way_to_colors() {
    let [at_once, steps] = readme();
    let [fetch, auto] = &at_once[..] else {
        panic!("{at_once:?}");
    };
    let [_, fit, colorize, frames] = &steps[..] else {
        panic!("{steps:?}");
    };
    let name = fetch.strip_prefix("teacher fetch ").expect("a name");
    let fetch: Vec<_> = fetch.split(' ').chain(["--yes"]).collect();
    // COLMAP has been through the tests' scene already.
    let words = auto.split(' ').map(|word| match word {
        "photos/" => "scene",
        word => word,
    });
    let auto: Vec<_> = words.chain(["--json"]).collect();
    assert_eq!(fit, "fit house");
    let colorize: Vec<_> = colorize.split(' ').chain(["--json"]).collect();

    let place = place_with_scene();
    let host = host(&place, vec![Answer::File(network())]);
    let table = String::from_utf8(place.read("table.toml")).expect("text");
    let named = table.replace("name = \"small\"", &format!("name = \"{name}\""));
    place.write("table.toml", named);
    place.succeed(&QUICK_FIT);
    let early = host.run(&place, &colorize);
    assert_eq!(early.code, Some(1));
    let remedy = format!("gs-chroma teacher fetch {name}");
    assert!(early.stderr.contains(&remedy), "{}", early.stderr);

    let fetched = host.run(&place, &fetch);
    assert_eq!(fetched.code, Some(0), "{}", fetched.stderr);
    let done = host.run(&place, &colorize);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let report: serde_json::Value = serde_json::from_str(&done.stdout).expect("a report");
    let teacher = &report["chroma"]["teachers"][0];
    assert_eq!(teacher["sha256"], sha256(&network()));
    assert_eq!(teacher["kind"], "DDColor");
    let frames: Vec<_> = frames.split(' ').collect();
    let done = host.run(&place, &frames);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(place.path("colored/00.png").is_file());

    // Everything is found and opened; the steps that follow are those of tests/cli/auto.rs.
    let mut command = host.command(&place, &auto);
    let spawned = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
    let mut child = spawned.expect("the program starts");
    let told = BufReader::new(child.stderr.take().expect("a pipe")).lines();
    let begun = |line: &String| line.starts_with("step ") && line.ends_with(", fit");
    assert!(
        told.map(|line| line.expect("text"))
            .any(|line| begun(&line))
    );
    child.kill().expect("it is there");
    child.wait().expect("a child");

    let unknown = host.run(&place, &["colorize", "--teacher", "dcolor"]);
    let message = &unknown.stderr;
    assert!(
        message.contains("dcolor: no such file") && message.contains(name),
        "{message}"
    );
    // What lies under a network's name has to be it.
    let kept = format!("cache/gs-chroma/teachers/{name}.onnx");
    place.write(&kept, "something else");
    let changed = host.run(&place, &colorize);
    let message = &changed.stderr;
    assert!(message.contains(&format!("is not {name}")), "{message}");
}

#[test]
fn writes_that_fail_keep_nothing_that_is_not_whole() {
    let place = Place::new();
    let host = host(&place, (0..20).map(|_| Answer::File(network())).collect());
    let fetch_it = ["teacher", "fetch", "small", "--yes", "--patience", "1"];
    let mut struck = 0;
    for step in 1..10 {
        let mut command = host.command(&place, &fetch_it);
        let done = Done::of(
            command
                .env("GS_CHROMA_TEST_FAULT", step.to_string())
                .output(),
        );
        let whole = place.path(KEPT).exists();
        assert_eq!(done.code == Some(0), whole, "{step}: {}", done.stderr);
        if whole {
            break;
        }
        struck += 1;
        let last = done.stderr.lines().last().unwrap_or_default();
        assert!(
            last.starts_with("error: ") && last.contains("storage"),
            "{last}"
        );
    }
    assert!(struck > 2, "{struck}");
    assert_eq!(place.read(KEPT), network());
}
