//! A dataset's views as its plan has them.

use std::sync::Arc;

use super::{TrainingView, TrainingViews, carve};
use crate::{
    capture::{Camera, CaptureError, Dataset, Exposure},
    effects::{Effect, Evidence, Plan},
};

/// Views whose photos come from a [`Dataset`].
#[derive(Clone, Debug)]
pub struct PlannedViews {
    dataset: Arc<Dataset>,
    /// Views of the dataset in use.
    views: Vec<usize>,
    /// Exposure of each view of the dataset.
    exposures: Vec<Exposure>,
    masks: Masks,
    masked: bool,
}

/// Use of masks.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Masks {
    /// All pixels count.
    Off,
    /// Masked pixels do not count.
    Count,
    /// Masked pixels are empty space.
    Remove,
}

impl PlannedViews {
    /// The dataset's training views.
    pub fn new(dataset: Arc<Dataset>, evidence: &Evidence, plan: &Plan) -> Self {
        let masks = match (dataset.removes_masked(), plan.has(Effect::Masks)) {
            (true, _) => Masks::Remove,
            (false, true) => Masks::Count,
            (false, false) => Masks::Off,
        };
        Self {
            exposures: plan.exposures.clone(),
            masked: masks != Masks::Off && evidence.masks_any(&dataset.split.train),
            masks,
            views: dataset.split.train.clone(),
            dataset,
        }
    }

    /// Views to look at while others are trained on; `exposures` are those of all views.
    pub(super) fn watched(
        dataset: Arc<Dataset>,
        views: Vec<usize>,
        exposures: Vec<Exposure>,
    ) -> Self {
        Self {
            exposures,
            masked: dataset.masked_views > 0,
            masks: Masks::Count,
            views,
            dataset,
        }
    }

    /// Any view of the dataset, as training sees its own.
    ///
    /// # Errors
    /// [`CaptureError`] of its photo.
    pub fn of(&self, view: usize) -> Result<TrainingView, CaptureError> {
        let photo = self.dataset.photo(view)?;
        Ok(TrainingView {
            camera: self.dataset.cameras[view].clone(),
            mask: match self.masks {
                Masks::Off => None,
                Masks::Count => photo.mask.clone(),
                Masks::Remove => carve::unknown(&photo),
            },
            gray: photo.gray.clone(),
            exposure: self.exposures[view],
        })
    }
}

impl TrainingViews for PlannedViews {
    fn count(&self) -> usize {
        self.views.len()
    }

    fn camera(&self, view: usize) -> &Camera {
        &self.dataset.cameras[self.views[view]]
    }

    fn exposure(&self, view: usize) -> Exposure {
        self.exposures[self.views[view]]
    }

    fn masked(&self) -> bool {
        self.masked
    }

    fn load(&self, view: usize) -> Result<TrainingView, CaptureError> {
        self.of(self.views[view])
    }
}
