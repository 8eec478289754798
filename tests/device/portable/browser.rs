//! The doctor in a browser: what it asks of this device is written down, done again by WebGPU
//! in headless Chromium on SwiftShader, and the browser's answers are what it judges.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::Arc,
};

use gs_chroma::{
    gpu::{Gpu, STORAGE_BUFFERS, Step, Tape, WORKGROUP_BYTES, shaders},
    low_level::doctor::{
        Verdict,
        cases::{CASES, Case},
        examine,
        kernels::TOPICS,
        measured::{Row, table},
    },
    raster::Raster,
};
use serde_json::{Value, json};

use crate::portable::{places::folder, say};

/// Cases that a browser without a GPU takes long for.
const SLOW: [&str; 2] = ["65,600 tiles", "600 in one tile"];

/// Step between the other cases that the browser runs.
const EVERY: usize = 5;

fn open() -> Gpu {
    Gpu::open().unwrap_or_else(|error| panic!("{error}"))
}

/// The hard cases that are asked of the browser.
fn cases() -> impl Iterator<Item = &'static Case> {
    let quick = CASES.iter().filter(|case| !SLOW.contains(&case.name));
    quick.step_by(EVERY)
}

/// All kernels on random inputs, and the cases.
fn examined(gpu: &Gpu) -> (Vec<Row>, Vec<Verdict>) {
    let raster = Arc::new(Raster::new(gpu));
    let rows = TOPICS.iter().flat_map(|(topic, measure)| {
        measure(&raster).unwrap_or_else(|error| panic!("{topic}: {error}"))
    });
    let rows = rows.collect();
    let verdicts = cases().map(|case| examine(&raster, case).expect(case.name));
    (rows, verdicts.collect())
}

/// Folder of the tools that draw in the browser.
fn tools() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/viewers")
}

/// The browser's answers to a tape, one per read, and its own description.
fn asked(tape: &Tape) -> (Vec<Vec<u8>>, Value) {
    let folder = folder("browser");
    let write = |name: &str, bytes: &[u8]| {
        fs::write(folder.join(name), bytes).expect("the target folder is writable");
    };
    let request = json!({
        // What the kernels take beyond what WebGPU promises.
        "limits": {
            "maxStorageBuffersPerShaderStage": STORAGE_BUFFERS,
            "maxComputeWorkgroupStorageSize": WORKGROUP_BYTES,
        },
        "kernels": shaders::ALL,
        "steps": tape.steps,
    });
    write("tape.json", request.to_string().as_bytes());
    write("tape.bin", &tape.bytes);
    let mut command = Command::new("node");
    command.arg(tools().join("webgpu.mjs")).arg(&folder);
    let done = command.output().expect("Node runs");
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{said}");
    let answers = fs::read(folder.join("answers.bin")).expect("answers");
    let mut rest = &answers[..];
    let sizes = tape.steps.iter().filter_map(|step| match step {
        Step::Read { size, .. } => Some(*size as usize),
        _ => None,
    });
    let answers = sizes.map(|size| {
        let (answer, behind) = rest.split_at(size);
        rest = behind;
        answer.to_vec()
    });
    let answers = answers.collect();
    assert!(rest.is_empty(), "{} bytes too many", rest.len());
    let about = serde_json::from_slice(&done.stdout).expect("JSON");
    (answers, about)
}

#[test]
#[ignore = "needs Chromium, Node and its packages: make test-all"]
fn doctor_holds_in_a_browser() {
    let device = open();
    let taped = device.taped();
    examined(&taped);
    let (answers, about) = asked(&taped.take_tape());
    let compiled = about["compiled"].as_u64().expect("a number");
    let (rows, verdicts) = examined(&device.answering("WebGPU in Chromium", answers));
    println!("{}\n{about}", table(&rows));
    for row in &rows {
        assert!(row.failures.is_empty(), "{row:?}");
    }
    for verdict in &verdicts {
        assert_eq!(verdict.failure, None, "{}", verdict.name);
    }
    assert!(rows.len() >= 28 && verdicts.len() >= 10);
    say(&format!(
        "WebGPU in Chromium on {}: compiles {compiled} entry points, doctor holds: {} quantities of kernels, {} hard cases",
        about["adapter"].as_str().expect("a name"),
        rows.len(),
        verdicts.len(),
    ));
}

/// The answers of another device are judged: zeros do not pass.
#[test]
fn answers_are_what_is_judged() {
    let device = open();
    let (topic, measure) = TOPICS[1];
    let taped = device.taped();
    let judged = |gpu: &Gpu| measure(&Arc::new(Raster::new(gpu))).expect(topic);
    assert!(judged(&taped).iter().all(|row| row.failures.is_empty()));
    let steps = taped.take_tape().steps;
    let zeros = steps.iter().filter_map(|step| match step {
        Step::Read { size, .. } => Some(vec![0; *size as usize]),
        _ => None,
    });
    let zeros: Vec<Vec<u8>> = zeros.collect();
    assert!(!zeros.is_empty());
    let rows = judged(&device.answering("nothing", zeros));
    assert!(rows.iter().all(|row| !row.failures.is_empty()), "{rows:?}");
    // And there must be one for each question.
    let none = measure(&Arc::new(Raster::new(
        &device.answering("nobody", Vec::new()),
    )));
    let words = none.expect_err("an error").to_string();
    assert!(words.contains("no such answer"), "{words}");
}
