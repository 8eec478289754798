//! The files of colors that were found.

use std::path::{Path, PathBuf};

use super::{
    Event, Observer, RunError, RunFolder, commit::Commit, files, fingerprint::of_file,
    log::with_rows,
};
use crate::{
    eval::COLUMNS,
    report::{Report, Row, contact_sheet},
    splats::{ShField, Splats, WriteOptions, npy, write_splats},
};

/// What `colorize` wrote.
#[derive(Clone, Debug)]
pub struct Output {
    /// The colored splat file, of any format.
    pub ply: PathBuf,
    /// The contact sheet, when a run was colored.
    pub contact_sheet: Option<PathBuf>,
}

/// What is written.
pub(super) struct ColorFiles<'a> {
    /// The colored scene.
    pub splats: &'a Splats,
    /// The a/b harmonics that it is made from.
    pub chroma: &'a ShField,
    /// Pictures of the contact sheet.
    pub rows: &'a [Row],
    /// Rows of the log.
    pub log: &'a str,
    /// How the scene is written.
    pub written: &'a WriteOptions,
}

impl ColorFiles<'_> {
    /// Writes them: into the run folder, if one is colored, all or none; what was measured of
    /// other colors goes.
    ///
    /// # Errors
    /// [`RunError`] of a file.
    pub fn write(
        &self,
        folder: Option<&RunFolder>,
        output: &Output,
        report: &mut Report,
        observe: &mut Observer<'_>,
    ) -> Result<(), RunError> {
        let Some(folder) = folder else {
            return self.write_scene(&output.ply, observe);
        };
        let mut commit = Commit::new(folder.path())?;
        commit.remove(&folder.color_checkpoint());
        if output.contact_sheet.is_some() {
            let (color, chroma) = (folder.color(), folder.chroma());
            let [color, chroma] = [color, chroma].map(|path| commit.place(&path));
            self.write_scene(&color, observe)?;
            files::write(&chroma, &npy::encode(self.chroma))?;
            let luma = report
                .files
                .iter()
                .find(|file| folder.luma().ends_with(&file.name));
            let luma = luma.cloned().map_or_else(|| of_file(&folder.luma()), Ok)?;
            report.files = vec![luma, of_file(&color)?, of_file(&chroma)?];
            commit.remove(&folder.evaluation());
            commit.remove_page(&folder.evaluation_page());
            let log = with_rows(&folder.log(), report.luma.iterations, self.log);
            files::write(&commit.place(&folder.log()), log.as_bytes())?;
            let sheet = contact_sheet(&COLUMNS, self.rows);
            files::write_png(&commit.place(&folder.contact_sheet()), &sheet)?;
            files::write(&commit.place(&folder.report()), &report.to_file())?;
        } else {
            // The run's own files tell of the run's own colors.
            self.write_scene(&output.ply, observe)?;
        }
        commit.finish()
    }

    fn write_scene(&self, path: &Path, observe: &mut Observer<'_>) -> Result<(), RunError> {
        for doubt in write_splats(path, self.splats, self.written)? {
            observe(Event::Warning(doubt));
        }
        Ok(())
    }
}
