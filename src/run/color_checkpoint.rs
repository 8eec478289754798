//! Checkpoints of a coloring.

use serde_json::Value;

use super::{
    ColorizeOptions, Event, Observer, RunError, RunFolder,
    checkpoints::{FileKeeper, Found},
    files,
};
use crate::{
    chroma::{ChromaCheckpoint, ChromaKeeper, ChromaSettings},
    gpu::Gpu,
    hash, input,
};

/// The checkpoint to go on from; none where there is none.
///
/// # Errors
/// As [`Found::read`].
pub(super) fn found_in(
    folder: Option<&RunFolder>,
    observe: &mut Observer<'_>,
) -> Result<Option<Found<(), ChromaCheckpoint>>, RunError> {
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

/// What a coloring is asked for and given; `taught` is a hash of what the teachers want.
///
/// # Errors
/// [`RunError::File`] of the gray Gaussians.
pub(super) fn question(
    folder: &RunFolder,
    options: &ColorizeOptions,
    settings: &ChromaSettings,
    gpu: &Gpu,
    taught: &str,
) -> Result<Value, RunError> {
    let luma = folder.luma();
    let luma = input::open(&luma)
        .and_then(hash::of_file)
        .map_err(files::at(&luma))?;
    Ok(serde_json::json!({
        "program": env!("CARGO_PKG_VERSION"),
        "device": gpu.describe(),
        "luma": luma,
        "taught": taught,
        "settings": settings,
        "degree": format!("{:?}", options.sh_degree),
        "correct-views": options.correct_views,
        "relight": options.relight,
    }))
}

impl ChromaKeeper for FileKeeper<'_, ()> {
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
