//! What the colors of a dataset's views are to be, asked for view by view.

use std::ops::ControlFlow;

use super::{
    ChromaError, ColorizerError, Targets,
    teacher::{AbImage, GrayImage, Query, Teacher},
};
use crate::{
    capture::{Dataset, Photo},
    effects::{TeacherSamples, TeacherSpread},
};

/// What a photo's colors are to be.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// CIELAB a, b at the photo's size.
    pub ab: AbImage,
    /// How much each pixel counts, `[height, width]`; `None` stands for 1 everywhere.
    pub weights: Option<Vec<f32>>,
}

/// Someone who colors photos.
pub trait Colorizer {
    /// The colors of a photo; `None` where there is nothing to say of it. Photos are asked for
    /// once each, in the order of the dataset's views.
    ///
    /// # Errors
    /// Whatever ends the whole.
    fn colorize(
        &mut self,
        query: Query<'_>,
        photo: GrayImage<'_>,
    ) -> Result<Option<Wanted>, ColorizerError>;
}

impl Colorizer for Teacher {
    fn colorize(
        &mut self,
        query: Query<'_>,
        photo: GrayImage<'_>,
    ) -> Result<Option<Wanted>, ColorizerError> {
        let answer = Self::colorize(self, query, photo, None)?;
        Ok(answer.map(|ab| Wanted { ab, weights: None }))
    }
}

/// What all views were taught.
pub struct Lesson {
    /// What is known of the views, and how much of it counts.
    pub targets: Targets,
    /// Each view's place among these; `None` where nothing is known.
    pub of_view: Vec<Option<usize>>,
    /// How far the training views disagree about COLMAP's points.
    pub spread: Option<TeacherSpread>,
    /// What they say there.
    pub samples: TeacherSamples,
}

/// Asks about every view, and keeps what is wanted at so many scales. Held-out views are
/// asked about too: for pictures to compare with, never for training. `observe` is told of
/// each view before.
///
/// # Errors
/// [`ChromaError`] of a photo, of the colorizer or of the file that answers wait in, or
/// [`ChromaError::Cancelled`].
pub fn teach(
    dataset: &Dataset,
    colorizer: &mut dyn Colorizer,
    scales: usize,
    observe: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<Lesson, ChromaError> {
    let capture = &dataset.capture;
    let mut samples = TeacherSamples::new(capture);
    let (mut targets, mut of_view) = (Targets::new(scales), Vec::new());
    let views: Vec<usize> = (0..dataset.cameras.len()).collect();
    dataset.visit(&views, |view, photo| {
        if observe(view).is_break() {
            return Err(ChromaError::Cancelled);
        }
        let camera = &dataset.cameras[view];
        let gray = GrayImage {
            width: photo.width,
            height: photo.height,
            pixels: &photo.gray,
        };
        let query = Query::view(&capture.views[view], camera);
        let wanted = colorizer.colorize(query, gray);
        let Some(Wanted { ab, weights }) = wanted.map_err(ChromaError::Colorizer)? else {
            of_view.push(None);
            return Ok(());
        };
        let (found, expected) = ([ab.width, ab.height], [photo.width, photo.height]);
        if found != expected {
            return Err(ChromaError::WrongSize { found, expected });
        }
        if dataset.split.train.contains(&view) {
            samples.take(capture, view, camera, &ab.ab);
        }
        let weights = masked_weights(weights, photo);
        of_view.push(Some(targets.push_ab(&ab, weights.as_deref())?));
        Ok(())
    })?;
    Ok(Lesson {
        targets,
        of_view,
        spread: samples.spread(capture),
        samples,
    })
}

/// Weights of the pixels that the photo's mask lets count.
pub fn masked_weights(weights: Option<Vec<f32>>, photo: &Photo) -> Option<Vec<f32>> {
    let Some(mask) = &photo.mask else {
        return weights;
    };
    let weights = weights.unwrap_or_else(|| vec![1.0; mask.len()]);
    let counted =
        (weights.iter().zip(mask)).map(|(weight, &count)| weight * f32::from(count) / 255.0);
    Some(counted.collect())
}
