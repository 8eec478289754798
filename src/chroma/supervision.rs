//! Colors that a dataset's views are to have, asked for view by view.

use std::ops::ControlFlow;

use super::{
    ChromaError, ColorizerError, Target, Targets, Task,
    teacher::{AbImage, GrayImage, HintImage, Query, Teacher},
};
use crate::{
    capture::{Dataset, Photo, Split},
    effects::{TeacherSamples, TeacherSpread},
};

/// Colors that a photo is to have.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewTarget {
    /// CIELAB a, b at the photo's size.
    pub ab: AbImage,
    /// Weight of each pixel, `[height, width]`; `None` stands for 1 everywhere.
    pub weights: Option<Vec<f32>>,
    /// Strokes painted on the photo, at its size, which color what they lie on in all views.
    pub strokes: Option<HintImage>,
    /// True if painted by hand: colors are learned from it even if the view is held out, and it is
    /// not measured then.
    pub by_hand: bool,
}

impl From<AbImage> for ViewTarget {
    /// Answer of a machine: all of it counts alike, in views that are trained on.
    fn from(ab: AbImage) -> Self {
        Self {
            ab,
            weights: None,
            strokes: None,
            by_hand: false,
        }
    }
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
    ) -> Result<Option<ViewTarget>, ColorizerError>;
}

impl Colorizer for Teacher {
    fn colorize(
        &mut self,
        query: Query<'_>,
        photo: GrayImage<'_>,
    ) -> Result<Option<ViewTarget>, ColorizerError> {
        let answer = Self::colorize(self, query, photo, None)?;
        Ok(answer.map(ViewTarget::from))
    }
}

/// Colors that all views are to have.
pub struct Supervision {
    /// Wanted colors and weights of the views.
    pub targets: Targets,
    /// Each view's place among these; `None` where nothing is known.
    pub of_view: Vec<Option<usize>>,
    /// Views that colors are learned from, ascending: those that are trained on, and held-out
    /// ones that were painted by hand.
    pub views: Vec<usize>,
    /// Strokes, as a/b and α, and each view's place among them.
    strokes: Targets,
    strokes_of: Vec<Option<usize>>,
    /// True for each view that was painted by hand.
    by_hand: Vec<bool>,
    /// Disagreement of the training views about COLMAP's points.
    pub spread: Option<TeacherSpread>,
    /// Their colors there.
    pub samples: TeacherSamples,
}

impl Supervision {
    /// Returns true if any view that colors are learned from has strokes.
    pub fn has_strokes(&self) -> bool {
        !self.strokes.is_empty()
    }

    /// The strokes on a view, at its size.
    ///
    /// # Errors
    /// When the temporary file cannot be read.
    pub fn paint(&self, view: usize) -> Result<Option<HintImage>, ChromaError> {
        let Some(strokes) = self.strokes_of[view] else {
            return Ok(None);
        };
        let strokes = self.strokes.read(strokes, 0)?;
        let alphas = strokes.weights.as_deref().unwrap_or_default();
        let colors = strokes.ab();
        Ok(Some(HintImage {
            width: colors.width,
            height: colors.height,
            paint: (colors.ab.iter().zip(alphas))
                .map(|(&[a, b], &alpha)| [alpha * a, alpha * b, alpha])
                .collect(),
        }))
    }

    /// Colors that a view's teachers want; `None` where nothing is known.
    ///
    /// # Errors
    /// When the temporary file cannot be read.
    pub(super) fn taught(&self, view: usize) -> Result<Option<Target>, ChromaError> {
        let target = self.of_view[view].map(|target| self.targets.read(target, 0));
        target.transpose()
    }

    /// Wanted picture of a view, with the strokes on it as they were painted; `None`
    /// where neither is known.
    ///
    /// # Errors
    /// When the temporary file cannot be read.
    pub fn shown(&self, view: usize) -> Result<Option<AbImage>, ChromaError> {
        let taught = self.taught(view)?.map(|target| target.ab());
        let Some(paint) = self.paint(view)? else {
            return Ok(taught);
        };
        let mut shown = taught.unwrap_or_else(|| AbImage {
            width: paint.width,
            height: paint.height,
            ab: vec![[0.0; 2]; paint.paint.len()],
        });
        for (ab, &[a, b, alpha]) in shown.ab.iter_mut().zip(&paint.paint) {
            *ab = [(1.0 - alpha) * ab[0] + a, (1.0 - alpha) * ab[1] + b];
        }
        Ok(Some(shown))
    }

    /// Tasks of the views that colors are learned from, by place among them.
    pub fn tasks(&self) -> Vec<Task> {
        (self.views.iter().enumerate())
            .filter_map(|(view, &i)| {
                let target = self.of_view[i]?;
                Some(Task { view, target })
            })
            .collect()
    }

    /// Views that colors are learned from and that are taught or have strokes.
    pub fn colored_views(&self) -> usize {
        let colored = |&&i: &&usize| self.of_view[i].is_some() || self.strokes_of[i].is_some();
        self.views.iter().filter(colored).count()
    }

    /// Returns true if a view was painted by hand.
    pub fn is_painted(&self, view: usize) -> bool {
        self.by_hand[view]
    }

    /// Held-out views that were painted by hand, ascending.
    pub fn painted_held_out(&self, split: &Split) -> Vec<usize> {
        let held_out = |view: &&usize| !split.train.contains(view);
        self.views.iter().filter(held_out).copied().collect()
    }

    /// The views to measure on, and what these are called: held-out ones that no color was
    /// learned from, or those that it was learned from where there is none.
    pub fn measured(&self, split: &Split) -> (&'static str, Vec<usize>) {
        let unseen = |view: &&usize| !self.views.contains(view);
        let test: Vec<usize> = split.test.iter().filter(unseen).copied().collect();
        match test.is_empty() {
            true => ("train", self.views.clone()),
            false => ("test", test),
        }
    }
}

/// Asks about every view, and keeps what is wanted at so many scales. Held-out views are
/// asked about too: for pictures to compare with, and for training only where they were painted
/// by hand. `observe` is told of each view before.
///
/// # Errors
/// [`ChromaError`] of a photo, of the colorizer or of the file that answers wait in, or
/// [`ChromaError::Cancelled`].
pub fn teach(
    dataset: &Dataset,
    colorizer: &mut dyn Colorizer,
    scales: usize,
    observe: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<Supervision, ChromaError> {
    let capture = &dataset.capture;
    let mut samples = TeacherSamples::new(capture);
    let (mut targets, mut of_view) = (Targets::new(scales), Vec::new());
    let (mut strokes, mut strokes_of) = (Targets::new(1), vec![None; dataset.cameras.len()]);
    let (mut learned, mut painted) = (Vec::new(), vec![false; dataset.cameras.len()]);
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
        let wanted = wanted.map_err(ChromaError::Colorizer)?;
        let by_hand = wanted.as_ref().is_some_and(|wanted| wanted.by_hand);
        painted[view] = by_hand;
        let learns = by_hand || dataset.split.train.contains(&view);
        if learns {
            learned.push(view);
        }
        let Some(wanted) = wanted else {
            of_view.push(None);
            return Ok(());
        };
        let ViewTarget { ab, weights, .. } = wanted;
        let (found, expected) = ([ab.width, ab.height], [photo.width, photo.height]);
        if found != expected {
            return Err(ChromaError::WrongSize { found, expected });
        }
        if let Some(paint) = wanted.strokes.filter(|_| learns) {
            let (colors, alphas): (Vec<[f32; 2]>, Vec<f32>) = paint.colors().unzip();
            let (width, height) = (paint.width, paint.height);
            if [width, height] != expected {
                let found = [width, height];
                return Err(ChromaError::WrongSize { found, expected });
            }
            let colors = AbImage {
                width,
                height,
                ab: colors,
            };
            strokes_of[view] = Some(strokes.push_ab(&colors, Some(&alphas))?);
        }
        let known = |weights: &Vec<f32>| weights.iter().any(|&weight| weight > 0.0);
        if !weights.as_ref().is_none_or(known) {
            of_view.push(None);
            return Ok(());
        }
        if learns {
            samples.take(capture, view, camera, &ab.ab);
        }
        let weights = masked_weights(weights, photo);
        of_view.push(Some(targets.push_ab(&ab, weights.as_deref())?));
        Ok(())
    })?;
    Ok(Supervision {
        targets,
        of_view,
        views: learned,
        strokes,
        strokes_of,
        by_hand: painted,
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
