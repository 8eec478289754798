//! The ground of a scene, as its cameras tell.

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use crate::capture::{Camera, Capture};

/// Weight of the cameras' moving over the ground, beside that of level cameras: level cameras with
/// one heading, as of a drone that never turns, leave a plane of directions open.
const MOVED: f64 = 0.2;

/// The same for pictures held upright. Less: a picture from straight above has no upper side.
const UPRIGHT: f64 = 0.05;

/// Weight of viewing directions that point down, against the images' upper sides, in finding up.
const DOWNWARD: f64 = 0.5;

/// Rounds of inverse iteration: each brings the answer closer by the ratio of two eigenvalues.
const ROUNDS: usize = 30;

/// Three unit vectors of COLMAP's world, at right angles to each other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ground {
    /// The direction in which points are spread most.
    pub along: [f64; 3],
    /// The other direction on the ground.
    pub across: [f64; 3],
    /// Away from it.
    pub up: [f64; 3],
}

impl Ground {
    /// The ground of a capture.
    pub fn of(capture: &Capture) -> Self {
        let up = up_of(capture.views.iter().map(|view| &view.camera));
        let side = up.any_orthonormal_vector();
        let level = Self::with(side, up);
        let places: Vec<[f64; 2]> = (capture.points.iter())
            .map(|point| level.place(point.position))
            .collect();
        let (sin, cos) = spread(&places).sin_cos();
        Self::with(cos * side + sin * up.cross(side), up)
    }

    fn with(along: DVec3, up: DVec3) -> Self {
        Self {
            along: along.to_array(),
            across: up.cross(along).to_array(),
            up: up.to_array(),
        }
    }

    /// Position of a world point on the ground, along its two axes.
    pub fn place(&self, position: DVec3) -> [f64; 2] {
        [self.along, self.across].map(|axis| DVec3::from(axis).dot(position))
    }

    /// Height of a world point, in world units.
    pub fn height(&self, position: DVec3) -> f64 {
        DVec3::from(self.up).dot(position)
    }
}

/// Up direction: across the horizontal axes of all images, which cameras on tripods, gimbals and in
/// hands hold level; if these leave it open, across the cameras' movements, and by the images'
/// upper sides.
fn up_of<'a>(cameras: impl Iterator<Item = &'a Camera> + Clone) -> DVec3 {
    let outer = |v: DVec3| DMat3::from_cols(v.x * v, v.y * v, v.z * v);
    let count = cameras.clone().count().max(1) as f64;
    let mean = |of: fn(&Camera) -> DVec3| cameras.clone().map(of).sum::<DVec3>() / count;
    let upper = mean(|camera| -camera.rotation.row(1));
    let ahead = mean(|camera| camera.rotation.row(2));
    let middle = mean(Camera::center);
    let (mut level, mut moved) = (DMat3::ZERO, DMat3::ZERO);
    for camera in cameras {
        level += outer(camera.rotation.row(0));
        moved += outer(camera.center() - middle);
    }
    let trace = moved.x_axis.x + moved.y_axis.y + moved.z_axis.z;
    let held = upper.try_normalize().unwrap_or(DVec3::NEG_Y);
    let tilt = level * (1.0 / count)
        + moved * (MOVED / trace.max(f64::MIN_POSITIVE))
        + (DMat3::IDENTITY - outer(held)) * UPRIGHT;
    // A little more makes it invertible, and moves no eigenvector.
    let inverse = (tilt + DMat3::IDENTITY * 1e-9).inverse();
    // Not at right angles to the answer, whichever it is.
    let from = held + DOWNWARD * -ahead + 0.1 * held.any_orthonormal_vector();
    let up = (0..ROUNDS).fold(from, |v, _| (inverse * v).try_normalize().unwrap_or(held));
    if up.dot(upper - DOWNWARD * ahead) < 0.0 {
        -up
    } else {
        up
    }
}

/// The angle from the first axis to the direction in which places are spread most, each
/// counting by how far it is off the middle up to the median, so that a few that are far off
/// do not decide.
fn spread(places: &[[f64; 2]]) -> f64 {
    let median = |values: &mut [f64]| match values.len() / 2 {
        0 => 0.0,
        middle => *values.select_nth_unstable_by(middle, f64::total_cmp).1,
    };
    let middle = [0, 1].map(|axis| {
        let mut values: Vec<f64> = places.iter().map(|place| place[axis]).collect();
        median(&mut values)
    });
    let off = |place: &[f64; 2]| [place[0] - middle[0], place[1] - middle[1]];
    let mut distances: Vec<f64> = (places.iter().map(off)).map(|[x, y]| x.hypot(y)).collect();
    let usual = median(&mut distances).max(f64::MIN_POSITIVE);
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    for [x, y] in places.iter().map(off) {
        let weight = 1.0 / x.hypot(y).max(usual).powi(2);
        xx += weight * x * x;
        xy += weight * x * y;
        yy += weight * y * y;
    }
    0.5 * (2.0 * xy).atan2(xx - yy)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    /// A world that is not upright in its own coordinates.
    fn tilt() -> DMat3 {
        DMat3::from_rotation_x(0.4) * DMat3::from_rotation_z(-0.3)
    }

    /// At a place, with a heading about up (y), looking down by an angle.
    fn camera(place: [f64; 3], heading: f64, down: f64) -> Camera {
        // Camera axes of a level camera that looks along z: right x, down -y.
        let flip = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
        let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
        let pose = DMat3::from_rotation_x(down) * mirror * flip;
        let rotation = pose * DMat3::from_rotation_y(heading) * tilt().transpose();
        Camera {
            width: 64,
            height: 48,
            fx: 60.0,
            fy: 60.0,
            cx: 32.0,
            cy: 24.0,
            rotation,
            translation: -(rotation * (tilt() * DVec3::from(place))),
        }
    }

    fn is_up(cameras: &[Camera]) {
        let up = up_of(cameras.iter());
        let angle = up.dot(tilt() * DVec3::Y).clamp(-1.0, 1.0).acos();
        // Cameras on a short arc are held a little forward.
        assert!(angle < 0.1, "{angle}");
    }

    #[test]
    fn cameras_in_a_ring_or_an_arc_stand_on_the_ground() {
        for [from, to] in [[0.0, 2.0 * PI], [0.0, 1.0]] {
            let ring: Vec<Camera> = (0..12)
                .map(|k| {
                    let angle = from + (to - from) * f64::from(k) / 12.0;
                    let (sin, cos) = angle.sin_cos();
                    camera([-4.0 * sin, 1.0, -4.0 * cos], -angle, 0.2)
                })
                .collect();
            is_up(&ring);
        }
    }

    #[test]
    fn a_survey_from_straight_above_with_or_without_turns() {
        for turn in [0.0, PI] {
            let survey: Vec<Camera> = (0..30)
                .map(|k| {
                    let (row, column) = (k / 6, k % 6);
                    let place = [f64::from(column), 20.0, 1.5 * f64::from(row)];
                    camera(place, turn * f64::from(row % 2), FRAC_PI_2)
                })
                .collect();
            is_up(&survey);
        }
    }

    #[test]
    fn one_camera_has_a_ground_too() {
        is_up(&[camera([0.0; 3], 0.3, 0.0)]);
    }

    #[test]
    fn the_first_axis_is_the_longer_one_whatever_is_far_off() {
        let angle = 0.6_f64;
        let (sin, cos) = angle.sin_cos();
        let mut places: Vec<[f64; 2]> = (0..600)
            .map(|k| {
                let (x, y) = (f64::from(k % 60) - 30.0, f64::from(k / 60) - 4.5);
                [cos * x - sin * y, sin * x + cos * y]
            })
            .collect();
        places.extend([[-9e4, 9e4]; 3]);
        assert!(
            (spread(&places) - angle).abs() < 0.05,
            "{}",
            spread(&places)
        );
        assert!(spread(&[]).is_finite() && spread(&[[1.0, 2.0]]).is_finite());
    }
}
