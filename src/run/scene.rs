//! What several commands need of a capture: its photos at working size, a
//! renderer for its splats.

use std::{
    collections::BTreeMap,
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
    capture::{Camera, Capture, CaptureError, Photo, Split, View, split},
    effects::{Overrules, Plan},
    gpu::GpuError,
    raster::{Field, Geometry, Raster, RasterOptions, Renderer, constants::NEAR_SHARE},
    splats::{ShField, Splats, ply},
};

/// A capture with its photos decoded.
pub(super) struct Scene {
    pub capture: Capture,
    pub split: Split,
    /// Photo and camera of each view, at working size.
    pub photos: Vec<(Photo, Camera)>,
    pub extent: f64,
}

impl Scene {
    /// Reads a COLMAP folder and decodes its photos.
    pub fn load(
        colmap_dir: &Path,
        max_side: Option<u32>,
        holdout: bool,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        let capture = Capture::load(colmap_dir)?;
        for rejected in &capture.rejected {
            observe(Event::Note(format!(
                "left out {}: {}",
                rejected.name, rejected.reason
            )));
        }
        let total = capture.views.len();
        let photos = decode(&capture.views, max_side, observe)?;
        Ok(Self {
            split: split(total, holdout),
            extent: capture.extent(),
            capture,
            photos,
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

    /// Which effects it calls for; `sh_degree` is the most that the preset has room for.
    pub fn plan(&self, sh_degree: u32, overrules: &Overrules) -> Plan {
        Plan::new(
            &self.capture,
            &self.photos,
            &self.split,
            sh_degree,
            overrules,
        )
    }

    /// Something that each view has, by the views' names.
    pub fn by_name<T: Clone>(&self, values: &[T]) -> BTreeMap<String, T> {
        (self.capture.views.iter().zip(values))
            .map(|(view, value)| (view.name.clone(), value.clone()))
            .collect()
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

/// Decodes the photos of all views, as many at a time as there are processors. Of
/// several that cannot be, the first is named, as if they were read in order.
fn decode(
    views: &[View],
    max_side: Option<u32>,
    observe: &mut Observer<'_>,
) -> Result<Vec<(Photo, Camera)>, CaptureError> {
    let workers = thread::available_parallelism().map_or(1, NonZero::get);
    let next = AtomicUsize::new(0);
    let (sender, decoded) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..workers.min(views.len()) {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(view) = views.get(index) else {
                        break;
                    };
                    // The receiver stays until every sender is gone.
                    let _ = sender.send((index, Photo::load(view, max_side)));
                }
            });
        }
        drop(sender);
        let mut photos: Vec<_> = views.iter().map(|_| None).collect();
        let mut failure: Option<(usize, CaptureError)> = None;
        for (done, (index, result)) in decoded.iter().enumerate() {
            observe(Event::Progress {
                stage: Stage::Photos,
                done,
                total: views.len(),
                message: views[index].name.clone(),
            });
            match result {
                Ok(photo) => photos[index] = Some(photo),
                Err(error) => {
                    // Whatever comes before this one is being decoded already.
                    next.store(views.len(), Ordering::Relaxed);
                    if failure.as_ref().is_none_or(|(first, _)| index < *first) {
                        failure = Some((index, error));
                    }
                }
            }
        }
        match failure {
            Some((_, error)) => Err(error),
            None => Ok(photos.into_iter().flatten().collect()),
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

/// The values of the pixels that count; of all where none does.
pub(super) fn counted<T: Copy>(photo: &Photo, values: &[T]) -> Vec<T> {
    let counted: Vec<T> = (values.iter().enumerate())
        .filter(|&(pixel, _)| counts(photo, pixel))
        .map(|(_, &value)| value)
        .collect();
    if counted.is_empty() {
        values.to_vec()
    } else {
        counted
    }
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
