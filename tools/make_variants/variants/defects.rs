//! Things on the photos that are not in the scene.

use fastrand::Rng;
use image::{GrayImage, Luma};

use super::brush::Stroke;
use super::scene::Scene;

/// Share of a photo that specks, hairs and scratches cover.
pub const DUST_AREA: f64 = 0.015;

/// The same of worn film.
pub const HEAVY_DUST_AREA: f64 = 0.05;

/// One training photo in so many has a passer-by.
const PASSER_BY_STEP: usize = 3;

/// Dust on so much of every training photo, a passer-by on each third.
pub fn dust(scene: &mut Scene, area: f64, seed: u64) -> String {
    for (order, (index, view)) in scene.training().enumerate() {
        let mut random = super::random(seed, index);
        let size = view.camera.size.map(f64::from);
        if order % PASSER_BY_STEP == 1 {
            for stroke in passer_by(&mut random, size) {
                stroke.paint(&mut view.picture);
            }
        }
        let mut covered = 0.0;
        while covered < area * size[0] * size[1] {
            covered += speck(&mut random, size).paint(&mut view.picture);
        }
    }
    format!(
        "dust on {} % of each training photo, held-out ones clean",
        100.0 * area
    )
}

/// A watermark in the corner and a passer-by on every training photo, and their masks.
pub fn masked(scene: &mut Scene, seed: u64) -> String {
    for (index, view) in scene.training() {
        let mut random = super::random(seed, index);
        let size = view.camera.size;
        let mut strokes = passer_by(&mut random, size.map(f64::from));
        strokes.extend(watermark(size.map(f64::from)));
        let mut mask = GrayImage::from_pixel(size[0], size[1], Luma([255]));
        for stroke in strokes {
            stroke.paint(&mut view.picture);
            stroke.mask(&mut mask);
        }
        view.mask = Some(mask);
    }
    "a watermark and a passer-by on each training photo, held-out ones clean".into()
}

/// A speck, a hair or a scratch; sizes are those of film 324 pixels wide.
fn speck(random: &mut Rng, [width, height]: [f64; 2]) -> Stroke {
    let unit = width / 324.0;
    let start = [random.f64() * width, random.f64() * height];
    let (places, radius) = match random.u8(..10) {
        0 => (scratch(random, start, height), 0.5 * unit),
        1..4 => (hair(random, start, unit), (0.5 + 0.4 * random.f64()) * unit),
        _ => (vec![start], (0.6 + 2.0 * random.f64().powi(2)) * unit),
    };
    Stroke {
        places,
        radius,
        tone: if random.bool() { 245.0 } else { 12.0 },
        opacity: 0.7 + 0.3 * random.f64(),
    }
}

/// Down the photo, as dirt in a camera's gate leaves it.
fn scratch(random: &mut Rng, [x, y]: [f64; 2], height: f64) -> Vec<[f64; 2]> {
    let length = (0.2 + 0.4 * random.f64()) * height;
    vec![
        [x, y],
        [x + 0.02 * (random.f64() - 0.5) * length, y + length],
    ]
}

/// A curl.
fn hair(random: &mut Rng, start: [f64; 2], unit: f64) -> Vec<[f64; 2]> {
    let mut angle = std::f64::consts::TAU * random.f64();
    let bend = 0.8 * (random.f64() - 0.5);
    let mut places = vec![start];
    for _ in 0..random.usize(6..16) {
        angle += bend + 0.3 * (random.f64() - 0.5);
        let [x, y] = places[places.len() - 1];
        places.push([x + 2.0 * unit * angle.cos(), y + 2.0 * unit * angle.sin()]);
    }
    places
}

/// A figure of head, coat and legs, somewhere on the lower part of the photo.
fn passer_by(random: &mut Rng, [width, height]: [f64; 2]) -> Vec<Stroke> {
    let tall = (0.4 + 0.15 * random.f64()) * height;
    let feet = [
        (0.15 + 0.7 * random.f64()) * width,
        (0.75 + 0.2 * random.f64()) * height,
    ];
    let coat = 20.0 + 130.0 * random.f64();
    let part = |places: &[[f64; 2]], radius: f64, tone: f64| Stroke {
        places: places
            .iter()
            .map(|[x, y]| [feet[0] + x * tall, feet[1] - y * tall])
            .collect(),
        radius: radius * tall,
        tone,
        opacity: 1.0,
    };
    vec![
        part(
            &[[-0.09, 0.03], [0.0, 0.45], [0.09, 0.03]],
            0.05,
            0.6 * coat,
        ),
        part(&[[-0.02, 0.45], [0.02, 0.72]], 0.13, coat),
        part(&[[-0.14, 0.68], [-0.18, 0.42]], 0.045, coat + 15.0),
        part(&[[0.14, 0.68], [0.16, 0.4]], 0.045, coat + 15.0),
        part(&[[0.0, 0.93]], 0.07, 190.0),
    ]
}

/// A ring with a bar under it, bottom right, the same on every photo.
fn watermark([width, height]: [f64; 2]) -> Vec<Stroke> {
    let (r, x, y) = (0.07 * width, 0.88 * width, 0.82 * height);
    let ring = (0..=24).map(|k| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / 24.0).sin_cos();
        [x + r * cos, y + r * sin]
    });
    let line = |places: Vec<[f64; 2]>| Stroke {
        places,
        radius: 0.2 * r,
        tone: 235.0,
        opacity: 0.8,
    };
    vec![
        line(ring.collect()),
        line(vec![[x - r, y + 1.6 * r], [x + r, y + 1.6 * r]]),
    ]
}
