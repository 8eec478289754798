//! The files of colors that were found.

use std::path::Path;

use super::{open::Coloring, solve::Solved};
use crate::{
    eval::COLUMNS,
    report::{Report, Row, contact_sheet},
    run::RunError,
    splats::{npy, write_splats},
    store::{commit::Commit, files, fingerprint::of_file, log::with_rows},
    tell::{Event, Observer},
};

impl Coloring<'_> {
    /// Writes them: into the run folder, if one is colored, all or none; what was measured of
    /// other colors goes.
    pub fn commit(
        &self,
        solved: &Solved,
        rows: &[Row],
        report: &mut Report,
        observe: &mut Observer<'_>,
    ) -> Result<(), RunError> {
        let splats = &solved.colored.splats;
        let mut write_scene = |path: &Path| {
            let doubts = write_splats(path, splats, &self.written)?;
            let doubts = doubts.into_iter().map(Event::Warning);
            doubts.for_each(&mut *observe);
            Ok::<_, RunError>(())
        };
        let Some(folder) = self.kept() else {
            return write_scene(&self.output.ply);
        };
        let mut commit = Commit::new(folder.path())?;
        commit.remove(&folder.color_checkpoint());
        if self.output.contact_sheet.is_none() {
            // The run's own files tell of the run's own colors.
            write_scene(&self.output.ply)?;
            return Ok(commit.finish()?);
        }
        let [color, chroma] = [folder.color(), folder.chroma()].map(|path| commit.place(&path));
        write_scene(&color)?;
        files::write(&chroma, &npy::encode(&solved.colored.distilled.chroma))?;
        let mut known = report.files.iter();
        let luma = known.find(|file| folder.luma().ends_with(&file.name));
        let luma = luma.cloned().map_or_else(|| of_file(&folder.luma()), Ok)?;
        report.files = vec![luma, of_file(&color)?, of_file(&chroma)?];
        commit.remove(&folder.evaluation());
        commit.remove_page(&folder.evaluation_page());
        let log = with_rows(&folder.log(), report.luma.iterations, &solved.log);
        files::write(&commit.place(&folder.log()), log.as_bytes())?;
        let sheet = contact_sheet(&COLUMNS, rows);
        files::write_png(&commit.place(&folder.contact_sheet()), &sheet)?;
        files::write(&commit.place(&folder.report()), &report.to_file())?;
        Ok(commit.finish()?)
    }
}
