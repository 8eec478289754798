//! `doctor` on the adapters that this machine has: the usual one, Mesa's software driver with
//! vectors as short as older processors have, and SwiftShader, which comes with Chromium.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use gs_chroma::gpu::Gpu;
use serde_json::{Value, json};

use crate::portable::{places, say};

/// Folders of the Vulkan loader's driver manifests.
const MANIFESTS: [&str; 3] = [
    "/etc/vulkan/icd.d",
    "/usr/local/share/vulkan/icd.d",
    "/usr/share/vulkan/icd.d",
];

/// Paths of browsers' software drivers.
const SWIFTSHADER: [&str; 4] = [
    "/usr/lib/chromium/libvk_swiftshader.so",
    "/usr/lib/chromium-browser/libvk_swiftshader.so",
    "/usr/lib64/chromium-browser/libvk_swiftshader.so",
    "/opt/google/chrome/libvk_swiftshader.so",
];

/// The manifest of Mesa's software driver.
fn lavapipe() -> Option<PathBuf> {
    let folders = MANIFESTS
        .iter()
        .filter_map(|folder| fs::read_dir(folder).ok());
    let mut files = folders.flatten().flatten().map(|entry| entry.path());
    files.find(|file| {
        let name = file.file_name().and_then(|name| name.to_str());
        name.is_some_and(|name| name.starts_with("lvp_icd"))
    })
}

/// A manifest of SwiftShader, which browsers do not tell the loader of.
fn swiftshader() -> Option<PathBuf> {
    let library = SWIFTSHADER
        .iter()
        .find(|library| Path::new(library).is_file())?;
    let manifest = places::folder("swiftshader").join("icd.json");
    let icd = json!({
        "file_format_version": "1.0.0",
        "ICD": { "library_path": library, "api_version": "1.1.0" },
    });
    fs::write(&manifest, icd.to_string()).expect("the target folder is writable");
    Some(manifest)
}

/// Report of `doctor` with this driver as the only one, everything in order.
fn doctor(manifest: &Path, variables: &[(&str, &str)]) -> Value {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gs-chroma"));
    command
        .args(["doctor", "--json"])
        // The second is what older loaders read.
        .env("VK_DRIVER_FILES", manifest)
        .env("VK_ICD_FILENAMES", manifest)
        .env("XDG_RUNTIME_DIR", env!("CARGO_TARGET_TMPDIR"))
        .env_remove("WGPU_ADAPTER_NAME")
        .envs(variables.iter().copied())
        .stdin(Stdio::null());
    let done = command.output().expect("the program starts");
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{said}");
    let diagnosis: Value = serde_json::from_slice(&done.stdout).expect("JSON");
    let count = |key: &str| diagnosis[key].as_array().expect("a list").len();
    let adapter = diagnosis["adapter"].as_str().expect("a name");
    let (kernels, cases) = (count("kernels"), count("cases"));
    assert!(kernels >= 28 && cases >= 50, "{kernels}, {cases}");
    say(&format!(
        "doctor holds on {adapter}: {kernels} quantities of kernels, {cases} hard cases"
    ));
    diagnosis
}

#[test]
fn the_usual_adapter_has_a_name() {
    let gpu = Gpu::open().unwrap_or_else(|error| panic!("{error}"));
    say(&format!("all tests run on {}", gpu.describe()));
    assert!(!gpu.info().name.is_empty());
}

#[test]
#[ignore = "another whole doctor on Mesa's software driver: make test-all"]
fn doctor_holds_with_vectors_of_128_bits() {
    let manifest = lavapipe().expect("lavapipe");
    let diagnosis = doctor(&manifest, &[("LP_NATIVE_VECTOR_WIDTH", "128")]);
    let adapter = diagnosis["adapter"].as_str().expect("a name");
    assert!(adapter.contains("128 bits"), "{adapter}");
}

#[test]
#[ignore = "another whole doctor on Chromium's software driver: make test-all"]
fn doctor_holds_on_swiftshader() {
    let manifest = swiftshader().expect("Chromium");
    let diagnosis = doctor(&manifest, &[]);
    let adapter = diagnosis["adapter"].as_str().expect("a name");
    assert!(adapter.contains("SwiftShader"), "{adapter}");
}
