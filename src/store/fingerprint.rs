//! Hashes of a training's input.

use std::{
    collections::{BTreeMap, BTreeSet},
    io,
    path::Path,
};

use glam::DVec3;

use super::files;
use crate::{
    capture::{Capture, Dataset, Photo, View, first_views, in_order},
    disk::trust,
    hash::{self, Hasher},
    input,
    report::{FileReport, PhotoReport},
    store::StoreError,
};

/// A SHA-256 over photos at working size, their cameras and COLMAP's points.
#[derive(Default)]
pub(crate) struct Fingerprint(Hasher);

impl Fingerprint {
    /// Takes a view; all are taken in their order.
    pub fn look(&mut self, dataset: &Dataset, view: usize, photo: &Photo) {
        let camera = &dataset.cameras[view];
        self.0.update(dataset.capture.views[view].name.as_bytes());
        for side in [photo.width, photo.height] {
            self.0.update(&side.to_le_bytes());
        }
        let rotation = camera.rotation.to_cols_array();
        let pose = rotation.into_iter().chain(camera.translation.to_array());
        let lens = [camera.fx, camera.fy, camera.cx, camera.cy];
        pose.chain(lens)
            .for_each(|value| self.0.update(&value.to_le_bytes()));
        self.0.update(&photo.gray);
        self.0.update(photo.mask.as_deref().unwrap_or_default());
    }

    /// Takes the points; in hexadecimal.
    pub fn finish(mut self, capture: &Capture) -> String {
        for point in &capture.points {
            for value in point.position.to_array() {
                self.0.update(&value.to_le_bytes());
            }
            self.0.update(&point.color);
        }
        self.0.finish()
    }
}

/// Hexadecimal digits of a photo's SHA-256 that are kept.
const DIGITS: usize = 16;

/// The photos of a capture, in the order of their names: their files and poses. Files that have
/// not changed since `before` are not hashed again.
pub(crate) fn of_photos(
    capture: &Capture,
    before: &[PhotoReport],
) -> Result<Vec<PhotoReport>, StoreError> {
    let views: Vec<_> = first_views(&capture.views).collect();
    let known: BTreeMap<&str, &PhotoReport> =
        before.iter().map(|photo| (&*photo.name, photo)).collect();
    let mut photos = Vec::with_capacity(views.len());
    in_order(
        &views,
        |view| {
            let known = known.get(&*view.photo);
            hashed(
                &view.image_path,
                known.map(|photo| [&*photo.stamp, &*photo.sha256]),
            )
        },
        |view, hashed| {
            let [stamp, sha256] = hashed.map_err(files::at(&view.image_path))?;
            photos.push(PhotoReport {
                name: view.photo.clone(),
                sha256,
                stamp,
                pose: pose(view, capture.offset),
            });
            Ok::<_, StoreError>(())
        },
    )?;
    photos.sort();
    Ok(photos)
}

/// A file of a run that has just been written to `path`.
pub(crate) fn of_file(path: &Path) -> Result<FileReport, StoreError> {
    let [stamp, sha256] = hashed(path, None).map_err(files::at(path))?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Ok(FileReport {
        name: name.into_owned(),
        sha256,
        stamp,
    })
}

/// Stamp and digits of a file's SHA-256; `known` are those of before.
pub(crate) fn hashed(path: &Path, known: Option<[&str; 2]>) -> io::Result<[String; 2]> {
    let file = input::open(path)?;
    let stamp = trust::stamp(&file)?;
    let sha256 = match known {
        Some([before, sha256]) if *before == stamp => sha256.to_owned(),
        _ => digits(hash::of_file(file)?),
    };
    Ok([stamp, sha256])
}

/// Camera and pose of a photo in a few digits. As many as 32-bit floats have are the same in
/// text and in binary models.
fn pose(view: &View, offset: DVec3) -> String {
    let camera = &view.camera;
    let numbers = [camera.fx, camera.fy, camera.cx, camera.cy]
        .into_iter()
        .chain(camera.rotation.to_cols_array())
        .chain(camera.translation.to_array())
        .chain(offset.to_array());
    let mut hasher = Hasher::default();
    for side in view.photo_size() {
        hasher.update(&side.to_le_bytes());
    }
    numbers.for_each(|number| hasher.update(&(number as f32).to_le_bytes()));
    digits(hasher.finish())
}

fn digits(mut sha256: String) -> String {
    sha256.truncate(DIGITS);
    sha256
}

/// Changes of photos since training, by name.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Changes {
    /// Photos that are there, of all.
    pub photos: usize,
    /// Their files are others, or were not there.
    pub changed: Vec<String>,
    /// They are not there any more.
    pub gone: Vec<String>,
    /// The first that is now what another was, and that other.
    pub exchanged: Option<[String; 2]>,
    /// They were taken elsewhere, or through another lens.
    pub moved: Vec<String>,
}

impl Changes {
    /// Compares those that were trained on with those that are there.
    pub fn between(before: &[PhotoReport], now: &[PhotoReport]) -> Self {
        let known: BTreeMap<&str, &PhotoReport> =
            before.iter().map(|photo| (&*photo.name, photo)).collect();
        let names: BTreeSet<&str> = now.iter().map(|photo| photo.name.as_str()).collect();
        let is_other = |photo: &&PhotoReport| {
            let known = known.get(&*photo.name);
            known.is_none_or(|known| known.sha256 != photo.sha256)
        };
        let is_moved = |photo: &&PhotoReport| {
            let known = known.get(&*photo.name);
            known.is_some_and(|known| !known.pose.is_empty() && known.pose != photo.pose)
        };
        let gone = before.iter().filter(|photo| !names.contains(&*photo.name));
        let of_bytes: BTreeMap<&str, &str> = (before.iter())
            .map(|photo| (&*photo.sha256, &*photo.name))
            .collect();
        let was = |photo: &PhotoReport| {
            let other = of_bytes.get(&*photo.sha256)?;
            Some([photo.name.clone(), (*other).to_owned()])
        };
        let name = |photo: &PhotoReport| photo.name.clone();
        Self {
            photos: now.len(),
            exchanged: now.iter().filter(is_other).find_map(was),
            changed: now.iter().filter(is_other).map(name).collect(),
            gone: gone.map(name).collect(),
            moved: now.iter().filter(is_moved).map(name).collect(),
        }
    }

    /// Refuses photos that have other poses now: a scene's colors would go elsewhere.
    pub fn check_poses(&self, folder: &Path) -> Result<(), StoreError> {
        match self.moved.first() {
            None => Ok(()),
            Some(photo) => Err(StoreError::OtherModel {
                folder: folder.to_owned(),
                photo: photo.clone(),
                moved: self.moved.len(),
                photos: self.photos,
            }),
        }
    }
}

/// Refuses a capture whose photos have other poses than those a run was trained with; photos are
/// not read.
pub(crate) fn check_poses(capture: &Capture, before: &[PhotoReport]) -> Result<(), StoreError> {
    let views = first_views(&capture.views);
    let now: Vec<PhotoReport> = views
        .map(|view| PhotoReport {
            name: view.photo.clone(),
            pose: pose(view, capture.offset),
            ..PhotoReport::default()
        })
        .collect();
    Changes::between(before, &now).check_poses(&capture.root)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_found() {
        let photos = |list: &[[&str; 3]]| -> Vec<PhotoReport> {
            let photo = |[name, sha256, pose]: &[&str; 3]| PhotoReport {
                name: (*name).to_owned(),
                sha256: (*sha256).to_owned(),
                pose: (*pose).to_owned(),
                ..PhotoReport::default()
            };
            list.iter().map(photo).collect()
        };
        let before = photos(&[["a", "1", "x"], ["b", "2", ""], ["c", "3", "x"]]);
        let now = photos(&[["a", "1", "y"], ["b", "9", "y"], ["d", "3", "y"]]);
        let changes = Changes::between(&before, &now);
        let expected = Changes {
            photos: 3,
            changed: vec!["b".to_owned(), "d".to_owned()],
            gone: vec!["c".to_owned()],
            exchanged: Some(["d".to_owned(), "c".to_owned()]),
            moved: vec!["a".to_owned()],
        };
        assert_eq!(changes, expected);
        let error = changes.check_poses(Path::new("scene")).unwrap_err();
        assert!(error.to_string().contains("1 of 3"), "{error}");
        let same = Changes::between(&before, &before);
        assert!(same.changed.is_empty() && same.check_poses(Path::new("scene")).is_ok());
    }
}
