//! The slopes of the training's loss against differences of it.

use glam::{DMat3, DVec3};
use gs_chroma::capture::Camera;

use crate::{
    grid::Grid,
    train::{Pixel, Slopes, photo_loss, variation},
};

fn camera() -> Camera {
    Camera {
        width: 12,
        height: 9,
        fx: 10.0,
        fy: 11.0,
        cx: 6.0,
        cy: 4.5,
        rotation: DMat3::from_rotation_y(0.2),
        translation: DVec3::new(0.1, -0.1, 4.0),
    }
}

/// A grid of random values, some densities below 0, of which half may show.
fn cloud(random: &mut fastrand::Rng) -> Grid {
    let rotation = DMat3::from_rotation_x(0.3);
    let mut grid = Grid::empty(rotation, DVec3::splat(-1.2), 0.4, [7, 6, 8]);
    for value in &mut grid.values {
        *value = random.f64() - 0.4;
    }
    for live in &mut grid.live {
        *live = random.f64() < 0.5;
    }
    grid.occupy();
    grid
}

#[test]
fn slopes_are_those_of_the_loss() {
    let mut random = fastrand::Rng::with_seed(7);
    let (mut grid, camera) = (cloud(&mut random), [camera()]);
    let pixels: Vec<Pixel> = (0..12 * 9)
        .map(|k| (0, [k % 12, k / 12], random.f64()))
        .collect();
    let mut slopes = Slopes::new(grid.live.len());
    let error = photo_loss(&grid, &camera, &pixels, pixels.len(), &mut slopes);
    assert!(error > 0.01, "{error}");
    // The same vertices before and after.
    let touched = slopes.touched.clone();
    let loss = |grid: &Grid| {
        let mut slopes = Slopes::new(grid.live.len());
        let photos = photo_loss(grid, &camera, &pixels, pixels.len(), &mut slopes);
        slopes.touched.clone_from(&touched);
        photos + variation(grid, &mut slopes)
    };
    variation(&grid, &mut slopes);
    let largest = slopes
        .values
        .iter()
        .fold(0.0_f64, |most, slope| most.max(slope.abs()));
    let mut compared = 0;
    for k in (0..grid.values.len()).step_by(3) {
        if slopes.values[k] == 0.0 {
            continue;
        }
        let (before, by) = (grid.values[k], 1e-6);
        grid.values[k] = before + by;
        let above = loss(&grid);
        grid.values[k] = before - by;
        let below = loss(&grid);
        grid.values[k] = before;
        let difference = (above - below) / (2.0 * by);
        let off = (difference - slopes.values[k]).abs();
        assert!(
            off < 1e-5 * largest,
            "{k}: {difference}, not {}",
            slopes.values[k]
        );
        compared += 1;
    }
    assert!(compared > 100, "{compared}");
}
