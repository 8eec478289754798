//! Names of a run's files.

use std::path::Path;

use super::{StoreError, files};
use crate::disk::trust;

/// Files and folders of a run that commands write together.
pub(crate) const ENTRIES: [&str; 10] = [
    "luma.ply",
    "color.ply",
    "chroma.npy",
    "report.json",
    "log.csv",
    "contact-sheet.png",
    "eval.json",
    "eval",
    "checkpoint",
    "checkpoint-color",
];

/// The folder of the teacher's answers.
pub(super) const TEACHER: &str = "teacher";

/// The folder of what was painted.
pub(super) const PAINT: &str = "paint";

/// Refuses a run whose files are elsewhere: a folder may come from somebody else.
///
/// # Errors
/// [`StoreError::File`] with the link.
pub(super) fn check_links(folder: &Path) -> Result<(), StoreError> {
    for name in ENTRIES.into_iter().chain([TEACHER, PAINT]) {
        let path = folder.join(name);
        trust::check_inside(folder, &path).map_err(files::at(&path))?;
    }
    Ok(())
}
