//! What several commands need of a capture: its photos at working size, a
//! renderer for its splats.

use std::{
    num::NonZero,
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
        mpsc,
    },
    thread,
};

use glam::DVec3;

use super::{Event, Observer, RunError, Stage};
use crate::{
    capture::{
        Camera, Capture, CaptureError, LoadOptions, Loader, MaskUse, Normalize, Photo, Split, View,
        first_views, split,
    },
    effects::{Overrules, Plan, Room},
    gpu::GpuError,
    raster::{Field, Geometry, Raster, RasterOptions, Renderer, constants::NEAR_SHARE},
    splats::{ShField, Splats, ply},
};

/// A capture with its photos decoded.
pub(super) struct Scene {
    pub capture: Capture,
    pub split: Split,
    /// How the photos were loaded; nothing in it is left open.
    pub options: LoadOptions,
    /// Photo and camera of each view, at working size.
    pub photos: Vec<(Photo, Camera)>,
    /// Views whose photo has a mask file.
    pub masked_views: usize,
    /// Pixels of all photos whose values are not finite.
    pub not_finite: usize,
    pub extent: f64,
}

impl Scene {
    /// Reads a COLMAP folder and decodes its photos.
    pub fn load(
        colmap_dir: &Path,
        options: &LoadOptions,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        let capture = Capture::load_with(colmap_dir, &options.capture())?;
        for rejected in &capture.rejected {
            observe(Event::Note(format!(
                "left out {}: {}",
                rejected.name, rejected.reason
            )));
        }
        let mut loader = Loader::open(&capture, options)?;
        if loader.undecided() {
            let photos: Vec<&View> = first_views(&capture.views).collect();
            let samples = of_each(&photos, Stage::Survey, |view| loader.sample(view), observe)?;
            loader.decide(samples.concat());
            if let Normalize::Range([low, high]) = loader.options().normalize {
                observe(Event::Note(format!(
                    "photos are normalised: {low:.6} becomes black and {high:.6} white (--normalize off leaves them)"
                )));
            }
        }
        let views: Vec<&View> = capture.views.iter().collect();
        let photos = of_each(&views, Stage::Photos, |view| loader.load(view), observe)?;
        if loader.not_finite() > 0 {
            observe(Event::Note(format!(
                "{} pixels of the photos are not finite and do not count",
                loader.not_finite()
            )));
        }
        Ok(Self {
            split: split(&capture.views, options.holdout),
            options: loader.options().clone(),
            photos,
            masked_views: loader.masked_views(&capture.views),
            not_finite: loader.not_finite(),
            extent: capture.extent(),
            capture,
        })
    }

    /// The views to measure on: the held-out ones, or all where none is.
    pub fn measured(&self) -> (&'static str, &[usize]) {
        if self.split.test.is_empty() {
            ("train", &self.split.train)
        } else {
            ("test", &self.split.test)
        }
    }

    /// Whether nothing is where masks are black; photos are black there, and that counts.
    pub fn removes_masked(&self) -> bool {
        self.masked_views > 0 && self.options.masked == MaskUse::Remove
    }

    /// Which effects it calls for, as far as the photos tell, and the `trial` if there was one.
    pub fn plan(&self, room: Room, overrules: &Overrules, trial: Option<f64>) -> Plan {
        let (capture, photos, split) = (&self.capture, &self.photos, &self.split);
        Plan::new(capture, photos, split, room, overrules, trial)
    }

    /// A renderer of several fields over the geometry of `splats`.
    pub fn renderer(
        &self,
        raster: &Arc<Raster>,
        splats: &Splats,
        fields: &[&ShField],
    ) -> Result<Renderer, GpuError> {
        let gpu = &raster.gpu;
        let fields = fields
            .iter()
            .map(|field| Field::upload(gpu, field))
            .collect::<Result<_, _>>()?;
        let geometry = Geometry::upload(gpu, splats)?;
        Renderer::new(raster.clone(), geometry, fields, NEAR_SHARE * self.extent)
    }
}

/// Does `work` on all views, on as many at a time as there are processors. Of
/// several that fail, the first is named, as if they were taken in order.
fn of_each<T: Send>(
    views: &[&View],
    stage: Stage,
    work: impl Fn(&View) -> Result<T, CaptureError> + Sync,
    observe: &mut Observer<'_>,
) -> Result<Vec<T>, CaptureError> {
    let workers = thread::available_parallelism().map_or(1, NonZero::get);
    let next = AtomicUsize::new(0);
    let (sender, finished) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..workers.min(views.len()) {
            let (sender, next, work) = (sender.clone(), &next, &work);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(view) = views.get(index) else {
                        break;
                    };
                    // The receiver stays until every sender is gone.
                    let _ = sender.send((index, work(view)));
                }
            });
        }
        drop(sender);
        let mut results: Vec<_> = views.iter().map(|_| None).collect();
        let mut failure: Option<(usize, CaptureError)> = None;
        for (done, (index, result)) in finished.iter().enumerate() {
            observe(Event::Progress {
                stage,
                done,
                total: views.len(),
                message: views[index].name.clone(),
            });
            match result {
                Ok(result) => results[index] = Some(result),
                Err(error) => {
                    // Whatever comes before this one is in work already.
                    next.store(views.len(), Ordering::Relaxed);
                    if failure.as_ref().is_none_or(|(first, _)| index < *first) {
                        failure = Some((index, error));
                    }
                }
            }
        }
        match failure {
            Some((_, error)) => Err(error),
            None => Ok(results.into_iter().flatten().collect()),
        }
    })
}

/// Reads a splat file that has at least one Gaussian and subtracts `offset`, in
/// world units, from its centres; also gives how the file wants to be drawn.
pub(super) fn read_splats(
    path: &Path,
    offset: DVec3,
    observe: &mut Observer<'_>,
) -> Result<(Splats, RasterOptions), RunError> {
    let read = ply::read_ply(path)?;
    if read.skipped > 0 {
        observe(Event::Note(format!(
            "{}: skipped {} Gaussians with values that are not finite or no rotation",
            path.display(),
            read.skipped
        )));
    }
    let mut splats = read.splats;
    if splats.is_empty() {
        return Err(RunError::NoSplats(path.to_owned()));
    }
    for mean in &mut splats.means {
        *mean = (DVec3::from(mean.map(f64::from)) - offset)
            .as_vec3()
            .to_array();
    }
    let options = RasterOptions {
        antialiased: read.antialiased,
    };
    Ok((splats, options))
}

/// Whether a pixel counts at least half.
pub(super) fn counts(photo: &Photo, pixel: usize) -> bool {
    photo.mask.as_ref().is_none_or(|mask| mask[pixel] >= 128)
}

/// Weights of the pixels that the photo's mask lets count.
pub(super) fn masked_weights(weights: Option<Vec<f32>>, photo: &Photo) -> Option<Vec<f32>> {
    let Some(mask) = &photo.mask else {
        return weights;
    };
    let weights = weights.unwrap_or_else(|| vec![1.0; mask.len()]);
    let counted =
        (weights.iter().zip(mask)).map(|(weight, &count)| weight * f32::from(count) / 255.0);
    Some(counted.collect())
}

/// Gray pixels as floats in [0, 1].
pub(super) fn gray_pixels(photo: &Photo) -> Vec<f32> {
    photo.gray.iter().map(|&v| f32::from(v) / 255.0).collect()
}

/// The photo as RGB in [0, 1], gray where it has no colours.
pub(super) fn rgb_pixels(photo: &Photo) -> Vec<[f32; 3]> {
    match &photo.rgb {
        Some(rgb) => rgb
            .iter()
            .map(|c| c.map(|v| f32::from(v) / 255.0))
            .collect(),
        None => gray_pixels(photo).into_iter().map(|v| [v; 3]).collect(),
    }
}

/// A one-channel picture as RGB.
pub(super) fn gray_to_rgb(pixels: &[f32]) -> Vec<[f32; 3]> {
    pixels.iter().map(|&v| [v.clamp(0.0, 1.0); 3]).collect()
}

/// A three-channel picture as RGB in [0, 1].
pub(super) fn shown_rgb(pixels: &[f32]) -> Vec<[f32; 3]> {
    pixels
        .chunks_exact(3)
        .map(|c| [c[0], c[1], c[2]].map(|v| v.clamp(0.0, 1.0)))
        .collect()
}
