//! Colors painted on a few places of a photo.

use super::images::{Filter, resample};
use super::named_images::NamedImages;
use super::{GrayImage, Query, TeacherError};
use crate::capture::Capture;
use crate::color::srgb_to_lab;
use std::path::Path;

/// A folder of painted hints: PNG images with transparency, named like the
/// photos, for any subset of them. What is transparent says nothing.
pub struct HintFolder {
    images: NamedImages,
}

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
        Ok(Self { images })
    }

    /// Says which photos there are, so that paint on one is not taken for another's.
    pub fn know(&mut self, capture: &Capture) {
        self.images.know(capture);
    }

    /// The paint on a photo, at the paint's own size or, where it is painted on the
    /// photo before its lens was taken out, at the photo's; none where there is no
    /// image. A photo may be given by its path relative to the photo folder.
    ///
    /// # Errors
    /// [`TeacherError::NoTransparency`] where the image has no alpha channel;
    /// otherwise as for a folder teacher's image.
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
        if !found.image.color().has_alpha() {
            return Err(TeacherError::NoTransparency {
                path: found.path.to_path_buf(),
            });
        }
        let size = [found.image.width(), found.image.height()];
        let rgba = found.image.into_rgba32f();
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

impl HintImage {
    /// Whether nothing is painted.
    pub fn is_empty(&self) -> bool {
        self.paint.iter().all(|paint| paint[2] == 0.0)
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
