//! The teacher as one to be measured: its own pictures, and what it makes of the gray
//! scene frame by frame.

use std::path::Path;

use super::subject::Subject;
use crate::{
    chroma::teacher::{AbImage, GrayImage, Teacher},
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
        subject: &Subject,
        baselines: bool,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        let mut teacher = Teacher::open(path, Some(&subject.folder.teacher()))?;
        let info = serde_json::to_value(teacher.describe()).unwrap_or_default();
        if let Some(chroma) = &subject.report.chroma
            && chroma.teacher != info
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
            answers.push(teacher.colorize(&view.name, gray)?);
        }
        if answers.iter().all(Option::is_none) {
            return Err(RunError::TeacherCoversNothing {
                teacher: path.to_owned(),
                example: scene.capture.views[0].name.clone(),
            });
        }
        let frames = match teacher {
            Teacher::Network(_) if baselines => Some(Teacher::open(path, None)?),
            Teacher::Folder(_) if baselines => {
                observe(Event::Note(
                    "a folder of images cannot colour frames: no baseline of luma, then teacher"
                        .to_owned(),
                ));
                None
            }
            _ => None,
        };
        Ok(Self {
            info,
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
        Ok(teacher.colorize(name, gray)?)
    }
}
