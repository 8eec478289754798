//! `fit JOB/block-3 --around RUN`: a trained block among its neighbors.

use std::{path::Path, sync::Arc};

use super::{
    checkpoint::sha256_of,
    request::{FitRequest, Init, Neighbors},
};
use crate::{
    capture::{Dataset, Exposure, Layers},
    eval::exposures,
    luma::LumaOverlay,
    raster::{Raster, SceneRenderer},
    run::RunError,
    splats::Splats,
    store::{RunFolder, StoreError},
    subject::scene::{Frame, read_splats},
    tell::{Event, Observer, Stage},
};

/// A block that goes on takes so small a part of its iterations so far: it only has to agree
/// with its neighbors.
const AGREEING_PART: usize = 6;

impl FitRequest {
    /// Goes on with a trained block among what its neighbors have in a run of `merge`, for a
    /// sixth of its iterations so far.
    ///
    /// # Errors
    /// [`StoreError::File`] where the run is none of the same photos, or this is no trained block.
    pub fn among(self, merged: &Path) -> Result<Self, RunError> {
        let folder = RunFolder::at(merged);
        let report = folder.read_report()?;
        let (Some(block), Some(Init::Run { iterations, .. })) = (&self.block, &self.init) else {
            let path = self.output.unwrap_or(self.colmap_dir);
            return Err(RunError::NoTrainedBlock(path));
        };
        if Path::new(&report.capture.path) != block.job.capture {
            let reason = "is no scene of the block's photos: give the run of `gs-chroma merge`";
            return Err(StoreError::file(merged, reason).into());
        }
        let luma = folder.luma();
        let iterations = Some(iterations.div_ceil(AGREEING_PART));
        Ok(Self {
            around: Some(Neighbors {
                sha256: sha256_of(luma.clone())?,
                surroundings: report.luma.surroundings,
                luma,
            }),
            settings: LumaOverlay {
                iterations,
                ..self.settings
            },
            // Only photos at the size that is trained on are without what is beyond.
            measure_side: None,
            ..self
        })
    }

    /// For a block trained among its neighbors, its photos minus the scene beyond it, which its
    /// Gaussians would otherwise reproduce and be wrong after merging; and the merged scene's
    /// Gaussians in its cell and margin, to start from, surroundings last. For other trainings, the
    /// photos unchanged.
    ///
    /// The merged scene is rendered for each photo, as far as it is visible there.
    ///
    /// # Errors
    /// [`RunError`] of the splat files, of the device, and where `folder` cannot be written to.
    pub(super) fn among_neighbors(
        &self,
        dataset: Dataset,
        raster: &Arc<Raster>,
        folder: &RunFolder,
        observe: &mut Observer<'_>,
    ) -> Result<(Dataset, Option<Splats>), RunError> {
        let (Some(block), Some(init)) = (&self.block, &self.init) else {
            return Ok((dataset, None));
        };
        let Some(neighbors) = &self.around else {
            if let Init::Run { folder, .. } = init
                && folder.read_report()?.luma.around.is_some()
            {
                observe(Event::Warning(format!(
                    "{} has nothing beyond its margin any more: train it among its neighbors, or what it shows there will be wrong",
                    block.plan().name
                )));
            }
            return Ok((dataset, None));
        };
        let offset = dataset.capture.offset;
        let own = read_splats(&init.path(), Frame::Own, observe)?.0.to_luma();
        let (merged, drawn) = read_splats(&neighbors.luma, Frame::World(offset), observe)?;
        let merged = merged.to_luma();
        let near = block.near(offset);
        let scene = merged.len().saturating_sub(neighbors.surroundings);
        let taken: Vec<usize> = (0..scene)
            .filter(|&i| near.holds(merged.means[i]))
            .collect();
        // Each block has surroundings of its own.
        let shell = own.len().saturating_sub(self.surroundings())..own.len();
        observe(Event::Note(format!(
            "continues with {} of the merged scene's {scene} Gaussians; what photos show of the others is taken off them",
            taken.len(),
        )));
        let mut start = merged.chosen(&taken);
        start.append(own.chosen(&shell.collect::<Vec<_>>()));

        let raster = raster.drawing(drawn);
        let told = block.exposures().unwrap_or_default();
        let beyond = Complement {
            raster: &raster,
            whole: &merged,
            part: &start,
            exposures: &exposures(&dataset, told),
        };
        let layers = beyond.layers(&dataset, folder, observe)?;
        Ok((dataset.without(layers), Some(start)))
    }
}

/// Difference of a scene and a part of it.
struct Complement<'a> {
    raster: &'a Arc<Raster>,
    whole: &'a Splats,
    part: &'a Splats,
    /// Exposure of each view.
    exposures: &'a [Exposure],
}

impl Complement<'_> {
    /// Renders the difference for each view.
    fn layers(
        &self,
        dataset: &Dataset,
        folder: &RunFolder,
        observe: &mut Observer<'_>,
    ) -> Result<Layers, RunError> {
        let total = dataset.cameras.len();
        let mut layers = Layers::new(folder.path(), total)?;
        let mut part = SceneRenderer::of(self.raster, self.part, &[&self.part.sh], dataset.extent)?;
        // No more of the scene has to fit onto the device than one photo shows.
        let fields = [&self.whole.sh];
        let mut whole = SceneRenderer::on_host(self.raster, self.whole, &fields, dataset.extent);
        for (view, camera) in dataset.cameras.iter().enumerate() {
            observe(Event::progress(
                Stage::Placing,
                view,
                total,
                &dataset.capture.views[view].name,
            ));
            let whole = whole.render(camera)?.remove(0);
            let part = part.render(camera)?.remove(0);
            let gain = self.exposures[view].gain as f32;
            let pixels = whole.pixels.iter().zip(&part.pixels);
            let beyond = pixels.map(|(whole, part)| gain * (whole - part));
            layers.put(view, &beyond.collect::<Vec<_>>())?;
        }
        Ok(layers)
    }
}
