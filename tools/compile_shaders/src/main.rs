//! Compiles the WESL kernels in `shaders/` to plain WGSL, a file in `shaders/compiled/` for each
//! kernel and variant, with the constants of `src/gpu/shaders.rs` that hold them:
//! `cargo run --release -p compile_shaders` after a change. The program is built without it.

use std::{collections::BTreeMap, fmt::Write, fs, path::Path};

use wesl::{ModulePath, Wesl};

mod stamp;

/// Kernels that know nothing of color channels.
const PLAIN: &[&str] = &[
    "adam",
    "chroma_loss",
    "compact",
    "densify",
    "lab_loss",
    "lbfgs",
    "project",
    "rgb_loss",
    "scan",
    "sort",
    "sum_loss",
    "tile_lists",
    "tile_ranges",
    "view_correction",
];

/// Kernels compiled once for each kind of color.
const COLORED: &[&str] = &["blend", "shade"];

/// Effects of the photos that the luma loss may reckon with.
const LOSS_EFFECTS: &[&str] = &["exposed", "masked"];

/// SSIM's windows and what the names of the kernels say of them.
const SSIM_WINDOWS: [(&str, &str); 3] = [
    ("window11", ""),
    ("window7", "_window7"),
    ("window5", "_window5"),
];

/// The repository.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

fn main() {
    let folder = Path::new(ROOT).join("shaders/compiled");
    // A variant that is no more has no file.
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir(&folder).expect("shaders/ is writable");
    for (name, text) in compiled() {
        fs::write(folder.join(name), text).expect("shaders/compiled/ is writable");
    }
}

/// Text of each file in `shaders/compiled/`.
fn compiled() -> BTreeMap<String, String> {
    let mut kernels = Kernels::default();
    let mut compile = |kernel, suffix: &str, features: &[&str]| {
        kernels.compile(kernel, suffix, features);
    };
    for kernel in PLAIN {
        compile(kernel, "", &[]);
    }
    for kernel in COLORED {
        for color in ["luma", "chroma", "rgb"] {
            compile(kernel, &format!("_{color}"), &[color]);
        }
    }
    compile("blend", "_depth", &["luma", "depth"]);
    for kernel in ["chroma_loss", "lab_loss"] {
        compile(kernel, "_agreeing", &["agreeing"]);
    }
    // Luma trains the geometry too; on frozen geometry the gradient of a/b or RGB and its
    // curvature come back as four figures.
    for kernel in ["blend_backward", "sum_instances"] {
        compile(kernel, "_luma", &["luma", "geometry"]);
        compile(kernel, "_figures", &["figures"]);
    }
    compile("shade_backward", "_luma", &["luma", "geometry"]);
    compile("shade_backward", "_chroma", &["chroma"]);
    compile("shade_backward", "_rgb", &["rgb"]);
    compile("project_backward", "", &["luma", "geometry"]);
    // In training the two that reach the parameters take Adam's step at once.
    for kernel in ["project_backward", "shade_backward"] {
        compile(kernel, "_step", &["luma", "geometry", "step"]);
    }
    // What training may trade for time (`src/luma/numerics.rs`): Adam steps for what the
    // view shows alone, and gradients wait for their sums at half the size.
    let lazy = ["luma", "geometry", "step", "lazy", "mip"];
    compile("project_backward", "_step_lazy", &lazy[..4]);
    compile("project_backward", "_mip_step_lazy", &lazy);
    compile("shade_backward", "_step_lazy", &lazy[..4]);
    for kernel in ["blend_backward", "sum_instances"] {
        compile(kernel, "_luma_half", &["luma", "geometry", "half"]);
    }
    // Each effect of the photos is in the loss only where a scene calls for it.
    for subset in 0..1 << LOSS_EFFECTS.len() {
        let effects: Vec<&str> = (LOSS_EFFECTS.iter().enumerate())
            .filter(|(bit, _)| subset >> bit & 1 == 1)
            .map(|(_, &effect)| effect)
            .collect();
        let suffix: String = effects.iter().map(|effect| format!("_{effect}")).collect();
        for (window, name) in SSIM_WINDOWS {
            let features = [&effects[..], &[window]].concat();
            compile("luma_loss", &format!("{suffix}{name}"), &features);
        }
    }
    // Antialiasing is in the projection only where a scene calls for it.
    let mip = ["luma", "geometry", "mip", "step"];
    compile("project", "_mip", &mip[2..3]);
    compile("project_backward", "_mip", &mip[..3]);
    compile("project_backward", "_mip_step", &mip);
    // RGB is trained with the geometry to look in a viewer as it does here, and by that
    // viewer's own kernel.
    let trained = ["rgb", "geometry"];
    for (suffix, viewer) in [("", &[][..]), ("_playcanvas", &["playcanvas"][..])] {
        let with = |more: &[&'static str]| [&trained[..], more, viewer].concat();
        for kernel in ["blend_backward", "sum_instances"] {
            compile(kernel, &format!("_rgb{suffix}"), &with(&[]));
        }
        for kernel in ["shade_backward", "project_backward"] {
            compile(kernel, &format!("_rgb_step{suffix}"), &with(&["step"]));
        }
    }
    compile("project", "_playcanvas", &["playcanvas"]);
    compile("blend", "_rgb_playcanvas", &["rgb", "playcanvas"]);
    // Where a processor draws.
    for kernel in ["scan", "sort"] {
        compile(kernel, "_simd", &["simd"]);
    }
    for color in ["luma", "chroma", "rgb"] {
        compile("blend", &format!("_{color}_simd"), &[color, "simd"]);
    }
    compile("blend", "_depth_simd", &["luma", "depth", "simd"]);
    compile(
        "blend",
        "_rgb_playcanvas_simd",
        &["rgb", "playcanvas", "simd"],
    );
    let simd = |features: &[&'static str]| [features, &["simd"]].concat();
    for (suffix, features) in [
        ("_luma", &["luma", "geometry"][..]),
        ("_luma_half", &["luma", "geometry", "half"]),
        ("_figures", &["figures"]),
        ("_rgb", &trained),
        ("_rgb_playcanvas", &["rgb", "geometry", "playcanvas"]),
    ] {
        compile("blend_backward", &format!("{suffix}_simd"), &simd(features));
    }
    kernels.files()
}

/// Everything compiled so far.
#[derive(Default)]
struct Kernels {
    /// A constant for each.
    constants: String,
    /// Name and constant of each.
    all: String,
    files: BTreeMap<String, String>,
}

impl Kernels {
    /// Compiles a kernel with these conditions; `suffix` tells the variant from others.
    fn compile(&mut self, kernel: &str, suffix: &str, features: &[&str]) {
        let mut compiler = Wesl::new(Path::new(ROOT).join("shaders"));
        compiler.keep_all_entrypoints();
        for feature in [
            "luma",
            "chroma",
            "rgb",
            "depth",
            "agreeing",
            "figures",
            "geometry",
            "step",
            "exposed",
            "masked",
            "mip",
            "lazy",
            "half",
            "playcanvas",
            "simd",
            "window11",
            "window7",
            "window5",
        ] {
            compiler.set_feature(feature, features.contains(&feature));
        }
        // Plain names: imported functions keep the name they have in their file.
        compiler.set_mangler(wesl::ManglerKind::None);
        let module: ModulePath = format!("package::{kernel}")
            .parse()
            .expect("a kernel's name is a module path");
        let wgsl = compiler
            .compile(&module)
            .unwrap_or_else(|error| panic!("shaders/{kernel}.wgsl: {error}"));
        let name = format!("{kernel}{suffix}");
        // What is imported comes in another order each time, which means nothing in WGSL.
        let text = wgsl.to_string();
        let mut declarations: Vec<&str> = text.trim_end().split("\n\n").collect();
        declarations.sort_unstable();
        let text = declarations.join("\n\n") + "\n";
        self.files.insert(format!("{name}.wgsl"), text);
        let conditions = match features {
            [] => String::new(),
            some => format!(" with {}", some.join(", ")),
        };
        let constant = name.to_uppercase();
        let file = format!("include_str!(\"{name}.wgsl\")");
        // Writing to a string cannot fail.
        let _ = write!(
            self.constants,
            "/// `shaders/{kernel}.wgsl`{conditions}.\npub const {constant}: &str = {file};\n\n"
        );
        let _ = write!(self.all, "(\"{name}\", {constant}), ");
    }

    /// The kernels and the constants.
    fn files(self) -> BTreeMap<String, String> {
        let Self {
            constants,
            all,
            mut files,
        } = self;
        let list = format!(
            "/// Every compiled kernel by name, for tests that reflect them.\n\
             pub const ALL: &[(&str, &str)] = &[{all}];\n"
        );
        files.insert("kernels.rs".to_owned(), constants + &list);
        files.insert(stamp::FILE.to_owned(), stamp::of(Path::new(ROOT)));
        files
    }
}

#[test]
fn the_compiled_kernels_are_those_of_the_sources() {
    let folder = Path::new(ROOT).join("shaders/compiled");
    let mut there: Vec<String> = fs::read_dir(&folder)
        .expect("shaders/compiled/ is there")
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    there.sort();
    let compiled = compiled();
    assert_eq!(there, compiled.keys().cloned().collect::<Vec<_>>());
    for (name, text) in compiled {
        let old = fs::read_to_string(folder.join(&name)).unwrap();
        assert!(
            old == text,
            "{name} is stale: cargo run --release -p compile_shaders"
        );
    }
}
