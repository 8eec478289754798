//! What is measured: a run with its scene, its luma and its colours.

use std::path::PathBuf;

use super::EvalOptions;
use crate::{
    capture::{Dataset, Exposure, Photo},
    report::Report,
    run::{
        Event, Observer, RunError, RunFolder,
        scene::{open, read_splats},
        yardstick::{Yardstick, exposures},
    },
    splats::{ShField, Splats},
};

/// A coloured run.
pub(super) struct Subject {
    pub folder: RunFolder,
    pub report: Report,
    pub dataset: Dataset,
    /// How bright each view's photo shows the scene.
    pub exposures: Vec<Exposure>,
    /// Geometry and luma.
    pub luma: Splats,
    /// Native a/b, where the run has them.
    pub chroma: Option<ShField>,
    /// RGB of the exported file.
    pub exported: ShField,
}

impl Subject {
    pub fn load(options: &EvalOptions, observe: &mut Observer<'_>) -> Result<Self, RunError> {
        let folder = match &options.run {
            Some(path) => RunFolder::at(path),
            None => RunFolder::newest()?,
        };
        let report = folder.read_report()?;
        let refused = |path: PathBuf, reason: &str| RunError::File {
            path,
            reason: format!("{reason}: run `gs-chroma colorize` first"),
        };
        let color = folder.color();
        if !color.exists() {
            return Err(refused(color, "the run is not coloured yet"));
        }
        // A run's own files are moved already.
        let offset = glam::DVec3::ZERO;
        let luma = read_splats(&folder.luma(), offset, observe)?.0.to_luma();
        let exported = read_splats(&color, offset, observe)?.0;
        if exported.means != luma.means || exported.sh.channels != 3 {
            return Err(refused(color, "its Gaussians are not those of luma.ply"));
        }
        let chroma = folder.read_chroma(luma.len())?;
        if chroma.is_none() {
            observe(Event::Note(format!(
                "{} is missing: the native picture is not measured; `gs-chroma colorize` writes it",
                folder.chroma().display()
            )));
        }
        let colmap = match &options.colmap {
            Some(path) => path.clone(),
            None => PathBuf::from(&report.capture.path),
        };
        let dataset = open(&colmap, &report.capture.load, observe)?;
        Ok(Self {
            exposures: exposures(&dataset, &report.luma.exposures),
            folder,
            report,
            dataset,
            luma,
            chroma,
            exported: exported.sh,
        })
    }

    /// The photo of a view, to hold pictures of it against.
    pub fn yardstick<'a>(&self, view: usize, photo: &'a Photo) -> Yardstick<'a> {
        Yardstick {
            photo,
            exposure: self.exposures[view],
        }
    }

    /// The name of the photos' folder.
    pub fn name(&self) -> String {
        let root = &self.dataset.capture.root;
        let name = root.canonicalize().ok();
        let name = name.as_ref().unwrap_or(root).file_name();
        name.map_or("scene".into(), |n| n.to_string_lossy())
            .into_owned()
    }
}
