//! Captures: COLMAP models, pinhole cameras, photos and splits.

mod arrangement;
pub mod camera;
mod colmap;
mod colors;
mod dataset;
mod decode;
mod error;
mod exposure;
mod film;
mod guess;
mod in_order;
mod jpeg;
mod layers;
pub mod lens;
mod loader;
mod mask;
mod memory;
mod metadata;
pub(crate) mod names;
mod options;
mod order;
mod orientation;
mod original;
mod photo;
#[cfg(feature = "cli")]
mod plain;
mod point_cloud;
mod resample;
mod sample;
mod source;
mod split;
mod tiff;
mod tone;
mod transforms;
mod unplaced;
mod view;

#[cfg(test)]
mod depth_tests;
#[cfg(test)]
mod fixtures;
#[cfg(test)]
mod left_out_tests;
#[cfg(test)]
mod name_tests;
#[cfg(test)]
mod rig_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod thumbnail_tests;
#[cfg(test)]
mod view_tests;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use glam::{DMat3, DQuat, DVec3};

use arrangement::Arrangement;
pub use camera::Camera;
pub use dataset::{Dataset, Notice};
pub(crate) use decode::decode_image;
pub use error::{AmbiguousNames, CaptureError, Position};
pub use exposure::Exposure;
pub use film::{FRAMES, Film, Signal};
pub(crate) use in_order::in_order;
pub use layers::Layers;
pub use lens::IMPERCEPTIBLE;
pub use loader::{Headers, Loader, Shrunk, first_views};
pub use mask::Masked;
pub(crate) use names::photos_in;
pub use options::{
    Channel, Choice, Chosen, Encoding, LoadOptions, MaskSource, MaskUse, Normalize, Rejected,
};
pub use order::view_at;
pub use orientation::{Orientation, SensorOrientation};
pub use original::Original;
pub use photo::Photo;
pub use resample::downscale;
pub use source::{IMAGES, is_capture, originals, photo_folder};
pub use split::{Split, split, split_as};
use transforms::Source;
pub use unplaced::Unplaced;
pub use view::{Observation, Point, View};
#[cfg(feature = "cli")]
pub(crate) use {
    decode::header as photo_header,
    loader::percentiles,
    mask::read as read_mask,
    plain::{Piece, plain_photo, plain_values},
    sample::{Depth, Header},
};

/// A quaternion's length may be off by so much: text files round its digits.
/// Beyond it the pose is no rotation that anyone meant.
const QUATERNION_SLACK: f64 = 1e-3;

/// Coordinates beyond this, in world units, are failures of the
/// reconstruction, not places: georeferenced ones stay below 1e8, even in
/// millimeters below 1e11.
const LARGEST_COORDINATE: f64 = 1e12;

/// Recenter when the cameras are farther from the origin than this many
/// extents: f32 then has less than 2⁻²⁴ · 100 ≈ 6e-6 of the extent as its step.
const RECENTER_EXTENTS: f64 = 100.0;

/// Factor from the cameras' radius to the scene's extent, as in 3DGS.
const EXTENT_MARGIN: f64 = 1.1;

/// Cameras closer together than this part of the distance to the points stand,
/// for the scene's size, in one place.
const COINCIDENT: f64 = 1e-4;

/// Distances between cameras, as a share of that to what they see, that show no depth.
const NO_BASELINE: f64 = 1e-3;

/// Photos with poses, and the sparse points seen in them.
#[derive(Clone, Debug, PartialEq)]
pub struct Capture {
    /// The folder of model and photos.
    pub root: PathBuf,
    /// Folder that the photos' names are relative to.
    pub photos: PathBuf,
    /// Photos to train on and held-out ones, where the model says.
    pub split: Option<Chosen>,
    /// The usable views, sorted by photo and then by name; at least one.
    pub views: Vec<View>,
    /// The usable points in the order of the file; at least one.
    pub points: Vec<Point>,
    /// Offset that was subtracted from every position; add it to come back to COLMAP's coordinates.
    /// Zero unless these were large; whole numbers.
    pub offset: DVec3,
    /// Photos without a usable pose or camera and those that were not to be used, sorted by
    /// name, and one entry for all points without a usable position.
    pub rejected: Vec<Rejected>,
    /// Warnings about the model's files, a line each.
    pub doubts: Vec<String>,
    /// The farthest that a camera's lens displaces a pixel from where its pinhole
    /// would show it, over all cameras that a photo has, in pixels at working size; whether that is
    /// taken out or not.
    pub distortion: f64,
}

impl Capture {
    /// Loads a COLMAP folder with the default options; see [`Capture::load_with`].
    ///
    /// # Errors
    /// As there.
    pub fn load(dir: &Path) -> Result<Self, CaptureError> {
        Self::load_with(dir, &LoadOptions::default())
    }

    /// Loads a COLMAP folder: `images/` and a model in `sparse/0/`, `sparse/`, the folder itself or
    /// `colmap/sparse/0/`, `.bin` before `.txt`; where there is none, the photos that
    /// `transforms.json` lists. Without points, there are random ones.
    ///
    /// Views and points whose coordinates are not finite, or no rotation, and photos with a
    /// camera that cannot be are left out and named in `rejected`. Cameras without photos do
    /// not matter. Photos are checked to exist, not read.
    ///
    /// # Errors
    /// If a folder, a file or a photo is missing, a file is damaged, no photo's camera has a
    /// known model and a lens's calibration, a name leads out of `images/`, or
    /// nothing usable is left.
    pub fn load_with(dir: &Path, options: &LoadOptions) -> Result<Self, CaptureError> {
        let chosen = options.chosen.as_ref();
        let Source {
            mut model,
            photos,
            missing,
            split,
        } = source::read(dir, chosen)?;
        // Tracks know an image by its place in the file.
        let mut images: Vec<_> = model.images.into_iter().enumerate().collect();
        images.sort_by(|(_, a), (_, b)| a.name.cmp(&b.name));
        let mut pairs = images.windows(2);
        if let Some(pair) = pairs.find(|pair| pair[0].1.name == pair[1].1.name) {
            return Err(CaptureError::DuplicateName {
                name: pair[0].1.name.clone(),
                path: model.images_path,
            });
        }

        let mut used = vec![false; model.cameras.len()];
        for (_, image) in &images {
            used[image.camera] = true;
        }
        let mut cameras: Vec<_> = (model.cameras.into_iter().zip(used))
            .map(|(camera, used)| used.then(|| arranged(camera, &model.cameras_path, options)))
            .collect();

        let (mut views, mut rejected) = (Vec::new(), not_placed(chosen, &images));
        rejected.extend(missing);
        let mut distortion: f64 = 0.0;
        // The first camera that cannot be.
        let mut impossible = None;
        // Of each image its first view and its camera.
        let mut view_at = vec![None; images.len()];
        for (place, image) in images {
            let colmap::Image {
                id: _,
                name,
                quaternion,
                translation,
                camera,
            } = image;
            if let Some(unwanted) = options.left_out.iter().find(|photo| photo.name == name) {
                rejected.push(unwanted.clone());
                continue;
            }
            let arrangement = match &cameras[camera] {
                Some(Ok(arrangement)) => arrangement,
                Some(Err(error)) => {
                    impossible = impossible.or(Some(camera));
                    let reason = format!("its camera cannot be ({error})");
                    rejected.push(Rejected { name, reason });
                    continue;
                }
                // Not arranged because no image has it.
                None => continue,
            };
            match pose(quaternion, translation) {
                Ok(rotation) => {
                    view_at[place] = Some((views.len(), camera));
                    let image_path = photos.join(&name);
                    views.extend(arrangement.views(&name, &image_path, rotation, translation));
                    distortion = distortion.max(arrangement.displacement);
                }
                Err(reason) => rejected.push(Rejected { name, reason }),
            }
        }
        rejected.sort_by(|a, b| a.name.cmp(&b.name));
        if views.is_empty() {
            if let Some(Some(Err(error))) = impossible.map(|camera| cameras.swap_remove(camera)) {
                return Err(error);
            }
            let path = model.images_path;
            return Err(match rejected.first() {
                None => CaptureError::NoImages { path },
                Some(first) => CaptureError::AllRejected {
                    path,
                    count: rejected.len(),
                    name: first.name.clone(),
                    reason: first.reason.clone(),
                },
            });
        }
        names::find_spelled(&mut views, &photos);
        check_photos_exist(&views)?;

        let mut points = model.points;
        if points.is_empty() && source::lists_photos(dir) {
            points = guess::points(&views);
            model.doubts.push(format!(
                "{}: names no points (ply_file_path): starting from {} random ones where the cameras look; COLMAP's would be better",
                model.points_path.display(),
                guess::COUNT
            ));
        }
        rejected.extend(retain_places(&mut points, &model.points_path)?);
        for point in &mut points {
            point.track.retain_mut(|seen| match view_at[seen.view] {
                Some((first, camera)) => (cameras[camera].as_ref())
                    .and_then(|arranged| arranged.as_ref().ok())
                    .is_some_and(|arrangement| arrangement.place(seen, first)),
                None => false,
            });
        }
        let mut capture = Self {
            root: dir.into(),
            photos,
            split,
            views,
            points,
            offset: DVec3::ZERO,
            rejected,
            doubts: model.doubts,
            distortion,
        };
        capture.recenter();
        Ok(capture)
    }

    /// The scene's extent as 3DGS defines it, in world units: 1.1 times the
    /// largest distance of a camera from the cameras' mean. Always positive.
    ///
    /// A single camera, or cameras in one place, have no such extent: 1.1 times
    /// the median distance from them to the points stands in for it, and 1
    /// where that too is zero.
    pub fn extent(&self) -> f64 {
        let center = self.center();
        let radii = (self.views.iter()).map(|view| view.camera.center().distance(center));
        let radius = radii.fold(0.0, f64::max);
        let distances = (self.points.iter()).map(|point| point.position.distance(center));
        let mut distances: Vec<f64> = distances.collect();
        let middle = distances.len() / 2;
        let to_points = match distances.get(middle) {
            Some(_) => *distances.select_nth_unstable_by(middle, f64::total_cmp).1,
            None => 0.0,
        };
        match radius {
            radius if radius > COINCIDENT * to_points => EXTENT_MARGIN * radius,
            _ if to_points > 0.0 => EXTENT_MARGIN * to_points,
            _ => 1.0,
        }
    }

    /// Returns true if all photos were taken from one place: then they show no depth.
    pub fn is_panorama(&self) -> bool {
        let center = self.center();
        let apart = (self.views.iter()).map(|view| view.camera.center().distance(center));
        let mut distances: Vec<f64> = (self.points.iter())
            .map(|point| point.position.distance(center))
            .collect();
        let middle = distances.len() / 2;
        distances.get(middle).is_some()
            && self.views.len() > 1
            && apart.fold(0.0, f64::max)
                <= NO_BASELINE * *distances.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// Paths of all photos below [`Self::photos`], also of those without a pose.
    pub fn all_photos(&self) -> Vec<String> {
        match source::lists_photos(&self.root) {
            true => {
                // All views of a photo are neighbors.
                let mut photos: Vec<String> =
                    (self.views.iter()).map(|view| view.photo.clone()).collect();
                photos.dedup();
                photos
            }
            false => photos_in(&self.photos),
        }
    }

    /// The mean of the camera centers.
    pub fn center(&self) -> DVec3 {
        let sum: DVec3 = self.views.iter().map(|view| view.camera.center()).sum();
        sum / self.views.len().max(1) as f64
    }

    /// Moves coordinates that are large against the scene, such as UTM ones,
    /// to the origin while they are still f64.
    fn recenter(&mut self) {
        let center = self.center();
        if center.length() <= RECENTER_EXTENTS * self.extent() {
            return;
        }
        let offset = center.round();
        for view in &mut self.views {
            view.camera = view.camera.recentered(offset);
        }
        for point in &mut self.points {
            point.position -= offset;
        }
        self.offset = offset;
    }
}

/// Takes points out whose coordinates no scene has, and names how many.
///
/// # Errors
/// [`CaptureError::NoPoints`] where none is left.
fn retain_places(points: &mut Vec<Point>, path: &Path) -> Result<Option<Rejected>, CaptureError> {
    let announced = points.len();
    points.retain(|point| is_place(point.position));
    if points.is_empty() {
        return Err(CaptureError::NoPoints { path: path.into() });
    }
    let left_out = announced - points.len();
    Ok((left_out > 0).then(|| Rejected {
        name: colmap::file_name(path),
        reason: format!(
            "{left_out} of {announced} points have coordinates that are not finite or beyond {LARGEST_COORDINATE:e}"
        ),
    }))
}

/// Photos that were chosen and that the model does not place.
fn not_placed(chosen: Option<&Chosen>, images: &[(usize, colmap::Image)]) -> Vec<Rejected> {
    let names = images.iter().map(|(_, image)| image.name.as_str());
    let placed: BTreeSet<&str> = names.collect();
    let chosen = chosen.into_iter();
    let wanted = chosen.flat_map(|chosen| chosen.train.union(&chosen.test));
    let missing = wanted.filter(|name| !placed.contains(name.as_str()));
    missing
        .map(|name| Rejected {
            name: name.clone(),
            reason: "it was chosen, and the model does not place it".into(),
        })
        .collect()
}

/// The views that a camera's photos become.
fn arranged(
    camera: colmap::Camera,
    path: &Path,
    options: &LoadOptions,
) -> Result<Arrangement, CaptureError> {
    let lens = camera.lens?;
    let model = lens.model;
    Arrangement::new(lens, options).map_err(|reason| CaptureError::Lens {
        path: path.into(),
        camera_id: camera.id,
        model,
        reason,
    })
}

/// The rotation of a pose, or why it is none.
fn pose([w, x, y, z]: [f64; 4], translation: DVec3) -> Result<DMat3, String> {
    let quaternion = DQuat::from_xyzw(x, y, z, w);
    if !(quaternion.is_finite() && translation.is_finite()) {
        return Err("its pose is not finite".into());
    }
    let length = quaternion.length();
    if (length - 1.0).abs() > QUATERNION_SLACK {
        return Err(format!(
            "its rotation is a quaternion of length {length} instead of 1"
        ));
    }
    if !is_place(translation) {
        return Err(format!("its translation exceeds {LARGEST_COORDINATE:e}"));
    }
    Ok(DMat3::from_quat(quaternion.normalize()))
}

/// Returns true if coordinates are finite and of a size that a scene can have.
fn is_place(position: DVec3) -> bool {
    // NaN fails the comparison.
    let all = position.to_array();
    all.iter().all(|c| c.abs() <= LARGEST_COORDINATE)
}

fn check_photos_exist(views: &[View]) -> Result<(), CaptureError> {
    let mut missing = views.iter().filter(|view| !view.image_path.is_file());
    match missing.next() {
        None => Ok(()),
        Some(first) => Err(CaptureError::MissingPhotos {
            first: first.image_path.clone(),
            missing: 1 + missing.count(),
            total: views.len(),
        }),
    }
}
