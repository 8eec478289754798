//! Stage 1 as a whole: photos in, a gray scene out.

use std::{
    ops::{ControlFlow, Range},
    sync::Arc,
    time::Instant,
};

use super::{
    AlbumPicture, Checkpoint, Checkpointing, CurvePoint, Demand, Goal, Grows, LumaError,
    LumaProgress, LumaSettings, LumaTrainer, NoCheckpoints, PlannedViews, TrialProgress,
    carve::carved,
    planned, resident_photos,
    start::{placed_splats, started, surroundings},
};
use crate::{
    capture::{Dataset, Exposure},
    effects::{Decider, Decision, Effect, Evidence, Overrules, Plan, Survey, Trials},
    gpu::{Gpu, GpuError},
    raster::{Load, Raster},
    splats::{ShField, Splats},
};

/// Views that are looked at while training goes on, at most.
const WATCHED: usize = 3;

/// A trained gray scene.
#[derive(Clone, Debug)]
pub struct LumaScene {
    /// Its Gaussians, one channel.
    pub splats: Splats,
    /// Number of surroundings, the last of these Gaussians.
    pub surroundings: usize,
    /// Settings of the training, with the decisions of the plan and the memory limit.
    pub settings: LumaSettings,
    /// Simulated effects with their evidence; exposures of all views.
    pub plan: Plan,
    /// The scene's extent in world units.
    pub extent: f64,
    /// Iterations that led to the Gaussians.
    pub iterations: usize,
    /// Held-out scores of the validations during training.
    pub curve: Vec<CurvePoint>,
    /// Pictures of one view at some of these; none unless asked for.
    pub album: Vec<AlbumPicture>,
    /// The iteration at which the training gave up what had brought no gain.
    pub given_up: Option<usize>,
    /// The last report.
    pub last: Option<LumaProgress>,
    /// Mean load of an iteration, over the reports.
    pub load: Load,
    /// Bytes that it was estimated to take on the device at most.
    pub estimated_device_memory: u64,
    /// Bytes that it took there at most, where the backend tells.
    pub peak_device_memory: Option<u64>,
    /// Seconds of trials, of all before the training, of it and of looking at watched views.
    pub seconds: [f64; 4],
}

impl LumaScene {
    /// Rasterizer that draws the scene as it was trained.
    pub fn raster(&self, gpu: &Gpu) -> Arc<Raster> {
        self.settings.raster(gpu)
    }

    /// Exposure of each view.
    pub fn exposures(&self) -> &[Exposure] {
        &self.plan.exposures
    }
}

/// Event of a training.
#[derive(Clone, Copy, Debug)]
pub enum LumaEvent<'a> {
    /// So many photos have been examined.
    Examined {
        /// The view whose photo comes next.
        view: usize,
        /// Views in all.
        total: usize,
    },
    /// A short training that tells whether exposures differ.
    Trial(TrialProgress),
    /// The effects that are simulated.
    Plan(&'a Plan),
    /// There is room for so many Gaussians only, within the settings' memory limit or, where
    /// there is none, the adapter's bindings.
    Capped(usize),
    /// The first Gaussians are placed, and what a training needs is brought to the device.
    Placing,
    /// The training begins after so many iterations.
    Starting {
        /// Iterations done.
        iteration: usize,
        /// Iterations in all, as it looks now.
        end: usize,
    },
    /// The training.
    Training(LumaProgress),
}

/// Observer of a training; a [`ControlFlow::Break`] ends it with [`LumaError::Cancelled`].
pub type LumaObserver<'a> = dyn FnMut(LumaEvent<'_>) -> ControlFlow<()> + 'a;

/// Trains a gray scene on a dataset, with the effects that its photos call for.
///
/// `dataset` holds photos at the size that is trained on.
///
/// # Errors
/// [`LumaError`] of a photo or of the device, or [`LumaError::Cancelled`].
pub fn fit(
    gpu: &Gpu,
    dataset: &Arc<Dataset>,
    settings: &LumaSettings,
    observe: &mut LumaObserver<'_>,
) -> Result<LumaScene, LumaError> {
    let mut survey = Survey::new(&dataset.capture, &dataset.cameras, &dataset.split);
    let views: Vec<usize> = (0..dataset.cameras.len()).collect();
    dataset.visit(&views, |view, photo| {
        survey.look(view, photo);
        let total = views.len();
        go_on(observe(LumaEvent::Examined { view, total }))
    })?;
    let evidence = survey.finish();
    Fit {
        raster: &Arc::new(Raster::new(gpu)),
        dataset,
        evidence: &evidence,
        overrules: &Overrules::default(),
        goal: Goal::Fixed,
        tries: true,
        start: None,
        surroundings: 0,
        exposures: None,
        grows: None,
        watched: None,
        album: false,
    }
    .run(settings, observe)
}

/// A training with all options, where [`fit`] takes the defaults.
pub struct Fit<'a> {
    /// Rasterizer of the training.
    pub raster: &'a Arc<Raster>,
    /// Photos at the size that is trained on.
    pub dataset: &'a Arc<Dataset>,
    /// Evidence from the photos.
    pub evidence: &'a Evidence,
    /// Effects that are on or off regardless of the evidence.
    pub overrules: &'a Overrules,
    /// Stopping goal; its seconds count from [`Fit::run`] on.
    pub goal: Goal,
    /// True if trials may decide effects that the photos leave open.
    pub tries: bool,
    /// Gaussians to start from instead of COLMAP's points.
    pub start: Option<&'a Splats>,
    /// Number of surroundings, the last of these Gaussians; they stay fixed.
    pub surroundings: usize,
    /// Exposure of each view, if known and the plan simulates exposure.
    pub exposures: Option<&'a [Exposure]>,
    /// Region in which Gaussians may be split; everywhere by default.
    pub grows: Option<Grows>,
    /// Views that are looked at on the way; a few of the held-out ones by default.
    pub watched: Option<(&'a Arc<Dataset>, Vec<usize>)>,
    /// True to keep pictures of one of them.
    pub album: bool,
}

impl Fit<'_> {
    /// Trains.
    ///
    /// # Errors
    /// As [`fit`].
    pub fn run(
        &self,
        settings: &LumaSettings,
        observe: &mut LumaObserver<'_>,
    ) -> Result<LumaScene, LumaError> {
        self.run_from(None, &mut NoCheckpoints, settings, observe)
    }

    /// Trains, or goes on with what an interrupted training of the same kept; seconds of the
    /// goal count from its beginning. `checkpointing` is asked now and then whether it wants a
    /// checkpoint.
    ///
    /// # Errors
    /// As [`fit`].
    pub fn run_from(
        &self,
        checkpoint: Option<&Checkpoint>,
        checkpointing: &mut dyn Checkpointing,
        settings: &LumaSettings,
        observe: &mut LumaObserver<'_>,
    ) -> Result<LumaScene, LumaError> {
        let begun = Instant::now();
        let dataset = self.dataset;
        let plan = match checkpoint.and_then(|checkpoint| checkpoint.state.plan.clone()) {
            Some(plan) => plan,
            None => self.plan(settings, observe)?,
        };
        let tried = |decision: &Decision| decision.decided_by == Decider::Trial;
        let trying = match plan.decisions.iter().any(tried) {
            true => begun.elapsed().as_secs_f64(),
            false => 0.0,
        };
        let plan = match self.exposures {
            Some(exposures) if plan.has(Effect::Exposure) => Plan {
                exposures: exposures.to_vec(),
                ..plan
            },
            _ => plan,
        };
        go_on(observe(LumaEvent::Plan(&plan)))?;
        let mut settings = settings.clone().planned(&plan);
        let demand = self.fit_memory(&mut settings, &plan, observe)?;
        go_on(observe(LumaEvent::Placing))?;
        let (start, surroundings) = self.start(&settings, checkpoint.is_some())?;
        let preparing = begun.elapsed().as_secs_f64();

        let begun = Instant::now();
        let views = PlannedViews::new(dataset.clone(), self.evidence, &plan);
        let raster = self.raster.clone();
        let gpu = raster.gpu.clone();
        let mut trainer = LumaTrainer::new(raster, settings, dataset.extent, &start, views)?;
        match self.start {
            Some(_) => trainer.surround_at_once(surroundings)?,
            None => trainer.surround(surroundings),
        }
        trainer.grow_in(self.grows.clone());
        trainer.aim(match self.goal.seconds() {
            Some(limit) => self.goal.with_seconds(limit - preparing),
            None => self.goal,
        });
        self.watch(&mut trainer, plan.exposures.clone())?;
        trainer.remember(plan.clone());
        if let Some(checkpoint) = checkpoint {
            trainer.resume(checkpoint)?;
        }
        let (mut last, mut peak_device_memory) = (None, None);
        go_on(observe(LumaEvent::Starting {
            iteration: checkpoint.map_or(0, Checkpoint::iteration),
            end: trainer.schedule().end,
        }))?;
        trainer.train_keeping(checkpointing, &mut |progress| {
            last = Some(progress);
            peak_device_memory = peak_device_memory.max(gpu.allocated_bytes());
            observe(LumaEvent::Training(progress))
        })?;
        let mut splats = trainer.splats()?;
        if dataset.removes_masked() {
            splats = carved(dataset, &splats)?;
        }
        let watching = trainer.watched_seconds();
        let before = checkpoint.map_or(0.0, Checkpoint::seconds);
        let training = before + begun.elapsed().as_secs_f64() - watching;
        Ok(LumaScene {
            settings: trainer.settings().clone(),
            surroundings: trainer.surroundings(),
            extent: dataset.extent,
            iterations: trainer.schedule().end,
            curve: trainer.curve().to_vec(),
            album: self.pictures(&mut trainer),
            given_up: trainer.given_up(),
            last,
            load: trainer.load(),
            estimated_device_memory: demand.peak_bytes(splats.len()),
            peak_device_memory,
            seconds: [trying, preparing, training, watching],
            plan,
            splats,
        })
    }

    /// Lets a training look at views on its way.
    fn watch(&self, trainer: &mut LumaTrainer, exposures: Vec<Exposure>) -> Result<(), LumaError> {
        let (photographed, views) = self.watched();
        trainer.watch(PlannedViews::watched(
            photographed.clone(),
            views,
            exposures,
        ))?;
        if self.album {
            trainer.keep_album();
        }
        Ok(())
    }

    /// Pictures from its way.
    fn pictures(&self, trainer: &mut LumaTrainer) -> Vec<AlbumPicture> {
        let (_, views) = self.watched();
        let of_dataset = |picture: AlbumPicture| AlbumPicture {
            view: views[picture.view],
            ..picture
        };
        trainer.album().into_iter().map(of_dataset).collect()
    }

    /// Gaussians to train, and those around them that stay.
    fn start(&self, settings: &LumaSettings, resumes: bool) -> Result<(Splats, Splats), LumaError> {
        let Some(splats) = self.start else {
            let around = surroundings(self.dataset, self.evidence, settings)?;
            let placed = match resumes {
                // Anything that can be uploaded: all will be replaced.
                true => placeholder(settings.sh_degree),
                false => placed_splats(self.dataset, self.evidence, settings, around.len())?,
            };
            return Ok((placed, around));
        };
        let trained = splats.len().saturating_sub(self.surroundings);
        let some = |range: Range<usize>| splats.chosen(&range.collect::<Vec<_>>());
        let around = started(&some(trained..splats.len()), settings);
        let room = LumaSettings {
            max_splats: settings.max_splats.saturating_sub(around.len()).max(1),
            ..settings.clone()
        };
        Ok((started(&some(0..trained), &room), around))
    }

    fn plan(
        &self,
        settings: &LumaSettings,
        observe: &mut LumaObserver<'_>,
    ) -> Result<Plan, LumaError> {
        if !self.tries {
            let (room, untried) = (settings.room(), Trials::new());
            return Ok(self
                .evidence
                .decide(room, self.overrules, &untried)
                .confirmed());
        }
        let mut asked = ControlFlow::Continue(());
        let plan = planned(
            self.dataset,
            self.evidence,
            settings,
            self.overrules,
            || Ok::<_, LumaError>(self.raster.clone()),
            &mut |progress| {
                if asked.is_continue() {
                    asked = observe(LumaEvent::Trial(progress));
                }
                asked
            },
        )?;
        // A trial is no part of the training.
        self.raster.gpu.timings()?;
        Ok(plan)
    }

    /// Lowers the cap on Gaussians to what there is memory for.
    fn fit_memory(
        &self,
        settings: &mut LumaSettings,
        plan: &Plan,
        observe: &mut LumaObserver<'_>,
    ) -> Result<Demand, LumaError> {
        let (dataset, limit) = (self.dataset, settings.memory_limit);
        let ignores = plan.has(Effect::Masks) || plan.has(Effect::Robust);
        let cameras = dataset.split.train.iter().map(|&i| &dataset.cameras[i]);
        let (photographed, watched) = self.watched();
        let demand = Demand::of(
            cameras,
            ignores,
            settings.sh_degree,
            resident_photos(settings),
        )
        .watching(watched.iter().map(|&i| &photographed.cameras[i]));
        let binding = self.raster.gpu.binding_limit();
        let fits = demand.largest_set(limit, binding);
        if fits == 0 {
            return Err(LumaError::Gpu(GpuError::OverLimit {
                splats: 1,
                needed: demand.peak_bytes(1),
                limit: limit.unwrap_or(binding),
            }));
        }
        if fits < settings.max_splats {
            go_on(observe(LumaEvent::Capped(fits)))?;
            settings.max_splats = fits;
        }
        Ok(demand)
    }

    /// The views that are looked at, by default a few of those that are measured, evenly
    /// spread.
    fn watched(&self) -> (&Arc<Dataset>, Vec<usize>) {
        if let Some((dataset, views)) = &self.watched {
            return (dataset, views.clone());
        }
        let measured = self.dataset.measured().1;
        let count = measured.len().min(WATCHED);
        let spread = (0..count).map(|k| measured[k * measured.len() / count]);
        (self.dataset, spread.collect())
    }
}

/// One Gaussian.
fn placeholder(sh_degree: u32) -> Splats {
    Splats {
        means: vec![[0.0; 3]],
        quats: vec![[1.0, 0.0, 0.0, 0.0]],
        log_scales: vec![[0.0; 3]],
        opacity_logits: vec![0.0],
        sh: ShField::zeros(1, sh_degree, 1),
    }
}

/// An error, if it is not to go on.
fn go_on(flow: ControlFlow<()>) -> Result<(), LumaError> {
    match flow {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(LumaError::Cancelled),
    }
}
