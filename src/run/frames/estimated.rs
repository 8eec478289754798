//! Poses of the frames between those with a pose, where the camera stands or turns.

use glam::{DMat3, DQuat};

use super::shots::Shot;
use crate::capture::{Camera, Dataset};

/// A frame's camera, between those of its neighbors.
pub(super) struct EstimatedView {
    /// Index of the nearest view in time, whose lens and exposure it has.
    pub nearest: usize,
    /// The camera at working size.
    pub camera: Camera,
}

/// For each frame of a film without a pose the one between its neighbors', where all photos are
/// taken from one place: a camera that stands or turns does so evenly, but for gate weave of some
/// pixels, which [`SceneDrawer`](crate::frames::SceneDrawer) finds. `None` for frames with a pose,
/// and between two lenses that differ by more than zoom.
pub(super) fn estimate(film: Option<&Dataset>, shots: &[Shot]) -> Vec<Option<EstimatedView>> {
    let Some(dataset) = film.filter(|dataset| dataset.capture.is_panorama()) else {
        return shots.iter().map(|_| None).collect();
    };
    // Faces of wide photos have poses of their own.
    let placed = shots.iter().filter(|shot| shot.views.len() == 1);
    let placed: Vec<(usize, usize)> = placed.map(|shot| (shot.index, shot.views.start)).collect();
    let of = |shot: &Shot| {
        if !shot.views.is_empty() {
            return None;
        }
        let next = placed.partition_point(|&(index, _)| index < shot.index);
        let before = next.checked_sub(1).map(|i| placed[i]);
        let (first, last) = match (before, placed.get(next).copied()) {
            (Some(before), Some(after)) => (before, after),
            (one, other) => one.or(other).map(|known| (known, known))?,
        };
        let length = last.0.abs_diff(first.0).max(1);
        let share = shot.index.abs_diff(first.0) as f64 / length as f64;
        let share = if first == last { 0.0 } else { share };
        Some(EstimatedView {
            nearest: if share < 0.5 { first.1 } else { last.1 },
            camera: {
                let views = [first.1, last.1];
                let [one, other] = views.map(|view| &dataset.capture.views[view].undistortion);
                let cameras = views.map(|view| &dataset.cameras[view]);
                (one == other).then(|| between(cameras, share)).flatten()?
            },
        })
    };
    shots.iter().map(of).collect()
}

/// The camera at a share of the way from one to another; `None` if their sizes differ.
fn between([a, b]: [&Camera; 2], share: f64) -> Option<Camera> {
    if [a.width, a.height] != [b.width, b.height] {
        return None;
    }
    let mix = |from: f64, to: f64| from + share * (to - from);
    let [from, to] = [a, b].map(|camera| DQuat::from_mat3(&camera.rotation));
    let rotation = DMat3::from_quat(from.slerp(to, share));
    let center = a.center().lerp(b.center(), share);
    Some(Camera {
        width: a.width,
        height: a.height,
        fx: mix(a.fx, b.fx),
        fy: mix(a.fy, b.fy),
        cx: mix(a.cx, b.cx),
        cy: mix(a.cy, b.cy),
        rotation,
        translation: -(rotation * center),
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn half_way_a_camera_has_turned_and_zoomed_by_half_about_its_place() {
        let center = DVec3::new(1.0, -2.0, 0.5);
        let turned = |angle: f64, focal: f64| {
            let rotation = DMat3::from_rotation_y(angle);
            Camera {
                width: 40,
                height: 30,
                fx: focal,
                fy: focal,
                cx: 20.0,
                cy: 15.0,
                rotation,
                translation: -(rotation * center),
            }
        };
        let (first, last) = (turned(0.1, 50.0), turned(0.5, 70.0));
        let found = between([&first, &last], 0.5).expect("one size");
        let wanted = turned(0.3, 60.0);
        assert!(found.rotation.abs_diff_eq(wanted.rotation, 1e-12));
        assert!(found.center().abs_diff_eq(center, 1e-12));
        assert_eq!([found.fx, found.cx], [60.0, 20.0]);
        let small = Camera { width: 20, ..last };
        assert!(between([&first, &small], 0.5).is_none());
    }
}
