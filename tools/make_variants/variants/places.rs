//! Where in space a pixel's content is, roughly: from the observations around it.

use super::scene::Scene;

/// Side of the cells in which depth is worked out, in pixels.
pub const CELL: u32 = 8;

/// Pixel and inverse depth of what each view observes.
pub fn inverse_depths(scene: &Scene) -> Vec<Vec<([f64; 2], f64)>> {
    let mut depths = vec![Vec::new(); scene.views.len()];
    for point in &scene.points {
        for seen in &point.track {
            let z = scene.views[seen.view].seen(point.position).z;
            if z > 0.0 {
                depths[seen.view].push((seen.pixel, z.recip()));
            }
        }
    }
    depths
}

/// Shepard's interpolation: every observation counts by its distance to the power of −4.
pub fn between(depths: &[([f64; 2], f64)], [x, y]: [f64; 2]) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for ([u, v], depth) in depths {
        // A pixel's square keeps an observation at the very place from dividing by zero.
        let distance = (u - x).powi(2) + (v - y).powi(2) + 1.0;
        let weight = distance.powi(-2);
        sum += weight * depth;
        weights += weight;
    }
    sum / weights
}
