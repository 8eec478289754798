//! Stage 2 of Gaussians as a whole: a gray scene and someone who colors photos in, a colored scene
//! out.

use std::{sync::Arc, time::Instant};

use super::{
    ChromaCheckpoint, ChromaCheckpointing, ChromaError, ChromaSettings, Colorizer, Degree,
    FrozenViews, NoChromaCheckpoints,
    bake::{BakeStep, bake_telling},
    distill::{ColorizeEvent, ColorizeObserver, Distill, Distilled, go_on},
    field::FrozenField,
    teach,
};
use crate::{
    capture::{Camera, Dataset},
    raster::Raster,
    splats::Splats,
};

/// A colored scene.
#[derive(Clone, Debug)]
pub struct Colored {
    /// The Gaussians with RGB harmonics, as splat files have them.
    pub splats: Splats,
    /// The a/b from which they are made.
    pub distilled: Distilled,
    /// Bytes that it was estimated to take on the device at most.
    pub estimated_device_memory: u64,
    /// Bytes that it took there at most, where the backend tells.
    pub peak_device_memory: Option<u64>,
    /// Views whose lists and targets stayed on the device.
    pub pinned_views: usize,
    /// Gaussians on the device at a time, where they waited on the host.
    pub splats_at_a_time: Option<usize>,
    /// Seconds of solving, the views' lists included, and of the bake.
    pub seconds: [f64; 2],
}

/// Colors the gray scene `luma`, which was trained on `dataset` and is drawn by `raster`.
///
/// # Errors
/// [`ChromaError`] of a photo, of the colorizer or of the device;
/// [`ChromaError::NoViews`] where no training view gets a color.
pub fn colorize(
    raster: &Arc<Raster>,
    dataset: &Dataset,
    luma: &Splats,
    colorizer: &mut dyn Colorizer,
    settings: &ChromaSettings,
    observe: &mut ColorizeObserver<'_>,
) -> Result<Colored, ChromaError> {
    let total = dataset.cameras.len();
    let supervision = teach(dataset, colorizer, settings.target_scales(), &mut |view| {
        observe(ColorizeEvent::Asked { view, total })
    })?;
    Distill {
        dataset,
        supervision: &supervision,
        sh_degree: Degree::Fixed(settings.sh_degree),
        correct_views: None,
    }
    .color_gaussians(
        (raster, luma),
        None,
        &mut NoChromaCheckpoints,
        settings,
        observe,
    )
}

impl Distill<'_> {
    /// Solves for the colors of Gaussians, a scene of one channel, and bakes them; from a
    /// checkpoint on, and with checkpoints for `checkpointing` after rounds.
    ///
    /// # Errors
    /// As [`Distill::run`].
    pub fn color_gaussians(
        &self,
        (raster, luma): (&Arc<Raster>, &Splats),
        checkpoint: Option<&ChromaCheckpoint>,
        checkpointing: &mut dyn ChromaCheckpointing,
        settings: &ChromaSettings,
        observe: &mut ColorizeObserver<'_>,
    ) -> Result<Colored, ChromaError> {
        let begun = Instant::now();
        // No photo is looked at any more.
        self.dataset.release();
        go_on(observe(ColorizeEvent::Listing))?;
        let (cameras, extent) = (self.cameras(), self.dataset.extent);
        let (scales, room) = (settings.target_scales(), self.memory(settings));
        let frozen = FrozenViews::new(raster, luma, extent, &cameras, scales, room)?;
        if let Some(at_a_time) = frozen.streamed() {
            go_on(observe(ColorizeEvent::Streaming { at_a_time }))?;
        }
        let listing = begun.elapsed().as_secs_f64();
        let distilled = self.run(&frozen, checkpoint, checkpointing, settings, observe)?;
        let begun = Instant::now();
        let mut peak = distilled.peak_device_memory;
        let splats = bake_telling(&frozen, luma, &distilled.chroma, &mut |step| {
            peak = peak.max(raster.gpu.allocated_bytes());
            observe(match step {
                BakeStep::Drawing { view, total } => ColorizeEvent::Drawing { view, total },
                BakeStep::Solving(progress) => ColorizeEvent::Baking(progress),
            })
        })?;
        Ok(Colored {
            splats,
            estimated_device_memory: frozen.demand(),
            peak_device_memory: peak,
            pinned_views: frozen.pinned(),
            splats_at_a_time: frozen.streamed(),
            seconds: [listing + distilled.seconds, begun.elapsed().as_secs_f64()],
            distilled,
        })
    }

    /// Cameras of the views that colors are learned from.
    fn cameras(&self) -> Vec<Camera> {
        let learned = self.supervision.views.iter();
        learned.map(|&i| self.dataset.cameras[i].clone()).collect()
    }
}
