//! `gs-chroma export`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, next, print, progress::Progress};
use crate::{
    run::{Event, ExportOptions, Look, Stage, export},
    viewer::{is_html, write_html},
};

/// Write a run's scene as a splat file, near the origin where COLMAP's coordinates are large.
#[derive(Args)]
pub struct Export {
    /// Run folder [default: newest under runs/].
    run: Option<PathBuf>,
    /// Splat file to write, or a page that shows the scene in any browser (.html).
    #[arg(short, long, value_name = "FILE")]
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
        if is_html(&self.output) {
            return self.run_html();
        }
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

    /// The page with the scene in it.
    fn run_html(self) -> Result<(), CliError> {
        let mut progress = Progress::through(vec![Stage::Model, Stage::Rendering, Stage::Saving]);
        let look = Look::open(self.run.as_deref(), None, &mut |event| {
            progress.show(&event)
        })?;
        let observe = &mut |event| progress.show(&event);
        let wrote = write_html(&look, self.luma, &self.output, observe)?;
        progress.finish();
        print(format_args!(
            "wrote {} Gaussians to {}, {:.1} MB",
            wrote.splats,
            self.output.display(),
            wrote.bytes as f64 / 1e6
        ))?;
        progress.close(&[], &next::look(&self.output))
    }
}
