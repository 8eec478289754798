//! What a training was given, in a few digits.

use std::collections::{BTreeMap, BTreeSet};

use super::{RunError, files};
use crate::{
    capture::{Capture, Dataset, Photo, first_views, in_order},
    hash::{self, Hasher},
    input,
    report::PhotoReport,
};

/// A SHA-256 over photos at working size, their cameras and COLMAP's points.
#[derive(Default)]
pub(super) struct Fingerprint(Hasher);

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

/// The files of a capture's photos, in the order of their names.
///
/// # Errors
/// [`RunError::File`].
pub(super) fn of_files(capture: &Capture) -> Result<Vec<PhotoReport>, RunError> {
    let views: Vec<_> = first_views(&capture.views).collect();
    let mut photos = Vec::with_capacity(views.len());
    in_order(
        &views,
        |view| input::open(&view.image_path).and_then(hash::of_file),
        |view, sha256| {
            let mut sha256 = sha256.map_err(files::at(&view.image_path))?;
            sha256.truncate(DIGITS);
            let name = view.photo.clone();
            photos.push(PhotoReport { name, sha256 });
            Ok::<_, RunError>(())
        },
    )?;
    photos.sort();
    Ok(photos)
}

/// What became of photos since they were trained on, by name.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Changes<'a> {
    /// Their files are others, or were not there.
    pub changed: Vec<&'a str>,
    /// They are not there any more.
    pub gone: Vec<&'a str>,
    /// The first that is now what another was, and that other.
    pub exchanged: Option<[&'a str; 2]>,
}

impl<'a> Changes<'a> {
    /// Compares those that were trained on with those that are there.
    pub fn between(before: &'a [PhotoReport], now: &'a [PhotoReport]) -> Self {
        let known: BTreeSet<_> = before.iter().collect();
        let names: BTreeSet<&str> = now.iter().map(|photo| photo.name.as_str()).collect();
        let changed = now.iter().filter(|photo| !known.contains(photo));
        let gone = before.iter().filter(|photo| !names.contains(&*photo.name));
        let of_bytes: BTreeMap<&str, &str> = (before.iter())
            .map(|photo| (&*photo.sha256, &*photo.name))
            .collect();
        let was = |photo: &'a PhotoReport| Some([&*photo.name, of_bytes.get(&*photo.sha256)?]);
        Self {
            exchanged: changed.clone().find_map(was),
            changed: changed.map(|photo| photo.name.as_str()).collect(),
            gone: gone.map(|photo| photo.name.as_str()).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_found() {
        let photos = |list: &[[&str; 2]]| -> Vec<PhotoReport> {
            let photo = |[name, sha256]: &[&str; 2]| PhotoReport {
                name: (*name).to_owned(),
                sha256: (*sha256).to_owned(),
            };
            list.iter().map(photo).collect()
        };
        let before = photos(&[["a", "1"], ["b", "2"], ["c", "3"]]);
        let now = photos(&[["a", "1"], ["b", "9"], ["d", "3"]]);
        let changes = Changes::between(&before, &now);
        let expected = Changes {
            changed: vec!["b", "d"],
            gone: vec!["c"],
            exchanged: Some(["d", "c"]),
        };
        assert_eq!(changes, expected);
        assert!(Changes::between(&before, &before).changed.is_empty());
    }
}
