//! `gs-chroma info`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, info_page, next, print, progress::Progress};
use crate::{report::Report, run::info, store::RunFolder};

/// Describe a run, a splat file or a COLMAP folder.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma info house
  gs-chroma info runs/house --json")]
pub struct Info {
    /// Run folder, splat file or COLMAP folder.
    path: PathBuf,
    /// Print as JSON.
    #[arg(long)]
    json: bool,
}

impl Info {
    pub(super) fn run(self) -> Result<(), CliError> {
        let mut progress = Progress::default();
        let found = info(&self.path, &mut |event| progress.show(&event))?;
        if self.json {
            return print(format_args!("{found:#}"));
        }
        let path = &self.path;
        let (page, next) = match serde_json::from_value::<Report>(found.clone()) {
            Ok(report) => {
                let run = RunFolder::find(Some(path))?;
                let path = run.path();
                let next = match report.chroma.is_some() {
                    true => next::frames(path),
                    false => next::colorize(path),
                };
                (info_page::of_run(path, &report), next)
            }
            Err(_) => {
                let next = match found["kind"] == "COLMAP folder" {
                    true => next::fit(path),
                    false => next::view(path),
                };
                (info_page::of_found(path, &found), next)
            }
        };
        print(page.trim_end())?;
        progress.close(&[], &next)
    }
}
