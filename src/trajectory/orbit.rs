//! A way around what a scene shows, right side up.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};

use super::looking;
use crate::{capture::Camera, splats::Splats};

/// Weight of cameras held upright in the choice of the up direction, against cameras held level:
/// enough to decide where these leave it open, as where all look one way.
const UPRIGHT: f64 = 0.05;

/// Weight of points that cameras see in the choice of the focus, against the meeting point of their
/// axes: enough to decide where these are parallel.
const SEEN: f64 = 0.05;

/// Length of the mean of all directions from which on all cameras look one way: within about 30°
/// of each other.
const ONE_WAY: f64 = 0.87;

/// Cameras that leave out no larger part of the circle, in radians, go all around.
const GAP: f64 = TAU / 3.0;

/// Cameras that look one way are left from their middle by as much as they spread, yet by no less
/// and no more than these shares of the distance of what they see: enough to show depth, and not
/// so much that sides show that no photo does.
const SWAY: [f64; 2] = [0.03, 0.25];

/// Elevation from which a ball is looked at, in radians: 15°.
const RISE: f64 = TAU / 24.0;

/// Gaussians that are asked where they are, at most.
const SAMPLES: usize = 20_000;

/// Rounds of inverse iteration: each brings the answer closer by the ratio of two eigenvalues.
const ROUNDS: usize = 100;

/// Center and axes of the orbit, seen from above.
struct OrbitCenter {
    /// Point that cameras look at.
    focus: DVec3,
    up: DVec3,
    /// Across, right of the middle direction.
    right: DVec3,
    /// Away from the middle camera, level.
    ahead: DVec3,
}

/// `frames` cameras, a closed way around what the given ones look at, at their usual height and
/// distance, with their sky up. Cameras all around it: a circle. Cameras on one side: to and fro
/// among them. Cameras that look one way: a loop before it, no farther than they are apart.
/// Cameras that look away from each other, as in a room: a circle that looks outward. All have the first
/// camera's lens and size. `points` are places that are seen, such as COLMAP's; there may be none.
///
/// # Panics
/// Without a camera.
pub fn orbit_of_cameras(cameras: &[&Camera], points: &[DVec3], frames: usize) -> Vec<Camera> {
    let forward = |camera: &Camera| camera.rotation.row(2);
    let like = cameras[0];
    let mean = |value: &dyn Fn(&Camera) -> DVec3| {
        cameras.iter().map(|camera| value(camera)).sum::<DVec3>() / cameras.len() as f64
    };
    let up = up_of(cameras);
    let seen: Vec<DVec3> = (cameras.iter())
        .filter_map(|camera| Some(camera.center() + depth_of(camera, points)? * forward(camera)))
        .collect();
    let focus = focus_of(cameras, &seen);
    let middle = mean(&Camera::center);
    let towards = mean(&forward);
    let part = |frame: usize| TAU * frame as f64 / frames.max(1) as f64;
    if towards.length() > ONE_WAY {
        let place = OrbitCenter::new(focus, up, towards);
        let distance = (focus - middle).length();
        let below = place.right.cross(towards.normalize());
        let sway = |axis: DVec3| {
            let square = |camera: &&Camera| (camera.center() - middle).dot(axis).powi(2);
            let spread = cameras.iter().map(square).sum::<f64>() / cameras.len() as f64;
            let [least, most] = SWAY.map(|share| share * distance);
            spread.sqrt().clamp(least, most)
        };
        let [across, down] = [sway(place.right), sway(below)];
        return (0..frames)
            .map(|frame| {
                let (sin, cos) = part(frame).sin_cos();
                let at = middle + across * cos * place.right + down * sin * below;
                looking(at, focus, up, like)
            })
            .collect();
    }
    let place = OrbitCenter::new(focus, up, focus - like.center());
    let around: Vec<[f64; 3]> = cameras.iter().map(|c| place.around(c.center())).collect();
    let median_of = |k: usize| median(around.iter().map(|at| at[k]).collect());
    let [distance, height] = [median_of(1), median_of(2)];
    let looks_at = |camera: &&Camera| (focus - camera.center()).dot(forward(camera));
    let outward = median(cameras.iter().map(looks_at).collect()) < 0.0;
    let (begin, gap) = gap_of(around.iter().map(|at| at[0]).collect());
    (0..frames)
        .map(|frame| {
            let angle = match gap > GAP {
                // From the end of the gap half of what is left, and to and fro.
                true => begin + gap + 0.5 * (TAU - gap) * (1.0 + part(frame).sin()),
                false => part(frame),
            };
            let at = place.at(angle, distance, height);
            let target = match outward {
                true => 2.0 * at - place.at(angle, 0.0, height),
                false => focus,
            };
            looking(at, target, up, like)
        })
        .collect()
}

/// The middle of Gaussians, and the distance from it within which a `share` of them lies. Each
/// counts by its opacity; of more than [`SAMPLES`] an even choice does.
pub fn ball_of_splats(splats: &Splats, share: f64) -> (DVec3, f64) {
    let step = splats.len().div_ceil(SAMPLES).max(1);
    let counted: Vec<(DVec3, f64)> = (splats.means.iter().zip(splats.opacities()))
        .step_by(step)
        .map(|(&mean, opacity)| (DVec3::from(mean.map(f64::from)), opacity))
        .collect();
    let up_to = |share: f64, value: &dyn Fn(DVec3) -> f64| {
        weighted_quantile(
            counted.iter().map(|&(at, w)| (value(at), w)).collect(),
            share,
        )
    };
    let middle = DVec3::from([0, 1, 2].map(|axis| up_to(0.5, &|place| place[axis])));
    let radius = up_to(share, &|place| place.distance(middle));
    (middle, radius.max(f64::from(f32::MIN_POSITIVE)))
}

/// `frames` cameras, a circle around a ball that fills their picture, from a little above. Up is
/// −y, as in files in COLMAP's coordinates whose first camera was held upright.
pub fn orbit_of_ball((middle, radius): (DVec3, f64), lens: &Camera, frames: usize) -> Vec<Camera> {
    let half = [
        (0.5 * f64::from(lens.width) / lens.fx).atan(),
        (0.5 * f64::from(lens.height) / lens.fy).atan(),
    ];
    let distance = radius / half[0].min(half[1]).sin();
    let place = OrbitCenter::new(middle, DVec3::NEG_Y, DVec3::Z);
    let (rise, out) = RISE.sin_cos();
    (0..frames)
        .map(|frame| {
            let angle = TAU * frame as f64 / frames.max(1) as f64;
            let at = place.at(angle, distance * out, distance * rise);
            looking(at, middle, place.up, lens)
        })
        .collect()
}

impl OrbitCenter {
    fn new(focus: DVec3, up: DVec3, ahead: DVec3) -> Self {
        let level = (ahead - ahead.dot(up) * up).try_normalize();
        let ahead = level.unwrap_or_else(|| up.any_orthonormal_vector());
        Self {
            focus,
            up,
            right: ahead.cross(up),
            ahead,
        }
    }

    /// Angle around the focus, 0 opposite `ahead`; distance from its axis; height above it.
    fn around(&self, at: DVec3) -> [f64; 3] {
        let from = at - self.focus;
        let [right, back] = [from.dot(self.right), -from.dot(self.ahead)];
        [right.atan2(back), right.hypot(back), from.dot(self.up)]
    }

    /// The reverse of [`Self::around`].
    fn at(&self, angle: f64, distance: f64, height: f64) -> DVec3 {
        let (sin, cos) = angle.sin_cos();
        self.focus + distance * (sin * self.right - cos * self.ahead) + height * self.up
    }
}

/// Up direction: across the sides of all pictures, which photographers hold level, and where these
/// leave it open as pictures are held.
fn up_of(cameras: &[&Camera]) -> DVec3 {
    let upward = |camera: &Camera| -camera.rotation.row(1);
    let mean: DVec3 = cameras.iter().map(|camera| upward(camera)).sum();
    // Photos from straight above may be upright either way.
    let held = match mean.length() > 0.1 * cameras.len() as f64 {
        true => mean.normalize(),
        false => upward(cameras[0]),
    };
    let outer = |v: DVec3| DMat3::from_cols(v.x * v, v.y * v, v.z * v);
    let level = (cameras.iter()).fold(DMat3::ZERO, |sum, camera| {
        sum + outer(camera.rotation.row(0))
    });
    let level = level * (1.0 / cameras.len() as f64);
    let tilt = level + (DMat3::IDENTITY - outer(held)) * UPRIGHT;
    // A little more makes it invertible, and moves no eigenvector.
    let inverse = (tilt + DMat3::IDENTITY * 1e-9).inverse();
    let up = (0..ROUNDS).fold(held, |v, _| (inverse * v).try_normalize().unwrap_or(held));
    if up.dot(held) < 0.0 { -up } else { up }
}

/// The median depth of the points that a camera sees.
fn depth_of(camera: &Camera, points: &[DVec3]) -> Option<f64> {
    let seen = points
        .iter()
        .filter(|&&point| camera.pixel_of(point).is_some());
    let depths: Vec<f64> = seen.map(|&point| camera.depth(point)).collect();
    (!depths.is_empty()).then(|| median(depths))
}

/// The place that is closest to what all cameras look along, in least squares, and a little to
/// what they see.
fn focus_of(cameras: &[&Camera], seen: &[DVec3]) -> DVec3 {
    let (mut left, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for camera in cameras {
        let axis = camera.rotation.row(2);
        let across =
            DMat3::IDENTITY - DMat3::from_cols(axis.x * axis, axis.y * axis, axis.z * axis);
        left += across;
        right += across * camera.center();
    }
    // Where nothing is seen, what lies a step ahead: far enough to tell a direction.
    let ahead: Vec<DVec3> = match seen.is_empty() {
        true => (cameras.iter())
            .map(|c| c.center() + c.rotation.row(2))
            .collect(),
        false => seen.to_vec(),
    };
    for place in &ahead {
        left += DMat3::IDENTITY * SEEN;
        right += SEEN * *place;
    }
    left.inverse() * right
}

/// Start and size of the largest gap between angles, in radians.
fn gap_of(mut angles: Vec<f64>) -> (f64, f64) {
    angles.sort_by(f64::total_cmp);
    let next = |i: usize| match angles.get(i + 1) {
        Some(next) => *next,
        None => angles[0] + TAU,
    };
    let gaps = (0..angles.len()).map(|i| (angles[i], next(i) - angles[i]));
    gaps.max_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0.0, TAU))
}

/// The upper median.
fn median(values: Vec<f64>) -> f64 {
    weighted_quantile(values.into_iter().map(|value| (value, 1.0)).collect(), 0.5)
}

/// The first value up to which more than a share of the weight lies; 0 without any.
fn weighted_quantile(mut values: Vec<(f64, f64)>, share: f64) -> f64 {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = values.iter().map(|(_, weight)| weight).sum();
    let mut sum = 0.0;
    let found = values.iter().find(|(_, weight)| {
        sum += weight;
        sum > share * total
    });
    found.or(values.last()).map_or(0.0, |(value, _)| *value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::lens;

    /// A world that is not upright in its own coordinates.
    fn tilted(v: DVec3) -> DVec3 {
        DMat3::from_rotation_z(0.4) * DMat3::from_rotation_x(0.7) * v
    }

    const UP: DVec3 = DVec3::new(0.0, 1.0, 0.0);

    fn placed(place: DVec3, target: DVec3) -> Camera {
        let [place, target, up] = [place, target, UP].map(tilted);
        looking(place, target, up, &lens([64, 48], 50.0))
    }

    fn orbit(cameras: &[Camera], points: &[DVec3], frames: usize) -> Vec<Camera> {
        orbit_of_cameras(&cameras.iter().collect::<Vec<_>>(), points, frames)
    }

    /// On a circle of radius 4 at height 1.5, looking at the origin.
    fn ring(angles: impl Iterator<Item = f64>) -> Vec<Camera> {
        let place = |a: f64| DVec3::new(4.0 * a.cos(), 1.5, 4.0 * a.sin());
        angles.map(|a| placed(place(a), DVec3::ZERO)).collect()
    }

    #[test]
    fn cameras_all_around_make_a_circle_at_their_height_that_closes() {
        let path = orbit(&ring((0..10).map(|k| 0.62 * f64::from(k))), &[], 36);
        for camera in &path {
            let at = camera.center();
            assert!(
                (at.length() - (16.0_f64 + 2.25).sqrt()).abs() < 0.05,
                "{at}"
            );
            assert!((at.dot(tilted(UP)) - 1.5).abs() < 0.05, "{at}");
            let forward = camera.rotation.row(2);
            assert!(forward.dot(-at.normalize()) > 0.999);
            // Right side up, and level.
            assert!(-camera.rotation.row(1).dot(tilted(UP)) > 0.9);
            assert!(camera.rotation.row(0).dot(tilted(UP)).abs() < 1e-3);
        }
        let step = |i: usize| path[i].center().distance(path[(i + 1) % 36].center());
        assert!((step(35) - step(0)).abs() < 1e-9 && step(0) > 0.5);
    }

    #[test]
    fn cameras_on_one_side_are_gone_to_and_fro_among() {
        let path = orbit(&ring((0..8).map(|k| 0.3 * f64::from(k))), &[], 40);
        let back = |camera: &Camera| {
            let at = DMat3::from_rotation_x(-0.7) * DMat3::from_rotation_z(-0.4) * camera.center();
            at.z.atan2(at.x)
        };
        let angles: Vec<f64> = path.iter().map(back).collect();
        let (low, high) = (
            angles.iter().fold(9.0_f64, |a, &b| a.min(b)),
            angles.iter().fold(-9.0_f64, |a, &b| a.max(b)),
        );
        assert!(
            (low - 0.0).abs() < 0.05 && (high - 2.1).abs() < 0.05,
            "{low} {high}"
        );
    }

    #[test]
    fn cameras_that_look_one_way_are_left_by_no_more_than_their_spread() {
        let cameras: Vec<Camera> = (0..12)
            .map(|k| {
                let at = DVec3::new(f64::from(k % 4) - 1.5, 0.5 * f64::from(k / 4) - 0.5, 0.0);
                placed(at, at + DVec3::Z)
            })
            .collect();
        let points: Vec<DVec3> = (-5..=5)
            .map(|k| tilted(DVec3::new(0.1 * f64::from(k), 0.0, 6.0)))
            .collect();
        let path = orbit(&cameras, &points, 24);
        for camera in &path {
            let at = camera.center();
            assert!(at.length() < 1.5, "{at}");
            assert!(camera.rotation.row(2).dot(tilted(DVec3::Z)) > 0.95);
            assert!(-camera.rotation.row(1).dot(tilted(UP)) > 0.95);
        }
        let seen = path[0].pixel_of(tilted(6.0 * DVec3::Z)).unwrap();
        assert!(
            (seen[0] - 32.0).abs() < 2.0 && (seen[1] - 24.0).abs() < 2.0,
            "{seen:?}"
        );
    }

    #[test]
    fn in_a_room_the_way_looks_outward() {
        let place = |a: f64| DVec3::new(a.cos(), 0.0, a.sin());
        let outward = |a: f64| placed(place(a), 3.0 * place(a));
        let cameras: Vec<Camera> = (0..9).map(|k| outward(0.7 * f64::from(k))).collect();
        for camera in orbit(&cameras, &[], 12) {
            let at = camera.center();
            assert!((at.length() - 1.0).abs() < 0.05, "{at}");
            assert!(camera.rotation.row(2).dot(at.normalize()) > 0.99);
        }
    }

    #[test]
    fn one_camera_and_cameras_in_one_place() {
        let camera = placed(DVec3::ZERO, DVec3::Z);
        for cameras in [vec![camera.clone()], vec![camera; 3]] {
            let path = orbit(&cameras, &[], 5);
            assert_eq!(path.len(), 5);
            assert!(
                path.iter()
                    .all(|c| c.translation.is_finite() && c.rotation.is_finite())
            );
        }
    }

    #[test]
    fn splats_fill_the_picture_with_y_down() {
        let places: Vec<[f32; 3]> = (0..100)
            .map(|k| {
                [
                    5.0 + (k % 10) as f32 * 0.1,
                    0.2,
                    3.0 + (k / 10) as f32 * 0.1,
                ]
            })
            .chain([[1000.0, 0.0, 0.0]])
            .collect();
        // The last hardly shows.
        let mut opacity_logits = vec![0.0; 101];
        opacity_logits[100] = -5.0;
        let splats = Splats {
            means: places.clone(),
            opacity_logits,
            ..Splats::default()
        };
        let ball = ball_of_splats(&splats, 0.5);
        let path = orbit_of_ball(ball, &lens([64, 48], 50.0), 8);
        for camera in &path {
            // Above what it looks at, where y points down.
            assert!(camera.center().y < 0.2);
            let inside = places[..100]
                .iter()
                .filter(|place| camera.pixel_of(DVec3::from(place.map(f64::from))).is_some());
            assert!(inside.count() >= 50);
        }
    }
}
