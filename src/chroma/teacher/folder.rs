//! A folder of coloured images as a teacher.

use super::named_images::NamedImages;
use super::{AbImage, GrayImage, TeacherError, TeacherInfo, file_name};
use crate::color::srgb_to_lab;
use std::path::{Path, PathBuf};

/// Images that were coloured elsewhere, for any subset of the photos.
///
/// An image belongs to the photo with the same path below the folder, whatever
/// the two extensions are. Symbolic links to folders are not followed.
pub struct FolderTeacher {
    folder: PathBuf,
    images: NamedImages,
}

impl FolderTeacher {
    /// Looks for images in `folder` and its subfolders.
    ///
    /// # Errors
    /// [`TeacherError::EmptyFolder`] where there is none,
    /// [`TeacherError::TwoImages`] where two differ only in their extension,
    /// [`TeacherError::Io`] where a folder cannot be read.
    pub fn open(folder: &Path) -> Result<Self, TeacherError> {
        Ok(Self {
            folder: folder.to_path_buf(),
            images: NamedImages::open(folder)?,
        })
    }

    /// Whether there is an image for the photo with this path below the photo
    /// folder.
    pub fn covers(&self, name: &str) -> bool {
        self.images.covers(name)
    }

    pub(super) fn describe(&self) -> TeacherInfo {
        TeacherInfo {
            name: file_name(&self.folder),
            kind: "folder".to_owned(),
            sha256: None,
            input_size: None,
        }
    }

    /// Colours of the photo's image at the image's size; none where there is no
    /// image.
    pub(super) fn colorize(
        &self,
        name: &str,
        photo: GrayImage<'_>,
    ) -> Result<Option<AbImage>, TeacherError> {
        let Some((_, image)) = self.images.load(name, photo)? else {
            return Ok(None);
        };
        let (width, height) = (image.width(), image.height());
        let rgb = image.into_rgb32f();
        let ab = rgb.pixels().map(|rgb| {
            let [_, a, b] = srgb_to_lab(rgb.0.map(f64::from));
            [a as f32, b as f32]
        });
        Ok(Some(AbImage {
            width,
            height,
            ab: ab.collect(),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Upsample;
    use super::*;
    use image::{Rgb, RgbImage};
    use std::fs;
    use tempfile::TempDir;

    const GRAY: [u8; 64] = [128; 64];

    fn photo(width: u32, height: u32) -> GrayImage<'static> {
        GrayImage {
            width,
            height,
            pixels: &GRAY[..(width * height) as usize],
        }
    }

    fn save(folder: &TempDir, name: &str, width: u32, height: u32, color: [u8; 3]) {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        RgbImage::from_pixel(width, height, Rgb(color))
            .save(path)
            .unwrap();
    }

    #[test]
    fn images_match_by_path_without_extension() {
        let folder = tempfile::tempdir().unwrap();
        save(&folder, "left/0001.png", 8, 8, [255, 0, 0]);
        save(&folder, "right/0001.JPG", 8, 8, [0, 0, 255]);
        save(&folder, "a.b.png", 8, 8, [0, 255, 0]);
        fs::write(folder.path().join("notes.txt"), "text").unwrap();
        let teacher = FolderTeacher::open(folder.path()).unwrap();
        for known in ["left/0001.png", "right/0001.png", "a.b.png"] {
            assert!(teacher.covers(known));
        }
        assert!(teacher.covers("left/0001.jpeg"));
        assert!(teacher.covers("./left/0001.tiff"));
        assert!(teacher.covers("a.b.png"));
        for other in ["0001.png", "left/0002.png", "left/0001/x.png", "a.png", ""] {
            assert!(!teacher.covers(other), "{other}");
            assert_eq!(teacher.colorize(other, photo(8, 8)).unwrap(), None);
        }
        // Blue has a strongly negative b, red a strongly positive a.
        let red = teacher
            .colorize("left/0001.jpg", photo(8, 8))
            .unwrap()
            .unwrap();
        assert!((red.ab[9][0] - 80.09).abs() < 0.05 && (red.ab[9][1] - 67.2).abs() < 0.05);
        let blue = teacher
            .colorize("right/0001.jpg", photo(8, 8))
            .unwrap()
            .unwrap();
        assert!(blue.ab[9][1] < -90.0);
    }

    #[test]
    fn images_of_other_sizes_are_averaged_to_the_photo() {
        let folder = tempfile::tempdir().unwrap();
        let mut stripes = RgbImage::new(64, 32);
        for (x, _, pixel) in stripes.enumerate_pixels_mut() {
            *pixel = Rgb(if x % 2 == 0 {
                [255, 0, 0]
            } else {
                [0, 255, 255]
            });
        }
        stripes.save(folder.path().join("v.png")).unwrap();
        let teacher = FolderTeacher::open(folder.path()).unwrap();
        let small = teacher.colorize("v.jpg", photo(8, 4)).unwrap().unwrap();
        let small = small.upsampled(photo(8, 4), Upsample::Guided);
        assert_eq!((small.width, small.height, small.ab.len()), (8, 4, 32));
        let a = |rgb| srgb_to_lab(rgb)[1] as f32;
        let mean = (a([1.0, 0.0, 0.0]) + a([0.0, 1.0, 1.0])) / 2.0;
        // The border sees half a stripe more of one colour.
        for ab in small.ab.chunks(8).flat_map(|row| &row[1..7]) {
            assert!((ab[0] - mean).abs() < 0.01, "{} {mean}", ab[0]);
        }
    }

    #[test]
    fn another_aspect_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        save(&folder, "wide.png", 103, 100, [10, 20, 30]);
        save(&folder, "near.png", 101, 100, [10, 20, 30]);
        let teacher = FolderTeacher::open(folder.path()).unwrap();
        assert!(teacher.colorize("near.png", photo(8, 8)).unwrap().is_some());
        let error = teacher
            .colorize("wide.jpg", photo(8, 8))
            .unwrap_err()
            .to_string();
        for part in ["wide.png", "wide.jpg", "103 x 100", "8 x 8"] {
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn folders_that_teach_nothing() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(
            FolderTeacher::open(folder.path()),
            Err(TeacherError::EmptyFolder { .. })
        ));
        save(&folder, "v.png", 4, 4, [1, 2, 3]);
        save(&folder, "v.jpg", 4, 4, [1, 2, 3]);
        let error = FolderTeacher::open(folder.path())
            .err()
            .unwrap()
            .to_string();
        assert!(
            error.contains("v.png") && error.contains("v.jpg"),
            "{error}"
        );
    }

    #[test]
    fn a_damaged_image_is_named() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("v.png"), b"\x89PNG\r\n\x1a\n broken").unwrap();
        fs::write(folder.path().join("w.jpg"), b"").unwrap();
        let teacher = FolderTeacher::open(folder.path()).unwrap();
        for name in ["v.png", "w.jpg"] {
            let error = teacher.colorize(name, photo(4, 4)).unwrap_err().to_string();
            assert!(error.contains(name), "{error}");
            assert!(!error.contains('\n'));
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_to_folders_are_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        save(&folder, "v.png", 4, 4, [1, 2, 3]);
        std::os::unix::fs::symlink(folder.path(), folder.path().join("loop")).unwrap();
        std::os::unix::fs::symlink(folder.path().join("v.png"), folder.path().join("w.png"))
            .unwrap();
        let teacher = FolderTeacher::open(folder.path()).unwrap();
        for (name, known) in [("v", true), ("w.jpg", true), ("loop/v.png", false)] {
            assert_eq!(teacher.covers(name), known, "{name}");
        }
    }
}
