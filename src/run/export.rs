//! `export`: a run's scene as a splat file.

use std::path::PathBuf;

use glam::DVec3;

use super::{
    Event, Observer, RunError, RunFolder, Shown, Stage, export_viewer::fitted, files,
    scene::comments_of_moved,
};
use crate::{
    raster::RasterOptions,
    splats::{Splats, ply},
    viewers::ViewerChoice,
};

/// The share of the Gaussians' size that the steps of 32-bit floats may have: shifts by half
/// of it are not seen.
const COARSE: f64 = 0.1;

/// What `export` is asked to do.
#[derive(Clone, Debug)]
pub struct ExportOptions {
    /// Run folder; the newest run by default.
    pub run: Option<PathBuf>,
    /// The splat file.
    pub output: PathBuf,
    /// Write the luma although the scene is colored.
    pub luma: bool,
    /// Whether centers are COLMAP's even where the scene was moved to the origin.
    pub colmap_coordinates: bool,
    /// Whom it is fitted for; without, it is what the run has.
    pub viewer: Option<ViewerChoice>,
    /// COLMAP folder with the cameras that it is fitted before, where it is not the one that
    /// `fit` noted.
    pub colmap: Option<PathBuf>,
}

/// What `export` wrote.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// Gaussians.
    pub splats: usize,
    /// What is subtracted from COLMAP's coordinates, in world units; zero where nothing is.
    pub offset: [f64; 3],
    /// What each viewer shows of it, where it was fitted to any.
    pub shown: Vec<Shown>,
}

/// Writes a run's scene as a splat file. Where COLMAP's coordinates are so large that `fit`
/// moved the scene to the origin, it stays there and a comment in the header has the offset,
/// unless COLMAP's are asked for.
///
/// # Errors
/// [`RunError`]; [`RunError::Coarse`] where COLMAP's coordinates would spoil the scene.
pub fn export(options: &ExportOptions, observe: &mut Observer<'_>) -> Result<Exported, RunError> {
    let folder = match &options.run {
        Some(path) => {
            ply::is_splat_file(path)?;
            RunFolder::at(path)
        }
        None => RunFolder::newest()?,
    };
    let report = folder.read_report()?;
    let colored = !options.luma && folder.color().exists();
    let file = if colored {
        folder.color()
    } else {
        folder.luma()
    };
    let splats = ply::read_ply(&file)?.splats;
    let moved = DVec3::from(report.capture.offset);
    let (added, left) = match options.colmap_coordinates {
        true => (moved, DVec3::ZERO),
        false => (DVec3::ZERO, moved),
    };
    let (size, largest) = (median_size(&splats), added.abs().max_element());
    let step = step_at(largest);
    if added != DVec3::ZERO && step > COARSE * size {
        return Err(RunError::Coarse {
            path: options.output.clone(),
            coordinate: largest,
            step,
            size,
        });
    }
    files::make_folder_of(&options.output)?;
    let (splats, drawn, shown) = match options.viewer {
        None => (splats, report.luma.settings.raster_options(), Vec::new()),
        Some(choice) => {
            let colmap = options.colmap.as_deref();
            let (splats, shown) = fitted(choice.viewers(), &splats, &report, colmap, observe)?;
            // As these viewers draw it.
            (splats, RasterOptions::default(), shown)
        }
    };
    observe(Event::begins(Stage::Saving));
    let comments = comments_of_moved(drawn, left);
    ply::write_ply(&options.output, &splats, added, &comments)?;
    Ok(Exported {
        splats: splats.len(),
        offset: left.to_array(),
        shown,
    })
}

/// How far apart 32-bit floats are at a coordinate.
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
