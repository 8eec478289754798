//! Rigs and frames, which COLMAP since 3.12 writes beside images: a photo's pose is that of its
//! sensor in the rig times that of the rig in the world. COLMAP reads only these.

use std::collections::HashMap;

use glam::{DQuat, DVec3};

use super::model::Image;
use super::records::{Pose, RecordSource};
use crate::capture::error::CaptureError;

/// Poses that differ by less are one: radians, and shares of the longest translation.
const SAME: f64 = 1e-9;

/// Largest difference that rounding to six digits causes, in the same units.
const ROUNDED: f64 = 1e-5;

/// Camera poses relative to the rig, by rig id and camera id; `None` if unknown.
type Rigs = HashMap<u32, HashMap<u32, Option<Pose>>>;

/// World-to-camera poses by image id; `None` if unknown.
pub(super) type Poses = HashMap<u32, Option<Pose>>;

/// `RIG_ID`, the number of sensors, the first one (kind and id), which is the rig's origin, and of
/// each other kind, id, whether its pose is known, and the pose.
fn rigs(source: &mut impl RecordSource) -> Result<Rigs, CaptureError> {
    let mut rigs = Rigs::new();
    while source.next()? {
        let id = source.u32("the id")?;
        let mut cameras = HashMap::new();
        for place in 0..source.u32("the number of sensors")? {
            let (is_camera, sensor) = (source.is_camera()?, source.u32("the sensor's id")?);
            let pose = match place == 0 || source.u8("whether a pose follows")? != 0 {
                false => None,
                true if place == 0 => Some((DQuat::IDENTITY, DVec3::ZERO)),
                true => source.pose("the sensor's pose")?,
            };
            if is_camera && cameras.insert(sensor, pose).is_some() {
                return Err(source.malformed(format!("camera {sensor} is there twice")));
            }
        }
        if rigs.insert(id, cameras).is_some() {
            return Err(source.malformed(format!("rig {id} is there twice")));
        }
    }
    Ok(rigs)
}

/// `FRAME_ID`, its rig's, the rig's pose in the world, the number of data, and of each its
/// sensor's kind and id, and its own: that of an image.
fn frames(source: &mut impl RecordSource, rigs: &Rigs) -> Result<Poses, CaptureError> {
    let mut poses = Poses::new();
    while source.next()? {
        source.u32("the id")?;
        let id = source.u32("the rig")?;
        let rig = rigs.get(&id);
        let rig =
            rig.ok_or_else(|| source.malformed(format!("rig {id} is not in the rigs file")))?;
        let in_world = source.pose("the pose")?;
        for _ in 0..source.u32("the number of data")? {
            let (is_camera, sensor) = (source.is_camera()?, source.u32("the sensor's id")?);
            let image = source.u64("the image")?;
            if !is_camera {
                continue;
            }
            let Some(in_rig) = rig.get(&sensor) else {
                return Err(source.malformed(format!("camera {sensor} is not in rig {id}")));
            };
            let pose = in_rig
                .zip(in_world)
                .map(|((turn, shift), (by, from))| (turn * by, turn.normalize() * from + shift));
            // No image has a larger id.
            let image = u32::try_from(image).unwrap_or(u32::MAX);
            if poses.insert(image, pose).is_some() {
                return Err(source.malformed(format!("image {image} is in two frames")));
            }
        }
    }
    Ok(poses)
}

/// Reads both files.
pub(super) fn read<S: RecordSource>(
    mut of_rigs: S,
    mut of_frames: S,
) -> Result<Poses, CaptureError> {
    frames(&mut of_frames, &rigs(&mut of_rigs)?)
}

/// Gives images the poses of their frames, and what is doubtful about that. Poses that are the
/// same keep their digits.
pub(super) fn place(images: &mut [Image], poses: &Poses) -> Vec<String> {
    let translations = images.iter().map(|image| image.translation.length());
    let reach = translations.fold(0.0, f64::max);
    let total = images.len();
    let (mut moved, mut angle, mut shift) = (Vec::new(), 0.0_f64, 0.0_f64);
    let mut unplaced = Vec::new();
    for image in images {
        let Some((turn, translation)) = poses.get(&image.id).copied().flatten() else {
            unplaced.push(image.name.clone());
            continue;
        };
        let [w, x, y, z] = image.quaternion;
        let between = DQuat::from_xyzw(x, y, z, w).normalize().inverse() * turn.normalize();
        let by = 2.0 * between.xyz().length().atan2(between.w.abs());
        let apart = image.translation.distance(translation);
        // NaN is not the same.
        if by <= SAME && apart <= SAME * reach {
            continue;
        }
        image.quaternion = [turn.w, turn.x, turn.y, turn.z];
        image.translation = translation;
        if !(by <= ROUNDED && apart <= ROUNDED * reach) {
            moved.push(image.name.clone());
            (angle, shift) = (angle.max(by), shift.max(apart));
        }
    }
    let mut doubts = Vec::new();
    if let Some(first) = moved.first() {
        doubts.push(format!(
            "rigs and frames contradict images: the poses of {} of {total} photos, such as {first}, differ by up to {:.3} degrees and {shift:.3} units; those of rigs and frames are used, as COLMAP does (remove both files if images are right)",
            moved.len(), angle.to_degrees()
        ));
    }
    if let Some(first) = unplaced.first() {
        doubts.push(format!(
            "frames give {} of {total} photos, such as {first}, no pose: that of images is used",
            unplaced.len()
        ));
    }
    doubts
}
