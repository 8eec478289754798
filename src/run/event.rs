//! What a run tells while it goes on.

use std::{cell::RefCell, fmt};

use crate::eval::{self, Task};

/// A part of a run that takes time. Each second of a run belongs to one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Opening the device.
    Device,
    /// Reading COLMAP's model, headers of photos and splat files.
    Model,
    /// Dividing a scene into blocks.
    Dividing,
    /// Looking at the range of the photos' values.
    Survey,
    /// Timing the device, where time is limited.
    Pace,
    /// Reading photos.
    Photos,
    /// Finding out which effects they call for.
    Plan,
    /// Short trainings that tell whether the scene calls for an effect.
    Trial,
    /// Placing the first Gaussians, and all that a training needs on the device.
    Placing,
    /// Stage 1.
    Training,
    /// Asking the teacher.
    Teacher,
    /// Solving for the lightness of other photos.
    Relight,
    /// Listing the Gaussians of each view's tiles.
    Lists,
    /// Solving for chroma harmonics of one degree after the other.
    Degree,
    /// Stage 2.
    Solving,
    /// Comparing how strong colors are with the teacher's.
    Strength,
    /// From a/b to the RGB that splat files have.
    Bake,
    /// Coloring a scene in another way, to compare with.
    Baseline,
    /// Finding Gaussians that no training view needs.
    Cleaning,
    /// Fitting the scene to a viewer.
    Viewer,
    /// Drawing pictures.
    Rendering,
    /// Following strokes from photo to photo.
    Strokes,
    /// Coloring photos at full size.
    Coloring,
    /// Measuring pictures against photos.
    Measuring,
    /// Drawing and comparing the frames of a path.
    Path,
    /// Drawing the photographed views.
    Views,
    /// Comparing these with each other.
    Pairs,
    /// Writing a page and its pictures.
    Page,
    /// Writing files.
    Saving,
    /// Whole runs, one after the other; counted in seconds.
    Sweep,
    /// Looking for a film's cuts; counted in seconds of the film.
    Cuts,
    /// Writing a film's frames.
    Frames,
    /// Looking for a film's sharpest frames.
    Sharpness,
    /// Making masks.
    Masks,
    /// Looking for features.
    Features,
    /// Matching photos.
    Matches,
    /// Finding poses.
    Poses,
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Device => "device",
            Self::Model => "model",
            Self::Dividing => "dividing",
            Self::Survey => "survey",
            Self::Pace => "pace",
            Self::Photos => "photos",
            Self::Plan => "plan",
            Self::Trial => "trial",
            Self::Placing => "placing",
            Self::Training => "training",
            Self::Teacher => "teacher",
            Self::Relight => "relight",
            Self::Lists => "lists",
            Self::Degree => "degree",
            Self::Solving => "solving",
            Self::Strength => "strength",
            Self::Bake => "bake",
            Self::Baseline => "baseline",
            Self::Cleaning => "cleaning",
            Self::Viewer => "viewer",
            Self::Rendering => "rendering",
            Self::Strokes => "strokes",
            Self::Coloring => "coloring",
            Self::Measuring => "measuring",
            Self::Path => "path",
            Self::Views => "views",
            Self::Pairs => "pairs",
            Self::Page => "page",
            Self::Saving => "saving",
            Self::Sweep => "sweep",
            Self::Cuts => "cuts",
            Self::Frames => "frames",
            Self::Sharpness => "sharpness",
            Self::Masks => "masks",
            Self::Features => "features",
            Self::Matches => "matches",
            Self::Poses => "poses",
        })
    }
}

/// What a run tells while it goes on.
#[derive(Clone, Debug)]
pub enum Event {
    /// Some lines worth reading once.
    Note(String),
    /// A line about something doubtful that does not stop the run.
    Warning(String),
    /// How far a stage is; the first of another stage ends the one before.
    Progress {
        /// Which stage.
        stage: Stage,
        /// Steps done.
        done: usize,
        /// Steps in all; 0 where they are not counted.
        total: usize,
        /// Figures of the moment.
        message: String,
    },
}

impl Event {
    /// A stage begins, whose steps are counted later if at all.
    pub fn begins(stage: Stage) -> Self {
        Self::Progress {
            stage,
            done: 0,
            total: 0,
            message: String::new(),
        }
    }
}

impl From<eval::Progress<'_>> for Event {
    fn from(progress: eval::Progress<'_>) -> Self {
        Self::Progress {
            stage: match progress.task {
                Task::Teacher => Stage::Teacher,
                Task::Peer => Stage::Baseline,
                Task::Measure => Stage::Measuring,
                Task::Path => Stage::Path,
                Task::Views => Stage::Views,
                Task::Pairs => Stage::Pairs,
                Task::Strength => Stage::Strength,
            },
            done: progress.done,
            total: progress.total,
            message: progress.name.to_owned(),
        }
    }
}

/// Who is told.
pub type Observer<'a> = dyn FnMut(Event) + 'a;

/// Tells `observe` everything and keeps the warnings.
pub(crate) fn keeping<'a>(
    warnings: &'a RefCell<Vec<String>>,
    observe: &'a mut Observer<'_>,
) -> impl FnMut(Event) + 'a {
    move |event| {
        if let Event::Warning(line) = &event {
            warnings.borrow_mut().push(line.clone());
        }
        observe(event);
    }
}
