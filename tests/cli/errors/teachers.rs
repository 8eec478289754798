//! Errors of a teacher, ONNX Runtime and the device.

use super::{COLORIZE, Case, Place, case, nothing};
use crate::scene;

/// Saves an image as the teacher's for a view.
fn paint(place: &Place, name: &str, [width, height]: [u32; 2]) {
    std::fs::create_dir_all(place.path("painted")).expect("writable");
    let image = image::RgbImage::new(width, height);
    image
        .save(place.path("painted").join(name))
        .expect("writable");
}

/// Saves an image of one color as the hints for view 1.
fn hint<P: image::PixelWithColorType<Subpixel = u8>>(place: &Place, pixel: P)
where
    [u8]: image::EncodableLayout,
{
    std::fs::create_dir_all(place.path("hints")).expect("writable");
    let image = image::ImageBuffer::from_pixel(scene::SIZE[0], scene::SIZE[1], pixel);
    image.save(place.path("hints/01.png")).expect("writable");
}

const HINTED: &str = "colorize --hints hints --solver adam --until 62";

const PAINTED: &str = "colorize --teacher painted --solver adam --until 62";

/// Variables that name Vulkan's drivers, pointing nowhere.
#[cfg(target_os = "linux")]
const NO_DRIVER: &[(&str, &str)] = &[
    ("VK_DRIVER_FILES", "/nonexistent.json"),
    ("VK_ICD_FILENAMES", "/nonexistent.json"),
];

#[cfg(target_os = "linux")]
const fn without_device(name: &'static str, command: &'static str) -> Case {
    Case {
        environment: NO_DRIVER,
        ..case(
            name,
            nothing,
            command,
            &["no Vulkan", "adapter", "mesa-vulkan-drivers"],
        )
    }
}

pub(super) const CASES: &[Case] = &[
    case(
        "no such teacher",
        nothing,
        "colorize --teacher nowhere.onnx",
        &["nowhere.onnx"],
    ),
    case(
        "no teacher's file",
        nothing,
        "colorize --teacher runs/scene/luma.ply",
        &["luma.ply", ".onnx file or a folder"],
    ),
    case(
        "a truncated network",
        nothing,
        "colorize --teacher onnx/truncated.onnx",
        &["truncated.onnx", "not a usable ONNX model"],
    ),
    case(
        "an empty network",
        |p| p.write("onnx/empty.onnx", ""),
        "colorize --teacher onnx/empty.onnx",
        &["empty.onnx", "not a usable ONNX model"],
    ),
    case(
        "a wrong rank",
        nothing,
        "colorize --teacher onnx/wrong_rank.onnx",
        &["wrong_rank.onnx", "[1,8]", "accepted: DDColor"],
    ),
    case(
        "wrong channels",
        nothing,
        "colorize --teacher onnx/wrong_channels.onnx",
        &["wrong_channels.onnx", "[1,5,32,32]", "[1,2,h,w]"],
    ),
    case(
        "two inputs",
        nothing,
        "colorize --teacher onnx/two_inputs.onnx",
        &["two_inputs.onnx", "style", "accepted"],
    ),
    case(
        "two kinds of networks fit",
        nothing,
        "colorize --teacher onnx/deoldify_tiny.onnx",
        &[
            "deoldify_tiny.onnx",
            "--teacher-profile deoldify or deoldify-browser",
        ],
    ),
    case(
        "no such profile",
        nothing,
        "colorize --teacher onnx/deoldify_tiny.onnx --teacher-profile colorful",
        &["--teacher-profile colorful", "deoldify-browser"],
    ),
    case(
        "another network's profile",
        nothing,
        "colorize --teacher onnx/ddcolor_tiny.onnx --teacher-profile deoldify",
        &["ddcolor_tiny.onnx", "accepted: DeOldify"],
    ),
    case(
        "a size that the network does not take",
        nothing,
        "colorize --teacher onnx/ddcolor_tiny.onnx --teacher-size 64",
        &["ddcolor_tiny.onnx", "--teacher-size 64", "takes 32"],
    ),
    case(
        "a class for a network without",
        nothing,
        "colorize --teacher onnx/ddcolor_tiny.onnx --teacher-class 3",
        &["ddcolor_tiny.onnx", "takes no class", "--teacher-class"],
    ),
    case(
        "a manifest with a field too many",
        |p| p.write("onnx/ddcolor_tiny.toml", "name = \"x\"\nsise = 3\n"),
        "colorize --teacher onnx/ddcolor_tiny.onnx",
        &["ddcolor_tiny.toml", "line 2", "`sise`", "teachers.md"],
    ),
    case(
        "a manifest with a field too few",
        |p| p.write("own.toml", "name = \"x\"\n"),
        "colorize --teacher onnx/ddcolor_tiny.onnx --teacher-profile own.toml",
        &["own.toml", "missing field `inputs`", "teachers.md"],
    ),
    case(
        "hints without transparency",
        |p| hint(p, image::Rgb([200, 0, 0])),
        HINTED,
        &["01.png", "no transparency", "PNG"],
    ),
    case(
        "hints without paint",
        |p| hint(p, image::Rgba([200, 0, 0, 0])),
        HINTED,
        &["hints", "nothing is painted", "--teacher"],
    ),
    case(
        "hints of other names",
        |p| {
            hint(p, image::Rgba([200, 0, 0, 9]));
            std::fs::rename(p.path("hints/01.png"), p.path("hints/x.png")).expect("a file");
        },
        HINTED,
        &["hints", "name of a photo", "01.png"],
    ),
    case(
        "one teacher of two covers nothing",
        |p| paint(p, "x.png", scene::SIZE),
        "colorize --teacher onnx/ddcolor_tiny.onnx --teacher painted",
        &["painted", "name of a photo"],
    ),
    case(
        "an empty folder",
        |p| std::fs::create_dir(p.path("painted")).expect("writable"),
        PAINTED,
        &["painted", "no .png, .jpg or .tif"],
    ),
    case(
        "a folder of other names",
        |p| paint(p, "portrait.png", scene::SIZE),
        PAINTED,
        &["painted", "name of a photo", "01.png"],
    ),
    case(
        "another aspect",
        |p| paint(p, "01.png", [50, 50]),
        PAINTED,
        &["01.png", "50 x 50", "64 x 48"],
    ),
    case(
        "two images for a photo",
        |p| {
            paint(p, "01.jpeg", scene::SIZE);
            paint(p, "01.jpg", scene::SIZE);
        },
        PAINTED,
        &["01.jpeg", "01.jpg", "keep one"],
    ),
    case(
        "a damaged image",
        |p| p.write("painted/01.png", "\u{89}PNG"),
        PAINTED,
        &["01.png", "not a readable image"],
    ),
    Case {
        environment: &[("ORT_DYLIB_PATH", "/nonexistent/libonnxruntime.so")],
        ..case(
            "no ONNX Runtime",
            nothing,
            COLORIZE,
            &[
                "/nonexistent/libonnxruntime.so",
                "not a usable ONNX Runtime library",
            ],
        )
    },
    Case {
        environment: &[
            ("ORT_DYLIB_PATH", ""),
            ("XDG_CACHE_HOME", "/nonexistent"),
            ("LOCALAPPDATA", "/nonexistent"),
            ("HOME", "/nonexistent"),
        ],
        ..case(
            "ONNX Runtime nowhere",
            nothing,
            COLORIZE,
            &["ONNX Runtime was not found", "ORT_DYLIB_PATH"],
        )
    },
];

/// Only Vulkan's loader takes its drivers from the environment.
#[cfg(target_os = "linux")]
pub(super) const DEVICES: &[Case] = &[
    without_device("fit without a device", super::FIT),
    without_device("colorize without a device", COLORIZE),
    without_device("render without a device", "render -o out"),
];
