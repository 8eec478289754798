//! `gs-chroma export`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, next, print, progress::Progress, values::one_of};
use crate::{
    run::{ExportOptions, Shown, export},
    viewers::ViewerChoice,
};

const VIEWERS: &[(ViewerChoice, &str)] = &[
    (ViewerChoice::Spark, "Spark"),
    (ViewerChoice::PlayCanvas, "PlayCanvas and SuperSplat"),
    (ViewerChoice::Any, "The compromise of all"),
];

/// Write a run's scene as a splat file, near the origin where COLMAP's coordinates are large.
#[derive(Args)]
pub struct Export {
    /// Run folder [default: newest under runs/].
    run: Option<PathBuf>,
    /// Splat file to write.
    #[arg(short, long, value_name = "FILE.ply")]
    output: PathBuf,
    /// Write the luminance although the scene is colored.
    #[arg(long)]
    luma: bool,
    /// Write COLMAP's coordinates even where the scene was moved to the origin.
    #[arg(long)]
    colmap_coordinates: bool,
    /// Fit scales, opacities and colors to what this viewer draws.
    #[arg(long, value_parser = one_of(VIEWERS))]
    viewer: Option<ViewerChoice>,
    /// COLMAP folder with the cameras to fit before, when it is not where `fit` found it.
    #[arg(long, value_name = "COLMAP_DIR", requires = "viewer")]
    colmap: Option<PathBuf>,
}

impl Export {
    pub(super) fn run(self) -> Result<(), CliError> {
        let options = ExportOptions {
            run: self.run,
            output: self.output,
            luma: self.luma,
            colmap_coordinates: self.colmap_coordinates,
            viewer: self.viewer,
            colmap: self.colmap,
        };
        let mut progress = Progress::through(options.stages());
        let wrote = export(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        print(format_args!(
            "wrote {} Gaussians to {}",
            wrote.splats,
            options.output.display()
        ))?;
        if wrote.offset != [0.0; 3] {
            let [x, y, z] = wrote.offset;
            print(format_args!(
                "its coordinates are COLMAP's less {x} {y} {z}, as its header says (--colmap-coordinates for COLMAP's own)"
            ))?;
        }
        if !wrote.shown.is_empty() {
            print(line_of(&wrote.shown))?;
        }
        progress.close(&[], &next::view(&options.output))
    }
}

/// What each viewer shows, and would have shown.
fn line_of(shown: &[Shown]) -> String {
    let each = |of: fn(&Shown) -> f64| {
        let each = (shown.iter()).map(|s| format!("{} {:.1} dB", s.viewer.name(), of(s)));
        each.collect::<Vec<_>>().join(", ")
    };
    format!(
        "shown as by `gs-chroma render`: {} (unfitted: {})",
        each(|shown| shown.after),
        each(|shown| shown.before)
    )
}
