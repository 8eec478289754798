//! Scenes with something behind everything that structure from motion found.

use glam::{DVec3, dvec3};

use super::places::{CELL, between, inverse_depths, observed};
use super::scene::{Scene, View};

/// Share of the points that go missing.
const MISSING: f64 = 0.6;

/// Gray of a plain backdrop.
const BACKDROP: u8 = 200;

/// Turns what lies beyond the nearer points into a sky: clouds that depend on nothing but
/// the direction, as what is very far does. Its points are gone.
pub fn open(scene: &mut Scene) -> String {
    let center = scene.center();
    sort_from(scene, center);
    let depths = inverse_depths(scene);
    let kept = kept(scene);
    let beyond = scene.points[kept - 1].position.distance(center);
    for (view, depths) in scene.views.iter_mut().zip(&depths) {
        if depths.is_empty() {
            continue;
        }
        let (camera, to_world) = (view.camera.clone(), view.rotation.transpose());
        let translation = view.translation;
        paint(view, clouds, |middle| {
            let [x, y] = camera.ray(middle);
            let seen = dvec3(x, y, 1.0) / between(depths, middle);
            (to_world * (seen - translation)).distance(center) > beyond
        });
    }
    scene.points.truncate(kept);
    format!("sky instead of what is farther than {beyond:.3} from the cameras' mean")
}

/// Turns what lies outside of a ball around what the cameras look at into one plain gray, as of
/// the paper behind an object in a studio. Its points are gone. Observations, not depths between
/// them, tell what a ray through the ball shows, or photos would contradict each other.
pub fn backdrop(scene: &mut Scene) -> String {
    let center = scene.aim();
    sort_from(scene, center);
    let kept = kept(scene);
    let radius = scene.points[kept - 1].position.distance(center);
    let sides = observed(scene, |index, _| if index < kept { 1.0 } else { -1.0 });
    for (view, sides) in scene.views.iter_mut().zip(&sides) {
        let (camera, middle) = (view.camera.clone(), view.seen(center));
        let plain = |_| BACKDROP;
        paint(view, plain, |pixel| {
            let [x, y] = camera.ray(pixel);
            let passes = middle.cross(dvec3(x, y, 1.0).normalize()).length();
            passes > radius || between(sides, pixel) < 0.0
        });
    }
    scene.points.truncate(kept);
    format!("a backdrop instead of what is farther than {radius:.3} from what the cameras look at")
}

/// The nearest points first.
fn sort_from(scene: &mut Scene, center: DVec3) {
    scene.points.sort_by(|a, b| {
        let [a, b] = [a, b].map(|point| point.position.distance_squared(center));
        a.total_cmp(&b)
    });
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

/// Paints the cells of a photo whose middle shows something far, by the direction.
fn paint(view: &mut View, gray: impl Fn(DVec3) -> u8, is_far: impl Fn([f64; 2]) -> bool) {
    let [columns, rows] = view.camera.size.map(|side| side.div_ceil(CELL));
    let to_world = view.rotation.transpose();
    for (column, row) in (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row))) {
        if !is_far([column, row].map(|k| f64::from(k * CELL) + 0.5 * f64::from(CELL))) {
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
