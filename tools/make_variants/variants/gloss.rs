//! Brightness that changes with the direction of view.

use std::f64::consts::TAU;

use glam::{DVec3, dvec3};

use super::places::{CELL, between, inverse_depths};
use super::resample::byte;
use super::scene::{Scene, View};

/// Logarithm of the largest gain: patches vary between 0.74 and 1.35.
const STRENGTH: f64 = 0.3;

/// Patches are as large as this part of the scene's width.
const PATCH: f64 = 0.5;

/// Multiplies each photo by `exp(STRENGTH · s(X) · h)`: `X` is the place that a pixel
/// shows, `s` a smooth pattern in space whose mean is zero, and `h` runs from −1 at one
/// end of the cameras to 1 at the other. No gain of whole photos explains that, and a
/// Gaussian whose brightness depends on direction does.
///
/// `X` comes from inverse depths between those of the view's observations. It need not
/// be exact: pattern and depth are smooth.
pub fn polish(scene: &mut Scene, seed: u64) -> String {
    let places = middle_half(scene);
    let mut random = super::random(seed, 0);
    let phases: [f64; 3] = std::array::from_fn(|_| TAU * random.f64());
    let sides = sides(scene);
    let depths: Vec<Vec<([f64; 2], f64)>> = inverse_depths(scene);
    for ((view, side), depths) in scene.views.iter_mut().zip(sides).zip(depths) {
        let pattern = |place: DVec3| {
            let waves = TAU / (2.0 * PATCH * places.width) * (place - places.center);
            let waves = [
                waves.x + phases[0],
                waves.y + phases[1],
                waves.z + phases[2],
            ];
            // Of two factors in [−1, 1]: a checkerboard with soft edges, whichever way it lies.
            (waves[0].sin() + waves[2].cos()).clamp(-1.0, 1.0) * waves[1].cos()
        };
        shade(view, &depths, |place| {
            (STRENGTH * side * pattern(place)).exp()
        });
    }
    format!(
        "patches vary by {:.2} to {:.2} with the direction of view",
        (-STRENGTH).exp(),
        STRENGTH.exp()
    )
}

/// Center and width of most of the scene.
struct Places {
    center: DVec3,
    width: f64,
}

/// The medians of the points' coordinates, and twice the median distance from there.
fn middle_half(scene: &Scene) -> Places {
    let median = |mut values: Vec<f64>| {
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let along = |axis: usize| scene.points.iter().map(|p| p.position[axis]).collect();
    let center = dvec3(median(along(0)), median(along(1)), median(along(2)));
    let distances = scene.points.iter().map(|p| p.position.distance(center));
    Places {
        center,
        width: 2.0 * median(distances.collect()),
    }
}

/// Position of each camera between the two that are farthest apart, −1 to 1, of mean zero before it
/// is clamped.
fn sides(scene: &Scene) -> Vec<f64> {
    let centers: Vec<DVec3> = scene.views.iter().map(View::center).collect();
    let pairs = centers
        .iter()
        .flat_map(|a| centers.iter().map(move |b| *b - *a));
    let axis = pairs.max_by(|a, b| a.length().total_cmp(&b.length()));
    let axis = axis.unwrap_or(DVec3::X).normalize_or(DVec3::X);
    let middle = scene.center();
    let along: Vec<f64> = centers.iter().map(|c| (*c - middle).dot(axis)).collect();
    let largest = along.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
    along.iter().map(|v| v / largest).collect()
}

/// Multiplies the photo by the gain of the place that each pixel shows.
fn shade(view: &mut View, depths: &[([f64; 2], f64)], gain: impl Fn(DVec3) -> f64) {
    if depths.is_empty() {
        return;
    }
    let [width, height] = view.camera.size;
    let [columns, rows] = [width, height].map(|side| side.div_ceil(CELL) + 1);
    let mut gains = Vec::with_capacity((columns * rows) as usize);
    for row in 0..rows {
        for column in 0..columns {
            let pixel = [column, row].map(|k| f64::from(k * CELL));
            let [x, y] = view.camera.ray(pixel);
            let seen = dvec3(x, y, 1.0) / between(depths, pixel);
            gains.push(gain(view.rotation.transpose() * (seen - view.translation)));
        }
    }
    let at = |column: u32, row: u32| gains[(row * columns + column) as usize];
    for (x, y, pixel) in view.picture.enumerate_pixels_mut() {
        let [u, v] = [x, y].map(|k| (f64::from(k) + 0.5) / f64::from(CELL));
        let (column, row) = (u as u32, v as u32);
        let (s, t) = (u.fract(), v.fract());
        let gain = (1.0 - t) * ((1.0 - s) * at(column, row) + s * at(column + 1, row))
            + t * ((1.0 - s) * at(column, row + 1) + s * at(column + 1, row + 1));
        pixel.0 = pixel.0.map(|value| byte(gain * f64::from(value)));
    }
}
