//! Depth, flow and consistency of a drawn scene whose geometry is known: a slanted wall.

use glam::{DMat3, DVec3};
use gs_chroma::{
    capture::Camera,
    measure::{Consistency, DepthSteps, Flow, visible},
    raster::{Field, Geometry, Renderer},
    splats::{ShField, Splats, sh},
};

use crate::kernels::harness::{gpu, raster};

/// Spacing of the wall's Gaussians in world units.
const STEP: f64 = 0.05;
/// Where the world lies: far from its origin.
const PLACE: DVec3 = DVec3::new(500.0, -300.0, 800.0);
/// The wall's depth grows by this much to the right.
const SLANT: f64 = 0.4;

/// The wall: x, y in [-2, 2], z = 5 + slant · x.
fn wall() -> (Splats, ShField) {
    let mut splats = Splats::default();
    let mut ab = ShField {
        degree: 0,
        channels: 2,
        coefficients: Vec::new(),
    };
    for i in 0..=80 {
        for j in 0..=80 {
            let (x, y) = (STEP * f64::from(i) - 2.0, STEP * f64::from(j) - 2.0);
            let mean = PLACE + DVec3::new(x, y, 5.0 + SLANT * x);
            splats.means.push(mean.as_vec3().to_array());
            splats.quats.push([1.0, 0.0, 0.0, 0.0]);
            splats.log_scales.push([(0.7 * STEP).ln() as f32; 3]);
            splats.opacity_logits.push(4.0);
            let colors = [30.0 * (3.0 * x).sin(), 20.0 * (2.0 * y).cos()];
            ab.coefficients.extend(colors.map(|c| (c / sh::C0) as f32));
        }
    }
    splats.sh = ShField::zeros(splats.len(), 0, 1);
    (splats, ab)
}

fn camera(center: DVec3, turn: f64) -> Camera {
    let rotation = DMat3::from_rotation_y(turn);
    Camera {
        width: 96,
        height: 72,
        fx: 90.0,
        fy: 90.0,
        cx: 48.0,
        cy: 36.0,
        rotation,
        translation: -(rotation * (PLACE + center)),
    }
}

/// Depth of the wall on the ray of a pixel, along the camera's z axis.
fn true_depth(camera: &Camera, index: usize) -> f64 {
    let (u, v) = ((index % 96) as f64 + 0.5, (index / 96) as f64 + 0.5);
    let ray = DVec3::new(
        (u - camera.cx) / camera.fx,
        (v - camera.cy) / camera.fy,
        1.0,
    );
    let direction = camera.rotation.transpose() * ray;
    // z - slant · x = 5 in the wall's coordinates.
    let normal = DVec3::new(-SLANT, 0.0, 1.0);
    (5.0 - normal.dot(camera.center() - PLACE)) / normal.dot(direction)
}

#[test]
fn a_walls_depth_and_the_flow_between_two_views_of_it() {
    let (splats, ab) = wall();
    let cameras = [
        camera(DVec3::ZERO, 0.0),
        camera(DVec3::new(0.5, -0.2, 0.3), 0.12),
    ];
    let drawn = cameras.each_ref().map(|camera| {
        let steps = DepthSteps::new(&splats, camera);
        let fields = [&ab].into_iter().chain(&steps.fields);
        let fields = fields.map(|field| Field::upload(gpu(), field).unwrap());
        let geometry = Geometry::upload(gpu(), &splats).unwrap();
        let mut renderer = Renderer::new(raster(), geometry, fields.collect(), 0.01).unwrap();
        let pictures = renderer.render(camera).unwrap();
        let again = renderer.with_one_list().render(camera).unwrap();
        assert!(pictures == again, "one list for all fields");
        let depth = steps.median(&pictures[1..], 96 * 72);
        (depth, pictures[0].pixels.as_chunks().0.to_vec())
    });
    let mut known = 0;
    for (camera, (depth, _)) in cameras.iter().zip(&drawn) {
        for (i, &z) in depth.iter().enumerate().filter(|(_, z)| !z.is_nan()) {
            let want = true_depth(camera, i);
            // Gaussians have a thickness of 0.035, and steps are 0.05 apart.
            assert!((f64::from(z) - want).abs() < 0.08, "{i}: {z} {want}");
            known += 1;
        }
    }
    // The wall fills most of both pictures, and not all.
    assert!(known > 6000 && known < 2 * 96 * 72, "{known}");

    let forward = Flow::geometric(&cameras[0], &cameras[1], &drawn[0].0);
    let backward = Flow::geometric(&cameras[1], &cameras[0], &drawn[1].0);
    let exact: Vec<f32> = (0..96 * 72)
        .map(|i| true_depth(&cameras[0], i) as f32)
        .collect();
    let exact = Flow::geometric(&cameras[0], &cameras[1], &exact);
    for (ours, want) in forward.vectors.iter().zip(&exact.vectors) {
        if !ours[0].is_nan() {
            let off = (ours[0] - want[0]).hypot(ours[1] - want[1]);
            assert!(off < 0.15, "{ours:?} {want:?}");
        }
    }

    let seen = visible(&forward, &backward);
    let of = |flow: &Flow| {
        let mut sum = Consistency::default();
        sum.add(&drawn[0].1, &drawn[1].1, [96, 72], flow, &seen);
        assert!(sum.visible_share() > 0.4, "{}", sum.visible_share());
        sum.rms().unwrap()
    };
    let right = of(&forward);
    let still = of(&Flow::geometric(&cameras[0], &cameras[0], &drawn[0].0));
    println!("{right:.3} with the flow, {still:.3} without");
    // The colors stand on the wall: what is left is the drawing's own.
    assert!(right < 0.6 && still > 4.0, "{right} {still}");
}
