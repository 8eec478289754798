//! A photo as the reference that pictures of the scene are compared with.

use std::collections::HashMap;

use crate::{
    capture::{Dataset, Exposure, Photo},
    measure,
    report::{ColorError, LumaQuality, ViewExposure},
};

/// A photo with its exposure and its mask.
///
/// Pictures that are measured are those that the photo would show ([`Reference::luma_shown`],
/// [`Reference::shown`]), for how bright a photo became is no matter of the scene.
#[derive(Clone, Copy)]
pub struct Reference<'a> {
    pub photo: &'a Photo,
    /// Exposure of the photo.
    pub exposure: Exposure,
}

/// Exposures by view of `dataset`, from a report; [`Exposure::NONE`] for views not in it.
pub fn exposures(dataset: &Dataset, told: &[ViewExposure]) -> Vec<Exposure> {
    let by_name: HashMap<&str, Exposure> = (told.iter())
        .map(|view| (view.name.as_str(), view.exposure))
        .collect();
    let of = |name: &str| by_name.get(name).copied().unwrap_or(Exposure::NONE);
    (dataset.capture.views.iter())
        .map(|view| of(&view.name))
        .collect()
}

impl<'a> Reference<'a> {
    /// Returns true if any pixel counts; a photo without one measures nothing.
    pub fn measures(&self) -> bool {
        (0..self.photo.gray.len()).any(|pixel| self.photo.counts(pixel))
    }

    /// Gray in [0, 1], `[height, width]`.
    pub fn gray(&self) -> Vec<f32> {
        self.photo.gray_values()
    }

    /// RGB in [0, 1], `[height, width]`, where the photo has colors.
    pub fn rgb(&self) -> Option<Vec<[f32; 3]>> {
        self.photo.rgb.as_ref().map(|_| self.photo.rgb_values())
    }

    /// The gray picture under the photo's exposure, in [0, 1].
    pub fn luma_shown(&self, luma: &[f32]) -> Vec<f32> {
        luma.iter().map(|&value| self.channel(value)).collect()
    }

    /// The RGB picture under the photo's exposure, in [0, 1]: an exposure treats all channels
    /// alike.
    pub fn shown(&self, rgb: &[[f32; 3]]) -> Vec<[f32; 3]> {
        (rgb.iter())
            .map(|rgb| rgb.map(|value| self.channel(value)))
            .collect()
    }

    /// The picture of which the photo shows `rgb`; it may leave [0, 1].
    pub fn unexposed(&self, rgb: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let Exposure { gain, offset } = self.exposure;
        let of_scene = |value: f32| ((f64::from(value) - offset) / gain) as f32;
        rgb.iter().map(|rgb| rgb.map(of_scene)).collect()
    }

    fn channel(&self, value: f32) -> f32 {
        self.exposure.shown(f64::from(value)) as f32
    }

    /// The values of the pixels that count.
    pub fn counted<T: Copy>(&self, values: &[T]) -> Vec<T> {
        (values.iter().enumerate())
            .filter(|&(pixel, _)| self.photo.counts(pixel))
            .map(|(_, &value)| value)
            .collect()
    }

    /// `picture`, but `truth` where a pixel does not count.
    pub fn patched<T: Copy>(&self, picture: &[T], truth: &[T]) -> Vec<T> {
        (picture.iter().zip(truth).enumerate())
            .map(|(pixel, (&ours, &right))| {
                if self.photo.counts(pixel) {
                    ours
                } else {
                    right
                }
            })
            .collect()
    }

    /// Quality of the scene's gray picture, whatever the photo's exposure.
    pub fn luma_quality(&self, luma: &[f32]) -> LumaQuality {
        let truth = self.gray();
        let shown: Vec<f32> = luma.iter().map(|value| value.clamp(0.0, 1.0)).collect();
        let [ours, right] = [&shown, &truth].map(|values| self.counted(values));
        LumaQuality {
            psnr: measure::reported_psnr(&ours, &right),
            corrected_psnr: Some(measure::corrected_psnr(&ours, &right)),
            plain_psnr: None,
            lost_detail: Some(self.lost_detail(&shown, &truth)),
            ssim: self.ssim(&shown, &truth),
        }
    }

    /// Share of the photo's textured blocks of which a picture shows hardly any detail.
    fn lost_detail(&self, shown: &[f32], truth: &[f32]) -> f64 {
        let (width, height) = (self.photo.width as usize, self.photo.height as usize);
        measure::lost_detail(width, height, &self.patched(shown, truth), truth)
    }

    /// PSNR of a gray picture where it counts, in dB.
    pub fn gray_psnr(&self, gray: &[f32]) -> f64 {
        let shown: Vec<f32> = gray.iter().map(|value| value.clamp(0.0, 1.0)).collect();
        measure::reported_psnr(&self.counted(&shown), &self.counted(&self.gray()))
    }

    /// Variance of the Laplacian of a gray picture where it counts, on the scale of 0 to 255.
    pub fn sharpness(&self, gray: &[f32]) -> f64 {
        let (width, height) = (self.photo.width as usize, self.photo.height as usize);
        measure::variance(&self.counted(&measure::laplacian(width, height, gray)))
    }

    /// Structural similarity. Where a pixel does not count the picture is taken to be
    /// right, and the others answer for all that is wrong.
    pub fn ssim(&self, shown: &[f32], truth: &[f32]) -> f64 {
        let (width, height) = (self.photo.width as usize, self.photo.height as usize);
        let share = self.counted(truth).len() as f64 / truth.len() as f64;
        1.0 - (1.0 - measure::ssim(width, height, &self.patched(shown, truth), truth)) / share
    }

    /// ΔE00 between two pictures.
    pub fn color_error(&self, a: &[[f32; 3]], b: &[[f32; 3]]) -> ColorError {
        measure::mean_delta_e(&self.counted(a), &self.counted(b)).into()
    }

    /// Colorfulness of a picture.
    pub fn colorfulness(&self, rgb: &[[f32; 3]]) -> f64 {
        measure::colorfulness(&self.counted(rgb))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two pixels, of which the second does not count.
    fn photo() -> Photo {
        Photo {
            width: 2,
            height: 1,
            gray: vec![100, 200],
            rgb: Some(vec![[120, 90, 60], [255, 0, 0]]),
            mask: Some(vec![255, 0]),
        }
    }

    #[test]
    fn what_does_not_count_changes_nothing() {
        let photo = photo();
        let reference = Reference {
            photo: &photo,
            exposure: Exposure::NONE,
        };
        let truth = reference.rgb().expect("colors");
        let mut other = truth.clone();
        other[1] = [0.0, 1.0, 0.0];
        assert_eq!(reference.color_error(&other, &truth).mean, 0.0);
        assert_eq!(
            reference.colorfulness(&other),
            reference.colorfulness(&truth)
        );
        let gray = reference.gray();
        let quality = reference.luma_quality(&[gray[0], 0.0]);
        assert_eq!((quality.psnr, quality.ssim), (measure::IDENTICAL_PSNR, 1.0));
        // What counts does.
        other[0][0] += 0.1;
        assert!(reference.color_error(&other, &truth).mean > 1.0);
        assert!(reference.luma_quality(&[gray[0] + 0.1, gray[1]]).psnr < 21.0);
    }

    #[test]
    fn a_photo_shows_the_scene_as_bright_as_it_was_exposed() {
        let photo = photo();
        let reference = Reference {
            photo: &photo,
            exposure: Exposure {
                gain: 1.25,
                offset: -0.05,
            },
        };
        let scene = [[0.4, 0.2, 0.02], [0.9, 0.6, 0.5]];
        let shown = reference.shown(&scene);
        for (shown, want) in (shown.as_flattened().iter()).zip([0.45, 0.2, 0.0, 1.0, 0.7, 0.575]) {
            assert!((shown - want).abs() < 1e-6, "{shown} {want}");
        }
        assert_eq!(
            reference.luma_shown(&[0.4, 0.02]),
            [shown[0][0], shown[0][2]]
        );
        // And back, where black and white did not cut.
        let back = reference.unexposed(&shown);
        for (pixel, channel) in [(0, 0), (0, 1), (1, 1), (1, 2)] {
            let (back, want) = (back[pixel][channel], scene[pixel][channel]);
            assert!((back - want).abs() < 1e-6, "{back} {want}");
        }
    }
}
