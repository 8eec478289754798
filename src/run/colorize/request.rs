//! A request to `colorize`, and the files that it makes.

use std::{path::PathBuf, sync::Arc};

use serde::{Deserialize, Serialize};

use crate::{
    chroma::{ChromaSettings, Degree},
    run::teach::TeachOptions,
    store::CheckpointOptions,
    subject::Live,
};

/// A request to color a gray scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ColorizeRequest {
    /// Run folder or gray splat file; the newest run by default.
    pub run: Option<PathBuf>,
    /// Teachers of the photos.
    pub teach: TeachOptions,
    /// The colored splat file; `color.ply` in the run folder by default.
    pub output: Option<PathBuf>,
    /// Last iteration, counted from the start of stage 1; the preset's by default.
    pub until: Option<usize>,
    /// Settings of the chroma solver. Seed and iterations are those of the run, the degree follows
    /// from `sh_degree`, and view correction from `correct_views`.
    pub settings: ChromaSettings,
    /// Degree of the chroma harmonics.
    pub sh_degree: Degree,
    /// Each view's teacher is brought into line with the others, or is not; by default where
    /// they disagree.
    pub correct_views: Option<bool>,
    /// COLMAP folder, where it is not the one that `fit` noted.
    pub colmap: Option<PathBuf>,
    /// Lightness, too, is what the photos show, and not what was trained; a run keeps its own
    /// files then.
    pub relight: bool,
    /// Photos are taken as they are where they and the model contradict each other.
    pub force: bool,
    /// The report tells where the device's time went.
    pub timings: bool,
    /// Checkpoint options; unused without a run.
    #[serde(skip)]
    pub checkpoints: CheckpointOptions,
    /// State for live viewers.
    #[serde(skip)]
    pub live: Option<Arc<Live>>,
}

impl Default for ColorizeRequest {
    fn default() -> Self {
        Self {
            run: None,
            teach: TeachOptions::default(),
            output: None,
            until: None,
            settings: ChromaSettings::irls(),
            sh_degree: Degree::Fixed(0),
            correct_views: None,
            colmap: None,
            relight: false,
            force: false,
            timings: false,
            checkpoints: CheckpointOptions::default(),
            live: None,
        }
    }
}

/// Output files of `colorize`.
#[derive(Clone, Debug)]
pub struct Output {
    /// The colored splat file, of any format.
    pub ply: PathBuf,
    /// The contact sheet, when a run was colored.
    pub contact_sheet: Option<PathBuf>,
}
