//! Evidence from a capture and its photos, measured once.

use super::{
    background::{Backdrop, FarPlaces},
    exposure::{Exposures, find_photo_exposures},
    outliers::Midpoints,
    patch_means::PatchMeans,
    sampling::sampling_spread,
    tracks::{Sample, look_up_tracks, sample_tracks},
};
use crate::capture::{Camera, Capture, Photo, Split};

/// Photos are shown to it one after the other, each once and in the order of the views; none
/// is kept.
#[derive(Debug)]
pub struct Survey<'a> {
    capture: &'a Capture,
    cameras: &'a [Camera],
    split: &'a Split,
    tracks: PatchMeans,
    midpoints: Midpoints,
    backdrop: Backdrop,
    cells: FarPlaces,
    masked: f64,
    pixels: f64,
    /// True for each view whose photo has a mask.
    with_mask: Vec<bool>,
}

/// The numbers from which follows which effects are simulated.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// Samples of each point in the views.
    pub(super) samples: Vec<Vec<Sample>>,
    /// By view, as the samples have it.
    pub(super) exposures: Exposures,
    /// Samples between the points.
    pub(super) midpoints: Midpoints,
    /// See [`sampling_spread`].
    pub(super) sampling_spread: Option<f64>,
    /// Per cent of the pixels that do not count; `None` where no photo has a mask.
    pub(super) masked: Option<f64>,
    /// True for each view whose photo has a mask.
    with_mask: Vec<bool>,
    /// Share of the photos' area far behind all points.
    pub(super) behind: f64,
    /// See [`Capture::distortion`].
    pub(super) distortion: f64,
    backdrop: Backdrop,
}

impl<'a> Survey<'a> {
    /// Decides where photos will be looked at. `cameras` are those of the capture's views at
    /// working size.
    pub fn new(capture: &'a Capture, cameras: &'a [Camera], split: &'a Split) -> Self {
        let backdrop = Backdrop::of(capture, cameras, &split.train);
        Self {
            tracks: look_up_tracks(capture, cameras),
            midpoints: Midpoints::of(capture, cameras),
            cells: backdrop.behind_cells(),
            backdrop,
            capture,
            cameras,
            split,
            masked: 0.0,
            pixels: 0.0,
            with_mask: vec![false; cameras.len()],
        }
    }

    /// Takes what is wanted of the photo of a view.
    pub fn look(&mut self, view: usize, photo: &Photo) {
        self.tracks.look(view, photo);
        self.midpoints.look(view, photo);
        self.backdrop.look(view, photo, &mut self.cells);
        self.pixels += photo.gray.len() as f64;
        if let Some(mask) = &photo.mask {
            self.with_mask[view] = true;
            self.masked += mask
                .iter()
                .map(|&count| 1.0 - f64::from(count) / 255.0)
                .sum::<f64>();
        }
    }

    /// Evidence of all photos together.
    pub fn finish(self) -> Evidence {
        let samples = sample_tracks(self.capture, self.cameras, &self.tracks);
        let views = &self.capture.views;
        Evidence {
            exposures: find_photo_exposures(&samples, views, &self.split.train),
            samples,
            midpoints: self.midpoints,
            sampling_spread: sampling_spread(self.capture, self.cameras),
            masked: (self.with_mask.contains(&true)).then_some(100.0 * self.masked / self.pixels),
            with_mask: self.with_mask,
            behind: self.backdrop.share(&self.cells),
            distortion: self.capture.distortion,
            backdrop: self.backdrop,
        }
    }
}

impl Evidence {
    /// Returns true if the photo of any of these views has a mask.
    pub fn masks_any(&self, views: &[usize]) -> bool {
        views.iter().any(|&view| self.with_mask[view])
    }

    /// Background of the scene.
    pub fn backdrop(&self) -> &Backdrop {
        &self.backdrop
    }
}
