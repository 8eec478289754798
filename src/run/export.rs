//! `export`: a run's scene, or the Gaussians of a file, as a splat file of any format.

use std::{cell::RefCell, fs, path::PathBuf, time::Instant};

use glam::DVec3;
use serde::Serialize;

use super::{
    Cleaned, Loss, RunError, ViewerCameras,
    export_clean::cleaned,
    export_viewer::{Cameras, fitted},
    loss::{Views, loss},
};
use crate::{
    raster::{RasterOptions, plain},
    splats::{Splats, WriteOptions, write_splats},
    store::{files, originals::OriginalFiles},
    subject::{LockMode, Opened, Scene, scene::written_as},
    tell::{Event, Observer, Stage, keeping},
    viewers::ViewerChoice,
};

/// The share of the Gaussians' size that the steps of 32-bit floats may have: shifts by half
/// of it are not seen.
const COARSE: f64 = 0.1;

#[derive(Clone, Debug, Default)]
pub struct ExportOptions {
    /// Run folder or splat file; the newest run by default.
    pub run: Option<PathBuf>,
    /// The splat file, whose name tells the format.
    pub output: PathBuf,
    /// Write the luma although the scene is colored.
    pub luma: bool,
    /// True if centers stay in COLMAP's coordinates even if the scene was moved to the origin.
    pub colmap_coordinates: bool,
    /// True if Gaussians that no training view needs are removed.
    pub clean: bool,
    /// Viewer to fit the scene for; `None` writes it unchanged.
    pub viewer: Option<ViewerChoice>,
    /// True if an antialiased scene is written for viewers that antialias.
    pub antialiased: bool,
    /// COLMAP folder with the cameras that it is cleaned and fitted before, where it is not the
    /// one that `fit` noted.
    pub colmap: Option<PathBuf>,
}

/// Result of `export`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Exported {
    /// File that was written.
    pub file: PathBuf,
    /// Number of Gaussians.
    pub splats: usize,
    /// Bytes of the file.
    pub bytes: u64,
    /// Seconds that writing took.
    pub seconds: f64,
    /// Offset subtracted from COLMAP's coordinates, in world units; zero if none.
    pub offset: [f64; 3],
    /// True if the file stores the offset.
    pub tells_offset: bool,
    /// Loss of the format.
    pub loss: Loss,
    /// Removed Gaussians, if cleaning was requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cleaned: Option<Cleaned>,
    /// PSNR in each viewer, if the scene was fitted.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub shown: Vec<ViewerCameras>,
    /// Doubts about the file.
    pub warnings: Vec<String>,
}

/// Writes a run's scene, or the Gaussians of a file, as a splat file, reads it back and measures
/// what that costs. Where COLMAP's coordinates are so large that `fit` moved the scene to the
/// origin, it stays there and the file says so if its format can, unless COLMAP's are asked for.
///
/// # Errors
/// [`RunError`]; [`RunError::Coarse`] where COLMAP's coordinates would spoil the scene.
pub fn export(options: &ExportOptions, observe: &mut Observer<'_>) -> Result<Exported, RunError> {
    let warnings = RefCell::default();
    let observe = &mut keeping(&warnings, observe);
    let output = options.output.as_path();
    let format = files::format_of(output)?;
    observe(Event::begins(Stage::Model));
    let opened = Opened::find(options.run.as_deref(), LockMode::Free)?;
    let _kept = opened.keep(OriginalFiles::default()).keep();
    let mut scene = opened.read(options.luma, None, observe)?;
    if opened
        .report()
        .is_some_and(|report| report.capture.panorama)
    {
        observe(Event::Note(
            "the scene is a panorama without depth: it is right from its camera's place only"
                .to_owned(),
        ));
    }
    files::make_folder_of(output)?;
    let before = &Cameras {
        opened: &opened,
        colmap: options.colmap.as_deref(),
        moved: scene.offset,
    };
    let drawn = scene.drawn;
    let mut left_out = None;
    if options.clean {
        let all = (&scene.splats, drawn, scene.surroundings);
        let (clean, found) = cleaned(all, before, observe)?;
        (scene.splats, left_out) = (clean, Some(found));
    }
    let mut shown = Vec::new();
    if let Some(choice) = options.viewer {
        (scene.splats, shown) = fitted(choice, (&scene.splats, drawn), before, observe)?;
        // As these viewers draw it.
        scene.drawn = RasterOptions::default();
    } else if scene.drawn.antialiased && !options.antialiased && opened.report().is_some() {
        plainly(&mut scene, before, observe);
    }
    let written = written(&scene, options)?;

    observe(Event::begins(Stage::Saving));
    let begun = Instant::now();
    let doubts = write_splats(output, &scene.splats, &written)?;
    let seconds = begun.elapsed().as_secs_f64();
    doubts
        .into_iter()
        .for_each(|doubt| observe(Event::Warning(doubt)));
    let bytes = fs::metadata(output).map_err(files::at(output))?.len();

    let wrote = (output, &written);
    let views = (opened.report()).map_or(Views::MadeUp, |report| Views::of_run(&report.capture));
    let loss = loss(&scene.splats, scene.drawn, &views, wrote, observe)?;
    Ok(Exported {
        file: output.to_owned(),
        splats: scene.splats.len(),
        bytes,
        seconds,
        offset: written.offset.to_array(),
        tells_offset: format.tells_offset(),
        loss,
        cleaned: left_out,
        shown,
        warnings: warnings.take(),
    })
}

/// Gives an antialiased scene opacities for viewers without antialiasing, where the cameras are
/// known.
fn plainly(scene: &mut Scene, before: &Cameras<'_>, observe: &mut Observer<'_>) {
    match before.open(usize::MAX, u32::MAX) {
        Ok((train, _, extent)) => {
            scene.splats = plain(&scene.splats, &train, extent);
            scene.drawn = RasterOptions::default();
        }
        Err(_) => observe(Event::Warning(
            "the scene is written to be drawn antialiased, since its cameras are not known: most viewers will draw it too bold".to_owned(),
        )),
    }
}

/// Coordinates that the scene is written in.
fn written(scene: &Scene, options: &ExportOptions) -> Result<WriteOptions, RunError> {
    let (added, left) = match options.colmap_coordinates {
        true => (scene.offset, DVec3::ZERO),
        false => (DVec3::ZERO, scene.offset),
    };
    let (size, largest) = (median_size(&scene.splats), added.abs().max_element());
    let step = step_at(largest);
    if added != DVec3::ZERO && step > COARSE * size {
        return Err(RunError::Coarse {
            path: options.output.clone(),
            coordinate: largest,
            step,
            size,
        });
    }
    Ok(WriteOptions {
        added,
        ..written_as(scene.drawn, left)
    })
}

/// Spacing of 32-bit floats at a coordinate.
fn step_at(coordinate: f64) -> f64 {
    let below = coordinate as f32;
    f64::from(below.next_up()) - f64::from(below)
}

/// The median of the Gaussians' smallest standard deviations, in world units; infinite without
/// any.
fn median_size(splats: &Splats) -> f64 {
    let smallest = |scales: &[f32; 3]| scales.iter().copied().fold(f32::INFINITY, f32::min);
    let mut sizes: Vec<f32> = splats.log_scales.iter().map(smallest).collect();
    let middle = sizes.len() / 2;
    if sizes.is_empty() {
        return f64::INFINITY;
    }
    f64::from(*sizes.select_nth_unstable_by(middle, f32::total_cmp).1).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_floats() {
        assert_eq!(step_at(5_412_345.0), 0.5);
        assert_eq!(step_at(3_000.25), 2f64.powi(-12));
    }

    #[test]
    fn the_median_of_the_smallest_scales() {
        let mut splats = Splats {
            log_scales: vec![[0.0, -1.0, 2.0], [-3.0, 5.0, 0.0], [-2.0, -2.0, 7.0]],
            ..Splats::default()
        };
        assert_eq!(median_size(&splats), (-2f64).exp());
        splats.log_scales.clear();
        assert_eq!(median_size(&splats), f64::INFINITY);
    }
}
