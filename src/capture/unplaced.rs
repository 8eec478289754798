//! Photos that are there but have no pose.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use super::names::{composed, photos_in};
use super::source::lists_photos;
use super::{Capture, CaptureError, colmap, first_views};

/// A share of the photos without a pose that is not worth a word: COLMAP seldom places all.
const USUAL: f64 = 0.1;

/// More photos without a pose than COLMAP usually leaves, or more photos in another model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unplaced {
    /// Photos that the model knows.
    pub placed: usize,
    /// Photos in `images/`.
    pub photos: usize,
    /// The model that is used.
    pub model: PathBuf,
    /// The model beside it that places the most photos, if these are more.
    pub better: Option<(PathBuf, u64)>,
}

impl Unplaced {
    /// Counts photos and models; none where nearly all photos have a pose and no other model
    /// has more.
    ///
    /// # Errors
    /// If the capture's model is gone.
    pub fn of(capture: &Capture) -> Result<Option<Self>, CaptureError> {
        if lists_photos(&capture.root) {
            return Ok(None);
        }
        let views = first_views(&capture.views);
        let used: BTreeSet<String> = views.map(|view| composed(&view.photo)).collect();
        let rejected = capture.rejected.iter();
        let rejected: BTreeSet<String> = rejected.map(|photo| composed(&photo.name)).collect();
        let (mut placed, mut others) = (used.len(), 0);
        for name in photos_in(&capture.photos) {
            let name = composed(&name);
            // That a photo was left out for another reason has been said.
            placed += usize::from(rejected.contains(&name));
            others += usize::from(!(used.contains(&name) || rejected.contains(&name)));
        }
        let photos = placed + others;
        let model = colmap::folder(&capture.root)?;
        let better = best_model(&capture.root, &model);
        let few = others as f64 > USUAL * photos as f64;
        Ok((few || better.is_some()).then_some(Self {
            placed,
            photos,
            model,
            better,
        }))
    }
}

/// The model in a folder of `sparse/` that places the most images, if these are more than those
/// of the model that is used.
fn best_model(root: &Path, used: &Path) -> Option<(PathBuf, u64)> {
    let own = colmap::images_in(used)?;
    let entries = fs::read_dir(root.join("sparse")).ok()?;
    let others = entries.flatten().map(|entry| entry.path());
    let counts = others.filter_map(|path| {
        let count = colmap::images_in(&path)?;
        Some((path, count))
    });
    // Of several with as many the first by name.
    counts
        .filter(|(_, count)| *count > own)
        .max_by(|(a, more), (b, than)| more.cmp(than).then(b.cmp(a)))
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{Model, folder, write};
    use super::super::{LoadOptions, Rejected};
    use super::*;

    fn unplaced(dir: &Path) -> Option<Unplaced> {
        Unplaced::of(&Capture::load(dir).unwrap()).unwrap()
    }

    #[test]
    fn photos_without_a_pose_are_counted() {
        let model = Model::example();
        let dir = folder(&model);
        write(dir.path(), "sparse/0", model.binary(), "bin");
        assert_eq!(unplaced(dir.path()), None);
        fs::write(dir.path().join("images/notes.txt"), "").unwrap();
        assert_eq!(unplaced(dir.path()), None);
        for name in ["d.JPG", "left/e.tif"] {
            fs::write(dir.path().join("images").join(name), "").unwrap();
        }
        let found = unplaced(dir.path()).expect("two of five have no pose");
        assert_eq!((found.placed, found.photos), (3, 5));
        assert_eq!(found.better, None);
        // What is left out has a pose all the same.
        let options = LoadOptions {
            left_out: vec![Rejected {
                name: "b.png".into(),
                reason: "turned".into(),
            }],
            ..LoadOptions::default()
        };
        let capture = Capture::load_with(dir.path(), &options).unwrap();
        assert_eq!(Unplaced::of(&capture).unwrap(), Some(found));
    }

    #[test]
    fn a_model_that_places_more_is_named() {
        let all = Model::example();
        let dir = folder(&all);
        let mut part = all.clone();
        part.images.truncate(1);
        for (extension, files) in [("bin", all.binary()), ("txt", all.text())] {
            write(dir.path(), "sparse/0", part.binary(), "bin");
            write(dir.path(), "sparse/1", files, extension);
            let found = unplaced(dir.path()).expect("one of three has a pose");
            let better = dir.path().join("sparse/1");
            assert_eq!(found.better, Some((better.clone(), 3)));
            assert_eq!((found.placed, found.photos), (1, 3));
            // As many are not more.
            write(dir.path(), "sparse/0", all.binary(), "bin");
            assert_eq!(unplaced(dir.path()), None);
            fs::remove_dir_all(better).unwrap();
        }
        // Nor is what a file cannot hold.
        let mut lies = all.binary();
        lies[1][..8].copy_from_slice(&u64::MAX.to_le_bytes());
        write(dir.path(), "sparse/1", lies, "bin");
        assert_eq!(unplaced(dir.path()), None);
    }
}
