//! Solving for the colors, which can go on where it was interrupted.

use std::{ops::ControlFlow, time::Instant};

use serde_json::Value;

use super::open::{Coloring, Supervised};
use crate::{
    chroma::{
        ChromaCheckpoint, ChromaCheckpointing, ChromaSettings, Colored, Distill,
        NoChromaCheckpoints, SolverKind,
    },
    hash, input,
    report::{KernelReport, kernel_reports},
    run::RunError,
    store::{
        RunFolder, StoreError,
        checkpoints::{CheckpointFiles, Found, Journal, tell_given_up},
        files,
    },
    subject::{LiveCheckpoints, SceneKind},
    tell::{Event, Observer},
};

/// The colors.
pub(super) struct Solved {
    pub colored: Colored,
    /// Rows of the log.
    pub log: String,
    pub timings: Option<Vec<KernelReport>>,
    /// Beginning of the command, as if it had never been interrupted.
    pub begun: Instant,
}

impl Coloring<'_> {
    /// Solves for what was taught, a command that began at `begun`.
    pub fn solve(
        &self,
        supervised: &Supervised,
        begun: Instant,
        observe: &mut Observer<'_>,
    ) -> Result<Solved, RunError> {
        let (request, settings) = (self.request, &supervised.settings);
        let kept = self.kept();
        let total = match settings.solver {
            SolverKind::Irls => settings.rounds,
            SolverKind::Adam => settings.iterations,
        };
        let found = match request.checkpoints.resume {
            true => found_in(kept, observe)?,
            false => {
                if let Some(folder) = kept {
                    tell_given_up(&folder.color_checkpoint(), observe);
                }
                None
            }
        };
        let begun = found.as_ref().map_or(begun, Found::begun);
        let journal = &Journal::new(found.as_ref().map_or(String::new(), Found::log), observe);
        let checkpointing = kept.map(|folder| {
            let question = self.question(folder, settings, &supervised.taught.wanted)?;
            found.iter().try_for_each(|found| found.check(&question))?;
            let (path, checkpoints) = (folder.color_checkpoint(), &request.checkpoints);
            Ok::<_, StoreError>(CheckpointFiles::new(
                path,
                question,
                (),
                checkpoints,
                journal,
                begun,
            ))
        });
        let mut checkpointing = checkpointing.transpose()?;
        let checkpoint = found.as_ref().map(|found| &found.checkpoint);
        let rounds = [checkpoint.map_or(0, ChromaCheckpoint::rounds), total];
        let keeps: &mut dyn ChromaCheckpointing = match &mut checkpointing {
            Some(checkpointing) => checkpointing,
            None => &mut NoChromaCheckpoints,
        };
        let mut showing = LiveCheckpoints {
            checkpointing: keeps,
            live: request.live.as_deref(),
            luma: Some(&self.luma),
        };
        let distill = Distill {
            dataset: &self.dataset,
            supervision: &supervised.taught.supervision,
            sh_degree: request.sh_degree,
            correct_views: request.correct_views,
        };
        let colored = distill.color_gaussians(
            (&self.raster, &self.luma),
            checkpoint,
            &mut showing,
            settings,
            &mut |event| {
                self.tell(event, rounds, journal);
                ControlFlow::Continue(())
            },
        );
        checkpointing.map_or(Ok(()), CheckpointFiles::close)?;
        let colored = colored?;
        self.show(SceneKind::Color, &colored.splats);
        let timings = match request.timings {
            true => Some(kernel_reports(
                &self.gpu.timings()?,
                &colored.distilled.load,
            )),
            false => None,
        };
        Ok(Solved {
            colored,
            log: journal.rows(),
            timings,
            begun,
        })
    }

    /// Options and inputs of a coloring, for its checkpoints; `taught` is the supervision's hash.
    fn question(
        &self,
        folder: &RunFolder,
        settings: &ChromaSettings,
        taught: &str,
    ) -> Result<Value, StoreError> {
        let (luma, request) = (folder.luma(), self.request);
        let sha256 = input::open(&luma).and_then(hash::of_file);
        Ok(serde_json::json!({
            "program": env!("CARGO_PKG_VERSION"),
            "device": self.gpu.describe(),
            "luma": sha256.map_err(files::at(&luma))?,
            "taught": taught,
            "settings": settings,
            "degree": request.sh_degree,
            "correct-views": request.correct_views,
            "relight": request.relight,
        }))
    }
}

/// The checkpoint to go on from; none where there is none.
fn found_in(
    folder: Option<&RunFolder>,
    observe: &mut Observer<'_>,
) -> Result<Option<Found<(), ChromaCheckpoint>>, StoreError> {
    let path = folder.map(RunFolder::color_checkpoint);
    match path.filter(|path| path.exists()) {
        Some(path) => Found::read(&path, ChromaCheckpoint::from_sections).map(Some),
        None => {
            observe(Event::Note(
                "there is no checkpoint of a coloring: it starts over".to_owned(),
            ));
            Ok(None)
        }
    }
}

impl ChromaCheckpointing for CheckpointFiles<'_, '_, ()> {
    fn wants(&mut self) -> bool {
        self.is_due()
    }

    fn keep(&mut self, checkpoint: ChromaCheckpoint) -> bool {
        self.write(checkpoint.rounds(), &checkpoint.to_sections())
    }

    fn end(&mut self) {
        self.heed_no_more();
    }
}
