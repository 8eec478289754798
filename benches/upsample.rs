//! Error of upsampling a small answer: true a/b of color photos, made 3.1 times smaller and
//! enlarged again, evenly and along the photo's edges.
//!
//! ```text
//! cargo bench --bench upsample -- FOLDER
//! ```
//!
//! FOLDER holds color photos, of any format that the program reads. They are
//! halved first, for JPEG files hold half of their colors' resolution.

use std::{path::PathBuf, process::ExitCode, time::Instant};

use gs_chroma::{
    chroma::teacher::{AbImage, GrayImage, Upsample},
    color::{GrayTable, srgb_to_lab},
};
use image::{RgbImage, imageops};

/// Ratio of the photo's size to an answer's: 256 pixels for a photo of 800.
const SMALLER: f64 = 3.125;

const WAYS: [(&str, Upsample); 2] = [
    ("bilinear", Upsample::Bilinear),
    ("guided", Upsample::Guided),
];

fn main() -> ExitCode {
    // Cargo adds `--bench`.
    let folder = std::env::args().skip(1).find(|word| !word.starts_with('-'));
    let Some(folder) = folder.map(PathBuf::from) else {
        eprintln!("usage: cargo bench --bench upsample -- FOLDER, with color photos");
        return ExitCode::from(2);
    };
    let photos: Vec<RgbImage> = match std::fs::read_dir(&folder) {
        Ok(files) => (files.flatten())
            .filter_map(|file| Some(image::open(file.path()).ok()?.into_rgb8()))
            .collect(),
        Err(error) => {
            eprintln!("error: {}: {error}", folder.display());
            return ExitCode::FAILURE;
        }
    };
    if photos.is_empty() {
        eprintln!("error: {} holds no photo", folder.display());
        return ExitCode::FAILURE;
    }
    println!("{} photos of {}", photos.len(), folder.display());
    println!("| | rms of a, b | ms a megapixel |\n|---|---|---|");
    for (name, upsample) in WAYS {
        let (mut squares, mut seconds, mut pixels) = (0.0, 0.0, 0.0);
        for photo in &photos {
            let [square, took] = enlarged(photo, upsample);
            squares += square;
            seconds += took;
            pixels += f64::from(photo.width() / 2) * f64::from(photo.height() / 2);
        }
        let rms = (squares / photos.len() as f64).sqrt();
        println!("| {name} | {rms:.3} | {:.1} |", seconds / pixels * 1e9);
    }
    ExitCode::SUCCESS
}

/// Mean squared distance in the a, b plane, and seconds.
fn enlarged(photo: &RgbImage, upsample: Upsample) -> [f64; 2] {
    let (width, height) = (photo.width() / 2, photo.height() / 2);
    let photo = imageops::resize(photo, width, height, imageops::FilterType::Triangle);
    let table = GrayTable::new();
    let pixels: Vec<u8> = photo.pixels().map(|rgb| table.gray(rgb.0)).collect();
    let ab = photo.pixels().map(|rgb| {
        let [_, a, b] = srgb_to_lab(rgb.0.map(|value| f64::from(value) / 255.0));
        [a as f32, b as f32]
    });
    let truth = AbImage {
        width,
        height,
        ab: ab.collect(),
    };
    let side = (f64::from(width) / SMALLER).max(1.0) as u32;
    let small = truth.resized(side, side);
    let gray = GrayImage {
        width,
        height,
        pixels: &pixels,
    };
    let begun = Instant::now();
    let large = small.upsampled(gray, upsample);
    let seconds = begun.elapsed().as_secs_f64();
    let pairs = large.ab.iter().zip(&truth.ab);
    let squares = pairs.map(|(a, b)| f64::from((a[0] - b[0]).hypot(a[1] - b[1])).powi(2));
    [squares.sum::<f64>() / truth.ab.len() as f64, seconds]
}
