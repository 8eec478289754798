//! Colors painted on a few places of a photo.

use super::images::{Filter, resample};
use super::named_images::NamedImages;
use super::{GrayImage, Query, TeacherError};
use crate::capture::{Capture, Orientation, SensorOrientation, decode_image};
use crate::color::srgb_to_lab;
use crate::input;
use image::Rgba32FImage;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A folder of painted hints, named like the photos, for any subset of them: PNG or TIFF images
/// with transparency, of which what is transparent says nothing, or opaque ones that are the photo
/// itself, of which what is as it was says nothing.
pub struct HintFolder {
    images: NamedImages,
    /// Paths of the photos by name, each with the orientation from its file to what COLMAP saw.
    photos: BTreeMap<String, (PathBuf, Orientation)>,
}

/// Levels, of 255, by which saving a photo anew may change a channel of it, and from which on a
/// pixel is painted.
const CHANGED: [f32; 2] = [12.0, 30.0];

/// Share of the pixels that must be as the photo has them, for a picture to be the photo with
/// strokes on it.
const UNPAINTED: f64 = 0.5;

/// The paint on one photo.
#[derive(Clone, Debug, PartialEq)]
pub struct HintImage {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// α a, α b, α of each pixel, `[height, width]`: CIELAB (D65) a, b of the
    /// paint, α from 0 (nothing painted) to 1.
    pub paint: Vec<[f32; 3]>,
}

impl HintFolder {
    /// Looks for images in `folder` and its subfolders.
    ///
    /// # Errors
    /// As for [`FolderTeacher::open`](super::FolderTeacher::open).
    pub fn open(folder: &Path) -> Result<Self, TeacherError> {
        let images = NamedImages::open(folder)?;
        let photos = BTreeMap::new();
        Ok(Self { images, photos })
    }

    /// Says which photos there are, so that paint on one is not taken for another's.
    pub fn know(&mut self, capture: &Capture) {
        self.images.know(capture);
        let photos = capture.views.iter();
        let photos = photos.map(|view| {
            let file = (view.image_path.clone(), view.stance.from_file);
            (view.photo.clone(), file)
        });
        self.photos = photos.collect();
    }

    /// Adds a photo of which there is no view, and that stands like this.
    pub fn know_photo(&mut self, name: &str, path: &Path, stance: SensorOrientation) {
        let file = (path.to_owned(), stance.from_file);
        self.photos.insert(name.to_owned(), file);
    }

    /// Warnings about the images so far, a line each.
    pub fn doubts(&self) -> Vec<String> {
        self.images.doubts()
    }

    /// Returns true if there is an image for a photo, painted or not.
    ///
    /// # Errors
    /// [`TeacherError::AmbiguousNames`] where nobody knows.
    pub fn covers<'a>(&'a self, query: impl Into<Query<'a>>) -> Result<bool, TeacherError> {
        self.images.covers(query)
    }

    /// The paint on a photo, at the paint's own size or, where it is painted on the
    /// photo before its lens was taken out, at the photo's; none where there is no
    /// image. A photo may be given by its path relative to the photo folder.
    ///
    /// # Errors
    /// [`TeacherError::NoTransparency`] where the image has no alpha channel and is not the
    /// photo with strokes on it; otherwise as for a folder teacher's image.
    pub fn load<'a>(
        &self,
        query: impl Into<Query<'a>>,
        photo: GrayImage<'_>,
    ) -> Result<Option<HintImage>, TeacherError> {
        let query = query.into();
        photo.check(query.name)?;
        let Some(found) = self.images.load(query, photo)? else {
            return Ok(None);
        };
        let size = [found.image.width(), found.image.height()];
        let has_alpha = found.image.color().has_alpha();
        let mut rgba = found.image.into_rgba32f();
        if rgba.pixels().all(|pixel| pixel.0[3] == 1.0) {
            let name = found.original.map_or(query.name, |original| original.name);
            match self.changed(name, &rgba)? {
                Some(alphas) => {
                    for (pixel, alpha) in rgba.pixels_mut().zip(alphas) {
                        pixel.0[3] = alpha;
                    }
                }
                None if has_alpha => {}
                None => {
                    return Err(TeacherError::NoTransparency {
                        path: found.path.to_path_buf(),
                    });
                }
            }
        }
        let paint = rgba.pixels().map(|rgba| match rgba.0 {
            // Most of a hint is transparent, and its color means nothing.
            [.., 0.0] => [0.0; 3],
            [r, g, b, alpha] => {
                let [_, a, b] = srgb_to_lab([r, g, b].map(f64::from));
                [alpha * a as f32, alpha * b as f32, alpha]
            }
        });
        let (mut paint, [width, height]) = match found.original {
            Some(original) => (
                original.shown(paint.collect(), size),
                [photo.width, photo.height],
            ),
            None => (paint.collect(), size),
        };
        // Interpolation overshoots beside an edge.
        for paint in &mut paint {
            paint[2] = paint[2].clamp(0.0, 1.0);
        }
        Ok(Some(HintImage {
            width,
            height,
            paint,
        }))
    }
}

impl HintFolder {
    /// Opacity of the paint on each pixel of an opaque image over the photo of this name, 0 to 1;
    /// none if it is not that photo, or the photo is unknown.
    ///
    /// # Errors
    /// [`TeacherError::Io`] or [`TeacherError::BadImage`] of the photo.
    fn changed(
        &self,
        name: &str,
        picture: &Rgba32FImage,
    ) -> Result<Option<Vec<f32>>, TeacherError> {
        let Some((path, from_file)) = self.photos.get(name) else {
            return Ok(None);
        };
        let file = input::read(path).map_err(TeacherError::io(path))?;
        let photo = decode_image(file).map_err(|reason| TeacherError::BadImage {
            path: path.clone(),
            reason,
        })?;
        let [width, height] = [picture.width(), picture.height()];
        let photo = photo.image.into_rgb32f();
        let size = [photo.width(), photo.height()];
        let photo = photo.pixels().map(|pixel| pixel.0).collect();
        let photo = from_file.turned(photo, 1, size);
        let size = from_file.size(size);
        let photo = resample(&photo, size, [width, height], Filter::Average);
        let apart: Vec<f32> = (picture.pixels().zip(&photo))
            .map(|(picture, photo)| {
                let channels = picture.0.iter().zip(photo);
                255.0 * channels.fold(0.0, |most: f32, (a, b)| most.max((a - b).abs()))
            })
            .collect();
        let same = apart.iter().filter(|&&apart| apart <= CHANGED[0]).count();
        if (same as f64) < UNPAINTED * apart.len() as f64 {
            return Ok(None);
        }
        // Specks are what saving has left; strokes are wider.
        let (width, height) = (width as usize, height as usize);
        let changed = |i: usize| apart[i] > CHANGED[0];
        let of_pixel = |i: usize| {
            let (x, y) = (i % width, i / width);
            let rows = y.saturating_sub(1)..(y + 2).min(height);
            let around = rows.flat_map(|y| {
                (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| y * width + x)
            });
            let (all, painted) = around.fold((0, 0), |(all, painted), other| {
                (all + 1, painted + usize::from(changed(other)))
            });
            let strength = (apart[i] - CHANGED[0]) / (CHANGED[1] - CHANGED[0]);
            if 2 * painted > all {
                strength.clamp(0.0, 1.0)
            } else {
                0.0
            }
        };
        Ok(Some((0..apart.len()).map(of_pixel).collect()))
    }
}

impl HintImage {
    /// Returns true if nothing is painted.
    pub fn is_empty(&self) -> bool {
        self.paint.iter().all(|paint| paint[2] == 0.0)
    }

    /// The same paint turned.
    pub(super) fn turned(&self, orientation: Orientation) -> Self {
        let size = [self.width, self.height];
        let [width, height] = orientation.size(size);
        Self {
            width,
            height,
            paint: orientation.turned(self.paint.clone(), 1, size),
        }
    }

    /// The same paint at another size (at least 1 × 1); paint mixes by its α.
    pub fn resized(&self, width: u32, height: u32) -> Self {
        let size = [self.width, self.height];
        Self {
            width: width.max(1),
            height: height.max(1),
            paint: resample(&self.paint, size, [width, height], Filter::Average),
        }
    }

    /// Opaque color `[a, b]` and α of each pixel; a and b are 0 where α is 0.
    pub fn colors(&self) -> impl Iterator<Item = ([f32; 2], f32)> {
        self.paint.iter().map(|&[a, b, alpha]| {
            let opaque = if alpha > 0.0 {
                [a / alpha, b / alpha]
            } else {
                [0.0; 2]
            };
            (opaque, alpha)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, RgbImage, Rgba, RgbaImage};

    const GRAY: GrayImage<'static> = GrayImage {
        width: 4,
        height: 2,
        pixels: &[90; 8],
    };

    #[test]
    fn paint_is_premultiplied_and_mixes_by_alpha() {
        let folder = tempfile::tempdir().unwrap();
        let mut image = RgbaImage::from_pixel(4, 2, Rgba([9, 200, 30, 0]));
        image.put_pixel(0, 0, Rgba([255, 0, 0, 255]));
        image.put_pixel(1, 0, Rgba([255, 0, 0, 51]));
        image.save(folder.path().join("v.png")).unwrap();
        let hints = HintFolder::open(folder.path()).unwrap();
        assert!(hints.load("w.jpg", GRAY).unwrap().is_none());
        let paint = hints.load("v.jpg", GRAY).unwrap().unwrap();
        assert!(!paint.is_empty());
        // CIELAB of pure red under D65: a 80.09, b 67.20.
        for (pixel, expected) in paint
            .paint
            .iter()
            .zip([[80.09, 67.2, 1.0], [16.02, 13.44, 0.2]])
        {
            assert!(
                pixel
                    .iter()
                    .zip(expected)
                    .all(|(p, e)| (p - e).abs() < 0.02),
                "{pixel:?}"
            );
        }
        assert!(paint.paint[2..].iter().all(|pixel| *pixel == [0.0; 3]));
        // The green of the transparent pixels does not mix in.
        let (color, alpha) = paint.resized(1, 1).colors().next().unwrap();
        assert!(
            (color[0] - 80.09).abs() < 0.02 && alpha > 0.1 && alpha < 0.3,
            "{color:?} {alpha}"
        );
    }

    /// A view of a photo in `folder`, which has brightness by column.
    fn capture(folder: &Path) -> Capture {
        let photo = RgbImage::from_fn(20, 10, |x, _| Rgb([60 + 5 * x as u8; 3]));
        let path = folder.join("v.png");
        photo.save(&path).unwrap();
        let camera = crate::capture::Camera {
            width: 20,
            height: 10,
            fx: 20.0,
            fy: 20.0,
            cx: 10.0,
            cy: 5.0,
            rotation: glam::DMat3::IDENTITY,
            translation: glam::DVec3::ZERO,
        };
        Capture {
            root: folder.into(),
            photos: folder.join("images"),
            split: None,
            views: vec![crate::capture::View {
                name: "v.png".into(),
                photo: "v.png".into(),
                image_path: path,
                camera,
                undistortion: None,
                stance: Default::default(),
            }],
            points: Vec::new(),
            offset: glam::DVec3::ZERO,
            rejected: Vec::new(),
            doubts: Vec::new(),
            distortion: 0.0,
        }
    }

    /// Strokes on the photo itself, saved without transparency or with all of it opaque.
    #[test]
    fn strokes_on_the_photo_are_told_from_it() {
        const GRAY: GrayImage<'static> = GrayImage {
            width: 20,
            height: 10,
            pixels: &[90; 200],
        };
        let (photos, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let capture = capture(photos.path());
        let mut painted = image::open(photos.path().join("v.png"))
            .unwrap()
            .into_rgb8();
        for x in 4..10 {
            for y in 2..8 {
                painted.put_pixel(x, y, Rgb([200, 60, 40]));
            }
        }
        // What saving as JPEG does to single pixels.
        painted.put_pixel(15, 5, Rgb([170, 150, 140]));
        let path = folder.path().join("v.png");
        for opaque in [false, true] {
            match opaque {
                false => painted.save(&path).unwrap(),
                true => {
                    let rgba = image::DynamicImage::from(painted.clone()).into_rgba8();
                    rgba.save(&path).unwrap();
                }
            }
            let mut hints = HintFolder::open(folder.path()).unwrap();
            hints.know(&capture);
            let paint = hints.load("v.png", GRAY).unwrap().unwrap();
            let alpha = |x: usize, y: usize| paint.paint[20 * y + x][2];
            assert_eq!((alpha(6, 5), alpha(15, 5), alpha(1, 1)), (1.0, 0.0, 0.0));
        }
        // Another picture is no photo with strokes on it.
        let other = RgbImage::from_pixel(20, 10, Rgb([200, 60, 40]));
        other.save(&path).unwrap();
        let mut hints = HintFolder::open(folder.path()).unwrap();
        hints.know(&capture);
        let message = hints.load("v.png", GRAY).unwrap_err().to_string();
        assert!(message.contains("not its photo"), "{message}");
    }

    #[test]
    fn a_tiff_layer_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let mut pixels = vec![0_u8; 4 * 8];
        pixels[..4].copy_from_slice(&[255, 0, 0, 255]);
        let file = std::fs::File::create(folder.path().join("v.tif")).unwrap();
        tiff::encoder::TiffEncoder::new(file)
            .unwrap()
            .write_image::<tiff::encoder::colortype::RGBA8>(4, 2, &pixels)
            .unwrap();
        let hints = HintFolder::open(folder.path()).unwrap();
        let paint = hints.load("v.jpg", GRAY).unwrap().unwrap();
        assert!(
            (paint.paint[0][0] - 80.09).abs() < 0.02,
            "{:?}",
            paint.paint
        );
        assert!(paint.paint[1..].iter().all(|pixel| *pixel == [0.0; 3]));
    }

    #[test]
    fn nothing_painted() {
        let folder = tempfile::tempdir().unwrap();
        RgbaImage::new(8, 4)
            .save(folder.path().join("v.png"))
            .unwrap();
        let hints = HintFolder::open(folder.path()).unwrap();
        assert!(hints.load("v.png", GRAY).unwrap().unwrap().is_empty());
    }

    #[test]
    fn without_transparency_or_of_another_aspect() {
        let folder = tempfile::tempdir().unwrap();
        RgbImage::from_pixel(4, 2, Rgb([1, 2, 3]))
            .save(folder.path().join("v.png"))
            .unwrap();
        RgbaImage::new(4, 4)
            .save(folder.path().join("w.png"))
            .unwrap();
        let hints = HintFolder::open(folder.path()).unwrap();
        for (name, part) in [("v.png", "transparency"), ("w.png", "aspect")] {
            let message = hints.load(name, GRAY).unwrap_err().to_string();
            assert!(
                message.contains(name) && message.contains(part),
                "{message}"
            );
        }
    }
}
