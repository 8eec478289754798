//! The report of `fit`.

use std::path::Path;

use super::super::{Preset, files};
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
                ..capture_report(&options.colmap_dir, self.dataset)
            },
            device: DeviceReport {
                name: self.gpu.describe(),
                backend: format!("{:?}", self.gpu.info().backend),
                software: self.gpu.is_software(),
            },
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

/// What a report says about exposures: nothing where they are alike.
fn exposures(dataset: &Dataset, plan: &Plan) -> Vec<ViewExposure> {
    let all = dataset.capture.views.iter().zip(&plan.exposures);
    all.filter(|_| plan.has(Effect::Exposure))
        .map(|(view, &exposure)| ViewExposure {
            name: view.name.clone(),
            exposure,
        })
        .collect()
}

/// What a report says about the photos.
pub(in crate::run) fn capture_report(colmap_dir: &Path, dataset: &Dataset) -> CaptureReport {
    let capture = &dataset.capture;
    let path = std::fs::canonicalize(colmap_dir).unwrap_or_else(|_| colmap_dir.to_owned());
    CaptureReport {
        path: path.to_string_lossy().into_owned(),
        views: capture.views.len(),
        train: dataset.split.train.len(),
        test: dataset.split.test.len(),
        points: capture.points.len(),
        rejected: capture
            .rejected
            .iter()
            .map(|rejected| format!("{}: {}", rejected.name, rejected.reason))
            .collect(),
        load: dataset.options.clone(),
        masked_views: dataset.masked_views,
        not_finite: dataset.not_finite(),
        extent: dataset.extent,
        offset: capture.offset.to_array(),
        photos: Vec::new(),
    }
}
