//! The teacher as one to be measured: its own pictures, and what it makes of the gray
//! scene frame by frame.

use super::{EvalError, Observer, Progress, Task as Step, picture::as_photo};
use crate::{
    capture::Dataset,
    chroma::{
        Targets,
        teacher::{AbImage, GrayImage, Query, Teacher},
    },
    raster::RenderedImage,
};

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
        teacher.check_images()?;
        Ok(Self {
            info: serde_json::to_value(info).unwrap_or_default(),
            answers,
            of_view,
            frames,
        })
    }

    /// Returns true if there is an answer for a view.
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

    /// The teacher's colors for a drawn gray picture; `None` without that baseline.
    pub fn color_frame(
        &mut self,
        name: &str,
        gray: &RenderedImage,
    ) -> Result<Option<AbImage>, EvalError> {
        let Some(teacher) = &mut self.frames else {
            return Ok(None);
        };
        let photo = as_photo(gray);
        let gray = GrayImage {
            width: photo.width,
            height: photo.height,
            pixels: &photo.gray,
        };
        Ok(teacher.colorize(name, gray, None)?)
    }
}
