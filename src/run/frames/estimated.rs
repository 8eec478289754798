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
pub(super) fn estimate(dataset: &Dataset, shots: &[Shot]) -> Vec<Option<EstimatedView>> {
    if !dataset.capture.is_panorama() {
        return shots.iter().map(|_| None).collect();
    }
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
            camera: between(dataset, [first.1, last.1], share)?,
        })
    };
    shots.iter().map(of).collect()
}

/// The camera between two views'; `None` if their lenses differ by more than zoom.
fn between(dataset: &Dataset, views: [usize; 2], share: f64) -> Option<Camera> {
    let [a, b] = views.map(|view| &dataset.cameras[view]);
    let [first, second] = views.map(|view| &dataset.capture.views[view].undistortion);
    if [a.width, a.height] != [b.width, b.height] || first != second {
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
