//! Scenes of which structure from motion found only a part.

use super::scene::Scene;

/// Share of the points that go missing.
const MISSING: f64 = 0.8;

/// Drops the points farthest from the cameras.
pub fn uncover(scene: &mut Scene) -> String {
    let center = scene.center();
    scene.points.sort_by(|a, b| {
        let [a, b] = [a, b].map(|point| point.position.distance_squared(center));
        a.total_cmp(&b)
    });
    let kept = kept(scene);
    let beyond = scene.points[kept - 1].position.distance(center);
    scene.points.truncate(kept);
    format!("no points farther than {beyond:.3} from the cameras' mean")
}

/// Drops as many, from anywhere.
pub fn thin(scene: &mut Scene, seed: u64) -> String {
    super::random(seed, 0).shuffle(&mut scene.points);
    scene.points.truncate(kept(scene));
    "points thinned evenly".into()
}

fn kept(scene: &Scene) -> usize {
    let count = scene.points.len();
    (count - (MISSING * count as f64) as usize).max(1)
}
