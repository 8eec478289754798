//! A folder of colored images as a teacher.

use super::named_images::NamedImages;
use super::settings::file_name;
use super::shown::SampleSheet;
use super::{AbImage, GrayImage, Query, TeacherError, TeacherInfo};
use crate::capture::Capture;
use crate::color::srgb_to_lab;
use image::{DynamicImage, Rgb, Rgb32FImage};
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// Images that were colored elsewhere, for any subset of the photos.
///
/// An image belongs to the photo with the same path below the folder, with the extension of a
/// picture behind it or without; where there is none, to the only photo whose path differs in
/// nothing but the extension. Symbolic links to folders are not followed.
pub struct FolderTeacher {
    folder: PathBuf,
    images: NamedImages,
    /// True if the images are the photos themselves.
    of_photos: bool,
    shown: RefCell<SampleSheet>,
}

/// Share of an image that may be transparent without a word.
const TRANSPARENT: f64 = 0.01;

/// Share of an image that is gray and not black or white from which on it is doubtful. Walls and
/// clouds are gray in part in photos, too; an image colored in one half is in more than this.
const GRAY: f64 = 0.4;

/// Tones that are neither black nor white, where whatever is colored is gray, and how far
/// channels of a gray are apart: of 1.
const TONES: std::ops::RangeInclusive<f32> = 0.01..=0.99;
const SAME: f32 = 1e-3;

impl FolderTeacher {
    /// Looks for images in `folder` and its subfolders.
    ///
    /// # Errors
    /// [`TeacherError::EmptyFolder`] where there is none,
    /// [`TeacherError::Io`] where a folder cannot be read.
    pub fn open(folder: &Path) -> Result<Self, TeacherError> {
        Ok(Self {
            folder: folder.to_path_buf(),
            images: NamedImages::open(folder)?,
            of_photos: false,
            shown: RefCell::default(),
        })
    }

    /// Says which photos there are, so that an image of one is not taken for another's.
    pub fn know(&mut self, capture: &Capture) {
        self.images.know(capture);
        let [own, photos] = [&self.folder, &capture.photos].map(|dir| dir.canonicalize());
        self.of_photos = matches!((own, photos), (Ok(own), Ok(photos)) if own == photos);
    }

    /// Returns true if there is an image for a photo, which may be given by its path below the
    /// photo folder.
    ///
    /// # Errors
    /// [`TeacherError::AmbiguousNames`] where nobody knows.
    pub fn covers<'a>(&'a self, query: impl Into<Query<'a>>) -> Result<bool, TeacherError> {
        self.images.covers(query)
    }

    pub(super) fn describe(&self) -> TeacherInfo {
        TeacherInfo {
            name: file_name(&self.folder),
            kind: "folder".to_owned(),
            sha256: None,
            device: None,
            input_size: None,
            class: None,
        }
    }

    /// Warnings about the images so far, a line each.
    pub(super) fn doubts(&self) -> Vec<String> {
        let images = self.images.doubts().into_iter();
        images.chain(self.shown.borrow().doubt()).collect()
    }

    fn doubt(&self, path: &Path, transparent: f64, gray: f64) {
        if transparent >= TRANSPARENT {
            let doubt = "are transparent in part, and teach the colors that are hidden there: where only a part is painted, give them as hints";
            self.images.doubt(path, Some(transparent), doubt.to_owned());
        }
        // Whole ones are told of elsewhere.
        if (GRAY..1.0).contains(&gray) {
            let doubt = "are gray in large part, and what they show there becomes gray: where only a part is colored, give them as hints";
            self.images.doubt(path, Some(gray), doubt.to_owned());
        }
    }

    /// Refuses images that show other photos than those whose names they have.
    pub(super) fn check(&self) -> Result<(), TeacherError> {
        self.shown.borrow().check(&self.folder)
    }

    /// Colors of the photo's image at the image's size, or at the photo's where the
    /// image is of the photo before its lens was taken out; none where there is no
    /// image.
    pub(super) fn colorize<'a>(
        &self,
        query: impl Into<Query<'a>>,
        photo: GrayImage<'_>,
    ) -> Result<Option<AbImage>, TeacherError> {
        let query = query.into();
        let mut shown = self.shown.borrow_mut();
        shown.look(query.name, photo);
        let Some(found) = self.images.load(query, photo)? else {
            return Ok(None);
        };
        let size = [found.image.width(), found.image.height()];
        // A face is but a part of its photo.
        let faces = found
            .original
            .is_some_and(|original| original.name != query.name);
        if !faces {
            shown.look_at(&file_name(found.path), &found.image);
        }
        let transparent = transparent(&found.image);
        let rgb = found.image.into_rgb32f();
        if !self.of_photos {
            self.doubt(found.path, transparent, gray(&rgb));
        }
        let ab = rgb.pixels().map(|rgb| {
            let [_, a, b] = srgb_to_lab(rgb.0.map(f64::from));
            [a as f32, b as f32]
        });
        let (ab, [width, height]) = match found.original {
            Some(original) => (
                original.shown(ab.collect(), size),
                [photo.width, photo.height],
            ),
            None => (ab.collect(), size),
        };
        Ok(Some(AbImage { width, height, ab }))
    }
}

/// Share of an image that is transparent at least in part.
fn transparent(image: &DynamicImage) -> f64 {
    if !image.color().has_alpha() {
        return 0.0;
    }
    let alphas = image.to_luma_alpha8();
    let clear = alphas.pixels().filter(|pixel| pixel.0[1] < u8::MAX);
    clear.count() as f64 / alphas.pixels().len() as f64
}

/// Share of what is neither black nor white in an image that is gray; 0 where that is little.
fn gray(image: &Rgb32FImage) -> f64 {
    let (mut gray, mut all) = (0, 0);
    for &Rgb([r, g, b]) in image.pixels() {
        if TONES.contains(&g) {
            all += 1;
            gray += usize::from((r - g).abs() < SAME && (b - g).abs() < SAME);
        }
    }
    match 10 * all < image.pixels().len() {
        true => 0.0,
        false => f64::from(gray as u32) / f64::from(all as u32),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Upsample;
    use super::*;
    use crate::capture::lens::{ModelName, Undistortion};
    use crate::capture::{Camera, View};
    use image::RgbImage;
    use std::fs;
    use std::sync::Arc;
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

    fn teacher_of(folder: &TempDir) -> FolderTeacher {
        FolderTeacher::open(folder.path()).unwrap()
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
            assert!(teacher.covers(known).unwrap());
        }
        assert!(teacher.covers("left/0001.jpeg").unwrap());
        assert!(teacher.covers("./left/0001.tiff").unwrap());
        assert!(teacher.covers("a.b").unwrap());
        for other in ["0001.png", "left/0002.png", "left/0001/x.png", "a.png", ""] {
            assert!(!teacher.covers(other).unwrap(), "{other}");
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
    fn an_image_is_not_taken_for_another_photos() {
        let folder = tempfile::tempdir().unwrap();
        save(&folder, "shot0.png", 8, 8, [255, 0, 0]);
        let view = |name: &str| View {
            name: name.into(),
            photo: name.into(),
            undistortion: None,
            ..face(name)
        };
        let mut capture = Capture {
            root: folder.path().into(),
            photos: folder.path().join("images"),
            split: None,
            views: vec![view("shot0.jpg"), view("shot0.png")],
            points: Vec::new(),
            offset: glam::DVec3::ZERO,
            rejected: Vec::new(),
            doubts: Vec::new(),
            distortion: 0.0,
        };
        let mut teacher = teacher_of(&folder);
        assert!(teacher.covers("shot0.jpg").unwrap());
        teacher.know(&capture);
        assert!(!teacher.covers("shot0.jpg").unwrap());
        assert!(teacher.covers("shot0.png").unwrap());
        capture.views[1] = view("shot0.tif");
        let mut teacher = teacher_of(&folder);
        teacher.know(&capture);
        let error = teacher.colorize("shot0.jpg", photo(8, 8)).unwrap_err();
        let error = error.to_string();
        for name in ["shot0.png", "shot0.jpg", "shot0.tif", "shot0.jpg.png"] {
            assert!(error.contains(name), "{error}");
        }
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
        // The border sees half a stripe more of one color.
        for ab in small.ab.chunks(8).flat_map(|row| &row[1..7]) {
            assert!((ab[0] - mean).abs() < 0.01, "{} {mean}", ab[0]);
        }
    }

    #[test]
    fn images_that_are_gray_or_transparent_in_part_are_doubtful() {
        let folder = tempfile::tempdir().unwrap();
        let half = |x: u32, y: u32| {
            if x < 4 {
                [90; 3]
            } else {
                [90, 20 + y as u8, 30]
            }
        };
        let image = RgbImage::from_fn(8, 8, |x, y| Rgb(half(x, y)));
        image.save(folder.path().join("half.png")).unwrap();
        let mut clear = DynamicImage::from(image).into_rgba8();
        clear
            .pixels_mut()
            .take(16)
            .for_each(|pixel| pixel.0 = [200, 9, 9, 0]);
        clear.save(folder.path().join("clear.png")).unwrap();
        save(&folder, "weak.png", 8, 8, [90, 91, 90]);
        save(&folder, "white.png", 8, 8, [255; 3]);
        let teacher = teacher_of(&folder);
        for name in ["half.jpg", "clear.jpg", "weak.jpg", "white.jpg"] {
            teacher.colorize(name, photo(8, 8)).unwrap();
        }
        let doubts = teacher.doubts();
        assert!(doubts[0].contains("(half.png 50 %) are gray in large part"));
        assert!(doubts[1].contains("(clear.png 25 %) are transparent in part"));
        assert_eq!(doubts.len(), 2, "{doubts:?}");
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
        for part in ["wide.png", "wide.jpg", "103 x 100", "8 x 8", "crop"] {
            assert!(error.contains(part), "{error}");
        }
        save(&folder, "turned.png", 4, 6, [10, 20, 30]);
        let error = teacher_of(&folder).colorize("turned.jpg", photo(6, 4));
        let error = error.unwrap_err().to_string();
        assert!(error.contains("turn it back"), "{error}");
    }

    #[test]
    fn folders_that_teach_nothing() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(
            FolderTeacher::open(folder.path()),
            Err(TeacherError::EmptyFolder { .. })
        ));
    }

    #[test]
    fn two_images_that_may_be_one_photos() {
        let folder = tempfile::tempdir().unwrap();
        save(&folder, "v.png", 4, 4, [1, 2, 3]);
        save(&folder, "v.jpg", 4, 4, [1, 2, 3]);
        let teacher = FolderTeacher::open(folder.path()).unwrap();
        assert!(teacher.colorize("v.jpg", photo(4, 4)).unwrap().is_some());
        let error = teacher.colorize("v.tif", photo(4, 4)).unwrap_err();
        let error = error.to_string();
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

    /// A view of a photo of 40 × 30 pixels through a fisheye that sees 140°.
    fn face(name: &str) -> View {
        let lens = ModelName::named("SIMPLE_FISHEYE").unwrap();
        let focal = 20.0 / 70_f64.to_radians();
        let lens = Arc::new(lens.lens(40, 30, &[focal, 20.0, 15.0]).unwrap());
        let cuts = lens.cuts().unwrap();
        let cut = cuts.iter().find(|cut| cut.face == Some("front")).unwrap();
        View {
            name: name.into(),
            photo: "a/b.jpg".into(),
            image_path: "b.jpg".into(),
            camera: cut.camera.clone(),
            undistortion: Some(Undistortion {
                lens: lens.clone(),
                rotation: cut.rotation,
            }),
            stance: Default::default(),
        }
    }

    #[test]
    fn images_of_photos_are_seen_through_their_lens() {
        let folder = tempfile::tempdir().unwrap();
        // Red left of the middle and blue right of it, at twice the photo's size.
        let mut halves = RgbImage::new(80, 60);
        for (x, _, pixel) in halves.enumerate_pixels_mut() {
            *pixel = Rgb(if x < 40 { [255, 0, 0] } else { [0, 0, 255] });
        }
        fs::create_dir(folder.path().join("a")).unwrap();
        halves.save(folder.path().join("a/b.png")).unwrap();
        let teacher = FolderTeacher::open(folder.path()).unwrap();
        let view = face("a/b@front.jpg");
        let Camera { width, height, .. } = view.camera;
        let pixels = vec![128; (width * height) as usize];
        let gray = GrayImage {
            width,
            height,
            pixels: &pixels,
        };
        let query = || Query::view(&view, &view.camera);
        let answer = teacher.colorize(query(), gray).unwrap().unwrap();
        assert_eq!((answer.width, answer.height), (width, height));
        let row = &answer.ab[(height / 2 * width) as usize..][..width as usize];
        let middle = width as usize / 2;
        let red = srgb_to_lab([1.0, 0.0, 0.0])[2] as f32;
        let blue = srgb_to_lab([0.0, 0.0, 1.0])[2] as f32;
        for (x, [_, b]) in row.iter().enumerate() {
            let expected = if x < middle { red } else { blue };
            // The filter reaches two pixels over the border between them.
            if x.abs_diff(middle) > 3 {
                assert!((b - expected).abs() < 0.1, "{x}: {b}");
            }
        }
        // Its own image goes before the photo's.
        save(&folder, "a/b@front.png", width, height, [0, 255, 0]);
        let teacher = FolderTeacher::open(folder.path()).unwrap();
        let answer = teacher.colorize(query(), gray).unwrap().unwrap();
        assert!(answer.ab.iter().all(|ab| ab[0] < -80.0));
        // An image of another cut of the photo is still refused.
        save(&folder, "a/b.png", 60, 60, [0, 255, 0]);
        fs::remove_file(folder.path().join("a/b@front.png")).unwrap();
        let teacher = FolderTeacher::open(folder.path()).unwrap();
        let error = teacher.colorize(query(), gray).unwrap_err().to_string();
        assert!(
            error.contains("a/b.jpg") && error.contains("40 x 30"),
            "{error}"
        );
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
            assert_eq!(teacher.covers(name).unwrap(), known, "{name}");
        }
    }
}
