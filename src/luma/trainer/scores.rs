//! Scores of a training on views that it does not train on.

use std::sync::Arc;

use image::GrayImage;

use crate::{
    luma::{TrainingViews, curve::CurvePoint},
    raster::Snapshot,
};

/// Held-out score at one validation of the training.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOutScore {
    /// Mean PSNR of the views, in dB.
    pub psnr: f64,
    /// Rise since the previous validation, in dB per minute of training.
    pub per_minute: Option<f64>,
}

/// From picture to picture of an album iterations grow by this factor.
const ALBUM_STEP: f64 = 1.4;

/// A picture of the first watched view at a validation.
#[derive(Clone, Debug)]
pub struct AlbumPicture {
    /// Iterations done.
    pub iteration: usize,
    /// Index of the view.
    pub view: usize,
    /// The view as it is shown.
    pub image: GrayImage,
}

/// State of validation during a training.
#[derive(Default)]
pub(super) struct Watch {
    pub views: Option<Arc<dyn TrainingViews>>,
    /// Those of which something counts.
    pub counting: Vec<usize>,
    /// The next look is after this iteration.
    pub next: usize,
    pub curve: Vec<CurvePoint>,
    /// Pictures of some validations, where they are asked for.
    pub album: Option<Vec<AlbumPicture>>,
    /// Seconds spent on it.
    pub seconds: f64,
    /// The best set that was looked at, while the training may go back to it.
    pub best: Option<Best>,
    /// The iteration that it went back from.
    pub given_up: Option<usize>,
}

impl Watch {
    /// Returns true if a validation follows `iteration` (counted from 1) of `end`.
    pub fn is_due(&self, iteration: usize, end: usize) -> bool {
        !self.counting.is_empty() && (iteration == end || iteration == self.next)
    }

    /// Keeps a picture, values from 0 to 1, if the one before is of much fewer iterations.
    pub fn keep(&mut self, iteration: usize, [width, height]: [u32; 2], shown: &[f32]) {
        let (view, Some(album)) = (self.counting[0], &mut self.album) else {
            return;
        };
        let last = album.last().map_or(0, |last| last.iteration);
        if iteration as f64 >= ALBUM_STEP * last as f64 {
            let gray = |value: &f32| (value.clamp(0.0, 1.0) * 255.0).round() as u8;
            let image = GrayImage::from_raw(width, height, shown.iter().map(gray).collect());
            album.extend(image.map(|image| AlbumPicture {
                iteration,
                view,
                image,
            }));
        }
    }

    /// Score of the last validation.
    pub fn last(&self) -> Option<HeldOutScore> {
        let last = self.curve.last()?;
        let rise = |before: &CurvePoint| {
            let minutes = (last.seconds - before.seconds) / 60.0;
            (minutes > 0.0).then(|| (last.psnr - before.psnr) / minutes)
        };
        let before = self.curve.iter().nth_back(1);
        Some(HeldOutScore {
            psnr: last.psnr,
            per_minute: before.and_then(rise),
        })
    }
}

/// All that a training changes but what it leaves out as outliers, in host memory: the
/// device may have no room for a second set.
pub(super) struct Best {
    pub iteration: usize,
    pub psnr: f64,
    pub model: Snapshot,
}
