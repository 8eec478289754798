//! `gs-chroma render`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, next, print, progress::Progress, values::one_of};
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
        let options = RenderOptions {
            run: self.run,
            colmap: self.colmap,
            views: self.views,
            luma: self.luma,
            output: self.output,
        };
        let mut progress = Progress::through(options.stages());
        let count = render(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        print(format_args!(
            "wrote {count} pictures to {}",
            options.output.display()
        ))?;
        let next = match &options.run {
            // What is drawn is a file already.
            Some(file) if options.colmap.is_some() && file.is_file() => next::view(file),
            run => next::export(run.as_deref()),
        };
        progress.close(&[], &next)
    }
}
