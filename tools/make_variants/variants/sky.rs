//! Scenes with something behind everything that structure from motion found.

use glam::{DVec3, dvec3};

use super::places::{CELL, between, inverse_depths};
use super::scene::{Scene, View};

/// Share of the points that go missing.
const MISSING: f64 = 0.6;

/// Gray of a plain backdrop.
const BACKDROP: u8 = 200;

/// Turns what lies beyond the nearer points into a sky: clouds that depend on nothing but
/// the direction, as what is very far does. Its points are gone.
pub fn open(scene: &mut Scene) -> String {
    format!("sky {}", replace_far(scene, clouds))
}

/// Turns it into one plain gray, as of the paper behind an object in a studio.
pub fn backdrop(scene: &mut Scene) -> String {
    format!("a backdrop {}", replace_far(scene, |_| BACKDROP))
}

/// Paints what lies beyond the nearer points by its direction. Says where that begins.
fn replace_far(scene: &mut Scene, gray: fn(DVec3) -> u8) -> String {
    let center = scene.center();
    scene.points.sort_by(|a, b| {
        let [a, b] = [a, b].map(|point| point.position.distance_squared(center));
        a.total_cmp(&b)
    });
    let depths = inverse_depths(scene);
    let kept = kept(scene);
    let beyond = scene.points[kept - 1].position.distance(center);
    for (view, depths) in scene.views.iter_mut().zip(&depths) {
        paint(view, depths, gray, |place| place.distance(center) > beyond);
    }
    scene.points.truncate(kept);
    format!("instead of what is farther than {beyond:.3} from the cameras' mean")
}

/// Drops as many points, from anywhere; the photos stay.
pub fn thin(scene: &mut Scene, seed: u64) -> String {
    super::random(seed, 0).shuffle(&mut scene.points);
    scene.points.truncate(kept(scene));
    "points thinned evenly".into()
}

fn kept(scene: &Scene) -> usize {
    let count = scene.points.len();
    (count - (MISSING * count as f64) as usize).max(1)
}

/// Paints the cells of a photo whose place is far.
fn paint(
    view: &mut View,
    depths: &[([f64; 2], f64)],
    gray: fn(DVec3) -> u8,
    is_far: impl Fn(DVec3) -> bool,
) {
    if depths.is_empty() {
        return;
    }
    let [columns, rows] = view.camera.size.map(|side| side.div_ceil(CELL));
    let to_world = view.rotation.transpose();
    for (column, row) in (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row))) {
        let middle = [column, row].map(|k| f64::from(k * CELL) + 0.5 * f64::from(CELL));
        let [x, y] = view.camera.ray(middle);
        let seen = dvec3(x, y, 1.0) / between(depths, middle);
        if !is_far(to_world * (seen - view.translation)) {
            continue;
        }
        let [width, height] = view.camera.size;
        for y in row * CELL..((row + 1) * CELL).min(height) {
            for x in column * CELL..((column + 1) * CELL).min(width) {
                let [u, v] = view.camera.ray([x, y].map(|k| f64::from(k) + 0.5));
                let gray = gray((to_world * dvec3(u, v, 1.0)).normalize());
                view.picture.get_pixel_mut(x, y).0 = [gray; 3];
            }
        }
    }
}

/// The gray of the sky in a direction: waves of some 20 to 60 degrees.
fn clouds(direction: DVec3) -> u8 {
    let waves = (7.0 * direction.x + 2.0 * direction.y).sin()
        + (9.0 * direction.y - 4.0 * direction.z).cos()
        + (15.0 * direction.z + 6.0 * direction.x).sin();
    (165.0 + 22.0 * waves) as u8
}
