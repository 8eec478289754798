//! The teacher as one to be measured: its own pictures, and what it makes of the gray
//! scene frame by frame.

use std::sync::Arc;

use super::{
    ColoredScene, EvalError, Observer, Progress, Task as Step,
    picture::{gray_picture, to_picture},
};
use crate::{
    capture::Dataset,
    chroma::{
        ChromaSettings, FrozenViews, Room, Targets, Task, fit_rgb, masked_weights, native_rgb,
        teacher::{AbImage, GrayImage, Query, Teacher},
    },
    raster::{Picture, Raster},
    splats::{ShField, sh},
};

/// Rounds for RGB splats, nearly four times those of chroma: harmonics of degree 3 settle
/// more slowly than a color for each Gaussian.
const RGB_ROUNDS: usize = 45;

/// A teacher and its answers for the photos.
pub struct MeasuredTeacher {
    /// Name, kind and identity.
    pub info: serde_json::Value,
    /// The answers, and each view's place among them, `None` where there is none.
    answers: Targets,
    of_view: Vec<Option<usize>>,
    /// Asked for drawn pictures; keeps no answers, since every coloring draws others.
    frames: Option<Teacher>,
}

impl MeasuredTeacher {
    /// Asks `teacher` for all photos; `frames`, where given, is asked for drawn pictures.
    ///
    /// # Errors
    /// [`EvalError`] of a photo or the teacher, [`EvalError::NothingTaught`].
    pub fn ask(
        mut teacher: Teacher,
        frames: Option<Teacher>,
        dataset: &Dataset,
        observe: &mut Observer<'_>,
    ) -> Result<Self, EvalError> {
        let info = teacher.describe();
        let (mut answers, mut of_view) = (Targets::new(1), Vec::new());
        let views: Vec<usize> = (0..dataset.cameras.len()).collect();
        dataset.visit(&views, |index, photo| {
            let view = &dataset.capture.views[index];
            observe(Progress {
                task: Step::Teacher,
                done: index,
                total: views.len(),
                name: &view.name,
            });
            let gray = GrayImage {
                width: photo.width,
                height: photo.height,
                pixels: &photo.gray,
            };
            let query = Query::view(view, &dataset.cameras[index]);
            let answer = teacher.colorize(query, gray, None)?;
            let kept = answer.map(|answer| answers.push_ab(&answer, None));
            of_view.push(kept.transpose()?);
            Ok::<_, EvalError>(())
        })?;
        if answers.is_empty() {
            return Err(EvalError::NothingTaught);
        }
        Ok(Self {
            info: serde_json::to_value(info).unwrap_or_default(),
            answers,
            of_view,
            frames,
        })
    }

    /// Whether there is an answer for a view.
    pub fn answers(&self, view: usize) -> bool {
        self.of_view[view].is_some()
    }

    /// The answer for a view, where there is one.
    ///
    /// # Errors
    /// [`EvalError::Chroma`] when kept answers cannot be read.
    pub fn answer(&self, view: usize) -> Result<Option<AbImage>, EvalError> {
        let kept = self.of_view[view].map(|index| self.answers.read(index, 0));
        Ok(kept.transpose()?.map(|target| target.ab()))
    }

    /// RGB splats on the run's geometry, fitted to the teacher's pictures of the training
    /// views: harmonics of degree 3 as splat trainers have, in [`RGB_ROUNDS`]. They are told what the training knew: exposures, masks.
    ///
    /// # Errors
    /// [`EvalError`] of a photo or the solver, [`EvalError::NothingTaught`].
    pub fn rgb_splats(
        &self,
        raster: &Arc<Raster>,
        scene: &ColoredScene,
        memory_limit: Option<u64>,
        observe: &mut Observer<'_>,
    ) -> Result<ShField, EvalError> {
        let dataset = &scene.dataset;
        observe(Progress {
            task: Step::RgbSplats,
            done: 0,
            total: 1,
            name: "",
        });
        let settings = ChromaSettings {
            sh_degree: sh::MAX_DEGREE,
            robust: None,
            correct_views: false,
            rounds: RGB_ROUNDS,
            settled: 0.0,
            ..ChromaSettings::irls()
        };
        let mut targets = Targets::new(settings.target_scales());
        let (mut tasks, mut cameras) = (Vec::new(), Vec::new());
        dataset.visit(&dataset.split.train, |view, photo| {
            let Some(answer) = self.answer(view)? else {
                return Ok(());
            };
            let colored = native_rgb(&gray_picture(photo), &to_picture(&answer));
            let wanted = scene.reference(view, photo).unexposed(&colored);
            let weights = masked_weights(None, photo);
            let size = [photo.width, photo.height];
            tasks.push(Task {
                view: cameras.len(),
                target: targets.push_rgb(size, &wanted, weights.as_deref())?,
            });
            cameras.push(dataset.cameras[view].clone());
            Ok::<_, EvalError>(())
        })?;
        if tasks.is_empty() {
            return Err(EvalError::NothingTaught);
        }
        let room = Room {
            limit: memory_limit,
            sh_degree: sh::MAX_DEGREE,
            weighted: targets.weighted(),
        };
        let (luma, extent, scales) = (&scene.luma, dataset.extent, targets.scales());
        let frozen = FrozenViews::new(raster, luma, extent, &cameras, scales, room)?;
        Ok(fit_rgb(&frozen, &settings, &targets, tasks)?)
    }

    /// What the teacher makes of a drawn gray picture; `None` without that baseline.
    ///
    /// # Errors
    /// [`EvalError::Teacher`].
    pub fn color_frame(
        &mut self,
        name: &str,
        gray: &Picture,
    ) -> Result<Option<AbImage>, EvalError> {
        let Some(teacher) = &mut self.frames else {
            return Ok(None);
        };
        let byte = |&v: &f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
        let pixels: Vec<u8> = gray.pixels.iter().map(byte).collect();
        let gray = GrayImage {
            width: gray.width,
            height: gray.height,
            pixels: &pixels,
        };
        Ok(teacher.colorize(name, gray, None)?)
    }
}
