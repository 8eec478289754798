//! `gs-chroma render`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, print, progress::Progress, values::one_of};
use crate::run::{RenderOptions, Views, render};

const VIEWS: &[(Views, &str)] = &[
    (Views::Train, "Those trained on"),
    (Views::Test, "Those held out"),
    (Views::All, "All"),
];

/// Draw a scene from the photographed viewpoints, one PNG a view.
#[derive(Args)]
pub struct Render {
    /// Run folder, or a splat file with --colmap [default: newest under runs/].
    run: Option<PathBuf>,
    /// COLMAP folder with the cameras, when it is not where `fit` found it.
    #[arg(long, value_name = "COLMAP_DIR")]
    colmap: Option<PathBuf>,
    /// Which views [default: those held out, or all where none is].
    #[arg(long, value_parser = one_of(VIEWS))]
    views: Option<Views>,
    /// Draw luma.ply although color.ply is there.
    #[arg(long)]
    luma: bool,
    /// Folder to write the pictures to.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

impl Render {
    pub(super) fn run(self) -> Result<(), CliError> {
        let mut progress = Progress::default();
        let options = RenderOptions {
            run: self.run,
            colmap: self.colmap,
            views: self.views,
            luma: self.luma,
            output: self.output,
        };
        let count = render(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        print(format_args!(
            "wrote {count} pictures to {}",
            options.output.display()
        ))?;
        Ok(())
    }
}
