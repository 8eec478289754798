//! A smooth way through photographed viewpoints.

use glam::{DMat3, DQuat, DVec3};

use crate::capture::Camera;

/// Frames between two cameras that the path goes through, at least: fewer, and it
/// would jump where the photographer did.
const FRAMES_PER_KEY: usize = 4;

/// Rounds of untangling; each visits every pair of edges, and a few suffice.
const ROUNDS: usize = 20;

/// Steps shorter than this, in [`distance`]'s units, are none.
const SMALLEST_STEP: f64 = 1e-9;

/// `frames` cameras along an open path through the given ones, or a good choice of
/// them: a Catmull–Rom spline through their centers, spherical interpolation of their
/// rotations, at a speed that is even in distance and turn together. All have the first
/// camera's intrinsics and size. `extent` is the size of the scene in world units.
///
/// # Panics
/// Without a camera.
pub fn camera_path(cameras: &[&Camera], extent: f64, frames: usize) -> Vec<Camera> {
    let apart = |a: &Camera, b: &Camera| distance(a, b, extent);
    let keys = thinned(
        &untangled(cameras, &apart),
        (frames / FRAMES_PER_KEY).max(2),
    );
    let mut times = vec![0.0];
    for pair in keys.windows(2) {
        times.push(times[times.len() - 1] + apart(pair[0], pair[1]));
    }
    let length = times[times.len() - 1];
    (0..frames)
        .map(|frame| {
            let time = length * frame as f64 / (frames.max(2) - 1) as f64;
            let segment = times
                .partition_point(|&t| t <= time)
                .clamp(1, keys.len().max(2) - 1)
                - 1;
            if length < SMALLEST_STEP || keys.len() < 2 {
                return keys[0].clone();
            }
            let share = (time - times[segment]) / (times[segment + 1] - times[segment]);
            between(&keys, segment, share.clamp(0.0, 1.0))
        })
        .collect()
}

/// Distance of two viewpoints: translation in extents plus rotation in radians.
pub fn distance(a: &Camera, b: &Camera, extent: f64) -> f64 {
    let turn = DQuat::from_mat3(&(a.rotation.transpose() * b.rotation));
    // The shorter way round; acos would lose small angles.
    let turn = 2.0 * turn.xyz().length().atan2(turn.w.abs());
    a.center().distance(b.center()) / extent + turn
}

/// The cameras in an order in which crossing back and forth is shortened away (2-opt),
/// beginning with the order given. Those in one place count once.
fn untangled<'a>(
    cameras: &[&'a Camera],
    apart: &dyn Fn(&Camera, &Camera) -> f64,
) -> Vec<&'a Camera> {
    let mut order: Vec<&Camera> = cameras.to_vec();
    let n = order.len();
    for _ in 0..ROUNDS {
        let mut shorter = false;
        for first in 0..n {
            for last in first + 1..n {
                // Turning first..=last round replaces the edges at its two ends.
                let edge = |a: Option<usize>, b: usize| {
                    a.and_then(|a| Some(apart(order.get(a)?, order[b])))
                        .unwrap_or(0.0)
                };
                let (before, after) = (first.checked_sub(1), Some(last + 1));
                let old = edge(before, first) + edge(after, last);
                let new = edge(before, last) + edge(after, first);
                if new < old - SMALLEST_STEP {
                    order[first..=last].reverse();
                    shorter = true;
                }
            }
        }
        if !shorter {
            break;
        }
    }
    order.dedup_by(|next, kept| apart(next, kept) < SMALLEST_STEP);
    order
}

/// At most `count` of the cameras, evenly along their order, both ends among them.
fn thinned<'a>(cameras: &[&'a Camera], count: usize) -> Vec<&'a Camera> {
    let last = cameras.len() - 1;
    if cameras.len() <= count {
        return cameras.to_vec();
    }
    (0..count)
        .map(|i| cameras[(i * last + (count - 1) / 2) / (count - 1)])
        .collect()
}

/// The camera at a share of the way from one key to the next.
fn between(keys: &[&Camera], segment: usize, share: f64) -> Camera {
    let key = |i: usize| keys[i.min(keys.len() - 1)];
    let (from, to) = (key(segment), key(segment + 1));
    let (p1, p2) = (from.center(), to.center());
    // Beyond the ends the path goes on as it came.
    let p0 = if segment > 0 {
        key(segment - 1).center()
    } else {
        2.0 * p1 - p2
    };
    let p3 = if segment + 2 < keys.len() {
        key(segment + 2).center()
    } else {
        2.0 * p2 - p1
    };
    let turn = |camera: &Camera| DQuat::from_mat3(&camera.rotation);
    let rotation = DMat3::from_quat(turn(from).slerp(turn(to), share).normalize());
    Camera {
        rotation,
        translation: -(rotation * catmull_rom([p0, p1, p2, p3], share)),
        ..keys[0].clone()
    }
}

/// The uniform Catmull–Rom spline between the second and the third point (E. Catmull,
/// R. Rom, *A Class of Local Interpolating Splines*, 1974).
fn catmull_rom([p0, p1, p2, p3]: [DVec3; 4], t: f64) -> DVec3 {
    let tangents = [0.5 * (p2 - p0), 0.5 * (p3 - p1)];
    let (t2, t3) = (t * t, t * t * t);
    p1 * (2.0 * t3 - 3.0 * t2 + 1.0)
        + tangents[0] * (t3 - 2.0 * t2 + t)
        + p2 * (3.0 * t2 - 2.0 * t3)
        + tangents[1] * (t3 - t2)
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::camera;
    use super::*;

    fn row(places: &[f64]) -> Vec<Camera> {
        let at = |&x: &f64| camera(DVec3::new(x, 0.0, 0.0), 0.1 * x);
        places.iter().map(at).collect()
    }

    fn path(places: &[f64], frames: usize) -> Vec<Camera> {
        let cameras = row(places);
        camera_path(&cameras.iter().collect::<Vec<_>>(), 1.0, frames)
    }

    #[test]
    fn a_row_in_disorder_is_walked_from_end_to_end_at_even_steps() {
        let path = path(&[2.0, 0.0, 3.0, 1.0, 4.0], 41);
        let x: Vec<f64> = path.iter().map(|camera| camera.center().x).collect();
        let forward = x[0] < x[40];
        for (i, &x) in x.iter().enumerate() {
            let want = if forward {
                0.1 * i as f64
            } else {
                4.0 - 0.1 * i as f64
            };
            assert!((x - want).abs() < 1e-9, "{i}: {x} {want}");
        }
        for camera in &path {
            let turn = 0.1 * camera.center().x;
            assert!(
                camera
                    .rotation
                    .abs_diff_eq(DMat3::from_rotation_y(turn), 1e-9)
            );
            assert_eq!((camera.width, camera.fx), (40, 50.0));
        }
    }

    #[test]
    fn the_path_goes_through_its_cameras_without_a_corner() {
        let centers = [
            DVec3::ZERO,
            DVec3::X,
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::new(0.0, 1.5, 1.0),
        ];
        let cameras: Vec<Camera> = centers.iter().map(|&c| camera(c, 0.0)).collect();
        let path = camera_path(&cameras.iter().collect::<Vec<_>>(), 1.0, 2001);
        let at: Vec<DVec3> = path.iter().map(Camera::center).collect();
        for center in centers {
            let nearest = at
                .iter()
                .map(|p| p.distance(center))
                .fold(f64::MAX, f64::min);
            assert!(nearest < 2e-3, "{center}: {nearest}");
        }
        for three in at.windows(3) {
            let (a, b) = (three[1] - three[0], three[2] - three[1]);
            assert!(a.angle_between(b) < 0.05, "{a} {b}");
        }
    }

    #[test]
    fn few_frames_few_keys_and_cameras_in_one_place() {
        assert_eq!(path(&[1.0, 2.0, 5.0], 1).len(), 1);
        assert!(
            path(&[1.0; 3], 5)
                .iter()
                .all(|c| c.center().x == path(&[1.0], 5)[0].center().x)
        );
        // Eight frames go through two cameras alone: the ends of the row.
        let places: Vec<f64> = (0..30).map(f64::from).collect();
        let few = path(&places, 8);
        let ends = [few[0].center().x, few[7].center().x];
        assert!((ends[0] - ends[1]).abs() > 28.9, "{ends:?}");
        assert!(few.iter().all(|camera| camera.translation.is_finite()));
    }

    #[test]
    fn distances_count_way_and_turn() {
        let a = camera(DVec3::ZERO, 0.0);
        let apart = |center, turn| distance(&a, &camera(center, turn), 2.0);
        assert!((apart(DVec3::X, 0.0) - 0.5).abs() < 1e-12);
        assert!((apart(DVec3::ZERO, 0.3) - 0.3).abs() < 1e-12);
        assert!((apart(DVec3::ZERO, -3.0) - 3.0).abs() < 1e-9);
        assert!((apart(DVec3::ZERO, 1e-9) - 1e-9).abs() < 1e-12);
    }
}
