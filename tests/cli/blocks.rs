//! `partition`, `fit` of blocks and `merge`: a scene in parts.

use std::{collections::BTreeSet, fs};

use serde_json::Value;

use super::program::Place;
use super::shared::place_with_scene;
use super::splat_file::SplatFile;

/// The bundled scene, and how it is trained in seconds.
const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo");
const QUICK: [&str; 6] = [
    "--max-side",
    "64",
    "--iterations",
    "40",
    "--checkpoint",
    "off",
];

/// A folder with a job of two blocks.
fn place_with_job() -> Place {
    let place = Place::new();
    partition(&place, "job");
    place
}

fn partition(place: &Place, job: &str) -> Value {
    let asked = ["--blocks", "2", "--max-splats", "3000", "--json"];
    place.json(&[&["partition", SCENE, "-o", job][..], &asked].concat())
}

fn fit(place: &Place, folder: &str) -> Value {
    place.json(&[&["fit", folder, "--json"][..], &QUICK].concat())
}

fn json(place: &Place, name: &str) -> Value {
    serde_json::from_slice(&place.read(name)).expect("JSON")
}

fn names(list: &Value) -> BTreeSet<String> {
    let names = list.as_array().expect("a list").iter();
    names
        .map(|name| name.as_str().expect("a name").to_owned())
        .collect()
}

/// Returns true if a point lies within the block's cell.
fn holds(block: &Value, job: &Value, place: [f64; 3]) -> bool {
    let axes = ["along", "across"].map(|axis| &job["ground"][axis]);
    let at = axes.map(|axis| {
        (0..3)
            .map(|k| axis[k].as_f64().unwrap() * place[k])
            .sum::<f64>()
    });
    (0..2).all(|k| {
        let edges = &block["core"][k];
        let low = edges[0].as_f64().unwrap_or(f64::NEG_INFINITY);
        low <= at[k] && at[k] < edges[1].as_f64().unwrap_or(f64::INFINITY)
    })
}

#[test]
fn a_scene_is_divided() {
    let place = place_with_job();
    let job = json(&place, "job/job.json");
    let blocks = job["blocks"].as_array().expect("blocks");
    assert_eq!(blocks.len(), 2);
    // Each point and each photo is somewhere; photos are held out wherever they are.
    let points: u64 = blocks
        .iter()
        .map(|block| block["points"].as_u64().unwrap())
        .sum();
    assert_eq!(points, job["points"].as_u64().unwrap());
    let coarse = json(&place, "job/coarse/block.json");
    let [train, test] = ["train", "test"].map(|kind| names(&coarse["photos"][kind]));
    assert_eq!((train.len(), test.len()), (12, 2));
    let [mut all_train, mut all_test] = [BTreeSet::new(), BTreeSet::new()];
    for block in blocks {
        let file = json(
            &place,
            &format!("job/{}/block.json", block["name"].as_str().unwrap()),
        );
        all_train.extend(names(&file["photos"]["train"]));
        all_test.extend(names(&file["photos"]["test"]));
        assert_eq!(file["max_splats"], block["estimate"]["splats"]);
        assert!(block["estimate"]["memory"].as_u64() < job["whole"]["memory"].as_u64());
    }
    assert_eq!((all_train, all_test), (train, test));
    let plan = image::open(place.path("job/plan.png")).expect("a picture");
    assert!(plan.width().max(plan.height()) == 1200);
    // The same again is the same; other blocks take the place of these.
    let before = place.read("job/job.json");
    partition(&place, "job");
    assert!(place.read("job/job.json") == before);
    place.succeed(&["partition", SCENE, "-o", "job", "--blocks", "1"]);
    assert!(!place.path("job/block-2").exists());
}

#[test]
fn blocks_are_trained_and_put_together() {
    let place = place_with_job();
    let job = json(&place, "job/job.json");
    let merge = ["merge", "job", "-o", "city", "--json"];
    let done = place.run(&merge);
    assert!(
        done.stderr
            .contains("is not trained yet: run `gs-chroma fit"),
        "{done:?}"
    );

    let coarse = fit(&place, "job/coarse");
    assert_eq!(
        (&coarse["capture"]["train"], &coarse["capture"]["test"]),
        (&12.into(), &2.into())
    );
    for block in ["job/block-1", "job/block-2"] {
        let report = fit(&place, block);
        assert!(
            report["warnings"].as_array().expect("a list").is_empty(),
            "{report}"
        );
        assert!(report["capture"]["chosen"]["train"].is_array());
        let most = json(&place, &format!("{block}/block.json"))["max_splats"].as_u64();
        assert!(report["luma"]["splats"].as_u64() <= most);
        let rate = |report: &Value| report["luma"]["settings"]["rates"]["quats"].as_f64();
        let share = report["capture"]["train"].as_f64().unwrap() / 12.0;
        let faster = rate(&report).unwrap() / rate(&coarse).unwrap();
        assert!((faster - share.powf(-0.5)).abs() < 1e-9, "{faster} {share}");
        let streams = |report: &Value| report["luma"]["settings"]["stream_photos"] == true;
        assert!(streams(&report) && !streams(&coarse));
        // What the coarse model has decided holds.
        for (ours, theirs) in (report["effects"].as_array().unwrap().iter())
            .zip(coarse["effects"].as_array().unwrap())
            .filter(|(ours, _)| !["lens", "luma-degree"].contains(&ours["name"].as_str().unwrap()))
        {
            assert_eq!(ours["on"], theirs["on"], "{ours}");
        }
    }

    let report = place.json(&merge);
    assert_eq!(report["capture"]["test"], 2);
    // The whole is trained on as the coarse model is, not as a block.
    let settings = [&report, &coarse].map(|report| &report["luma"]["settings"]);
    let [ours, theirs] = settings.map(|settings| settings["rates"]["quats"].as_f64().unwrap());
    assert!((ours / theirs - 1.0).abs() < 1e-9, "{ours} {theirs}");
    assert_eq!(settings[0]["stream_photos"], false);
    assert_eq!(
        report["luma"]["held_out_views"].as_array().map(Vec::len),
        Some(2)
    );
    let city = SplatFile::read(&place, "city/luma.ply");
    let of_city = city.column("x").len();
    assert_eq!(report["luma"]["splats"].as_u64(), Some(of_city as u64));
    // Of each block what lies in its own cell, and nothing else.
    let own = |file: &SplatFile, block: &Value| {
        let [x, y, z] = ["x", "y", "z"].map(|axis| file.column(axis));
        let places = (0..x.len()).map(|i| [x[i], y[i], z[i]].map(f64::from));
        places.filter(|&place| holds(block, &job, place)).count()
    };
    let blocks = job["blocks"].as_array().unwrap();
    let kept: Vec<usize> = ["job/block-1/luma.ply", "job/block-2/luma.ply"]
        .iter()
        .zip(blocks)
        .map(|(name, block)| own(&SplatFile::read(&place, name), block))
        .collect();
    assert_eq!(kept.iter().sum::<usize>(), of_city);
    assert_eq!(kept, [own(&city, &blocks[0]), own(&city, &blocks[1])]);

    // The coarse model's shell, which every block has, is there once and last.
    let shell = |name: &str, report: &Value| {
        let file = SplatFile::read(&place, &format!("{name}/luma.ply"));
        let surroundings = report["luma"]["surroundings"].as_u64().unwrap() as usize;
        let [x, y, z] = ["x", "y", "z"].map(|axis| file.column(axis));
        let last = x.len() - surroundings..x.len();
        let mut places: Vec<_> = last.map(|i| [x[i], y[i], z[i]]).collect();
        places.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
        places
    };
    let around = shell("city", &report);
    assert!(!around.is_empty() && around == shell("job/coarse", &coarse));

    // It is a run like any other.
    let photos = format!("{SCENE}/images");
    place.succeed(&["colorize", "city", "--teacher", &photos, "--rounds", "3"]);

    // A block goes on among its neighbors, for a sixth of its iterations.
    let around = ["--around", "city", "--json"];
    let second = place.json(&[&["fit", "job/block-2"][..], &around].concat());
    assert_eq!(second["luma"]["iterations"], 47);
    assert_eq!(
        second["luma"]["around"].as_str().map(str::len),
        Some(64),
        "{second}"
    );
    // It has nothing beyond its margin, and neither have the photos that it is measured on.
    assert!(second["luma"]["splats"].as_u64() < report["luma"]["splats"].as_u64());
    let shown = |report: &Value, name: &str| {
        let views = report["luma"]["held_out_views"].as_array().unwrap();
        let view = views.iter().find(|view| view["name"] == name);
        view.unwrap()["psnr"].as_f64().unwrap()
    };
    let views = second["luma"]["held_out_views"].as_array().unwrap();
    assert!(!views.is_empty());
    // And a later training splits as before.
    let growth = |report: &Value| report["luma"]["settings"]["growth"].as_f64();
    assert_eq!(growth(&second), growth(&report));
    for view in views {
        let name = view["name"].as_str().unwrap();
        let [block, city] = [&second, &report].map(|report| shown(report, name));
        assert!(block > city - 0.5, "{name}: {block} {city}");
    }
    let printed = place.succeed(&["merge", "job", "-o", "agreed"]);
    assert!(
        printed.contains("held-out PSNR across borders: "),
        "{printed}"
    );
    let alone = place.json(&["fit", "job/block-2", "--iterations", "1", "--json"]);
    let warnings = alone["warnings"].to_string();
    assert!(
        warnings.contains("train it among its neighbors"),
        "{warnings}"
    );
    for (command, code) in [
        (&["fit", "job/block-2", "--around", "nowhere"][..], 1),
        (&["fit", "agreed", "--around", "city"], 1),
        (&["fit", SCENE, "-o", "new", "--around", "city"], 2),
    ] {
        let done = place.run(command);
        assert!(
            done.code == Some(code) && done.stderr.starts_with("error: "),
            "{done:?}"
        );
    }

    // A block of another plan is not put together with these.
    let text = String::from_utf8(place.read("job/job.json")).unwrap();
    let mut other = job.clone();
    other["blocks"][0]["near"][0][0] = (-7.0).into();
    place.write("job/job.json", other.to_string());
    let done = place.run(&merge);
    assert!(
        done.code == Some(1)
            && done
                .stderr
                .contains("block-1: was trained for another plan"),
        "{done:?}"
    );
    place.write("job/job.json", text);

    // A trained job is not divided anew.
    let done = place.run(&["partition", SCENE, "-o", "job"]);
    assert!(
        done.code == Some(1) && done.stderr.contains("is trained"),
        "{done:?}"
    );
    // A block goes on as any run does, with its own photos and exposures.
    let on = place.json(&["fit", "job/block-1", "--iterations", "40", "--json"]);
    assert_eq!(on["luma"]["iterations"], 80);
}

#[test]
fn a_block_does_without_a_coarse_model_but_says_so() {
    let place = place_with_job();
    let report = fit(&place, "job/block-2");
    let warnings = report["warnings"].to_string();
    assert!(warnings.contains("without a coarse model"), "{warnings}");
}

#[test]
fn what_is_wrong_with_a_job_is_told() {
    let place = place_with_job();
    let fails = |command: &[&str], words: &[&str]| {
        let done = place.run(command);
        assert_eq!(done.code, Some(1), "{command:?}: {done:?}");
        let line = done.stderr.trim_end();
        assert!(
            line.starts_with("error: ") && line.lines().count() == 1,
            "{line}"
        );
        for word in words {
            assert!(
                line.contains(word),
                "{command:?}: {line} says nothing of {word}"
            );
        }
    };
    fails(
        &["merge", "nowhere"],
        &["nowhere", "is no job", "partition"],
    );
    fails(
        &["partition", SCENE, "-o", "other", "--memory-limit", "1"],
        &["1 MiB", "smallest"],
    );
    assert!(!place.path("other").exists());
    let job = String::from_utf8(place.read("job/job.json")).unwrap();
    place.write(
        "job/job.json",
        job.replacen("\"overlap\"", "\"overlay\"", 1),
    );
    fails(&["merge", "job"], &["job.json", "overlay", "partition"]);
    place.write(
        "job/job.json",
        job.replacen("\"version\": 1", "\"version\": 9", 1),
    );
    fails(&["fit", "job/block-1"], &["job.json", "version 9"]);
    place.write("job/job.json", job.replace("block-2", "../block-2"));
    fails(&["merge", "job"], &["job.json", "names"]);
    place.write("job/job.json", &job);
    fs::rename(place.path("job/block-2"), place.path("job/block-3")).expect("a folder");
    fails(&["fit", "job/block-3"], &["block-3", "no block of the job"]);
    for (command, code) in [
        (&["partition", SCENE][..], 2),
        (&["partition", SCENE, "-o", "x", "--blocks", "0"], 2),
        (&["partition", SCENE, "-o", "x", "--overlap", "1.5"], 2),
    ] {
        assert_eq!(place.run(command).code, Some(code), "{command:?}");
    }
}

#[test]
fn a_job_is_moved_with_its_photos_and_leads_nowhere_else() {
    let place = place_with_scene();
    place.succeed(&["partition", "scene", "-o", "job", "--blocks", "1"]);
    fs::create_dir(place.path("moved")).expect("a folder");
    let moves = |name: &str| {
        let to = place.path(&format!("moved/{name}"));
        fs::rename(place.path(name), to).expect("a folder");
    };
    let refused = |job: &str, part: &str| {
        let done = place.run(&["merge", job]);
        assert!(
            done.code == Some(1) && done.stderr.contains(part) && done.stderr.lines().count() == 1,
            "{done:?}"
        );
    };
    moves("scene");
    refused("job", "its photos are not at");
    moves("job");
    refused("moved/job", "is not trained yet");
    let text = String::from_utf8(place.read("moved/job/job.json")).expect("text");
    for name in ["..", "../block-1", "/tmp", "a/b", "", "coarse"] {
        let named = text.replace("\"block-1\"", &format!("{name:?}"));
        place.write("moved/job/job.json", named);
        refused("moved/job", "no names of folders");
    }
    place.write("moved/job/job.json", text);
    #[cfg(unix)]
    {
        let block = place.path("moved/job/block-1");
        fs::rename(&block, place.path("elsewhere")).expect("a folder");
        std::os::unix::fs::symlink("../../elsewhere", &block).expect("a link");
        refused("moved/job", "is a link");
        let again = place.run(&["partition", "moved/scene", "-o", "moved/job"]);
        assert!(again.code == Some(1) && again.stderr.contains("is a link"));
        assert_eq!(place.files("elsewhere"), ["block.json"]);
    }
}
