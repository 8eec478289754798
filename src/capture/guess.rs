//! Points for photos with poses and nothing else: random places that the cameras look at.

use fastrand::Rng;
use glam::{DMat3, DVec3};

use super::{Camera, Point, View};

/// Number of points.
pub(super) const COUNT: usize = 10_000;

/// Nearest and farthest depth of a point, over the distance from the camera to what all look at.
const DEPTHS: [f64; 2] = [0.4, 3.0];

/// Distance to what is seen, over the cameras' radius, where their axes do not tell.
const FAR: f64 = 5.0;

/// Weight of that distance: as much as axes tell that lie within 2° of each other.
const PARALLEL: f64 = 1e-3;

/// Random points, as many in each view, evenly spread over its picture and the logarithm of the
/// depth; the same for the same views.
pub(super) fn points(views: &[View]) -> Vec<Point> {
    let mean = |of: &dyn Fn(&Camera) -> DVec3| {
        let all = views.iter().map(|view| of(&view.camera));
        all.sum::<DVec3>() / views.len() as f64
    };
    let middle = mean(&Camera::center);
    let radii = views
        .iter()
        .map(|view| view.camera.center().distance(middle));
    let radius = radii.fold(0.0, f64::max);
    let far = if radius > 0.0 { FAR * radius } else { 1.0 };
    // The place nearest to all axes, by least squares.
    let guess = middle + far * mean(&|camera| camera.rotation.row(2));
    let (mut planes, mut sum) = (DMat3::IDENTITY * PARALLEL, PARALLEL * guess);
    for View { camera, .. } in views {
        let axis = camera.rotation.row(2);
        let across =
            DMat3::IDENTITY - DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
        planes += across * (1.0 / views.len() as f64);
        sum += across * camera.center() / views.len() as f64;
    }
    let focus = planes.inverse() * sum;
    let mut rng = Rng::with_seed(0);
    let point = |i: usize| {
        let camera = &views[i % views.len()].camera;
        let distance = Some(camera.depth(focus)).filter(|depth| *depth > 0.0);
        let [near, far] = DEPTHS.map(|share| (share * distance.unwrap_or(far)).ln());
        let depth = (near + (far - near) * rng.f64()).exp();
        let [u, v] = [camera.width, camera.height].map(|side| f64::from(side) * rng.f64());
        let ray = DVec3::new(
            (u - camera.cx) / camera.fx,
            (v - camera.cy) / camera.fy,
            1.0,
        );
        Point {
            position: camera.center() + camera.rotation.transpose() * (depth * ray),
            color: [127; 3],
            track: Vec::new(),
        }
    };
    (0..COUNT).map(point).collect()
}
