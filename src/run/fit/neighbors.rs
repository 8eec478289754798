//! `fit JOB/block-3 --around RUN`: a trained block among its neighbors.

use std::{path::PathBuf, sync::Arc};

use serde::{Deserialize, Serialize};

use super::{FitRequest, Init};
use crate::{
    capture::{Dataset, Exposure, Layers},
    eval::exposures,
    raster::{Raster, SceneRenderer},
    run::RunError,
    splats::Splats,
    store::RunFolder,
    subject::scene::{Frame, read_splats},
    tell::{Event, Observer, Stage},
};

/// The scene of a merged run, of which a block takes what is in its cell and margin.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Neighbors {
    /// Its splat file.
    pub luma: PathBuf,
    /// SHA-256 of the file.
    pub sha256: String,
    /// How many of its Gaussians, the last ones, are surroundings.
    pub surroundings: usize,
}

impl FitRequest {
    /// Of a block that goes on among its neighbors its photos without what they show beyond it,
    /// for else its Gaussians would stand in for that and be wrong once blocks are put together;
    /// and what the merged scene has in its cell and margin, to start from. Surroundings come
    /// last. Of other trainings the photos as they are.
    ///
    /// The merged scene is drawn for each photo, as far as the photo shows it.
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
                    "{} has nothing beyond its margin any more: go on with --around, or what it shows there will be wrong",
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
            "goes on with {} of the merged scene's {scene} Gaussians; what photos show of the others is taken off them",
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

/// What a scene has and a part of it has not.
struct Complement<'a> {
    raster: &'a Arc<Raster>,
    whole: &'a Splats,
    part: &'a Splats,
    /// Of each view.
    exposures: &'a [Exposure],
}

impl Complement<'_> {
    /// What photos show of it.
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
