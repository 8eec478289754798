//! `gs-chroma merge`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, next, print, progress::Progress, values::folder};
use crate::run::{MergeOptions, SeamViews, ViewMean, merge};

/// Put the trained blocks of a job together, and measure the whole.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma merge job -o runs/city
  gs-chroma colorize runs/city --teacher ddcolor-tiny")]
pub struct Merge {
    /// Job folder of `partition` with trained blocks.
    job: PathBuf,
    /// Run folder to write [default: runs/<name of the job folder>].
    #[arg(short, long, value_name = "RUN", value_parser = folder())]
    output: Option<PathBuf>,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

impl Merge {
    pub(super) fn run(self) -> Result<(), CliError> {
        let options = MergeOptions {
            job: self.job,
            output: self.output,
        };
        let mut progress = Progress::through(options.stages());
        let (folder, report, seams) = merge(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if self.json {
            return print(report.to_json());
        }
        print(report.luma_summary())?;
        print(in_words(&seams))?;
        let wrote = [folder.luma(), folder.contact_sheet()];
        let wrote = wrote.each_ref().map(PathBuf::as_path);
        progress.close_with(folder.path(), &wrote, &next::colorize(folder.path()))
    }
}

/// Views that show a border, and others.
fn in_words(views: &SeamViews) -> String {
    let of = |mean: &ViewMean| match mean.psnr {
        Some(psnr) => format!("{psnr:.1} dB ({} views)", mean.views),
        None => "no view".to_owned(),
    };
    format!(
        "held-out PSNR across borders: {}; inside one block: {}",
        of(&views.across),
        of(&views.inside)
    )
}
