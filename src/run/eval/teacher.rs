//! The teacher as one to be measured: its own pictures, and what it makes of the gray
//! scene frame by frame.

use std::path::Path;

use super::subject::Subject;
use crate::{
    chroma::teacher::{AbImage, GrayImage, Teacher, TeacherSettings},
    raster::Picture,
    run::{Event, Observer, RunError, Stage},
};

/// A teacher and its answers for the photos.
pub(super) struct EvalTeacher {
    /// Name, kind and identity.
    pub info: serde_json::Value,
    /// The answer for each view, `None` where there is none.
    pub answers: Vec<Option<AbImage>>,
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
        let scene = &subject.scene;
        let mut answers = Vec::with_capacity(scene.photos.len());
        for (done, ((photo, _), view)) in scene.photos.iter().zip(&scene.capture.views).enumerate()
        {
            observe(Event::Progress {
                stage: Stage::Teacher,
                done,
                total: scene.photos.len(),
                message: view.name.clone(),
            });
            let gray = GrayImage {
                width: photo.width,
                height: photo.height,
                pixels: &photo.gray,
            };
            answers.push(teacher.colorize(&view.name, gray, None)?);
        }
        if answers.iter().all(Option::is_none) {
            return Err(RunError::TeacherCoversNothing {
                teacher: path.to_owned(),
                example: scene.capture.views[0].name.clone(),
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
            info: serde_json::to_value(info).unwrap_or_default(),
            answers,
            frames,
        })
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
