//! State of a training.

use std::sync::Arc;

use super::scores::Watch;
use crate::{
    capture::Exposure,
    effects::Plan,
    gpu::{Gpu, GpuError},
    luma::{
        DensifyRules, Goal, LumaError, LumaSettings, Schedule,
        loss::{LossEffects, Targets},
        memory::{Demand, ENTRIES_PER_SPLAT, resident_photos},
        pace::Pace,
        view::TrainingViews,
        workspace::{Kernels, Workspace},
    },
    raster::{Load, Model, Raster, RasterNumerics, constants::NEAR_SHARE},
    splats::{Splats, sh},
};

/// A run with time left takes at most so many times its iterations: beyond, a larger set
/// or larger photos would have been worth more.
const LONGER: usize = 3;

/// Says of a place, in the training's coordinates, whether Gaussians may be split there.
pub type Grows = Arc<dyn Fn([f32; 3]) -> bool + Send + Sync>;

/// Trains geometry and luma.
pub struct LumaTrainer {
    pub(super) raster: Arc<Raster>,
    pub(super) gpu: Gpu,
    pub(super) kernels: Kernels,
    pub(super) settings: LumaSettings,
    /// Schedule from the settings, as changed since.
    pub(super) schedule: Schedule,
    pub(super) goal: Goal,
    pub(super) extent: f64,
    pub(super) near: f64,
    pub(super) views: Arc<dyn TrainingViews>,
    pub(super) targets: Targets,
    pub(super) model: Model,
    /// None while a new one is made, which the old one would crowd out, or when there was
    /// no room for it.
    pub(super) workspace: Option<Workspace>,
    pub(super) demand: Demand,
    /// Iteration at which the present workspace began to count steps.
    pub(super) base: usize,
    pub(super) pace: Pace,
    /// Iterations that a run with time left may take.
    pub(super) longest: usize,
    pub(super) watch: Watch,
    /// Shell to draw behind the scene.
    pub(super) surroundings: Option<Splats>,
    /// Sums over the reports of what [`Self::load`] averages.
    pub(super) seen: Load,
    /// Reports.
    pub(super) reports: usize,
    /// Region in which Gaussians may be split, if not everywhere.
    pub(super) grows: Option<Grows>,
    /// Plan to store in checkpoints.
    pub(super) plan: Option<Plan>,
    /// Iterations and seconds that an interrupted training had done.
    pub(super) done: (usize, f64),
}

impl LumaTrainer {
    /// A trainer that starts from `splats` (one channel of the settings' degree).
    ///
    /// # Errors
    /// [`LumaError::Gpu`] when the adapter cannot hold it, [`LumaError::NoViews`], or what is
    /// wrong with a photo.
    pub fn new(
        raster: Arc<Raster>,
        settings: LumaSettings,
        extent: f64,
        splats: &Splats,
        views: impl TrainingViews + 'static,
    ) -> Result<Self, LumaError> {
        let views: Arc<dyn TrainingViews> = Arc::new(views);
        let all = 0..views.count();
        if all.is_empty() {
            return Err(LumaError::NoViews);
        }
        let raster = raster.drawing(settings.raster_options());
        let raster = raster.computing(RasterNumerics {
            signed_pulls: settings.rules == DensifyRules::Published,
            ..settings.numerics.raster
        });
        let gpu = raster.gpu.clone();
        let effects = LossEffects {
            exposed: (all.clone()).any(|view| views.exposure(view) != Exposure::NONE),
            masked: settings.robust || views.masked(),
        };
        let kernels = Kernels::new(&gpu, effects, settings.numerics.ssim_window);
        let near = NEAR_SHARE * extent;
        let schedule = Schedule::of(&settings);
        let demand = Demand::of(
            all.map(|view| views.camera(view)),
            effects.masked,
            splats.sh.degree,
            resident_photos(&settings),
        );
        let longest = LONGER * settings.iterations;
        let capacity = splats.len() * ENTRIES_PER_SPLAT;
        demand.check(settings.memory_limit, splats.len(), capacity)?;
        let targets = Targets::new(&gpu, effects, &views, demand.max_pixels, demand.streams)?;
        let model = Model::upload(&gpu, splats)?;
        let workspace = Workspace::new(&raster, &kernels, &model, &targets, &demand, capacity)?;
        Ok(Self {
            raster,
            gpu,
            kernels,
            settings,
            schedule,
            goal: Goal::Fixed,
            extent,
            near,
            views,
            targets,
            model,
            workspace: Some(workspace),
            demand,
            base: 0,
            pace: Pace::default(),
            longest,
            watch: Watch::default(),
            surroundings: None,
            seen: Load::default(),
            reports: 0,
            grows: None,
            plan: None,
            done: (0, 0.0),
        })
    }

    /// Trains towards `goal` instead of to the end of the schedule.
    pub fn aim(&mut self, goal: Goal) {
        self.goal = goal;
    }

    /// Splits Gaussians only where that is `true` of their centers; others are trained all the
    /// same.
    pub fn grow_in(&mut self, grows: Option<Grows>) {
        self.grows = grows;
    }

    /// Trains by another schedule than that of its settings.
    pub fn follow(&mut self, schedule: Schedule) {
        self.schedule = schedule;
    }

    /// Settings of the training.
    pub fn settings(&self) -> &LumaSettings {
        &self.settings
    }

    /// When things happen; once it is trained, when they did.
    pub fn schedule(&self) -> &Schedule {
        &self.schedule
    }

    /// Number of surroundings, the last of the Gaussians.
    pub fn surroundings(&self) -> usize {
        self.model.held
    }

    /// Reads the Gaussians.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn splats(&self) -> Result<Splats, GpuError> {
        self.model.download(&self.gpu)
    }

    /// Mean load of an iteration, over the reports.
    pub fn load(&self) -> Load {
        let mean = |sum: f64| sum / self.reports.max(1) as f64;
        let count = self.views.count();
        let pixels = (0..count).map(|view| {
            let camera = self.views.camera(view);
            f64::from(camera.width) * f64::from(camera.height)
        });
        Load {
            splats: mean(self.seen.splats),
            visible: mean(self.seen.visible),
            instances: mean(self.seen.instances),
            capacity: mean(self.seen.capacity),
            pixels: pixels.sum::<f64>() / count as f64,
            tiles: self.demand.max_tiles as f64,
            channels: 1.0,
            sh_planes: sh::coefficient_count(self.model.field.degree) as f64,
            numerics: self.raster.numerics(),
        }
    }

    /// # Errors
    /// [`GpuError::NoWorkspace`] after one could not be made.
    pub(super) fn workspace(&self) -> Result<&Workspace, GpuError> {
        self.workspace.as_ref().ok_or(GpuError::NoWorkspace)
    }
}
