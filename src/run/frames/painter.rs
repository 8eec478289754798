//! Sources of a photo's colors.

use super::{estimated::EstimatedView, shots::Shot};
use crate::{
    capture::{CaptureError, Dataset, Exposure, Normalize, Original, View},
    chroma::teacher::AbImage,
    frames::{Canvas, SceneDrawer, ViewOf, WeightedColors},
    run::{RunError, teach::Teachers},
};

/// Sources of a photo's colors: scene, exposures and teachers.
pub(super) struct Painter<'a> {
    pub drawer: SceneDrawer<'a>,
    pub exposures: Vec<Exposure>,
    pub dataset: &'a Dataset,
    /// Of each photo without a pose the one that it should have, if that is known.
    pub estimated: &'a [Option<EstimatedView>],
    pub teachers: Option<Teachers>,
    /// Values that become black and white in pictures of photos with more than 8 bits.
    pub range: Normalize,
    /// Longer side of the canvas met last, over that of its photo's.
    pub side: Option<f64>,
}

impl<'a> Painter<'a> {
    pub fn view(&self, shot: &Shot) -> &'a View {
        &self.dataset.capture.views[shot.views.start]
    }

    /// A photo at its file's size and depth.
    pub fn original(&self, shot: &Shot) -> Result<Original, CaptureError> {
        let loader = self.dataset.loader();
        match shot.views.is_empty() {
            true => loader.unplaced(&shot.path, self.range),
            false => loader.original(self.view(shot), self.range),
        }
    }

    /// Views of a photo, the estimated one where it has no pose.
    pub fn views(&self, shot: &Shot) -> Vec<ViewOf<'a>> {
        let dataset = self.dataset;
        let of = |i: usize| ViewOf {
            view: &dataset.capture.views[i],
            camera: &dataset.cameras[i],
            exposure: self.exposures[i],
            is_estimated: false,
        };
        let estimated = self.estimated[shot.index].as_ref().map(|estimated| ViewOf {
            camera: &estimated.camera,
            is_estimated: true,
            ..of(estimated.nearest)
        });
        shot.views.clone().map(of).chain(estimated).collect()
    }

    /// A photo with a pose at the size at which its views were trained.
    pub fn canvas(&mut self, shot: &Shot, original: &Original) -> Canvas {
        let size = SceneDrawer::size(&self.views(shot));
        let size = size.unwrap_or([original.width, original.height]);
        let canvas = Canvas::sized(original, size);
        let longer = |width: u32, height: u32| f64::from(width.max(height));
        let scale = longer(canvas.width, canvas.height) / longer(original.width, original.height);
        self.side = Some(scale);
        canvas
    }

    /// The longer side for a photo without a pose: at the scale of the others.
    pub fn side(&self, original: &Original) -> u32 {
        let scale = self.side.or_else(|| self.usual_scale()).unwrap_or(1.0);
        let longer = f64::from(original.width.max(original.height));
        ((longer * scale).round() as u32).max(1)
    }

    /// Scale of the first view.
    fn usual_scale(&self) -> Option<f64> {
        let view = self.dataset.capture.views.first()?;
        let seen = ViewOf {
            view,
            camera: &self.dataset.cameras[0],
            exposure: Exposure::NONE,
            is_estimated: false,
        };
        let [width, height] = SceneDrawer::size(&[seen])?;
        let size = self.dataset.loader().seen(view).ok()?.0;
        Some(f64::from(width.max(height)) / f64::from(size[0].max(size[1])))
    }

    pub fn seen(&mut self, shot: &Shot, canvas: &Canvas) -> Result<WeightedColors, RunError> {
        let views = self.views(shot);
        Ok(self.drawer.draw(&views, canvas)?)
    }

    /// The teachers' colors of a photo, a and b of each pixel.
    pub fn answer(
        &mut self,
        name: &str,
        view: Option<&ViewOf<'_>>,
        canvas: &Canvas,
    ) -> Result<Option<Vec<[f32; 2]>>, RunError> {
        let Some(teachers) = &mut self.teachers else {
            return Ok(None);
        };
        let placed = view.filter(|seen| !seen.is_estimated);
        let name = placed.map_or(name, |seen| &seen.view.photo);
        let answer = teachers.color(canvas.query(name), canvas.gray_image())?;
        Ok(answer.map(|AbImage { ab, .. }| ab))
    }
}
