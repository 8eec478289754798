//! The report of a coloring.

use std::fs;

use super::{
    open::{Coloring, Supervised},
    solve::Solved,
};
use crate::{
    eval::Measured,
    report::{
        CaptureReport, ChromaReport, ChromaSeconds, DeviceReport, EffectReport, REPORT_VERSION,
        Report,
    },
    store::files,
};

impl Coloring<'_> {
    /// The run's report with what was found, but for warnings and seconds; one of a splat file
    /// knows its photos and its colors.
    pub fn report(&self, supervised: &Supervised, solved: &Solved, measured: &Measured) -> Report {
        let chroma = Some(self.chroma(supervised, solved, measured));
        let luma = self.trained.clone();
        match self.opened.report() {
            Some(report) => Report {
                luma,
                chroma,
                ..report.clone()
            },
            None => Report {
                version: REPORT_VERSION,
                program: env!("CARGO_PKG_VERSION").to_owned(),
                capture: CaptureReport::of(&self.colmap, &self.dataset),
                device: DeviceReport::of(&self.gpu),
                preset: self.preset,
                effects: Vec::new(),
                warnings: Vec::new(),
                files: Vec::new(),
                luma,
                chroma,
            },
        }
    }

    fn chroma(
        &self,
        supervised: &Supervised,
        solved: &Solved,
        measured: &Measured,
    ) -> ChromaReport {
        let (colored, supervision) = (&solved.colored, &supervised.taught.supervision);
        let (teach, split) = (&self.request.teach, &self.dataset.split);
        let [distill, bake] = colored.seconds;
        let last = colored.distilled.last;
        let steps = last.map_or(0, |progress| progress.iteration);
        let painted = supervision.painted_held_out(split);
        let name = |view: usize| self.dataset.capture.views[view].name.clone();
        ChromaReport {
            teachers: self.teachers.describe(),
            strength: teach.strength,
            upsample: teach.settings.upsample,
            teacher_profile: teach.settings.profile.clone().map(|profile| {
                let manifest = profile
                    .ends_with(".toml")
                    .then(|| fs::canonicalize(&profile));
                let path = manifest.and_then(|found| found.ok()?.to_str().map(str::to_owned));
                path.unwrap_or(profile)
            }),
            teacher_size: teach.settings.size,
            teacher_class: teach.settings.class,
            hints: supervised.taught.hinted,
            hint_folder: teach.hints.as_ref().and_then(|folder| {
                let found = folder.canonicalize();
                let path = found.as_ref().unwrap_or(folder);
                path.to_str().map(str::to_owned)
            }),
            claimed: colored.distilled.claimed,
            painted_held_out: painted.into_iter().map(name).collect(),
            colored_views: colored.distilled.colored_views,
            unseen: self.unseen(colored),
            saturation: colored.distilled.saturation,
            iterations: steps,
            until: self.trained.iterations + steps,
            passes: last.map_or(0.0, |progress| progress.passes),
            moved: last.and_then(|progress| progress.moved),
            effects: EffectReport::of(&colored.distilled.effects),
            warnings: Vec::new(),
            loss: last.map_or(0.0, |progress| progress.loss),
            seconds: ChromaSeconds {
                distill,
                bake,
                ..ChromaSeconds::default()
            },
            peak_host_memory: files::peak_host_memory(),
            peak_device_memory: colored.peak_device_memory,
            estimated_device_memory: colored.estimated_device_memory,
            pinned_views: colored.pinned_views,
            splats_at_a_time: colored.splats_at_a_time,
            settings: colored.distilled.settings.clone(),
            bake: measured.bake,
            measured_on: supervision.measured(split).0.to_owned(),
            pictures: measured.mean(),
            views: measured.views.clone(),
            timings: solved.timings.clone(),
        }
    }
}
