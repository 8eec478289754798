//! `fit RUN`: a finished training goes on.

use std::{fs, path::Path};

use super::{BlockPlace, FitRequest, Init, request::decided};
use crate::{effects::Overrules, luma::LumaOverlay, run::RunError, store::RunFolder};

impl FitRequest {
    /// Request to continue a finished run: the same photos, effects and settings, from its
    /// Gaussians, with its final learning rates, for as many iterations again; `None` if the folder
    /// is not a run.
    ///
    /// # Errors
    /// [`StoreError::File`] where the run's report is damaged.
    pub fn continuing(run: &Path) -> Result<Option<Self>, RunError> {
        let folder = RunFolder::find(Some(run))?;
        if !(folder.report().exists() && folder.luma().exists()) {
            return Ok(None);
        }
        let report = folder.read_report()?;
        let mut settings = report.luma.settings.clone();
        let [_, last] = settings.rates.means;
        settings.rates.means = [last; 2];
        Ok(Some(Self {
            output: Some(folder.path().to_owned()),
            preset: Some(report.preset),
            settings: LumaOverlay {
                settings: Some(settings),
                ..LumaOverlay::default()
            },
            overrules: Overrules {
                sh_degree: Some(report.luma.settings.sh_degree),
                ..decided(&report.effects, &[])
            },
            load: report.capture.load,
            measure_side: report.luma.measured_side,
            block: BlockPlace::read(folder.path())?,
            init: Some(Init::Run {
                folder,
                iterations: report.luma.iterations,
                surroundings: report.luma.surroundings,
            }),
            ..Self::new(
                fs::canonicalize(&report.capture.path).unwrap_or(report.capture.path.into()),
            )
        }))
    }
}
