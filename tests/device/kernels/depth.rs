//! Depth, flow and consistency of a drawn scene whose geometry is known: a slanted wall.

use glam::{DMat3, DVec3};
use gs_chroma::{
    capture::Camera,
    low_level::{
        doctor::stage,
        oracle::random::{opaque_stack, random_scene_before, random_view},
    },
    measure::{Consistency, Flow, visible},
    raster::SceneRenderer,
    splats::{ShField, Splats, sh},
};

use crate::kernels::harness::raster;

/// Spacing of the wall's Gaussians in world units.
const STEP: f64 = 0.05;
/// Position of the world: far from its origin.
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
    let mut renderer = SceneRenderer::new(&raster(), &splats, &[&ab], 0.01).unwrap();
    let drawn = cameras.each_ref().map(|camera| {
        let pictures = renderer.render(camera).unwrap();
        let depth = renderer.depth(camera).unwrap();
        (depth, pictures[0].pixels.as_chunks().0.to_vec())
    });
    let mut known = 0;
    for (camera, (depth, _)) in cameras.iter().zip(&drawn) {
        for (i, &z) in depth.iter().enumerate().filter(|(_, z)| !z.is_nan()) {
            let want = true_depth(camera, i);
            // Gaussians have a thickness of 0.035.
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

/// Depths that split a scene into equal parts, the last beyond everything; fields of two channels
/// that draw how opaque what is no farther than each is.
fn steps(splats: &Splats, camera: &Camera) -> (Vec<f64>, Vec<ShField>) {
    let depth = |mean: &[f32; 3]| camera.depth(DVec3::from(mean.map(f64::from)));
    let seen: Vec<f64> = splats.means.iter().map(depth).collect();
    let mut sorted = seen.clone();
    sorted.sort_by(f64::total_cmp);
    let of_step = |k: usize| sorted.get(k * sorted.len() / 31);
    let depths: Vec<f64> = (0..32)
        .map(|k| of_step(k).copied().unwrap_or(f64::INFINITY))
        .collect();
    let one = (1.0 / sh::C0) as f32;
    let field = |pair: &[f64; 2]| ShField {
        degree: 0,
        channels: 2,
        coefficients: (seen.iter())
            .flat_map(|z| pair.map(|depth| if *z <= depth { one } else { 0.0 }))
            .collect(),
    };
    let fields = depths.as_chunks().0.iter().map(field).collect();
    (depths, fields)
}

/// The pictures of what lies before each depth tell between which two the median is.
#[test]
fn the_median_lies_between_the_depths_where_opacity_passes_half() {
    let random = (0..4).map(|seed| {
        let view = random_view(seed);
        (random_scene_before::<1>(&view, seed, 150, 0), view)
    });
    let stacks = (8..10).map(|seed| opaque_stack::<1>(seed, 60, 0));
    let mut scenes: Vec<(Splats, Camera)> = (random.chain(stacks))
        .map(|(scene, view)| (stage::splats(&scene), stage::camera(&view)))
        .collect();
    scenes.push((wall().0, camera(DVec3::new(0.5, -0.2, 0.3), 0.12)));
    let (mut known, mut astray) = (0, 0);
    for (splats, camera) in &scenes {
        let (depths, fields) = steps(splats, camera);
        let fields: Vec<&ShField> = fields.iter().collect();
        let mut renderer = SceneRenderer::new(&raster(), splats, &fields, 0.01).unwrap();
        let pictures = renderer.render(camera).unwrap();
        for (pixel, &depth) in renderer.depth(camera).unwrap().iter().enumerate() {
            let at = |step: usize| pictures[step / 2].pixels[2 * pixel + step % 2];
            astray += usize::from(depth.is_nan() != (at(31) < 0.5));
            // Half of the opacity, where that is nearly one.
            let above = (0..32).find(|&step| at(step) >= 0.5 * at(31)).unwrap();
            if at(31) < 0.99 {
                continue;
            }
            let nearest = if above == 0 { 0.0 } else { depths[above - 1] };
            let between = nearest * 0.9999..=depths[above] * 1.0001;
            known += 1;
            astray += usize::from(!between.contains(&f64::from(depth)));
        }
    }
    // A pixel at which opacity is half but for rounding may fall to either side.
    assert!(known > 5000 && astray < 20, "{known} {astray}");
}

/// Lists are made once for a view, and anew for another one or another size.
#[test]
fn a_renderer_draws_the_view_that_it_is_given() {
    let (splats, _) = wall();
    let fields = [0, 2].map(|degree| random_field(&splats, degree));
    let cameras = [0.12, -0.2].map(|angle| camera(DVec3::new(0.5, -0.2, 0.3), angle));
    let mut renderer =
        SceneRenderer::new(&raster(), &splats, &[&fields[0], &fields[1]], 0.01).unwrap();
    let shown = cameras.each_ref().map(|camera| {
        let mut alone = |field| {
            let mut renderer = SceneRenderer::new(&raster(), &splats, &[field], 0.01).unwrap();
            renderer.render(camera).unwrap().remove(0)
        };
        let apart: Vec<_> = fields.iter().map(&mut alone).collect();
        assert_eq!(renderer.render(camera).unwrap(), apart);
        renderer.depth(camera).unwrap()
    });
    assert_ne!(bits(&shown[0]), bits(&shown[1]));
    // The view before this one was the other.
    assert_eq!(bits(&renderer.depth(&cameras[0]).unwrap()), bits(&shown[0]));
}

fn random_field(splats: &Splats, degree: u32) -> ShField {
    let mut field = ShField::zeros(splats.len(), degree, 1);
    for (i, value) in field.coefficients.iter_mut().enumerate() {
        *value = (i as f32 * 0.7).sin();
    }
    field
}

fn bits(depths: &[f32]) -> Vec<u32> {
    depths.iter().map(|depth| depth.to_bits()).collect()
}
