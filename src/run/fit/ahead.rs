//! Networks that color the photos while luma trains: a processor's work beside a GPU's.

use std::{
    path::PathBuf,
    sync::atomic::{AtomicBool, Ordering},
    thread,
};

use serde::{Deserialize, Serialize};

use crate::{
    capture::Dataset,
    chroma::teacher::{GrayImage, Query, Teacher, TeacherSettings},
    run::RunError,
    store::RunFolder,
    tell::{Event, Observer, Stage},
};

/// Teachers that are asked while luma trains; may be none.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AheadOptions {
    /// Colorization networks. A folder of colored photos may be named, but has nothing to
    /// be asked.
    pub teachers: Vec<PathBuf>,
    /// How they are asked, as `colorize` will ask them.
    pub settings: TeacherSettings,
}

/// The teachers, opened: what is wrong with them is said before an hour of training.
pub(super) struct Ahead(Vec<Teacher>);

/// How far they came.
#[derive(Default)]
struct Came {
    answers: usize,
    failure: Option<String>,
}

impl Ahead {
    /// Opens them; answers are kept in the run's folder, where `colorize` finds them.
    pub fn open(options: &AheadOptions, folder: &RunFolder) -> Result<Self, RunError> {
        let open = |path: &PathBuf| Teacher::open(path, Some(&folder.teacher()), &options.settings);
        let teachers = (options.teachers.iter())
            .map(open)
            .collect::<Result<_, _>>()?;
        Ok(Self(teachers))
    }

    /// Asks about every photo, on a thread of its own, while `work` is done. What is not
    /// answered by then is left to `colorize`; at most one answer is waited for.
    ///
    /// # Errors
    /// Those of `work`: a network that fails is a warning, and `colorize`'s to mend.
    pub fn meanwhile<T>(
        mut self,
        dataset: &Dataset,
        observe: &mut Observer<'_>,
        work: impl FnOnce(&mut Observer<'_>) -> Result<T, RunError>,
    ) -> Result<T, RunError> {
        self.0.retain(Teacher::is_network);
        if self.0.is_empty() {
            return work(observe);
        }
        let wanted = self.0.len() * dataset.cameras.len();
        let stop = AtomicBool::new(false);
        let (done, came) = thread::scope(|scope| {
            let asking = scope.spawn(|| ask(&mut self.0, dataset, &stop));
            let done = work(observe);
            stop.store(true, Ordering::Relaxed);
            if !asking.is_finished() {
                observe(Event::begins(Stage::Teacher));
            }
            // A network that panics says so itself.
            (done, asking.join().unwrap_or_default())
        });
        let done = done?;
        observe(match came.failure {
            Some(error) => Event::Warning(format!("asked ahead: {error}")),
            None => Event::Note(format!("asked ahead: {} of {wanted} answers", came.answers)),
        });
        Ok(done)
    }
}

fn ask(teachers: &mut [Teacher], dataset: &Dataset, stop: &AtomicBool) -> Came {
    let mut came = Came::default();
    for (index, view) in dataset.capture.views.iter().enumerate() {
        if stop.load(Ordering::Relaxed) {
            return came;
        }
        let photo = match dataset.photo(index) {
            Ok(photo) => photo,
            Err(error) => {
                came.failure = Some(error.to_string());
                return came;
            }
        };
        let gray = GrayImage {
            width: photo.width,
            height: photo.height,
            pixels: &photo.gray,
        };
        for teacher in &mut *teachers {
            if stop.load(Ordering::Relaxed) {
                return came;
            }
            match teacher.prepare(Query::view(view, &dataset.cameras[index]), gray) {
                Ok(()) => came.answers += 1,
                Err(error) => {
                    came.failure = Some(error.to_string());
                    return came;
                }
            }
        }
    }
    came
}
