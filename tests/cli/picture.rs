//! Pictures of a colored file against the oracle, which knows the file alone.

use super::oracle::render::render;
use super::oracle::shade::Shading;
use super::program::Place;
use super::scene;
use super::shared::{onnx, place_with_run};
use super::splat_file::SplatFile;

/// The least PSNR in dB. 8 bits alone cost 59 dB; measured 58.9 dB.
const LEAST_PSNR: f64 = 45.0;

/// A picture's values in [0, 1], `[height · width · 3]`.
pub fn png(place: &Place, name: &str) -> Vec<f64> {
    let image = image::load_from_memory(&place.read(name)).expect("a picture");
    assert_eq!([image.width(), image.height()], scene::SIZE, "{name}");
    let bytes = image.into_rgb8().into_raw();
    bytes.into_iter().map(|v| f64::from(v) / 255.0).collect()
}

/// Peak signal-to-noise ratio in dB.
pub fn psnr(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    -10.0 * (squares / a.len() as f64).log10()
}

#[test]
fn the_exported_file_alone_gives_the_rendered_pictures() {
    let place = place_with_run();
    place.succeed(&["export", "-o", "out.ply"]);
    place.succeed(&["render", "--views", "all", "-o", "pictures"]);
    let splats = SplatFile::read(&place, "out.ply").to_oracle();
    for index in [0, 4, 9] {
        let view = scene::view(index, [0.0; 3]);
        let expected: Vec<f64> = render(&splats, &view, Shading::Offset)
            .into_iter()
            .flatten()
            .map(|value| value.clamp(0.0, 1.0))
            .collect();
        let name = format!("pictures/{}", scene::name(index));
        let found = psnr(&png(&place, &name), &expected);
        println!("{name}: {found:.1} dB");
        assert!(found >= LEAST_PSNR, "{name}: {found:.1} dB");
        // Something is to be seen, and in color.
        let mean = expected.iter().sum::<f64>() / expected.len() as f64;
        let spread = expected
            .iter()
            .map(|v| (v - mean).abs())
            .fold(0.0, f64::max);
        let color = expected
            .chunks(3)
            .map(|c| (c[0] - c[2]).abs())
            .fold(0.0, f64::max);
        assert!(spread > 0.1 && color > 0.05, "{spread} {color}");
    }
}

/// The header says how a file wants to be drawn, here and in the file colored from it.
#[test]
fn a_file_that_was_trained_antialiased_is_drawn_so() {
    let place = place_with_run();
    place.succeed(&["export", "-o", "plain.ply"]);
    let plain = place.read("plain.ply");
    let after = b"1.0\n".as_slice();
    let at = after.len() + plain.windows(4).position(|w| w == after).expect("a format");
    let comment = b"comment SplatRenderMode: mip\n".as_slice();
    let marked = [&plain[..at], comment, &plain[at..]].concat();
    std::fs::write(place.path("mip.ply"), marked).expect("a file");
    for name in ["plain", "mip"] {
        let file = format!("{name}.ply");
        let render = ["render", &file, "--colmap", "scene", "--views", "all"];
        place.succeed(&[&render[..], &["-o", name]].concat());
    }
    let splats = SplatFile::read(&place, "mip.ply").to_oracle();
    let view = super::oracle::view::View {
        antialiased: true,
        ..scene::view(4, [0.0; 3])
    };
    let expected: Vec<f64> = (render(&splats, &view, Shading::Offset)
        .into_iter()
        .flatten())
    .map(|value| value.clamp(0.0, 1.0))
    .collect();
    let [plain, mip] = ["plain", "mip"].map(|from| {
        let picture = png(&place, &format!("{from}/{}", scene::name(4)));
        psnr(&picture, &expected)
    });
    assert!(mip >= LEAST_PSNR && plain < mip - 3.0, "{mip} and {plain}");

    let colorize = [
        "colorize", "mip.ply", "--colmap", "scene", "--solver", "adam",
    ];
    let teacher = onnx("ddcolor_tiny.onnx");
    let amounts = ["--until", "5", "--teacher", &teacher];
    place.succeed(&[&colorize[..], &amounts[..]].concat());
    let colored = SplatFile::read(&place, "mip-color.ply");
    let mode = "comment SplatRenderMode: mip".to_owned();
    assert!(colored.header.contains(&mode), "{:?}", colored.header);
}
