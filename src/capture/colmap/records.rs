//! Records of cameras, images and points, whichever way a file spells their fields.

use std::path::PathBuf;

use glam::{DQuat, DVec3};

use super::model::{Cameras, Image, lens, relative_name};
use super::tracks::{Sighting, Sightings};
use crate::capture::error::{CaptureError, Position};
use crate::capture::lens::{MOST_PARAMETERS, ModelName};
use crate::capture::{Chosen, Point};

/// A rotation, of about unit length, and a translation.
pub(super) type Pose = (DQuat, DVec3);

/// A file of records, binary or text.
pub(super) trait RecordSource {
    /// Goes to the next record, if there is one. Refuses what the last one holds beyond its
    /// fields.
    fn next(&mut self) -> Result<bool, CaptureError>;
    fn u8(&mut self, field: &str) -> Result<u8, CaptureError>;
    fn u32(&mut self, field: &str) -> Result<u32, CaptureError>;
    fn u64(&mut self, field: &str) -> Result<u64, CaptureError>;
    fn f64(&mut self, field: &str) -> Result<f64, CaptureError>;
    /// A camera's model; COLMAP's name or number of one that is unknown.
    fn model(&mut self) -> Result<Result<ModelName, String>, CaptureError>;
    /// Passes over the rest of a record; false where only its fields tell how long it is.
    fn skip(&mut self) -> bool;
    /// Refuses more parameters than a model has.
    fn check_parameters(&self, model: ModelName) -> Result<(), CaptureError>;
    /// An image's name as it is written.
    fn name(&mut self) -> Result<String, CaptureError>;
    /// The 2D points of an image that belong to a 3D point.
    fn sightings(&mut self) -> Result<Vec<Sighting>, CaptureError>;
    /// The number of elements of a point's track.
    fn track_length(&mut self) -> Result<u32, CaptureError>;
    /// Reads a sensor's type; true if it is a camera. Other sensors are ignored.
    fn is_camera(&mut self) -> Result<bool, CaptureError>;
    /// The file, the current record in words, and where the field read last begins.
    fn place(&self) -> (PathBuf, String, Position);

    fn f64s<const N: usize>(&mut self, field: &str) -> Result<[f64; N], CaptureError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64(field)?;
        }
        Ok(values)
    }

    /// A pose; none where it is not finite.
    fn pose(&mut self, field: &str) -> Result<Option<Pose>, CaptureError> {
        let all: [f64; 7] = self.f64s(field)?;
        let [w, x, y, z, translation @ ..] = all;
        let finite = all.iter().all(|value| value.is_finite());
        Ok(finite.then_some((DQuat::from_xyzw(x, y, z, w), translation.into())))
    }

    fn malformed(&self, reason: String) -> CaptureError {
        let (path, record, position) = self.place();
        CaptureError::Malformed {
            path,
            record,
            position,
            reason,
        }
    }

    fn bad_name(&self, reason: String) -> CaptureError {
        let (path, record, position) = self.place();
        CaptureError::ImageName {
            path,
            record,
            position,
            reason,
        }
    }
}

/// `CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]`
pub(super) fn cameras(mut source: impl RecordSource) -> Result<Cameras, CaptureError> {
    let mut cameras = Cameras::default();
    while source.next()? {
        let id = source.u32("the id")?;
        let lens = match source.model()? {
            Ok(model) => {
                let (width, height) = (source.u64("the width")?, source.u64("the height")?);
                let mut parameters = [0.0; MOST_PARAMETERS];
                let parameters = &mut parameters[..model.parameters];
                for parameter in &mut *parameters {
                    *parameter = source.f64("the parameters")?;
                }
                source.check_parameters(model)?;
                let lens = lens(model, width, height, parameters);
                lens.map_err(|reason| source.malformed(reason))
            }
            Err(model) => {
                let unknown = CaptureError::CameraModel {
                    path: source.place().0,
                    camera_id: id,
                    model,
                };
                if !source.skip() {
                    return Err(unknown);
                }
                Err(unknown)
            }
        };
        (cameras.insert(id, lens)).map_err(|reason| source.malformed(reason))?;
    }
    Ok(cameras)
}

/// `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`, then `X Y POINT3D_ID` of each 2D point.
pub(super) fn images(
    mut source: impl RecordSource,
    cameras: &Cameras,
    chosen: Option<&Chosen>,
) -> Result<(Vec<Image>, Sightings), CaptureError> {
    let mut images = Vec::new();
    let mut sightings = Sightings::of_all(chosen.is_none());
    while source.next()? {
        let id = source.u32("the id")?;
        let quaternion = source.f64s("the quaternion")?;
        let translation = DVec3::from(source.f64s::<3>("the translation")?);
        let camera = cameras.place(source.u32("the camera")?);
        let camera = camera.map_err(|reason| source.malformed(reason))?;
        let name = relative_name(&source.name()?).map_err(|reason| source.bad_name(reason))?;
        let mut seen = source.sightings()?;
        if chosen.is_some_and(|chosen| !chosen.has(&name)) {
            continue;
        }
        // Most 2D points may belong to none, and there are many images.
        seen.shrink_to_fit();
        sightings.insert(id, images.len(), seen);
        images.push(Image {
            id,
            name,
            quaternion,
            translation,
            camera,
        });
    }
    Ok((images, sightings))
}

/// `POINT3D_ID X Y Z R G B ERROR TRACK[]`, the track being pairs of an image's id and
/// the index of a 2D point.
pub(super) fn points(
    mut source: impl RecordSource,
    sightings: &Sightings,
) -> Result<Vec<Point>, CaptureError> {
    let mut points = Vec::new();
    while source.next()? {
        let id = source.u64("the id")?;
        let position = DVec3::from(source.f64s::<3>("the position")?);
        let mut color = [0; 3];
        for channel in &mut color {
            *channel = source.u8("the color")?;
        }
        source.f64("the error")?;
        let count = source.track_length()?;
        let mut track = Vec::with_capacity(sightings.room(count));
        let mut shown = count == 0;
        for _ in 0..count {
            let (image, index) = (source.u32("the track")?, source.u32("the track")?);
            shown |= sightings.has(image);
            track.extend(sightings.observation(id, image, index));
        }
        if !shown {
            continue;
        }
        points.push(Point {
            position,
            color,
            track,
        });
    }
    Ok(points)
}
