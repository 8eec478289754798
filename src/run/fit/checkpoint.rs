//! Checkpoints of a training.

use std::path::PathBuf;

use serde_json::Value;

use super::{FitRequest, Init, budget::Budget};
use crate::{
    capture::LoadOptions,
    gpu::Gpu,
    hash, input,
    luma::{Checkpoint, Checkpointing},
    run::RunError,
    store::{
        RunFolder, StoreError,
        checkpoints::{CheckpointFiles, Found},
        files,
    },
    tell::{Event, Observer},
};

/// A training that was interrupted.
pub(super) type FoundTraining = Found<Budget, Checkpoint>;

/// The checkpoint to go on from; none where there never was one.
///
/// # Errors
/// As [`Found::read`], and [`RunError::NothingToResume`] where a run ended as it should.
pub(super) fn found_in(
    folder: &RunFolder,
    observe: &mut Observer<'_>,
) -> Result<Option<FoundTraining>, RunError> {
    let path = folder.checkpoint();
    if path.exists() {
        return Ok(Some(Found::read(&path, Checkpoint::from_sections)?));
    }
    if folder.report().exists() {
        return Err(RunError::NothingToResume(folder.path().to_owned()));
    }
    observe(Event::Note(format!(
        "{} does not exist: training starts over",
        path.display()
    )));
    Ok(None)
}

/// Options and inputs of a run, to compare with those of a checkpoint.
pub(super) fn question(
    options: &FitRequest,
    budget: &Budget,
    load: &LoadOptions,
    gpu: &Gpu,
    photos: &str,
) -> Result<Value, StoreError> {
    let init = options.init.as_ref().map(Init::path).map(sha256_of);
    let mut question = serde_json::json!({
        "program": env!("CARGO_PKG_VERSION"),
        "device": gpu.describe(),
        "photos": photos,
        "preset": budget.preset,
        "settings": budget.work.settings,
        "load": load,
        "effects": options.overrules,
        "goal": options.goal,
        "measure-side": options.measure_side,
        "init": init.transpose()?,
    });
    if let Some(block) = &options.block {
        let coarse = block.coarse().map(sha256_of).transpose()?;
        question["block"] = serde_json::json!(block.plan());
        question["coarse"] = serde_json::json!(coarse);
    }
    if let Some(neighbors) = &options.around {
        question["around"] = serde_json::json!(neighbors.sha256);
    }
    Ok(question)
}

/// The SHA-256 of a file.
pub(super) fn sha256_of(path: PathBuf) -> Result<String, StoreError> {
    let sha256 = input::open(&path).and_then(hash::of_file);
    sha256.map_err(files::at(&path))
}

impl Checkpointing for CheckpointFiles<'_, '_, Budget> {
    fn wants(&mut self, _: usize) -> bool {
        self.is_due()
    }

    fn keep(&mut self, checkpoint: Checkpoint) -> bool {
        self.write(checkpoint.iteration(), &checkpoint.to_sections())
    }
}
