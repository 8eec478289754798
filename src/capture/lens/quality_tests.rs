//! Error by the method of resampling, on a photo of the bundled scene; `--nocapture` prints the
//! figures.

use std::path::Path;
use std::sync::Arc;

use glam::DVec2;

use super::undistort::sample;
use super::{Lens, ModelName, Undistortion};
use crate::capture::{Camera, Capture, LoadOptions, Loader, Photo, downscale};

/// A gray picture of width × height.
type Gray = (Vec<u8>, [u32; 2]);

/// A photo and its pinhole.
fn source() -> (Photo, Camera) {
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/demo");
    let capture = Capture::load(&demo).unwrap();
    let loader = Loader::new(LoadOptions::default());
    loader.load(&capture.views[3]).unwrap()
}

/// A barrel of the pinhole's focal length whose photos have `size`.
fn barrel(camera: &Camera, size: [u32; 2]) -> Lens {
    let camera = camera.resized(size[0], size[1]);
    let parameters = [camera.fx, camera.cx, camera.cy, -0.25];
    let model = ModelName::named("SIMPLE_RADIAL").unwrap();
    model.lens(size[0], size[1], &parameters).unwrap()
}

/// Image of a picture through a lens: the mean of 16 rays a pixel.
fn photographed(lens: &Lens, (photo, camera): &(Photo, Camera)) -> Gray {
    let subpixels = 4;
    let mut sources = Vec::new();
    for pixel in 0..lens.width * lens.height {
        let corner = DVec2::new(f64::from(pixel % lens.width), f64::from(pixel / lens.width));
        for k in 0..subpixels * subpixels {
            let within = DVec2::new(f64::from(k % subpixels), f64::from(k / subpixels)) + 0.5;
            let ray = lens.ray(corner + within / f64::from(subpixels)).unwrap();
            let at = DVec2::new(camera.fx * ray.x, camera.fy * ray.y) / ray.z;
            sources.push((at + DVec2::new(camera.cx, camera.cy)).as_vec2().to_array());
        }
    }
    let size = [photo.width, photo.height];
    let values: Vec<f32> = sample(&photo.gray, size, &sources, |&v| [f32::from(v)])
        .map(|[value]| value)
        .collect();
    let mean = |rays: &[f32]| (rays.iter().sum::<f32>() / rays.len() as f32).round() as u8;
    let rays = (subpixels * subpixels) as usize;
    (
        values.chunks(rays).map(mean).collect(),
        [lens.width, lens.height],
    )
}

fn halved((gray, [width, height]): &Gray) -> Gray {
    let size = [width / 2, height / 2];
    let pixels: Vec<[u8; 1]> = gray.iter().map(|&g| [g]).collect();
    let from = [*width as usize, *height as usize];
    let halved = downscale(&pixels, from, size.map(|side| side as usize));
    (halved.into_flattened(), size)
}

/// Two pixels of each axis by distance.
fn bilinear((gray, [width, height]): &Gray, sources: &[[f32; 2]]) -> Vec<u8> {
    let at = |x: i64, y: i64| {
        let (x, y) = (
            x.clamp(0, i64::from(*width) - 1),
            y.clamp(0, i64::from(*height) - 1),
        );
        f32::from(gray[(y * i64::from(*width) + x) as usize])
    };
    let sampled = sources.iter().map(|[x, y]| {
        let (x0, y0) = ((x - 0.5).floor(), (y - 0.5).floor());
        let (s, t) = (x - 0.5 - x0, y - 0.5 - y0);
        let (x0, y0) = (x0 as i64, y0 as i64);
        let above = at(x0, y0) * (1.0 - s) + at(x0 + 1, y0) * s;
        let below = at(x0, y0 + 1) * (1.0 - s) + at(x0 + 1, y0 + 1) * s;
        (above * (1.0 - t) + below * t).round() as u8
    });
    sampled.collect()
}

fn cubic((gray, size): &Gray, sources: &[[f32; 2]]) -> Vec<u8> {
    let sampled = sample(gray, *size, sources, |&value| [f32::from(value)]);
    sampled.map(|[value]| value.round() as u8).collect()
}

/// PSNR in dB of a picture that `camera` shows against one of the same scale, over
/// the middle of the latter.
fn psnr(picture: &[u8], camera: &Camera, (truth, [width, height]): &Gray) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    let left = (camera.cx - f64::from(*width) / 2.0).round() as u32;
    let top = (camera.cy - f64::from(*height) / 2.0).round() as u32;
    for y in height / 8..height - height / 8 {
        for x in width / 8..width - width / 8 {
            let shown = picture[((y + top) * camera.width + x + left) as usize];
            sum += f64::from(shown.abs_diff(truth[(y * width + x) as usize])).powi(2);
            count += 1;
        }
    }
    10.0 * (255.0_f64.powi(2) * f64::from(count) / sum).log10()
}

#[test]
fn pictures_are_sampled_well() {
    let source = source();
    let size = [source.0.width, source.0.height];
    let small = size.map(|side| side / 2);
    let whole: Gray = (source.0.gray.clone(), size);
    let truth = halved(&whole);

    // Photo and picture at one scale.
    let lens = barrel(&source.1, small);
    let photo = photographed(&lens, &source);
    let cut = lens.cuts().unwrap().remove(0);
    let undistortion = Undistortion {
        lens: Arc::new(lens),
        rotation: cut.rotation,
    };
    let sources = undistortion.sources(&cut.camera, photo.1);
    let [two, four] = [bilinear(&photo, &sources), cubic(&photo, &sources)]
        .map(|picture| psnr(&picture, &cut.camera, &truth));
    println!("same scale: bilinear {two:.2} dB, cubic {four:.2} dB");
    assert!(four > two + 1.0);

    // A picture of half the photo's scale.
    let lens = barrel(&source.1, size);
    let photo = photographed(&lens, &source);
    let whole_cut = lens.cuts().unwrap().remove(0).camera;
    let undistortion = Undistortion {
        lens: Arc::new(lens),
        rotation: cut.rotation,
    };
    let shrunk = halved(&photo);
    let before = cubic(&shrunk, &undistortion.sources(&cut.camera, shrunk.1));
    let without = cubic(&photo, &undistortion.sources(&cut.camera, photo.1));
    let even = whole_cut.resized(2 * cut.camera.width, 2 * cut.camera.height);
    let even = Camera {
        fx: 2.0 * cut.camera.fx,
        fy: 2.0 * cut.camera.fy,
        cx: 2.0 * cut.camera.cx,
        cy: 2.0 * cut.camera.cy,
        ..even
    };
    let large = cubic(&photo, &undistortion.sources(&even, photo.1));
    let after = halved(&(large, [even.width, even.height]));
    let [before, without, after] =
        [before, without, after.0].map(|picture| psnr(&picture, &cut.camera, &truth));
    println!(
        "half the scale: shrunk before {before:.2} dB, after {after:.2} dB, not at all {without:.2} dB"
    );
    assert!(after > before + 5.0 && after > without - 2.0);
}
