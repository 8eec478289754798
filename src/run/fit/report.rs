//! The report of `fit`.

use super::{
    Init,
    training::{Job, Trained},
};
use crate::{
    capture::Dataset,
    effects::{Effect, Plan},
    report::{
        CaptureReport, DeviceReport, EffectReport, LumaReport, LumaSeconds, REPORT_VERSION, Report,
        ViewExposure,
    },
    run::Preset,
    store::files,
};

impl Job<'_> {
    /// The report of a training by a preset.
    pub fn report(&self, preset: Preset, trained: &Trained) -> Report {
        let (options, scene) = (self.options, &trained.scene);
        let (last, [trial, preparing, train, curve]) = (scene.last, scene.seconds);
        Report {
            version: REPORT_VERSION,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            capture: CaptureReport {
                photos: self.photos.to_vec(),
                ..CaptureReport::of(&options.colmap_dir, self.dataset)
            },
            device: DeviceReport::of(self.gpu),
            preset,
            effects: EffectReport::of(&scene.plan.decisions),
            warnings: Vec::new(),
            files: Vec::new(),
            luma: LumaReport {
                settings: scene.settings.clone(),
                iterations: scene.iterations + options.init.as_ref().map_or(0, Init::iterations),
                given_up: scene.given_up,
                splats: scene.splats.len(),
                surroundings: scene.surroundings,
                around: (options.around.as_ref()).map(|neighbors| neighbors.sha256.clone()),
                plan: (options.block.as_ref()).map(|block| block.plan_sha256().to_owned()),
                poisoned: last.map_or(0, |progress| progress.poisoned),
                refused: last.map_or(0, |progress| progress.refused),
                loss: last.map_or(0.0, |progress| progress.loss),
                goal: options.goal,
                seconds: LumaSeconds {
                    load: self.loading + preparing,
                    trial,
                    train,
                    curve,
                    measure: trained.measuring,
                    all: self.begun.elapsed().as_secs_f64(),
                },
                peak_host_memory: files::peak_host_memory(),
                peak_device_memory: scene.peak_device_memory,
                estimated_device_memory: scene.estimated_device_memory,
                exposures: exposures(self.dataset, &scene.plan),
                curve: scene.curve.clone(),
                curve_on: self.dataset.measured().0.to_owned(),
                measured_side: options.measure_side,
                held_out: trained.held_out(),
                held_out_views: trained.held_out_views.clone(),
                timings: trained.timings.clone(),
            },
            chroma: None,
        }
    }
}

/// Exposures for the report; empty if the effect is off.
fn exposures(dataset: &Dataset, plan: &Plan) -> Vec<ViewExposure> {
    let all = dataset.capture.views.iter().zip(&plan.exposures);
    all.filter(|_| plan.has(Effect::Exposure))
        .map(|(view, &exposure)| ViewExposure {
            name: view.name.clone(),
            exposure,
        })
        .collect()
}
