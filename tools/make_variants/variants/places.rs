//! Approximate position in space of a pixel's content, from the observations around it.

use super::scene::Scene;

/// Side of the cells in which depth is worked out, in pixels.
pub const CELL: u32 = 8;

/// Pixel and inverse depth of what each view observes.
pub fn inverse_depths(scene: &Scene) -> Vec<Vec<([f64; 2], f64)>> {
    observed(scene, |_, depth| depth.recip())
}

/// Pixel and value of what each view observes: of a point, by its index, at some depth.
pub fn observed(scene: &Scene, value: impl Fn(usize, f64) -> f64) -> Vec<Vec<([f64; 2], f64)>> {
    let mut values = vec![Vec::new(); scene.views.len()];
    for (index, point) in scene.points.iter().enumerate() {
        for seen in &point.track {
            let z = scene.views[seen.view].seen(point.position).z;
            if z > 0.0 {
                values[seen.view].push((seen.pixel, value(index, z)));
            }
        }
    }
    values
}

/// Shepard's interpolation: every observation counts by its distance to the power of −4.
pub fn between(values: &[([f64; 2], f64)], [x, y]: [f64; 2]) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for ([u, v], value) in values {
        // A pixel's square keeps an observation at the very place from dividing by zero.
        let distance = (u - x).powi(2) + (v - y).powi(2) + 1.0;
        let weight = distance.powi(-2);
        sum += weight * value;
        weights += weight;
    }
    sum / weights
}
