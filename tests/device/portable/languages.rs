//! Every kernel in the languages of other devices: written by naga as SPIR-V, MSL, HLSL and GLSL,
//! and read again by what validates these. Tint, which Chromium compiles WGSL with, is asked in
//! `browser.rs`.
//!
//! There is no validator of MSL outside Apple's Xcode, so MSL is written and not read.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use gs_chroma::gpu::shaders;
use naga::valid::{Capabilities, ValidationFlags, Validator};

use crate::portable::{
    places::{complaint, folder},
    say,
};

/// Every kernel in a file of its own, with its name and entry points.
fn written(folder: &Path) -> Vec<(PathBuf, &'static str, Vec<String>)> {
    let write = |(name, source): &(&'static str, &'static str)| {
        let file = folder.join(format!("{name}.wgsl"));
        fs::write(&file, source).expect("the target folder is writable");
        let module = naga::front::wgsl::parse_str(source).expect("WGSL");
        let entries = module.entry_points.iter().map(|entry| entry.name.clone());
        (file, *name, entries.collect())
    };
    shaders::ALL.iter().map(write).collect()
}

/// Nothing that a device may lack: 16-bit floats, subgroups, 64-bit integers.
#[test]
fn kernels_need_nothing_that_webgpu_does_not_promise() {
    for (name, source) in shaders::ALL {
        let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{name}: {e}"));
        Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{name}: {e:?}"));
        assert!(!source.contains("enable "), "{name} enables an extension");
    }
}

/// Direct3D 12 tells indirect dispatches that there are none (wgpu 30 without its validation). The
/// luma loss alone asks, which the host dispatches.
#[test]
fn indirect_dispatches_do_not_ask_how_many_workgroups_there_are() {
    for (name, source) in shaders::ALL {
        let asks = source.contains("num_workgroups");
        assert_eq!(asks, name.starts_with("luma_loss"), "{name}");
    }
}

#[test]
#[ignore = "needs naga, spirv-val and glslangValidator: make test-all"]
fn naga_writes_what_validators_read() {
    let folder = folder("languages");
    let mut entry_points = 0;
    for (file, name, entries) in written(&folder) {
        let [spv, msl, hlsl] = ["spv", "metal", "hlsl"].map(|kind| file.with_extension(kind));
        let mut command = Command::new("naga");
        // The oldest that wgpu writes for.
        command.args(["--metal-version", "2.0", "--shader-model", "51"]);
        command.arg(&file).args([&spv, &msl, &hlsl]);
        assert_eq!(complaint(&mut command), None, "{name}");
        let mut command = Command::new("spirv-val");
        command.args(["--target-env", "vulkan1.0"]).arg(&spv);
        assert_eq!(complaint(&mut command), None, "{name}.spv");
        let text = fs::read_to_string(&hlsl).expect("HLSL");
        fs::write(&hlsl, for_glslang(&text)).expect("the target folder is writable");
        for entry in entries {
            let mut command = Command::new("glslangValidator");
            command.args(["-D", "-V", "-S", "comp", "-e", &entry, "-o"]);
            command.arg(folder.join("hlsl.spv")).arg(&hlsl);
            assert_eq!(complaint(&mut command), None, "{name}.hlsl, {entry}");

            let glsl = folder.join(format!("{name}.{entry}.comp"));
            let mut command = Command::new("naga");
            command.args(["--entry-point", &entry, "--profile", "es310"]);
            command.arg(&file).arg(&glsl);
            assert_eq!(complaint(&mut command), None, "{name}, {entry}");
            let mut command = Command::new("glslangValidator");
            command.args(["-S", "comp"]).arg(&glsl);
            assert_eq!(complaint(&mut command), None, "{name}.comp, {entry}");
            entry_points += 1;
        }
    }
    say(&format!(
        "validators read the SPIR-V, HLSL and GLSL of all {entry_points} entry points"
    ));
}

/// HLSL without what glslang, unlike Microsoft's compilers, does not know: 0 cast to an array,
/// and a function that makes an array for a constant.
fn for_glslang(text: &str) -> String {
    let line = |line: &str| {
        let Some((left, right)) = line.split_once(" = ") else {
            return line.to_owned();
        };
        let cast = right.starts_with('(') && right.ends_with("])0;");
        let of_a_function = line.trim_start().starts_with("static const ");
        let arguments = right.strip_prefix("Construct").and_then(|right| {
            let (_, arguments) = right.split_once('(')?;
            arguments.strip_suffix(");")
        });
        match arguments {
            // A variable of the group is set, one of a function made.
            _ if cast && left.trim_start().contains(' ') => format!("{left};"),
            _ if cast => String::new(),
            Some(arguments) if of_a_function => format!("{left} = {{ {arguments} }};"),
            _ => line.to_owned(),
        }
    };
    text.lines().map(|text| line(text) + "\n").collect()
}

#[test]
fn what_glslang_does_not_know_is_left_out_and_nothing_else() {
    let text = "        touching = (uint[16])0;\n    float sum[8] = (float[8])0;\n\
                static const float A[2] = Constructarray2_float_(1.0, -2.0);\n    uint k = (uint)0;\n";
    let left =
        "\n    float sum[8];\nstatic const float A[2] = { 1.0, -2.0 };\n    uint k = (uint)0;\n";
    assert_eq!(for_glslang(text), left);
}
