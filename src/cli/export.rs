//! `gs-chroma export`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, next, print, progress::Progress};
use crate::run::{Event, ExportOptions, Stage, export};

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
}

impl Export {
    pub(super) fn run(self) -> Result<(), CliError> {
        let options = ExportOptions {
            run: self.run,
            output: self.output,
            luma: self.luma,
            colmap_coordinates: self.colmap_coordinates,
        };
        let mut progress = Progress::through(vec![Stage::Saving]);
        progress.show(&Event::begins(Stage::Saving));
        let wrote = export(&options)?;
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
        progress.close(&[], &next::view(&options.output))
    }
}
