//! The teacher as one to be measured: its own pictures, and what it makes of the gray
//! scene frame by frame.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{
    drawing::{gray_picture, to_picture},
    subject::Subject,
};
use crate::{
    chroma::{
        ChromaSettings, FrozenViews, Room, Targets, Task, fit_rgb, masked_weights, native_rgb,
        teacher::{AbImage, Asked, GrayImage, Teacher, TeacherSettings},
    },
    raster::{Picture, Raster},
    run::{Event, Observer, RunError, Stage},
    splats::{ShField, sh},
};

/// RGB splats get so many times the rounds of `colorize`: harmonics of degree 3 settle more
/// slowly than a color for each Gaussian.
const RGB_ROUNDS: usize = 3;

/// A teacher and its answers for the photos.
pub(super) struct EvalTeacher {
    path: PathBuf,
    /// Name, kind and identity.
    pub info: serde_json::Value,
    /// The answers, and each view's place among them, `None` where there is none.
    answers: Targets,
    of_view: Vec<Option<usize>>,
    /// Asked for drawn pictures; keeps no answers, since every colouring draws others.
    frames: Option<Teacher>,
}

impl EvalTeacher {
    /// Asks for all photos, through the run's cache; opens the teacher for frames too
    /// where `baselines` are wanted and it is a network.
    pub fn ask(
        path: &Path,
        settings: &TeacherSettings,
        subject: &Subject,
        baselines: bool,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        let mut teacher = Teacher::open(path, Some(&subject.folder.teacher()), settings)?;
        let info = teacher.describe();
        if let Some(chroma) = &subject.report.chroma
            && !(chroma.teachers.iter()).any(|t| (&t.name, &t.sha256) == (&info.name, &info.sha256))
        {
            observe(Event::Note(
                "the run was coloured by another teacher than the one it is measured against"
                    .to_owned(),
            ));
        }
        let dataset = &subject.dataset;
        let (mut answers, mut of_view) = (Targets::new(1), Vec::new());
        let views: Vec<usize> = (0..dataset.cameras.len()).collect();
        dataset.visit(&views, |index, photo| {
            let view = &dataset.capture.views[index];
            observe(Event::Progress {
                stage: Stage::Teacher,
                done: index,
                total: views.len(),
                message: view.name.clone(),
            });
            let gray = GrayImage {
                width: photo.width,
                height: photo.height,
                pixels: &photo.gray,
            };
            let asked = Asked::view(view, &dataset.cameras[index]);
            let answer = teacher.colorize(asked, gray, None)?;
            let kept = answer.map(|answer| answers.push_ab(&answer, None));
            of_view.push(kept.transpose()?);
            Ok::<_, RunError>(())
        })?;
        if answers.is_empty() {
            return Err(RunError::TeacherCoversNothing {
                teacher: path.to_owned(),
                example: dataset.capture.views[0].name.clone(),
            });
        }
        let frames = if baselines && teacher.is_network() {
            Some(Teacher::open(path, None, settings)?)
        } else {
            if baselines {
                observe(Event::Note(
                    "a folder of images cannot colour frames: no baseline of luma, then teacher"
                        .to_owned(),
                ));
            }
            None
        };
        Ok(Self {
            path: path.to_owned(),
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
    pub fn answer(&self, view: usize) -> Result<Option<AbImage>, RunError> {
        let kept = self.of_view[view].map(|index| self.answers.read(index, 0));
        Ok(kept.transpose()?.map(|target| target.ab()))
    }

    /// RGB splats on the run's geometry, fitted to the teacher's pictures of the training
    /// views: harmonics of degree 3 as splat trainers have, in [`RGB_ROUNDS`] times the
    /// rounds that `colorize` takes by default. They are told what `fit` knew: exposures, masks.
    pub fn rgb_splats(
        &self,
        raster: &Arc<Raster>,
        subject: &Subject,
        memory_limit: Option<u64>,
        observe: &mut Observer<'_>,
    ) -> Result<ShField, RunError> {
        let dataset = &subject.dataset;
        let (done, total) = (0, 1);
        let message = "RGB splats to compare with".to_owned();
        observe(Event::Progress {
            stage: Stage::Chroma,
            done,
            total,
            message,
        });
        let ours = ChromaSettings::irls();
        let settings = ChromaSettings {
            sh_degree: sh::MAX_DEGREE,
            robust: None,
            correct_views: false,
            coarse_rounds: RGB_ROUNDS * ours.coarse_rounds,
            rounds: RGB_ROUNDS * ours.rounds,
            ..ours
        };
        let mut targets = Targets::new(settings.target_scales());
        let (mut tasks, mut cameras) = (Vec::new(), Vec::new());
        dataset.visit(&dataset.split.train, |view, photo| {
            let Some(answer) = self.answer(view)? else {
                return Ok(());
            };
            let colored = native_rgb(&gray_picture(photo), &to_picture(&answer));
            let wanted = subject.yardstick(view, photo).unexposed(&colored);
            let weights = masked_weights(None, photo);
            let size = [photo.width, photo.height];
            tasks.push(Task {
                view: cameras.len(),
                target: targets.push_rgb(size, &wanted, weights.as_deref())?,
            });
            cameras.push(dataset.cameras[view].clone());
            Ok::<_, RunError>(())
        })?;
        if tasks.is_empty() {
            return Err(RunError::TeacherCoversNothing {
                teacher: self.path.clone(),
                example: dataset.capture.views[dataset.split.train[0]].name.clone(),
            });
        }
        let room = Room {
            limit: memory_limit,
            sh_degree: sh::MAX_DEGREE,
            weighted: targets.weighted(),
        };
        let (luma, extent, scales) = (&subject.luma, dataset.extent, targets.scales());
        let frozen = FrozenViews::new(raster, luma, extent, &cameras, scales, room)?;
        Ok(fit_rgb(&frozen, &settings, &targets, tasks)?)
    }

    /// What the teacher makes of a drawn gray picture; `None` without that baseline.
    pub fn color_frame(&mut self, name: &str, gray: &Picture) -> Result<Option<AbImage>, RunError> {
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
