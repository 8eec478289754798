//! Check that the images of a folder show the photos that they are named after.

use std::path::Path;

use image::DynamicImage;

use super::images::{Filter, resample};
use super::{GrayImage, TeacherError};
use crate::capture::Orientation;
use crate::color::gray_from_rgb;
use crate::effects::{correlation, listed};

/// Sides at which pictures are compared, in pixels: grain, strokes and small shifts are gone.
const SIDE: u32 = 24;

/// An image whose lightness correlates this well with its photo's is of that photo.
const LIKE: f64 = 0.9;

/// One that correlates this well with another photo's, and by [`CLEARLY`] more than with its own,
/// is of that one. Other tones, grain and stains lower both; neighbors in a film correlate with
/// the wrong photo nearly as well as with the right one, and do little harm.
const LIKE_ANOTHER: f64 = 0.8;
const CLEARLY: f64 = 0.15;

/// Below this an image is like no photo. The lowest that a photo with other tones has is above
/// 0.6.
const UNLIKE: f64 = 0.2;

/// Names that are told.
const TOLD: usize = 3;

/// Photos that were asked about, and the images that answered, small.
#[derive(Default)]
pub(super) struct SampleSheet {
    /// Name and gray of each photo.
    photos: Vec<(String, Vec<f32>)>,
    /// Name, index of the photo, and gray of each image.
    images: Vec<(String, usize, Vec<f32>)>,
}

impl SampleSheet {
    /// Takes a photo.
    pub fn look(&mut self, name: &str, photo: GrayImage<'_>) {
        self.photos.push((name.to_owned(), small(photo)));
    }

    /// Takes the image for the photo taken last, turned like it.
    pub fn look_at(&mut self, name: &str, image: &DynamicImage) {
        let photo = self.photos.len().saturating_sub(1);
        self.images.push((name.to_owned(), photo, thumbnail(image)));
    }

    /// Refuses images that show other photos than their own.
    pub fn check(&self, folder: &Path) -> Result<(), TeacherError> {
        let found = self.images.iter().filter_map(|(name, own, image)| {
            let photo = self.stranger(*own, image)?;
            Some(format!("{name} shows {photo}, not {}", self.photos[*own].0))
        });
        let found: Vec<String> = found.collect();
        match found.is_empty() {
            true => Ok(()),
            false => Err(TeacherError::OtherPhotos {
                path: folder.to_owned(),
                count: found.len(),
                images: self.images.len(),
                shown: found[..found.len().min(TOLD)].join("; "),
            }),
        }
    }

    /// Images that are like no photo, in a line.
    pub fn doubt(&self) -> Option<String> {
        let unlike = self.images.iter().filter(|(_, own, image)| {
            let own = likeness(image, &self.photos[*own].1);
            own.is_some_and(|own| own < UNLIKE)
        });
        let names: Vec<&str> = unlike.map(|(name, ..)| name.as_str()).collect();
        (!names.is_empty()).then(|| {
            format!(
                "{} of {} images ({}) do not look like their photos, in lightness: check their names and whether they are turned or cropped",
                names.len(),
                self.images.len(),
                listed(names.iter().copied())
            )
        })
    }

    /// The photo that an image shows, where that is plainly another than its own.
    fn stranger(&self, own: usize, image: &[f32]) -> Option<&str> {
        let with_own = likeness(image, &self.photos[own].1).filter(|&found| found < LIKE)?;
        let others = self.photos.iter().filter_map(|(name, photo)| {
            let found = likeness(image, photo)?;
            (found >= LIKE_ANOTHER.max(with_own + CLEARLY)).then_some((found, name.as_str()))
        });
        others
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, name)| name)
    }
}

/// True if an image matches a photo better in the second orientation than in the first.
pub(super) fn stands(
    image: &DynamicImage,
    photo: GrayImage<'_>,
    [lying, standing]: [Orientation; 2],
) -> bool {
    let (image, photo) = (thumbnail(image), small(photo));
    // Squares keep their sides.
    let turned = |way: Orientation| likeness(&way.turned(image.clone(), 1, [SIDE; 2]), &photo);
    matches!((turned(lying), turned(standing)), (Some(lying), Some(standing)) if standing > lying)
}

fn small(photo: GrayImage<'_>) -> Vec<f32> {
    let gray: Vec<[f32; 1]> = photo
        .pixels
        .iter()
        .map(|&v| [f32::from(v) / 255.0])
        .collect();
    let size = [photo.width, photo.height];
    resample(&gray, size, [SIDE; 2], Filter::Average).into_flattened()
}

fn thumbnail(image: &DynamicImage) -> Vec<f32> {
    let rgb = image.thumbnail_exact(SIDE, SIDE).into_rgb32f();
    let gray = rgb
        .pixels()
        .map(|rgb| gray_from_rgb(rgb.0.map(f64::from)) as f32);
    gray.collect()
}

/// The correlation of two small pictures; none where one is the same everywhere.
fn likeness(image: &[f32], photo: &[f32]) -> Option<f64> {
    let pairs = || image.iter().zip(photo);
    let there: Vec<[f64; 2]> = pairs().map(|(&a, &b)| [a.into(), b.into()]).collect();
    let back: Vec<[f64; 2]> = pairs().map(|(&a, &b)| [b.into(), a.into()]).collect();
    correlation(&back).and_then(|_| correlation(&there))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::GrayImage;

    /// Blobs and a slope, others for each photo.
    fn photo(number: u32) -> GrayImage {
        GrayImage::from_fn(90, 60, |x, y| {
            let hash = (x / 15 + 7 * (y / 15) + 31 * number).wrapping_mul(2_654_435_761);
            image::Luma([40 + (hash >> 25) as u8 + x as u8 / 3])
        })
    }

    fn shown(images: &[GrayImage]) -> SampleSheet {
        let mut shown = SampleSheet::default();
        for (number, image) in (0..).zip(images) {
            let photo = photo(number);
            shown.look(&format!("{number}.jpg"), gray_image(&photo));
            shown.look_at(&format!("{number}.png"), &image.clone().into());
        }
        shown
    }

    fn gray_image(photo: &GrayImage) -> super::super::GrayImage<'_> {
        super::super::GrayImage {
            width: photo.width(),
            height: photo.height(),
            pixels: photo.as_raw(),
        }
    }

    #[test]
    fn images_of_other_photos_are_refused_and_other_tones_are_not() {
        let moved: Vec<_> = (0..6).map(|number| photo((number + 1) % 6)).collect();
        let error = shown(&moved)
            .check(Path::new("colored"))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("6 of 6") && error.contains("0.png shows 1.jpg"),
            "{error}"
        );
        let alike = |tone: &dyn Fn(u32, f64) -> f64| {
            let images = (0..6).map(|number| {
                let mut image = photo(number);
                for (i, pixel) in (0..).zip(image.pixels_mut()) {
                    let value = tone(i, f64::from(pixel.0[0]));
                    pixel.0[0] = value.clamp(0.0, 255.0) as u8;
                }
                image
            });
            let shown = shown(&images.collect::<Vec<_>>());
            shown.check(Path::new("colored")).unwrap();
            shown.doubt()
        };
        assert_eq!(alike(&|_, v| v), None);
        assert_eq!(alike(&|_, v| v * v / 255.0), None);
        assert_eq!(alike(&|_, v| 3.0 * (v - 80.0)), None);
        let grain = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 24) - 128.0;
        assert_eq!(alike(&|i, v| v + grain(i)), None);
        // Without lightness nothing is known of them.
        assert_eq!(alike(&|_, _| 90.0), None);
        let doubt = alike(&|_, v| 255.0 - v).unwrap();
        assert!(doubt.contains("6 of 6 images (0.png, 1.png"), "{doubt}");
    }
}
