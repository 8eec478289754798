//! `gs-chroma seams`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, print, progress::Progress};
use crate::run::{PairMean, SeamColors, SeamViews, SeamsOptions, ViewMean, seams};

/// Measure whether a merged run shows the borders of its blocks: held-out views across them, and
/// colors on both sides.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma seams job runs/city")]
pub struct SeamsCommand {
    /// Job folder of `partition`.
    job: PathBuf,
    /// Run folder that `merge` has made of it.
    run: PathBuf,
    /// A run of the same photos that was never divided, to compare views with.
    #[arg(long, value_name = "RUN")]
    against: Option<PathBuf>,
    /// Print the figures as JSON.
    #[arg(long)]
    json: bool,
}

impl SeamsCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        let options = SeamsOptions {
            job: self.job,
            run: self.run,
            against: self.against,
        };
        let mut progress = Progress::default();
        let found = seams(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if self.json {
            return print(format_args!("{:#}", serde_json::json!(found)));
        }
        print(in_words(&found.views))?;
        match &found.colors {
            Some(colors) => print(of_colors(colors)),
            None => print("not colored yet"),
        }
    }
}

/// Views that show a border, and others.
pub(super) fn in_words(views: &SeamViews) -> String {
    let of = |mean: &ViewMean| {
        let psnr = mean
            .psnr
            .map_or(String::new(), |psnr| format!(", {psnr:.2} dB"));
        let gain = (mean.gain).map_or(String::new(), |gain| format!(" ({gain:+.2} dB)"));
        format!("{}{psnr}{gain}", mean.views)
    };
    format!(
        "held-out views across borders: {}; inside one block: {}",
        of(&views.across),
        of(&views.inside)
    )
}

fn of_colors(colors: &SeamColors) -> String {
    let of = |mean: &PairMean| match (mean.delta_e, mean.hue) {
        (Some(delta_e), Some(hue)) => {
            format!("{delta_e:.2} (hue alone {hue:.2}, {} pairs)", mean.pairs)
        }
        _ => "none".to_owned(),
    };
    format!(
        "mean ΔE00 of neighboring Gaussians across borders: {}; beside them: {}; elsewhere: {}",
        of(&colors.across),
        of(&colors.beside),
        of(&colors.inside)
    )
}
