//! A request to `fit`.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use serde::{Deserialize, Serialize};

use super::block::{BlockPlace, job_of};
use crate::{
    blocks::{BlockFile, Job, Kind},
    capture::LoadOptions,
    effects::{Effect, Overrules},
    luma::{Goal, LumaOverlay, Preset},
    report::EffectReport,
    run::RunError,
    store::{CheckpointOptions, RunFolder},
    subject::Live,
};

/// Gaussians to start from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Init {
    /// Those of a splat file.
    File(PathBuf),
    /// Those of a run that goes on.
    Run {
        /// The run.
        folder: RunFolder,
        /// Its iterations so far.
        iterations: usize,
        /// Number of surroundings, the last of its Gaussians.
        surroundings: usize,
    },
}

impl Init {
    /// The splat file.
    pub fn path(&self) -> PathBuf {
        match self {
            Self::File(path) => path.clone(),
            Self::Run { folder, .. } => folder.luma(),
        }
    }

    /// Iterations that led to them, as far as the run's log has them.
    pub(super) fn iterations(&self) -> usize {
        match self {
            Self::File(_) => 0,
            Self::Run { iterations, .. } => *iterations,
        }
    }

    /// Number of surroundings among them.
    fn surroundings(&self) -> usize {
        match self {
            Self::File(_) => 0,
            Self::Run { surroundings, .. } => *surroundings,
        }
    }
}

/// The scene of a merged run, of which a block takes what is in its cell and margin.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Neighbors {
    /// Its splat file.
    pub luma: PathBuf,
    /// SHA-256 of the file.
    pub sha256: String,
    /// Number of surroundings, the last of its Gaussians.
    pub surroundings: usize,
}

/// Effects that each block decides for itself: how far a lens displaces pixels depends on the
/// photos' size, and harmonics of any degree can be put together.
const OWN: [Effect; 2] = [Effect::Lens, Effect::LumaDegree];

/// A request to train a gray scene; `None` leaves a value to the preset.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct FitRequest {
    /// The COLMAP folder.
    pub colmap_dir: PathBuf,
    /// The run folder; `runs/<folder name>` by default.
    pub output: Option<PathBuf>,
    /// Amount of work; `paper` on a GPU and `draft` on a software adapter by default.
    /// With another goal than a fixed one, the most that is tried, `paper` by default.
    pub preset: Option<Preset>,
    /// Settings in the place of the preset's. Not the iterations together with a
    /// time limit or a target, nor what the plan of effects decides.
    pub settings: LumaOverlay,
    /// Options for loading photos; the longer side is the preset's if it is `None`.
    pub load: LoadOptions,
    /// Longer side at which held-out views are measured; that of training by default.
    pub measure_side: Option<u32>,
    /// Pictures of a view during training are kept.
    pub album: bool,
    /// Effects that are on or off regardless of the evidence.
    pub overrules: Overrules,
    /// Gaussians to start from.
    pub init: Option<Init>,
    /// The block of a larger scene that it is.
    pub block: Option<BlockPlace>,
    /// Neighbors of a block that continues its training.
    pub around: Option<Neighbors>,
    /// Stopping goal; its seconds cover the whole run. A PSNR is that of the held-out views, or of
    /// some training views if none is held out.
    pub goal: Goal,
    /// The report tells where the device's time went.
    pub timings: bool,
    /// Checkpoints of the run.
    #[serde(skip)]
    pub checkpoints: CheckpointOptions,
    /// State for live viewers.
    #[serde(skip)]
    pub live: Option<Arc<Live>>,
}

impl FitRequest {
    /// All as the preset and the photos have it.
    pub fn new(colmap_dir: PathBuf) -> Self {
        Self {
            colmap_dir,
            ..Self::default()
        }
    }

    /// Request to train a block of a job, or its coarse model, in its own folder; `None` if the
    /// folder is neither. Photos, effects and exposures found by the coarse model hold for all
    /// blocks.
    ///
    /// # Errors
    /// [`RunError::Store`] where a file of the job is damaged.
    pub fn of_block(folder: &Path) -> Result<Option<Self>, RunError> {
        let Some(file) = BlockFile::read(folder)? else {
            return Ok(None);
        };
        let job = Job::read(&job_of(folder))?;
        let block = BlockPlace::read(folder)?;
        let coarse = block.as_ref().and_then(|block| block.coarse.as_ref());
        let (load, overrules) = match coarse {
            Some((_, report)) => (report.capture.load.clone(), decided(&report.effects, &OWN)),
            None => Default::default(),
        };
        let settings = LumaOverlay {
            max_splats: file.max_splats,
            iterations: file.iterations,
            // Those of the coarse model surround all blocks.
            surround: coarse.map(|_| false),
            // What is divided into blocks is larger than a device.
            stream_photos: block.as_ref().map(|_| true),
            haste: (block.as_ref()).map(|block| block.job.haste(&block.block)),
            ..LumaOverlay::default()
        };
        Ok(Some(Self {
            output: Some(folder.to_owned()),
            preset: (file.kind == Kind::Coarse).then_some(Preset::Draft),
            settings,
            load: LoadOptions {
                max_side: None,
                chosen: Some(file.photos),
                ..load
            },
            overrules,
            block,
            ..Self::new(job.capture)
        }))
    }

    /// Returns true if photos, effects and exposures come from a coarse model.
    pub fn inherits(&self) -> bool {
        (self.block.as_ref()).is_some_and(|block| block.coarse.is_some())
    }

    /// Number of surroundings, the last of the initial Gaussians.
    pub(super) fn surroundings(&self) -> usize {
        self.init.as_ref().map_or(0, Init::surroundings)
    }
}

/// Effects as they were decided, those aside that are decided anew.
pub(super) fn decided(effects: &[EffectReport], anew: &[Effect]) -> Overrules {
    let named = |on| {
        let of_kind = effects.iter().filter(|effect| effect.on == on);
        of_kind
            .map(|effect| effect.name)
            .filter(|name| !anew.contains(name))
            .collect()
    };
    Overrules {
        with: named(true),
        without: named(false),
        sh_degree: None,
    }
}
